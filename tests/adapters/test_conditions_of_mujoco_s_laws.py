"""Where MuJoCo's laws speak: each condition by itself; what a law makes of paths that differ; paths as recordings."""

import math
from dataclasses import replace

import numpy as np
import pytest

from adapters.law.moved_starts import BLURRED, GAP_ROUND_OFF, PERTURBATIONS, SPREAD_FACTOR, SUM_ROUND_OFF, scale_of
from adapters.mujoco import ball_on_face, blows, motions, predictions, profiles
from adapters.mujoco.predictions import EITHER, ENOUGH
from adapters.needs import needs
from adapters.scene import Body, Box, Disc, HalfSpace, Pair, Scene, Sphere

DT = 1 / 64


def scene_of(dimension, shape, twist=None, up=0.5, **changes):
    """One body over a level floor, at rest unless told otherwise."""
    spins = 1 if dimension == 2 else 3
    turn = (0.0,) if dimension == 2 else (1.0, 0.0, 0.0, 0.0)
    level = (0.0,) * (dimension - 1)
    inertia = 0.1 if dimension == 2 else (0.1,) * 3
    floor = Body("floor", HalfSpace((*level, 1.0)), motion="fixed")
    body = Body("body", shape, 2.0, inertia, (*level, up, *turn), twist or (0.0,) * (dimension + spins))
    pairs = (Pair("floor", "body", 0.0, 0.25), Pair(restitution=0.5, friction=0.75))
    return replace(Scene("own", 1, dimension, (floor, body), pairs, (*level, -9.81), 1.0), **changes)


def ball_of(dimension):
    return Disc(0.5) if dimension == 2 else Sphere(0.5)


def box_of(dimension):
    return Box((0.5,) * dimension)


def spoilt(scene, **changes):
    """The scene with its free body changed."""
    return replace(scene, bodies=(scene.bodies[0], replace(scene.bodies[1], **changes)))


def units(length):
    return [tuple(0.25 * (k == i) for k in range(length)) for i in range(length)]


# ---- conditions ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dimension", [2, 3])
def test_vertical_motion_condition_over_a_level_floor(dimension):
    scene = scene_of(dimension, ball_of(dimension))
    d, body = dimension, scene.bodies[1]
    assert motions.is_vertical(scene)
    assert motions.is_vertical(spoilt(scene, twist=tuple(-1.0 * (k == d - 1) for k in range(len(body.twist)))))
    others = [spoilt(scene, twist=twist) for k, twist in enumerate(units(len(body.twist))) if k != d - 1]
    others += [spoilt(scene, pose=(*place, *body.pose[d - 1 :])) for place in units(d - 1)]
    others += [spoilt(scene, force=force) for force in units(d)]
    others += [spoilt(scene, torque=torque) for torque in units(len(body.twist) - d)]
    others += [replace(scene, gravity=(*side, -9.81)) for side in units(d - 1)]
    turned = (0.1,) if d == 2 else (math.cos(0.1), math.sin(0.1), 0.0, 0.0)
    others += [spoilt(scene, pose=(*body.pose[:d], *turned)), spoilt(scene, motion="fixed")]
    level = (0.0,) * (d - 2)
    for shape in (HalfSpace((*level, 0.6, 0.8)), HalfSpace((*level, 0.0, 1.0), 0.125), box_of(d)):
        others.append(replace(scene, bodies=(replace(scene.bodies[0], shape=shape), body)))
    assert [motions.is_vertical(each) for each in others] == [False] * len(others)


@pytest.mark.parametrize("dimension", [2, 3])
def test_planar_box_problem_only_when_pulled_along_x(dimension):
    scene, d = scene_of(dimension, box_of(dimension)), dimension
    body = scene.bodies[1]

    def asked(scene):
        return predictions.box_on_face("default", scene, DT)

    assert asked(scene) is not None
    along = spoilt(scene, force=(0.5, *(0.0,) * (d - 2), -1.0), twist=(0.5, *(0.0,) * (len(body.twist) - 1)))
    assert asked(replace(along, gravity=(1.0, *along.gravity[1:]))) is not None
    others = [spoilt(scene, twist=twist) for twist in units(len(body.twist))[d:]]
    others += [spoilt(scene, torque=torque) for torque in units(len(body.twist) - d)]
    if d == 3:
        others += [spoilt(scene, force=(0.0, 0.5, 0.0)), replace(scene, gravity=(0.0, 0.5, -9.81))]
    others += [spoilt(scene, shape=ball_of(d)), replace(scene, bodies=(*scene.bodies, replace(body, name="other")))]
    level = (0.0,) * (d - 2)
    for shape in (HalfSpace((*level, 0.6, 0.8)), box_of(d)):
        others.append(replace(scene, bodies=(replace(scene.bodies[0], shape=shape), body)))
    assert [asked(each) for each in others] == [None] * len(others)
    law = predictions.incline_law("default", "creep")
    assert law(scene, DT, None) is not None and law(along, DT, None) is None


@pytest.mark.parametrize("dimension", [2, 3])
def test_friction_of_the_pair_for_a_ball_on_a_face(dimension):
    scene, d = scene_of(dimension, ball_of(dimension)), dimension
    body = scene.bodies[1]
    found = ball_on_face._ball_on_face("tuned", replace(scene, gravity=(0.5, *scene.gravity[1:])), DT)
    assert found.mu == 0.25 and found.half_height == 0.5 and found.half_length == 0.0
    assert found.inertia == pytest.approx(0.05) and found.load == (0.5, -9.81) and found.share == 1.0
    for other in (
        replace(scene, bodies=(*scene.bodies, replace(body, name="other"))), spoilt(scene, shape=box_of(d)),
        replace(scene, bodies=(replace(scene.bodies[0], shape=box_of(d)), body)),
        replace(scene, pairs=(Pair("floor", "body", 0.0, 0.0), Pair(friction=0.75))),
    ):  # fmt: skip
        assert ball_on_face._ball_on_face("tuned", other, DT) is None


def test_matched_profile_without_contacts_equal_to_tuned(monkeypatch):
    asked = []
    monkeypatch.setattr(profiles, "tuned", lambda *given: (asked.append(given), ["tuned"])[1])
    free = replace(needs(scene_of(2, Disc(0.5))), regime="free")
    assert profiles.matched(free, DT) == ["tuned"] and asked == [(free, DT)]
    resting = profiles.matched(replace(free, regime="rest"), DT)
    assert len(asked) == 1 and len({setting.name for setting in resting}) == len(resting) > 10


# ---- what a law makes of paths ---------------------------------------------------------------------------------------


def ball_paths(monkeypatch, values):
    """`ball_metrics` gives these values, start by start."""
    left = list(values)
    monkeypatch.setattr(predictions, "ball_metrics", lambda *asked: {"rebound_speed": (left.pop(0),)})


def test_ball_band_grows_with_its_widest_path(monkeypatch):
    scene = replace(scene_of(3, Sphere(0.5)), params={"v": 4.0})
    law = predictions.ball_law("tuned", "rebound_speed")

    def said(*off):
        ball_paths(monkeypatch, (2.0, *(2.0 + each for each in (*off, *(0.0,) * (len(PERTURBATIONS) - len(off))))))
        return law(scene, DT, None)

    value, floor = said()
    assert value == 2.0 and floor == SUM_ROUND_OFF * 4.0
    edge = BLURRED * 4.0
    for off in ((0.25 * edge,), (-0.25 * edge,), (0.125 * edge, -0.25 * edge)):
        assert said(*off) == (2.0, pytest.approx(floor + SPREAD_FACTOR * 0.25 * edge, rel=1e-9))
    assert said(0.999 * edge) is not None and said(1.001 * edge) is None
    ball_paths(monkeypatch, (2.0, None, *(2.0,) * len(PERTURBATIONS)))
    assert law(scene, DT, None) is None
    assert law(spoilt(scene, force=(0.5, 0.0, 0.0)), DT, None) is None
    assert law(spoilt(scene, shape=Box((0.5,) * 3)), DT, None) is None
    for metric, more in (("impulse", True), ("momentum_defect", True), ("rebound_speed", False)):
        monkeypatch.setattr(predictions, "ball_metrics", lambda *asked: dict.fromkeys(
            ("impulse", "momentum_defect", "rebound_speed"), (2.0,)))  # fmt: skip
        _, band = predictions.ball_law("default", metric)(scene, DT, None)
        assert (band > 1.1 * SUM_ROUND_OFF * scale_of(scene, metric)) == more


def test_sizes_of_ball_measures():
    scene = replace(scene_of(3, Sphere(0.5)), params={"v": 4.0, "height": 3.0})
    sizes = {"apex[2]": 3.0, "rebound_speed": 4.0, "velocity_change": 4.0, "impulse": 8.0, "flight_time": 1.0}
    assert {name: scale_of(scene, name) for name in sizes} == sizes
    assert scale_of(replace(scene, params={}), "impulse") == 2.0


def test_column_prediction_between_touching_and_separate_faces(monkeypatch):
    scene = replace(scene_of(2, Box((0.5, 0.25)), up=0.25), duration=2.0)
    values = []
    monkeypatch.setattr(predictions, "column", lambda *asked: asked[-1])
    monkeypatch.setattr(predictions, "as_trajectory", lambda scene, dt, path: path)

    def said(metric, value, other, iterations=None):
        def measure(scene, path):
            values.append(path)
            return {metric: ((value if path == 0.0 else other),)}

        law = predictions.column_law if iterations is None else predictions.column_asked
        return law("default", metric)(scene, DT, measure, *([] if iterations is None else [iterations]))

    monkeypatch.setattr(predictions, "_trembles", lambda *asked: 0.0)
    value, band = said("sinking", 0.125, 0.125)
    assert value == 0.125 and 0.0 < band < 1e-4 and values == [0.0, GAP_ROUND_OFF]
    assert said("sinking", 0.125, 0.1) == (0.125, pytest.approx(band + 0.05))
    assert said("sinking", 0.1, 0.125)[1] == pytest.approx(band + 0.05, abs=0.2 * band)
    assert said("sinking", 0.125, 0.0625) is not None and said("sinking", 0.125, 0.0624) is None
    assert said("sinking", 0.25, 0.25) is not None and said("sinking", 0.2501, 0.2501) is None  # half of its height
    for given in ((None, 0.1), (0.1, None)):
        assert said("sinking", *given) is None
    assert said("settle_time", 0.5, 0.625) == (0.5, 0.25 + DT)
    monkeypatch.setattr(predictions, "_trembles", lambda *asked: math.inf)
    assert said("settle_time", 0.5, 0.625) == (1.25, 0.75 + 0.25 + DT)  # until the run's end
    assert said("sinking", 0.125, 0.125, ENOUGH) == (value, band) and said("sinking", 0.125, 0.125, ENOUGH - 1) is None
    scene = spoilt(scene, shape=Disc(0.25))
    assert said("sinking", 0.125, 0.125) is None


@pytest.mark.parametrize(("metric", "column"), [("creep", 0), ("acceleration", 1)])
def test_slide_told_over_its_second_half_until_blurred(monkeypatch, metric, column):
    scene, off = scene_of(2, Box((0.5, 0.25)), up=0.25), [0.0, 0.0, 0.0]
    starts = []

    def slide(box, steps, velocity):
        starts.append(velocity)
        rows = np.zeros((steps + 1, 2))
        rows[:, column] = (
            np.maximum(np.arange(steps + 1) - (steps + 1) // 2, 0) * DT * (1.0 + off[(len(starts) - 1) % 3])
        )
        return rows

    monkeypatch.setattr(predictions, "_slide", slide)

    def said(*given):
        off[:] = given
        return predictions.incline_law("default", metric)(scene, DT, None)

    value, floor = said(0.0, 0.0, 0.0)
    error = predictions.solver_error("default", scene, DT)
    assert value == pytest.approx(1.0) and starts[:3] == [0.0, error, -error]
    assert floor == pytest.approx(error if metric == "creep" else 2.0 * error / 0.5, rel=1e-3)
    edge = 9.81  # all of the load, in a second
    for least in (0.5 * BLURRED * edge, -0.5 * BLURRED * edge):
        told = said(0.0, 0.25 * least, least)
        assert told == (pytest.approx(1.0), pytest.approx(floor + SPREAD_FACTOR * abs(least), rel=1e-6))
    wide = 0.5 * (BLURRED + EITHER) * edge
    assert said(0.0, wide, 0.0)[1] == pytest.approx(floor + 2.0 * wide, rel=1e-6)
    assert said(0.0, 1.01 * EITHER * edge, 0.0) is None


# ---- paths as recordings ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dimension", [2, 3])
def test_record_of_a_column_against_the_step_loop(dimension):
    scene, d = scene_of(dimension, ball_of(dimension)), dimension
    rows = np.array([[[0.5], [0.0], [0.0]], [[0.375], [-8.0], [0.0]], [[0.25], [-8.0], [3.0]]])
    found = motions.as_trajectory(scene, DT, rows)
    assert (found.dt, found.finish) == (DT, "completed") and list(found.t) == [0.0, DT, 2.0 * DT]
    assert found.pose[:, 1, d - 1] == pytest.approx([0.5, 0.375, 0.25])
    assert np.delete(found.pose[0, 1], d - 1) == pytest.approx(np.delete(scene.bodies[1].pose, d - 1))
    assert found.pose[:, 0] == pytest.approx(np.array([scene.bodies[0].pose] * 3))
    assert found.twist[:, 1, d - 1] == pytest.approx([0.0, -8.0, -8.0])
    assert not np.delete(found.twist, d - 1, axis=2).any() and not found.twist[:, 0].any()
    own = found.contacts.rows
    assert list(found.contacts.step) == [0, 1, 2] and list(found.contacts.offset) == [0, 1, 2, 3]
    assert list(own.a) == [0, 0, 0] and list(own.b) == [1, 1, 1] and own.gap.shape == (3,)
    assert own.impulse[:, -1] == pytest.approx([0.0, 0.0, 3.0]) and not own.impulse[:, :-1].any()
    for unknown in (own.point, own.normal, own.gap[:, None] * np.ones(d)):
        assert unknown.shape == (3, d) and np.isnan(unknown).all()


@pytest.mark.parametrize("heading", [(1.0,), (-1.0,), (0.6, 0.8), (0.0, -1.0)])
def test_planar_motion_along_a_heading_stays_upright(heading):
    d = len(heading) + 1
    scene = scene_of(d, box_of(d))
    motion = np.array([[[0.0, 0.5, 0.0], [2.0, 0.0, 0.0]], [[0.25, 0.75, 0.5], [1.0, -3.0, 0.125]]])
    found = motions.along_a_heading(scene, DT, np.array(heading), motion)
    assert (found.dt, found.finish, found.contacts) == (DT, "completed", None) and list(found.t) == [0.0, DT]
    assert found.pose[:, 1, : d - 1] == pytest.approx(np.outer([0.0, 0.25], heading))
    assert found.twist[:, 1, : d - 1] == pytest.approx(np.outer([2.0, 1.0], heading))
    assert found.pose[:, 1, d - 1] == pytest.approx([0.5, 0.75])
    assert found.twist[:, 1, d - 1] == pytest.approx([0.0, -3.0])
    assert found.pose[:, 0] == pytest.approx(np.array([scene.bodies[0].pose] * 2)) and not found.twist[:, 0].any()
    if d == 2:
        assert list(found.pose[:, 1, 2]) == [0.0, 0.5] and list(found.twist[:, 1, 2]) == [0.0, 0.125]
        return
    # What points along the heading turns towards the vertical.
    w, vector = found.pose[1, 1, 3], found.pose[1, 1, 4:]
    ahead = np.array([*heading, 0.0])
    turned = ahead + 2.0 * np.cross(vector, np.cross(vector, ahead) + w * ahead)
    assert turned == pytest.approx(math.cos(0.5) * ahead + math.sin(0.5) * np.array([0.0, 0.0, 1.0]))
    assert np.cross(found.twist[1, 1, 3:], ahead) == pytest.approx([0.0, 0.0, 0.125])
    assert found.pose[0, 1, 3:] == pytest.approx([1.0, 0.0, 0.0, 0.0])


@pytest.mark.parametrize("dimension", [2, 3])
def test_gap_between_two_balls(dimension):
    rest = (0.0,) * (dimension - 1), () if dimension == 2 else (0.0, 0.0)
    turn = (0.0,) if dimension == 2 else (1.0, 0.0, 0.0, 0.0)
    made = Disc if dimension == 2 else Sphere
    first, second = (
        Body(name, made(radius), mass, 0.1 if dimension == 2 else (0.1,) * 3, (x, *rest[0], *turn),
             (speed, *rest[0], 0.0, *rest[1]))
        for name, radius, mass, x, speed in (("first", 0.5, 2.0, -1.0, 3.0), ("second", 0.25, 4.0, 0.75, 1.0))
    )  # fmt: skip
    scene = Scene("own", 1, dimension, (first, second), (Pair(restitution=0.5),), (0.0,) * dimension, 1.0)
    found = blows.blow_of(scene)
    assert found is not None and (found.gap, found.closing) == (1.0, 2.0)
