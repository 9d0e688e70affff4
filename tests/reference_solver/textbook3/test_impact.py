"""Single impacts against closed forms: Newton's restitution, Coulomb's friction impulse, the full inertia tensor."""

import numpy as np
import pytest

from reference_solver import Settings

# One contact: a handful of roundings of order eps in K, the impulse and the velocity update.
ROUND_OFF = 1e-14


@pytest.mark.parametrize("profile", ["fixed_step", "reference"])
@pytest.mark.parametrize("dt", [1 / 60, 1 / 240, 1 / 1000])
def test_rebound_under_gravity(build, dt, profile):
    """A fixed step spends its gravity inside the impact; the loop lets it act afterwards."""
    ball = build.sphere((0.0, 0.0, 0.5), (0.0, 0.0, -2.0))
    simulation = build.simulation([build.floor(), ball], getattr(Settings, profile)(dt), (0.0, 0.0, -9.81), 0.8)
    simulation.advance(1)
    expected = 1.6 if profile == "fixed_step" else 1.6 - 9.81 * dt
    assert abs(simulation.twist[1, 2] - expected) <= ROUND_OFF * 2.0


# Tangential velocity and spin are chosen oblique to all axes. Sliding speed u = v_t + omega x r; sticking needs
# |u| k / (1 + k) <= mu (1 + e) |v_n|, here 2/7 of |u| against 1.8 mu for v_n = -1, e = .8.
SLIDES = [
    pytest.param((0.4, 0.3, -1.0), (0.2, -0.7, 0.5), 0.5, True, id="sticks"),
    pytest.param((4.0, -3.0, -1.0), (2.0, 5.0, 1.0), 0.1, False, id="slips"),
    pytest.param((1.0, 0.0, -1.0), (0.0, -20.0, 3.0), 5.0, True, id="spin reverses the way"),
]


@pytest.mark.parametrize(("velocity", "spin", "mu", "sticks"), SLIDES)
def test_oblique_spinning_sphere_by_coulomb(build, settings, velocity, spin, mu, sticks):
    m, radius, k, e = 0.7, 0.5, 0.4, 0.8
    ball = build.sphere((0.0, 0.0, radius), velocity, spin, radius, m, k)
    simulation = build.simulation([build.floor(), ball], settings, restitution=e, friction=mu)
    simulation.advance(1)
    v, w = np.array(velocity), np.array(spin)
    arm = np.array([0.0, 0.0, -radius])
    slip = (v + np.cross(w, arm)) * [1, 1, 0]
    # (1 + k) / k is what a tangential impulse does to the slip, times 1 / m (S-A7 of the scene catalogue).
    stop = -m * k / (1 + k) * slip
    bound = mu * m * (1 + e) * abs(v[2])
    assert sticks == (np.linalg.norm(stop) <= bound)
    friction = stop if sticks else -bound * slip / np.linalg.norm(slip)
    impulse = friction + m * (1 + e) * abs(v[2]) * np.array([0.0, 0.0, 1.0])
    expected = np.concatenate([v + impulse / m, w + np.cross(arm, impulse) / (k * m * radius**2)])
    assert simulation.twist[1] == pytest.approx(expected, abs=10 * ROUND_OFF * np.abs(expected).max())


@pytest.mark.parametrize("profile", [Settings.classical, Settings.fixed_step])
def test_spin_by_a_strike_off_centre(build, mechanics, profile):
    """A small sphere hits the top face of a turned box with three different moments (S-A5).

    The step is 1 us, so that free rotation after the impact changes the energy by less than round-off.
    """
    settings = profile(1e-6)
    e, speed = 0.7, 3.0
    turn = (0.8, 0.3, -0.4, 0.33)
    box = build.box((0.1, 0.2, 0.3), half=(0.7, 0.4, 0.2), mass=2.0, turn=turn)
    r = mechanics.rotation_matrix(box.pose[3:])
    n = r[:, 2]
    touch = np.array([0.1, 0.2, 0.3]) + r @ [0.45, -0.3, 0.2]
    ball = build.sphere(touch + 0.1 * n, -speed * n, radius=0.1, mass=0.5)
    simulation = build.simulation([box, ball], settings, restitution=e)
    simulation.advance(1)
    arm = touch - [0.1, 0.2, 0.3]
    inverse = np.linalg.inv(mechanics.inertia(box, np.array(box.pose)))
    kappa = 1 / 2.0 + 1 / 0.5 + n @ np.cross(inverse @ np.cross(arm, n), arm)
    impulse = (1 + e) * speed / kappa
    assert simulation.twist[1, :3] == pytest.approx((-speed + impulse / 0.5) * n, abs=1e-13 * speed)
    assert simulation.twist[0, :3] == pytest.approx(-impulse / 2.0 * n, abs=1e-13 * speed)
    spin_momentum = mechanics.inertia(box, simulation.pose[0]) @ simulation.twist[0, 3:]
    assert spin_momentum == pytest.approx(np.cross(arm, -impulse * n), abs=1e-13 * speed)
    lost = 0.5 * (1 - e**2) * speed**2 / kappa
    assert mechanics.kinetic_energy(simulation) == pytest.approx(0.5 * 0.5 * speed**2 - lost, rel=1e-13)


def test_velocities_of_elastic_spheres_head_on(build, settings):
    direction = np.array([2.0, -1.0, 2.0]) / 3.0
    bodies = [build.sphere(-0.5 * direction, direction), build.sphere(0.5 * direction, (0.0, 0.0, 0.0))]
    simulation = build.simulation(bodies, settings, restitution=1.0)
    simulation.advance(1)
    assert simulation.twist[:, :3] == pytest.approx(np.array([np.zeros(3), direction]), abs=ROUND_OFF)


def test_rebound_from_a_prescribed_wall(build, settings):
    """Against a wall moving at V the law holds for relative velocities: v+ = V + e (V - v-)."""
    wall = build.floor(motion="prescribed", twist=(0.0, 0.0, 2.0, 0.0, 0.0, 0.0))
    ball = build.sphere((0.0, 0.0, 0.5), (0.0, 0.0, -3.0))
    simulation = build.simulation([wall, ball], settings, restitution=0.6)
    simulation.advance(1)
    assert simulation.twist[1, 2] == pytest.approx(2.0 + 0.6 * 5.0, abs=5 * ROUND_OFF)
    assert simulation.pose[0, 2] == pytest.approx(2.0 * build.dt, rel=1e-15)
