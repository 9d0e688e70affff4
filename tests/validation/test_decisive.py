"""Which setting of a cure matters: found by switching, kept as data, and stale data is noticed."""

import math

import pytest

from adapters.engine_folder import DECISIVE, belongs_of, cured_of, inside
from adapters.experiment import Cured
from adapters.registry import find, names, profile_of
from validation.settings import decisive
from validation.settings.decisive import (
    ALONE,
    COMPLETES,
    NEEDED,
    Decisive,
    Part,
    changes_of,
    measure,
    read,
    slots_of,
    smallest,
    write,
)

ENGINES = [name for name in names() if cured_of(name)]


def entry(*parts, engine="toy"):
    return Decisive(engine, "1.0", "default", "tuned", "impact", 2, ({"e": 0.5},), ("rebound_ratio",), 30.0, 0.1, parts)


def toy(enough):
    """Error over tolerance of subsets of changes of an engine that is cured by any of the sets in ``enough``."""
    return lambda subsets: [0.5 if any(each <= set(own) for each in enough) else 9.0 for own in subsets]


@pytest.mark.parametrize(
    ("enough", "kept"),
    [
        ([{"a", "c"}], {"a", "c"}),
        ([{"a", "b"}, {"a", "c"}], {"a", "c"}),
        ([{"a", "b", "c"}], {"a", "b", "c"}),
    ],
)
def test_decisive_settings_sufficient_and_minimal(enough, kept):
    names, badness = ["a", "b", "c", "d"], toy(enough)
    without = dict(zip(names, badness([[n for n in names if n != name] for name in names]), strict=True))
    found = smallest(names, without, badness)
    assert set(found) == kept
    assert badness([found]) == [0.5]
    assert badness([[n for n in found if n != name] for name in found]) == [9.0] * len(found)


@pytest.mark.parametrize(
    ("roles", "text"),
    [
        ({"a": ALONE, "b": ""}, "a"),
        ({"a": ALONE, "b": ALONE}, "a or b"),
        ({"a": NEEDED, "b": NEEDED, "c": ""}, "a and b"),
        ({"a": NEEDED, "b": COMPLETES, "c": COMPLETES}, "a with b and c"),
        ({"a": COMPLETES, "b": COMPLETES}, "a and b"),
        ({"a": NEEDED, "b": NEEDED, "c": NEEDED, "d": COMPLETES}, "a, b and c with d"),
    ],
)
def test_decisive_settings_in_words(roles, text):
    assert entry(*(Part(name, "1", 2.0, 2.0, role) for name, role in roles.items())).text == text


def test_a_list_is_read_back(tmp_path):
    path = tmp_path / "decisive.csv"
    mine = entry(Part("a", '"reflect"', 0.5, math.inf, ALONE), Part("b", "[0.9, 1.0]", 30.0, 0.1, ""))
    other = entry(Part("c", "null", 0.5, 2.0, ALONE), engine="another")
    write([mine, other], path)
    assert read(path) == [mine, other]
    write([other], path)
    assert read(path) == [other]


@pytest.mark.parametrize("engine", ENGINES)
def test_listed_cures_match_today_s_profiles(engine):
    if find(engine).engine is None:
        pytest.skip(f"{engine}: {find(engine).reason}")
    listed, targets = read(inside(engine, DECISIVE)), cured_of(engine)
    assert {e.engine for e in listed} == {engine}
    roles = {(profile_of(engine, "shipped"), profile_of(engine, "tuned"))}
    assert {(target.shipped, target.better) for target in targets} == roles
    assert [(e.scene, e.cells, e.metrics) for e in listed] == [(t.scene, t.cells, t.metrics) for t in targets] != []
    for own, target in zip(listed, targets, strict=True):
        every = [changes_of(slot, target.better) for slot in slots_of(engine, target)]
        expected = {name for changes in every for name in changes if belongs_of(engine).get(name) not in changes}
        said = {name: decisive.as_text([changes.get(name) for changes in every]) for name in expected}
        assert {part.setting: part.value for part in own.parts} == said, "crosscheck tune ENGINE --decisive"
        assert own.before > 1.0 >= own.after and own.settings
        for part in own.parts:
            assert (part.alone <= 1.0) == (part.decides == ALONE)
            assert part.without > 1.0 or part.decides != NEEDED


@pytest.mark.long
@pytest.mark.parametrize(("engine", "scene"), [("chipmunk", "stack"), ("bullet", "incline")])
def test_listed_cures_reproduced(engine, scene):
    if find(engine).engine is None:
        pytest.skip(f"{engine}: {find(engine).reason}")
    (target,) = [target for target in cured_of(engine) if target.scene == scene]
    (listed,) = [e for e in read(inside(engine, DECISIVE)) if e.scene == scene]
    found = measure(engine, target)
    assert found.text == listed.text
    assert {part.setting: part.decides for part in found.parts} == {part.setting: part.decides for part in listed.parts}


def test_no_cure_for_a_case_that_passes_as_shipped():
    pytest.importorskip("pymunk")
    with pytest.raises(ValueError, match="no fix"):
        measure("chipmunk", Cured("default", "tuned", "incline", ({},)))


def test_named_cures_measured_with_the_requested_workers(monkeypatch):
    engine = ENGINES[0]
    monkeypatch.setattr(decisive, "measure", lambda *asked: asked)
    assert decisive.measure_all(engine, 3) == [(engine, target, 3) for target in cured_of(engine)]
    assert decisive.measure_all(engine) == [(engine, target, 1) for target in cured_of(engine)]
