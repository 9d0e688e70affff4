"""Which slots a run has: profiles are chosen by what they are, not by how they are called."""

import ast
import warnings
from dataclasses import replace

import pytest

from adapters import registry
from adapters.engine import NOT_KNOWN
from adapters.isolation.foreign import Found
from adapters.plain import Notice
from adapters.scene import SceneError
from validation import identity
from validation.catalogue import CATALOGUE
from validation.cells import MOST_ITERATIONS, MOST_ULPS, Slot, slot_from_dict
from validation.findings import Findings, known_of
from validation.running import plan
from validation.running.plan import FULL_DT, Request, slots


@pytest.mark.parametrize("engine", [name for name in registry.names() if registry.find(name).engine is not None])
def test_full_suite_at_the_usual_step(engine):
    facts, dts = registry.facts(engine), {}
    for slot in slots(Request(["impact"], [engine], suite="full", dimensions=[max(facts.dimensions)])):
        dts.setdefault(slot.profile, set()).add(slot.dt)
    assert set(dts) == set(registry.find(engine).engine.profiles)
    for profile, steps in dts.items():
        shipped = facts.roles.get(profile) == "shipped"
        assert steps == {*FULL_DT, *([facts.customary_dt] if shipped else [])}, profile


@pytest.mark.parametrize("scene", ["bounce", "stack"])
def test_full_suite_of_all_variations_and_all_steps(scene):
    wanted = Request([scene], ["chipmunk"], suite="full")
    full, quick = set(slots(wanted)), set(slots(replace(wanted, suite="standard")))
    assert quick < full
    found = {}
    for slot in full:
        found.setdefault(replace(slot, dt=plan.QUICK_DT), set()).add(slot.dt)
    own = {slot for slot in full if slot.dt == plan.QUICK_DT}
    asked = {slot for slot in own if plan.is_standard(slot)}
    assert quick <= asked < own == set(found)
    for slot, steps in found.items():
        assert steps >= set(FULL_DT) if slot in asked else steps == {plan.QUICK_DT}, slot


def test_asked_steps_of_all_variations():
    found = slots(Request(["bounce"], ["chipmunk"], suite="full", dts=[1 / 60]))
    assert {slot.dt for slot in found} == {1 / 60}
    assert len({slot.params for slot in found}) == 64
    (_, *steps) = {slot.dt for slot in slots(Request(["bounce"], ["chipmunk"], suite="full", params={"e": 0.77}))}
    assert len(steps) >= 4
    found = slots(Request(["stack"], ["chipmunk"], suite="full", iterations=[7]))
    assert {slot.dt for slot in found} >= set(FULL_DT)


def test_moved_starts_at_the_quick_step_and_own_iterations():
    found = slots(Request(["stack"], ["chipmunk"], suite="full", floors=True))
    moved = [slot for slot in found if slot.ulp]
    assert {slot.iterations for slot in found} > {None}
    assert {(slot.iterations, slot.dt) for slot in moved} == {(None, plan.QUICK_DT)}
    for profile in {slot.profile for slot in found}:
        assert sorted(slot.ulp for slot in moved if slot.profile == profile and slot.dimension == 2) == [1, 2]


@pytest.mark.parametrize(("name", "profile"), [("chipmunk", "default"), ("reference", "classical")])
def test_rows_of_an_absent_engine_under_its_profile(monkeypatch, name, profile):
    monkeypatch.setattr(plan, "find", lambda engine: Found(engine, None, "", "nothing is called that"))
    assert {slot.profile for slot in slots(Request(["impact"], [name]))} == {profile}


def test_rows_of_an_unknown_engine(monkeypatch):
    monkeypatch.setattr(plan, "find", lambda engine: Found(engine, None, "", "nothing is called that"))
    monkeypatch.setattr(plan, "facts", lambda engine: None)
    assert {slot.profile for slot in slots(Request(["impact"], ["anything"]))} == {NOT_KNOWN}


def test_imports_of_any_depth_found_without_expressions():
    """The identity of a cell hangs on it: against a walk through every node of each source of ours."""
    deep = (
        b"def f():\n  try:\n    match 1:\n      case 1:\n        with x: import deep\n  except E: from . import other\n"
    )
    sources = [path.read_bytes() for name in ("adapters", "validation") for path in identity._sources(name)]
    assert len(sources) > 200 and set(identity._named(deep, "a.b")) == {"deep", "a.b", "a.b.other"}
    for source in (deep, *sources):
        found = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Import | ast.ImportFrom)]
        named = {alias.name for node in found if isinstance(node, ast.Import) for alias in node.names}
        named |= {name for node in found if isinstance(node, ast.ImportFrom) for name in _from(node, "a.b")}
        assert set(identity._named(source, "a.b")) == named


def _from(node, package):
    """Names that a `from` import may load; none beyond the top of the package."""
    parts = package.split(".")
    if node.level > len(parts):
        return []
    base = ".".join([*parts[: len(parts) - node.level + 1], *([node.module] if node.module else [])])
    base = base if node.level else node.module
    return [base, *(f"{base}.{alias.name}" for alias in node.names)]


@pytest.mark.parametrize(
    ("field", "most", "least"),
    [("iterations", MOST_ITERATIONS, 1), ("ulp", MOST_ULPS, -MOST_ULPS)],
)
def test_limits_of_a_slot(field, most, least):
    plain = Slot("impact", (), 2, "chipmunk", "default", 1 / 240).as_dict()
    for value in (least, most):
        assert getattr(slot_from_dict(plain | {field: value}), field) == value
    for value in (least - 1, most + 1, 1.5, "2"):
        with pytest.raises(SceneError, match=rf"^slot\.{field}: .* must be a whole number in \[{least}, {most}\]$"):
            slot_from_dict(plain | {field: value})


@pytest.mark.parametrize("name", CATALOGUE)
def test_quick_suite_as_a_part_of_the_standard_suite(name):
    canonical = CATALOGUE[name]
    asked, stated = {}, {}
    for suite in ("quick", "standard"):
        asked[suite] = {
            (canonical.minimal(each.params), count, dimension)
            for each in canonical.variations(suite)
            for count in each.iterations
            for dimension in canonical.dimensions
            if each.runs_in(dimension)
        }
        stated[suite] = {
            (dimension, check.metric.partition("[")[0])
            for params, _, dimension in asked[suite]
            for check in canonical.checks(canonical.scene(dimension, dict(params)), plan.QUICK_DT)
            if check.truth is not None
        }
    assert asked["quick"] <= asked["standard"]
    assert len({cell[:2] for cell in asked["quick"]}) <= 8
    assert stated["quick"] == stated["standard"]
    assert {canonical.minimal(canonical.representative)} <= {params for params, _, _ in asked["quick"]}


def test_step_of_the_standard_suite():
    quick, standard = (slots(Request(["impact"], ["chipmunk"], suite=suite)) for suite in ("quick", "standard"))
    assert set(quick) < set(standard)
    assert {slot.dt for slot in standard} == {plan.QUICK_DT} and all(map(plan.is_standard, standard))


def test_study_at_defaults_without_a_matching_variation(monkeypatch):
    """Its rows are those of the scene without parameters: a study that no family could name would stay new for ever."""
    canonical = CATALOGUE["incline"]
    others = tuple(v for v in canonical.variations("standard") if canonical.minimal(v.params))
    assert canonical.studies and others
    slot = Slot("incline", (), 2, "toy", "default", plan.QUICK_DT)
    for studies, standard in ((canonical.studies, True), ((), False)):
        monkeypatch.setattr(plan, "CATALOGUE", {"incline": replace(canonical, studies=studies, standard=others)})
        assert plan.is_standard(slot) is standard
        assert not plan.is_standard(replace(slot, iterations=3)) and not plan.is_standard(replace(slot, dt=1 / 60))


@pytest.mark.skipif(registry.find("mujoco").engine is None, reason="mujoco is not installed")
def test_quick_suite_cells_of_a_profile_without_a_rank():
    def asked(**more):
        found = slots(Request(["slide"], ["mujoco"], dimensions=[3], **more))
        cells = {}
        for slot in found:
            cells.setdefault(slot.profile, set()).add((slot.params, slot.iterations))
        return cells

    quick, named, standard = asked(), asked(profiles=["matched"]), asked(suite="standard")
    assert quick["matched"] == {(CATALOGUE["slide"].minimal(CATALOGUE["slide"].representative), None)}
    assert len(quick["tuned"]) > 1 and named == {"matched": quick["tuned"]}
    assert standard["matched"] == standard["tuned"]
    assert asked(params={"mu": 0.25})["matched"] == {((("mu", 0.25),), None)}


def test_scene_larger_than_an_engine_is_meant_for():
    """It is told before anything runs, and for this engine alone."""
    request = Request(["stack"], ["reference", "chipmunk"], params={"n": 100.0}, dimensions=[2])
    with pytest.warns(Notice) as said:
        assert slots(request)
    told = "reference is meant for 100 bodies: a case of stack with 101 may take minutes"
    assert {str(each.message) for each in said} == {told}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert slots(replace(request, params={"n": 99.0}))


def test_scene_that_an_engine_s_suites_leave_out(monkeypatch, tmp_path):
    """Among others it has no case, and a row of it has no regression status; alone it runs."""
    (tmp_path / plan.LEFT_OUT).write_text('slide = "it shakes"')
    monkeypatch.setattr(plan, "inside", lambda engine, name: tmp_path / name if engine == "chipmunk" else None)
    plan.left_out.cache_clear()
    try:
        asked = {
            name: {slot.scene for slot in slots(Request(["slide", "impact"], [name]))}
            for name in ("chipmunk", "reference")
        }
        assert asked == {"chipmunk": {"impact"}, "reference": {"slide", "impact"}}
        alone = slots(Request(["slide"], ["chipmunk"]))
        assert alone and not any(map(plan.is_standard, alone))
        known = known_of(alone[0], "braking", "7.3", Findings("chipmunk", {}, (), {}))
        assert not known.expected and known.remark == "no suite runs this scene on chipmunk: it shakes"
    finally:
        plan.left_out.cache_clear()
