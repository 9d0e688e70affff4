"""A rod pushed with its end ahead: slide and jam against forces and impulses of a rigid body; faults of sizes."""

import math
from dataclasses import replace

import numpy as np
import pytest
from planted import failing, made, still
from scipy.integrate import solve_ivp

from adapters.scene import SceneError
from adapters.trajectory import Trajectory
from validation.scenes.painleve import critical
from validation.truths.leaning import turn

DT = 1 / 240
SIZES = [0.1, 0.01, 0.001]


def end_of(scene, tilt):
    """The lower left corner of the box against its centre, and its derivative by the tilt."""
    half = np.array(scene.bodies[1].shape.half_extents)
    c, s = math.cos(tilt), math.sin(tilt)
    arm = np.array([[c, -s], [s, c]]) @ -half
    return arm, np.array([-arm[1], arm[0]])


def forces(scene, tilt, spin, mu, g, heavy=1.0):
    """Accelerations and the force of the floor: the end does not accelerate up, or, held, not at all. Five unknowns."""
    rod = scene.bodies[1]
    arm, turned = end_of(scene, tilt)
    rows, right = np.zeros((5, 5)), np.array([0.0, -rod.mass * g, 0.0, 0.0, 0.0])
    rows[:3, :3] = np.diag([rod.mass, rod.mass, heavy * rod.inertia])
    # Force (tangent, normal) at the end, and its moment about the centre.
    rows[:3, 3], rows[:3, 4] = -np.array([1.0, 0.0, -arm[1]]), -np.array([0.0, 1.0, arm[0]])
    rows[3, :3], right[3] = [0.0, 1.0, turned[1]], spin**2 * arm[1]
    if mu is None:
        rows[4, :3], right[4] = [1.0, 0.0, turned[0]], spin**2 * arm[0]
    else:
        rows[4, 3:] = 1.0, mu  # it slides to the right
    return np.linalg.solve(rows, right)


def jammed(scene, heavy=1.0, stick=1.0):
    """Velocity of the rod after an impulse at its end that stops it, and that impulse (tangent, normal)."""
    rod = scene.bodies[1]
    _, turned = end_of(scene, rod.pose[2])
    along, up = np.array([1.0, 0.0, turned[0]]), np.array([0.0, 1.0, turned[1]])
    before, masses = np.array(rod.twist), np.diag([rod.mass, rod.mass, heavy * rod.inertia])
    contact = np.array([along, up])
    impulse = np.linalg.solve(contact @ np.linalg.inv(masses) @ contact.T, -stick * (contact @ before))
    return before + np.linalg.inv(masses) @ contact.T @ impulse, impulse


def moved(scene, dt=DT, mu=None, g=None, heavy=1.0, offset=0.0, late=0.0, stick=1.0):
    """The motion by DOP853; ``offset`` of a step order and ``late`` of the first contact, in steps."""
    p, rod = scene.params, scene.bodies[1]
    g = p["g"] if g is None else g
    friction = p["ratio"] * critical(p) if mu is None else mu
    jams = p["ratio"] > 1.0
    start, held = np.array(rod.twist), None if jams else friction
    if jams:
        start, _ = jammed(scene, heavy, stick)

    def rates(t, y):
        return [*y[3:], *forces(scene, y[2], y[5], held, g, heavy)[:3]]

    times = np.arange(round(scene.duration / dt) + 1) * dt
    found = solve_ivp(
        rates, (0.0, times[-1] + dt), [*rod.pose, *start], "DOP853", dense_output=True, rtol=1e-11, atol=1e-12
    )
    states = found.sol(np.maximum(0.0, times - late * dt)).T
    waits = times < late * dt
    states[waits, 3:] = rod.twist
    states[:, 0] += late * dt * p["v"] * ~waits + p["v"] * times * waits
    states[:, :3] += offset * dt * states[:, 3:] * (times > 0.0)[:, None]
    n = len(times)
    pose, twist = still(scene, n)
    pose[:, 1], twist[:, 1] = states[:, :3], states[:, 3:]
    return Trajectory(times, pose, twist, None, dt, "completed")


CELLS = [{}, {"ratio": 0.6}, {"ratio": 0.2}, {"ratio": 2.0}, {"ratio": 1.05, "lean": 45.0, "v": 5.0}]


@pytest.mark.parametrize("params", CELLS)
def test_rod_that_slides_or_jams(params):
    canonical, scene = made("painleve", **params)
    measured, truth = canonical.measure(scene, moved(scene, 1 / 960)), canonical.exact(scene)
    for name, value in truth.items():
        assert measured[name][0] == pytest.approx(value, abs=2e-4 if name == "slowed" else 1e-6), name


def test_critical_friction_of_the_rod():
    """And the impulse that stops the end is just within the cone there; for a thin rod as published."""
    for lean in (30.0, 60.0, 75.0):
        _, scene = made("painleve", ratio=0.3, lean=lean, v=50.0)
        p, rod = scene.params, scene.bodies[1]
        arm, turned = end_of(scene, rod.pose[2])
        push = np.array([-critical(p), 1.0])
        spin = (arm[0] * push[1] - arm[1] * push[0]) / rod.inertia
        assert 1.0 / rod.mass + turned[1] * spin == pytest.approx(0.0, abs=1e-9)
        _, impulse = jammed(scene)
        assert -impulse[0] / impulse[1] == pytest.approx(critical(p), rel=1e-9)
        c, s = math.cos(math.radians(lean)), math.sin(math.radians(lean))
        thin = {**p, "aspect": 1e-9}
        assert critical(thin) == pytest.approx((1.0 + 3.0 * c * c) / (3.0 * s * c), rel=1e-6)


@pytest.mark.parametrize("offset", [-0.5, 0.0, 0.5])
@pytest.mark.parametrize("late", [0.0, 1.0])
@pytest.mark.parametrize("dt", [1 / 60, DT, 1 / 960])
@pytest.mark.parametrize("params", [{}, {"ratio": 0.6}, {"ratio": 0.2}])
def test_step_orders_with_a_late_contact(params, dt, late, offset):
    canonical, scene = made("painleve", **params)
    assert failing(canonical, scene, moved(scene, dt, offset=offset, late=late)) == set()


def first_order(scene, dt):
    """Semi-implicit steps with the end held at the level of velocities: one contact solved exactly, slip or stick."""
    rod, mu = scene.bodies[1], scene.material("floor", "rod").friction
    pose, twist, rows = np.array(rod.pose), np.array(rod.twist), []
    inverse = np.diag([1.0 / rod.mass, 1.0 / rod.mass, 1.0 / rod.inertia])
    for _ in range(round(scene.duration / dt) + 1):
        rows.append((*pose, *twist))
        twist = twist + [0.0, -scene.params["g"] * dt, 0.0]
        arm, turned = end_of(scene, pose[2])
        if pose[1] + arm[1] <= 1e-12:
            contact = np.array([[1.0, 0.0, turned[0]], [0.0, 1.0, turned[1]]])
            w, u = contact @ inverse @ contact.T, contact @ twist
            impulse = np.linalg.solve(w, -u)
            if abs(impulse[0]) > mu * impulse[1]:
                normal = -u[1] / (w[1, 1] - mu * w[1, 0])
                impulse = np.array([-mu * normal, normal])
            if impulse[1] > 0.0:
                twist = twist + inverse @ contact.T @ impulse
        pose = pose + dt * twist
    r = np.array(rows)
    n = len(r)
    poses, twists = still(scene, n)
    poses[:, 1], twists[:, 1] = r[:, :3], r[:, 3:]
    return Trajectory(np.arange(n) * dt, poses, twists, None, dt, "completed")


@pytest.mark.parametrize("dt", [1 / 120, DT, 1 / 960])
@pytest.mark.parametrize("params", CELLS)
def test_a_step_of_first_order_passes(params, dt):
    canonical, scene = made("painleve", **params)
    assert failing(canonical, scene, first_order(scene, dt)) == set()


@pytest.mark.parametrize("size", SIZES)
def test_painleve_rod_with_wrong_friction_gravity_or_inertia(size):
    canonical, slides = made("painleve", ratio=0.6)
    dt = DT if size > 0.05 else 1 / 3840
    wrong = failing(canonical, slides, moved(slides, dt, mu=0.6 * critical(slides.params) * (1.0 - size)))
    assert size < 0.005 or wrong >= {"turning_time", "turning_spin"}
    dragged = moved(slides, dt)
    dragged.twist[:, 1, 0] -= 2.0 * size * np.linspace(0.0, 1.0, len(dragged.t))
    assert size < 0.005 or failing(canonical, slides, dragged) == {"slowed"}
    assert size < 0.005 or "turning_spin" in failing(canonical, slides, moved(slides, dt, heavy=1.0 + size))
    up = moved(slides)
    up.pose[20:30, 1, 1] += size
    assert failing(canonical, slides, up) == ({"lifted"})
    canonical, jams = made("painleve")
    assert size < 0.005 or "passing_spin" in failing(canonical, jams, moved(jams, dt, heavy=1.0 + 3.0 * size))
    assert size < 0.005 or "edge_moved" in failing(canonical, jams, moved(jams, dt, stick=1.0 - 3.0 * size))
    assert size < 0.005 or "passing_spin" in failing(canonical, jams, moved(jams, dt, stick=1.0 - size))


def test_painleve_rod_that_slides_or_stops_wrongly():
    canonical, jams = made("painleve")
    sliding = moved(made("painleve", ratio=0.6)[1], late=0.0)
    assert "edge_moved" in failing(canonical, jams, sliding)
    canonical, slides = made("painleve", ratio=0.6)
    stopped = moved(replace(jams, duration=slides.duration))
    assert failing(canonical, slides, stopped) >= {"turning_time", "turning_spin"}


@pytest.mark.parametrize(("params", "named"), [({"ratio": 0.6, "v": 1.0}, "v"), ({"v": 0.1}, "v"), ({"v": 20.0}, "v")])
def test_painleve_rod_in_neither_regime_refused(params, named):
    with pytest.raises(SceneError, match=rf"painleve\.{named}"):
        made("painleve", **params)


def test_duration_of_a_turn_reached_and_not_reached():
    assert turn(lambda angle, square: (-1.0, 0.0), 0.0, 1.0) is None

    def rates(angle, square):
        return math.sin(angle) + 0.3 * square, math.sqrt(square)

    def there(t, y):
        return y[0] - 0.9

    there.terminal = True
    found = solve_ivp(
        lambda t, y: [y[1], *rates(y[0], y[1] ** 2)], (0.0, 9.0), [0.3, 0.0, 0.0], "DOP853", events=there, rtol=1e-12,
        atol=1e-14,
    )  # fmt: skip
    ours = turn(rates, 0.3, 0.9)
    assert (ours.time, ours.spin, ours.gathered) == pytest.approx((found.t[-1], *found.y[1:, -1]), abs=1e-8)
