"""Breaks of invariance as findings: known within their band, drifted outside it, new where nobody has listed them."""

import json

import pytest
from click.testing import CliRunner

from adapters.registry import names
from reports.command import main, posing
from validation.catalogue import CATALOGUE
from validation.cells import Slot
from validation.findings import FindingsError
from validation.judging.verdicts import Standing
from validation.questions import breaks
from validation.questions.breaks import BAND, breaks_of, decades_of, listed, read, standing_of, write
from validation.questions.invariance import RELATIONS, Change

DT = 1 / 240
FAMILY = """
[[family]]
id = "order"
profiles = ["default"]
scenes = ["head_on", "impact"]
relations = ["renumbered"]
reason = "contacts are solved in the order of the bodies"
source = "solver.c:12"
releases = ">=1,<2"
"""
BROKEN = Change("renumbered", "speed", 1e-3, 1e-9)


def slot(profile="default", scene="head_on", **more):
    params = tuple(CATALOGUE[scene].minimal(CATALOGUE[scene].representative))
    return Slot(scene, params, 2, "chipmunk", profile, DT, **more)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Findings of Chipmunk in a folder of their own."""
    (tmp_path / "breaks.toml").write_text(FAMILY)
    monkeypatch.setattr(breaks, "findings_folder", lambda engine: tmp_path)
    monkeypatch.setattr(posing, "findings_folder", lambda engine: tmp_path)
    breaks_of.cache_clear()
    yield tmp_path
    breaks_of.cache_clear()


def keep(folder, *found, version="1.5"):
    write(folder, listed("chipmunk", version, found))


def test_states_of_a_break(folder):
    assert standing_of(slot(), "1.5", BROKEN) == (Standing.NEW, "")
    keep(folder, (slot(), BROKEN))
    assert standing_of(slot(), "1.5", BROKEN) == (Standing.KNOWN, "contacts are solved in the order of the bodies")
    factor = 10.0**BAND
    for change, standing in (
        (Change("renumbered", "speed", 0.99e-3 * factor, 1e-9), Standing.KNOWN),
        (Change("renumbered", "speed", 1.02e-3 * factor, 1e-9), Standing.DRIFTED),
        (Change("renumbered", "speed", 0.98e-3 / factor, 1e-9), Standing.DRIFTED),
        (Change("renumbered", "spin", 1e-3, 1e-9), Standing.DRIFTED),
        (Change("renumbered", refused="it crashed", lost=True), Standing.DRIFTED),
        (Change("renumbered", "speed", 1e-10, 1e-9), Standing.DRIFTED),
        (Change("mirrored", "speed", 1e-3, 1e-9), Standing.NEW),
        (Change("boosted", refused="something is fixed"), None),
        (Change("moved", "speed", 0.0, 1e-9), None),
    ):
        found, why = standing_of(slot(), "1.5", change)
        assert found is standing, change
        assert bool(why) is (standing in (Standing.KNOWN, Standing.DRIFTED)), change  # only a list has a reason


def test_lost_answer_listed_as_such(folder):
    lost = Change("renumbered", refused="it crashed", lost=True)
    keep(folder, (slot(), lost))
    assert (folder / "breaks.csv").read_text().splitlines()[1] == "order,default,head_on,2,renumbered,,lost"
    assert standing_of(slot(), "1.5", lost)[0] is Standing.KNOWN
    assert standing_of(slot(), "1.5", BROKEN)[0] is Standing.DRIFTED


def test_scope_of_a_list_of_breaks(folder):
    keep(folder, (slot(), BROKEN), (slot("tuned"), BROKEN), (slot(iterations=7), BROKEN))
    assert len(breaks_of("chipmunk").members) == 1
    assert standing_of(slot(), "2.0", BROKEN)[0] is Standing.NEW
    assert standing_of(slot("tuned"), "1.5", BROKEN)[0] is Standing.NEW
    assert standing_of(slot(iterations=7), "1.5", BROKEN) == (None, "")  # only representative cells have a list


def test_restored_relation_removed_and_unasked_kept(folder):
    keep(folder, (slot(), BROKEN), (slot(scene="impact"), BROKEN))
    keep(folder, (slot(), Change("renumbered", "speed", 0.0, 1e-9)))
    assert [key[1] for key in breaks_of("chipmunk").members] == ["impact"]


def test_nothing_listed_for_the_solver_profile(tmp_path):
    (tmp_path / "breaks.toml").write_text(FAMILY.replace('"default"', '"reference"'))
    with pytest.raises(FindingsError, match="is an exact profile"):
        read("reference", tmp_path)
    (tmp_path / "breaks.toml").write_text(FAMILY.replace('"default"', '"*"'))
    with pytest.raises(FindingsError, match="is an exact profile"):
        read("reference", tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('reason = "contacts are solved in the order of the bodies"', "", "reason is missing"),
        ('["renumbered"]', '"renumbered"', "relations must be a list"),
        ('">=1,<2"', '"one"', "no version specifier"),
        (FAMILY, FAMILY + FAMILY, "is listed twice"),
        (
            'scenes = ["head_on", "impact"]\nrelations = ["renumbered"]',
            'scenes = ["*"]\nrelations = ["*"]',
            "name scenes or relations",
        ),
    ],
)
def test_files_that_are_wrong_are_named(tmp_path, old, new, said):
    (tmp_path / "breaks.toml").write_text(FAMILY.replace(old, new))
    with pytest.raises(FindingsError, match=said):
        read("chipmunk", tmp_path)


@pytest.mark.parametrize("line", ["order,default,head_on,2,renumbered,speed", "x,default,head_on,2,renumbered,speed,1",
                                  "order,default,head_on,two,renumbered,speed,1"])  # fmt: skip
def test_a_line_that_is_wrong_is_named(tmp_path, line):
    (tmp_path / "breaks.toml").write_text(FAMILY)
    (tmp_path / "breaks.csv").write_text(",".join(breaks.COLUMNS) + "\n" + line + "\n")
    with pytest.raises(FindingsError, match=r"breaks\.csv:2"):
        read("chipmunk", tmp_path)


def test_size_of_a_change_of_an_invariant():
    assert decades_of(Change("again", "count", 1.0, 0.0)) == pytest.approx(323.3, abs=0.1)


def test_invariance_status_of_new_drifted_and_known_breaks(folder, monkeypatch):
    pytest.importorskip("pymunk")
    answer = [Change("again", "speed", 0.0, 1e-9), BROKEN]
    monkeypatch.setattr(posing, "compare", lambda slot: answer)
    monkeypatch.setattr(posing, "find", lambda engine: type("Found", (), {"version": "1.5"}))
    call = ["run", "head_on", "--engine", "chipmunk", "--profile", "default", "--dim", "2", "--invariance"]

    def asked(*more):
        return CliRunner(env={"COLUMNS": "80"}).invoke(main, [*call, *more])

    first = asked()
    assert first.exit_code == 1 and "renumbered NEW (speed" in " ".join(first.stdout.split())
    assert asked("--keep").exit_code == 0
    known = asked()
    assert known.exit_code == 0 and "known: contacts are solved in the order of the bodies" in known.stdout
    (plain,) = json.loads(asked("--json").stdout)
    assert [(c["relation"], c["physics"], c["standing"]) for c in plain["changes"]] == [
        ("again", "pass", None), ("renumbered", "fail", "known")
    ]  # fmt: skip
    answer[1] = Change("renumbered", "speed", 0.0, 1e-9)
    mended = asked()
    assert mended.exit_code == 1 and "renumbered drifted" in " ".join(mended.stdout.split())
    refused = CliRunner().invoke(main, ["run", "head_on", "--keep"])
    assert refused.exit_code == 2 and "needs --invariance" in refused.stderr


@pytest.mark.parametrize("engine", [name for name in names() if breaks_of(name).families])
def test_scenes_and_relations_of_committed_breaks(engine):
    known, relations = breaks_of(engine), {relation.name for relation in RELATIONS}
    for family in known.families.values():
        assert {*family.relations} <= relations | {"*"} and {*family.scenes} <= {*CATALOGUE} | {"*"}
    assert known.members
    for (_, scene, dimension, relation), found in known.members.items():
        assert dimension in CATALOGUE[scene].dimensions and relation in relations
        assert found.decades is None or found.decades > 0.0
