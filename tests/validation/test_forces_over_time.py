"""Forces over time that a scene file states, on contacts worked out by hand and on engines that slide a held hand."""

import math
from dataclasses import replace

import numpy as np
import pytest

from adapters.engine import Contacts
from adapters.needs import needs
from adapters.registry import load
from adapters.scene import Body, Box, Disc, HalfSpace, Pair, Scene
from adapters.stepping import run
from adapters.trajectory import ContactRecord, Sampling, Trajectory
from validation.files.quantities import quantity, unit
from validation.files.scene_files import canonical_from_text
from validation.metrics import NOT_RECORDED, SEVERAL, UNAVAILABLE, forces, over_time

DT, DURATION = 0.25, 4.0
FLOOR, BALL, TOP = range(3)
NOTHING = (0.0, 0.0)


def scene_of():
    bodies = (
        Body("floor", HalfSpace((0.0, 1.0)), motion="fixed"),
        Body("ball", Disc(0.5), 1.0, 1.0, (0.0, 0.5, 0.0)),
        Body("top", Disc(0.5), 1.0, 1.0, (0.0, 1.5, 0.0)),
    )
    return Scene("s", 1, 2, bodies, (Pair(),), (0.0, -8.0), DURATION)


def told(steps, height=0.5):
    """A record of 16 steps of 1/4 s: contacts (a, b, impulse on b, gap) of each, and the ball's height at each sample.

    The last second are the last four; what is before it is absurd unless a test says otherwise.
    """
    absurd = [[(FLOOR, BALL, (99.0, 99.0), 0.0)]] * (16 - len(steps))
    rows = [[(*row, 0.0)[:4] for row in step] for step in [*absurd, *steps]]
    flat = [(a, b, NOTHING, NOTHING, impulse, gap) for step in rows for a, b, impulse, gap in step]
    offset = np.cumsum([0, *(len(step) for step in rows)])
    pose = np.array([[body.pose for body in scene_of().bodies]] * 17)
    pose[:, BALL, 1] = height
    record = ContactRecord(np.arange(1, 17), offset, Contacts.from_rows(flat, 2))
    return Trajectory(np.arange(17) * DT, pose, np.zeros_like(pose), record, DT, "completed")


def of(trajectory, name, over=None, at=None):
    return quantity(scene_of(), trajectory, name, at, over)


#: Two contacts of the ball with the floor, one with what lies on it: 8 and 4 N s over 1/4 s in the mean.
STEPS = [
    [(FLOOR, BALL, (0.5, 0.25)), (FLOOR, BALL, (0.0, 0.5)), (BALL, TOP, (0.0, 0.25))],
    [(FLOOR, BALL, (0.5, 1.0)), (FLOOR, BALL, (0.0, 0.0)), (BALL, TOP, (0.0, 0.5))],
    [(FLOOR, BALL, (-0.5, 1.5)), (FLOOR, BALL, (0.0, 1.0)), (BALL, TOP, (0.0, 0.75))],
    [(FLOOR, BALL, (0.5, 2.0)), (FLOOR, BALL, (0.0, 0.75)), (BALL, TOP, (0.0, 1.5))],
]


@pytest.mark.parametrize(
    ("name", "steps"),
    [
        ("floor/ball.fy", (3.0, 4.0, 10.0, 11.0)),
        ("ball/floor.fy", (-3.0, -4.0, -10.0, -11.0)),
        ("floor/ball.fx", (2.0, 2.0, -2.0, 2.0)),
        ("ball.fy", (2.0, 2.0, 7.0, 5.0)),  # the floor pushes up, what lies on the ball pushes down
        ("top/ball.fy", (-1.0, -2.0, -3.0, -6.0)),
        ("floor/top.fy", (0.0, 0.0, 0.0, 0.0)),
    ],
)
def test_force_of_a_step_from_impulses_of_all_contacts(name, steps):
    trajectory = told(STEPS)
    mean = sum(steps) / 4
    spread = math.sqrt(sum((force - mean) ** 2 for force in steps) / 4)
    expected = {"mean": mean, "least": min(steps), "greatest": max(steps), "spread": spread}
    assert {over: of(trajectory, name, over) for over in expected} == {
        over: (pytest.approx(value), "") for over, value in expected.items()
    }
    assert of(trajectory, name) == of(trajectory, name, "mean") and unit(name) == "N"
    for k, force in enumerate(steps):  # steps 13 to 16, the first of which begins at 3 s
        for at in (3.0 + (k + 0.5) * DT, 3.0 + (k + 1) * DT):
            assert of(trajectory, name, at=at) == (pytest.approx(force), "")
    assert of(trajectory, "floor/ball.fy", at=0.0) == of(trajectory, "floor/ball.fy", at=DT) == (99.0 / DT, "")


def test_each_contact_and_their_number():
    trajectory = told(STEPS)
    single = {"mean": 3.5, "least": 0.0, "greatest": 8.0}  # of .25, .5, 1, 0, 1.5, 1, 2 and .75 N s
    found = {over: of(trajectory, "floor/ball.contact_fy", over)[0] for over in single}
    assert found == pytest.approx(single)
    assert of(trajectory, "ball.contact_fy", "least")[0] == -6.0  # from above
    assert of(trajectory, "top/ball.contact_fy", "greatest")[0] == -1.0
    assert of(trajectory, "floor/ball.contact_fx", "spread", 3.75)[0] == pytest.approx(1.0)  # -2 and 0 N
    assert of(trajectory, "floor/ball.contacts", "spread") == (0.0, "")
    assert [of(trajectory, f"{name}.contacts", "mean")[0] for name in ("floor/ball", "ball", "top")] == [2.0, 3.0, 1.0]
    assert of(trajectory, "floor/top.contacts", "greatest") == (0.0, "")
    assert of(trajectory, "floor/top.contact_fy", "least") == (None, "there is no contact with a known force")
    assert (unit("a/b.contact_fy"), unit("a/b.contacts"), unit("a/b.overlap_without_force")) == ("N", "1", "m")


def test_touching_and_pushing_contacts_without_near_ones():
    near, pushing = (FLOOR, BALL, NOTHING, 0.1), (FLOOR, BALL, (0.0, 0.1), 0.1)
    unknown = (FLOOR, BALL, NOTHING, math.nan)
    steps = [[near], [near, pushing], [(FLOOR, BALL, NOTHING, -0.1)] * 2, [unknown, near, (FLOOR, BALL, NOTHING, 0.0)]]
    trajectory = told(steps)
    counts = [of(trajectory, "floor/ball.contacts", at=3.0 + (k + 1) * DT)[0] for k in range(4)]
    assert counts == [0.0, 1.0, 2.0, 2.0]
    assert [of(trajectory, "floor/ball.contacts", over)[0] for over in ("least", "mean", "greatest")] == [
        0.0,
        1.25,
        2.0,
    ]


def test_overlap_without_force_at_both_ends_of_a_step():
    push = [(FLOOR, BALL, (0.0, 1.0))]
    height = np.full(17, 0.5)
    height[12:] = [0.5, 0.4, 0.375, 0.25, 0.45]  # overlaps of 0, .1, .125, .25 and .05 m at the ends of the last steps
    name = "floor/ball.overlap_without_force"
    found = told([[], [], push, [(FLOOR, BALL, NOTHING)]], height)
    assert [of(found, name, at=3.0 + (k + 1) * DT)[0] for k in range(4)] == pytest.approx([0.0, 0.1, 0.0, 0.05])
    assert of(found, name, "greatest")[0] == pytest.approx(0.1)
    assert of(found, "ball/floor.overlap_without_force", "greatest")[0] == pytest.approx(0.1)
    assert of(told([push] * 4, height), name, "greatest") == (0.0, "")
    # Where an engine does not tell a force, an overlap may be with one or without; where there is none, nobody asks.
    blank = [[(FLOOR, BALL, (math.nan, math.nan))]] * 4
    assert of(told(blank, height), name, "greatest") == (None, UNAVAILABLE)
    assert of(told(blank, np.full(17, 0.75)), name, "greatest") == (0.0, "")


def test_missing_force_of_an_engine_with_its_reason():
    blank = told([[(FLOOR, BALL, (math.nan, 1.0))]] * 4)
    for over in ("mean", "least", "greatest", "spread"):
        for name in ("floor/ball.fx", "ball.fx", "floor/ball.contact_fx"):
            assert of(blank, name, over) == (None, UNAVAILABLE)
        assert of(blank, "floor/ball.fy", over)[0] is not None
    assert of(blank, "floor/ball.contacts") == (1.0, "")
    none = replace(blank, contacts=None)
    for name in ("floor/ball.fy", "floor/ball.contacts", "floor/ball.contact_fy", "floor/ball.overlap_without_force"):
        assert of(none, name, "least") == (None, NOT_RECORDED)
    assert over_time("load", forces(none, BALL, [FLOOR])[:, 1], ("least",)) == {"load[least]": (None, NOT_RECORDED)}
    # A body is no partner of itself, and steps outside of the window are not told.
    assert forces(told(STEPS), BALL, [BALL, FLOOR], 3.0)[:, 1] == pytest.approx([3.0, 4.0, 10.0, 11.0])
    assert forces(told(STEPS), BALL, [FLOOR], 3.0, 3.5)[:, 1] == pytest.approx([3.0, 4.0])


HAND = """
name = "held hand"
dimension = 3
gravity = [0.0, 0.0, -9.81]
duration = 2.0
[[bodies]]
name = "table"
shape = { type = "half_space", normal = [0.0, 0.0, 1.0] }
motion = "fixed"
surface_velocity = [SPEED, 0.0, 0.0]
[[bodies]]
name = "stop"
shape = { type = "half_space", normal = [-1.0, 0.0, 0.0], offset = -0.1 }
motion = "fixed"
[[bodies]]
name = "hand"
shape = { type = "box", half_extents = [0.1, 0.1, 0.05] }
mass = 1.0
pose = [0.0, 0.0, 0.05, 1.0, 0.0, 0.0, 0.0]
[[pairs]]
restitution = 0.0
friction = 0.5
[[pairs]]
a = "stop"
b = "hand"
restitution = 0.0
friction = 0.0
[[checks]]
quantity = "table/hand.fz"
value = "g"
tolerance = "0.001 * g"
"""


@pytest.mark.parametrize("name", ["contacts", "contact_fy"])
def test_box_contacts_in_space_and_in_the_plane(name):
    """A corner in the plane is an edge in space, with a contact at both ends: neither number nor forces compare."""
    planar, lifted = told(STEPS), replace(told(STEPS), out_of_plane=0.0)
    scene = scene_of()
    for made, is_told in ((scene, True), (with_a_box(scene), False)):
        for record, plane in ((planar, True), (lifted, False)):
            value, why = quantity(made, record, f"floor/ball.{name}", None, "mean")
            assert (value is not None) == (is_told or plane) and (why == SEVERAL) == (value is None)
    for whole in ("floor/ball.fy", "floor/ball.overlap_without_force"):  # sums are those of the plane
        assert quantity(with_a_box(scene), lifted, whole, None, "mean")[0] is not None


def with_a_box(scene):
    box = replace(scene.bodies[BALL], shape=Box((0.5, 0.5)))
    return replace(scene, bodies=(scene.bodies[FLOOR], box, scene.bodies[TOP]))


def stated(tmp_path, text):
    return canonical_from_text(text, tmp_path / "hand.toml")


def ran(canonical, engine, profile, dt):
    pytest.importorskip({"mujoco": "mujoco", "bullet": "pybullet"}.get(engine, "numpy"))
    scene, engine = canonical.scene(3), load(engine)
    settings = {setting.name: setting.value for setting in engine.settings(profile, needs(scene), dt)}
    trajectory = run(engine, scene, dt, settings, canonical.sampling(scene))
    measured = canonical.measure(scene, trajectory)
    checks = [check for check in canonical.checks(scene, dt) if check.source.endswith("[[checks]]")]
    return {check.metric: (measured[check.metric][0], check) for check in checks}


def fails(found):
    return {metric for metric, (value, check) in found.items() if not abs(value - check.truth) <= check.bound}


@pytest.mark.few(8)
@pytest.mark.parametrize("speed", [0.1, 0.03, 0.5])
@pytest.mark.parametrize("dt", [1 / 60, 1 / 240, 0.002, 1 / 1000])
@pytest.mark.parametrize("profile", ["default", "tuned"])
def test_hand_with_flickering_force_fails_at_any_step(tmp_path, profile, dt, speed):
    """The mean alone is right to a thousandth at some of these, and the motion looks like rest."""
    found = ran(stated(tmp_path, HAND.replace("SPEED", str(speed))), "mujoco", profile, dt)
    name = "table/hand.fz"
    assert {f"{over}[{name}]" for over in ("least", "greatest", "spread")} <= fails(found)
    least, greatest, spread, mean = (found[f"{over}[{name}]"][0] for over in ("least", "greatest", "spread", "final"))
    assert least < 0.8 * 9.81 and greatest > 1.2 * 9.81 and spread > 0.1 * 9.81 and abs(mean - 9.81) < 0.15 * 9.81


@pytest.mark.parametrize(
    ("engine", "profile"), [("bullet", "default"), ("mujoco", "matched"), ("reference", "classical")]
)
def test_a_hand_that_is_pushed_steadily_passes(tmp_path, engine, profile):
    found = ran(stated(tmp_path, HAND.replace("SPEED", "0.1")), engine, profile, 1 / 240)
    assert fails(found) == set() and len(found) == 4


def test_check_of_a_mean_a_number_or_an_instant(tmp_path):
    text = HAND.replace("SPEED", "0.1")
    assert {check.metric: check.truth for check in stated(tmp_path, text).checks(stated(tmp_path, text).scene(3), 0.01)
            if check.source.endswith("[[checks]]")} == {
        "final[table/hand.fz]": 9.81, "least[table/hand.fz]": 9.81, "greatest[table/hand.fz]": 9.81,
        "spread[table/hand.fz]": 0.0,
    }  # fmt: skip
    for extra, metric in (
        ('over = "mean"', "final[table/hand.fz]"),
        ('over = "least"', "least[table/hand.fz]"),
        ('over = "spread"', "spread[table/hand.fz]"),
        ("at = 0.5", "at[0.5 s][table/hand.fz]"),
    ):
        canonical = stated(tmp_path, f"{text}{extra}\n")
        scene = canonical.scene(3)
        (check,) = (check for check in canonical.checks(scene, 0.01) if check.source.endswith("[[checks]]"))
        assert (check.metric, check.truth, check.unit) == (metric, 9.81, "N") and canonical.exact(scene)[metric] == 9.81
        # Contacts are recorded over the last second, or from the instant on.
        assert canonical.sampling(scene) == Sampling(1, 0.5 if "at" in extra else 1.0)
    single = text.replace("table/hand.fz", "table/hand.contact_fz") + "at = 0.5\n"
    metrics = {check.metric for check in stated(tmp_path, single).checks(scene, 0.01) if "contact_fz" in check.metric}
    name = "at[0.5 s][table/hand.contact_fz]"
    assert metrics == {name, f"least {name}", f"greatest {name}", f"spread {name}"}


def test_forces_recorded_only_where_requested(tmp_path):
    """What no check asks for costs nothing: contacts of the last second, and no earlier, as before."""
    text = HAND.replace("SPEED", "0.1").partition("[[checks]]")[0]
    canonical = stated(tmp_path, text)
    assert canonical.sampling(canonical.scene(3)) == Sampling(1, 1.0)
    early = 'quantity = "hand.vx"\nvalue = 0.0\ntolerance = 1.0\nat = 0.1\n'
    canonical = stated(tmp_path, f"{text}[[checks]]\n{early}")
    assert canonical.sampling(canonical.scene(3)) == Sampling(1, 1.0)
