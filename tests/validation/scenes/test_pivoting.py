"""Boxes that fall over an edge and rock: truths against integrated motion and equations of impact; faults of sizes."""

import math
from dataclasses import replace

import numpy as np
import pytest
from planted import failing, made, still
from scipy.integrate import solve_ivp

from adapters.scene import SceneError
from adapters.trajectory import Trajectory
from validation.truths.pivoting import Pivot

DT = 1 / 240
SIZES = [0.1, 0.01, 0.001]


def recorded(scene, times, place, tilt, velocity, spin, dt=DT):
    """A record of a body's centre (s, 2), tilt, velocity and spin in the upright plane."""
    d, n = scene.dimension, len(times)
    pose, twist = still(scene, n)
    if d == 2:
        pose[:, 1] = np.column_stack([place, tilt])
        twist[:, 1] = np.column_stack([velocity, spin])
    else:
        pose[:, 1, [0, 2]], pose[:, 1, 1] = place, 0.0
        zero = np.zeros(n)
        pose[:, 1, 3:] = np.column_stack([np.cos(tilt / 2), zero, -np.sin(tilt / 2), zero])
        twist[:, 1, [0, 2]], twist[:, 1, 4] = velocity, -spin
    return Trajectory(times, pose, twist, None, dt, "completed")


# ---- a fall over an edge ----


def lagrange(width, height, g, inertia_share=1.0):
    """phi'' of a box that turns about a fixed edge, from its moment about that edge by adding up its own elements."""
    x, y = np.meshgrid((np.arange(400) + 0.5) / 400 * width, (np.arange(400) + 0.5) / 400 * height)
    about_edge = float((x**2 + y**2).mean())
    rho = 0.5 * math.hypot(width, height)
    own = about_edge - rho**2
    return g * rho / (rho**2 + inertia_share * own)


def fallen(scene, dt=DT, offset=0.0, late=0.0, g=None, inertia_share=1.0, edge=0.0):
    """A fall about the edge, DOP853; ``offset`` in steps of what a step order shows, ``edge`` [m] that it slips."""
    p = scene.params
    width, height = p["aspect"] * p["height"], p["height"]
    alpha, rho = math.atan2(width, height), 0.5 * math.hypot(width, height)
    square = lagrange(width, height, p["g"] if g is None else g, inertia_share)
    start = [math.radians(p["from"]), 0.0]
    times = np.arange(round(scene.duration / dt) + 1) * dt
    found = solve_ivp(
        lambda t, y: [y[1], square * math.sin(y[0])], (0.0, times[-1] + 1.0), start, "DOP853", dense_output=True,
        rtol=1e-12, atol=1e-13,
    )  # fmt: skip
    phi, spin = found.sol(np.maximum(0.0, times - late + offset * dt * (times > 0.0)))
    spin[times < late] = 0.0
    place = rho * np.column_stack([np.sin(phi), np.cos(phi)])
    place[:, 0] += np.linspace(0.0, edge, len(times))
    velocity = rho * spin[:, None] * np.column_stack([np.cos(phi), -np.sin(phi)])
    return recorded(scene, times, place, -phi - alpha, velocity, -spin, dt)


CELLS = [{}, {"from": 1.0, "to": 30.0}, {"aspect": 0.2, "from": 1.0, "to": 60.0, "mu": 3.0}]


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("params", CELLS[:2])
def test_fall_of_a_box_over_its_edge(params, dimension):
    canonical, scene = made("pivot", dimension, **params)
    measured, truth = canonical.measure(scene, fallen(scene)), canonical.exact(scene)
    assert measured["passing_time"][0] == pytest.approx(truth["passing_time"], rel=2e-5)  # elements of 1/400
    assert measured["passing_spin"][0] == pytest.approx(truth["passing_spin"], rel=2e-5)
    assert measured["edge_moved"][0] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("offset", [-0.5, 0.0, 0.5])
@pytest.mark.parametrize("late", [0.0, 1.0])
@pytest.mark.parametrize("dt", [1 / 60, DT, 1 / 960])
def test_step_orders_and_late_contacts_pass(dt, late, offset):
    canonical, scene = made("pivot")
    assert failing(canonical, scene, fallen(scene, dt, offset, late * dt)) == set()


def first_order(scene, dt):
    """A semi-implicit step with the edge held in velocity only: what any solver of first order does of it."""
    p = scene.params
    width, height = p["aspect"] * p["height"], p["height"]
    own, tilt, rows = (width**2 + height**2) / 12.0, scene.bodies[1].pose[2], []
    place, velocity, spin = np.array(scene.bodies[1].pose[:2]), np.zeros(2), 0.0
    for _ in range(round(scene.duration / dt) + 1):
        rows.append((*place, tilt, *velocity, spin))
        velocity = velocity + [0.0, -p["g"] * dt]
        c, s = math.cos(tilt), math.sin(tilt)
        arm = np.array([c * 0.5 * width + s * 0.5 * height, s * 0.5 * width - c * 0.5 * height])
        gap = place[1] + arm[1]
        if gap <= 1e-12:
            # Both velocities of the edge to zero, by the impulse that does it.
            moved = velocity + spin * np.array([-arm[1], arm[0]])
            k = np.eye(2) + np.outer([-arm[1], arm[0]], [-arm[1], arm[0]]) / own
            impulse = -np.linalg.solve(k, moved)
            velocity, spin = velocity + impulse, spin + (arm[0] * impulse[1] - arm[1] * impulse[0]) / own
        place, tilt = place + dt * velocity, tilt + dt * spin
    r = np.array(rows)
    return recorded(scene, np.arange(len(r)) * dt, r[:, :2], r[:, 2], r[:, 3:5], r[:, 5], dt)


@pytest.mark.parametrize("params", [{}, {"from": 1.0, "to": 30.0}, {"aspect": 0.2, "from": 5.0}])
@pytest.mark.parametrize("dt", [1 / 60, 1 / 120, DT, 1 / 960])
def test_a_step_of_first_order_passes(params, dt):
    canonical, scene = made("pivot", **params)
    assert failing(canonical, scene, first_order(scene, dt)) == set()


@pytest.mark.parametrize("size", SIZES)
def test_pivoting_fall_with_wrong_gravity_inertia_slip_or_twist(size):
    canonical, scene = made("pivot", 3)
    assert failing(canonical, scene, fallen(scene)) == set()
    assert size < 0.05 or "passing_time" in failing(canonical, scene, fallen(scene, g=9.81 * (1.0 - size)))
    heavy = failing(canonical, scene, fallen(scene, 1 / 3840, inertia_share=1.0 + size))
    assert size < 0.05 or heavy >= {"passing_spin", "passing_time"}
    fine = fallen(scene, 1 / 3840, g=9.81 * (1.0 - size))
    assert size < 0.005 or failing(canonical, scene, fine) >= {"passing_time", "passing_spin"}
    assert failing(canonical, scene, fallen(scene, edge=5.0 * size)) == {"edge_moved"}
    twisting = fallen(scene)
    twisting.twist[5, 1, 3] = size
    assert failing(canonical, scene, twisting) == {"twisted"}


def test_box_that_stops_before_the_edge():
    canonical, scene = made("pivot")
    still = fallen(scene)
    still = replace(still, pose=np.repeat(still.pose[:1], len(still.t), axis=0))
    assert canonical.measure(scene, still)["passing_time"] == (None, "it never arrives there")


@pytest.mark.parametrize(
    ("params", "named"),
    [({"to": 5.0}, "pivot.to"), ({"to": 62.0, "mu": 9.0}, "pivot.to"), ({"mu": 0.3}, "pivot.mu")],
)
def test_motion_other_than_a_fall_over_an_edge_refused(params, named):
    with pytest.raises(SceneError, match=named):
        made("pivot", **params)


def test_friction_at_an_edge_by_the_centre_s_motion():
    """The force on the centre from its acceleration, differenced from the path, over the weight."""
    on, start, h = Pivot(0.5, 1.0, 9.81), 0.1, 1e-4
    for angle in (0.3, 0.6, 0.9):
        t = on.time(start, 0.0, angle)
        found = solve_ivp(
            lambda t, y: [y[1], on.rate * math.sin(y[0])], (0.0, t + h), [start, 0.0], "DOP853", rtol=1e-13,
            atol=1e-14, dense_output=True,
        )  # fmt: skip
        place = [on.arm * np.array([math.sin(phi), math.cos(phi)]) for phi in found.sol([t - h, t, t + h])[0]]
        acceleration = (place[0] - 2.0 * place[1] + place[2]) / h**2
        assert on.grip(start, 0.0, angle) == pytest.approx(
            (acceleration[0] / 9.81, 1.0 + acceleration[1] / 9.81), abs=1e-5
        )


@pytest.mark.parametrize("off", [0.0, 0.01])
@pytest.mark.parametrize(("start", "angle"), [(-0.4, 0.2), (-0.4, -0.1), (0.1, 0.5)])
def test_initial_spin_allowance_as_of_a_shifted_start(start, angle, off):
    """Another spin at the start by 1.5 steps of acceleration, an edge that sinks, and 1.5 steps where it is read."""
    on, spin, dt = Pivot(0.5, 1.0, 9.81), 1.5, DT
    kick = off + 1.5 * dt * on.rate * math.sin(max(abs(start), abs(angle)))
    sinks = on.carried_away(start, spin, angle, dt) + 9.81 * dt * dt
    true = on.speed(start, spin, angle)
    faster = math.sqrt(on.speed(start, spin + kick, angle) ** 2 + 2.0 * on.rate * sinks / on.arm)
    read = 1.5 * dt * on.rate * abs(math.sin(angle))
    assert on.spin_off(start, spin, angle, dt, off) == pytest.approx(faster - true + read)
    slower = on.time(start, spin - kick, angle) - on.time(start, spin, angle)
    assert slower < on.time_off(start, spin, angle, dt, off) < 2.0 * slower
    assert math.isinf(on.time_off(-0.4, 0.01, 0.2, dt)), "one that slow does not get there"


# ---- a block that rocks ----


def landing(width, height, spin):
    """Spin after a landing, from the equations: both edges' impulses, the old edge lets go, the new one is held."""
    own = (width**2 + height**2) / 12.0
    # Turning clockwise about the right lower edge before: velocity of the centre.
    before = np.array([-0.5 * height * spin, 0.5 * width * spin, spin]) * [1.0, -1.0, 1.0]
    arm = np.array([-0.5 * width, -0.5 * height])  # of the left lower edge, held afterwards
    rows = np.array([[1.0, 0.0, -arm[1]], [0.0, 1.0, arm[0]]])
    mass = np.diag([1.0, 1.0, own])
    system = np.block([[mass, -rows.T], [rows, np.zeros((2, 2))]])
    return np.linalg.solve(system, [*(mass @ before), 0.0, 0.0])[2]


@pytest.mark.parametrize("aspect", [0.15, 0.25, 0.5, 1.0, 1.3])
def test_state_after_a_landing_by_the_equations_of_impact(aspect):
    _, scene = made("rocking_block", aspect=aspect, mu=5.0)
    from validation.scenes.rocking_block import eta

    assert landing(aspect, 1.0, 1.0) == pytest.approx(eta(scene.params), abs=1e-12)


def rocking(scene, dt=DT, eta=None, late=0.0, g=None):
    """Swings about either edge by DOP853, landings by their equations, ``late`` in steps after the block is flat."""
    p = scene.params
    width, height = p["aspect"] * p["height"], p["height"]
    alpha, rho = math.atan2(width, height), 0.5 * math.hypot(width, height)
    square = 0.75 * (p["g"] if g is None else g) / rho
    keep = landing(width, height, 1.0) if eta is None else eta
    times = np.arange(round(scene.duration / dt) + 1) * dt
    theta, spin, since, side = p["tilt"] * alpha, 0.0, 0.0, 1.0
    tilts, spins = np.zeros(len(times)), np.zeros(len(times))

    def flat(t, y):
        return y[0] + late * dt * abs(y[1])

    flat.terminal, flat.direction = True, -1
    for _ in range(8):
        found = solve_ivp(
            lambda t, y: [y[1], -square * math.sin(alpha - y[0])], (since, times[-1] + dt), [theta, spin], "DOP853",
            dense_output=True, events=flat, rtol=1e-12, atol=1e-13,
        )  # fmt: skip
        here = (times >= since) & (times <= found.t[-1])
        tilts[here], spins[here] = side * found.sol(times[here])
        if found.t[-1] >= times[-1]:
            break
        # Turned too far it is tilted to the other side already, about an edge that lies as deep.
        since, theta, spin, side = found.t[-1], -found.y[0, -1] + 1e-13, -keep * found.y[1, -1], -side
    left = tilts >= 0.0
    edge = np.where(left, 0.0, width)
    angle = alpha - np.abs(tilts)
    across = np.where(left, 1.0, -1.0)
    place = np.column_stack([edge + across * rho * np.sin(angle), rho * np.cos(angle)])
    return recorded(scene, times, place, tilts, np.zeros_like(place), spins, dt)


@pytest.mark.parametrize("params", [{}, {"aspect": 0.5, "tilt": 0.7}, {"aspect": 0.15, "tilt": 0.3}])
def test_swings_and_landings_are_housner_s(params):
    canonical, scene = made("rocking_block", **params)
    measured = canonical.measure(scene, rocking(scene, 1 / 960))
    for name, truth in canonical.exact(scene).items():
        # Tops are told by samples, p^2 sin(alpha) dt^2/8; landings by a line where the path has a kink, a share of dt;
        # at the end the block is not quite flat.
        near = {"amplitude": 2e-5, "landing": 0.2 / 960, "slid": 1e-3}[name.partition("[")[0]]
        assert measured[name][0] == pytest.approx(truth, abs=near), name


@pytest.mark.parametrize("late", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("dt", [1 / 60, DT, 1 / 960])
@pytest.mark.parametrize("params", [{}, {"aspect": 0.5, "tilt": 0.7}])
def test_landings_that_are_found_late_pass(params, dt, late):
    canonical, scene = made("rocking_block", **params)
    assert failing(canonical, scene, rocking(scene, dt, late=late)) == set()


@pytest.mark.parametrize("dt", [1 / 30, 1 / 60, 1 / 960])
@pytest.mark.parametrize("params", [{"aspect": 0.1, "tilt": 0.5}, {"aspect": 0.1, "tilt": 0.95}])
def test_largest_tilt_allowed_at_coarse_steps(params, dt):
    """A tilt between upright and balance is as far off as either of them at most."""
    canonical, scene = made("rocking_block", **params)
    truth, alpha = canonical.exact(scene), math.atan(params["aspect"])
    tops = {c.metric: c for c in canonical.checks(scene, dt) if c.metric.startswith("amplitude")}
    assert len(tops) == 3
    for metric, check in tops.items():
        top = truth[metric]
        assert 0.0 < top < alpha and 0.0 < check.bound <= max(top, alpha - top) * (1.0 + 1e-9)


@pytest.mark.parametrize("size", SIZES)
def test_pivoting_with_excess_speed_or_a_sliding_block(size):
    canonical, scene = made("rocking_block")
    keep = landing(2.5, 10.0, 1.0)
    wrong = failing(canonical, scene, rocking(scene, 1 / 3840, eta=keep * (1.0 - size)))
    assert size < 0.005 or "amplitude[1]" in wrong
    assert size < 0.05 or {"amplitude[1]", "amplitude[2]", "landing[2]"} <= failing(
        canonical, scene, rocking(scene, eta=keep * (1.0 - size))
    )
    assert size < 0.05 or "landing[1]" in failing(canonical, scene, rocking(scene, g=9.81 * (1.0 - size)))
    slid = rocking(scene)
    slid.pose[-1, 1, 0] += 5.0 * size
    assert failing(canonical, scene, slid) == {"slid"}


def test_lying_block_without_landings():
    canonical, scene = made("rocking_block")
    still = rocking(scene)
    still = replace(still, pose=np.repeat(still.pose[:1], len(still.t), axis=0))
    assert canonical.measure(scene, still)["landing[1]"] == (None, "it lands less than 1 times")


@pytest.mark.parametrize(("params", "named"), [({"mu": 0.1}, "rocking_block.mu")])
def test_refusal_of_a_block_that_slides_where_it_lands(params, named):
    with pytest.raises(SceneError, match=named):
        made("rocking_block", **params)
