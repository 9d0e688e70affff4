"""The panel of a fix: what it mends and breaks in cases of other groups."""

import csv
from dataclasses import replace

import pytest

from adapters.engine_folder import PANELS, inside
from adapters.registry import find, load, names, profile_of
from reports.fixes import panel_text, profile_costs, recorded_paste, recorded_text
from validation.canonical import Check
from validation.cells import Outcome, Slot
from validation.fixes import panel, search
from validation.fixes.kept import cures_of, panels_of
from validation.fixes.panel import OWN_SCENE, Cost, Panel, carried, compared, judged, other_cases
from validation.posed import pinned, resolve
from validation.settings.switching import Reading, observe, readings, switched

SLOT = Slot("pinch", (), 3, "mujoco", "default", 1 / 240)
#: MuJoCo's restitution without stiffness, as it was printed for `thin_wall`.
DAMPER = {"solref": "reflect", "kappa_elastic": 0.0, "kappa_plastic": 0.0}


def reading(value, metric="creep"):
    return Reading(SLOT, Check(metric, "m", 0.0, 1.0, "because", "source"), value, "")


@pytest.mark.parametrize(
    ("before", "after", "breaks", "mends"),
    [
        (0.4, 1.1, 1, 0), (2.0, 0.5, 0, 1), (2.0, 5.9, 0, 0), (2.0, 6.1, 1, 0), (0.4, 0.9, 0, 0), (0.5, None, 1, 0),
        (0.99, 1.01, 1, 0), (1.01, 0.99, 0, 1), (None, 0.5, 0, 1), (None, None, 0, 0),
    ],
)  # fmt: skip
def test_check_broken_or_mended_where_a_verdict_changes(before, after, breaks, mends):
    found = judged({("a grip", "creep"): [(reading(before), reading(after))]}, 1)
    assert (len(found.breaks), found.mends) == (breaks, mends)


def test_check_of_many_variants_counted_once():
    good, bad = (reading(2.0), reading(0.5)), (reading(0.5), reading(2.0))
    assert judged({(OWN_SCENE, "creep"): [good, good]}, 2).mends == 1
    found = judged({(OWN_SCENE, "creep"): [good, bad, bad]}, 3)
    assert found.mends == 0 and [each.case for each in found.breaks] == ["its own scene elsewhere"]


def test_fix_that_breaks_more_than_it_mends():
    cost = Cost("a body at rest", "penetration", "m", 1e-4, 0.041, 0.0)
    fix = next(each for each in cures_of("mujoco").values() if each.recommended)
    kept = replace(fix, panel=Panel(20, 1, (cost,)))
    assert not kept.withdrawn and "tried in 20 other cases: breaks a body at rest" in recorded_text(kept)
    assert "(penetration 1.0e-4 -> 0.041 m, true 0)" in recorded_text(kept)
    gone = replace(fix, panel=Panel(20, 1, (cost, cost)))
    assert gone.withdrawn and not gone.recommended and recorded_paste(gone) == ""
    assert "no fix: what was found breaks more elsewhere than it fixes" in recorded_text(gone)
    assert panel_text(Panel(20, 3, ())) == "tried in 20 other cases: breaks nothing"


def test_every_case_that_a_fix_breaks_named():
    """What a reader pastes it for may be the third: a stiffness of 0 lets whatever rests sink."""
    cases = ("a spinning rebound", "a slide at 45 degrees", "a bouncy body at rest", "a column of ten")
    text = panel_text(Panel(24, 9, tuple(Cost(case, "drift", "m", 0.0, 0.1, 0.0) for case in cases)))
    assert all(case in text for case in cases) and "more" not in text
    rest, column = (f"{case} (drift 0 -> 0.1 m, true 0)" for case in ("a bouncy body at rest", "a column of ten"))
    assert text.endswith(f"breaks {rest}, {column}, a spinning rebound, a slide at 45 degrees")


def test_formula_at_the_step_of_a_case():
    pytest.importorskip("mujoco")
    here = Slot("stack", (), 3, "mujoco", "default", 1 / 240)
    margin = {"margin": 0.001 * 9.81 / 240**2}
    assert carried(margin, here, replace(here, dt=1 / 60))["margin"] == pytest.approx(16.0 * margin["margin"])
    assert carried(margin, here, Slot("impact", (), 3, "mujoco", "default", 1 / 240))["margin"] == 0.0


def test_sinking_contact_without_stiffness():
    """A damper holds nothing: a body that rests on it sinks without end."""
    pytest.importorskip("mujoco")
    words, slot = next(each for each in other_cases("mujoco", "default") if each[0] == "a bouncy body at rest")
    found = compared([(words, slot, switched(slot, DAMPER))])
    assert "penetration" in {each.metric for each in found.breaks} and found.withdrawn


def test_panel_of_a_file_s_fix(tmp_path, monkeypatch):
    """It is pasted into a model that has more than this scene: a damper that mends its rebound lets a column sink."""
    pytest.importorskip("mujoco")
    bouncy = panel._FILES / "bouncy_box_at_rest.toml"
    (tmp_path / "own.toml").write_text(bouncy.read_text(encoding="utf-8").replace("bouncy box at rest", "own"))
    monkeypatch.setattr(panel, "compared", lambda asked, jobs: [words for words, *_ in asked])
    words = panel.tried(replace(SLOT, scene=pinned(str(tmp_path / "own.toml"))), DAMPER)
    assert {"a bouncy body at rest", "a bouncy column of five at 1/200 s", "a rebound"} <= set(words)


def test_settings_of_single_pairs_without_a_rebound():
    pytest.importorskip("mujoco")
    thrown, rest = Slot("thin_wall", (), 3, "mujoco", "default", 1 / 240), replace(SLOT, scene="long_rest")
    assert panel._meant({"cone": "elliptic", **DAMPER}, thrown, rest) == {"cone": "elliptic"}
    bouncy = replace(SLOT, scene=pinned(str(panel._FILES / "bouncy_box_at_rest.toml")))
    assert panel._meant(DAMPER, thrown, bouncy) == DAMPER


def test_short_cases_of_every_group():
    cases = other_cases("mujoco", "default")
    assert len({words for words, _ in cases}) == len(panel.OTHERS) == len(cases)
    assert all(resolve(slot.scene).scene(3, dict(slot.params)).duration <= 60.0 for _, slot in cases)
    planar = dict(other_cases("chipmunk", "default"))
    assert all(slot.dimension == 2 for slot in planar.values()) and "a slide at 45 degrees" not in planar


@pytest.mark.few(3)
@pytest.mark.parametrize("name", sorted(path.name for path in panel._FILES.glob("*.toml")))
def test_truths_of_the_panel_s_files(name):
    """All but that of a box that starts in the floor, which rigid bodies do not."""
    slot = Slot(pinned(str(panel._FILES / name)), (), 3, "reference", "reference", 1 / 240)
    (found,) = observe([slot]).values()
    if name == "box_in_the_floor.toml":
        assert found.outcome is Outcome.UNSUPPORTED
    else:
        assert found.outcome is Outcome.OK and all(each.badness <= 1.0 for each in readings(found))


#: A cube that slides at 6 m/s never turns, since mu < 1.
CUBE = """
name = "a fast cube"
dimension = 3
gravity = [0.0, 0.0, -9.81]
duration = 1.5
[[bodies]]
name = "floor"
shape = { type = "half_space", normal = [0.0, 0.0, 1.0] }
motion = "fixed"
[[bodies]]
name = "cube"
shape = { type = "box", half_extents = [0.05, 0.05, 0.05] }
mass = 1.0
pose = [0.0, 0.0, 0.05, 1.0, 0.0, 0.0, 0.0]
twist = [6.0, 0.0, 0.0, 0.0, 0.0, 0.0]
[[pairs]]
restitution = 0.0
friction = 0.5
[[checks]]
quantity = "cube.angle"
value = 0.0
tolerance = 0.02
because = "never tips"
"""


@pytest.mark.parametrize(("elsewhere", "mended"), [(lambda slot: (), True), (search.at_other_steps, False)])
def test_no_fix_for_a_chaotic_case_at_one_step(tmp_path, elsewhere, mended):
    """It hops on MuJoCo's pyramid: a margin changes the hops, and where the cube ends by chance."""
    pytest.importorskip("mujoco")
    (tmp_path / "cube.toml").write_text(CUBE)
    slot = Slot(pinned(str(tmp_path / "cube.toml")), (), 3, "mujoco", "default", 1 / 240)
    trials = search._Trials([slot], 1, elsewhere)
    (found,) = trials.all([[{"margin": 0.001 * 9.81 / 240**2}]])
    after = dict(zip((each.check.metric for each in trials.start), trials.badness(found.changes), strict=True))
    assert (after["final[cube.angle]"] <= 1.0) == mended


@pytest.mark.parametrize("engine", [name for name in names() if inside(name, PANELS)])
def test_committed_panels_for_installed_release_and_profiles(engine):
    with inside(engine, PANELS).open(encoding="utf-8", newline="") as lines:
        rows = list(csv.DictReader(lines))
    assert {row["version"] for row in rows} == {find(engine).version}
    assert set(panels_of(engine)) == {row["profile"] for row in rows} <= set(load(engine).profiles)


@pytest.mark.parametrize("engine", [name for name in names() if inside(name, PANELS)])
def test_committed_fixes_tried_in_all_cases_of_the_panel(engine):
    """A case that is newer than the table, or one that is gone, is noticed: `make cures`."""
    planned = {}
    for fix in cures_of(engine).values():
        if fix.changes:
            here = Slot(fix.scene, tuple(sorted(fix.params.items())), fix.dimension, engine, fix.shipped, fix.dt)
            planned[fix.scene, fix.dimension] = (len(panel.cases_of(here, fix.changes)), fix.panel and fix.panel.cases)
    assert planned and {key: both for key, both in planned.items() if both[0] != both[1]} == {}
    others = len(other_cases(engine, profile_of(engine, "shipped")))
    assert {found.cases for found in panels_of(engine).values()} == {others}


def test_text_of_what_a_tuned_profile_breaks():
    """Bullet's drops friction's points of a cube that is pushed, which as shipped goes as far as it should."""
    (line,) = [each for each in profile_costs([("bullet", "tuned"), ("bullet", "default")]) if "a push" in each]
    assert line.startswith("bullet/tuned, against the engine as shipped, tried in 21 other cases: breaks ")
