"""Newton's law creates energy where contacts rebound and rub alone (E63), and what parts is not pressed (E21)."""

from dataclasses import replace

import numpy as np
import pytest

from reference_solver import Body, Disc, HalfSpace, Model, Settings, Simulation
from reference_solver.certificate.audit import audit, energy
from reference_solver.certificate.audit.run import Run
from reference_solver.pieces import IMPACT

DT, E = 1.0 / 240.0, 0.3
LIGHT, HEAVY = 0.1, 10.0


def landing(sinks, falls, e=E, friction=0.0):
    """A heavy disc comes down on a light one that rests, with e = 0, on a floor which ``sinks`` [m/s]."""

    def disc(y, mass, speed):
        return Body(Disc(0.5), mass, 0.125 * mass, (0.0, y, 0.0), (0.0, speed, 0.0))

    floor = Body(HalfSpace((0.0, 1.0)), twist=(0.0, -sinks, 0.0), motion="prescribed")
    bodies = [floor, disc(0.5, LIGHT, 0.0), disc(1.5, HEAVY, -falls)]
    restitution = np.zeros((3, 3))
    restitution[1, 2] = restitution[2, 1] = e
    return Model(2, bodies, (0.0, 0.0), restitution, friction)


def run(model):
    record = Simulation(model, Settings.reference(DT)).record(4, pieces=True)
    return record, Run(model, record.pieces, DT)


def refused(model, record):
    return {finding.name for finding in audit(model, record, DT) if not finding.holds}


def test_disc_struck_while_its_floor_sinks():
    """It parts from the floor as it is struck, which has no part in that; then it is faster than the floor."""
    model = landing(0.25, 0.25)
    record, judged = run(model)
    assert judged.is_followed.sum() == 1
    heavy = -0.25 + (1.0 + E) * 0.25 * LIGHT / (LIGHT + HEAVY)
    assert record.twist[-1, 1:, 1] == pytest.approx([-0.25, heavy], rel=1e-12)
    assert refused(model, record) == set()


def test_push_on_a_contact_that_parts():
    """The same from the floor's view, whose contact is put into the blow between the discs, without a load and with."""
    floor, light, heavy = landing(0.25, 0.25).bodies
    bodies = [
        replace(floor, twist=None, motion="fixed"),
        replace(light, twist=(0.0, 0.25, 0.0)),
        replace(heavy, twist=(0.0, 0.0, 0.0)),
    ]
    model = replace(landing(0.25, 0.25), bodies=bodies)
    record, _ = run(model)
    pieces = record.pieces
    first, second = np.flatnonzero(pieces.kind == IMPACT)
    at, added = pieces.first_contact[first], pieces.first_contact[second]
    assert (pieces.body_a[at], pieces.body_a[added]) == (1, 0)
    for push in (0.0, 1e-6):
        moved = replace(pieces, first_contact=pieces.first_contact + (np.arange(len(pieces) + 1) > first))
        for name in ("body_a", "body_b", "feature", "point", "normal", "impulse", "moment"):
            rows = getattr(pieces, name)
            moved = replace(moved, **{name: np.insert(rows, at, rows[added], axis=0)})
        moved.impulse[at], moved.moment[at] = push * moved.normal[at], 0.0
        assert ("normal" in refused(model, replace(record, pieces=moved))) is (push > 0.0)


def test_refusal_of_a_rebound_faster_than_its_law():
    record, _ = run(landing(0.25, 0.25, E + 1e-6))
    assert "normal" in refused(landing(0.25, 0.25), record)


@pytest.mark.parametrize(
    ("sinks", "falls", "e", "friction", "may"),
    [
        (0.25, 0.25, E, 0.0, False),
        (0.0, 0.25, E, 0.0, False),
        (-0.1, 0.25, E, 0.0, False),  # all approach
        (0.0, 0.25, E, 0.5, True),  # Kane's
    ],
)
def test_gains_with_restitution_and_friction_alone(sinks, falls, e, friction, may):
    record, judged = run(landing(sinks, falls, e, friction))
    first = record.pieces.kind == IMPACT
    assert first.any() and energy._may_gain(judged)[first].tolist() == [may] * int(first.sum())
    assert refused(judged.model, record) == set()


def test_refusal_of_a_gain_without_restitution_and_friction():
    """The heavy disc leaves ten times as fast as it came: no law, and energy from nowhere."""
    model = landing(0.0, 0.25)
    record, _ = run(model)
    pieces, after = record.pieces, record.pieces.twist_after.copy()
    hit = np.flatnonzero(np.repeat(pieces.kind == IMPACT, np.diff(pieces.first_body)) & (pieces.body == 2))
    after[hit] *= 1.0 + 10.0 / E  # from .3 of the speed to more than it had
    assert "gained" in refused(model, replace(record, pieces=replace(pieces, twist_after=after)))
