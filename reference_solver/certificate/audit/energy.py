"""Where energy comes from and goes: prescribed surfaces and loads give it, friction takes it, and nothing else does."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from reference_solver.certificate.audit.contact import reduced_mass, unsure_turn
from reference_solver.certificate.audit.motion import swings, turned_by_momentum
from reference_solver.certificate.audit.run import Run, cross, twist_of
from reference_solver.certificate.audit.turning import rotation_vector, turned_contacts
from reference_solver.model import Array

#: What counts as no gap, as a share of a body: as much as the check ``apart`` lets an impulse act across.
ACROSS = 1e-9
#: Share of a body below which a gap is none (E20).
NO_GAP = 1e-12


def measured(run: Run) -> Iterator[tuple[str, float]]:
    """Yield what is measured of the energy."""
    if not len(run.pieces):
        yield from (("gained", 0.0), ("lost", 0.0))
        return
    gained, exempt, unseen, scale = _gains(run)
    without = np.where(exempt, 0.0, np.sign(gained) * np.maximum(np.abs(gained) - unseen, 0.0))
    yield "gained", float(max(np.cumsum(without).max(initial=0.0), without.max(initial=0.0)) / scale)
    # In a force phase friction takes energy where something slips, loads that press a gap shut lose what they do there,
    # and nothing else does. Low rebounds that are summed up lose more.
    asked = run.is_forces & (run.pieces.length > 0.0) & ~run.is_rocking
    yield "lost", float(np.where(asked, -without - _friction(run) - _shut(run), 0.0).max(initial=0.0) / scale)


def _shut(run: Run) -> Array:
    """Energy (p,) that contacts take by closing gaps which count as none, at most [J]: impulse times closing speed.

    What carries acts at such a gap, and gravity's work on the way is taken by it: of a weight at rest a share of
    gap/(g h^2), whatever the weight. The gap itself is judged as ``apart``.
    """
    pieces, over = run.pieces, turned_contacts(run)
    (row_a, row_b), (a, b) = run.side, (pieces.body_a, pieces.body_b)
    closing = np.zeros(len(a))
    for late, point, normal in ((False, pieces.point, pieces.normal), (True, over.last_point, over.last_normal)):
        moving = run.velocity_at(row_b, b, point, late, late) - run.velocity_at(row_a, a, point, late, late)
        closing -= 0.5 * (moving * normal).sum(axis=1)
    gap = ACROSS * np.minimum(run.extent[a], run.extent[b])
    length = pieces.length[run.contact_owner]
    speed = np.minimum(np.maximum(closing, 0.0), gap / np.where(length > 0.0, length, np.inf))
    taken = np.zeros(len(pieces))
    np.add.at(taken, run.contact_owner, np.linalg.norm(pieces.impulse, axis=1) * speed)
    return taken


def _friction(run: Run) -> Array:
    """Energy (p,) that friction takes at most in each piece: its impulses times the larger slip of both ends [J].

    Between them a slip may be faster: by an eighth of what accelerations add, times the share by which they change. So
    may that of the end where its point is not known, as of a rod that lies flush and rolls.
    """
    pieces, over = run.pieces, turned_contacts(run)
    (row_a, row_b), (a, b) = run.side, (pieces.body_a, pieces.body_b)
    slips = []
    for late, point, normal in ((False, pieces.point, pieces.normal), (True, over.last_point, over.last_normal)):
        moving = run.velocity_at(row_b, b, point, late, late) - run.velocity_at(row_a, a, point, late, late)
        slips.append(moving - (moving * normal).sum(axis=1)[:, None] * normal)
    slip = np.maximum(*(np.linalg.norm(each, axis=1) for each in slips))
    slip *= 1.0 + np.where(np.isfinite(over.stray), 0.0, unsure_turn(run, slips[0]))
    along = pieces.impulse - (pieces.impulse * over.normal).sum(axis=1)[:, None] * over.normal
    # A mean normal is known but for its lean, a mean slip but for that of its direction.
    size = np.linalg.norm(along, axis=1) + over.lean * np.linalg.norm(pieces.impulse, axis=1)
    added = np.linalg.norm(pieces.impulse, axis=1) / reduced_mass(run) + run.pull * pieces.length[run.contact_owner]
    taken = np.zeros(len(pieces))
    np.add.at(taken, run.contact_owner, size * (slip + 0.25 * swings(run)[run.contact_owner] * added))
    return taken


def _gains(run: Run) -> tuple[Array, np.ndarray, Array, float]:
    """Energy (p,) that each piece gained beyond what loads and surfaces gave, which pieces the law may, and a scale.

    The third is what is not known of the work of surfaces and torques.

    Newton's restitution may create energy (`_may_gain`): such pieces are exempt, and judged by their law.
    """
    pieces, body = run.pieces, run.pieces.body
    free, owner = run.free[body], run.owner
    before, after = (_kinetic(run, k) for k in range(2))
    way = pieces.pose_after[:, : run.d] - pieces.pose_before[:, : run.d]
    load = (run.force[body] * way).sum(axis=1)
    turn, unknown = _turn(run)
    load += (run.torque[body] * turn).sum(axis=1)
    gained = np.zeros(len(pieces))
    np.add.at(gained, owner, np.where(free, after - before - load, 0.0))
    work, unseen_work = _surface_work(run)
    np.add.at(gained, run.contact_owner, -work)
    unseen = np.zeros(len(pieces))
    np.add.at(unseen, run.contact_owner, unseen_work)
    np.add.at(unseen, owner, unknown * np.linalg.norm(run.torque[body], axis=1))
    # The way of a load is known to the last place of a coordinate, and to a gap that is none, which may be closed.
    known = np.spacing(np.abs(pieces.pose_after[:, : run.d])) + NO_GAP * run.extent[body][:, None]
    np.add.at(unseen, owner, np.where(free, (np.abs(run.force[body]) * known).sum(axis=1), 0.0))
    most = np.zeros(len(pieces))
    np.add.at(most, owner, np.where(free, before + after + np.abs(load), 0.0))
    # What loads do to all free bodies in a step: at rest, all that there is of kinetic energy is round-off.
    usual = float((run.mass * np.maximum(run.pull * run.dt, run.still) ** 2)[run.free].sum()) or 1.0
    return gained, run.is_impact & _may_gain(run), unseen, max(float(most.max()), usual)


def _may_gain(run: Run) -> NDArray[np.bool_]:
    """Whether (p,) an impact of each piece's contacts may create energy by Newton's law (E63).

    With impulses p it changes it by ``p.(u- + u+)/2``, u seen from what is moved: by ``-(1 - e) p_n |u_n-|/2`` of each
    contact that approaches: without friction the sum is below zero.
    """
    pieces, owner = run.pieces, run.contact_owner
    a, b, n = pieces.body_a, pieces.body_b, pieces.normal
    pressed = (pieces.impulse * n).sum(axis=1) > 0.0
    bouncy, rough = np.zeros(len(pieces), bool), np.zeros(len(pieces), bool)
    bouncy[owner[pressed & (run.model.restitution[a, b] > 0.0)]] = True
    rough[owner[pressed & (run.model.friction[a, b] > 0.0)]] = True
    return np.asarray(bouncy & rough)


def _turn(run: Run) -> tuple[Array, Array]:
    """Turn (m, 1 | 3) about fixed axes, the integral of the spin, and what is unknown (m,) of it [rad].

    A constant torque works by it. Where nothing pushes, or with an even force, angular momentum changes evenly and
    Euler's equations tell the spin (`integrated_turn`). In a piece that turns forces change, by what no record
    says; but the body has turned by the rotation vector psi, and by Magnus' series (W. Magnus, Commun. Pure Appl. Math.
    7, 1954) the integral of the spin is ``psi + h^2 (w_0 x w_1)/12`` but for the fifth order. With a_k the terms of
    Taylor's series of the spin about the middle, times h, that is ``-([a_1, a_4]/120 + [a_3, a_2]/60 + [[a_1, a_2],
    a_2]/240 + [a_1, [a_1, a_3]]/360 + [a_1, [a_1, [a_1, a_2]]]/720)`` (from the sixth order of the series: S. Blanes et
    al., Phys. Rep. 470, 2009). Both ends tell a_1 to a_3; a_4 is a sixth of a_2 times the square of the share by which
    accelerations change.
    """
    pieces, found, unknown = run.pieces, np.zeros((len(run.pieces.body), 3)), np.zeros(len(run.pieces.body))
    if run.d == 2:
        return pieces.pose_after[:, 2:] - pieces.pose_before[:, 2:], unknown
    bends = (run.pushed[2] > 0.0) & ~run.is_frozen[run.owner]
    asked = run.free[pieces.body] & (run.torque[pieces.body] != 0.0).any(axis=1) & (run.length > 0.0)
    even, rows = np.flatnonzero(asked & ~bends), np.flatnonzero(asked & bends)
    found[even] = turned_by_momentum(run, even)[1]
    first, last = (run.length[rows][:, None] * x[rows, run.d :] for x in (pieces.twist_before, pieces.twist_after))
    found[rows] = rotation_vector(pieces.pose_before[rows, 3:], pieces.pose_after[rows, 3:])
    found[rows] += np.cross(first, last) / 12.0
    one, two, three = (
        np.linalg.norm(x, axis=1) for x in (found[rows], last - first, 3.0 * (first + last) - 6.0 * found[rows])
    )
    four = two * swings(run)[run.owner[rows]] ** 2 / 6.0
    unknown[rows] = one * (four / 120.0 + two**2 / 240.0 + one * three / 360.0 + one**2 * two / 720.0)
    unknown[rows] += two * three / 60.0
    return found, unknown


def _kinetic(run: Run, late: int) -> Array:
    """Kinetic energy (m,) before or after [J]."""
    pieces = run.pieces
    twist = pieces.twist_after if late else pieces.twist_before
    v, w = twist[:, : run.d], twist[:, run.d :]
    return np.asarray(0.5 * run.mass[pieces.body] * (v * v).sum(axis=1) + 0.5 * (run.spin[late] * w).sum(axis=1))


def _surface_work(run: Run) -> tuple[Array, Array]:
    """Work (c,) that surfaces which move as prescribed do on free bodies [J], and what is not known of it.

    Places are those of the middle of a piece: a force that changes, on a surface that turns while it moves, does more
    or less by a twelfth of its change times both.
    """
    pieces = run.pieces
    work, unseen = np.zeros(len(pieces.body_a)), np.zeros(len(pieces.body_a))
    swing = swings(run)[run.contact_owner]
    for i, sign in ((pieces.body_a, 1.0), (pieces.body_b, -1.0)):
        twist = np.array([twist_of(body) for body in run.model.bodies])[i]
        place = np.array([body.pose[: run.d] for body in run.model.bodies], dtype=float)[i]
        length = pieces.length[run.contact_owner]
        time = pieces.begin[run.contact_owner] + 0.5 * length
        place = place + time[:, None] * twist[:, : run.d]
        impulse = sign * pieces.impulse
        moment = sign * pieces.moment - cross(place, impulse)
        power = (impulse * twist[:, : run.d]).sum(axis=1) + (moment * twist[:, run.d :]).sum(axis=1)
        moved = run.is_frozen[run.contact_owner] | run.free[i]
        speed, spin = np.linalg.norm(twist[:, : run.d], axis=1), np.linalg.norm(twist[:, run.d :], axis=1)
        work += np.where(run.free[i], 0.0, power)
        unseen += np.where(moved, 0.0, length * speed * spin * np.linalg.norm(impulse, axis=1) * swing / 6.0)
    return work, unseen
