"""A run of ours that promises a solution and does not find it is never judged: its certificate makes it INVALID."""

from dataclasses import replace

import pytest

from reference_solver.exact import loop, world
from reference_solver.exact.bodies import world_of
from validation.catalogue import CATALOGUE
from validation.cells import Outcome, Slot
from validation.files.stated import instant_of
from validation.judging.rows import rows_of
from validation.questions.invariance import compare
from validation.running.execution import execute

COLUMN = Slot("stack", (("n", 10.0),), 2, "reference", "reference", 1 / 60)


def test_verdict_on_a_certified_run():
    observation = execute(COLUMN)
    assert observation.outcome is Outcome.OK and observation.certificate["certified"] is True


def test_bounce_rest_time_from_its_recorded_contacts():
    found = execute(Slot("bounce", (("e", 0.95),), 2, "reference", "reference", 1 / 240))
    assert found.outcome is Outcome.OK, found.certificate["reasons"]
    assert found.certificate["metric_errors"]["rest_time"] <= 1e-3
    assert (
        found.metrics["force_in_flight"] == (0.0, "") and found.certificate["metric_errors"]["force_in_flight"] == 0.0
    )
    assert {row.physics for row in rows_of("run", [found])} == {"pass"}


def test_verdict_on_an_uncertified_run(monkeypatch):
    """Bodies lighter by a thousandth than the scene says, as the loop of events has them."""

    def lighter(model):
        found = world_of(model)
        return replace(found, bodies=found.bodies._replace(inverse_mass=1.001 * found.bodies.inverse_mass))

    monkeypatch.setattr(world, "world_of", lighter)
    observation = execute(Slot("bounce", (("e", 0.5),), 2, "reference", "reference", 1 / 60))
    assert observation.outcome is Outcome.REFUSED
    assert "momentum" in observation.reason
    assert observation.metrics  # what it did is kept, to be looked at
    rows = rows_of("run", [observation])
    assert rows and all(row.physics is None and row.alarming for row in rows)


def test_reason_of_a_run_that_the_loop_refuses(monkeypatch):
    monkeypatch.setattr(loop, "MOST_PIECES", 3)
    observation = execute(Slot("bounce", (("e", 0.5),), 2, "reference", "reference", 1 / 60))
    assert observation.outcome is Outcome.REFUSED and observation.reason.startswith("more than 3 pieces of motion")
    rows = rows_of("run", [observation])
    assert rows and all(row.physics is None and row.alarming for row in rows)


@pytest.mark.parametrize("dimension", [2, pytest.param(3, marks=pytest.mark.long)])
def test_box_on_one_1e5_times_lighter(dimension):
    asked = {"ratio": 1e5}
    slot = Slot(
        "heavy_on_light", CATALOGUE["heavy_on_light"].minimal(asked), dimension, "reference", "reference", 1 / 240
    )
    found = execute(slot)
    assert found.outcome is Outcome.OK, found.certificate["reasons"]
    assert {row.physics for row in rows_of("run", [found])} == {"pass"}


@pytest.mark.parametrize("rate", [480, 960])
def test_certificate_far_from_the_origin_despite_round_off(rate):
    """A prescribed box pushes a column: friction ends all disturbances, and places are rounded."""
    found = execute(Slot("shove", (("angle", 45.0),), 2, "reference", "reference", 1 / rate))
    assert found.outcome is Outcome.OK, found.certificate["reasons"]


@pytest.mark.long
def test_certificate_of_eight_blocks_that_fall_off_each_other():
    asked = {"n": 8.0, "margin": -0.05, "duration": 1.5}
    slot = Slot("overhang", CATALOGUE["overhang"].minimal(asked), 2, "reference", "reference", 1 / 240)
    found = execute(slot)
    assert found.outcome is Outcome.OK, found.certificate["reasons"]


ICE = """
name = "ice to asphalt"
dimension = 2
gravity = [0.0, -9.81]
duration = {duration}
pairs = [{{ friction = 0.0 }}, {{ a = "asphalt", b = "box", friction = 0.5 }}]
[[bodies]]
name = "ice"
shape = {{ type = "box", half_extents = [2.0, 0.5] }}
motion = "fixed"
pose = [-2.0, -0.5, 0.0]
[[bodies]]
name = "asphalt"
shape = {{ type = "box", half_extents = [2.0, 0.5] }}
motion = "fixed"
pose = [2.0, -0.5, 0.0]
[[bodies]]
name = "box"
shape = {{ type = "box", half_extents = [0.5, 0.1] }}
mass = 1.0
pose = [{x}, 0.1, 0.0]
twist = [3.0, 0.0, 0.0]
[[checks]]
quantity = "box.x"
at = 0.05
value = "{x} + 3 * t"
tolerance = 1e-6
[[checks]]
quantity = "box.x"
value = "{x} + 3 * t"
tolerance = 0.8
"""


def on_ice(tmp_path, x, duration):
    """Return the verdict of each row: a box, .5 m wide each way, slides from ``x`` [m] on to asphalt at x > 0."""
    path = tmp_path / "ice.toml"
    path.write_text(ICE.format(x=x, duration=duration))
    rows = rows_of("run", [execute(Slot(str(path), (), 2, "reference", "reference", 1 / 240))])
    return {row.metric: (row.physics, row.reason) for row in rows}


@pytest.mark.parametrize(("x", "duration"), [(-0.7, 0.5), (-0.8, 0.2)])
def test_undetermined_motion_judged_before_the_branch_and_by_invariants(tmp_path, x, duration):
    """While the box is on both, each may carry all of it or nothing: it ends anywhere within decimetres."""
    found = on_ice(tmp_path, x, duration)
    assert [found[metric][0] for metric in ("energy_growth", "penetration", "at[0.05 s][box.x]")] == ["pass"] * 3
    physics, why = found["final[box.x]"]
    assert physics is None and why.startswith("the motion is not determined: bodies 0, 1 and 2 can share")


@pytest.mark.parametrize(
    ("metric", "at"),
    [("at[0.05 s][box.x]", 0.05), ("at[1e-05 s][a.b.omega]", 1e-5), ("final[box.x]", None), ("energy_growth", None),
     ("at[0.5 s][box.fx]", None), ("at[0.5 s][floor/box.fz]", None), ("least at[0.5 s][box.fz]", None)],
)  # fmt: skip
def test_instant_of_a_metric_by_its_name(metric, at):
    assert instant_of(metric) == at


def test_motion_judged_in_full_before_the_ambiguity(tmp_path):
    assert {physics for physics, _ in on_ice(tmp_path, -0.7, 0.06).values()} == {"pass", None}
    assert on_ice(tmp_path, -0.7, 0.06)["final[box.x]"] == ("pass", "")


def test_values_after_an_ambiguous_load_not_judged(tmp_path, monkeypatch):
    monkeypatch.setitem(globals(), "ICE", ICE.replace("at = 0.05", "at = 0.15"))
    found = on_ice(tmp_path, -0.7, 0.5)
    assert found["at[0.15 s][box.x]"][0] is None and found["energy_growth"][0] == "pass"


DOOR = """
name = "a puck on a door that swings"
dimension = {dimension}
gravity = {none}
duration = 1.0
pairs = [{{ restitution = 0.0, friction = 0.0 }}]
[[bodies]]
name = "door"
shape = {{ type = "half_space", normal = {normal} }}
motion = "prescribed"
twist = {swing}
[[bodies]]
name = "puck"
shape = {{ type = "{shape}", radius = 0.1 }}
mass = 2.0
pose = {pose}
twist = {twist}
[[checks]]
quantity = "puck.x"
value = "(0.75 * exp(1) + 0.25 * exp(-1)) * cos(1) - 0.1 * sin(1)"
tolerance = 1e-9
[[checks]]
quantity = "puck.{up}"
value = "(0.75 * exp(1) + 0.25 * exp(-1)) * sin(1) + 0.1 * cos(1)"
tolerance = 1e-9
"""
PLANAR = {
    "dimension": 2, "none": [0.0] * 2, "normal": [0.0, 1.0], "swing": [0.0, 0.0, 1.0], "shape": "disc",
    "pose": [1.0, 0.1, 0.0], "twist": [0.4, 1.0, 0.0], "up": "y",
}  # fmt: skip
SPATIAL = {
    "dimension": 3, "none": [0.0] * 3, "normal": [0.0, 0.0, 1.0], "swing": [0.0, 0.0, 0.0, 0.0, -1.0, 0.0],
    "shape": "sphere", "pose": [1.0, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0], "twist": [0.4, 0.0, 1.0, 0.0, 0.0, 0.0], "up": "z",
}  # fmt: skip


@pytest.mark.few(1)
@pytest.mark.parametrize("world", [PLANAR, SPATIAL], ids=["plane", "space"])
def test_puck_on_a_turning_face(tmp_path, world):
    """Without friction s'' = omega^2 s along the face: s = s0 cosh(omega t) + v0/omega sinh(omega t)."""
    path = tmp_path / "door.toml"
    path.write_text(DOOR.format(**world))
    slot = Slot(str(path), (), world["dimension"], "reference", "reference", 1 / 240)
    found = {row.metric: (row.physics, row.reason) for row in rows_of("run", [execute(slot)])}
    judged = {metric: said for metric, said in found.items() if said[0] is not None or said[1]}
    assert judged == dict.fromkeys(("penetration", "final[puck.x]", f"final[puck.{world['up']}]"), ("pass", ""))
    assert [change.refused for change in compare(slot, ["mirrored"]) if not change.holds or change.refused] == []
    (moved,) = compare(slot, ["moved"])
    assert moved.refused.startswith("a half-space that turns about the origin")
