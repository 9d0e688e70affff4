"""Free rotation of bodies with unequal moments: conserved quantities, order, and the intermediate axis."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipj

from reference_solver import Body, Box, Model, Settings, Simulation

MOMENTS = np.array([1.0, 2.0, 3.0])


def tumbling(spin, dt, turn=(1.0, 0.0, 0.0, 0.0), moments=MOMENTS, profile=Settings.reference, **fields):
    """One free body with world angular velocity `spin`; its shape plays no part."""
    turn = tuple(np.asarray(turn) / np.linalg.norm(turn))
    body = Body(Box((0.5, 0.5, 0.5)), 1.0, tuple(moments), (0.0, 0.0, 0.0, *turn), (0.0, 0.0, 0.0, *spin), **fields)
    return Simulation(Model(3, [body], (0.0, 0.0, 0.0), 0.0, 0.0), profile(dt))


def momenta(mechanics, record):
    """Angular momentum of body 0 in every frame, (s, 3)."""
    frames = [mechanics.rotation_matrix(pose[3:]) for pose in record.pose[:, 0]]
    return np.array([r @ (MOMENTS * (r.T @ w)) for r, w in zip(frames, record.twist[:, 0, 3:], strict=True)])


def exact_orientation(spin, end):
    """Quaternion and body angular velocity after `end`, by an independent integrator of order 8."""

    def rate(_, state):
        q, w = state[:4], state[4:]
        dq = 0.5 * np.array(
            [
                -q[1] * w[0] - q[2] * w[1] - q[3] * w[2],
                q[0] * w[0] + q[2] * w[2] - q[3] * w[1],
                q[0] * w[1] + q[3] * w[0] - q[1] * w[2],
                q[0] * w[2] + q[1] * w[1] - q[2] * w[0],
            ]
        )
        return np.concatenate([dq, -np.cross(w, MOMENTS * w) / MOMENTS])

    start = np.concatenate([[1.0, 0.0, 0.0, 0.0], spin])
    return solve_ivp(rate, (0.0, end), start, method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]


def angle_between(p, q):
    """Angle of the rotation between two orientations [rad]."""
    return 2.0 * math.sqrt(max(2.0 - 2.0 * abs(np.dot(p / np.linalg.norm(p), q / np.linalg.norm(q))), 0.0))


def test_order_of_orientation_in_fixed_steps():
    spin, end = np.array([0.05, 3.0, 0.02]), 10.0
    exact = exact_orientation(spin, end)
    errors = []
    for steps in (600, 1200, 2400, 4800):
        simulation = tumbling(spin, end / steps, profile=Settings.classical)
        simulation.advance(steps)
        errors.append(angle_between(simulation.pose[0, 3:], exact[:4]))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders.min() >= 1.9 and errors[-1] <= 3e-5


@pytest.mark.parametrize("rate", [30, 240])
@pytest.mark.parametrize("spin", [(0.05, 3.0, 0.02), (1.0, -2.0, 3.0), (20.0, 5.0, -9.0)], ids=["slow", "all", "fast"])
def test_path_and_energy_of_a_tumbling_flight(mechanics, spin, rate):
    """DOP853 at 1e-13 errs by 1e-12 of the turn, some 40 rad at most; the splitting composed to order 8 by less."""
    spin = np.array(spin)
    exact = exact_orientation(spin, 2.0)[:4]
    record = tumbling(spin, 1.0 / rate).record(2 * rate)
    last = record.pose[-1, 0, 3:]
    assert last * np.sign(last @ exact) == pytest.approx(exact / np.linalg.norm(exact), abs=1e-10)
    momentum = momenta(mechanics, record)
    energy = np.einsum("sk,sk->s", momentum, record.twist[:, 0, 3:])
    assert np.ptp(energy) <= 1e-12 * energy[0]


def test_order_under_a_constant_torque(mechanics):
    spin, torque = np.array([0.3, 2.0, -0.5]), np.array([0.5, -1.0, 2.0])

    def rate(_, state):
        q, w = state[:4], state[4:]
        local = mechanics.rotation_matrix(q / np.linalg.norm(q)).T @ torque
        change = (local - np.cross(w, MOMENTS * w)) / MOMENTS
        return np.concatenate([[-0.5 * q[1:] @ w], 0.5 * (q[0] * w + np.cross(q[1:], w)), change])

    start = np.concatenate([[1.0, 0.0, 0.0, 0.0], spin])
    exact = solve_ivp(rate, (0.0, 1.0), start, method="DOP853", rtol=1e-13, atol=1e-14).y[:4, -1]
    simulation = tumbling(spin, 1 / 60, torque=tuple(torque))
    simulation.advance(60)
    last = simulation.pose[0, 3:]
    assert last * np.sign(last @ exact) == pytest.approx(exact / np.linalg.norm(exact), abs=1e-10)


def test_flips_about_the_intermediate_axis(mechanics):
    """Dzhanibekov: I = (1, 2, 3), spin (.01, 1, 0). Here M^2 < 2 E I_2, so that axes 1 and 3 swap roles.

    w2 = sqrt((M^2 - 2 E I1) / (I2 (I2 - I1))) sn(tau), tau = (t + t0) sqrt((I2 - I1)(2 E I3 - M^2) / (I1 I2 I3)), and
    w3(0) = 0 is where sn = 1: a quarter period before t = 0.
    """
    i1, i2, i3 = MOMENTS
    w1, w2 = 0.01, 1.0
    energy2, momentum2 = i1 * w1**2 + i2 * w2**2, (i1 * w1) ** 2 + (i2 * w2) ** 2
    assert momentum2 < energy2 * i2
    rate = math.sqrt((i2 - i1) * (energy2 * i3 - momentum2) / (i1 * i2 * i3))
    modulus = (i3 - i2) * (momentum2 - energy2 * i1) / ((i2 - i1) * (energy2 * i3 - momentum2))
    amplitude = math.sqrt((momentum2 - energy2 * i1) / (i2 * (i2 - i1)))
    record = tumbling((w1, w2, 0.0), 1 / 60).record(60 * 42, stride=60)  # a whole period is 41.51 s
    in_body = [
        mechanics.rotation_matrix(pose[3:]).T @ w
        for pose, w in zip(record.pose[:, 0], record.twist[:, 0, 3:], strict=True)
    ]
    _, cn, dn, _ = ellipj(rate * record.t, modulus)
    quarter_later = cn / dn  # sn(x + K)
    # What a step leaves, 1e-13, grows by exp(.58 t) on the way to a flip: 1e5-fold in the 20 s between two.
    assert np.array(in_body)[:, 1] == pytest.approx(amplitude * quarter_later, abs=1e-7)
    assert min(np.array(in_body)[:, 1]) < -0.99  # it did flip


def test_rotation_with_equal_moments():
    spin = np.array([1.0, -2.0, 0.5])
    simulation = tumbling(spin, 1 / 240, moments=(0.7, 0.7, 0.7))
    simulation.advance(2400)
    angle = 10.0 * np.linalg.norm(spin)
    expected = np.concatenate([[math.cos(angle / 2)], math.sin(angle / 2) * spin / np.linalg.norm(spin)])
    assert (simulation.twist[0, 3:] == spin).all()
    assert angle_between(simulation.pose[0, 3:], expected) <= 1e-7  # acos of round-off near 1 is sqrt(eps)


def test_spin_by_a_torque_about_a_principal_axis():
    simulation = tumbling((0.0, 0.0, 0.0), 1 / 240, torque=(0.0, 0.0, 6.0))
    simulation.advance(240)
    assert simulation.twist[0] == pytest.approx([0, 0, 0, 0, 0, 2.0], abs=1e-12)


def test_angular_momentum_of_contacts_and_free_rotation(build, mechanics, settings):
    """Two tumbling boxes of unequal moments that collide keep their total angular momentum to round-off."""
    half = (0.7, 0.4, 0.2)
    a = build.box((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 2.0, 0.5), half, 1.0, (0.9, 0.1, 0.2, -0.3))
    b = build.box((0.3, 0.1, 1.2), (0.0, 0.0, -1.0), (0.3, -1.0, 2.0), half, 2.0, (0.3, 0.9, 0.2, 0.1))
    simulation = build.simulation([a, b], settings, restitution=0.5, friction=0.5)
    before = mechanics.angular_momentum(simulation)
    touched = False
    for _ in range(240):
        simulation.advance(1)
        touched = touched or len(simulation.contacts()) > 0
    assert touched
    # Splitting is only by position correction of steps, which moves bodies without impulse: it may shift x x m v by
    # (push) x (m v). Pushes cancel in m x but not in v, so that they enter at the size of the overlap removed.
    pushed = 0.0 if settings.tolerance is not None else simulation.certificate["projected"]
    allowed = 1e-12 + 4.0 * pushed
    assert np.abs(mechanics.angular_momentum(simulation) - before).max() <= allowed
