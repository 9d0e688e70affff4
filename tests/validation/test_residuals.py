"""Residuals of reported contacts: nothing of exact ones, and each law is seen to break by the planted size."""

import math
import os
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from adapters.engine import Contacts
from adapters.scene import Body, Disc, HalfSpace, Pair, Scene, Sphere
from adapters.trajectory import ContactRecord, Trajectory
from validation.cells import Slot
from validation.questions import residuals as asked
from validation.questions.residuals import LAWS, Residuals, ask, measured, residuals
from validation.running.apart import Apart

DT, MASS, G, MU = 0.01, 2.0, 10.0, 0.5
WEIGHT = MASS * G * DT


def ball(vx, vy):
    return Body("ball", Disc(0.5), MASS, 0.25, (0.0, 0.5, 0.0), (vx, vy, 0.0))


def sliding(steps=5, speed=3.0, **changes):
    """A smooth-spinning ball held from turning would be unphysical: this one slides and spins up, exactly."""
    scene = Scene(
        "toy", 1, 2,
        (Body("floor", HalfSpace((0.0, 1.0), 0.0), motion="fixed"), ball(speed, 0.0)),
        (Pair(restitution=0.0, friction=MU),), (0.0, -G), steps * DT,
    )  # fmt: skip
    impulse = np.array([-MU * WEIGHT, WEIGHT]) + np.array(changes.pop("impulse", (0.0, 0.0)))
    t = np.arange(steps + 1) * DT
    pose, twist = np.zeros((steps + 1, 2, 3)), np.zeros((steps + 1, 2, 3))
    for k in range(steps + 1):
        twist[k, 1] = [speed - MU * G * t[k], 0.0, -0.5 * MU * WEIGHT / 0.25 * k]
        pose[k, 1] = [speed * t[k], 0.5, 0.0]
    twist[1:, 1, 1] += changes.pop("rise", 0.0)
    rows = Contacts.from_rows([(0, 1, (pose[k, 1, 0], 0.0), (0.0, 1.0), impulse, 0.0) for k in range(1, steps + 1)], 2)
    record = ContactRecord(np.arange(1, steps + 1), np.arange(steps + 1), rows)
    return scene, Trajectory(t, pose, twist, record, DT, "completed")


def values(found):
    return {name: value for name, (value, _) in found[0].items()}


def test_exact_contacts_have_no_residual():
    found = values(residuals(*sliding()))
    assert list(found) == list(LAWS)
    assert max(found.values()) < 1e-13


@pytest.mark.parametrize("size", [1e-6, 1e-3, 0.1])
@pytest.mark.parametrize(
    ("changes", "law", "share"),
    [
        ({"impulse": (-WEIGHT, 0.0)}, "cone", 1.0),
        ({"impulse": (0.0, WEIGHT)}, "momentum", 1.0),
        ({"rise": 1.0}, "separation", 1.0),
    ],
)
def test_a_planted_fault_is_seen_with_its_size(changes, law, share, size):
    planted = {name: tuple(size * v for v in value) if name == "impulse" else size for name, value in changes.items()}
    scene, found = sliding(**planted)
    told = values(residuals(scene, found))
    assert told[law] > 0.2 * share * size / 3.0
    assert told[law] < 5.0 * share * size


def test_pulling_contact_and_driving_friction():
    assert values(residuals(*sliding(impulse=(0.0, -1.5 * WEIGHT))))["pull"] == pytest.approx(1.0)
    driven = values(residuals(*sliding(impulse=(2.0 * MU * WEIGHT, 0.0))))
    assert driven["slip"] > 0.1 and driven["cone"] < 1e-12


def test_unreported_forces_with_a_reason_and_no_number():
    scene, found = sliding()
    silent = Trajectory(found.t, found.pose, found.twist, None, DT, "completed")
    assert residuals(scene, silent)[0]["pull"] == (None, "the engine reports no contacts")
    found.contacts.rows.impulse[0] = math.nan
    assert "does not report" in residuals(scene, found)[0]["cone"][1]


def test_newton_s_law_of_a_bounce_and_its_half():
    for back, wrong in ((1.5, 0.0), (0.9, 0.6 / 3.0)):
        scene = Scene(
            "toy", 1, 2,
            (Body("wall", HalfSpace((0.0, 1.0), 0.0), motion="fixed"), ball(0.0, -3.0)),
            (Pair(restitution=0.5),), (0.0, 0.0), DT,
        )  # fmt: skip
        twist = np.zeros((2, 2, 3))
        twist[:, 1, 1] = -3.0, back
        pose = np.zeros((2, 2, 3))
        pose[:, 1, 1] = 0.5
        rows = Contacts.from_rows([(0, 1, (0.0, 0.0), (0.0, 1.0), (0.0, MASS * (3.0 + back)), 0.0)], 2)
        found = Trajectory(
            np.array([0.0, DT]), pose, twist, ContactRecord(np.array([1]), np.array([0, 1]), rows), DT, "completed"
        )
        told = values(residuals(scene, found))
        assert told["separation"] == pytest.approx(wrong, abs=1e-12)
        assert told["momentum"] < 1e-12


def test_process_of_real_engines():
    pytest.importorskip("pymunk")
    with Apart() as apart:
        found = ask(Slot("pinch", (), 2, "chipmunk", "tuned", 1 / 240), apart)
        lost = apart.ask(os._exit, 3)
        again = ask(Slot("pinch", (), 2, "chipmunk", "tuned", 1 / 240), apart)
    assert found.contacts > 100 and found.values["cone"][0] < 1e-6
    assert lost == "the process ended with exit code 3" and again == found
    assert measured(Slot("impact", (), 3, "chipmunk", "tuned", 1 / 240)).refused


def touching(dimension, bodies, row, pairs, twists, gravity=None, dt=DT):
    """Bodies of these twists before and after one step at whose end one contact is reported."""
    scene = Scene("toy", 1, dimension, bodies, pairs, gravity or (0.0,) * dimension, dt)
    pose = np.array([[body.pose for body in scene.bodies]] * 2, float)
    record = ContactRecord(np.array([1]), np.array([0, 1]), Contacts.from_rows([row], dimension))
    return scene, Trajectory(np.array([0.0, dt]), pose, np.array(twists, float), record, dt, "completed")


def test_slip_of_a_ball_in_space():
    """3 m/s, less half a metre times 2 rad/s, are 2 m/s; a quarter of the load pushes that way, over g dt = 8 m/s."""
    flat, up = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
    floor = Body("floor", HalfSpace(up), motion="fixed")
    ball = Body(
        "ball", Sphere(0.5), 1.0, (0.1,) * 3, (0.0, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0), (3.0, 0.0, 0.0, 0.0, 2.0, 0.0)
    )
    twist = [[0.0] * 6, [3.0, 0.0, 0.0, 0.0, 2.0, 0.0]]
    row = (0, 1, flat, up, (0.25, 0.0, 1.0), 0.0)
    found = values(
        residuals(*touching(3, (floor, ball), row, (Pair(friction=0.5),), [twist] * 2, (0.0, 0.0, -80.0), 0.1))
    )
    assert found["slip"] == pytest.approx(0.25 * 2.0 / 8.0) and found["cone"] == found["separation"] == 0.0


def test_common_motion_without_slip_and_with_pair_friction():
    left, right = (Body(name, Disc(0.5), 1.0, 0.1, (x, 5.0, 0.0)) for name, x in (("left", 0.0), ("right", 1.0)))
    floor = Body("floor", HalfSpace((0.0, 1.0)), motion="fixed")
    pairs = (Pair("left", "right", 0.0, 0.25), Pair("floor", "*", 0.0, 0.0))
    twist = [[0.0] * 3, [0.0, 3.0, 0.0], [0.0, 3.0, 0.0]]
    row = (1, 2, (0.5, 5.0), (1.0, 0.0), (1.0, 0.25), 0.0)
    found = values(residuals(*touching(2, (floor, left, right), row, pairs, [twist] * 2, (0.0, -1.0))))
    assert (found["slip"], found["cone"], found["separation"]) == (0.0, 0.0, 0.0)


def test_residuals_of_a_box_on_a_belt():
    """2 m/s on a belt of 2 m/s; a force of 4 N takes it to 2.02 m/s in the step."""
    belt = Body("floor", HalfSpace((0.0, 1.0)), motion="fixed", surface_velocity=(2.0, 0.0))
    rider = Body("ball", Disc(0.5), MASS, 0.25, (0.0, 0.5, 0.0), (2.0, 0.0, 0.0), force=(4.0, 0.0))
    twists = [[[0.0] * 3, [2.0 - 0.01, 0.0, 0.0]], [[0.0] * 3, [2.0 + 0.01, 0.0, 0.0]]]
    row = (0, 1, (0.0, 0.0), (0.0, 1.0), (0.0, WEIGHT), 0.0)
    found = values(residuals(*touching(2, (belt, rider), row, (Pair(friction=MU),), twists, (0.0, -G))))
    assert found["slip"] == pytest.approx(0.0, abs=1e-12) and found["momentum"] == pytest.approx(0.0, abs=1e-12)


def test_missing_momentum_of_the_worst_step():
    told = values(residuals(*sliding(impulse=(0.0, 0.25 * WEIGHT))))
    assert told["momentum"] == pytest.approx(0.2)  # a quarter of the weight too much, over 5/4 of it, in every step


def nothing(reason):
    return dict.fromkeys(LAWS, (None, reason))


def test_reason_for_a_missing_residual_of_every_law():
    scene, found = sliding()
    assert residuals(scene, replace(found, contacts=None)) == (nothing("the engine reports no contacts"), 0)
    empty = ContactRecord(np.array([1]), np.array([0, 0]), Contacts.from_rows([], 2))
    assert residuals(scene, replace(found, contacts=empty)) == (nothing("nothing touched"), 0)
    found.contacts.rows.impulse[:] = 0.0
    assert residuals(scene, found) == (nothing("no contact carried a load"), 5)


class Silent:
    def ask(self, *asked):
        return "no answer: killed"


def test_refused_broken_and_lost_cells_told():
    slot = Slot("impact", (), 2, "chipmunk", "tuned", 1 / 240)
    assert ask(slot, Silent()) == Residuals(slot, nothing("no answer: killed"), 0, "no answer: killed")
    unknown = Slot("impact", (), 2, "nobody", "tuned", 1 / 240)
    lost = measured(unknown)
    assert "nobody" in lost.refused and lost == Residuals(unknown, nothing(lost.refused), 0, lost.refused)
    pytest.importorskip("pymunk")
    spatial = Slot("impact", (), 3, "chipmunk", "tuned", 1 / 240)
    refused = measured(spatial)
    assert "planar" in refused.refused and refused == Residuals(spatial, nothing(refused.refused), 0, refused.refused)
    two, three = (Slot("stack", (("n", n),), 2, "chipmunk", "tuned", 1 / 60) for n in (2.0, 3.0))
    assert measured(two).slot == two and measured(three).contacts > measured(two).contacts > 0


def test_slip_of_a_rolling_ball():
    rolling = Body("ball", Disc(0.5), MASS, 0.25, (0.0, 0.5, 0.0))
    floor = Body("floor", HalfSpace((0.0, 1.0)), motion="fixed")
    twists = [[[0.0] * 3, [2.0, 0.0, -4.0]]] * 2
    for push in (0.1 * WEIGHT, -0.1 * WEIGHT):
        row = (0, 1, (0.0, 0.0), (0.0, 1.0), (push, WEIGHT), 0.0)
        found = values(residuals(*touching(2, (floor, rolling), row, (Pair(friction=MU),), twists, (0.0, -G))))
        assert (found["slip"], found["separation"], found["cone"]) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("belt_last", [False, True])
def test_belt_friction_along_and_against_its_motion(belt_last):
    """At rest on a belt of 3 m/s the ball slips back by 3: friction forwards is right, backwards it drives."""
    belt = Body("belt", HalfSpace((0.0, 1.0)), motion="fixed", surface_velocity=(3.0, 0.0))
    still = Body("ball", Disc(0.5), MASS, 0.25, (0.0, 0.5, 0.0))
    bodies, side = ((still, belt), -1.0) if belt_last else ((belt, still), 1.0)
    for drag, drives in ((0.4, False), (-0.4, True)):
        # The impulse acts on the body with the higher index, and the normal points to it.
        row = (0, 1, (0.0, 0.0), (0.0, side), (side * drag * WEIGHT, side * WEIGHT), 0.0)
        found = residuals(*touching(2, bodies, row, (Pair(friction=MU),), [[[0.0] * 3] * 2] * 2, (0.0, -G)))
        # Nothing is faster than 3 m/s over the belt but what moves there is nothing: the speed told is one step's fall.
        assert values(found)["slip"] == pytest.approx(3.0 * 0.4 / (G * DT) if drives else 0.0)
        assert all(reason == "" for _, reason in found[0].values())


def test_friction_work_without_speed_and_of_separating_bodies():
    """Pressed together without gravity: no residual but of momentum; and a contact that parted before, and carries."""
    floor = Body("floor", HalfSpace((0.0, 1.0)), motion="fixed")
    still = Body("ball", Disc(0.5), MASS, 0.25, (0.0, 0.5, 0.0))
    row = (0, 1, (0.0, 0.0), (0.0, 1.0), (0.0, WEIGHT), 0.0)
    pairs = (Pair(restitution=0.8, friction=MU),)
    found = values(residuals(*touching(2, (floor, still), row, pairs, [[[0.0] * 3] * 2] * 2, (0.0, 0.0))))
    assert (found["separation"], found["slip"], found["momentum"]) == (0.0, 0.0, 1.0)
    parted = [[[0.0] * 3, [0.0, 0.5, 0.0]], [[0.0] * 3, [0.0, 0.0, 0.0]]]
    found = values(residuals(*touching(2, (floor, still), row, pairs, parted, (0.0, 0.0))))
    assert found["separation"] == 0.0


def test_residuals_of_a_refused_profile(monkeypatch):
    slot = Slot("impact", (), 2, "toy", "tuned", 1 / 240)
    refuses = {"tuned": "it has no such solver"}.get
    monkeypatch.setattr(
        asked, "load", lambda name: SimpleNamespace(refusal=lambda scene, profile, dt: refuses(profile))
    )
    monkeypatch.setattr(asked, "posed_for", lambda engine, scene: scene)
    said = "it has no such solver"
    assert measured(slot) == Residuals(slot, nothing(said), 0, said)


def test_contacts_recorded_from_the_first_step(monkeypatch):
    pytest.importorskip("pymunk")
    wanted, run = [], asked.run
    monkeypatch.setattr(asked, "run", lambda *given: wanted.append(given[-1]) or run(*given))
    for scene in ("stack", "long_rest"):
        assert measured(Slot(scene, (("duration", 2.0),), 2, "chipmunk", "tuned", 1 / 60)).refused == ""
    assert [(sampling.stride, sampling.contacts_from) for sampling in wanted] == [(1, 0.0)] * 2


@pytest.mark.filterwarnings("ignore:invalid value")
@pytest.mark.parametrize("part", ["point", "normal", "impulse"])
def test_contact_that_is_nan_has_no_share(part):
    """Contacts of other packages: infinite impulses are more than any share, a place that is none tells no slip."""
    scene, found = sliding()
    getattr(found.contacts.rows, part)[2, 0] = math.inf if part == "impulse" else math.nan
    told, count = residuals(scene, found)
    assert count == 5 and all(value is None or math.isfinite(value) for value, _ in told.values())
    without = {name for name, (value, _) in told.items() if value is None}
    assert {"point": {"slip"}, "normal": {"pull", "cone"}, "impulse": set(LAWS)}[part] <= without
    assert all("not a number" in why for value, why in told.values() if value is None)


def test_momentum_that_is_nan_not_passed_over():
    bodies = tuple(Body(name, Disc(0.5), 1.0, 0.1, (x, 0.0, 0.0)) for name, x in (("a", 0.0), ("b", 1.0), ("c", 5.0)))
    row = (0, 1, (0.5, 0.0), (1.0, 0.0), (0.3, 0.0), 0.0)
    scene, found = touching(2, bodies, row, (Pair(),), np.zeros((2, 3, 3)))
    assert residuals(scene, found)[0]["momentum"][0] == pytest.approx(1.0)
    found.twist[1, 2, 0] = math.nan  # of the last body: those before it miss a finite momentum
    assert residuals(scene, found)[0]["momentum"][0] is None
