"""Boxes that fall over an edge, worked out by hand: how they start, forces they need, what is forgiven, numbers."""

import math

import numpy as np
import pytest
from planted import made, stated, still
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from adapters.scene import SceneError
from adapters.trajectory import Trajectory
from validation.catalogue import CATALOGUE
from validation.scenes import tilt_table
from validation.scenes.tilt_table import TOLD
from validation.truths.pivoting import Pivot, fall_checks

DT = 1 / 64


def near(value):
    """As near as 64 nodes tell the integral of a spin that begins at rest."""
    return pytest.approx(value, rel=1e-6)


# ---- a box on its edge: sides of 0.6 and 0.8 m, the centre 0.5 m from the edge, p^2 = 3 * 8/(4 * 0.5) = 12/s^2 ----

ON, START, END = Pivot(0.6, 0.8, 8.0), 0.1, 0.7


def fallen(start, spin=0.0, end=END):
    """Time and spin of phi'' = 12 sin(phi) at ``end``, and the integral of the square of its spin until then."""

    def there(t, y):
        return y[0] - end

    there.terminal = True
    found = solve_ivp(
        lambda t, y: [y[1], 12.0 * math.sin(y[0]), y[1] ** 2], (0.0, 9.0), [start, spin, 0.0], "DOP853", events=there,
        rtol=1e-12, atol=1e-14,
    )  # fmt: skip
    return found.t[-1], found.y[1, -1], found.y[2, -1]


TIME, SPIN, SQUARES = fallen(START)
TRUTH = {"passing_time": TIME, "passing_spin": SPIN, "edge_moved": 0.0}
#: rho dt/2 by the integral of w^2, and g dt^2.
CARRIED = 0.25 / 64 * SQUARES + 1 / 512


def test_allowance_of_a_fall_over_an_edge():
    found = stated(fall_checks(ON, START, END, DT, TRUTH))
    assert found == {
        "passing_time": ("s", near(1.5 / 64 + TIME * CARRIED / 0.5)),
        "passing_spin": ("rad/s", near(1.5 / 64 * 12.0 * math.sin(END) + 12.0 / (0.5 * SPIN) * CARRIED)),
        "edge_moved": ("m", near(CARRIED + 0.5e-12)),
    }
    # Of a step so short that nothing is left of it, round-off of the arm.
    short = {check.metric: check.bound for check in fall_checks(ON, START, END, 1e-13, TRUTH)}
    assert short["edge_moved"] == pytest.approx(0.5e-12 + 0.25e-13 * SQUARES, rel=1e-6)


@pytest.mark.parametrize(("tilted", "other"), [(0.02, 0.08), (0.095, 0.01), (0.5, 0.01)])
def test_coarse_start_allowance_as_time_of_another_start(tilted, other):
    """No start is nearer to the balance than a tenth of what was asked."""
    found = {check.metric: check.bound for check in fall_checks(ON, START, END, DT, TRUTH, tilted)}
    plain = {check.metric: check.bound for check in fall_checks(ON, START, END, DT, TRUTH)}
    later = fallen(other)[0] - TIME
    assert found == {**plain, "passing_time": near(plain["passing_time"] + later)}


def test_initial_spin_allowance_of_a_turning_start():
    time, spin, squares = fallen(START, 0.5)
    truth = {"passing_time": time, "passing_spin": spin, "edge_moved": 0.0}
    found = {check.metric: check.bound for check in fall_checks(ON, START, END, DT, truth, spin=0.5)}
    carried = 0.25 / 64 * squares + 1 / 512
    assert found == {
        "passing_time": near(1.5 / 64 + time * carried / 0.5 + ON.time_off(START, 0.5, END, DT)),
        "passing_spin": near(ON.spin_off(START, 0.5, END, DT)),
        "edge_moved": near(carried + 0.5e-12),
    }


@pytest.mark.parametrize(
    ("start", "angle", "top"), [(-0.4, 0.2, 0.0), (-0.2, 0.4, 0.0), (-0.4, -0.1, -0.1), (0.1, 0.5, 0.1)]
)
def test_box_too_slow_for_the_top(start, angle, top):
    """The spin that just gets over the top, and what a step may take of it: from there on the time is finite."""
    needed = math.sqrt(24.0 * (math.cos(top) - math.cos(start)))
    dt = 1e-4

    def taken(spin):
        return 1.5 * dt * 12.0 * math.sin(max(abs(start), abs(angle))) + 12.0 * (
            ON.carried_away(start, spin, angle, dt) + 8.0 * dt * dt
        ) / (0.5 * spin)

    enough = brentq(lambda spin: spin - taken(spin) - needed, needed + 1e-6, needed + 5.0, xtol=1e-12)
    assert math.isinf(ON.time_off(start, enough * (1.0 - 1e-6), angle, dt))
    assert math.isfinite(ON.time_off(start, enough * (1.0 + 1e-6), angle, dt))


# ---- a block on a tilted table ----


@pytest.mark.parametrize("dimension", [2, 3])
def test_block_on_the_table_under_tilted_gravity(dimension):
    """tan(theta) = 3/4 where both limits are 1: gravity is (6, -8) of 10."""
    _, scene = made("tilt_table", dimension, ratio=0.75, mu=1.0, aspect=1.0, height=2.0, g=10.0, mass=3.0)
    floor, block = scene.bodies
    assert (scene.name, scene.version, scene.duration) == ("tilt_table", 1, 2.0)
    assert scene.gravity == pytest.approx((6.0, *(0.0,) * (dimension - 2), -8.0))
    assert (floor.motion, block.name, block.mass) == ("fixed", "block", 3.0)
    assert block.shape.half_extents == (1.0,) * dimension and block.pose[dimension - 1] == 1.0
    assert block.twist == (0.0,) * (3 if dimension == 2 else 6) and not any(block.pose[: dimension - 1])
    assert (scene.pairs[0].restitution, scene.pairs[0].friction) == (0.0, 1.0)


def test_block_at_one_limit_and_at_both():
    assert set(CATALOGUE["tilt_table"].exact(made("tilt_table", ratio=1.0, mu=0.5, aspect=0.5)[1])) == {"moved"}
    with pytest.raises(SceneError, match=r"tilt_table\.ratio: at 2 "):
        made("tilt_table", ratio=2.0, mu=0.5, aspect=0.25)


def test_allowance_on_a_tilted_table():
    table = CATALOGUE["tilt_table"]
    fall = 9.81 / 4096
    _, stays = made("tilt_table", height=2.0)
    assert stated(table.checks(stays, DT)) == {"moved": ("m", pytest.approx(2.0 * fall + 2e-12, rel=1e-13))}
    _, slides = made("tilt_table", ratio=1.1, aspect=1.0)
    assert stated(table.checks(slides, DT)) == {
        "acceleration": ("m/s^2", near(0.01 * 9.81 / 64)),  # over the second of the two seconds
        "turned": ("m", near(fall)),
    }
    _, topples = made("tilt_table", ratio=1.1, height=2.0)
    on, theta = Pivot(0.6, 2.0, 9.81), math.atan(0.33)
    start = theta - math.atan(0.3)
    told = fall_checks(on, start, start + TOLD, DT, table.exact(topples), tilted=fall / 0.6)
    assert table.checks(topples, DT) == told and len(told) == 3


@pytest.mark.parametrize(("ratio", "aspect"), [(1.1, 0.3), (1.3, 0.1), (1.5, 0.2), (1.3, 0.06), (1.05, 0.05)])
def test_friction_for_a_toppling_block(ratio, aspect):
    """Force of the table from the acceleration of the centre, differenced from the path; 2 % of it decide."""
    theta, height = math.atan(ratio * aspect), 1.0
    alpha, arm, h = math.atan(aspect), 0.5 * math.hypot(aspect, height), 1e-4
    square = 0.75 * 9.81 / arm
    found = solve_ivp(
        lambda t, y: [y[1], square * math.sin(y[0])], (0.0, 9.0), [theta - alpha, 0.0], "DOP853", dense_output=True,
        rtol=1e-12, atol=1e-13, events=lambda t, y: y[0] - (theta - alpha + TOLD),
    )  # fmt: skip
    needed = 0.0
    for t in np.linspace(h, found.t_events[0][0], 60):
        turn = found.sol([t - h, t, t + h])[0] - theta  # of the diagonal against the table's normal
        place = arm * np.column_stack([np.sin(turn), np.cos(turn)])
        force = (place[0] - 2.0 * place[1] + place[2]) / h**2 - 9.81 * np.array([math.sin(theta), -math.cos(theta)])
        needed = max(needed, abs(force[0]) / force[1])
    least = max(needed, 1.001 * ratio * aspect)
    made("tilt_table", ratio=ratio, aspect=aspect, mu=1.02 * least)
    assert bool(needed > 1.03 * ratio * aspect) is (aspect < 0.1)  # slender ones need more on their way than to start
    if aspect < 0.1:
        with pytest.raises(SceneError, match=r"tilt_table\.mu"):
            made("tilt_table", ratio=ratio, aspect=aspect, mu=0.98 * needed)


def test_error_on_a_tilted_table():
    canonical, stays = made("tilt_table", height=2.0)
    error = canonical.primary.error
    assert error(stays, DT, {"moved": (0.5, "")}) == (pytest.approx(0.25), "")
    _, slides = made("tilt_table", ratio=1.1, aspect=1.0)
    a = 9.81 * (0.55 - 0.5) / math.hypot(1.0, 0.55)
    assert error(slides, DT, {"acceleration": (0.9 * a, "")}) == (pytest.approx(0.1), "")
    _, topples = made("tilt_table", ratio=1.1, height=2.0)
    time = canonical.exact(topples)["passing_time"]
    assert error(topples, DT, {"passing_time": (1.1 * time, "")}) == (pytest.approx(0.1), "")
    assert error(topples, DT, {"passing_time": (None, "never")}) == (None, "never")


def test_measures_on_a_tilted_table():
    """A block of 1.2 by 2 m: it goes 0.3 m and back, turns by 1/100, and its edge goes with it."""
    canonical, scene = made("tilt_table", 3, aspect=0.6, height=2.0, mu=2.0)
    t = np.arange(9) * DT
    pose, twist = still(scene, 9)
    pose[1, 1, :3] += (0.02, 0.0, 0.0)
    pose[3, 1, :3] += (0.1, 0.2, 0.2)
    pose[-1, 1, 3:] = (math.cos(0.005), 0.0, math.sin(0.005), 0.0)
    twist[:, 1, 0] = np.linspace(0.0, 8.0 * DT, 9) ** 2
    corner = math.sqrt(0.6**2 + 0.6**2 + 1.0)
    assert canonical.measure(scene, Trajectory(t, pose, twist, None, DT, "completed")) == {
        "moved": (pytest.approx(0.3 + 0.01 * corner), ""),
        "acceleration": (pytest.approx((8.0**2 - 4.0**2) * DT**2 / (4.0 * DT)), ""),
        "turned": (pytest.approx(0.01 * corner), ""),
        "passing_time": (None, "it never arrives there"),
        "passing_spin": (None, "it never arrives there"),
        "edge_moved": (pytest.approx(0.3), ""),
    }
    # Turned by a tenth about its own centre, the edge goes a tenth of its distance from there, 1.17 m.
    turned = np.array([[body.pose for body in scene.bodies]] * 9)
    turned[3, 1, 3:] = (math.cos(0.05), 0.0, math.sin(0.05), 0.0)
    found = canonical.measure(scene, Trajectory(t, turned, twist, None, DT, "completed"))
    assert found["edge_moved"] == (pytest.approx(2.0 * math.sin(0.05) * math.hypot(0.6, 1.0)), "")
    # The edge counts until the angle is passed, here between the samples 5 and 6, and to the end if it is not.
    tilted = pose.copy()
    tilted[-1, 1, :3] += (9.0, 0.0, 0.0)
    assert canonical.measure(scene, Trajectory(t, tilted, twist, None, DT, "completed"))["edge_moved"][0] > 8.0
    tilted[6:, 1, 3:] = (math.cos(0.2), 0.0, math.sin(0.2), 0.0)
    found = canonical.measure(scene, Trajectory(t, tilted, twist, None, DT, "completed"))
    assert 5.0 * DT < found["passing_time"][0] < 6.0 * DT and found["edge_moved"] == (pytest.approx(0.3), "")


@pytest.mark.parametrize(
    ("start", "spin", "end"), [(0.1, 0.0, 0.6), (0.1, 1.5, 0.6), (-0.3, 2.0, 0.5), (0.0, 0.3, 0.4)]
)
def test_time_of_a_fall_by_its_equation_of_motion(start, spin, end):
    """phi'' = r sin(phi), integrated in time until the angle is passed; r is the rate of a pendulum upside down."""
    on = Pivot(0.5, 1.0, 9.81)

    def passed(t, y):
        return y[0] - end

    passed.terminal = True
    found = solve_ivp(
        lambda t, y: [y[1], on.rate * math.sin(y[0])], (0.0, 10.0), [start, spin], "DOP853", events=passed, rtol=1e-11,
        atol=1e-12,
    )  # fmt: skip
    assert on.time(start, spin, end) == pytest.approx(found.t[-1], rel=1e-8)
    assert on.speed(start, spin, end) == pytest.approx(found.y[1, -1], rel=1e-8)


def test_round_off_allowed_of_a_zero_step():
    """No kick is owed at the start where none is told: what is left grows with the step alone."""
    for dt in (1e-6, 1e-9):
        assert ON.spin_off(START, 1.0, END, dt) < 1e2 * dt and ON.time_off(START, 1.0, END, dt) < 1e2 * dt
    truth = {"passing_time": ON.time(START, 0.0, END), "passing_spin": ON.speed(START, 0.0, END), "edge_moved": 0.0}
    (_, _, moved) = fall_checks(ON, START, END, 1e-18, truth)
    assert moved.bound >= 0.5e-12, "the edge is told to the round-off of the arm of 0.5 m, 1e-12 of it"


@pytest.mark.parametrize("ratio", [0.5, 1.5])
def test_friction_along_a_tilted_table(monkeypatch, ratio):
    """What a force across and up in space is along and against a table that falls to the right by its angle."""
    canonical = CATALOGUE["tilt_table"]
    p = canonical.complete({"ratio": ratio})
    turned = tilt_table.angle(p)
    for along in np.linspace(-0.9, 0.9, 13):
        for against in (0.5, 1.0, 2.0):
            across = along * math.cos(turned) + against * math.sin(turned)
            up = -along * math.sin(turned) + against * math.cos(turned)
            monkeypatch.setattr(Pivot, "grip", lambda *asked, found=(across, up): found)
            assert tilt_table._held(p, ON, 0.0, 0.1) is (abs(along) <= p["mu"] * against)
