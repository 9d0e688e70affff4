"""Impacts: Newton's law, oblique and off-centre, against closed forms.

Tolerances: a single impact is a handful of roundings, so 4 units in the last place (1e-15 relative) of the largest
quantity; several rows carry the solver's residual stop 1e-13 times a condition number below ten.
"""

import itertools
import math

import numpy as np
import pytest

from reference_solver import Settings
from reference_solver.pieces import IMPACT

EPS = np.finfo(float).eps


@pytest.mark.parametrize("dt", [1 / 60, 1 / 240, 1 / 960])
@pytest.mark.parametrize("profile", [Settings.classical, Settings.fixed_step])
def test_rebound_by_speed_phase_and_gravity(build, profile, dt):
    for e, v, phase, g in itertools.product(
        (0.2, 0.5, 0.8, 0.95, 1.0), (1e-3, 0.1, 1.0, 6.0, 50.0, 1e3), (0.0, 0.3, 0.7), (0.0, 9.81)
    ):
        bodies = [build.floor(), build.disc(0.0, 0.5 + phase * v * dt, (0.0, -v, 0.0))]
        record = build.simulation(bodies, profile(dt), (0.0, -g), e).record(3)
        speed = record.twist[:, 1, 1]
        hit = int(np.argmax(speed > 0.0))
        assert hit > 0, (e, v, phase, g)
        before = speed[hit - 1]
        # Two roundings of terms no larger than the speed and the step's gravity increment.
        assert abs(speed[hit] + e * before) <= 4 * EPS * max(abs(before), g * dt), (e, v, phase, g)


def test_speed_and_overlap_after_an_inelastic_impact(build, settings):
    simulation = build.simulation([build.floor(), build.disc(0.0, 0.5015, (0.0, -3.0, 0.0))], settings)
    simulation.advance(200)
    assert abs(simulation.twist[1, 1]) <= 1e-15
    # Within the slop a contact counts as touching; the reference profile has none.
    assert abs(simulation.pose[1, 1] - 0.5) <= settings.slop + 1e-12


@pytest.mark.parametrize("friction", [0.0, 0.5])
@pytest.mark.parametrize("e", [0.2, 0.5, 0.8, 1.0])
def test_rebound_of_a_flat_box(build, fixed_step, e, friction):
    simulation = build.simulation(
        [build.floor(), build.box(0.0, 0.5, (0.0, -3.0, 0.0))], fixed_step, (0.0, -9.81), e, friction
    )
    simulation.advance(1)
    assert simulation.twist[1] == pytest.approx([0.0, 3.0 * e, 0.0], abs=1e-12)


@pytest.mark.parametrize(
    ("vt", "spin", "mu", "e"),
    [(1.0, 10.0, 0.5, 0.5), (3.0, 0.0, 0.1, 0.5), (1.0, 0.0, 0.5, 0.0), (2.0, -4.0, 0.05, 1.0), (1.0, 30.0, 0.2, 0.8)],
)
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_oblique_disc_by_coulomb(build, settings, vt, spin, mu, e, side):
    """Scene S-A7: with k = I/(m R^2) = 1/2 a disc sticks iff |u| k/(1 + k) <= mu (1 + e) v_n, u = v_t + omega R."""
    vn, radius, k = 2.0, 0.5, 0.5
    vt, spin = side * vt, side * spin
    simulation = build.simulation(
        [build.floor(), build.disc(0.0, radius, (vt, -vn, spin))], settings, (0.0, 0.0), e, mu
    )
    simulation.advance(1)
    u = vt + spin * radius
    if abs(u) * k / (1.0 + k) <= mu * (1.0 + e) * vn:
        after = (vt - k * spin * radius) / (1.0 + k)
        turned = -after / radius
    else:
        change = mu * (1.0 + e) * vn * math.copysign(1.0, u)
        after, turned = vt - change, spin - change / (k * radius)
    # Classical: the two rows of a disc do not couple, so one sweep is exact.
    assert simulation.twist[1] == pytest.approx([after, e * vn, turned], abs=1e-14 * (abs(spin) + 4.0))


@pytest.mark.parametrize("offset", [0.0, 0.2, 1.0 / 12.0 * 2.0])
@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_off_centre_strike_on_a_free_rod(build, settings, offset, e):
    """Scene S-A4: J = (1 + e) v / (1/m + 1/M + d^2/I) for a particle on a free rod, V = J/M, omega = J d / I."""
    half, m, big, v = (1.0, 0.01), 0.3, 2.0, 4.0
    rod = build.box(0.0, 0.0, half=half, mass=big)
    ball = build.disc(offset, half[1] + 0.05, (0.0, -v, 0.0), radius=0.05, mass=m)
    record = build.simulation([rod, ball], settings, restitution=e).record(1, pieces=settings.tolerance is not None)
    twist, pieces = record.twist[-1], record.pieces
    if pieces is not None:  # the impact alone: with e = 0 the ball stays on the rod that turns, and goes on pushing
        (last,) = np.flatnonzero(pieces.kind == IMPACT)
        twist = pieces.twist_after[pieces.first_body[last] : pieces.first_body[last + 1]]
    impulse = (1.0 + e) * v / (1.0 / m + 1.0 / big + offset**2 / rod.inertia)
    assert twist[0] == pytest.approx([0.0, -impulse / big, -impulse * offset / rod.inertia], abs=1e-13 * v)
    assert twist[1, 1] == pytest.approx(-v + impulse / m, abs=1e-13 * v)


@pytest.mark.parametrize("ratio", [1.0, 10.0, 1e3, 1e6])
@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_momentum_of_two_discs_on_one_line(build, settings, ratio, e):
    v1, v2 = 2.0, -1.0
    bodies = [build.disc(-0.5, 0.0, (v1, 0.0, 0.0)), build.disc(0.5, 0.0, (v2, 0.0, 0.0), mass=ratio)]
    simulation = build.simulation(bodies, settings, restitution=e)
    simulation.advance(1)
    total = 1.0 + ratio
    expected = [(v1 + ratio * v2 - ratio * e * (v1 - v2)) / total, (v1 + ratio * v2 + e * (v1 - v2)) / total]
    assert simulation.twist[:, 0] == pytest.approx(expected, abs=8 * EPS * 3.0)


def test_three_balls_in_a_row_by_the_simultaneous_law(build, reference):
    """Law N-SIM: v1 = (1 - 2 e)/3, v2 = v3 = (1 + e)/3 (scene S-B1)."""
    for e in (0.0, 0.4, 1.0):
        bodies = [build.disc(float(i), 0.0, (1.0 if i == 0 else 0.0, 0.0, 0.0)) for i in range(3)]
        simulation = build.simulation(bodies, reference, restitution=e)
        simulation.advance(1)
        # Residual stop 1e-13, three bodies: condition below ten.
        assert simulation.twist[:, 0] == pytest.approx([(1 - 2 * e) / 3, (1 + e) / 3, (1 + e) / 3], abs=1e-12)


def test_apexes_never_rise_at_e_1(build, settings):
    """Fixed steps cost a phase error per bounce, bounded and without trend; energy must not be pumped."""
    bodies = [build.floor(), build.disc(0.0, 1.53)]
    record = build.simulation(bodies, settings, (0.0, -9.81), 1.0).record(240 * 20)
    height = record.pose[:, 1, 1] - 0.5
    start = height[0]
    # Hitting at depth d <= v h instead of 0 shifts the energy by at most g d.
    v = math.sqrt(2 * 9.81 * start)
    assert height.max() <= start + v * build.dt
    assert height[-480:].max() >= start - 2.0 * v * build.dt


@pytest.mark.parametrize("e", [0.5, 0.8])
def test_rest_of_a_bouncing_disc_by_its_series(build, settings, e):
    """t = sqrt(2 h / g) (1 + e)/(1 - e), mean over 16 phases of the first impact.

    Each of N = ln(v / 2 g dt)/ln(1/e) bounces is found up to a step late, and the tail below 2 g dt lasts 4 dt/(1 - e).
    """
    g, errors = 9.81, []
    for i in range(16):
        height = 1.0 + 0.01 * i
        simulation = build.simulation([build.floor(), build.disc(0.0, 0.5 + height)], settings, (0.0, -g), e)
        record = simulation.record(1200)
        moving = np.flatnonzero(np.abs(record.twist[:, 1, 1]) > 0.01 * g * build.dt)
        errors.append(record.t[moving[-1]] - math.sqrt(2.0 * height / g) * (1.0 + e) / (1.0 - e))
        assert np.abs(record.twist[-1]).max() <= 1e-12
    bounces = math.log(math.sqrt(2.0 * g) / (2.0 * g * build.dt)) / math.log(1.0 / e)
    assert abs(np.mean(errors)) <= (bounces + 4.0 / (1.0 - e)) * build.dt
