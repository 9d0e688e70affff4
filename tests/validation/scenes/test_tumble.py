"""A box that tumbles: its period against Jacobi's functions and integration, bounds against steps of first order."""

import numpy as np
import pytest
from planted import failing, made
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from scipy.special import ellipk

from adapters.trajectory import Trajectory
from validation.scenes import tumble
from validation.truths import spinning

DT = 1 / 240
OWN = spinning.moments(1.0, tumble.SIDES)
CELLS = [{}, {"delta": 0.01, "spin": 6.0}, {"delta": 1.0, "spin": 1.0}, {"delta": 1e-4, "spin": 2.0}]


def quaternion_rate(q, w):
    """dq/dt of a spin in body axes."""
    a, x, y, z = q
    return 0.5 * np.array(
        [-x * w[0] - y * w[1] - z * w[2], a * w[0] + y * w[2] - z * w[1], a * w[1] - x * w[2] + z * w[0],
         a * w[2] + x * w[1] - y * w[0]]
    )  # fmt: skip


def recorded(times, attitude, spin, dt):
    """A record from quaternions and spins in body axes."""
    pose, twist = np.zeros((len(times), 1, 7)), np.zeros((len(times), 1, 6))
    pose[:, 0, 3:] = attitude / np.linalg.norm(attitude, axis=1)[:, None]
    twist[:, 0, 3:] = Rotation.from_quat(pose[:, 0, [4, 5, 6, 3]]).apply(spin)
    return Trajectory(times, pose, twist, None, dt, "completed")


def integrated(scene, dt=DT, own=None, braking=0.0):
    """Euler's equations and the attitude's, DOP853; ``braking`` [1/s] takes from the spin."""
    own = OWN if own is None else own
    start = [1.0, 0.0, 0.0, 0.0, *scene.bodies[0].twist[3:]]
    times = np.arange(round(scene.duration / dt) + 1) * dt

    def rates(t, y):
        w = y[4:]
        return [*quaternion_rate(y[:4], w), *(np.cross(own * w, w) / own - braking * w)]

    found = solve_ivp(rates, (0.0, times[-1]), start, "DOP853", rtol=1e-12, atol=1e-13, t_eval=times).y.T
    return recorded(times, found[:, :4], found[:, 4:], dt)


@pytest.mark.parametrize("params", CELLS)
def test_period_by_jacobi_and_by_integration(params):
    canonical, scene = made("tumble", 3, **params)
    p, (i1, i2, i3) = scene.params, OWN
    twice_energy, square = p["spin"] ** 2 * np.array([i2 + i3 * p["delta"] ** 2, i2**2 + i3**2 * p["delta"] ** 2])
    # Landau and Lifshitz, (37.10): with M^2 > 2 E I2, from w2 = sn at its largest.
    rate = np.sqrt((i3 - i2) * (square - twice_energy * i1) / (i1 * i2 * i3))
    m = (i2 - i1) * (twice_energy * i3 - square) / ((i3 - i2) * (square - twice_energy * i1))
    truth = canonical.exact(scene)["flip_time"]
    assert truth == pytest.approx(ellipk(m) / rate, rel=1e-7 if p["delta"] < 1e-3 else 1e-10)
    measured = canonical.measure(scene, integrated(scene))
    assert measured["flip_time"][0] == pytest.approx(truth, abs=1e-4)  # by rates that are differences of samples
    assert measured["momentum_drift"][0] < 1e-9 and measured["energy_drift"][0] < 1e-9


def explicit(scene, dt, world=False):
    """Steps of first order: Euler's equations explicitly, attitude by the old or by the new spin."""
    own, q, w = OWN, np.array([1.0, 0.0, 0.0, 0.0]), np.array(scene.bodies[0].twist[3:])
    rows = []
    for _ in range(round(scene.duration / dt) + 1):
        rows.append((*q, *w))
        new = w + dt * np.cross(own * w, w) / own
        q = q + dt * quaternion_rate(q, new if world else w)
        q, w = q / np.linalg.norm(q), new
    rows = np.array(rows)
    return recorded(np.arange(len(rows)) * dt, rows[:, :4], rows[:, 4:], dt)


@pytest.mark.parametrize("new_spin", [False, True])
@pytest.mark.parametrize("dt", [1 / 60, 1 / 120, DT, 1 / 960])
@pytest.mark.parametrize("params", CELLS[:3])
def test_steps_of_first_order_pass(params, dt, new_spin):
    canonical, scene = made("tumble", 3, **params)
    assert failing(canonical, scene, explicit(scene, dt, new_spin)) == set()


@pytest.mark.parametrize("size", [0.1, 0.01, 0.001])
def test_tumble_with_wrong_inertia_or_a_braked_spin(size):
    """As small as a step of first order is fine: at 1/240 s its own drift is 1.5 per cent, at 1/3840 s 1e-3."""
    canonical, scene = made("tumble", 3)
    dt = DT if size > 0.05 else 1 / 3840
    braked = failing(canonical, scene, integrated(scene, dt, braking=size))
    assert size < 0.005 or {"energy_drift", "momentum_drift"} <= braked
    heavy = OWN * [1.0, 1.0 + size, 1.0]
    assert size < 0.005 or {"flip_time", "energy_drift"} <= failing(canonical, scene, integrated(scene, dt, own=heavy))


def test_box_without_a_turn_over_has_no_time():
    canonical, scene = made("tumble", 3)
    times = np.arange(10) * DT
    steady = recorded(times, np.tile([1.0, 0.0, 0.0, 0.0], (10, 1)), np.tile([0.0, 3.0, 0.0], (10, 1)), DT)
    assert canonical.measure(scene, steady)["flip_time"] == (None, "it never arrives there")
