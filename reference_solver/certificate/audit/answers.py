"""Whether the laws allow another answer than the recorded one, at each impact and as each force phase begins (E87).

Newton's restitution, Signorini's complementarity and Coulomb's friction are equations and signs for each *mode* of the
contacts: open, sticking, or slipping in a direction. More than one mode may fit: what sticks might slip, what opens
might stay pressed. Unknown are impulses and velocities, or forces and accelerations; a contact that slides already
cannot choose its direction.

Where modes are few and each of them is a linear system, all of them are tried, and what is found is all there is. Else
modes are where Newton's method starts from, on the equations that are equivalent to the laws (P. Alart, A. Curnier,
*Comput. Methods Appl. Mech. Eng.* 92, 1991): what it ends in counts if it obeys them. Where the contacts of a cluster
have more modes than `MOST`, those of its faces are taken, whose contacts all do the same; where these are too many as
well the cluster is not searched, and neither is what comes after `BUDGET` is used.

Answers are two only if a contact does something else in each. Forces that move nothing, and modes that meet at their
borders, make none; those that are shared otherwise in the same modes are for `sharing`.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference_solver.certificate.audit.contact import ROUNDED, SLIP_NOISE, fastest_of, speeds
from reference_solver.certificate.audit.rolling import accelerations
from reference_solver.certificate.audit.run import Indices, Run
from reference_solver.certificate.audit.sharing import (
    HELD,
    SIDES_OF,
    Known,
    by_root_of_inertia,
    clusters,
    joined_contents,
    pushed,
    tangents_of,
)
from reference_solver.exact_contact import non_negative_least_squares
from reference_solver.model import Array
from reference_solver.pieces import CHAIN, FROZEN, TURNING

#: Modes of one cluster up to which all are tried: four planar contacts that stick have 256, four in space 1296.
MOST = 1300
#: Systems of equations that are solved for one run, each counted with the cube of a tenth of its size.
BUDGET = 4e5
#: Wrong sign, as a share of the largest speed or acceleration of a problem, that is round-off; difference from which
#: two answers are two; and share to which a problem is that of another instant.
SIGN, TWO, ALIKE = 1e-10, 1e-6, 1e-8
#: Condition of a mode's equations beyond which its contacts are redundant, and only a sum of forces is known.
REDUNDANT = 1e9
#: Share of that difference up to which a velocity is none.
SAME = 0.1
#: Steps of Newton's method, which converges in a few, or not at all; and what makes its equations solvable where
#: contacts are redundant, as a share of them: a thousand times their round-off.
STEPS, DAMPING = 12, 1e-13
#: What a contact does in a mode: open; closed, and sticking if it does not slide; and from then on numbers of
#: directions in which it begins to slip, where Newton's method starts.
OPEN, CLOSED, SLIPS = 0, 1, 2
DIRECTIONS = {2: np.array([[1.0], [-1.0]]), 3: np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])}


class Answers(NamedTuple):
    """When the laws have two answers for the first time, and when it was first not searched for one [s]."""

    begin: float
    told: str  # which contacts do what
    unsearched: float
    contacts: int  # of the solve that was not searched


class Problem(NamedTuple):
    """Contacts of one cluster at one instant: ``u = W p + free``, for each contact its normal and tangents.

    Units of mass and time are such that an impulse of one along a normal changes its velocity by one, and that the
    largest velocity is one. Normal velocities are those beyond what restitution wants.
    """

    matrix: Array  # (c, d, c, d)
    free: Array  # (c, d)
    mu: Array  # (c,)
    slip: Array  # (c, d - 1) unit vector along which a contact slides; zeros where it may choose
    given: Array  # (c, d) what is recorded
    modes: Indices  # (m, c)


class _Instants(NamedTuple):
    """What the problems of all contacts (c,) are made of."""

    asked: NDArray[np.bool_]  # (c,) takes part
    jams: NDArray[np.bool_]  # (c,) is of an impact in which nothing approaches: it does what no forces can (E54)
    row: Indices  # (c, 2) rows of both bodies; -1 where one is not free
    free: Array  # (c, d) velocities without impulses of the piece
    wander: Array  # (c, d) accelerations but for those by loads
    slip: Array  # (c, d - 1) as a force phase begins
    push: Array  # (c, 2, d, 3 | 6) what unit impulses do to both bodies, times the root of M
    pull: Array  # (m, 3 | 6) what loads do to the bodies of all rows, times the root of M
    given: Array  # (c, d)
    noise: float  # speed that is round-off [m/s]


def answers(run: Run) -> Answers:
    """Return where another answer exists first, and where the search ended."""
    found, spent = Answers(np.inf, "", np.inf, 0), 0.0
    known: dict[bytes, list[Array]] = {}
    at = _instants(run)
    for own, lasts, problem in _problems(run, at):
        begin = float(run.pieces.begin[run.contact_owner[own[0]]])
        key = _key(problem) if problem else b""
        if problem and key not in known and spent + _cost(problem) <= BUDGET:
            known[key], spent = all_answers(problem), spent + _cost(problem)
        if not problem or key not in known:
            if begin < found.unsearched:
                found = found._replace(unsearched=begin, contacts=len(own))
            continue
        others = known[key]
        if at.jams[own[0]] and not lasts:  # without impulses it goes on as it is, for which no forces may exist
            others = [u for u in others if np.abs(u - problem.free).max() > TWO]
        two = _two(others, problem)
        jams = "may go on as they are, or jam" if at.jams[own[0]] and lasts and others else ""
        if (two is not None or jams) and begin < found.begin:
            bodies = f"bodies {run.pieces.body_a[own[0]]} and {run.pieces.body_b[own[0]]}"
            found = found._replace(begin=begin, told=_told(run, own, *two) if two and not jams else f"{bodies} {jams}")
    return found


def _problems(run: Run, at: _Instants) -> Iterator[tuple[Indices, bool, Problem | None]]:
    """Yield the clusters of contacts with friction that may have several answers: their numbers, and their problem.

    And whether that is one of forces; a jam has both. None stands for a problem of too many modes.
    """
    pieces, owner = run.pieces, run.contact_owner
    if not len(owner):
        return
    mu = run.model.friction[pieces.body_a, pieces.body_b]
    contents, known = _contents(run, at), Known(run)
    for k in np.unique(owner[at.asked & (mu > 0.0)]):
        own = np.arange(pieces.first_contact[k], pieces.first_contact[k + 1])
        if known.answer(own, contents, lambda own: own) is not own:
            continue
        for each in clusters(own[at.asked[own]], at.row):
            cluster = np.sort(each)
            if not mu[cluster].any():
                continue
            pairs = [pieces.body_a[cluster], pieces.body_b[cluster], *np.round(pieces.normal[cluster] / TWO).T]
            faces = list(zip(*(each.tolist() for each in pairs), strict=True))
            number = {each: i for i, each in enumerate(sorted(set(faces)))}
            face = np.array([number[each] for each in faces])
            for lasts in (False, True) if at.jams[cluster[0]] else (not run.is_impact[k],):
                slip = at.slip[cluster] if lasts else 0.0 * at.slip[cluster]
                modes = modes_of((mu[cluster] > 0.0) & ~slip.any(axis=1), face, run.d)
                if not len(modes):
                    yield cluster, lasts, None
                elif (problem := _problem(run, at, cluster, mu, slip, lasts, modes)) is not None:
                    yield cluster, lasts, problem


def _instants(run: Run) -> _Instants:
    pieces, owner, d = run.pieces, run.contact_owner, run.d
    a, b, n = pieces.body_a, pieces.body_b, pieces.normal
    speed, impact = speeds(run), run.is_impact[owner]
    noise = ROUNDED * fastest_of(speed)
    row = np.column_stack([np.where(run.free[i], side, -1) for i, side in zip((a, b), run.side, strict=True)])
    axes = np.concatenate([n[:, None], tangents_of(n)], axis=1)
    u = np.einsum("cj,ckj->ck", run.meeting_velocity(after=False), axes)
    # What parts has no part in it. In an impact all points of a pair that meets answer together (E21).
    closed = u[:, 0] <= HELD * speed + noise
    _, pair = np.unique((owner * len(run.free) + a) * len(run.free) + b, return_inverse=True)
    met = np.bincount(pair, closed) > 0.0
    exact = np.where(run.is_impact, pieces.scheme != CHAIN, np.isin(pieces.scheme, (FROZEN, TURNING)))
    after = np.einsum("cj,ckj->ck", run.meeting_velocity(after=True), axes)
    approach, change = np.zeros((2, len(pieces.begin)))
    np.maximum.at(approach, owner, -u[:, 0])
    np.maximum.at(change, owner, np.abs(after - u).max(axis=1))
    jams = (run.is_impact & (pieces.scheme == FROZEN) & (approach + noise < TWO * change))[owner] & closed
    asked = np.where(impact & ~jams, met[pair], closed) & (row >= 0).any(axis=1) & exact[owner]
    push = np.zeros((*row.shape, d, pieces.twist_before.shape[1]))
    for side, sign in ((0, -1.0), (1, 1.0)):
        for j in range(d):
            push[:, side, j] = pushed(run, row[:, side], pieces.point, sign * axes[:, j])
    asked &= np.isfinite(push).all(axis=(1, 2, 3))
    # What restitution wants; where a rebound is held that is nothing (E22).
    wanted = run.model.restitution[a, b] * np.maximum(-u[:, 0], 0.0)
    held = after[:, 0] < 0.5 * wanted
    free = u - np.column_stack([np.where(held, 0.0, wanted), np.zeros((len(u), d - 1))])
    rates = accelerations(run, asked & (~impact | jams))
    wander = np.column_stack([rates[:, 0], np.einsum("cj,ckj->ck", rates[:, 1:], axes[:, 1:])])
    size = np.linalg.norm(u[:, 1:], axis=1)
    slides = size > SLIP_NOISE * speed + noise
    slip = np.where(slides[:, None], u[:, 1:], 0.0) / np.where(slides, size, 1.0)[:, None]
    body = pieces.body
    pull = run.force[body] / np.sqrt(run.mass[body])[:, None]
    pull = np.column_stack([pull, by_root_of_inertia(run, np.arange(len(body)), _torques(run))])
    length = pieces.length[owner]
    given = np.einsum("cj,ckj->ck", pieces.impulse, axes) / np.where(length > 0.0, length, 1.0)[:, None]
    return _Instants(asked, jams, row, free, wander, slip, push, pull, given, noise)


def _contents(run: Run, at: _Instants) -> tuple[Array, Array]:
    """What problems of contacts (c,) are made of, see `Known.answer`."""
    c, impact = len(at.asked), run.is_impact[run.contact_owner]
    kind = np.column_stack([at.asked, at.jams, impact, at.slip])
    push, pull = at.push.reshape(c, -1), np.where(at.row[:, :, None] >= 0, at.pull[at.row], 0.0).reshape(c, -1)
    free, wander = np.where(impact[:, None], at.free, 0.0), np.where((~impact | at.jams)[:, None], at.wander, 0.0)
    speed, rate, pushed, pulled = (np.abs(each).max(axis=1) for each in (free, wander, push, pull))
    rates = wander, rate + pushed * pulled
    return joined_contents((kind, np.ones(c)), (free, speed), rates, (push, pushed), (pull, pulled))


def _torques(run: Run) -> Array:
    """Moments (m, 1 | 3) that turn the body of each row as its piece begins: given ones, less those of its own spin."""
    torque = run.torque[run.pieces.body]
    if run.d == 2:
        return torque
    w = run.pieces.twist_before[:, 3:]
    return np.asarray(torque - np.where(run.free[run.pieces.body][:, None], np.cross(w, run.spin[0]), 0.0))


def _problem(
    run: Run, at: _Instants, own: Indices, mu: Array, slip: Array, lasts: bool, modes: Indices
) -> Problem | None:
    """Return the problem of a cluster of contacts; None if it has one answer for certain, or all is round-off."""
    d, c = run.d, len(own)
    rows = np.unique(at.row[own])
    rows = rows[rows >= 0]
    moves = np.zeros((c, d, len(rows), at.push.shape[3]))
    for side in (0, 1):
        known = np.flatnonzero(at.row[own, side] >= 0)
        moves[known, :, np.searchsorted(rows, at.row[own[known], side])] += at.push[own[known], side]
    flat = moves.reshape(c * d, -1)
    matrix, free, time = (flat @ flat.T).reshape(c, d, c, d), at.free[own], 1.0
    if lasts:
        free, time = at.wander[own] + (flat @ at.pull[rows].ravel()).reshape(c, d), run.dt
    scale = 1.0 / np.sqrt(np.diagonal(matrix[:, 0, :, 0]))
    size = np.abs(scale[:, None] * free).max()
    if not np.isfinite(size) or np.abs(free).max() * time <= at.noise:
        return None
    if _is_single(matrix, mu[own]) and not at.jams[own[0]]:
        return None
    return Problem(
        scale[:, None, None, None] * matrix * scale[None, None, :, None],
        scale[:, None] * free / size,
        mu[own],
        slip,
        at.given[own] / scale[:, None] / size,
        modes,
    )


def _is_single(matrix: Array, mu: Array) -> bool:
    """Whether one contact has one answer whatever its velocity (E66)."""
    if len(mu) > 1:
        return False
    normal, coupling = matrix[0, 0, 0, 0], matrix[0, 1:, 0, 0]
    share = mu[0] * np.linalg.norm(coupling) / normal
    if matrix.shape[1] == 2:
        return bool(share < 1.0 - SIGN)
    # In space friction acts in a disc whose size follows it, by that share: below this there is one friction.
    least, most = np.linalg.eigvalsh(matrix[0, 1:, 0, 1:] - np.outer(coupling, coupling) / normal)
    return bool(share < (1.0 - SIGN) * least / most)


def modes_of(chooses: NDArray[np.bool_], face: Indices, d: int) -> Indices:
    """Modes (m, c) of contacts, each for itself or all of a ``face`` (c,) alike; none of too many.

    Contacts that slide, or have no friction, do not choose among directions.
    """
    for group in (np.arange(len(face)), face):
        many = [SLIPS + (len(DIRECTIONS[d]) if chooses[group == g].any() else 0) for g in range(group.max() + 1)]
        if np.prod(many, dtype=float) <= MOST:
            found = np.array(list(product(*map(range, many))))[:, group]
            return np.asarray(np.where(chooses, found, np.minimum(found, CLOSED)))
    return np.zeros((0, len(face)), np.int64)


def _key(problem: Problem) -> bytes:
    """The same for problems that are alike to `ALIKE`, but where that falls between two numbers."""
    parts = [np.round(part / ALIKE).astype(np.int64).ravel() for part in problem[:4]]
    return np.concatenate(parts).tobytes()


def _chooses(problem: Problem) -> NDArray[np.bool_]:
    """Whether (c,) a contact may stick, or slip where it likes."""
    return np.asarray((problem.mu > 0.0) & ~problem.slip.any(axis=1))


def _is_linear(problem: Problem) -> bool:
    """Whether all modes are tried, and each of them is a linear system."""
    chooses, d = _chooses(problem), problem.free.shape[1]
    many = (SLIPS + len(DIRECTIONS[d])) ** int(chooses.sum()) * SLIPS ** int((~chooses).sum())
    return (d == 2 or not chooses.any()) and len(problem.modes) == many


def _cost(problem: Problem) -> float:
    """How much of the budget a problem takes."""
    steps = 1.0 if _is_linear(problem) else STEPS
    chosen = int(_chooses(problem).sum()) * (problem.free.shape[1] - 1)
    return float(len(problem.modes) * steps * ((len(problem.free) + chosen) / 10.0) ** 3)


def all_answers(problem: Problem) -> list[Array]:
    """Velocities (c, d) of all answers that are found, of those alike one."""
    d, chooses, modes = problem.free.shape[1], _chooses(problem), problem.modes
    closed, sticks = modes > OPEN, (modes == CLOSED) & chooses
    slip = np.concatenate([np.zeros((SLIPS, d - 1)), DIRECTIONS[d]])[modes]
    slip = np.where((closed & ~chooses)[:, :, None], problem.slip, slip)
    impulse, redundant = _of_modes(problem, closed, sticks, slip)
    found: list[Array] = []
    if _is_linear(problem):
        sure = ~redundant
        _enter(found, _fitting(problem, impulse[sure], closed[sure], sticks[sure], slip[sure]))
    else:
        _enter(found, _newton(problem, np.concatenate([impulse[~redundant], problem.given[None]])))
    # Redundant contacts that all slip fit also with less of them closed, or as one of them begins to stick. Those that
    # stick need not: they can be wedged.
    redundant &= sticks.any(axis=1) & _agree(problem, closed, sticks, slip)
    if not _is_linear(problem):
        redundant &= closed.all(axis=1) & (sticks | ~chooses).all(axis=1)
    for k in np.flatnonzero(redundant):
        if not any(_is_of_mode(u, closed[k], sticks[k], slip[k]) for u in found):
            _enter(found, _of_redundant(problem, closed[k], sticks[k], slip[k]))
    return found


def _agree(problem: Problem, closed: NDArray[np.bool_], sticks: NDArray[np.bool_], slip: Array) -> NDArray[np.bool_]:
    """Whether (m,) closed contacts with one velocity along all their tangents, as of one face, do the same."""
    rows = np.concatenate([problem.matrix[:, 1:].reshape(len(problem.mu), -1), problem.free[:, 1:]], axis=1)
    rows /= np.linalg.norm(rows, axis=1)[:, None]
    i, j = np.nonzero(np.triu(np.abs(rows[:, None] - rows).max(axis=2) <= ALIKE, 1))
    differs = (sticks[:, i] != sticks[:, j]) | (slip[:, i] != slip[:, j]).any(axis=2)
    return np.asarray(~(differs & closed[:, i] & closed[:, j]).any(axis=1))


def _is_of_mode(u: Array, closed: NDArray[np.bool_], sticks: NDArray[np.bool_], slip: Array) -> bool:
    """Whether an answer (c, d) is one of a redundant mode in which a contact sticks: another one is no second."""
    size = TWO * max(1.0, float(np.abs(u).max()))
    stays = np.where(closed, u[:, 0] <= SAME * size, u[:, 0] > size)
    moves = (u[:, 1:] * slip).sum(axis=1)[slip.any(axis=1)]
    return bool(stays.all() and np.abs(u[sticks, 1:]).max(initial=0.0) <= SAME * size and (moves > size).all())


def _enter(found: list[Array], velocities: Array) -> None:
    """Add velocities that are not there yet."""
    for one in velocities:
        if all(np.abs(one - other).max() > TWO * max(1.0, float(np.abs(one).max())) for other in found):
            found.append(one)


def _of_modes(
    problem: Problem, closed: NDArray[np.bool_], sticks: NDArray[np.bool_], slip: Array
) -> tuple[Array, NDArray[np.bool_]]:
    """Impulses (m, c, d) of modes, and whether (m,) their contacts are redundant: those have none.

    Unknown are the normal impulses, and friction where a contact may choose.
    """
    m, (c, d) = len(closed), problem.free.shape
    unknown, zero = np.ones((c, d), bool), np.zeros((m, c, d), bool)
    unknown[:, 1:] = _chooses(problem)[:, None]
    given = np.eye(c * d).reshape(c, d, c, d)
    given[np.arange(c), 1:, np.arange(c), 0] -= np.where(unknown[:, 1:], 0.0, problem.mu[:, None] * problem.slip)
    given = given[:, :, unknown]  # all impulses from those that are unknown
    size = given.shape[2]
    zero[:, :, 0], zero[:, :, 1:] = closed, sticks[:, :, None]
    zero = zero[:, unknown]
    system = np.tile(np.eye(size), (m, 1, 1))
    moved = np.einsum("cidj,djk->cik", problem.matrix, given)[unknown]
    system[zero] = np.broadcast_to(moved, system.shape)[zero]
    rubs = np.where((closed & ~sticks)[:, :, None], problem.mu[:, None] * slip, 0.0)
    place = np.cumsum(unknown.ravel()).reshape(c, d) - 1
    for i in np.flatnonzero(unknown[:, -1]):
        system[:, place[i, 1:], place[i, 0]] += rubs[:, i]
    right = np.where(zero, -problem.free[unknown], 0.0)
    length = np.linalg.norm(system, axis=2)
    system, right = system / length[:, :, None], right / length
    sure = np.abs(np.linalg.det(system)) > np.finfo(float).tiny ** 0.1
    impulse = np.zeros((m, size))
    inverse = np.linalg.inv(system[sure])
    large = np.linalg.norm(inverse, axis=(1, 2)) > REDUNDANT
    impulse[sure] = np.einsum("mij,mj->mi", inverse, right[sure])
    sure[np.flatnonzero(sure)[large]] = False
    return np.asarray(np.einsum("cdk,mk->mcd", given, impulse)), ~sure


def _velocities(problem: Problem, impulse: Array) -> Array:
    return np.asarray(np.einsum("cidj,mdj->mci", problem.matrix, impulse) + problem.free)


def _fitting(
    problem: Problem, impulse: Array, closed: NDArray[np.bool_], sticks: NDArray[np.bool_], slip: Array
) -> Array:
    """Velocities (k, c, d) of those modes whose signs are those of the laws."""
    u = _velocities(problem, impulse)
    size = np.maximum(np.abs(u).max(axis=(1, 2)), np.abs(impulse).max(axis=(1, 2))).clip(min=1.0)
    noise = (SIGN * size)[:, None]
    pressed = impulse[:, :, 0]
    fits = np.where(closed, pressed, u[:, :, 0]) >= -noise
    fits &= ~sticks | (np.linalg.norm(impulse[:, :, 1:], axis=2) <= problem.mu * pressed + noise)
    slips = closed & ~sticks & _chooses(problem)
    fits &= ~slips | ((u[:, :, 1:] * slip).sum(axis=2) >= -noise)
    return np.asarray(u[fits.all(axis=1)])


def _of_redundant(problem: Problem, closed: NDArray[np.bool_], sticks: NDArray[np.bool_], slip: Array) -> Array:
    """Velocities (0 | 1, c, d) of one mode of which some impulses within the cones fulfil the laws."""
    c, d = problem.free.shape
    edges = []
    for i in np.flatnonzero(closed):
        ways = SIDES_OF[d] if sticks[i] else -slip[i : i + 1]
        edge = np.zeros((len(ways), c, d))
        edge[:, i, 0], edge[:, i, 1:] = 1.0, problem.mu[i] * ways
        edges.append(edge)
    cone = np.concatenate(edges)
    zero = np.zeros((c, d), bool)
    zero[:, 0], zero[:, 1:] = closed, sticks[:, None]
    moved = np.einsum("cidj,mdj->mci", problem.matrix, cone)
    weight, off = non_negative_least_squares(moved[:, zero].T, -problem.free[zero])
    impulse = np.einsum("m,mci->ci", weight, cone)[None]
    if off > SIGN * max(1.0, float(np.abs(impulse).max())):
        return np.zeros((0, c, d))
    return _fitting(problem, impulse, closed[None], sticks[None], slip[None])


def _newton(problem: Problem, impulse: Array) -> Array:
    """Velocities (k, c, d) of the answers in which Newton's method ends from ``impulse`` (m, c, d)."""
    c, d = problem.free.shape
    size, mu, slides = c * d, problem.mu, ~_chooses(problem)
    identity, matrix = np.eye(size).reshape(c, d, c, d), problem.matrix
    done = np.zeros((0, c, d))
    for _ in range(STEPS):
        u = _velocities(problem, impulse)
        miss, normal = np.empty((len(impulse), c, d)), impulse[:, :, 0] - u[:, :, 0]
        jacobian = np.tile(identity, (len(impulse), 1, 1, 1, 1))
        pressed = normal > 0.0
        miss[:, :, 0] = np.where(pressed, u[:, :, 0], impulse[:, :, 0])
        limit = mu * impulse[:, :, 0].clip(min=0.0)
        aim = impulse[:, :, 1:] - u[:, :, 1:]
        length = np.linalg.norm(aim, axis=2)
        sticks = ~slides & (length <= limit) & (limit > 0.0)
        way = np.where(slides[:, None], -problem.slip, aim / np.where(length > 0.0, length, 1.0)[:, :, None])
        miss[:, :, 1:] = np.where(sticks[:, :, None], u[:, :, 1:], impulse[:, :, 1:] - limit[:, :, None] * way)
        for i in range(c):
            jacobian[pressed[:, i], i, 0] = matrix[i, 0]
            jacobian[sticks[:, i], i, 1:] = matrix[i, 1:]
            rubs = np.flatnonzero(~sticks[:, i] & (limit[:, i] > 0.0))
            jacobian[rubs, i, 1:, i, 0] -= mu[i] * way[rubs, i]
            if len(rubs) and not slides[i]:
                turn = np.eye(d - 1) - way[rubs, i, :, None] * way[rubs, i, None]
                turn *= (limit[rubs, i] / length[rubs, i])[:, None, None]
                jacobian[rubs, i, 1:] -= np.einsum("mij,jck->mick", turn, identity[i, 1:] - matrix[i, 1:])
        scale = SIGN * np.maximum(np.abs(u).max(axis=(1, 2)), np.abs(impulse).max(axis=(1, 2))).clip(min=1.0)
        ends = np.abs(miss).max(axis=(1, 2)) <= scale
        done = np.concatenate([done, u[ends]])
        goes_on = ~ends & np.isfinite(miss).all(axis=(1, 2))
        if not goes_on.any():
            break
        a, r = jacobian[goes_on].reshape(-1, size, size), miss[goes_on].reshape(-1, size)
        across = a.swapaxes(1, 2)
        square = a @ across
        square += DAMPING * np.trace(square, axis1=1, axis2=2)[:, None, None] * np.eye(size)
        step = across @ np.linalg.solve(square, r[:, :, None])
        impulse = impulse[goes_on] - step[:, :, 0].reshape(-1, c, d)
    return done


def _two(velocities: list[Array], problem: Problem) -> tuple[int, Array, Array] | None:
    """Return two answers of which a contact does something else in each, and which contact; None if there are none."""
    chooses = _chooses(problem)
    for k, one in enumerate(velocities):
        for other in velocities[:k]:
            size = TWO * max(1.0, float(np.abs(one).max()), float(np.abs(other).max()))
            opens = np.column_stack([x[:, 0] > size for x in (one, other)])
            shut = np.column_stack([x[:, 0] <= SAME * size for x in (one, other)])
            slips = np.column_stack([np.linalg.norm(x[:, 1:], axis=1) for x in (one, other)])
            slip = (slips.max(axis=1) > size) & (slips.min(axis=1) <= SAME * size)
            slip |= (slips.min(axis=1) > size) & ((one[:, 1:] * other[:, 1:]).sum(axis=1) < 0.0)
            differs = (opens & shut[:, ::-1]).any(axis=1) | (slip & chooses & ~opens.any(axis=1))
            if differs.any():
                return int(differs.argmax()), one, other
    return None


def _told(run: Run, own: Indices, contact: int, one: Array, other: Array) -> str:
    """What a contact of a solve may do, and with which bodies it is solved."""
    pieces, size = run.pieces, TWO * max(1.0, float(np.abs(one).max()), float(np.abs(other).max()))
    bodies = f"bodies {pieces.body_a[own[contact]]} and {pieces.body_b[own[contact]]}"
    if max(one[contact, 0], other[contact, 0]) > size >= min(one[contact, 0], other[contact, 0]):
        what = "may part, or stay in contact"
    elif min(np.linalg.norm(x[contact, 1:]) for x in (one, other)) <= size:
        what = "may slip, or stick"
    else:
        what = "may slip either way"
    return f"{bodies} {what}"
