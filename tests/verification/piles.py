"""Piles of a few bodies that fall between walls: their laws and energy."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from reference_solver.certificate.audit import audit
from reference_solver.model import Array, Model
from reference_solver.piles import GRAVITY, RATE, planar_pile, spatial_pile
from reference_solver.records import Record
from reference_solver.settings import TOLERANCE, Settings
from reference_solver.simulation import Simulation
from tests.verification.gate import Gate
from tests.verification.rotation import rotation_matrix

#: Seconds that a pile falls.
TIME = 1.0
#: Share of all energy that may come from nowhere: in each of a thousand pieces what a step may err by.
GAINED = 1e3 * TOLERANCE
#: Dimension, number of bodies, share of round ones. Boxes alone in space fall on several rough corners at once, whose
#: friction is solved to 1e-6 only: their certificate is refused.
PILES = ((2, 8, 1.0), (2, 8, 0.5), (2, 8, 0.0), (3, 4, 1.0), (3, 4, 0.5))


def gates() -> Iterator[Gate]:
    """Yield all rows."""
    for dimension, count, share in PILES:
        make, made_by = (planar_pile, "planar") if dimension == 2 else (spatial_pile, "spatial")
        model, case = make(1, count, share), f"{count} bodies, {share:.0%} round"
        record = Simulation(model, Settings.reference(1.0 / RATE)).record(round(RATE * TIME), pieces=True)
        broken = sum(not finding.holds for finding in audit(model, record, 1.0 / RATE))
        yield Gate.exactly("pile: laws broken", case, broken, 0, made_by)
        all_of_it = energies(model, record)
        gained = np.maximum(np.diff(all_of_it), 0.0).sum() / all_of_it[0]
        yield Gate.at_most("pile: energy gained, of all", case, gained, GAINED, made_by)


def energies(model: Model, record: Record) -> Array:
    """Kinetic and potential energy (s,) of the free bodies, from the floor [J]."""
    total, d = np.zeros(len(record.t)), model.dimension
    for i, body in enumerate(model.bodies):
        if body.motion != "free":
            continue
        moments = np.ravel(np.asarray(body.inertia))
        for k, (pose, twist) in enumerate(zip(record.pose[:, i], record.twist[:, i], strict=True)):
            spin = twist[d:] if d == 2 else rotation_matrix(pose[3:]).T @ twist[d:]
            total[k] += 0.5 * body.mass * (twist[:d] @ twist[:d]) + 0.5 * moments @ spin**2
            total[k] += body.mass * GRAVITY * pose[d - 1]
    return total
