"""Coulomb friction in space: threshold, direction, rolling, and the law of one contact."""

import math
import sys

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from reference_solver import Settings
from reference_solver.textbook3.one_contact import coulomb_impulse, disc_friction

G, MU = 9.81, 0.5


def incline(build, settings, ratio, body, heading=0.0):
    """Rotated gravity: tan(slope) = ratio mu, downhill along `heading` in the plane of the floor."""
    slope = math.atan(ratio * MU)
    pull = G * math.sin(slope)
    gravity = (pull * math.cos(heading), pull * math.sin(heading), -G * math.cos(slope))
    return build.simulation([build.floor(), body], settings, gravity, friction=MU), slope


@pytest.mark.parametrize("ratio", [0.5, 0.9, 0.99, 0.999])
def test_creep_of_a_box_below_the_friction_limit(build, reference, ratio):
    simulation, _ = incline(build, reference, ratio, build.box((0.0, 0.0, 0.5)), heading=0.7)
    simulation.advance(1000)
    assert np.abs(simulation.twist[1]).max() <= 1e-14
    assert np.abs(simulation.pose[1, :3] - [0, 0, 0.5]).max() <= 1e-12


@pytest.mark.parametrize("ratio", [1.001, 1.01, 1.1, 2.0])
def test_box_above_the_friction_limit(build, reference, ratio):
    simulation, slope = incline(build, reference, ratio, build.box((0.0, 0.0, 0.5)), heading=0.7)
    simulation.advance(240)
    expected = G * (math.sin(slope) - MU * math.cos(slope))  # m/s after 1 s
    downhill = np.array([math.cos(0.7), math.sin(0.7), 0.0])
    assert simulation.twist[1, :3] @ downhill == pytest.approx(expected, rel=1e-11)
    assert np.linalg.norm(simulation.twist[1, :3] - expected * downhill) <= 1e-12
    assert simulation.pose[1, :3] == pytest.approx(0.5 * expected * downhill + [0, 0, 0.5], abs=1e-12)


@pytest.mark.parametrize("heading", np.radians([0.0, 15.0, 30.0, 45.0, 77.0, 90.0]))
@pytest.mark.parametrize("shape", ["box", "sphere"])
def test_friction_by_direction(build, reference, shape, heading):
    """Straight line and deceleration mu g; a pyramid of two axes would give up to sqrt(2) and turn the path."""
    along = np.array([math.cos(heading), math.sin(heading), 0.0])
    body = getattr(build, shape)((0.0, 0.0, 0.5), 5.0 * along)
    simulation = build.simulation([build.floor(), body], reference, (0.0, 0.0, -G), friction=MU)
    steps = 48  # the sphere slips for t = 5 k / ((1 + k) mu g) = .29 s, longer than .2 s
    simulation.advance(steps)
    expected = 5.0 - MU * G * steps * build.dt
    assert simulation.twist[1, :3] == pytest.approx(expected * along, abs=1e-12)


def test_parabola_and_roll_of_a_struck_billiard_ball(build, settings):
    """Masse shot (S-C6): the direction of slip stays what it is, so that friction is a constant force."""
    radius, k, mu = 0.5, 0.4, 0.2
    v0, w0 = np.array([3.0, 0.0, 0.0]), np.array([4.0, 6.0, 7.0])
    slip = v0 + np.cross(w0, [0.0, 0.0, -radius])
    direction = slip / np.linalg.norm(slip)
    ball = build.sphere((0.0, 0.0, radius), v0, w0, radius, k=k)
    simulation = build.simulation([build.floor(), ball], settings, (0.0, 0.0, -G), friction=mu)
    end = np.linalg.norm(slip) * k / ((1 + k) * mu * G)
    record = simulation.record(400)
    slipping = record.t < end - build.dt
    t = record.t[slipping, None]
    assert record.twist[slipping, 1, :3] == pytest.approx(v0 - mu * G * t * direction, abs=1e-11)
    # Semi-implicit steps: each position lags the parabola by mu g t dt / 2. The loop is exact.
    lag = build.dt if settings.tolerance is None else 0.0
    path = [0, 0, radius] + v0 * t - 0.5 * mu * G * (t * t + t * lag) * direction
    assert record.pose[slipping, 1, :3] == pytest.approx(path, abs=1e-11)
    rolling = record.twist[record.t > end + 2 * build.dt, 1]
    assert rolling[:, :3] == pytest.approx(np.tile(v0 - slip * k / (1 + k), (len(rolling), 1)), abs=1e-11)
    assert rolling[:, 5] == pytest.approx(7.0, abs=1e-12)  # a point contact does not brake spin about its normal


@pytest.mark.parametrize(("k", "share"), [(2 / 5, 5 / 7), (2 / 3, 3 / 5)])
@pytest.mark.parametrize("dt", [1 / 60, 1 / 240, 1 / 700])
def test_rolling_speed_by_angular_momentum(build, k, share, dt):
    """About the contact line the angular momentum is conserved, hence the exact end speed at any step."""
    ball = build.sphere((0.0, 0.0, 0.5), (3.0, 4.0, 0.0), k=k)
    simulation = build.simulation([build.floor(), ball], Settings.reference(dt), (0.0, 0.0, -G), friction=MU)
    simulation.advance(round(1.0 / dt))
    assert simulation.twist[1, :3] == pytest.approx([3.0 * share, 4.0 * share, 0.0], abs=1e-12)
    assert simulation.twist[1, 3:] == pytest.approx(np.array([-4.0, 3.0, 0.0]) * share / 0.5, abs=1e-12)


def test_spin_of_a_box_braked_by_its_corners(build, reference):
    """Four corners at distance rho, each loaded m g / 4: torque mu m g rho against the spin, none against v = 0."""
    box = build.box((0.0, 0.0, 0.25), spin=(0.0, 0.0, 8.0), half=(0.5, 0.5, 0.25))
    simulation = build.simulation([build.floor(), box], reference, (0.0, 0.0, -G), friction=MU)
    simulation.advance(24)
    rho, moment = math.hypot(0.5, 0.5), 1 / 6
    assert simulation.twist[1, 5] == pytest.approx(8.0 - MU * G * rho / moment * 24 * build.dt, abs=1e-10)
    assert np.abs(simulation.twist[1, :5]).max() <= 1e-12


components = st.floats(-1.0, 1.0).map(lambda x: round(x, 6))


@st.composite
def collision_matrices(draw):
    """Symmetric positive definite K with condition below 1e3: 1/m on the diagonal plus lever terms."""
    rows = np.array(draw(st.lists(st.lists(components, min_size=3, max_size=3), min_size=3, max_size=3)))
    return rows @ rows.T + 0.02 * np.eye(3)


def upper(k):
    return (k[0, 0], k[0, 1], k[0, 2], k[1, 1], k[1, 2], k[2, 2])


@given(collision_matrices(), st.tuples(components, components, components), st.floats(0.0, 1.5))
def test_impulse_of_one_contact_by_signorini_and_coulomb(k, q, mu):
    """Whichever branch found the impulse, it must fulfil the law.

    Well-posed: k_nn > mu |k_nt|; other contacts may have none (Painleve) and are not drawn.
    """
    assume(k[2, 2] > mu * math.hypot(k[0, 2], k[1, 2]) * 1.05)
    p = np.array(coulomb_impulse(upper(k), q, mu))
    u = k @ p + q
    size = max(np.abs(q).max(), 1e-3)
    bound = mu * p[2]
    assert p[2] >= 0.0 and u[2] >= -1e-11 * size and abs(p[2] * u[2]) <= 1e-11 * size * max(p[2], 1e-3)
    # Products below the smallest normal double (2e-308) are rounded to multiples of 5e-324, whatever their size.
    assert math.hypot(p[0], p[1]) <= bound * (1 + 1e-13) + sys.float_info.min
    slip = math.hypot(u[0], u[1])
    if p[2] > 0.0 and slip > 1e-9 * size:
        assert p[:2] == pytest.approx(-bound * u[:2] / slip, abs=1e-8 * bound + 1e-14)


@given(collision_matrices(), st.tuples(components, components), st.floats(1e-3, 2.0))
def test_dissipation_of_friction_against_other_impulses(k, g, radius):
    def cost(p):
        return 0.5 * p @ k[:2, :2] @ p + p @ np.array(g)

    best = cost(np.array(disc_friction(k[0, 0], k[0, 1], k[1, 1], g[0], g[1], radius)))
    for angle in np.linspace(0.0, 2 * math.pi, 60):
        for share in (0.2, 0.7, 1.0):
            trial = cost(share * radius * np.array([math.cos(angle), math.sin(angle)]))
            assert trial >= best - 1e-12 * (abs(best) + abs(trial) + 1e-6)
