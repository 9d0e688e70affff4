"""First contacts of planar bodies on polynomial paths, spins included, against dense samples of their outlines."""

import math

import numpy as np
import pytest

from reference_solver import Body, Box, Capsule, Disc, HalfSpace, Model, Polygon, Settings, Simulation
from reference_solver.compilation import from_python, kernel
from reference_solver.needs import EVERYTHING
from reference_solver.planar.meeting import allocate_meeting
from reference_solver.planar.state import allocate_bodies
from reference_solver.stepping.time_of_impact import (
    bend_bound,
    first_contact,
    introduce,
    next_contact_of_held,
    safe_time,
    separate,
    stand,
    watch_all,
)

DT = 1.0 / 60.0
#: Samples of a step: a corner that turns 30 rad in it goes 1e-3 of its lever between two.
SAMPLES = 30_001
#: Gaps at a first contact [m]: a few units in the last place of coordinates of some metres.
TOUCHING = 1e-14
WALL = HalfSpace((0.0, 1.0))
TRIANGLE = Polygon(((0.5, -0.3), (0.1, 0.6), (-0.6, -0.3)))
HEXAGON = Polygon(tuple((math.cos(k * math.pi / 3.0), math.sin(k * math.pi / 3.0)) for k in range(6)))
TURNING = {"box": Box((0.8, 0.3)), "capsule": Capsule(0.7, 0.1), "triangle": TRIANGLE, "hexagon": HEXAGON}


def core(shape):
    """Corners (k, 2) and radius."""
    if isinstance(shape, Box):
        x, y = shape.half_extents
        return np.array([(x, y), (-x, y), (-x, -y), (x, -y)]), 0.0
    if isinstance(shape, Capsule):
        return np.array([(shape.half_length, 0.0), (-shape.half_length, 0.0)]), shape.radius
    return (np.zeros((1, 2)), shape.radius) if isinstance(shape, Disc) else (np.array(shape.vertices), 0.0)


def reach(shape):
    corners, radius = core(shape)
    return np.hypot(*corners.T).max() + radius


def poses(start, coefficients, t):
    """Poses (s, 3) at times (s,); coefficients (3, k) of t, t^2, .."""
    powers = np.stack([t ** (k + 1) for k in range(coefficients.shape[1])])
    return np.asarray(start) + (coefficients @ powers).T


def outline(shape, pose):
    """Corners (s, k, 2) in the world."""
    corners, _ = core(shape)
    c, s = np.cos(pose[:, 2:]), np.sin(pose[:, 2:])
    x, y = corners.T
    return np.stack([c * x - s * y + pose[:, :1], s * x + c * y + pose[:, 1:2]], axis=-1)


def segment_distance(p, q, r):
    """Distances (s,) of points r from the segments p q, all (s, 2)."""
    along = q - p
    share = np.clip(np.einsum("sd,sd->s", r - p, along) / np.maximum(np.einsum("sd,sd->s", along, along), 1e-300), 0, 1)
    return np.hypot(*(r - p - share[:, None] * along).T)


def inside(corners, point):
    """Whether points (s, 2) lie inside convex counter-clockwise outlines (s, k, 2)."""
    edge = np.roll(corners, -1, axis=1) - corners
    to = point[:, None] - corners
    return (edge[..., 0] * to[..., 1] - edge[..., 1] * to[..., 0] > 0.0).all(axis=1)


def distance(first, second, pose_a, pose_b):
    """Gap of two shapes with corners at poses (s, 3): brute force over corners and edges; negative inside."""
    (_, radius_a), (_, radius_b) = core(first), core(second)
    a, b = outline(first, pose_a), outline(second, pose_b)
    gap = np.full(len(pose_a), np.inf)
    for p, q, sharp in ((a, b, radius_a == 0.0), (b, a, radius_b == 0.0)):
        within = np.zeros(len(pose_a), bool)
        for i in range(q.shape[1]):
            for k in range(p.shape[1]):
                gap = np.minimum(gap, segment_distance(p[:, k], p[:, (k + 1) % p.shape[1]], q[:, i]))
            if sharp and p.shape[1] > 2:
                within |= inside(p, q[:, i])
        gap = np.where(within, -gap, gap)
    return gap - radius_a - radius_b


def wall_gap(shape, pose):
    return outline(shape, pose)[..., 1].min(axis=1) - core(shape)[1]


def on_paths(first, second, start, paths, begins=(0.0, 0.0)):
    """Two bodies on paths (3, k) that begin at times of their own."""
    bodies = [Body(first, motion="fixed", pose=(0.0, 0.0, 0.0)), Body(second, 1.0, 1.0, start[1])]
    if not isinstance(first, HalfSpace):
        bodies[0] = Body(first, 1.0, 1.0, start[0])
    meeting = allocate_meeting(allocate_bodies(Model(2, bodies, (0.0, 0.0), 0.0, 0.0), EVERYTHING))
    for i in range(2):
        meeting.paths.pose[i], meeting.paths.begin[i] = start[i], begins[i]
        meeting.paths.coefficient[i, :, 1 : 1 + paths[i].shape[1]] = paths[i]
    return meeting


def meet(first, second, start, paths, until=DT, begins=(0.0, 0.0), now=0.0):
    """First contact of two bodies on such paths."""
    return first_contact(on_paths(first, second, start, paths, begins), 0, 1, now, until)


@kernel
def safe_time_at_start(meeting, clearance, acceleration):
    introduce(meeting, 0, 1)
    watch_all(meeting)
    stand(meeting, 0.0)
    separate(meeting)
    return safe_time(meeting, clearance, acceleration)


@pytest.mark.parametrize("spins", [(0.0, 7.0), (-3.0, 7.0)])
def test_a_gap_bends_by_what_its_corners_turn(spins):
    """Both centres have constant velocity: a corner at distance r from its centre accelerates by r w^2 at most."""
    shapes, paths = (Box((0.8, 0.3)), TRIANGLE), [np.array([[0.1], [0.2], [w]]) for w in spins]
    meeting = on_paths(*shapes, ((0.0, 0.0, 0.0), (9.0, 0.0, 0.0)), paths)
    assert first_contact(meeting, 0, 1, 0.0, DT) == math.inf
    bend = from_python(bend_bound)(meeting, 0.0, DT)
    assert bend == pytest.approx(sum(reach(s) * w * w for s, w in zip(shapes, spins, strict=True)), rel=1e-12)


@pytest.mark.parametrize(("rate", "bend"), [(-2.0, 0.0), (-2.0, -9.0), (1.0, -9.0), (0.0, -0.3), (-4.0, 9.0)])
def test_a_safe_time_is_the_first_zero_of_its_parabola(rate, bend):
    """A disc over a wall: of ``c + r t + b t^2 / 2``."""
    paths = np.zeros((3, 1)), np.array([[3.0], [rate], [0.0]])
    meeting = on_paths(WALL, Disc(0.5), (np.zeros(3), (0.0, 1.2, 0.0)), paths)
    roots = np.roots([0.5 * bend, rate, 0.7])
    first = min(root.real for root in roots if abs(root.imag) < 1e-12 and root.real > 0.0)
    assert safe_time_at_start(meeting, 0.7, bend) == pytest.approx(first, rel=1e-14)


def is_first(t, gaps, exact, times):
    """Whether t is a contact, and no sample before it is one."""
    through = np.nonzero(gaps < -TOUCHING)[0]
    if t == math.inf:
        return len(through) == 0
    return abs(exact(t)) <= TOUCHING and (len(through) == 0 or t <= times[through[0]])


STILL = np.zeros((3, 5))


@pytest.mark.few(12)
@pytest.mark.parametrize("degree", [1, 2, 5])
@pytest.mark.parametrize("turn", [4.0, 10.0, 30.0])
@pytest.mark.parametrize("name", TURNING)
def test_the_first_contact_with_a_wall_is_found_however_fast_a_body_turns(name, turn, degree):
    """A bisection finds some contact: at 30 rad a step it was the first one in 1 of 20 cases."""
    random = np.random.default_rng([list(TURNING).index(name), int(turn), degree])
    shape, times, met = TURNING[name], np.linspace(0.0, DT, SAMPLES), 0
    for _ in range(17):
        start = (0.0, reach(shape) * random.uniform(1.001, 1.4), random.uniform(0.0, 7.0))
        path = np.zeros((3, 5))
        path[:, 0] = random.normal(), -random.uniform(0.0, 1.2) * reach(shape) / DT, turn / DT * random.choice([-1, 1])
        if degree > 1:
            path[:, 1] = random.normal(), -5.0, 0.2 * turn / DT**2 * random.normal()
        if degree > 2:
            path[:, 2:] = random.normal(size=(3, 3)) * 0.2 / DT ** np.array([3.0, 4.0, 5.0])
        t = meet(WALL, shape, ((0.0, 0.0, 0.0), start), (STILL, path))
        gaps = wall_gap(shape, poses(start, path, times))

        def exact(t, shape=shape, start=start, path=path):
            return wall_gap(shape, poses(start, path, np.array([t])))[0]

        assert is_first(t, gaps, exact, times)
        met += t < math.inf
    assert met >= 5


@pytest.mark.few(5)
@pytest.mark.parametrize("turn", [0.0, 4.0, 30.0])
@pytest.mark.parametrize(
    ("first", "second"),
    [("box", "box"), ("box", "triangle"), ("capsule", "hexagon"), ("disc", "box"), ("capsule", "capsule")],
)
def test_two_turning_bodies_meet_first_where_their_outlines_do(first, second, turn):
    """Both turn, on paths of degree five that began at different times."""
    shapes = [(TURNING | {"disc": Disc(0.4)})[name] for name in (first, second)]
    random = np.random.default_rng([len(first), len(second), int(turn)])
    times, met = np.linspace(0.0, DT, SAMPLES), 0
    apart = reach(shapes[0]) + reach(shapes[1])
    for _ in range(10):
        start = ((0.0, 0.0, random.uniform(0.0, 7.0)), (apart * 1.5, 0.3 * random.normal(), random.uniform(0.0, 7.0)))
        paths, begins = [], (-random.uniform(0.0, 0.5) * DT, -random.uniform(0.0, 0.5) * DT)
        for k in range(2):
            path = np.zeros((3, 5))
            path[:, 0] = (
                (1 - 2 * k) * random.uniform(0.2, 0.8) * apart / DT,
                random.normal(),
                turn / DT * random.normal(),
            )
            path[:, 2:] = random.normal(size=(3, 3)) * 0.1 / DT ** np.array([3.0, 4.0, 5.0])
            paths.append(path)

        def gap(t, start=start, paths=paths, begins=begins):
            a, b = (poses(start[k], paths[k], t - begins[k]) for k in range(2))
            return distance(*shapes, a, b)

        centres = [poses(start[k], paths[k], np.array([-begins[k]]))[0, :2] for k in range(2)]
        if np.hypot(*(centres[1] - centres[0])) <= apart:
            continue  # outlines may cross with no corner inside, which `distance` does not see
        t = meet(*shapes, start, paths, begins=begins)
        assert is_first(t, gap(times), lambda s, gap=gap: gap(np.array([s]))[0], times)
        met += t < math.inf
    assert met >= 3


@pytest.mark.parametrize("speed", [1e-9, 1e-3, 10.0])
def test_a_ball_that_leaves_is_back_when_its_parabola_is(speed):
    """It touches to the last digit at the start: 2 u / g, whatever comes before it left the floor's round-off."""
    path = np.zeros((3, 2))
    path[1] = speed, -0.5 * 9.81
    back = 2.0 * speed / 9.81
    t = meet(WALL, Disc(0.5), ((0.0,) * 3, (0.0, 0.5, 0.0)), (np.zeros((3, 2)), path), until=1.5 * back)
    # 1e-12 of the half width below the floor counts as back where the whole flight is lower than that
    assert t == pytest.approx(back, rel=1e-13) or (speed < 1e-5 and t == math.inf)
    assert meet(WALL, Disc(0.5), ((0.0,) * 3, (0.0, 0.5, 0.0)), (np.zeros((3, 2)), path), until=0.99 * back) == math.inf


@pytest.mark.parametrize("corner", [1, -1])
def test_the_other_corner_of_a_held_box_comes_down_when_its_face_lies_flat(corner):
    """On a wall and on a box; the face lies flat after angle / spin, wherever the held corner goes meanwhile."""
    angle, spin, half = 0.05 * corner, -4.0 * corner, (0.6, 0.2)
    corners = outline(Box(half), np.array([[0.0, 0.0, angle]]))[0]
    lever = corners[corners[:, 1].argmin()]
    for first, top in ((WALL, 0.0), (Box((5.0, 1.0)), 1.0)):
        start = (0.3, top - lever[1], angle)
        bodies = [Body(first, motion="fixed"), Body(Box(half), 1.0, 1.0, start)]
        meeting = allocate_meeting(allocate_bodies(Model(2, bodies, (0.0, 0.0), 0.0, 0.0), EVERYTHING))
        meeting.paths.pose[:] = [(0.0, 0.0, 0.0), start]
        # about the held corner: v = -w x lever
        meeting.paths.coefficient[1, :, 1] = spin * lever[1] + 0.7, -spin * lever[0], spin
        t = next_contact_of_held(meeting, 0, 1, 0.0, 1.0, 0.0, 0.0, 0.1)
        # the centre goes straight, the corner on a circle: it leaves the face by lever (spin t)^2 / 2, which shifts the
        # time at which the *height* of the other corner is zero, not the angle at which the face is flat
        pose = poses(start, np.array(meeting.paths.coefficient[1, :, 1:]), np.array([t]))
        height = np.sort(outline(Box(half), pose)[0, :, 1])[:2] - top
        assert abs(height).min() <= TOUCHING
        assert next_contact_of_held(meeting, 0, 1, 0.0, 1.0, 0.0, 0.0, 0.9 * t) == math.inf


@pytest.mark.parametrize("deep", [1e-11, 1e-10, 1e-9])
@pytest.mark.parametrize("corner", [1, -1])
def test_a_corner_comes_down_on_the_wall_however_deep_another_one_is_in_it(corner, deep):
    """A box turns from the corner that is in the wall on to the other; the wall is where it is for each corner."""
    half, angle = (0.5, 0.2), 1e-8 * corner
    start = (0.1, 0.2, angle)
    start = (0.1, 0.2 - deep - wall_gap(Box(half), np.array([start]))[0], angle)
    path = np.array([[0.3], [0.0], [-1e-4 * corner]])
    t = meet(WALL, Box(half), (np.zeros(3), start), (np.zeros((3, 1)), path))
    other = 2 + int(np.argmax(outline(Box(half), np.array([start]))[0, 2:, 1]))
    assert abs(outline(Box(half), poses(start, path, np.array([t])))[0, other, 1]) <= 1e-12  # noise: .2e-12
    assert 0.0 < t < DT


@pytest.mark.parametrize("above", [0.2, 0.6, 0.9, 1.2, 2.0, 10.0])
@pytest.mark.parametrize("held", [-0.9, 0.0, 0.9])
def test_a_corner_that_no_contact_holds_is_watched(held, above):
    """Of a box on a wall one corner is within what counts as no gap, and the other off by less or more than that.

    Bodies turn about the first, so that the other comes down: it is watched wherever it has no contact, at a gap above
    1e-12 of the half width.
    """
    half, place = (0.5, 0.2), 0.1
    noise = 1e-12 * half[1] + 2e-15 * 0.6
    angle = (above - held) * noise / (2.0 * half[0])
    start = (place, half[1] + 0.5 * (held + above) * noise, angle)
    bodies = [Body(WALL, motion="fixed"), Body(Box(half), 1.0, 1.0, start)]
    meeting = allocate_meeting(allocate_bodies(Model(2, bodies, (0.0, 0.0), 0.0, 0.0), EVERYTHING))
    meeting.paths.pose[:] = [(0.0, 0.0, 0.0), start]
    # about the corner on the left, at first at rest: no corner moves as the step begins
    meeting.paths.coefficient[1, :, 2] = 20.0 * half[1], -20.0 * half[0], -20.0
    t = next_contact_of_held(meeting, 0, 1, 0.0, 1.0, 0.0, 0.0, 0.1)
    assert t < 1e-5 or above <= 1.0


@pytest.mark.parametrize("turn", [4.0, 10.0, 30.0])
def test_a_step_rebounds_from_the_first_contact(turn):
    """Smooth, e = 1: the twist after the step is that after the impulse of the first contact, from dense samples."""
    random, judged = np.random.default_rng(int(turn)), 0
    times = np.linspace(0.0, DT, SAMPLES)
    inertia = 0.3
    for _ in range(12):
        shape = TURNING[random.choice(list(TURNING))]
        start = (0.0, reach(shape) * random.uniform(1.0, 1.3), random.uniform(0.0, 7.0))
        twist = np.array([0.0, -random.uniform(0.2, 1.2) * reach(shape) / DT, turn / DT * random.choice([-1, 1])])
        simulation = Simulation(
            Model(
                2, [Body(WALL, motion="fixed"), Body(shape, 1.0, inertia, start, tuple(twist))], (0.0, 0.0), 1.0, 0.0
            ),
            Settings.reference(DT),
        )
        simulation.advance(1)
        through = np.nonzero(wall_gap(shape, poses(start, twist[:, None], times)) < 0.0)[0]
        expected = twist.copy()
        if len(through):
            early, late = times[through[0] - 1], times[through[0]]
            for _ in range(60):
                middle = 0.5 * (early + late)
                high = wall_gap(shape, poses(start, twist[:, None], np.array([middle])))[0] > 0.0
                early, late = (middle, late) if high else (early, middle)
            pose = poses(start, twist[:, None], np.array([early]))
            corners = outline(shape, pose)[0]
            lever = corners[corners[:, 1].argmin()][0] - pose[0, 0]
            impulse = -2.0 * (twist[1] + twist[2] * lever) / (1.0 + lever**2 / inertia)
            expected += np.array([0.0, impulse, lever * impulse / inertia])
            again = poses(pose[0], expected[:, None], np.linspace(1e-9, DT - early, SAMPLES))
            if (wall_gap(shape, again) < 0.0).any():
                continue  # a second contact in this step
        assert simulation.twist[1] == pytest.approx(expected, rel=1e-9, abs=1e-9 * turn / DT)
        judged += len(through) > 0
    assert judged >= 4


def test_accelerations_that_are_none_at_the_start_are_bounded():
    """Neither moving nor accelerated at the start: a gap of .1 (1 - 2 (t/dt)^3) closes at dt / 2^(1/3)."""
    path = np.zeros((3, 5))
    path[1, 2] = -0.2 / DT**3
    t = meet(WALL, Disc(0.5), ((0.0,) * 3, (0.0, 0.6, 0.0)), (STILL, path))
    assert t == pytest.approx(DT * 0.5 ** (1.0 / 3.0), rel=1e-14)
    path[1, 3] = 0.3 / DT**4  # it turns back before it gets there: 1 - 2 s^3 + 3 s^4 > 0
    assert meet(WALL, Disc(0.5), ((0.0,) * 3, (0.0, 0.6, 0.0)), (STILL, path)) == math.inf


def test_a_turn_that_begins_at_rest_is_bounded():
    """A box that stands upright over a wall comes down by turning alone: its corner, at a known angle.

    So small an angle that the change of spin, and not the spin, is what has to be bounded.
    """
    half, angle = (0.2, 0.5), 0.005
    # the corner is below the centre by .2 sin a + .5 cos a = |half| cos(a - atan(.2/.5))
    height = math.hypot(*half) * math.cos(angle - math.atan(0.4))
    path = np.zeros((3, 5))
    path[2, 1] = 0.02 / DT**2
    t = meet(WALL, Box(half), ((0.0,) * 3, (0.0, height, 0.0)), (STILL, path))
    assert 0.02 * (t / DT) ** 2 == pytest.approx(angle, rel=1e-11)


@pytest.mark.parametrize("seed", range(40))
def test_a_corner_over_a_face_that_turns_is_met_when_it_comes_down_and_not_before(seed):
    """One end of the face comes up along the fixed normal, however far from it the corner is."""
    rng = np.random.default_rng(seed)
    small, angle, spin = Box((0.2, 0.2)), rng.uniform(0.1, 1.4), rng.uniform(-5.0, 5.0)
    corners = outline(small, np.array([[0.0, 0.0, angle]]))[0]
    lever = corners[corners[:, 1].argmin()]
    start = ((0.0, 0.0, 0.0), (0.1 - lever[0], 1.0 + 1e-10 - lever[1], angle))
    paths = np.zeros((2, 3, 5))
    paths[0, 2] = spin, rng.uniform(-300.0, 300.0), 0.0, 0.0, 0.0
    # the second goes along with the first, spins by itself, and rises or falls
    paths[1, 2, 0] = spin + rng.choice([0.0, rng.uniform(-5.0, 5.0)])
    paths[1, :2, 0] = -paths[1, 2, 0] * -lever[1] - spin, paths[1, 2, 0] * -lever[0] + spin * 0.1
    paths[1, 1, 1:3] = rng.uniform(-50.0, 50.0), rng.uniform(-1e4, 1e4)
    t = meet(Box((1.0, 1.0)), small, start, paths)
    times = np.linspace(0.0, DT, 4000)[1:]
    corner = outline(small, poses(start[1], paths[1], times))
    turn = poses(start[0], paths[0], times)[:, 2][:, None]
    height = (np.cos(turn) * corner[..., 1] - np.sin(turn) * corner[..., 0]).min(axis=1) - 1.0
    down = np.nonzero(height < -TOUCHING)[0]
    if len(down) == 0:
        assert t == math.inf
    else:
        assert t <= times[down[0]]
        assert t == pytest.approx(0.0, abs=2e-8) or height[max(int(t / times[0]) - 2, 0)] < 1e-3 * DT
