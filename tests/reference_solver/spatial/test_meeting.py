"""First contacts of spatial bodies on polynomial paths, spins included, against dense samples of their corners."""

import math

import numpy as np
import pytest

from reference_solver import Body, Box, Capsule, HalfSpace, Model, Sphere
from reference_solver.compilation import from_python, kernel
from reference_solver.needs import EVERYTHING
from reference_solver.spatial.meeting import allocate_meeting, spin_on
from reference_solver.spatial.motion import initialise
from reference_solver.spatial.separation import separation as separation_and_normal
from reference_solver.spatial.state import allocate_bodies
from reference_solver.stepping.time_of_impact import (
    NORMAL,
    TURN,
    first_contact,
    introduce,
    next_contact_of_held,
    set_normal,
    stand,
    turn_with_edges,
)

DT = 1.0 / 60.0
#: Samples of a step: a corner that turns 30 rad in it goes 2e-3 of its lever between two.
SAMPLES = 15_001
#: Gaps at a first contact [m]: a few units in the last place of coordinates of some metres.
TOUCHING = 2e-14
WALL = HalfSpace((0.0, 0.0, 1.0))
STANDING = (1.0, 0.0, 0.0, 0.0)


def corners_of(shape):
    """Corners (k, 3) of the core, and the radius it is grown by."""
    if isinstance(shape, Box):
        signs = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        return signs * np.array(shape.half_extents), 0.0
    if isinstance(shape, Capsule):
        return np.array([(shape.half_length, 0.0, 0.0), (-shape.half_length, 0.0, 0.0)]), shape.radius
    return np.zeros((1, 3)), shape.radius


def rotation(psi):
    """Matrices (s, 3, 3) of rotation vectors (s, 3) (Rodrigues)."""
    x, y, z = psi.T
    zero = np.zeros_like(x)
    k = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(-1, 3, 3)
    angle = np.maximum(np.linalg.norm(psi, axis=1), 1e-12)[:, None, None]
    return np.eye(3) + np.sin(angle) / angle * k + (1.0 - np.cos(angle)) / angle**2 * (k @ k)


def matrix(quaternion):
    w, v = quaternion[0], np.array(quaternion[1:])
    cross = np.array([(0.0, -v[2], v[1]), (v[2], 0.0, -v[0]), (-v[1], v[0], 0.0)])
    return np.eye(3) + 2.0 * w * cross + 2.0 * cross @ cross


def places(shape, start, path, t):
    """Corners (s, k, 3) in the world at times (s,)."""
    way = sum(path[:, k] * t[:, None] ** (k + 1) for k in range(path.shape[1]))
    turned = rotation(way[:, 3:]) @ matrix(start[3:])
    return np.einsum("sij,kj->ski", turned, corners_of(shape)[0]) + (np.array(start[:3]) + way[:, :3])[:, None]


def meeting_of(bodies, paths):
    state = allocate_bodies(Model(3, bodies, (0.0,) * 3, 0.0, 0.0), EVERYTHING)
    initialise(state)
    meeting = allocate_meeting(state)
    meeting.paths.pose[:] = state.pose
    for i, path in enumerate(paths):
        meeting.paths.coefficient[i, :, 1 : 1 + path.shape[1]] = path
    return meeting


def unit(random, size):
    vector = random.normal(size=size)
    return vector / np.linalg.norm(vector)


@pytest.mark.parametrize("turn", [0.5, 4.0, 30.0])
@pytest.mark.parametrize("name", ["box", "capsule", "sphere"])
def test_the_first_contact_with_a_wall_is_found_however_fast_a_body_turns(name, turn):
    """Paths of degree five whose axis of turning turns."""
    random, met = np.random.default_rng([len(name), int(2 * turn)]), 0
    times = np.linspace(0.0, DT, SAMPLES)
    for _ in range(12):
        shape = {"box": Box(tuple(random.uniform(0.1, 1.0, 3))), "capsule": Capsule(0.7, 0.1), "sphere": Sphere(0.5)}[
            name
        ]
        reach = np.linalg.norm(corners_of(shape)[0], axis=1).max() + corners_of(shape)[1]
        start = (0.0, 0.0, reach * random.uniform(1.0, 1.3), *unit(random, 4))
        path = np.zeros((6, 5))
        path[:3, 0] = random.normal(), random.normal(), -random.uniform(0.0, 1.2) * reach / DT
        path[3:, 0] = turn / DT * unit(random, 3)
        path[3:, 1] = 0.2 * turn / DT**2 * random.normal(size=3)
        path[:, 2:] = random.normal(size=(6, 3)) * 0.2 / DT ** np.array([3.0, 4.0, 5.0])
        floor = Body(WALL, motion="fixed", pose=(0.0, 0.0, 0.0, *STANDING))
        meeting = meeting_of([floor, Body(shape, 1.0, (1.0,) * 3, start)], [np.zeros((6, 5)), path])
        t = first_contact(meeting, 0, 1, 0.0, DT)

        def gap(t, shape=shape, start=start, path=path):
            return places(shape, start, path, t)[..., 2].min(axis=1) - corners_of(shape)[1]

        through = np.nonzero(gap(times) < -TOUCHING)[0]
        if t == math.inf:
            assert len(through) == 0
            continue
        met += 1
        assert abs(gap(np.array([t]))[0]) <= TOUCHING
        assert len(through) == 0 or t <= times[through[0]]
    assert met >= 4


@pytest.mark.parametrize("size", [1e-6, 9e-3, 1.1e-2, 0.5, 3.0])
def test_the_spin_of_a_turn_is_the_integral_that_it_is_said_to_be(size):
    """exp(u psi) psi' over u by Gauss's rule, which is exact to round-off here; by its series below 1e-2 rad."""
    random, at = np.random.default_rng(int(1e6 * size)), from_python(spin_on)
    nodes, weights = np.polynomial.legendre.leggauss(24)
    for _ in range(5):
        psi, rate = size * unit(random, 3), unit(random, 3)
        path = np.zeros((6, 1))
        path[3:, 0] = rate
        ball = Body(Sphere(0.5), 1.0, (1.0,) * 3, (0.0, 0.0, 0.0, *STANDING))
        meeting = meeting_of([ball], [path])
        meeting.paths.coefficient[0, 3:, 0] = psi  # the turn so far
        turn, spin = at(meeting.paths, 0, 0.0)
        assert turn == pytest.approx(tuple(psi), rel=1e-15)
        whole = 0.5 * sum(
            w * rotation(0.5 * (u + 1.0) * psi[None])[0] @ rate for u, w in zip(nodes, weights, strict=True)
        )
        assert np.abs(np.array(spin) - whole).max() <= 4e-15  # some units in the last place of a rate of 1


def test_the_direction_that_separates_two_boxes_is_a_unit_vector_along_which_their_corners_keep_the_gap():
    """Either box may be the first, so that half of the normals of faces are turned round."""
    measured, random, parted = from_python(separation_and_normal), np.random.default_rng(3), 0
    for _ in range(60):
        shapes = [Box(tuple(random.uniform(0.1, 1.0, 3))) for _ in range(2)]
        poses = [(*random.uniform(-1.5, 1.5, 3), *unit(random, 4)) for _ in range(2)]
        bodies = [Body(shape, 1.0, (1.0,) * 3, pose) for shape, pose in zip(shapes, poses, strict=True)]
        state = allocate_bodies(Model(3, bodies, (0.0,) * 3, 0.0, 0.0), EVERYTHING)
        initialise(state)
        gap, normal = measured(state, 0, 1)
        assert np.linalg.norm(normal) == pytest.approx(1.0, abs=1e-15 * 4)
        first, second = (
            (np.array(pose[:3]) + corners_of(shape)[0] @ matrix(pose[3:]).T) @ np.array(normal)
            for shape, pose in zip(shapes, poses, strict=True)
        )
        assert second.min() - first.max() == pytest.approx(gap, abs=TOUCHING)
        parted += gap > 0.0
    assert 20 <= parted <= 58  # both are met


@pytest.mark.parametrize("turn", [4.0, 20.0])
def test_two_boxes_meet_first_where_no_plane_separates_them(turn):
    """Fifteen axes decide between sampled poses: apart at every sample before, touching at the time found."""
    random, met = np.random.default_rng(int(turn)), 0
    times = np.linspace(0.0, DT, 4001)
    for _ in range(6):
        shapes = [Box(tuple(random.uniform(0.1, 0.6, 3))) for _ in range(2)]
        apart = sum(float(np.linalg.norm(shape.half_extents)) for shape in shapes)
        starts = [(0.0, 0.0, 0.0, *unit(random, 4)), (1.1 * apart, 0.2 * random.normal(), 0.0, *unit(random, 4))]
        paths = []
        for k in range(2):
            path = np.zeros((6, 5))
            path[:3, 0] = (1 - 2 * k) * random.uniform(0.3, 0.8) * apart / DT, random.normal(), random.normal()
            path[3:, 0] = turn / DT * unit(random, 3)
            path[:, 2] = random.normal(size=6) * 0.1 / DT**3
            paths.append(path)
        bodies = [Body(shape, 1.0, (1.0,) * 3, start) for shape, start in zip(shapes, starts, strict=True)]
        t = first_contact(meeting_of(bodies, paths), 0, 1, 0.0, DT)
        early = times[times < t]
        assert (separation(shapes, starts, paths, early) > 0.0).all()
        if t < math.inf:
            met += 1
            assert abs(separation(shapes, starts, paths, np.array([t]))[0]) <= TOUCHING
    assert met >= 2


def separation(shapes, starts, paths, t):
    """Largest gap (s,) over the fifteen axes of two boxes, from their corners alone."""
    corners = [places(*each, t) for each in zip(shapes, starts, paths, strict=True)]
    # corners differ in x by bit 4, in y by bit 2, in z by bit 1
    axes = [[c[:, 4] - c[:, 0], c[:, 2] - c[:, 0], c[:, 1] - c[:, 0]] for c in corners]
    candidates = axes[0] + axes[1] + [np.cross(e, g) for e in axes[0] for g in axes[1]]
    best = np.full(len(t), -np.inf)
    for axis in candidates:
        n = axis / np.linalg.norm(axis, axis=1)[:, None]
        low_a, low_b = (np.einsum("ski,si->sk", c, n) for c in corners)
        gap = np.maximum(low_b.min(axis=1) - low_a.max(axis=1), low_a.min(axis=1) - low_b.max(axis=1))
        best = np.maximum(best, gap)
    return best


def test_the_face_of_a_box_held_by_an_edge_comes_down_when_it_lies_flat():
    """On a floor and on a box: it turns about the held edge, and lies flat after angle / spin."""
    half, angle, spin = (0.5, 0.4, 0.3), 0.02, 4.0
    turned = (math.cos(0.5 * angle), 0.0, -math.sin(0.5 * angle), 0.0)  # its edge at x = -0.5 is down
    lever = matrix(turned) @ np.array([-half[0], 0.0, -half[2]])
    for first, top in ((WALL, 0.0), (Box((2.0, 2.0, 1.0)), 1.0)):
        start = (0.1, 0.2, top - lever[2], *turned)
        path = np.zeros((6, 2))
        path[3:, 0] = 0.0, spin, 0.0  # from z to x: the other edge comes down
        path[:3, 0] = -np.cross((0.0, spin, 0.0), lever)
        bodies = [Body(first, motion="fixed", pose=(0.0, 0.0, 0.0, *STANDING)), Body(Box(half), 1.0, (1.0,) * 3, start)]
        meeting = meeting_of(bodies, [np.zeros((6, 2)), path])
        t = next_contact_of_held(meeting, 0, 1, 0.0, 0.0, 1.0, 0.0, 0.1)
        assert 0.0 < t < 0.1
        heights = places(Box(half), start, path, np.array([t]))[0, 4:, 2] - top  # corners at x = +0.5
        assert abs(heights).min() <= TOUCHING
        assert next_contact_of_held(meeting, 0, 1, 0.0, 0.0, 1.0, 0.0, 0.9 * t) == math.inf


def about(axis, angle):
    """Quaternion of a turn."""
    return np.array([math.cos(0.5 * angle), *(math.sin(0.5 * angle) * np.array(axis))])


def product(p, q):
    return np.array([p[0] * q[0] - p[1:] @ q[1:], *(p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:]))])


@kernel
def turned_along(meeting):
    """Let the direction upwards turn along with the edges of a pair at the start of its paths."""
    introduce(meeting, 0, 1)
    stand(meeting, 0.0)
    set_normal(meeting, 0.0, 0.0, 1.0)
    return turn_with_edges(meeting)


@pytest.mark.parametrize("below, above", [("edge", "edge"), ("edge", "corner"), ("corner", "edge")])
def test_the_direction_that_turns_along_stays_square_to_the_edges_that_it_separates(below, above):
    """Edges turn as ``e' = w x e``, so that ``n.e = 0`` lasts where ``n'.e = -n.(w x e)``."""
    random = np.random.default_rng(5)
    upright = about((1.0, 0.0, 0.0), 0.25 * math.pi)  # on an edge along x
    on_corner = product(about((0.0, 1.0, 0.0), -math.atan(math.sqrt(0.5))), upright)
    for _ in range(8):
        heading = about((0.0, 0.0, 1.0), random.uniform(0.4, math.pi - 0.4))
        turns = [upright if below == "edge" else on_corner, product(heading, upright if above == "edge" else on_corner)]
        bodies = [Body(Box((1.0,) * 3), 1.0, (1.0,) * 3, (0.0, 0.0, 3.0 * k, *turns[k])) for k in range(2)]
        paths = [np.zeros((6, 1)), np.zeros((6, 1))]
        for path in paths:
            path[3:, 0] = random.normal(size=3)
        meeting = meeting_of(bodies, paths)
        assert turned_along(meeting)
        n = meeting.vector[NORMAL]
        turned = np.cross(meeting.vector[TURN], n)
        for k, feature in enumerate((below, above)):
            edge = matrix(turns[k])[:, 0]
            if feature == "edge":
                assert turned @ edge == pytest.approx(-n @ np.cross(paths[k][3:, 0], edge), abs=1e-13)
        assert np.abs(turned).max() > 0.01
