"""Dominoes: falls integrated anew, the blow from equations of two bodies and their feet, planted faults of sizes."""

import math
from dataclasses import replace

import numpy as np
import pytest
from planted import failing, made, still
from scipy.integrate import solve_ivp

from adapters.scene import SceneError
from adapters.trajectory import Trajectory
from validation.scenes.domino import STRUCK

DT = 1 / 240
SIZES = [0.1, 0.01, 0.001]


def fall(p, g=None, heavy=1.0):
    """Right side of theta'' = torque over moment, of a box on its lower right edge, clockwise."""
    width, height = p["aspect"] * p["height"], p["height"]
    g, own = p["g"] if g is None else g, heavy * (width**2 + height**2) / 12.0

    def rates(t, y):
        x, z = centre(p, y[0])
        return [y[1], g * x / (own + x * x + z * z)]

    return rates


def centre(p, turn):
    """Centre of a domino against its foot (its lower right edge), turned clockwise."""
    width, height = p["aspect"] * p["height"], p["height"]
    return (
        -0.5 * width * np.cos(turn) + 0.5 * height * np.sin(turn),
        0.5 * width * np.sin(turn) + 0.5 * height * np.cos(turn),
    )


def blow(p, theta, spin, e=None):
    """Spins after the blow, and friction over pressure of both feet, from eleven equations.

    Two bodies, two feet that do not move, before or after, and the contact between; counter-clockwise inside.
    """
    width, height, nu = p["aspect"] * p["height"], p["height"], p["rub"]
    e = p["e"] if e is None else e
    own = (width**2 + height**2) / 12.0
    first, second = np.array(centre(p, theta)), np.array(centre(p, 0.0))
    meet = height * math.cos(theta)  # height at which they meet; the foot of the second is gap + width ahead
    before = np.array([spin * first[1], -spin * first[0], -spin, 0.0, 0.0, 0.0])
    masses = np.diag([1.0, 1.0, own, 1.0, 1.0, own])

    def point(body, arm, way):
        row = np.zeros(6)
        row[3 * body : 3 * body + 3] = way[0], way[1], arm[0] * way[1] - arm[1] * way[0]
        return row

    feet = [point(b, -c, way) for b, c in ((0, first), (1, second)) for way in ((1.0, 0.0), (0.0, 1.0))]
    corner = np.array([height * math.sin(theta), meet]) - first
    face = np.array([-width, meet]) - second
    normal = point(1, face, (1.0, 0.0)) - point(0, corner, (1.0, 0.0))
    rub = point(1, face, (0.0, -1.0)) - point(0, corner, (0.0, -1.0))
    rows = np.zeros((11, 11))
    rows[:6, :6] = masses
    for k, foot in enumerate(feet):
        rows[:6, 6 + k], rows[6 + k, :6] = -foot, foot
    rows[:6, 10], rows[10, :6] = -(normal + nu * rub), normal
    found = np.linalg.solve(rows, [*(masses @ before), 0.0, 0.0, 0.0, 0.0, -e * (normal @ before)])
    return (-found[2], -found[5]), (abs(found[6]) / found[7], abs(found[8]) / found[9])


def motion(scene, dt=DT, g=None, heavy=1.0, e=None, offset=0.0, late=0.0):
    """Falls by DOP853 and the blow from `blow`; ``offset`` and ``late`` in steps: step order, blow found late."""
    p = scene.params
    times = np.arange(round(scene.duration / dt) + 1) * dt
    width, height = p["aspect"] * p["height"], p["height"]
    rates = fall(p, g, heavy)
    options = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13, "dense_output": True}

    def met(t, y):
        return height * math.sin(y[0]) - p["gap"] * height

    met.terminal = True
    start = [0.0, -scene.bodies[1].twist[2]]
    if p["ratio"] < 1.0:
        met.terminal = False
    before = solve_ivp(rates, (0.0, times[-1] + dt), start, events=met, **options)
    turns, spins = np.zeros((2, len(times))), np.zeros((2, len(times)))
    if p["ratio"] > 1.0:
        turn, spin = before.y[:, -1] + late * dt * np.array([before.y[1, -1], 0.0])
        (first, second), _ = blow(p, turn, spin, e)
        since = before.t[-1] + late * dt
        ways = [solve_ivp(rates, (since, times[-1] + dt), y, **options) for y in ([turn, first], [0.0, second])]
        after = times > since
        for k, way in enumerate(ways):
            turns[k, after], spins[k, after] = way.sol(times[after])
        turns[0, ~after], spins[0, ~after] = before.sol(np.minimum(times[~after], before.t[-1]))
    else:
        turns[0], spins[0] = before.sol(times)
    turns = turns + offset * dt * spins
    n = len(times)
    pose, twist = still(scene, n)
    for k, foot in enumerate((0.0, p["gap"] * height + width)):
        x, z = centre(p, turns[k])
        pose[:, 1 + k] = np.column_stack([foot + x, z, -turns[k]])
        twist[:, 1 + k] = np.column_stack([z * spins[k], -x * spins[k], -spins[k]])
    return Trajectory(times, pose, twist, None, dt, "completed")


CELLS = [{}, {"ratio": 0.9}, {"ratio": 2.0}, {"ratio": 0.5}, {"ratio": 1.3}, {"e": 1.0, "gap": 0.7}, {"aspect": 0.6}]


@pytest.mark.parametrize("params", CELLS)
def test_a_domino_turns_and_strikes_as_its_equations_say(params):
    canonical, scene = made("domino", **params)
    measured, truth = canonical.measure(scene, motion(scene, 1 / 960)), canonical.exact(scene)
    for name, value in truth.items():
        assert measured[name][0] == pytest.approx(value, abs=2e-5), name


@pytest.mark.parametrize("params", CELLS)
def test_domino_feet_declared_to_hold_in_the_blow(params):
    _, scene = made("domino", **params)
    p = scene.params
    theta = math.asin(p["gap"])
    _, needed = blow(p, theta, 1.0)
    assert max(needed) <= p["mu"]


def test_domino_feet_that_would_slip_in_the_blow_refused():
    _, scene = made("domino")
    _, needed = blow(scene.params, math.asin(0.6), 1.0)
    made("domino", mu=1.02 * max(needed))
    with pytest.raises(SceneError, match=r"domino\.mu: .* both feet where"):
        made("domino", mu=0.98 * max(needed))


@pytest.mark.parametrize("offset", [-0.5, 0.0, 0.5])
@pytest.mark.parametrize("late", [0.0, 1.0])
@pytest.mark.parametrize("dt", [1 / 60, DT, 1 / 960])
@pytest.mark.parametrize("params", [{}, {"ratio": 0.9}, {"ratio": 1.3}])
def test_domino_by_step_orders_and_a_late_blow(params, dt, late, offset):
    canonical, scene = made("domino", **params)
    assert failing(canonical, scene, motion(scene, dt, offset=offset, late=late)) == set()


@pytest.mark.parametrize("size", SIZES)
def test_domino_with_wrong_restitution_gravity_inertia_or_slip(size):
    canonical, scene = made("domino")
    dt = DT if size > 0.05 else 1 / 3840
    assert size < 0.05 or "struck_spin" in failing(canonical, scene, motion(scene, dt, e=0.5 * (1.0 - 2.0 * size)))
    seen = failing(canonical, scene, motion(scene, dt, g=9.81 * (1.0 + size)))
    assert size < 0.005 or seen >= {"passing_time", "passing_spin"}
    assert size < 0.005 or "passing_time" in failing(canonical, scene, motion(scene, dt, heavy=1.0 + 5.0 * size))
    slipped = motion(scene)
    slipped.pose[50:, 1, 0] -= 10.0 * size
    assert failing(canonical, scene, slipped) == {"edge_moved"}
    canonical, back = made("domino", ratio=0.9)
    less = motion(back, dt, g=9.81 * (1.0 + size))
    assert size < 0.005 or "highest" in failing(canonical, back, less)
    touched = motion(back)
    touched.pose[-1, 2, 0] += 10.0 * size
    assert failing(canonical, back, touched) == {"next_moved"}


def test_domino_pushed_too_little_or_passing_through_the_next():
    canonical, scene = made("domino")
    still = motion(scene)
    still = replace(still, pose=np.repeat(still.pose[:1], len(still.t), axis=0), twist=0.0 * still.twist)
    assert failing(canonical, scene, still) == {"passing_time", "passing_spin", "struck_time", "struck_spin"}
    through = motion(scene)
    through.pose[:, 2], through.twist[:, 2] = scene.bodies[2].pose, 0.0
    assert failing(canonical, scene, through) == {"struck_time", "struck_spin"}


@pytest.mark.parametrize(
    ("params", "named"),
    [
        ({"ratio": 1.0}, "ratio"),
        ({"mu": 0.1}, "mu"),
        ({"aspect": 0.2}, "mu"),
        ({"rub": 0.5}, "mu"),
        ({"e": 0.0}, "e"),
        ({"ratio": 1.1}, "ratio"),
    ],
)
def test_domino_that_does_not_end_as_stated_refused(params, named):
    with pytest.raises(SceneError, match=rf"domino\.{named}"):
        made("domino", **params)


def test_next_domino_measured_while_it_rises():
    _, scene = made("domino")
    assert math.atan(scene.params["aspect"]) > STRUCK
