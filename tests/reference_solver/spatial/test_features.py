"""Kinematics of held contacts and of rotation vectors, against finite differences over random poses.

Central differences of fourth order over .3 ms err by 3e-16 of the fifth derivative, and round-off by 1e-12; poses at
which lines nearly meet or run nearly parallel, where derivatives have no bound, are left out.
"""

import numpy as np
import pytest

from reference_solver.compilation import from_python
from reference_solver.spatial import turning, vector
from reference_solver.spatial.features import (
    ALONG,
    DIRECTION,
    LINE,
    PLACE,
    PLANE,
    POINT,
    RADIUS,
    SIDE,
    follow,
    name_features,
)
from reference_solver.spatial.motion import initialise
from reference_solver.spatial.state import BODY, BOX, FIXED, FREE, allocate_manifolds
from reference_solver.stepping.lasting import allocate_lasting

spin_from_rate, vector_rate = from_python(turning.spin_from_rate), from_python(turning.vector_rate)
vector_curvature = from_python(turning.vector_curvature)
quaternion_product = from_python(vector.quaternion_product)
rotation_quaternion = from_python(vector.rotation_quaternion)

STEP = 3e-4
PAIRS = {
    "face and vertex": (PLANE, POINT),
    "vertex and face": (POINT, PLANE),
    "edges": (LINE, LINE),
    "edge and vertex": (LINE, POINT),
    "vertex and edge": (POINT, LINE),
    "points": (POINT, POINT),
}


def rate(function):
    """Central difference of fourth order at zero."""
    h = STEP
    return (8.0 * (function(h) - function(-h)) - (function(2.0 * h) - function(-2.0 * h))) / (12.0 * h)


def turned(vector):
    return np.array(rotation_quaternion(tuple(vector)))


def two_bodies(poses, twists, motion):
    bodies = np.zeros(2, BODY).view(np.recarray)
    bodies.pose, bodies.twist, bodies.kind, bodies.motion = poses, twists, BOX, motion
    bodies.inverse_mass = bodies.inverse_moments = bodies.moments = 1.0
    initialise(bodies)
    return bodies


@pytest.mark.parametrize("cores", PAIRS.values(), ids=PAIRS)
@pytest.mark.parametrize(
    "motion", [(FREE, FREE), (FIXED, FREE), (FREE, FIXED)], ids=["both", "first held", "last held"]
)
def test_gap_rows_and_gamma_follow_the_bodies(cores, motion):
    rng = np.random.default_rng(7)
    tried = 0
    while tried < 20:
        poses, twists = np.zeros((2, 7)), rng.normal(size=(2, 6))
        poses[:, :3] = rng.normal(size=(2, 3))
        for i in range(2):
            poses[i, 3:] = turned(rng.normal(size=3))
        lasting = allocate_lasting(3, 2, 1)
        lasting.body[0], lasting.kind[0, :2] = (0, 1), cores
        lasting.place[0, PLACE : PLACE + 6] = rng.normal(size=6)
        lines = rng.normal(size=(2, 3))
        lasting.place[0, DIRECTION : DIRECTION + 6] = (lines / np.linalg.norm(lines, axis=1)[:, None]).ravel()
        lasting.place[0, RADIUS : RADIUS + 2] = rng.uniform(0.0, 0.3, 2)
        lasting.place[0, SIDE] = rng.choice([-1.0, 1.0])

        def moved(s, poses=poses, twists=twists, lasting=lasting):
            at = poses.copy()
            at[:, :3] += s * twists[:, :3]
            for i in range(2):
                at[i, 3:] = quaternion_product(tuple(turned(s * twists[i, 3:])), tuple(poses[i, 3:]))
            follow(two_bodies(at, twists, motion), lasting, 0)
            return lasting.gap[0], lasting.frame[0].copy(), lasting.speed[0].copy(), lasting.gamma[0].copy()

        _, frame, speed, gamma = moved(0.0)
        apart = abs(lasting.gap[0] + lasting.place[0, RADIUS : RADIUS + 2].sum())
        if np.abs(gamma).max() > 10.0 or apart < 0.5 or np.abs(lasting.place[0, ALONG : ALONG + 2]).max() > 5.0:
            continue
        tried += 1
        assert rate(lambda s: moved(s)[0]) == pytest.approx(speed[0], abs=1e-8)
        assert rate(lambda s: moved(s)[2][0]) == pytest.approx(gamma[0], abs=1e-7)
        _, frame, speed, gamma = moved(0.0)  # its tangents are those nearest to the ones of the call before
        assert np.einsum("srv,sv->r", lasting.jacobian[0], twists) == pytest.approx(speed, abs=1e-13)
        # The slip as a vector: its change within the tangents of the start.
        change = rate(lambda s: moved(s)[2][1:] @ moved(s)[1][1:])
        assert frame[1:] @ change == pytest.approx(gamma[1:], abs=1e-7)
    assert tried == 20


@pytest.mark.parametrize("size", [0.01, 0.29, 0.31, 1.0, 3.0])
def test_rotation_vectors_turn_as_the_spin_says(size):
    rng = np.random.default_rng(3)
    for _ in range(20):
        a, b, c = rng.normal(size=(3, 3))
        a *= size / np.linalg.norm(a)

        def quaternion(t, a=a, b=b, c=c):
            return turned(a + b * t + c * t * t)

        def spin(t, a=a, b=b, c=c):
            return np.array(spin_from_rate(tuple(a + b * t + c * t * t), tuple(b + 2.0 * c * t)))

        change = rate(quaternion)
        seen = 2.0 * np.array(quaternion_product(tuple(change), tuple(quaternion(0.0) * [1, -1, -1, -1])))[1:]
        w = spin(0.0)
        assert seen == pytest.approx(w, abs=1e-9)
        assert vector_rate(tuple(a), tuple(w)) == pytest.approx(b, abs=1e-12)
        assert vector_curvature(tuple(a), tuple(w), tuple(rate(spin))) == pytest.approx(2.0 * c, abs=1e-8)


def found(normal, arm_a, arm_b, poses):
    """Cores that `name_features` sees at one point between two unit cubes."""
    bodies = two_bodies(poses, np.zeros((2, 6)), (FREE, FREE))
    bodies.geometry = (0.5, 0.5, 0.5, 0.0)
    manifolds, lasting = allocate_manifolds(1), allocate_lasting(3, 2, 1)
    manifolds.body_b[0] = 1
    manifolds.frame[0, 2], manifolds.arm_a[0, 0], manifolds.arm_b[0, 0] = normal, arm_a, arm_b
    named = name_features(bodies, manifolds, lasting, 0, 0)
    follow(bodies, lasting, 0)
    return named, tuple(lasting.kind[0, :2]), lasting.gap[0]


def upright(*places):
    return np.array([(*place, 1.0, 0.0, 0.0, 0.0) for place in places])


def test_features_are_named_by_the_face_where_there_is_one():
    up = (0.0, 0.0, 1.0)
    corner, below = (0.5, 0.5, 0.5), (0.5, 0.5, -0.5)
    assert found(up, corner, below, upright((0, 0, 0), (0, 0, 1)))[:2] == (True, (PLANE, POINT))
    # The corner of the lower cube under the face of the shifted upper one.
    assert found(up, corner, (0.3, 0.2, -0.5), upright((0, 0, 0), (0.2, 0.3, 1)))[:2] == (True, (POINT, PLANE))
    # Edges of flush faces that cross: the upper cube turned by 30 degrees about the vertical.
    poses = upright((0, 0, 0), (0.3, 0.0, 1))
    poses[1, 3:] = (np.cos(np.pi / 12), 0.0, 0.0, np.sin(np.pi / 12))
    x, y = 0.5 - 0.3, (0.5 - 0.2 * np.cos(np.pi / 6)) / np.sin(np.pi / 6)
    assert abs(y) > 0.5  # the line x = .5 meets the edge y' = -.5 of the turned square instead
    y = (-0.5 + x * np.sin(np.pi / 6)) / np.cos(np.pi / 6)
    named, cores, gap = found(up, (0.5, y, 0.5), (x, y, -0.5), poses)
    assert named and cores == (LINE, LINE) and abs(gap) <= 1e-15
