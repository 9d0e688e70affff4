"""How bodies move between impacts and what changes their momentum, from Newton's and Euler's equations alone."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from reference_solver.certification.audit.run import Run, cross, twist_of
from reference_solver.certification.audit.space import normal_turns
from reference_solver.certification.geometry import rotation
from reference_solver.model import Array
from reference_solver.pieces import ROCKING

#: Classical Runge-Kutta steps in which a turn is integrated: one of .3 rad is off by 1e-11.
TURN_STEPS = 16
#: What Hermite's polynomial misses of the integral of a way over time h, as a share of h times how far the way may lie
#: off the mean velocity (B = a h^2 angle/2): h^5/720 of the way's fourth derivative, a ((angle/h)^2 + 2 angle/h^2) for
#: a turn at a steady rate and for one that begins, at angles of up to half a radian.
HERMITE = 5.0 / 720.0
#: Largest displacement, as a share of a body, that closes a gap of the impulse-level scheme.
CORRECTED = 1e-4


def measured(run: Run, pose: Array, end: Array) -> Iterator[tuple[str, float]]:
    """Yield what is measured of the motion; ``pose`` (n, P) at the start, ``end`` (n, P) as samples have it last."""
    yield "finite", 0.0 if _all_finite(run) else 1.0
    yield "joined", _joined(run, pose, end)
    yield "time", _time(run)
    yield "momentum", _momentum(run)
    yield "spin", _spin(run)
    yield from _path(run)
    yield "turn", _turn(run)
    yield "prescribed", _prescribed(run, pose, end)


def _all_finite(run: Run) -> bool:
    pieces = run.pieces
    fields = (pieces.pose_after, pieces.twist_before, pieces.twist_after, pieces.impulse, pieces.moment, pieces.normal)
    return all(np.isfinite(field).all() for field in fields)


def _joined(run: Run, pose: Array, end: Array) -> float:
    """Largest jump of a pose or twist between the pieces of a body, and between pieces and samples; 0 expected.

    A quaternion of the model is made a unit one first, which moves it by its own round-off.
    """
    pieces, worst = run.pieces, 0.0
    for i, body in enumerate(run.model.bodies):
        rows = np.flatnonzero(pieces.body == i)
        if body.motion != "free":  # in as many pieces at a time as touch it: see `_prescribed`
            continue
        if not len(rows):
            worst = max(worst, float(np.abs(end[i] - pose[i]).max()))
            continue
        here, then = rows[:-1], rows[1:]
        first = np.abs(pieces.pose_before[rows[0]] - pose[i])
        if run.d == 3:
            first[3:] -= 2.0 * np.finfo(float).eps
        starts = max(first.max(), 0.0)
        ends = np.abs(pieces.pose_after[rows[-1]] - end[i]).max()
        twist = np.abs(pieces.twist_before[rows[0]] - twist_of(body)).max() if pieces.begin[0] == 0.0 else 0.0
        places = np.abs(pieces.pose_after[here] - pieces.pose_before[then]).max(initial=0.0)
        speeds = np.abs(pieces.twist_after[here] - pieces.twist_before[then]).max(initial=0.0)
        worst = max(worst, float(starts), float(ends), float(twist), float(places), float(speeds))
    return worst


def _time(run: Run) -> float:
    """Largest gap or overlap in time between the pieces of a free body, as a share of a step."""
    pieces, worst = run.pieces, 0.0
    for i in np.flatnonzero(run.free):
        at = run.owner[pieces.body == i]
        begin, length = pieces.begin[at], pieces.length[at]
        if len(at):
            noise = 4.0 * np.spacing(np.abs(begin).max())
            jump = np.abs(begin[1:] - begin[:-1] - length[:-1]).max(initial=0.0)
            whole = abs((pieces.step.max() + 1) * run.dt - (begin[-1] + length[-1]))
            worst = max(worst, (max(float(jump), whole) - noise) / run.dt)
    return worst


def _momentum(run: Run) -> float:
    """Change of m v against impulses and loads, each body in each piece, as a share of all that acts on it."""
    pieces, mass = run.pieces, run.mass[run.pieces.body][:, None]
    before, after = (mass * twist[:, : run.d] for twist in (pieces.twist_before, pieces.twist_after))
    load = run.length[:, None] * run.force[pieces.body]
    linear, _, size, _ = run.pushed
    defect = np.linalg.norm(after - before - linear - load, axis=1)
    scale = np.linalg.norm(before, axis=1) + np.linalg.norm(after, axis=1) + size + np.linalg.norm(load, axis=1)
    return _worst(defect, scale + mass[:, 0] * run.still[pieces.body], run.free[pieces.body])


def _spin(run: Run) -> float:
    """Change of angular momentum against moments and torques, as a share of all that acts.

    About the body's own place at the start of the piece. Where levers stood still they moved with the body, and its
    own angular momentum takes their moments; else the body's way in the piece counts, by its Hermite polynomial.
    """
    pieces, body = run.pieces, run.pieces.body
    before, after = run.spin
    _, moment, size, moment_size = run.pushed
    torque = run.length[:, None] * run.torque[body]
    gained = after - before - moment - torque
    mass, force, length = run.mass[body][:, None], run.force[body], run.length[:, None]
    way = pieces.pose_after[:, : run.d] - pieces.pose_before[:, : run.d]
    first, last = pieces.twist_before[:, : run.d], pieces.twist_after[:, : run.d]
    over = 0.5 * length * way + length**2 * (first - last) / 12.0
    gained = np.where(run.is_frozen[run.owner][:, None], gained, gained + cross(way, mass * last) - cross(over, force))
    # A body that spins about nothing has the momentum that its speed gives to a point at its outermost.
    arm = np.where(np.isfinite(run.reach), run.reach, 0.0)[body]
    speed = np.linalg.norm(first, axis=1) + np.linalg.norm(last, axis=1) + run.still[body]
    parts = (np.linalg.norm(x, axis=1) for x in (before, after, torque))
    scale = sum(parts) + moment_size + arm * (run.mass[body] * speed + size)
    missed = np.where(run.is_frozen[run.owner], 0.0, HERMITE * run.length * _bend(run) * np.linalg.norm(force, axis=1))
    return _worst(np.maximum(np.linalg.norm(gained, axis=1) - missed, 0.0), scale, run.free[body])


def _path(run: Run) -> Iterator[tuple[str, float]]:
    """Ways of free bodies against their velocities: those nothing touches, and those something touches.

    With constant acceleration the way is the mean velocity times the time. In a phase of fifth order the velocity
    bends: by no more than what it changes, times the angle by which bodies or normals turn in the piece.
    """
    pieces, body, length = run.pieces, run.pieces.body, run.length
    last = pieces.twist_after[:, : run.d]
    mean = 0.5 * (pieces.twist_before[:, : run.d] + last)
    mean = np.where(run.is_fixed[run.owner][:, None], last, mean)
    way = pieces.pose_after[:, : run.d] - pieces.pose_before[:, : run.d]
    defect = np.linalg.norm(way - length[:, None] * mean, axis=1)
    bend = np.where(run.is_frozen[run.owner], 0.0, _bend(run))
    # What rocks to rest goes anywhere between its speeds of the start and of the end, which comes first.
    change = np.linalg.norm(last - pieces.twist_before[:, : run.d], axis=1)
    bend = np.where((pieces.scheme == ROCKING)[run.owner], 0.5 * length * change, bend)
    touched = np.zeros(len(body), bool)
    for row in run.side:
        touched[row[row >= 0]] = True
    noise = 8.0 * np.spacing(np.abs(pieces.pose_before[:, : run.d]).max(axis=1, initial=0.0))
    defect = np.maximum(defect - bend - noise - 4.0 * np.spacing(length * np.linalg.norm(mean, axis=1)), 0.0)
    size = np.where(np.isfinite(run.extent), run.extent, 1.0)[body]
    # What closes the gaps of the impulse-level scheme is of the third order of its step.
    defect = np.where(run.is_correction[run.owner], np.maximum(defect - CORRECTED * size, 0.0), defect)
    share = np.where(run.free[body], defect / size, 0.0)
    yield "flight", float(share[~touched].max(initial=0.0))
    yield "path", float(share[touched].max(initial=0.0))


def _bend(run: Run) -> Array:
    """How far a path of a phase of fifth order may lie off the mean velocity times the time (m,) [m]."""
    pieces, body, length = run.pieces, run.pieces.body, run.length
    spin = np.linalg.norm(pieces.twist_before[:, run.d :], axis=1) + np.linalg.norm(
        pieces.twist_after[:, run.d :], axis=1
    )
    angle = np.zeros(len(pieces))
    np.maximum.at(angle, run.owner, 0.5 * length * spin)
    # A disc that slides round another turns nothing but the normal.
    np.maximum.at(angle, run.contact_owner, normal_turns(run))
    change = np.linalg.norm(pieces.twist_after[:, : run.d] - pieces.twist_before[:, : run.d], axis=1)
    load = length * np.linalg.norm(run.force[body], axis=1) / run.mass[body]
    return np.asarray(0.5 * length * (change + load) * np.minimum(angle[run.owner], 1.0))


def _turn(run: Run) -> float:
    """Orientations of free bodies that nothing touches against Euler's equations, [rad]; 1e-15 a unit is round-off."""
    pieces = run.pieces
    alone = run.free[pieces.body] & (run.length > 0.0)
    for row in run.side:
        alone[row[row >= 0]] = False
    rows = np.flatnonzero(alone)
    if not len(rows):
        return 0.0
    length = run.length[rows]
    if run.d == 2:
        last = pieces.twist_after[rows, 2]
        mean = np.where(run.is_fixed[run.owner[rows]], last, 0.5 * (pieces.twist_before[rows, 2] + last))
        turn = pieces.pose_after[rows, 2] - pieces.pose_before[rows, 2]
        noise = 8.0 * np.spacing(np.abs(pieces.pose_after[rows, 2]))
        return float(np.maximum(np.abs(turn - length * mean) - noise, 0.0).max())
    before, after = (spin[rows] for spin in run.spin)
    moments = run.moments[pieces.body[rows]]
    q = integrated_turn(pieces.pose_before[rows, 3:], before, after, moments, length)
    dot = np.abs((q * pieces.pose_after[rows, 3:]).sum(axis=1) / np.linalg.norm(pieces.pose_after[rows, 3:], axis=1))
    off = np.linalg.norm(
        q * np.sign((q * pieces.pose_after[rows, 3:]).sum(axis=1))[:, None] - pieces.pose_after[rows, 3:], axis=1
    )
    return float(np.where(dot > 0.5, 2.0 * off, np.pi).max())


def integrated_turn(q: Array, before: Array, after: Array, moments: Array, length: Array) -> Array:
    """Quaternions (s, 4) after ``length``; angular momentum goes linearly from ``before`` to ``after``, world axes."""
    h = length / TURN_STEPS

    def rate(q: Array, share: float) -> Array:
        momentum = before + share * (after - before)
        turn = rotation(np.concatenate([np.zeros((len(q), 3)), q], axis=1))
        w = np.einsum("sij,sj,skj,sk->si", turn, 1.0 / moments, turn, momentum)
        scalar, vector = q[:, :1], q[:, 1:]
        return 0.5 * np.concatenate(
            [-(w * vector).sum(axis=1, keepdims=True), scalar * w + np.cross(w, vector)], axis=1
        )

    step = h[:, None]
    for k in range(TURN_STEPS):
        at, middle, end = k / TURN_STEPS, (k + 0.5) / TURN_STEPS, (k + 1.0) / TURN_STEPS
        one = rate(q, at)
        two = rate(q + 0.5 * step * one, middle)
        three = rate(q + 0.5 * step * two, middle)
        four = rate(q + step * three, end)
        q = q + step / 6.0 * (one + 2.0 * two + 2.0 * three + four)
        q = q / np.linalg.norm(q, axis=1, keepdims=True)
    return q


def _prescribed(run: Run, start: Array, end: Array) -> float:
    """Largest distance of a body that is not free from its prescribed motion, in pieces and samples [m, rad]."""
    pieces, worst = run.pieces, 0.0
    if not len(pieces):
        return worst
    steps = int(pieces.step.max()) + 1
    for i in np.flatnonzero(~run.free):
        rows, at = pieces.body == i, run.owner[pieces.body == i]
        times = np.concatenate([[0.0, steps * run.dt], pieces.begin[at], pieces.begin[at] + pieces.length[at]])
        states = np.concatenate([start[i][None], end[i][None], pieces.pose_before[rows], pieces.pose_after[rows]])
        should = run.prescribed_pose(int(i), times)
        # One rounding of each coordinate a step.
        noise = 2.0 * (steps + 4) * np.spacing(np.maximum(np.abs(states), np.abs(should)).max(initial=1.0))
        twist = twist_of(run.model.bodies[int(i)])
        speeds = np.abs(np.concatenate([pieces.twist_before[rows], pieces.twist_after[rows]]) - twist).max(initial=0.0)
        worst = max(worst, float(speeds), float(np.abs(states - should).max() - noise))
    return worst


def _worst(defect: Array, scale: Array, of: NDArray[np.bool_]) -> float:
    share = np.divide(defect, scale, out=np.where(defect > 0.0, np.inf, 0.0), where=scale > 0.0)
    return float(share[of].max(initial=0.0))
