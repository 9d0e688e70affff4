"""How bodies move between impacts and what changes their momentum, from Newton's and Euler's equations alone."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from reference_solver.certificate.audit.run import Run, cross, twist_of
from reference_solver.certificate.audit.turning import changes_of_force
from reference_solver.certificate.audit.unexplained import Unexplained
from reference_solver.geometry import rotation
from reference_solver.model import Array
from reference_solver.pieces import ROCKING
from reference_solver.records import Record

#: A turn is integrated in steps of this angle at most [rad], up to what a turn may cost; each leaves out this share.
STEPPED_TURN, MOST_STEPS, LEFT_OUT = 0.1, 4096, 1e-11
#: Rows that are integrated at a time: their terms take 6 MB.
BLOCK = 2048
#: Share of h^5 times the fourth derivative of a way that its integral by both ends leaves out: 1/720, six times.
UNSEEN = 6.0 / 720.0


def measured(run: Run, pose: Array, record: Record, left: Unexplained) -> Iterator[tuple[str, float]]:
    """Yield what is measured of the motion; ``pose`` (n, P) at the start, samples as the record has them."""
    end = record.pose[-1]
    yield "finite", 0.0 if _all_finite(run) else 1.0
    yield "joined", max(_joined(run, pose, end), _sampled(run, record))
    yield "time", _time(run)
    yield "momentum", _momentum(run, left)
    yield "spin", _spin(run, left)
    yield from _path(run, left)
    yield "turn", _turn(run, left)
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


def _sampled(run: Run, record: Record) -> float:
    """Largest distance of a sample, its velocity or its time from what the pieces say of the end of that step."""
    pieces = run.pieces
    steps = np.rint(record.t / run.dt).astype(np.int64)
    worst = float(np.abs(record.t - steps * run.dt).max(initial=0.0) / run.dt)
    worst = worst if worst > 1e-12 else 0.0
    for i in np.flatnonzero(run.free):
        rows = np.flatnonzero(pieces.body == i)
        last = np.searchsorted(pieces.step[run.owner[rows]], steps) - 1
        known = last >= 0
        at = rows[last[known]]
        worst = max(worst, float(np.abs(record.pose[known, i] - pieces.pose_after[at]).max(initial=0.0)))
        worst = max(worst, float(np.abs(record.twist[known, i] - pieces.twist_after[at]).max(initial=0.0)))
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


def _momentum(run: Run, left: Unexplained) -> float:
    """Change of m v against impulses and loads, each body in each piece, as a share of all that acts on it."""
    pieces, mass = run.pieces, run.mass[run.pieces.body][:, None]
    before, after = (mass * twist[:, : run.d] for twist in (pieces.twist_before, pieces.twist_after))
    load = run.length[:, None] * run.force[pieces.body]
    linear, _, size, _ = run.pushed
    defect = np.linalg.norm(after - before - linear - load, axis=1)
    scale = np.linalg.norm(before, axis=1) + np.linalg.norm(after, axis=1) + size + np.linalg.norm(load, axis=1)
    still = mass[:, 0] * run.still[pieces.body]
    left.gained(defect / mass[:, 0])
    return _worst(np.maximum(defect - still, 0.0), scale + still, run.free[pieces.body])


def _spin(run: Run, left: Unexplained) -> float:
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
    frozen = run.is_frozen[run.owner]
    gained = np.where(frozen[:, None], gained, gained + cross(way, mass * last) - cross(over, force))
    # What that polynomial does not see of the way: h^5/720 of its fourth derivative, an acceleration times w^2 or the
    # rate of w, with w the rate at which contacts turn. A ball that slides over another without friction turns them and
    # does not spin. Each force turns with its own contact, so that forces count, and not their sum.
    load, time = np.linalg.norm(force, axis=1), length[:, 0]
    pulled = (load * time + size) / mass[:, 0]
    passing = time * np.linalg.norm(last - first, axis=1) / np.where(np.isfinite(run.extent), run.extent, 1.0)[body]
    unseen = UNSEEN * load * time**2 * pulled * (turned_by(run)[run.owner] ** 2 + passing)
    # A body that spins about nothing has the momentum that its speed gives to a point at its outermost.
    arm = np.where(np.isfinite(run.reach), run.reach, 0.0)[body]
    still = run.still[body]
    speed = np.linalg.norm(first, axis=1) + np.linalg.norm(last, axis=1) + still
    parts = (np.linalg.norm(x, axis=1) for x in (before, after, torque))
    scale = sum(parts) + moment_size + arm * (run.mass[body] * speed + size)
    # A body whose outermost points are so slow stands still, as in `_momentum`.
    defect = np.linalg.norm(gained, axis=1) - np.where(frozen, 0.0, unseen) - arm * run.mass[body] * still
    left.gained(arm * np.maximum(defect, 0.0) / run.moments[body].min(axis=1))
    return _worst(np.maximum(defect, 0.0), scale, run.free[body])


def _path(run: Run, left: Unexplained) -> Iterator[tuple[str, float]]:
    """Ways of free bodies against their velocities: those nothing touches, and those something touches.

    With constant acceleration the way is the mean velocity times the time. In a piece that turns the velocity
    bends: by no more than what it changes, times the angle by which bodies turn in the piece.
    """
    pieces, body, length = run.pieces, run.pieces.body, run.length
    last = pieces.twist_after[:, : run.d]
    mean = 0.5 * (pieces.twist_before[:, : run.d] + last)
    way = pieces.pose_after[:, : run.d] - pieces.pose_before[:, : run.d]
    defect = np.linalg.norm(way - length[:, None] * mean, axis=1)
    bend = np.where(run.is_frozen[run.owner], 0.0, _bend(run))
    # What rocks to rest goes anywhere between its speeds of the start and of the end, which comes first.
    change = np.linalg.norm(last - pieces.twist_before[:, : run.d], axis=1)
    bend = np.where((pieces.scheme == ROCKING)[run.owner], 0.5 * length * change, bend)
    touched = _touched(run)
    noise = 8.0 * np.spacing(np.abs(pieces.pose_before[:, : run.d]).max(axis=1, initial=0.0))
    defect = np.maximum(defect - bend - noise - 4.0 * np.spacing(length * np.linalg.norm(mean, axis=1)), 0.0)
    size = np.where(np.isfinite(run.extent), run.extent, 1.0)[body]
    left.went(defect)
    share = np.where(run.free[body], defect / size, 0.0)
    yield "flight", float(share[~touched].max(initial=0.0))
    yield "path", float(share[touched].max(initial=0.0))


def _bend(run: Run) -> Array:
    """How far a path of a piece that turns may lie off the mean velocity times the time (m,) [m]."""
    body = run.pieces.body
    acting = run.pushed[2] + run.length * np.linalg.norm(run.force[body], axis=1)
    return np.asarray(0.5 * run.length * acting / run.mass[body] * np.minimum(swings(run)[run.owner], 1.0))


def swings(run: Run) -> Array:
    """Share (p,) by which accelerations of bodies may change in a piece.

    By the angle through which contacts turn, and by forces that change, of which the way sees a sixth.
    """
    share = np.zeros(len(run.pieces))
    np.maximum.at(share, run.contact_owner, changes_of_force(run))
    return turned_by(run) + 0.25 * share


def turned_by(run: Run) -> Array:
    """Angle (p,) through which levers and normals turn in a piece, at most [rad].

    With spins and with what spins change to; and by contacts that go along a body: a lever then changes by its way
    over it.
    """
    pieces, d = run.pieces, run.d
    spins = [np.linalg.norm(twist[:, d:], axis=1) for twist in (pieces.twist_before, pieces.twist_after)]
    gained = np.linalg.norm(pieces.twist_after[:, d:] - pieces.twist_before[:, d:], axis=1)
    angle = np.zeros(len(pieces))
    np.maximum.at(angle, run.owner, 0.5 * run.length * sum(spins) + np.sqrt(run.length * gained))
    slip = np.zeros((len(pieces.body_a), d))
    size = np.full(len(pieces.body_a), np.inf)
    for row, body, sign in zip(run.side, (pieces.body_a, pieces.body_b), (-1.0, 1.0), strict=True):
        slip += sign * run.velocity_at(row, body, pieces.point, after=False)
        size = np.minimum(size, run.extent[body])
    slid = pieces.length[run.contact_owner] * np.linalg.norm(slip, axis=1) / size
    np.maximum.at(angle, run.contact_owner, slid)
    return angle


def _turn(run: Run, left: Unexplained) -> float:
    """Orientations of free bodies against their spins, in space by Euler's equations [rad].

    Torques are constant where rows stand still; where they turn, spins bend as paths do. Sums of low rebounds are not
    asked.
    """
    pieces, owner = run.pieces, run.owner
    rows = np.flatnonzero(run.free[pieces.body] & (run.length > 0.0) & ~run.is_rocking[owner])
    if not len(rows):
        return 0.0
    length, body = run.length[rows], pieces.body[rows]
    first, last = pieces.twist_before[rows, run.d :], pieces.twist_after[rows, run.d :]
    arm = np.where(np.isfinite(run.reach), run.reach, 0.0)[body]
    acting = arm * run.pushed[2][rows] + length * np.linalg.norm(run.torque[body], axis=1)
    bend = 0.5 * length * acting / run.moments[body].min(axis=1) * np.minimum(swings(run)[owner[rows]], 1.0)
    if run.d == 3:
        # Constant torques of a slide turn a ball about an axis that turns: as one rotation that is of third order.
        turning = length**2 * np.linalg.norm(np.cross(first, last), axis=1) / 8.0
        bend = np.where(run.is_frozen[owner[rows]], turning, bend + turning)
    else:
        bend = np.where(run.is_frozen[owner[rows]], 0.0, bend)
    bend = np.where(_touched(run)[rows], bend, 0.0)
    if run.d == 2:
        mean = 0.5 * (first + last)[:, 0]
        turn = pieces.pose_after[rows, 2] - pieces.pose_before[rows, 2]
        noise = 8.0 * np.spacing(np.abs(pieces.pose_after[rows, 2])) + bend
        off = np.maximum(np.abs(turn - length * mean) - noise, 0.0)
        left.went(arm * off, rows)
        return float(off.max())
    q, _ = turned_by_momentum(run, rows)
    dot = (q * pieces.pose_after[rows, 3:]).sum(axis=1)
    off = 2.0 * np.linalg.norm(q * np.sign(dot)[:, None] - pieces.pose_after[rows, 3:], axis=1)
    whole = np.linalg.norm(pieces.pose_after[rows, 3:], axis=1)
    off = np.where(np.abs(dot) > 0.5 * whole, np.maximum(off - bend, 0.0), np.pi)
    left.went(arm * off, rows)
    return float(off.max())


def _touched(run: Run) -> NDArray[np.bool_]:
    """Whether (m,) a body has a contact in its piece."""
    found = np.zeros(len(run.pieces.body), bool)
    for row in run.side:
        found[row[row >= 0]] = True
    return found


def turned_by_momentum(run: Run, rows: NDArray[np.int64]) -> tuple[Array, Array]:
    """Quaternions (s, 4) and integrals of spins (s, 3) of rows whose momentum changes evenly, by `integrated_turn`."""
    before, after = (spin[rows] for spin in run.spin)
    moments = run.moments[run.pieces.body[rows]]
    return integrated_turn(run.pieces.pose_before[rows, 3:], before, after, moments, run.length[rows])


def integrated_turn(q: Array, before: Array, after: Array, moments: Array, length: Array) -> tuple[Array, Array]:
    """Quaternions (s, 4) after ``length``, and the integrals (s, 3) of the spins on the way [rad].

    Angular momentum L goes linearly from ``before`` to ``after``, world axes. By Taylor's series of Euler's equations:
    axes e turn by e' = w x e, w = sum (e . L)/I e, so that a bound rho of them grows by rho' <= W rho^3, W = |L|/I_min,
    and no coefficient is larger than that of (1 - 2 W t)^-1/2: terms are as many as leave (2 W t)^k below `LEFT_OUT`.
    """
    q, turn = q.copy(), np.zeros((len(q), 3))
    all_axes = rotation(np.concatenate([turn, q], axis=1))
    gained = after - before
    most = (np.linalg.norm(before, axis=1) + np.linalg.norm(gained, axis=1)) * length / moments.min(axis=1)
    steps = np.ceil(np.nan_to_num(most / STEPPED_TURN, posinf=1.0)).clip(1, MOST_STEPS).astype(np.int64)
    for step in range(int(steps.max(initial=0))):
        left = np.flatnonzero(step < steps)
        for at in np.split(left, range(BLOCK, len(left), BLOCK)):
            share = 1.0 / steps[at]
            h = share * length[at]
            momentum, added = h * (before[at].T + step * share * gained[at].T), h * share * gained[at].T
            axes, turned, ways = _series(all_axes[at], q[at], momentum, added, moments[at].T, most[at] * share)
            all_axes[at], q[at] = axes, turned
            turn[at] += ways
    return q, turn


def _series(axes: Array, q: Array, momentum: Array, added: Array, moments: Array, angle: Array) -> tuple[Array, ...]:
    """Axes (s, 3, 3), quaternions (s, 4) and integrals of spins (s, 3) after a time of one; vectors are (3, s)."""
    largest = 2.0 * min(float(np.fmax.reduce(angle, initial=0.0)), STEPPED_TURN)  # a run that ended has no numbers
    terms = int(np.ceil(np.log(LEFT_OUT) / np.log(max(largest, LEFT_OUT))))
    e, turned = np.zeros((terms + 1, 3, 3, len(q))), np.zeros((terms + 1, 4, len(q)))
    rate, spin, across = np.zeros((terms, 3, len(q))), np.zeros((terms, 3, len(q))), np.zeros((terms, 4, 4, len(q)))
    e[0], turned[0] = np.moveaxis(axes, 0, 2), q.T
    for k in range(terms):
        rate[k] = np.einsum("jis,js->is", e[k], momentum) / moments
        if k:
            rate[k] += np.einsum("jis,js->is", e[k - 1], added) / moments
        spin[k] = np.einsum("jabs,jbs->as", e[k::-1], rate[: k + 1])
        across[k] = _product(spin[k])
        e[k + 1] = np.einsum("jabs,jbcs->acs", across[: k + 1, 1:, 1:], e[k::-1]) / (k + 1)
        turned[k + 1] = 0.5 * np.einsum("jabs,jbs->as", across[: k + 1], turned[k::-1]) / (k + 1)
    ways = (spin / np.arange(1, terms + 1)[:, None, None]).sum(axis=0)
    return np.moveaxis(e.sum(axis=0), 2, 0), turned.sum(axis=0).T, ways.T


def _product(w: Array) -> Array:
    """Matrices (4, 4, s) that multiply a quaternion from the left by vectors w (3, s); lower right those of w x."""
    x, y, z = w
    zero = np.zeros_like(x)
    return np.array(((zero, -x, -y, -z), (x, zero, -z, y), (y, z, zero, -x), (z, -y, x, zero)))


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
