"""Blocks on a tilted table and columns that rest for long: motions integrated anew, planted faults of three sizes."""

import math
from dataclasses import replace

import numpy as np
import pytest
from planted import failing, made, still
from scipy.integrate import solve_ivp

from adapters.trajectory import Trajectory
from validation.scenes.tilt_table import TOLD, angle, outcome

DT = 1 / 240
SIZES = (0.1, 0.01, 0.001)


def recorded(scene, dt, x, z, turn, vx=0.0, vz=0.0, spin=0.0, stride=1):
    """A record of a planar motion of body 1: centre (x, z), turn and spin clockwise."""
    n, d = round(scene.duration / dt / stride) + 1, scene.dimension
    pose, twist = still(scene, n)
    pose[:, 1, 0], pose[:, 1, d - 1] = x, z
    twist[:, 1, 0], twist[:, 1, d - 1] = vx, vz
    if d == 2:
        pose[:, 1, 2], twist[:, 1, 2] = -np.asarray(turn), -np.asarray(spin)
    else:  # clockwise seen along -y is a positive turn about y
        half = 0.5 * np.broadcast_to(turn, n)
        pose[:, 1, 3:] = np.column_stack([np.cos(half), 0.0 * half, np.sin(half), 0.0 * half])
        twist[:, 1, 4] = spin
    return Trajectory(np.arange(n) * dt * stride, pose, twist, None, dt, "completed")


def tilted(scene, dt=DT, mu=None, g=None, order=0.0):
    """Newton's equations of the block, by DOP853: at rest, sliding, or on its lower edge that stays.

    The pendulum is written with its mass, its moment about the edge and the torque of gravity, not with p^2.
    """
    p = scene.params
    mu, g = p["mu"] if mu is None else mu, p["g"] if g is None else g
    theta, width, height = angle(p), p["aspect"] * p["height"], p["height"]
    t = np.arange(round(scene.duration / dt) + 1) * dt
    if outcome(p) == "stays":
        return recorded(scene, dt, 0.0, 0.5 * height, 0.0)
    if outcome(p) == "slides":
        a = g * (math.sin(theta) - mu * math.cos(theta))
        way = solve_ivp(lambda t, y: [y[1], a], (0.0, t[-1]), [0.0, 0.0], "DOP853", t, rtol=1e-12, atol=1e-14).y
        return recorded(scene, dt, way[0] + order * dt * way[1], 0.5 * height, 0.0, vx=way[1])
    moment = p["mass"] * ((width**2 + height**2) / 12.0 + (width**2 + height**2) / 4.0)

    def place(turn):
        """Centre against the edge, which is at (width/2, 0)."""
        return (
            -0.5 * width * np.cos(turn) + 0.5 * height * np.sin(turn),
            0.5 * width * np.sin(turn) + 0.5 * height * np.cos(turn),
        )

    def motion(t, y):
        x, z = place(y[0])
        force = p["mass"] * g * np.array([math.sin(theta), -math.cos(theta)])
        return [y[1], (z * force[0] - x * force[1]) / moment]

    turn, spin = solve_ivp(motion, (0.0, t[-1]), [0.0, 0.0], "DOP853", t, rtol=1e-12, atol=1e-14).y
    turn = turn + order * dt * spin
    x, z = place(turn)
    return recorded(scene, dt, 0.5 * width + x, z, turn, z * spin, -x * spin, spin)


CASES = (
    {"ratio": 0.98},
    {"ratio": 1.1},
    {"ratio": 1.3},
    {"ratio": 1.02},
    {"aspect": 1.0},
    {"aspect": 1.0, "ratio": 1.1},
)


@pytest.mark.parametrize("order", [-0.5, 0.0, 0.5])
@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("params", CASES)
def test_integrated_equations_in_every_step_order(params, dimension, order):
    canonical, scene = made("tilt_table", dimension, **params)
    trajectory = tilted(scene, order=order)
    assert failing(canonical, scene, trajectory) == set()
    if not order:
        truth = canonical.exact(scene)
        found = {metric: canonical.measure(scene, trajectory)[metric][0] for metric in truth}
        assert found == pytest.approx(truth, abs=1e-7)


@pytest.mark.parametrize("size", SIZES)
def test_resting_block_that_moves_or_turns(size):
    canonical, scene = made("tilt_table", 3)
    for axis in (0, 1, 2):
        gone = tilted(scene)
        gone.pose[-1, 1, axis] += size
        assert failing(canonical, scene, gone) == {"moved"}
    swung = tilted(scene)
    swung.pose[-1, 1, 3:] = [math.cos(0.5 * size), 0.0, math.sin(0.5 * size), 0.0]
    assert failing(canonical, scene, swung) == {"moved"}


@pytest.mark.parametrize("size", SIZES)
def test_sliding_block_with_wrong_friction_or_a_turn(size):
    canonical, scene = made("tilt_table", aspect=1.0, ratio=1.1)
    assert failing(canonical, scene, tilted(scene, mu=0.5 * (1.0 - size))) == {"acceleration"}
    turned = tilted(scene)
    turned.pose[100:, 1, 2] += size
    assert failing(canonical, scene, turned) == {"turned"}


@pytest.mark.parametrize("size", SIZES)
def test_toppling_block_too_fast_or_on_a_slipping_edge(size):
    """Gravity is seen in time and spin from a few per cent on: half a per cent of time is one and a half steps."""
    canonical, scene = made("tilt_table", ratio=1.1)
    fast = failing(canonical, scene, tilted(scene, g=9.81 * (1.0 + size)))
    assert fast == {0.1: {"passing_time", "passing_spin"}}.get(size, set())
    slipped = tilted(scene)
    slipped.pose[50:, 1, 0] -= size
    assert failing(canonical, scene, slipped) == {"edge_moved"}


def test_small_faults_of_a_toppling_block_at_small_steps():
    """The bound shrinks with the step: what 1/240 s forgives, 1/3840 s does not."""
    canonical, scene = made("tilt_table", ratio=1.1)
    assert "passing_time" in failing(canonical, scene, tilted(scene, 1 / 3840, g=9.81 * 1.01))


def test_tilting_block_that_stays_or_goes_wrongly():
    for params, metric in (({"ratio": 1.02}, "passing_time"), ({"ratio": 1.02, "aspect": 1.0}, "acceleration")):
        canonical, scene = made("tilt_table", **params)
        assert metric in failing(canonical, scene, recorded(scene, DT, 0.0, 0.5, 0.0))
    canonical, stays = made("tilt_table", ratio=0.98)
    _, goes = made("tilt_table", ratio=1.1)
    assert failing(canonical, stays, tilted(replace(goes, duration=2.0))) == {"moved"}


@pytest.mark.parametrize(
    ("params", "named"), [({"ratio": 1.7}, "ratio"), ({"aspect": 0.05, "mu": 0.06, "ratio": 1.1}, "mu")]
)
def test_blocks_in_two_regimes_refused_by_name(params, named):
    with pytest.raises(ValueError, match=rf"tilt_table\.{named}"):
        made("tilt_table", **params)


@pytest.mark.parametrize(("aspect", "limit"), [(0.3, 0.3), (1.0, 0.5)])
def test_turned_gravity_by_the_first_limit(aspect, limit):
    for ratio in (0.98, 1.1):
        _, scene = made("tilt_table", ratio=ratio, aspect=aspect)
        across, up = scene.gravity
        assert -across / up == pytest.approx(ratio * limit) and math.hypot(across, up) == pytest.approx(9.81)


def test_toppling_block_before_its_landing():
    _, scene = made("tilt_table", ratio=1.1)
    assert 0.5 * math.pi > TOLD and scene.duration < 1.2


# ---- a column that rests for long ----


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("duration", [10.0, 420.0])
def test_column_at_rest_after_any_start(dimension, duration):
    canonical, scene = made("long_rest", dimension, duration=duration)
    resting = recorded(scene, DT, 0.0, 0.5, 0.0, stride=60)
    resting.pose[:4, 1, 0] += 0.01
    assert failing(canonical, scene, resting) == set()


@pytest.mark.parametrize(("duration", "seen"), [(10.0, 0.3), (100.0, 0.03), (1000.0, 0.003)])
@pytest.mark.parametrize("dimension", [2, 3])
def test_column_that_drifts_sinks_or_turns_slowly(dimension, duration, seen):
    """A rate ``seen`` [m/h], and twice that of turning: the arm of a corner is 0.7 or 0.87 m."""
    canonical, scene = made("long_rest", dimension, duration=duration)
    samples = round(scene.duration / DT / 60) + 1
    way = seen / 3600.0 * np.linspace(0.0, duration, samples)
    up = dimension - 1
    for axis, sign, metric in (
        (0, 1.0, "drift_per_hour"),
        (up, 1.0, "sinking_per_hour"),
        (up, -1.0, "sinking_per_hour"),
    ):
        slow = recorded(scene, DT, 0.0, 0.5, 0.0, stride=60)
        slow.pose[:, 3, axis] += sign * way
        assert failing(canonical, scene, slow) == {metric}
    assert failing(canonical, scene, recorded(scene, DT, 0.0, 0.5, 2.0 * way, stride=60)) == {"turn_per_hour"}
    assert failing(canonical, scene, recorded(scene, DT, 0.0, 0.5, 0.1 * way, stride=60)) == set()
