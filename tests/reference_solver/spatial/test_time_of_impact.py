"""First contacts of moving bodies against closed forms, fine scans, and walls that nothing may pass."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from reference_solver import Body, Box, Capsule, HalfSpace, Model, Sphere
from reference_solver.compilation import from_python, kernel
from reference_solver.needs import EVERYTHING
from reference_solver.spatial.flight import place_at
from reference_solver.spatial.meeting import allocate_meeting, turn_bounds
from reference_solver.spatial.motion import initialise
from reference_solver.spatial.state import MANIFOLD, allocate_bodies
from reference_solver.spatial.time_of_impact import begin_paths, is_pressed
from reference_solver.stepping.time_of_impact import bend_bound, first_contact

G = 9.81
SIGNS = np.array(list(itertools.product((-1, 1), repeat=3)))


def moving(shape, place, velocity=(0.0, 0.0, 0.0), spin=(0.0, 0.0, 0.0), turn=(1.0, 0.0, 0.0, 0.0), moments=(1.0,) * 3):
    turn = np.asarray(turn, float) / np.linalg.norm(turn)
    return Body(shape, 1.0, moments, (*place, *turn), (*velocity, *spin))


def still(shape, place=(0.0, 0.0, 0.0), **fields):
    return Body(shape, pose=(*place, 1.0, 0.0, 0.0, 0.0), **({"motion": "fixed"} | fields))


def flying(*bodies, acceleration=()):
    """Records of the bodies with these accelerations, each at the start of its path."""
    records = allocate_bodies(Model(3, bodies, (0.0, 0.0, 0.0), 0.0, 0.0), EVERYTHING)
    initialise(records)
    for i, a in enumerate(acceleration):
        records.rate[i, :3] = a
    return records


def impact(a, b, duration, acceleration=()):
    records = flying(a, b, acceleration=acceleration)
    meeting = allocate_meeting(records)
    begin_paths(records, meeting.paths, duration)
    return first_contact(meeting, 0, 1, 0.0, duration)


FLOOR = still(HalfSpace((0.0, 0.0, 1.0)))
DOWN = ((0.0, 0.0, 0.0), (0.0, 0.0, -G))


@pytest.mark.parametrize("shape", [Sphere(0.5), Box((0.3, 0.4, 0.5))])
@pytest.mark.parametrize(("height", "speed"), [(1.0, 0.0), (1e-6, 0.0), (0.3, 2.0), (0.3, -2.0), (50.0, -100.0)])
def test_a_falling_body_reaches_the_floor_when_the_parabola_does(shape, height, speed):
    time = impact(FLOOR, moving(shape, (0.2, 0.1, 0.5 + height), (3.0, 0.0, speed)), 100.0, DOWN)
    root = math.sqrt(speed**2 + 2 * G * height)
    expected = 2 * height / (root - speed) if speed <= 0 else (speed + root) / G
    # The gap is a difference of numbers of size 0.5 + height: a few units in their last place over the impact speed.
    assert abs(time - expected) <= 1e-15 * (0.5 + height) / root + 1e-15 * expected


@pytest.mark.parametrize("shape", [Sphere(0.5), Box((0.3, 0.4, 0.5))])
@pytest.mark.parametrize("speed", [1e-3, 1.0, 300.0])
def test_a_rebound_returns_after_twice_its_speed_over_gravity(shape, speed):
    time = impact(FLOOR, moving(shape, (0.2, 0.1, 0.5), (0.0, 0.0, speed)), 100.0, DOWN)
    assert time == pytest.approx(2 * speed / G, rel=1e-14, abs=1e-15 / speed)
    assert impact(FLOOR, moving(shape, (0.2, 0.1, 0.5), (0.0, 0.0, speed)), speed / G, DOWN) == math.inf


def test_bodies_that_rest_or_part_are_not_met():
    assert impact(FLOOR, moving(Box((0.5,) * 3), (0.0, 0.0, 0.5)), 1.0) == math.inf
    assert impact(FLOOR, moving(Box((0.5,) * 3), (0.0, 0.0, 0.5), (0.0, 0.0, 1.0)), 1.0) == math.inf
    assert impact(moving(Sphere(0.5), (0, 0, 0)), moving(Sphere(0.5), (1.0, 0, 0), (0.0, 1.0, 0.0)), 9.0) == math.inf


@pytest.mark.parametrize("miss", [0.0, 0.3, 0.9])
@pytest.mark.parametrize("fall", [0.0, G])
def test_spheres_meet_when_their_distance_is_the_sum_of_radii(miss, fall):
    """Distance 10, side step ``miss``: x = 10 - sqrt(1 - miss^2) at 8 m/s, whatever both fall."""
    a = moving(Sphere(0.4), (0.0, 0.0, 0.0), (3.0, 1.0, -2.0))
    b = moving(Sphere(0.6), (10.0, miss, 0.0), (-5.0, 1.0, -2.0))
    time = impact(a, b, 9.0, ((0.0, 0.0, -fall),) * 2)
    slope = math.sqrt(1 - miss**2)  # how the distance changes with the position along the way
    assert time == pytest.approx((10.0 - slope) / 8.0, abs=4e-15 / slope)


def test_spheres_under_different_loads_meet_at_the_first_root_of_a_quartic():
    """One rests, the other falls past it: (x + v t + a t^2 / 2)^2 = R^2."""
    x, v, a = np.array([0.5, 0.2, 3.0]), np.array([0.3, -0.1, 1.0]), np.array([0.0, 0.0, -G])
    time = impact(moving(Sphere(0.5), (0.0, 0.0, 0.0)), moving(Sphere(0.5), x, v), 9.0, (np.zeros(3), a))
    quartic = sum(np.convolve(c, c) for c in np.column_stack([0.5 * a, v, x]))
    roots = np.roots(quartic - np.array([0.0, 0.0, 0.0, 0.0, 1.0]))
    first = roots[(abs(roots.imag) < 1e-12) & (roots.real > 0)].real.min()
    assert time == pytest.approx(first, rel=1e-12)  # numpy's roots of a quartic, not ours, set this


def test_a_turning_box_lands_on_its_corner():
    """Half extents (a, ., c) turning about y: the lowest corner is a |sin| + c |cos| under the centre."""
    a, c, rate = 0.7, 0.2, 9.0
    box = moving(Box((a, 0.3, c)), (0.0, 0.0, 2.0), (0.0, 0.0, -1.0), (0.0, rate, 0.0))
    time = impact(FLOOR, box, 5.0, DOWN)

    def height(t):
        return 2.0 - t - 0.5 * G * t**2 - a * abs(math.sin(rate * t)) - c * abs(math.cos(rate * t))

    grid = np.linspace(0, 1, 100_001)
    late = grid[np.argmax([height(t) < 0 for t in grid])]
    assert time == pytest.approx(brentq(height, late - 1e-5, late, xtol=1e-16), abs=2e-15)


def test_a_turning_half_space_sweeps_up_a_sphere():
    """A wall through the origin turning about z meets a sphere at distance d when sin(w t) d = R."""
    wall = still(HalfSpace((0.0, 1.0, 0.0)), motion="prescribed", twist=(0, 0, 0, 0, 0, 2.0))
    time = impact(wall, moving(Sphere(0.5), (3.0, 3.0, 0.0)), 5.0)
    # Height over the wall at angle w t: 3 cos - 3 sin = 0.5
    assert time == pytest.approx(0.5 * (math.acos(0.5 / (3 * math.sqrt(2))) - math.pi / 4), rel=1e-14)


numbers = st.floats(-1.0, 1.0).map(lambda x: round(x, 3))
vectors = st.tuples(numbers, numbers, numbers)
turns = st.tuples(numbers, numbers, numbers, numbers).filter(lambda q: math.hypot(*q) > 0.1)
halves = st.tuples(*[st.floats(0.2, 1.0).map(lambda x: round(x, 2))] * 3)


def rotation(turn):
    return Rotation.from_quat([*turn[1:], turn[0]])


def corners(half, start, turn, velocity, spin, acceleration, t):
    """Corners of a box with equal moments at time t, and its axes, by another library's rotations."""
    r = (Rotation.from_rotvec(np.multiply(spin, t)) * rotation(turn)).as_matrix()
    centre = np.asarray(start) + np.multiply(velocity, t) + 0.5 * t**2 * np.asarray(acceleration)
    return centre + (SIGNS * half) @ r.T, r


def overlap_depth(first, second):
    """Largest gap over the fifteen axes of two boxes; > 0 is apart."""
    (pa, ra), (pb, rb) = first, second
    axes = [*ra.T, *rb.T] + [np.cross(u, v) for u in ra.T for v in rb.T]
    gaps = []
    for n in axes:
        size = np.linalg.norm(n)
        if size > 1e-6:
            ha, hb = pa @ n / size, pb @ n / size
            gaps.append(max(hb.min() - ha.max(), ha.min() - hb.max()))
    return max(gaps)


@given(halves, halves, vectors, vectors, vectors, vectors, turns, turns)
@hypothesis_settings(max_examples=15)
def test_boxes_are_apart_until_the_time_of_impact_and_touch_there(ha, hb, away, velocity, spin_a, spin_b, ta, tb):
    place, velocity = 3.0 * np.array(away), 4.0 * np.array(velocity)
    spin_a, spin_b, fall = 5.0 * np.array(spin_a), 5.0 * np.array(spin_b), (0.0, 0.0, -G)
    ta, tb = np.array(ta) / np.linalg.norm(ta), np.array(tb) / np.linalg.norm(tb)

    def depth(t):
        first = corners(ha, (0, 0, 0), ta, (0, 0, 0), spin_a, (0, 0, 0), t)
        return overlap_depth(first, corners(hb, place, tb, velocity, spin_b, fall, t))

    assume(depth(0.0) > 1e-6)
    a, b = moving(Box(ha), (0, 0, 0), (0, 0, 0), spin_a, ta), moving(Box(hb), place, velocity, spin_b, tb)
    end = 1.5
    time = impact(a, b, end, ((0, 0, 0), fall))
    assert min(depth(t) for t in np.linspace(0.0, min(time, end), 150)) >= -1e-13
    if time < end:
        assert abs(depth(time)) <= 1e-13  # round-off of places up to 20 m, and of two libraries' rotations


@given(halves, vectors, vectors, vectors, turns)
@hypothesis_settings(max_examples=15)
def test_a_sphere_is_clear_of_a_turning_box_until_they_touch(half, away, velocity, spin, turn):
    place, velocity, spin = 3.0 * np.array(away), 4.0 * np.array(velocity), 5.0 * np.array(spin)
    turn, radius, fall = np.array(turn) / np.linalg.norm(turn), 0.3, (0.0, 0.0, -G)

    def gap(t):
        r = (Rotation.from_rotvec(spin * t) * rotation(turn)).as_matrix()
        local = r.T @ (place + velocity * t + 0.5 * t**2 * np.array(fall))
        return np.linalg.norm(local - np.clip(local, -np.array(half), half)) - radius

    assume(gap(0.0) > 1e-6)
    box, ball = moving(Box(half), (0, 0, 0), (0, 0, 0), spin, turn), moving(Sphere(radius), place, velocity)
    time = impact(ball, box, 1.5, (fall, (0, 0, 0)))
    assert min(gap(t) for t in np.linspace(0.0, min(time, 1.5), 500)) >= -1e-13
    if time < 1.5:
        assert abs(gap(time)) <= 1e-13


def segment_gap(p, e, q, g):
    """Distance of two segments (middle, half vector), by halving intervals of a convex function of one parameter."""

    def nearest(x):
        start = p + x * e - q
        return np.linalg.norm(start - np.clip(start @ g / (g @ g), -1, 1) * g)

    low, high = -1.0, 1.0
    for _ in range(100):
        third = (high - low) / 3
        if nearest(low + third) < nearest(high - third):
            high -= third
        else:
            low += third
    return nearest(0.5 * (low + high))


@given(vectors, vectors, vectors, vectors, turns, turns)
@hypothesis_settings(max_examples=15)
def test_capsules_are_clear_until_they_touch(away, velocity, spin_a, spin_b, ta, tb):
    place, velocity = 3.0 * np.array(away), 4.0 * np.array(velocity)
    spin_a, spin_b, fall = 5.0 * np.array(spin_a), 5.0 * np.array(spin_b), np.array((0.0, 0.0, -G))
    ta, tb = np.array(ta) / np.linalg.norm(ta), np.array(tb) / np.linalg.norm(tb)

    def gap(t):
        e = 0.5 * (Rotation.from_rotvec(spin_a * t) * rotation(ta)).as_matrix()[:, 0]
        g = 0.8 * (Rotation.from_rotvec(spin_b * t) * rotation(tb)).as_matrix()[:, 0]
        return segment_gap(np.zeros(3), e, place + velocity * t + 0.5 * t**2 * fall, g) - 0.3

    assume(gap(0.0) > 1e-6)
    a = moving(Capsule(0.5, 0.2), (0, 0, 0), (0, 0, 0), spin_a, ta)
    time = impact(a, moving(Capsule(0.8, 0.1), place, velocity, spin_b, tb), 1.5, ((0, 0, 0), fall))
    assert min(gap(t) for t in np.linspace(0.0, min(time, 1.5), 60)) >= -1e-13
    if time < 1.5:
        assert abs(gap(time)) <= 1e-13


@pytest.mark.parametrize("size", [1e-4, 1.0, 1e4])
@pytest.mark.parametrize("lengths_per_second", [1.0, 1e3, 1e6])
@pytest.mark.parametrize("spin", [(0.0, 0.0, 0.0), (3.0, -50.0, 20.0)])
@pytest.mark.parametrize("round_body", [True, False])
def test_nothing_passes_a_thin_wall(size, lengths_per_second, spin, round_body):
    """A wall of a thousandth of the body's size, met within one step of a sixtieth of a second, or not yet."""
    half = (0.3 * size, 0.4 * size, 0.5 * size)
    wall = still(Box((0.0005 * size, 100.0 * size, 100.0 * size)))
    speed = lengths_per_second * size
    body = moving(Sphere(0.5 * size) if round_body else Box(half), (-2.0 * size, 0, 0), (speed, 0, 0), spin)
    time = impact(wall, body, 1.0 / 60.0)
    if speed < 60.0 * 1.4 * size:
        assert time == math.inf
        return
    place = -2.0 * size + speed * time
    if round_body:
        reach = 0.5 * size
    else:
        reach = (SIGNS * half @ Rotation.from_rotvec(np.array(spin) * time).as_matrix().T)[:, 0].max()
    # 1e-15: round-off of the place at impact, some units in the last place of 2 sizes
    assert place + reach == pytest.approx(-0.0005 * size, abs=2e-15 * size)


@kernel
def bounds(meeting):
    return turn_bounds(meeting, 0, 0.0, 1.0)


@pytest.mark.parametrize("moments", [(1.0, 2.0, 2.9), (0.1, 2.0, 2.0), (1.0, 1.1, 1.2)])
@pytest.mark.parametrize("spin", [(0.1, 10.0, 0.2), (5.0, 5.0, -5.0), (0.0, 0.01, 10.0)])
def test_a_free_body_never_turns_faster_than_its_bound(moments, spin):
    """|w| stays below |L| / I_min, |dw/dt| below its square, over a tumble of two seconds."""
    body = moving(Box((0.5,) * 3), (0, 0, 0), (0, 0, 0), spin, (0.7, 0.1, 0.5, -0.2), moments)
    records = flying(body)
    fastest, quickest = bounds(allocate_meeting(records))
    spins, dt = [records.twist[0, 3:].copy()], 1e-3
    for _ in range(2000):
        place_at(records, 0, dt, records, 0)
        spins.append(records.twist[0, 3:].copy())
    assert np.linalg.norm(spins, axis=1).max() <= fastest * (1 + 1e-12)
    # A difference over dt is a mean of the derivative, and the splitting errs by (w dt)^2 < 1 % of it.
    assert np.linalg.norm(np.diff(spins, axis=0), axis=1).max() <= 1.01 * quickest * dt


@pytest.mark.parametrize("spin", [(0.0, 0.0, 3.0), (2.0, 3.0, -4.0)])
def test_a_gap_bends_by_no_less_than_its_corners_turn(spin):
    """Both centres have constant velocity: corners accelerate by r w^2, and the bound is up to 1.5 times that."""
    boxes = [Box((0.5, 0.2, 0.1)), Box((0.3, 0.3, 0.3))]
    records = flying(*(moving(box, (9.0 * k, 0.0, 0.0), spin=spin) for k, box in enumerate(boxes)))
    meeting = allocate_meeting(records)
    begin_paths(records, meeting.paths, 0.1)
    assert first_contact(meeting, 0, 1, 0.0, 0.1) == math.inf
    turned = sum(np.linalg.norm(box.half_extents) for box in boxes) * np.dot(spin, spin)
    assert turned <= from_python(bend_bound)(meeting, 0.0, 0.1) * (1.0 + 1e-12) <= 1.5 * turned * 1.001


@pytest.mark.parametrize("kick", [(0.0, 0.0, 2.0), (3.0, -1.0, 0.5)])
def test_the_axis_of_a_ball_that_a_torque_turns_drifts_to_the_fifth_order(kick):
    """Against DOP853: halving the time divides the error by 32; without the drift of the axis, or half of it, by 8."""
    spin, off = np.array((1.0, -2.0, 0.7)), []

    def rate(t, q):
        w = spin + t * np.array(kick)
        return 0.5 * np.concatenate([[-w @ q[1:]], q[0] * w + np.cross(w, q[1:])])

    for time in (0.2, 0.1, 0.05):
        records = flying(moving(Sphere(0.5), (0.0, 0.0, 0.0), spin=spin))
        records.rate[0, 3:] = kick
        place_at(records, 0, time, records, 0)
        truth = solve_ivp(rate, (0.0, time), (1.0, 0.0, 0.0, 0.0), "DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
        off.append(np.linalg.norm(records.pose[0, 3:] - truth))
    assert off[0] / off[1] == pytest.approx(32.0, rel=0.15) == off[1] / off[2]


@pytest.mark.parametrize("spin", [(0.3, -0.2, 1.0), (2.0, 3.0, -4.0), (-5.0, 1.0, 0.5)])
@pytest.mark.parametrize("gap", [1e-14, 1e-9])
def test_edges_that_cross_and_part_are_not_met_though_both_turn(spin, gap):
    """Two boxes on edge, across each other; along a fixed direction the ends of an edge that turns come up at once."""
    on_edge = math.cos(math.pi / 8), math.sin(math.pi / 8)
    lower, upper = Box((0.6, 0.2, 0.2)), Box((0.2, 0.7, 0.2))
    reach = 0.2 * math.sqrt(2.0)
    a = moving(lower, (0.0, 0.0, 0.0), spin=spin, turn=(on_edge[0], on_edge[1], 0.0, 0.0))
    b_turn = (on_edge[0], 0.0, on_edge[1], 0.0)
    start = np.array((0.02, 0.03, 2.0 * reach + gap))
    # The point of contact on A moves with A; B goes with it, and up.
    velocity = np.cross(spin, (0.02, 0.03, reach)) + np.cross((-1.0, 2.0, 0.7), (0.0, 0.0, reach)) + (0.0, 0.0, 1e-3)
    b = moving(upper, start, velocity, (-1.0, 2.0, 0.7), b_turn)
    end = 2e-3

    def depth(t):
        first = corners((0.6, 0.2, 0.2), (0, 0, 0), np.array(a.pose[3:]), (0, 0, 0), spin, (0, 0, 0), t)
        return overlap_depth(
            first, corners((0.2, 0.7, 0.2), start, np.array(b_turn), velocity, (-1.0, 2.0, 0.7), (0, 0, 0), t)
        )

    time = impact(a, b, end)
    late = min((t for t in np.linspace(0.0, end, 400) if depth(t) < -1e-12), default=math.inf)
    if math.isinf(late):
        assert time == math.inf
    else:  # turning brings them together again
        assert depth(time) <= 1e-12 and time <= late
        assert min(depth(t) for t in np.linspace(0.0, time, 200)) >= -1e-12


def test_a_point_is_held_at_impulse_level_unless_it_was_left_to_go_and_elsewhere_unless_it_parts():
    pressed, manifolds = from_python(is_pressed), np.zeros(1, MANIFOLD).view(np.recarray)
    for target, impulse, held in ((-1.0, 0.0, False), (-1.0, 0.2, True), (0.0, 0.0, True)):
        manifolds.target[0, 3], manifolds.impulse[0, 3, 2] = target, impulse
        for parts in (0, 1):
            manifolds.open[0, 3] = parts
            assert pressed(manifolds, 0, 3, True) == held
            assert pressed(manifolds, 0, 3, False) == (parts == 0)
