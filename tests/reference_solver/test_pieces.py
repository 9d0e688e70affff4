"""The record of a run piece by piece: it changes no bit, leaves nothing out, and explains every velocity."""

import numpy as np
import pytest

from reference_solver import Body, Box, Disc, HalfSpace, Model, Settings, Simulation, Sphere
from reference_solver.pieces import FORCES, FROZEN, IMPACT, ROCKING, TURNING

DT, G = 1.0 / 60.0, 9.81
UPRIGHT = (1.0, 0.0, 0.0, 0.0)


def tumbling(dimension, restitution=0.3):
    """Two boxes and a ball fall onto a floor: impacts, slides, and motion between them."""
    if dimension == 2:
        floor = Body(HalfSpace((0.0, 1.0)), motion="fixed")
        boxes = [Body(Box((0.3, 0.2)), 2.0, 0.1, (0.1 * i, 0.4 + 0.6 * i, 0.3 * i), (1.0, 0.0, i)) for i in range(2)]
        ball = Body(Disc(0.2), 1.0, 0.02, (1.5, 0.3, 0.0))
    else:
        floor = Body(HalfSpace((0.0, 0.0, 1.0)), pose=(0.0, 0.0, 0.0, *UPRIGHT), motion="fixed")
        turned = [(np.cos(0.2 * i), 0.0, np.sin(0.2 * i), 0.0) for i in range(2)]
        boxes = [
            Body(
                Box((0.3, 0.25, 0.2)), 2.0, (0.1, 0.1, 0.1), (0.1 * i, 0, 0.5 + 0.7 * i, *turned[i]), (1, 0, 0, 0, 0, i)
            )
            for i in range(2)
        ]
        ball = Body(Sphere(0.2), 1.0, (0.02,) * 3, (1.5, 0.0, 0.3, *UPRIGHT))
    model = Model(dimension, [floor, *boxes, ball], (*(0.0,) * (dimension - 1), -G), restitution, 0.5)
    return Simulation(model, Settings.reference(DT))


@pytest.mark.parametrize("dimension", [2, 3])
def test_bits_of_a_recorded_run(dimension):
    plain, recorded = tumbling(dimension), tumbling(dimension)
    one = plain.record(24, 3, contacts=True)
    other = recorded.record(24, 3, contacts=True, pieces=True)
    assert one.pieces is None and len(other.pieces) >= 24
    for name in ("t", "pose", "twist", "offset"):
        assert (getattr(one, name) == getattr(other, name)).all()
    assert (one.contacts.impulse == other.contacts.impulse).all()


@pytest.mark.parametrize("dimension", [2, 3])
def test_velocities_explained_by_joined_pieces(dimension):
    """Each body goes on where it was, and its momentum changes by the impulses on it and its weight, to round-off."""
    run = tumbling(dimension)
    start = run.pose
    first, then = run.record(18, pieces=True), run.record(6, pieces=True)
    assert then.pieces.step.min() == 18 and then.pieces.begin[0] == pytest.approx(18 * DT, abs=1e-15)
    pieces, last = first.pieces, {}
    assert set(pieces.kind) == {FORCES, IMPACT}
    assert set(pieces.scheme) <= {FROZEN, TURNING, ROCKING}
    owner = np.repeat(np.arange(len(pieces)), np.diff(pieces.first_body))
    for i in (1, 2, 3):  # each has its pieces, of the island it is in
        assert pieces.length[owner[pieces.body == i]].sum() == pytest.approx(18 * DT, abs=1e-13)
    weight = np.zeros(dimension)
    weight[-1] = -G
    for k in range(len(pieces)):
        touch = slice(pieces.first_contact[k], pieces.first_contact[k + 1])
        for row in range(pieces.first_body[k], pieces.first_body[k + 1]):
            i = pieces.body[row]
            pose, twist = last.get(i, (start[i], None))
            assert (pieces.pose_before[row] == pose).all()
            assert twist is None or (pieces.twist_before[row] == twist).all()
            last[i] = pieces.pose_after[row], pieces.twist_after[row]
            if i == 0:
                continue
            sign = (pieces.body_b[touch] == i) * 1.0 - (pieces.body_a[touch] == i)
            pushed = sign @ pieces.impulse[touch]
            gained = run.model.bodies[i].mass * (pieces.twist_after[row] - pieces.twist_before[row])[:dimension]
            assert gained == pytest.approx(
                pushed + run.model.bodies[i].mass * pieces.length[k] * weight, abs=1e-13
            )  # N s, of some 10
    assert all((first.pose[-1][i] == last[i][0]).all() for i in last)


def test_pieces_of_a_run_of_no_steps():
    assert len(tumbling(2).record(0, pieces=True).pieces) == 0


def test_residuals_asked_of_the_loop():
    """It has no sweeps that could be short of a solution: numbers of them would be zero whatever it does."""
    with pytest.raises(ValueError, match="certificate"):
        _ = tumbling(2).certificate
    with pytest.raises(ValueError, match="certificate"):
        tumbling(2).record(1, certificates=True)


def test_pieces_of_a_step_at_fixed_dt():
    model = tumbling(2).model
    with pytest.raises(ValueError, match="pieces"):
        Simulation(model, Settings.classical(DT)).record(1, pieces=True)
