"""Rows and their rates against differences of gaps and velocities along a motion."""

import numpy as np
import pytest

from reference_solver import Body, Box, Capsule, Disc, HalfSpace, Model, Sphere
from reference_solver.exact.bodies import State, start_of, world_of
from reference_solver.exact.kernels.features import FACE, LINE, POINT
from reference_solver.exact.rows import Contacts

#: Half the difference of times [s]: errors of differences are its square, and round-off over it.
STEP = 1e-4

BOX, FLAT_BOX, PILL, BALL, DISC = Box((0.5, 0.4, 0.3)), Box((0.5, 0.4)), Capsule(0.4, 0.2), Sphere(0.3), Disc(0.3)
#: Dimension, and shapes and features (kind, number) of either body.
PAIRS = {
    "corner on half-space": (2, HalfSpace((0.6, 0.8)), FLAT_BOX, (FACE, 0), (POINT, 1)),
    "corner on edge": (2, FLAT_BOX, FLAT_BOX, (FACE, 2), (POINT, 3)),
    "edge on corner": (2, FLAT_BOX, FLAT_BOX, (POINT, 1), (FACE, 0)),
    "disc on edge": (2, FLAT_BOX, DISC, (FACE, 1), (POINT, 0)),
    "end of capsule on the side of another": (2, PILL, PILL, (FACE, 1), (POINT, 0)),
    "disc on corner": (2, FLAT_BOX, DISC, (POINT, 2), (POINT, 0)),
    "corner in space on half-space": (3, HalfSpace((0.0, 0.6, 0.8)), BOX, (FACE, 0), (POINT, 5)),
    "corner on face": (3, BOX, BOX, (FACE, 4), (POINT, 2)),
    "face on end of capsule": (3, PILL, BOX, (POINT, 1), (FACE, 1)),
    "ball on corner": (3, BOX, BALL, (POINT, 7), (POINT, 0)),
    "ball on edge": (3, BOX, BALL, (LINE, 3), (POINT, 0)),
    "end of capsule on edge": (3, PILL, BOX, (POINT, 0), (LINE, 6)),
    "edges that cross": (3, BOX, BOX, (LINE, 0), (LINE, 7)),
    "capsules that cross": (3, PILL, PILL, (LINE, 0), (LINE, 0)),
}


def moving(d, shapes, seed):
    """World of two bodies in any places, and their state."""
    rng = np.random.default_rng(seed)
    bodies = []
    for k, shape in enumerate(shapes):
        place = rng.uniform(-1.0, 1.0, d) + 2.0 * k
        turn = rng.normal(size=4 if d == 3 else 1)
        turn /= np.linalg.norm(turn) if d == 3 else 1.0
        motion = "prescribed" if isinstance(shape, HalfSpace) else "free"
        twist = rng.uniform(-1.0, 1.0, 6 if d == 3 else 3)
        inertia = tuple(rng.uniform(0.8, 1.0, 3)) if d == 3 else 0.9
        bodies.append(Body(shape, 1.3, inertia, (*place, *turn), tuple(twist), motion))
    model = Model(d, bodies, (0.0,) * d, 0.0, 0.5)
    return world_of(model), start_of(model), rng


def after(state, acceleration, t):
    """State after a time under constant accelerations of places and of spins, to second order in it."""
    moved = state.moved(t * state.velocity + 0.5 * t * t * acceleration)
    return State(t, moved.place, moved.orientation, state.velocity + t * acceleration)


@pytest.mark.parametrize("name", PAIRS)
@pytest.mark.parametrize("seed", range(3))
def test_rates_of_gap_and_slip_against_finite_differences(name, seed):
    d, first, second, feature_a, feature_b = PAIRS[name]
    world, state, rng = moving(d, (first, second), seed)
    contacts = Contacts.of(world, np.array([[0, 1, *feature_a, *feature_b]]))
    acceleration = rng.uniform(-1.0, 1.0, state.velocity.shape)
    rows = contacts.at_state(state).rows
    speed, rate = rows.speed[0].copy(), rows.rate[0] + contacts.matrices[0] @ acceleration.ravel()
    frame = rows.frame[0].copy()
    assert frame @ frame.T == pytest.approx(np.eye(d))  # the features exist
    # The slip is u less its normal part; tangents turn about the normal as they like, so those of the start are kept.
    gap, slip = [], []
    for t in (-STEP, STEP):
        rows = contacts.at_state(after(state, acceleration, t)).rows
        gap.append((rows.gap[0], rows.speed[0, 0]))
        across = rows.speed[0, 1:] @ rows.frame[0, 1:]
        slip.append(frame[1:] @ across)
    (gap_before, speed_before), (gap_after, speed_after) = gap
    assert (gap_after - gap_before) / (2.0 * STEP) == pytest.approx(speed[0], abs=1e-6)
    assert (speed_after - speed_before) / (2.0 * STEP) == pytest.approx(rate[0], abs=1e-5)
    assert (slip[1] - slip[0]) / (2.0 * STEP) == pytest.approx(rate[1:], abs=1e-5)
