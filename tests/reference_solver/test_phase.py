"""Phases of lasting contact: their lengths know no world that moves, and contacts that part come back by a parabola."""

import numpy as np
import pytest

from reference_solver import Body, Disc, Model, Settings, Simulation, Sphere
from reference_solver.compilation import from_python
from reference_solver.stepping import phase
from reference_solver.stepping.lasting import CONTACTS, HOPS, allocate_lasting
from tests.verification.space import GRAVITY, SPACES

first_return = from_python(phase.first_return)

#: Speed of the world [m/s], step [s] and time [s]: long steps, that the length of a phase is what its error allows.
SPEED, DT, TIME = 30.0, 1 / 20, 0.45


def on_a_hill(space, speed):
    """A ball that rolls down a ball of one metre, all of it at ``speed`` along the ground."""
    hill = Body(
        Disc(1.0) if space.dimension == 2 else Sphere(1.0),
        motion="prescribed",
        pose=space.pose(0.0, 0.0),
        twist=space.twist(speed),
    )
    ball = space.ball(1.3 * np.sin(0.3), 1.3 * np.cos(0.3), space.twist(speed), 0.3)
    return Model(space.dimension, [hill, ball], space.vector(0.0, -GRAVITY), 0.0, 5.0)


@pytest.mark.parametrize("space", SPACES, ids=lambda space: space.name)
def test_a_world_that_moves_as_a_whole_makes_the_same_phases(space):
    """What a phase may be off is a share of the motion in it: of that of the world it would be a thousandfold."""
    rest, moving = (Simulation(on_a_hill(space, speed), Settings.reference(DT)) for speed in (0.0, SPEED))
    one, other = (run.record(round(TIME / DT), pieces=True) for run in (rest, moving))
    assert len(one.pieces) == len(other.pieces) > 2 * TIME / DT  # phases are shortened
    relative = other.pose[-1, 1] - other.pose[-1, 0], one.pose[-1, 1] - one.pose[-1, 0]
    # Each of its pieces rounds places of up to SPEED TIME by half a unit in the last place, some four times on the way
    # to a stage; e^(t sqrt(g / 1.5 R)) = 2.8 times as much is left of that in the end.
    rounded = 4.0 * len(one.pieces) * SPEED * TIME * 0.5 * np.finfo(float).eps * 2.8
    assert np.abs(relative[0] - relative[1]).max() <= rounded < 1e-12


def test_contacts_that_part_are_back_where_their_gaps_are_closed_again():
    """Gaps u t + a t^2/2; one that did not part, and one that nothing draws back, are not waited for."""
    speeds, gains = (3e-12, 2e-12, 1e-12, 1e-12), (-9.81, -2.5, -400.0, 0.5)
    lasting = allocate_lasting(2, 2, 4)
    lasting.size[CONTACTS] = 4
    lasting.body[:, 1] = 1
    lasting.parts[:] = HOPS, HOPS, 0, HOPS
    lasting.speed[:, 0] = speeds
    lasting.gamma[:, 0] = -0.31  # of levers that turn
    lasting.acceleration[1] = (0.0, 1.0, 0.0)
    lasting.jacobian[:, 1, 0, 1] = np.add(gains, 0.31)
    back = first_return(lasting, 1.0)
    assert speeds[0] * back + 0.5 * gains[0] * back**2 == pytest.approx(0.0, abs=1e-14 * speeds[0] * back)
    assert speeds[1] * back + 0.5 * gains[1] * back**2 > 0.0  # it comes later
    assert first_return(lasting, 0.5 * back) == 0.5 * back
    lasting.parts[0] = 0
    late = first_return(lasting, 1.0)
    assert speeds[1] * late + 0.5 * gains[1] * late**2 == pytest.approx(0.0, abs=1e-14 * speeds[1] * late)
