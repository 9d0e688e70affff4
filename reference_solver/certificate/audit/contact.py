"""Whether impulses obey the laws of contact: Newton's restitution, Signorini's complementarity, Coulomb's cone."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from reference_solver.certificate.audit.run import Run, cross, twist_of
from reference_solver.certificate.audit.turning import SOLVED, turned_contacts, turns_beside
from reference_solver.certificate.audit.unexplained import Unexplained
from reference_solver.geometry import nearest
from reference_solver.model import Array
from reference_solver.pieces import FROZEN, ROCKING
from reference_solver.shapes import Disc, Sphere

#: Share of the speeds that meet which may be left at contacts that stay closed: of 80 random scenes 2e-9 at most.
LEFT_OVER = 1e-7
#: A slip below this share of the speeds that meet is round-off of a phase, at whose end it is taken out.
SLIP_NOISE = 1e-11
#: Speed, as a share of the fastest of the run, that impacts and phases leave by round-off: a hundred last places.
ROUNDED = 2e-14
#: Share of the fastest approach of an impact above which a contact with e = 0 parts for certain, and one with e > 0;
#: below it, it may part, or lie and have turned. And share of the speeds that meet which is round-off of a solve.
PARTS, LEFT, LIES = 1e-5, 2e-11, 1e-9
#: A rebound counts as soft where it leaves no faster than what loads do in this many steps.
SOFT_STEPS = 2.0
#: How many times as fast as until the next sample bodies may go apart at first.
APART = 4.0
#: Share of mu p_n by which friction is within its cone for certain: ten times what a solve leaves of it.
WITHIN = 1e-8
#: Units in the last place of the largest impulse of a piece that its other impulses are known to: what is summed over
#: the contacts of a body is rounded at that size.
UNITS = 4.0


def measured(run: Run, left: Unexplained) -> Iterator[tuple[str, float]]:
    """Yield what is measured of all contacts."""
    names = ("pull", "cone", "normal", "friction", "moment", "scale", "unknown")
    if not len(run.pieces.body_a):
        yield from ((name, 0.0) for name in names)
        return
    yield from zip(names, _laws(run, left), strict=True)


def ends_of_series(run: Run) -> NDArray[np.bool_]:
    """Whether (c,) a contact holds a rebound of its law, or comes to rest by rocking, where it rubs or turns.

    What such an end leaves out hangs on the number of rebounds that it leaves out, not on the step in which it is.
    """
    pieces, owner = run.pieces, run.contact_owner
    a, b, n = pieces.body_a, pieces.body_b, pieces.normal
    cornered = _cornered(run)
    approach, leaves = ((run.meeting_velocity(after) * n).sum(axis=1) for after in (False, True))
    rebound = -run.model.restitution[a, b] * approach
    held = (run.is_impact & ~run.is_chain)[owner] & (leaves < 0.5 * rebound) & ((pieces.impulse * n).sum(axis=1) > 0.0)
    rubs = run.model.friction[a, b] > 0.0
    return np.asarray((held | (pieces.scheme == ROCKING)[owner]) & (cornered[a] | cornered[b] | rubs))


def _cornered(run: Run) -> NDArray[np.bool_]:
    """Whether (n,) a body is free and has levers that turn with it."""
    round_ones = [isinstance(body.shape, Disc | Sphere) for body in run.model.bodies]
    return run.free & ~np.array(round_ones)


def left_out_by_series(run: Run, ends: NDArray[np.bool_]) -> tuple[Array, Array]:
    """What (c,) the rebounds move that each of ``ends`` leaves out [m], and how fast that goes on [m/s].

    Of speed u and first flight T they make the way ``s = u T/(1 - e)``. Friction a, which comes in blows instead of all
    along, moves bodies by ``a T^2/(2 (1 - e^2))`` meanwhile, and a row of corners that turns at the rate w has
    velocities off by w s (E22): where it is hit, and up to ``m r^2/I`` times that a reach r from the centre. What holds
    the contact afterwards brings it back, ``T = 2 u/g_n``; a series lasts a step at most.
    """
    pieces, a, b = run.pieces, run.pieces.body_a, run.pieces.body_b
    e, approach = run.model.restitution[a, b], (run.meeting_velocity(after=False) * pieces.normal).sum(axis=1)
    leaves = np.where(ends, e * np.maximum(-approach, 0.0), 0.0)
    slows, rubs = np.zeros(len(leaves)), np.zeros(len(leaves))
    for j in np.flatnonzero(leaves > 0.0):
        held, rubs[j] = _held_by(run, int(j), -approach[j])
        slows[j] = max(1.0 - e[j], 0.0) * held
    lasts = 2.0 * leaves / np.maximum(slows, 2.0 * leaves / run.dt + np.finfo(float).tiny)
    way = leaves * lasts
    cornered = _cornered(run)
    spins = [
        np.where((row >= 0) & cornered[i], np.linalg.norm(pieces.twist_before[row, run.d :], axis=1), 0.0)
        for i, row in ((a, run.side[0]), (b, run.side[1]))
    ]
    far = np.where(run.free, run.mass * run.reach**2 / run.moments.min(axis=1), 0.0)
    way *= 1.0 + np.maximum(far[a], far[b])
    return rubs * way / (1.0 + e), np.maximum(*spins) * way


def slips_taken_out(run: Run) -> Array:
    """How far (c,) each contact is off where a slip ends within its piece, and the piece sticks all along [m].

    A rebound that is held may leave a slip that loads end long before the piece ends (E22). On rows that stand still
    the piece takes it out evenly: the slip u of its start moves the contact by half of u times the length of the piece,
    and not by what little it slips. Friction is within its cone in such a piece. Runs whose pieces end at the same time
    are off by the same. A point a reach r from a centre moves up to ``1 + m r^2/I`` times as far.
    """
    pieces, owner, n = run.pieces, run.contact_owner, run.pieces.normal
    both = (run.meeting_velocity(after) for after in (False, True))
    slip, left = (np.linalg.norm(u - (u * n).sum(axis=1)[:, None] * n, axis=1) for u in both)
    pressed = (pieces.impulse * n).sum(axis=1)
    rubs = np.linalg.norm(pieces.impulse - pressed[:, None] * n, axis=1)
    limit = run.model.friction[pieces.body_a, pieces.body_b] * pressed
    frozen = run.is_forces[owner] & (pieces.scheme == FROZEN)[owner]
    ends = frozen & (left < 0.5 * slip) & (rubs < (1.0 - WITHIN) * limit)
    far = np.where(run.free, run.mass * run.reach**2 / run.moments.min(axis=1), 0.0)
    gain = 1.0 + np.maximum(far[pieces.body_a], far[pieces.body_b])
    return np.where(ends, 0.5 * slip * pieces.length[owner] * gain, 0.0)


def grazes(run: Run, t: Array, pose: Array, noise: float) -> tuple[Array, Array]:
    """When (k,) bodies meet or do not as round-off has it [s], and what (k,) speed of any of their points that changes.

    Bodies that go apart with the acceleration a after they came near each other with the speed u were nearer by
    ``u^2/(2 a)`` then. Where gaps below ``noise`` [m] count as none, they meet with any u up to ``sqrt(2 a noise)``, or
    pass each other. The acceleration is that of the gap until the first sample (``t``, ``pose``) after the impact that
    resolves it, if the pair has no impulse before it; it may have been `APART` times as large when they met. At gaps
    below ``4 APART noise`` a speed of parting looks like an acceleration.
    """
    pieces, owner = run.pieces, run.contact_owner
    approach = (run.meeting_velocity(after=False) * pieces.normal).sum(axis=1)
    pushed = np.linalg.norm(pieces.impulse, axis=1) > 0.0
    rows = np.flatnonzero(pushed)
    pair, begin = (pieces.body_a * len(run.free) + pieces.body_b)[rows], pieces.begin[owner[rows]]
    until = np.full(len(pushed), np.inf)
    order = np.lexsort((begin, pair))
    same = pair[order[1:]] == pair[order[:-1]]
    until[rows[order[:-1]]] = np.where(same, begin[order[1:]], np.inf)
    sample = np.minimum(np.searchsorted(t, pieces.begin[owner], side="right"), len(t) - 1)
    alone = run.is_impact[owner] & pushed & (approach < 0.0) & (until >= t[sample]) & (t[sample] > pieces.begin[owner])
    times, speed, mass = [], [], reduced_mass(run)
    for j in np.flatnonzero(alone):
        both = (int(pieces.body_a[j]), int(pieces.body_b[j]))
        first, second = (run.model.bodies[i].shape for i in both)
        for k in range(sample[j], len(t)):
            if t[k] > until[j]:
                met = 0.0
                break
            gap = max(float(nearest(first, pose[k, both[0]], second, pose[k, both[1]]).gap), 0.0)
            met = math.sqrt(2.0 * APART * noise * 2.0 * gap) / (t[k] - pieces.begin[owner[j]])
            if gap > 4.0 * APART * noise:
                break
        if -approach[j] <= met:
            impulse = (1.0 + run.model.restitution[both]) * met * mass[j]
            far = [
                (1.0 + run.mass[i] * run.reach[i] ** 2 / run.moments[i].min()) / run.mass[i]
                for i in both
                if run.free[i]
            ]
            times.append(float(pieces.begin[owner[j]]))
            speed.append(impulse * max(far))
    return np.array(times), np.array(speed)


def joint_blows(run: Run, none: Array) -> tuple[Array, Array, Array]:
    """When (k,) several contacts are struck at once [s], how late one may be (k,) [s], and what (k,) speeds change by.

    Contacts of a pair that are open by its gap in ``none`` (n, n) [m], and close with the speed u, would be struck
    ``gap / u`` later.
    """
    pieces, owner = run.pieces, run.contact_owner
    approach = -(run.meeting_velocity(after=False) * pieces.normal).sum(axis=1)
    meets = run.is_impact[owner] & (approach > LIES * speeds(run))
    late = np.zeros(len(pieces))
    np.maximum.at(late, owner[meets], none[pieces.body_a[meets], pieces.body_b[meets]] / approach[meets])
    several = np.flatnonzero(np.bincount(owner[meets], minlength=len(pieces)) > 1)
    twist, reach = pieces.twist_after - pieces.twist_before, np.where(run.free, run.reach, 0.0)[pieces.body]
    speed = np.linalg.norm(twist[:, : run.d], axis=1) + reach * np.linalg.norm(twist[:, run.d :], axis=1)
    fastest = [speed[pieces.first_body[k] : pieces.first_body[k + 1]].max() for k in several]
    return pieces.begin[several], late[several], np.array(fastest)


def late_blows(run: Run, none: float) -> tuple[Array, Array, Array]:
    """When (k,) contacts are struck [s], by how much loads change speeds for a gap until then [1/s], and for how long.

    What closes with the speed u is struck gap / u later, and leaves so much faster, until all its rebounds are over. If
    they rise no higher than ``none`` [m] they are summed up.
    """
    pieces, approach = run.pieces, -(run.meeting_velocity(after=False) * run.pieces.normal).sum(axis=1)
    met = np.flatnonzero(run.is_impact[run.contact_owner] & (approach > math.sqrt(2.0 * run.pull * none)))
    e, change = run.model.restitution[pieces.body_a[met], pieces.body_b[met]], 2.0 * run.pull / approach[met]
    return pieces.begin[run.contact_owner[met]], change, 4.0 / change / (1.0 - e)


def _held_by(run: Run, j: int, stopped: float) -> tuple[float, float]:
    """Return the acceleration [m/s^2] at which the pair of contact j is held after an impact, and its friction's share.

    By what it takes to hold the pair, of which ``stopped`` [m/s] took the impulse of the impact; 0 and mu where the
    phase after it is not told.
    """
    pieces, mu = run.pieces, float(run.model.friction[run.pieces.body_a[j], run.pieces.body_b[j]])

    def impulses(piece: int) -> tuple[float, float]:
        own = slice(pieces.first_contact[piece], pieces.first_contact[piece + 1])
        same = (pieces.body_a[own] == pieces.body_a[j]) & (pieces.body_b[own] == pieces.body_b[j])
        p, n = pieces.impulse[own][same], pieces.normal[own][same]
        pressed = (p * n).sum(axis=1)
        return float(pressed.sum()), float(np.linalg.norm(p - pressed[:, None] * n, axis=1).sum())

    after = int(run.contact_owner[j]) + 1
    if after >= len(pieces) or not run.is_forces[after] or pieces.length[after] <= 0.0:
        return 0.0, mu
    (blow, _), (pressed, rubbed) = impulses(after - 1), impulses(after)
    if blow <= 0.0 or pressed <= 0.0:
        return 0.0, mu
    return pressed / float(pieces.length[after]) * stopped / blow, rubbed / pressed


def _laws(run: Run, left: Unexplained) -> Iterator[float]:
    pieces = run.pieces
    row_a, row_b = run.side
    a, b, n = pieces.body_a, pieces.body_b, pieces.normal
    restitution, mu = run.model.restitution[a, b], run.model.friction[a, b]
    before, after = (run.meeting_velocity(late) for late in (False, True))
    approach, leaves = (before * n).sum(axis=1), (after * n).sum(axis=1)
    # Where rows turn within a piece its impulse is a mean over normals: what remains unknown of that mean adds a share
    # of the normal impulse to the friction, and of the friction to the normal impulse.
    over = turned_contacts(run)
    pressed = (pieces.impulse * over.normal).sum(axis=1)
    along = pieces.impulse - pressed[:, None] * over.normal
    held_back = np.linalg.norm(along, axis=1)
    mass = reduced_mass(run)
    speed = speeds(run)
    scale = mass * speed + pressed.clip(min=0.0)
    owner = run.contact_owner
    # What is left of speeds at contacts that stay closed is taken out by impulses of any sign; low rebounds are summed
    # up with rows of their start.
    correction, coarse = run.is_correction[owner], run.is_rocking[owner]
    impact, chain, frozen = run.is_impact[owner], run.is_chain[owner], run.is_frozen[owner]

    # Impulses of one solve are known to some units in the last place of the largest of them, not of each.
    largest = np.zeros(len(pieces))
    np.maximum.at(largest, owner, np.linalg.norm(pieces.impulse, axis=1))
    unseen = UNITS * np.spacing(largest)[owner]
    # A phase keeps contacts closed that hardly carry anything: speeds of round-off are taken out either way.
    taken_out = np.where(frozen, 0.0, SLIP_NOISE * mass * speed)
    pulls = -pressed - unseen - taken_out - over.lean * held_back
    # What came to rest without loads still has round-off of the speeds that it had.
    left_over = mass * (LEFT_OVER * speed + SLIP_NOISE * fastest_of(speed))
    pulls = np.where(correction, np.abs(pressed) - left_over, pulls)
    left.pushed(pulls.clip(min=0.0))
    yield _worst(pulls, scale)
    leaning = (1.0 + mu * mu) * pressed.clip(min=0.0) * over.lean
    excess = held_back - mu * pressed.clip(min=0.0) - leaning - taken_out
    excess = np.where(correction, held_back - left_over, excess)
    left.pushed(excess.clip(min=0.0))
    yield _worst(excess, scale)

    # Complementarity: an impulse where, and only where, the velocity after it is the least that is allowed. What is
    # allowed after an impact is -e u-, after a chain of them none; a soft rebound may be held instead.
    rebound = np.where(impact & ~chain, np.maximum(-restitution * approach, 0.0), 0.0)
    soft = rebound <= SOFT_STEPS * run.pull * run.dt
    # Where rows turn within a piece, the velocity at its start must be none: that of a later piece tells of its end.
    ends = np.where(frozen, leaves, approach)
    defect = np.abs(pressed - np.maximum(pressed - mass * (ends - rebound), 0.0))
    stopped = np.abs(pressed - np.maximum(pressed - mass * ends, 0.0))
    held = impact & soft & (rebound > 0.0) & (stopped < defect)
    defect = np.where(held, stopped, defect)
    # What parts as an impact begins has no part in it, but in a chain, and comes closer only to be struck next.
    # All points of a pair that meets answer together.
    _, pair = np.unique((owner * len(run.free) + a) * len(run.free) + b, return_inverse=True)
    met = np.bincount(pair, approach < -LIES * speed) > 0.0
    parts = impact & (approach > 0.0) & ~(chain & (pressed > 0.0)) & ~met[pair]
    alone = pressed.clip(min=0.0) + np.where(run.is_followed[owner], 0.0, mass * np.maximum(-leaves, 0.0))
    fastest = np.zeros(len(pieces))
    np.maximum.at(fastest, owner, -approach)
    for k in np.flatnonzero(run.is_followed):  # what the first impact of an instant rounds, the last one still has
        fastest[k + 1] = max(fastest[k : k + 2])
    certain = (
        np.where(restitution > 0.0, LEFT, PARTS) * fastest[owner]
        + LIES * speed
        + 2.0 * np.minimum(run.still[a], run.still[b])
    )
    alone = np.where(approach > certain, alone, np.minimum(alone, defect))
    defect = np.where(parts, alone, defect)
    # What is not pressed and is not an impact may part, or come closer: a gap is a matter of geometry.
    parting = ~impact & (pressed <= 0.0)
    # What came to rest without loads still comes closer or parts by round-off of the speeds that it had.
    defect -= np.where(impact, 0.0, mass * ROUNDED * fastest_of(speed))
    defect = np.where(parting | coarse, 0.0, defect.clip(min=0.0))
    left.pushed(defect)
    yield _worst(defect, scale)

    # Maximal dissipation: friction is what stops the slip, or all of mu p_n against it. Where rows turn, the slip is
    # the mean of those at both ends, each at its own point and normal.
    ended = run.velocity_at(row_b, b, over.last_point, True, late=True) - run.velocity_at(
        row_a, a, over.last_point, True, late=True
    )
    first = before - approach[:, None] * n
    last = ended - (ended * over.last_normal).sum(axis=1)[:, None] * over.last_normal
    # Where that point is not known, the slip of the start has to do, and how far it turns on its lever.
    sure, stopped_slip = np.isfinite(over.stray)[:, None], after - leaves[:, None] * n
    last = np.where(sure, last, stopped_slip)
    slip = np.where(frozen[:, None], stopped_slip, np.where(sure, 0.5 * (first + last), first))
    slip = slip - (slip * over.normal).sum(axis=1)[:, None] * over.normal
    wanted = along - mass[:, None] * slip
    size = np.linalg.norm(wanted, axis=1)
    limit = mu * pressed.clip(min=0.0)
    wanted *= np.where(size > limit, limit / np.where(size > 0.0, size, 1.0), 1.0)[:, None]
    # Where the direction of a slip turns within a piece, its friction is a mean of directions; in the plane there are
    # but two, and the normal's turn is known. One that turns back has both its ends alike, not its neighbours.
    if run.d == 3:
        swing = turns_beside(run, _angle(first, last)).clip(max=2.0)
    else:
        swing = np.where((first * last).sum(axis=1) < 0.0, 2.0, 0.0)
    turned = swing + np.where(sure[:, 0], 0.0, unsure_turn(run, slip))
    missed = np.linalg.norm(along - wanted, axis=1) - np.where(frozen, 0.0, limit * turned) - leaning
    missed = np.where(coarse, 0.0, missed)
    left.pushed(missed.clip(min=0.0))
    yield _worst(missed, scale)

    about = cross(over.point, pieces.impulse)
    force = np.linalg.norm(pieces.impulse, axis=1)
    arm = np.linalg.norm(pieces.point, axis=1) + run.size
    with np.errstate(invalid="ignore"):  # of no impulse times an unknown point
        off = np.linalg.norm(pieces.moment - about, axis=1) - np.where(force > 0.0, over.stray * force, 0.0)
        off -= arm * taken_out
    left.pushed(off.clip(min=0.0) / run.size)  # on a lever that is at least as long
    yield _worst(off, arm * np.where(frozen, force, force + SOLVED * scale))

    yield float(np.linalg.norm(pieces.impulse, axis=1).max() / _momentum_at_hand(run))
    movable = (run.free[a] & (row_a < 0)) | (run.free[b] & (row_b < 0))
    yield float(movable.sum())


def reduced_mass(run: Run) -> Array:
    """Mass (c,) that a contact feels at least along its normal [kg]: levers only lower it."""
    pieces = run.pieces
    inverse = np.zeros(len(pieces.body_a))
    for i, row in ((pieces.body_a, run.side[0]), (pieces.body_b, run.side[1])):
        arm = pieces.point - np.where((row >= 0)[:, None], pieces.pose_before[row, : run.d], pieces.point)
        lever = (arm * arm).sum(axis=1) / run.moments[i].min(axis=1)
        inverse += np.where(run.free[i], 1.0 / run.mass[i] + lever, 0.0)
    return np.asarray(1.0 / np.where(inverse > 0.0, inverse, 1.0))


def speeds(run: Run) -> Array:
    """Speeds (c,) whose differences a contact's velocity is: of both points, before and after, and of loads [m/s].

    At least what moves a body by some units in the last place of its size.
    """
    pieces = run.pieces
    total = run.pull * run.dt + 2.0 * np.minimum(run.still[pieces.body_a], run.still[pieces.body_b])
    for i, row in ((pieces.body_a, run.side[0]), (pieces.body_b, run.side[1])):
        arm = pieces.point - np.where((row >= 0)[:, None], pieces.pose_before[row, : run.d], pieces.point)
        far = np.linalg.norm(arm, axis=1)
        for twist in (pieces.twist_before, pieces.twist_after):
            v, w = twist[row, : run.d], twist[row, run.d :]
            total += np.where(row >= 0, np.linalg.norm(v, axis=1) + far * np.linalg.norm(w, axis=1), 0.0)
        del i
    return np.asarray(0.5 * total)


def unsure_turn(run: Run, slip: Array) -> Array:
    """Sine (c,) by which a slip may be turned that was taken at the point of the start, at most 2.

    In the piece that point goes elsewhere on bodies that spin.
    """
    pieces = run.pieces
    passing = np.zeros(len(slip))
    for i, row in ((pieces.body_a, run.side[0]), (pieces.body_b, run.side[1])):
        arm = pieces.point - np.where((row >= 0)[:, None], pieces.pose_before[row, : run.d], pieces.point)
        spins = [np.linalg.norm(x[row, run.d :], axis=1) for x in (pieces.twist_before, pieces.twist_after)]
        spin = np.where(row >= 0, np.maximum(*spins), 0.0)
        passing += spin * spin * np.linalg.norm(arm, axis=1) * pieces.length[run.contact_owner]
        del i
    size = np.linalg.norm(slip, axis=1)
    return np.minimum(np.divide(passing, size, out=np.full(len(size), 2.0), where=size > 0.0), 2.0)


def _angle(one: Array, other: Array) -> Array:
    """Sine bound of the angle between rows, 2 where either is nothing."""
    a, b = np.linalg.norm(one, axis=1), np.linalg.norm(other, axis=1)
    safe = (a > 0.0) & (b > 0.0)
    unit = [x / np.where(safe, size, 1.0)[:, None] for x, size in ((one, a), (other, b))]
    return np.where(safe, np.linalg.norm(unit[0] - unit[1], axis=1), 2.0)


def _momentum_at_hand(run: Run) -> float:
    """Momentum that all motion and loads of the run could give to one contact [N s]."""
    pieces, free = run.pieces, run.free
    arm = np.where(np.isfinite(run.reach), run.reach, 0.0)
    speeds = np.zeros(len(free))
    # At the start of the run and by loads over its time: what follows from impulses does not vouch for them.
    duration = float((pieces.step.max() + 1 - pieces.step.min()) * run.dt)
    for i, body in enumerate(run.model.bodies):
        twist = twist_of(body)
        speeds[i] = np.linalg.norm(twist[: run.d]) + arm[i] * np.linalg.norm(twist[run.d :])
    fastest = float(speeds.max()) + run.pull * max(duration, run.dt)
    return float(run.mass[free].sum() * fastest) if free.any() and fastest > 0.0 else 1.0


def fastest_of(speed: Array) -> float:
    """Largest of `speeds` [m/s], of those at places that are known."""
    return float(speed[np.isfinite(speed)].max(initial=0.0))


def _worst(defect: Array, scale: Array) -> float:
    share = np.divide(defect, scale, out=np.where(defect > 0.0, np.inf, 0.0), where=scale > 0.0)
    return float(max(share.max(initial=0.0), 0.0))
