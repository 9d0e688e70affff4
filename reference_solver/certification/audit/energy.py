"""Where energy comes from: contacts take it, prescribed surfaces and loads give it, and nothing else does."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from reference_solver.certification.audit.run import Run, cross, twist_of
from reference_solver.model import Array


def measured(run: Run) -> Iterator[tuple[str, float]]:
    """Yield what is measured of the energy."""
    if not len(run.pieces):
        yield "gained", 0.0
        return
    gained, exempt, scale = _gains(run)
    without = np.where(exempt, 0.0, gained)
    yield "gained", float(max(np.cumsum(without).max(initial=0.0), without.max(initial=0.0)) / scale)


def _gains(run: Run) -> tuple[Array, np.ndarray, float]:
    """Energy (p,) that each piece gained beyond what loads and surfaces gave, which pieces the law may, and a scale.

    Newton's restitution with friction may create energy (E63), and so may the release of a held rebound: energy that
    was taken away before. Both are exempt and judged by their laws.
    """
    pieces, body = run.pieces, run.pieces.body
    free, owner = run.free[body], run.owner
    before, after = (_kinetic(run, k) for k in range(2))
    way = pieces.pose_after[:, : run.d] - pieces.pose_before[:, : run.d]
    load = (run.force[body] * way).sum(axis=1)
    mean = 0.5 * (pieces.twist_before[:, run.d :] + pieces.twist_after[:, run.d :])
    turn = pieces.pose_after[:, 2:] - pieces.pose_before[:, 2:] if run.d == 2 else run.length[:, None] * mean
    load += (run.torque[body] * turn).sum(axis=1)
    gained = np.zeros(len(pieces))
    np.add.at(gained, owner, np.where(free, after - before - load, 0.0))
    np.add.at(gained, run.contact_owner, -_surface_work(run))
    most = np.zeros(len(pieces))
    np.add.at(most, owner, np.where(free, before + after + np.abs(load), 0.0))
    # What loads do to all free bodies in a step: at rest, all that there is of kinetic energy is round-off.
    usual = float((run.mass * np.maximum(run.pull * run.dt, run.still) ** 2)[run.free].sum()) or 1.0
    mixed = np.zeros(len(pieces), bool)
    a, b = pieces.body_a, pieces.body_b
    lawful = (run.model.restitution[a, b] > 0.0) & (run.model.friction[a, b] > 0.0)
    mixed[run.contact_owner[lawful]] = True
    return gained, run.is_release | (run.is_impact & mixed), max(float(most.max()), usual)


def _kinetic(run: Run, late: int) -> Array:
    """Kinetic energy (m,) before or after [J]."""
    pieces = run.pieces
    twist = pieces.twist_after if late else pieces.twist_before
    v, w = twist[:, : run.d], twist[:, run.d :]
    return np.asarray(0.5 * run.mass[pieces.body] * (v * v).sum(axis=1) + 0.5 * (run.spin[late] * w).sum(axis=1))


def _surface_work(run: Run) -> Array:
    """Work (c,) that surfaces which move as prescribed do on free bodies [J]."""
    pieces = run.pieces
    work = np.zeros(len(pieces.body_a))
    for i, sign in ((pieces.body_a, 1.0), (pieces.body_b, -1.0)):
        twist = np.array([twist_of(body) for body in run.model.bodies])[i]
        place = np.array([body.pose[: run.d] for body in run.model.bodies], dtype=float)[i]
        time = pieces.begin[run.contact_owner] + 0.5 * pieces.length[run.contact_owner]
        place = place + time[:, None] * twist[:, : run.d]
        impulse = sign * pieces.impulse
        moment = sign * pieces.moment - cross(place, impulse)
        power = (impulse * twist[:, : run.d]).sum(axis=1) + (moment * twist[:, run.d :]).sum(axis=1)
        work += np.where(run.free[i], 0.0, power)
    return work
