"""What a step at impulse level leaves of gaps and velocities is taken out at its end (E28)."""

import numpy as np
import pytest

from reference_solver import Settings, Simulation
from reference_solver.certificate.audit.run import Run
from reference_solver.piles import planar_pile

DT = 1.0 / 120.0


@pytest.fixture(scope="module")
def settled():
    """A pile of discs and boxes that falls, with some steps at impulse level."""
    simulation = Simulation(planar_pile(1, 16, 0.5), Settings.reference(DT))
    record = simulation.record(150, pieces=True)
    assert simulation.certificate["held_steps"] >= 5
    return simulation, record


def test_gaps_and_overlaps_that_it_leaves_are_closed(settled):
    """Left alone they are 1e-3 of a half width; what closes them leaves less than a millionth."""
    assert settled[0].certificate["penetration"] < 1e-6


def test_velocities_at_its_end_are_those_that_its_contacts_allow(settled):
    """Of what is pressed a thousandth of the approach is left at most, by points that the record has for the piece."""
    simulation, record = settled
    run, pieces = Run(simulation.model, record.pieces, DT), record.pieces
    asked = run.is_correction[run.contact_owner] & (np.abs(pieces.impulse) > 0.0).any(axis=1)
    approach = [
        (
            run.velocity_at(run.side[1], pieces.body_b, pieces.point, late)
            - run.velocity_at(run.side[0], pieces.body_a, pieces.point, late)
        )
        * pieces.normal
        for late in (False, True)
    ]
    before, after = (-x.sum(axis=1)[asked] for x in approach)
    assert asked.sum() >= 20 and before.max() > 0.1
    assert after.max() < 1e-3 * before.max()
