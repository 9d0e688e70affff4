"""Blows of a plate that closes in and of a box on its edge: events and impulses anew, planted faults of three sizes."""

import math
from dataclasses import replace

import numpy as np
import pytest
from planted import carried, failing, made
from scipy.integrate import solve_ivp

from adapters.stepping import step_count
from adapters.trajectory import Trajectory
from validation.scenes.closing_wall import _turned_back

DT = 1 / 240
SIZES = (0.1, 0.01, 0.001)


# ---- a wall that closes in ----


def thrown(scene, dt=DT, e=1.0, moved=1.0, swept=False, gain=0.0):
    """A ball stepped to and fro: blows found where steps end, or (swept) at their times within them.

    ``moved`` is the share of the plate's speed that its blows know of, ``gain`` what each adds to a relative speed.
    """
    p, n = scene.params, step_count(scene.duration, dt) + 1
    pose = np.array([[b.pose for b in scene.bodies]] * n)
    twist = np.array([[b.twist for b in scene.bodies]] * n)
    x, v, plate, closing = p["radius"] + 0.5 * p["length"], p["v"], p["length"] + p["radius"], p["closing"]
    for k in range(n):
        pose[k, 2, 0], twist[k, 2, 0] = x, v
        pose[k, 1, 0] += -closing * k * dt
        left = dt
        while True:
            at = plate - closing * (k * dt + dt - left)
            reach = (at - x) / (v + closing) if v > -closing else math.inf
            wall = (p["radius"] - x) / v if v < 0.0 else math.inf
            if not swept or min(reach, wall) > left:
                break
            t = max(0.0, min(reach, wall))
            x, left = x + v * t, left - t
            v = -e * v if wall < reach else -e * (v + moved * closing) * (1.0 + gain) - moved * closing
        x += v * left
        if not swept:
            if v > -closing and x > plate - closing * (k + 1) * dt:
                v = -e * (v + moved * closing) * (1.0 + gain) - moved * closing
            elif v < 0.0 and x < p["radius"]:
                v = -e * v
    return Trajectory(np.arange(n) * dt, pose, twist, None, dt, "completed")


@pytest.mark.parametrize("swept", [False, True])
@pytest.mark.parametrize("dt", [1 / 60, DT, 1 / 960])
@pytest.mark.parametrize("closing", [0.05, 0.1, 0.25])
def test_blows_in_time_or_a_step_late(closing, dt, swept):
    canonical, scene = made("closing_wall", closing=closing)
    trajectory = thrown(scene, dt, swept=swept)
    assert failing(canonical, scene, trajectory) == set()
    if swept:
        truth = canonical.exact(scene)
        found = {metric: canonical.measure(scene, trajectory)[metric][0] for metric in truth}
        assert found == pytest.approx(truth, abs=1e-12)


def test_times_of_the_formula_against_integration():
    """x' = v between events that DOP853 finds; and (v - V) L is the same after each blow of the plate."""
    canonical, scene = made("closing_wall")
    p, truth = scene.params, canonical.exact(scene)
    t, x, v, kept = 0.0, 0.5 * p["length"], p["v"], []

    def plate(t, y):
        return y[0] - (p["length"] - p["closing"] * t)

    def wall(t, y):
        return y[0]

    for n in (1, 2, 3):
        for event, moved in ((plate, p["closing"]), (wall, 0.0)):
            event.terminal, event.direction = True, math.copysign(1.0, v)
            found = solve_ivp(lambda t, y, v=v: [v], (t, 99.0), [x], "DOP853", events=event, rtol=1e-13, atol=1e-13)
            t, x, v = found.t[-1], found.y[0, -1], -(v + moved) - moved if moved else -v
            if moved:
                assert (t, -v) == pytest.approx((truth[f"time[{n}]"], truth[f"speed[{n}]"]), rel=1e-9)
                kept.append((-v - p["closing"]) * x)
    assert kept == pytest.approx([kept[0]] * 3, rel=1e-9)


@pytest.mark.parametrize("size", SIZES)
def test_blows_that_ignore_the_plate_or_e(size):
    canonical, scene = made("closing_wall")
    speeds = {f"speed[{n}]" for n in (1, 2, 3)}
    assert speeds <= failing(canonical, scene, thrown(scene, swept=True, moved=1.0 - size))
    assert speeds <= failing(canonical, scene, thrown(scene, swept=True, e=1.0 - size))
    assert speeds <= failing(canonical, scene, thrown(scene, swept=True, gain=size))


def test_blow_times_with_and_without_a_rebound():
    canonical, scene = made("closing_wall")
    late = thrown(scene, swept=True)
    shifted = replace(late, t=late.t + 1.5 * DT)
    assert failing(canonical, scene, shifted) == {"time[1]"}
    assert {f"time[{n}]" for n in (1, 2, 3)} <= failing(canonical, scene, replace(late, t=late.t + 10.0 * DT))
    lost = thrown(scene)
    lost.twist[:, 2, 0] = 1.0
    assert canonical.measure(scene, lost)["time[1]"][0] is None


@pytest.mark.parametrize("place", range(2), ids=["place", "speed"])
def test_ball_missing_in_one_sample_has_no_turning_time(place):
    """Beside the blows it would pass: turns and speeds are looked for at other samples."""
    canonical, scene = made("closing_wall")
    found = thrown(scene, swept=True)
    (found.pose, found.twist)[place][3, 2, 0] = math.nan
    with pytest.raises(ArithmeticError, match="not a finite number"):
        canonical.measure(scene, found)


# ---- a box on its edge ----


def landed(scene, dt=DT, e=None, share=(0.5, 0.5), moment=1.0):
    """Impulses of the corners that hit, from the scene's own bodies by a 6 x 6 balance; ``share`` between the two."""
    p, d, (_, box) = scene.params, scene.dimension, scene.bodies
    e = p["e"] if e is None else e
    half = np.array(box.shape.half_extents)
    turn = box.pose[2] if d == 2 else -2.0 * math.atan2(box.pose[5], box.pose[3])
    c, s = math.cos(turn), math.sin(turn)
    corners = np.array([(x * half[0], z * half[-1]) for x in (-1, 1) for z in (-1, 1)])
    turned = np.column_stack([c * corners[:, 0] - s * corners[:, 1], s * corners[:, 0] + c * corners[:, 1]])
    x, _ = turned[np.argmin(turned[:, 1])]
    i = box.inertia if d == 2 else box.inertia[1]
    blow = (1.0 + e) * p["v"] / (1.0 / box.mass + x * x / (moment * i))
    n, after = step_count(scene.duration, dt) + 1, math.ceil(p["delay"] / dt)
    pose = np.array([[b.pose for b in scene.bodies]] * n)
    twist = np.array([[b.twist for b in scene.bodies]] * n)
    twist[after:, 1, d - 1] += blow / box.mass
    if d == 2:
        twist[after:, 1, 2] += x * blow / (moment * i)
    else:  # r x J of both corners, J upwards: torque (y J, -x J, 0) in world axes
        y = np.array([-half[1], half[1]])
        twist[after:, 1, 3] += (y @ share) * blow * c / box.inertia[0]
        twist[after:, 1, 4] += -x * blow / (moment * i)
    impulse = np.zeros((n, 1, d))
    impulse[after, 0, -1] = blow
    return Trajectory(np.arange(n) * dt, pose, twist, carried([(0, 1)], impulse), dt, "completed")


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("tilt", [20.0, 30.0, 44.0])
@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_blow_worked_out_at_the_scene_s_corner(e, tilt, dimension):
    canonical, scene = made("edge_drop", dimension, e=e, tilt=tilt)
    trajectory = landed(scene)
    assert failing(canonical, scene, trajectory) == set()
    # What leaves the edge: e times the approach, and the energy that e leaves of the part that meets.
    truth, p = canonical.exact(scene), scene.params
    arm = truth["spin"] * (scene.bodies[1].inertia if dimension == 2 else scene.bodies[1].inertia[1]) / truth["impulse"]
    assert truth["rise"] + truth["spin"] * arm == pytest.approx(e * p["v"], rel=1e-12)


@pytest.mark.parametrize("size", SIZES)
def test_blow_with_wrong_e_inertia_or_share(size):
    canonical, scene = made("edge_drop", 3)
    told = {"rise", "spin", "impulse"}
    assert failing(canonical, scene, landed(scene, e=0.5 * (1.0 - size))) == told
    assert failing(canonical, scene, landed(scene, moment=1.0 + size)) == told
    assert failing(canonical, scene, landed(scene, share=(0.5 + size, 0.5 - size))) == {"twisted"}
    pushed = landed(scene)
    pushed.twist[-1, 1, 1] = size
    assert failing(canonical, scene, pushed) == {"sideways"}


def test_refusal_of_a_box_that_lands_on_two_edges():
    with pytest.raises(ValueError, match=r"edge_drop\.tilt"):
        made("edge_drop", e=1.0, tilt=5.0)


@pytest.mark.parametrize(("meets", "told"), [(-0.3, 0.0), (0.0, 0.0), (0.4, 0.4), (1.0, 1.0), (1.7, 1.0)])
def test_turning_point_of_a_ball_within_its_two_samples(meets, told):
    """Ways x = t - meets and -(t - meets) cross at ``meets``; it is sampled at -1, 0, 1 and 2 s."""
    t = np.array([-1.0, 0.0, 1.0, 2.0])
    velocity = np.array([1.0, 1.0, -1.0, -1.0])
    assert _turned_back(t, velocity * (t - meets), velocity, 2) == pytest.approx(told, abs=1e-15)
