"""The full certificate: the audit of a run, how far it is off for its tolerance, and for how long that can be told.

*Error.* Steps say only when the event loop is looked at. The run is made again to a finer and to a coarser tolerance.
What is decided within round-off (which of two corners strikes first, whether what hardly slips does) is decided by the
order of bodies and by signs: the mirrored world, its bodies in reverse order, is as true, and ends where the run does.
What the loop strikes together may touch a little later: by a gap that counts as none.
To all this comes what solves leave of their speeds, as far as a disturbance of that size would grow (below), and how
far apart two motions can be that both obey the laws, where contacts can share a load in more than one way
(`audit.sharing`). Where that distance is visible before the horizon, the run is refused. Bodies that touch and go apart
at once meet, or do not, as round-off has it: what that moves comes to it as well (`audit.contact`).

*Start.* A contact that is open by a gap that counts as none is closed from the start on. In truth loads close it a
little later, while its bodies move as if it were not there: what that changes of velocities goes on from there.

*Place.* No law knows where the origin is; what touches is decided by gaps that are differences of coordinates. The run
is made twice more far from the origin, and a world that stands farther away near it: what differs there, beyond the X
of both and what coarser coordinates explain, refuses. The rest, as the run's own coordinates are smaller, is in X.

*Horizon.* The run is made twice more from velocities that are disturbed in their last places. Until a disturbance has
grown ``GROWTH`` times over what it would be in free flight, a run can be truth to all but the last few digits;
afterwards no run at this precision can, and only its laws are certified. So it is where several pairs of bodies that
touch each other meet in one instant and round-off decides which of them comes first (E21).
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from math import sqrt

import numpy as np

from reference_solver.certificate.audit import (
    Answers,
    Finding,
    answers,
    audited,
    ends_of_series,
    first_without_order,
    grazes,
    joint_blows,
    late_blows,
    shared_loads,
    slips_taken_out,
)
from reference_solver.certificate.audit.run import twist_of
from reference_solver.certificate.relations import Change, permuted
from reference_solver.exact.bodies import start_of, world_of
from reference_solver.exact.features import no_gap
from reference_solver.exact.forces import decide
from reference_solver.exact.impacts import strike
from reference_solver.exact.motion import free_acceleration
from reference_solver.exact.problem import ROUND_OFF
from reference_solver.exact.refusals import Refused
from reference_solver.exact.rows import touching_contacts
from reference_solver.geometry import reach, rotation
from reference_solver.model import POSE_SIZE, Array, Model
from reference_solver.pieces import CHAIN, IMPACT
from reference_solver.records import Record
from reference_solver.settings import TOLERANCES, Settings
from reference_solver.shapes import smallest_extent
from reference_solver.simulation import Simulation

#: Growth of a disturbance at which the horizon lies.
GROWTH = 1e3
#: Size of the disturbance, as a share of the fastest speed of the run: thousands of units in the last place, so that
#: what it grows to is told from the round-off of either run.
DISTURBANCE = 1e-12
#: Shares of the tolerance of the event loop to which a run is made again, where these may be set. The finer one's steps
#: are three quarters as long, those of the coarser one 1.3 times.
SHARES = (0.1, 10.0)
#: Least time for which bodies fall, as a share of the world's, where it is asked what the fall through a gap changes:
#: speeds are well above round-off then, and hardly any slip ends. What it changes is proportional to that time.
FALL = 1e-4
#: Samples within which what happens a little sooner or later far from the origin may be told.
BLOCK = 5
#: What a solve leaves of its speeds (E73), so that a run moves by a tenth of what the disturbance moves it.
SOLVE = 1e-13
#: Distances from the origin to which the run is moved, in smallest half widths. At the second one gaps are closed some
#: seven times as far apart as near the origin. At 30 000 a contact that lets go may chatter within them: of 125 planar
#: scenes two came out .6 and 3 micrometres off there, and were right where they stand.
PLACES = (30.0, 3000.0)
#: Direction of the move: all coordinates change, none as much as another.
AWAY = (0.83, -0.47, 0.31)
#: Signs of the disturbance, one after the other.
SEED = 20


@dataclass(frozen=True)
class Certificate:
    """What a run may be used for.

    Parameters
    ----------
    holds
        Whether it may serve as truth to ``error`` until ``horizon``: every finding is within its limit.
    reasons
        What failed, one sentence each; and, where the horizon lies within the run, that only laws are certified
        beyond it, which is no failure.
    findings
        All that was measured.
    t
        (s,) times of the samples [s].
    error
        (s,) bound of the distance between the run and any exact motion: of any point of any free body, for its
        tolerance, round-off, and loads that the laws do not determine [m].
    growth
        (s,) of a disturbance, over what it is in free flight for the time of the run; the largest so far.
    horizon
        First time at which ``growth`` reaches `GROWTH` [s]; infinite if it does not.
    determined
        Time until which the laws know one motion only [s]: none of how loads are shared shows in it, and no solve has
        another answer. Infinite if at no time of the run, be it beyond the horizon, two motions that obey them are
        visibly apart.
    unique
        From when two motions obey the laws, or uniqueness was not searched; empty if all solves were searched for
        another answer and have none.
    several
        Whether two motions obey the laws.
    disturbed
        (s,) way that the disturbance moves a body, over its speed [s].
    dt
        Time between two looks [s].
    gap
        Largest gap that counts as none where the run is [m].
    grazed
        (s,) way of bodies that meet or pass each other as such a gap decides [m].
    late
        (s,) way of bodies since blows come too late or too soon, over the gap of each.
    pose
        (s, n, 3 | 7) poses that are certified.
    """

    holds: bool
    reasons: tuple[str, ...]
    findings: tuple[Finding, ...] = field(repr=False)
    t: Array = field(repr=False)
    error: Array = field(repr=False)
    growth: Array = field(repr=False)
    horizon: float
    determined: float
    unique: str
    several: bool
    disturbed: Array = field(repr=False)
    dt: float
    gap: float
    grazed: Array = field(repr=False)
    late: Array = field(repr=False)
    pose: Array = field(repr=False)

    def error_until(self, t: float) -> float:
        """Return the bound of the error up to the time ``t`` [m]; infinite beyond the horizon."""
        if t >= self.horizon:
            return float("inf")
        return float(self.error[min(int(np.searchsorted(self.t, t)), len(self.t) - 1)])

    def rounding(self, place: float) -> Array:
        """Return what coordinates of the size ``place`` [m] move a body in any run of the scene (s,) [m].

        Gaps and places are known to some units in the last place, anew in every step: that is a speed of as much in a
        step, and moves bodies as the disturbance does, or `OTHER_SIGNS` times as far. Where a disturbance of velocities
        dies out, places still add up the ways of all steps: each sum is rounded by half a unit, in each of two runs.
        Bodies touch at a gap of `GAP`, wherever they are.
        """
        units = COORDINATE_UNITS * (1.0 + OTHER_SIGNS * self.disturbed / self.dt) + self.t / self.dt + self.late
        steps = np.spacing(place) * units
        grazed = sqrt((self.gap + COORDINATE_UNITS * np.spacing(place)) / self.gap) * self.grazed
        return np.maximum.accumulate(steps + grazed + self.gap * (1.0 + np.minimum(self.growth, GROWTH)))


#: Gaps below this share of a half width, or these units in the last place of a coordinate, are closed (E8).
GAP, COORDINATE_UNITS = 1e-12, 10.0
#: How many times as far as the disturbance another one of its size may move bodies: its signs are some of many.
OTHER_SIGNS = 10.0
#: What the end of a slip in space leaves out, as a share of the smallest half width: once less than 1e-11 of the
#: world's speed is left of it, that is taken off at once (E23).
SLIP_ENDS = 1e-11
#: What a series of rebounds that is held may leave out, as a share of the smallest half width, until its bodies have
#: turned by a radian (E22); and in how many steps they do, at .01 rad a step: 2.4 rad/s at 1/240 s. What it leaves out
#: of velocities goes on from there. Where the record tells of more, by how fast it was hit last, that counts.
SERIES_ENDS, SERIES_STEPS = 1e-11, 100.0


def certify(model: Model, settings: Settings, steps: int, stride: int = 1, others: Sequence[Array] = ()) -> Certificate:
    """Run ``model`` and certify the run.

    It costs eight runs, six if all motion is in closed form, one more with a stride or few looks, and the audit.

    ``others``: poses (s, n, 3 | 7) of the runs to `tolerances_beside` its own, which else are made here.

    Raises
    ------
    ValueError
        If ``steps`` is below 1, ``stride`` below 1, or ``settings`` are not of the event loop.
    """
    if steps < 1:
        raise ValueError(f"steps: {steps!r} must be a whole number of at least 1")
    run = Simulation(model, settings)
    try:
        record = run.record(steps, stride, pieces=True)
    except Refused as refused:
        return _no_run(model, settings, steps // stride, stride, str(refused))
    growth, horizon, moved, size = _horizon(model, settings, record, steps, stride)
    beyond = f"a last-place disturbance has grown {GROWTH:.0g}-fold"
    beyond = f"beyond {horizon:.3g} s {beyond}: only laws hold there"
    unordered, several = _without_order(model, record, settings.dt)
    if unordered <= horizon and unordered < np.inf:
        horizon = unordered
        beyond = (
            f"beyond {horizon:.3g} s round-off decides whether bodies {several} are struck together or one after the "
            "other: only laws hold there"
        )
    found_answers = answers(model, record, settings.dt)
    unique, two = _unique(found_answers), _sample_after(record.t, found_answers.begin, settings.dt)
    if two <= horizon and two < np.inf:
        horizon, beyond = two, unique
    apart, shared = shared_loads(model, record, settings.dt, horizon)
    place = np.abs(record.pose[np.isfinite(record.pose)]).max(initial=0.0)
    gap = GAP * max((reach(body.shape) for body in model.bodies if body.motion == "free"), default=1.0)
    gap += COORDINATE_UNITS * float(np.spacing(place))
    grazed = grazes(model, record, settings.dt, gap, np.minimum(growth, GROWTH))
    measured, unexplained = audited(model, record, settings.dt)
    findings = [*measured, shared]
    reasons = [str(finding) for finding in findings if not finding.holds]
    round_off = np.maximum.accumulate(moved * SOLVE / DISTURBANCE)
    error = _error(model, run, record, steps, stride, others) + round_off
    error += np.where(record.t >= _first_chain(record), gap * (1.0 + growth), 0.0)
    open_by, speed = _open_at_start(model)
    error += (open_by + speed * record.t) * np.clip(growth, 1.0, GROWTH)
    # Bodies meet within the units in which coordinates are known, each time, and go on from there.
    assert record.pieces is not None
    met = np.searchsorted(record.pieces.begin[record.pieces.kind == IMPACT], record.t, side="right")
    late = late_blows(model, record, settings.dt, gap)
    error += np.spacing(place) * (COORDINATE_UNITS * (1.0 + met) + late) * (1.0 + np.minimum(growth, GROWTH))
    within = record.t < horizon
    if not np.isfinite(error[within]).all():
        reasons.append("mirrored or to another tolerance, the event loop refuses it before its end")
    # A difference of two motions that obey the laws grows as that disturbance does, and what all runs are off by.
    slips = slips_taken_out(model, record, settings.dt)
    joint = joint_blows(model, record, settings.dt, no_gap(world_of(model), place))
    error = np.maximum.accumulate(
        error + np.clip(growth, 1.0, GROWTH) * (apart + slips + joint + 2.0 * unexplained) + grazed
    )
    until = _determined(model, record.t, apart, shared.limit)
    until = min(until, float(record.t[record.t < two].max()) if two < np.inf else np.inf)
    rest = (unique, two < np.inf, moved / size, settings.dt, gap, grazed, late, record.pose)
    found = Certificate(not reasons, tuple(reasons), tuple(findings), record.t, error, growth, horizon, until, *rest)
    if found.holds:
        otherwise, rounded = _misplaced(model, settings, found, steps, stride)
        reasons += otherwise
        found = replace(found, error=np.maximum.accumulate(found.error + rounded))
    holds = not reasons
    if horizon <= record.t[-1]:
        reasons.append(beyond)
    return replace(found, holds=holds, reasons=tuple(reasons))


def tolerances_beside(tolerance: float) -> list[float]:
    """Return a tenth of a tolerance and ten times it, as far as these may be set."""
    return [min(max(share * tolerance, TOLERANCES[0]), TOLERANCES[1]) for share in SHARES]


def _open_at_start(model: Model) -> tuple[float, float]:
    """Return the largest gap that is held from the start [m], and how much faster bodies are once it has closed [m/s].

    With accelerations a of the contacts without a gap, bodies fall through gaps δ for T = √(2 δ/c), where c is how fast
    a closes them, and are stopped. The run has those of all contacts instead, for as long.
    """
    world, state = world_of(replace(model, restitution=0.0)), start_of(model)
    contacts = touching_contacts(world, state)
    if not len(contacts):
        return 0.0, 0.0
    contacts = contacts.chosen(np.abs(contacts.rows.speed[:, 0]) < world.still)
    gaps = contacts.rows.gap.copy()
    if not (gaps > 0.0).any():
        return 0.0, 0.0
    free = free_acceleration(world, state.axes, state.velocity)
    try:
        open_ones = decide(world, state, contacts.chosen(gaps <= 0.0), free).acceleration
    except Refused:
        open_ones = free
    closing = -contacts.at_state(state.moving(open_ones)).rows.speed[:, 0]
    falls = (gaps > 0.0) & (closing > ROUND_OFF * world.pull)
    if not falls.any():
        return float(gaps.max()), 0.0
    time = float(np.sqrt(2.0 * gaps[falls] / closing[falls]).max())
    seen = max(time, FALL * world.time)
    fallen = state.moving(state.velocity + seen * open_ones)
    try:
        held = decide(world, state, contacts.at_state(state), free).acceleration
        blows = strike(world, fallen, contacts.at_state(fallen))
        after = blows[-1].after if blows else fallen
        change = after.velocity - state.velocity - seen * held
    except Refused:
        change = seen * open_ones
    d = model.dimension
    lengths = np.array([reach(body.shape) if body.motion == "free" else 0.0 for body in model.bodies])
    apart = np.linalg.norm(change[:, :d], axis=1) + lengths * np.linalg.norm(change[:, d:], axis=1)
    return float(gaps.max()), float(apart[lengths > 0.0].max(initial=0.0)) * time / seen


def _no_run(model: Model, settings: Settings, samples: int, stride: int, why: str) -> Certificate:
    """Return the certificate of a run that the event loop refuses."""
    t = np.multiply(stride * settings.dt, np.arange(samples + 1), dtype=np.float64)
    none = np.full(samples + 1, np.inf)
    pose = np.full((samples + 1, len(model.bodies), POSE_SIZE[model.dimension]), np.nan)
    made = (none, none, float("inf"), float("inf"), "", False, none, settings.dt, 0.0, none, none, pose)
    return Certificate(False, (why,), (), t, *made)


def poses_of(model: Model, settings: Settings, steps: int, stride: int) -> Array:
    """Return poses (s, n, 3 | 7) of a run, no numbers from where the event loop refuses it."""
    with suppress(Refused):
        return Simulation(model, settings).record(steps, stride).pose
    simulation = Simulation(model, settings)
    found = np.full((steps // stride + 1, *simulation.pose.shape), np.nan)
    found[0] = simulation.pose
    with suppress(Refused):
        for sample in range(1, len(found)):
            simulation.advance(stride)
            found[sample] = simulation.pose
    return found


def _determined(model: Model, t: Array, apart: Array, limit: float) -> float:
    """Last time at which motions are not ``apart`` at all (s,), where they are by ``limit`` of a half width later."""
    if not (apart > limit * _size(model)).any():
        return float("inf")
    return float(t[apart <= 0.0].max(initial=0.0))


def _first_chain(record: Record) -> float:
    """Return when impacts first follow each other in one instant, in which bodies stay as far apart as gaps are [s]."""
    pieces = record.pieces
    assert pieces is not None
    at_once = np.append((pieces.begin[1:] == pieces.begin[:-1]) & (pieces.kind[1:] == IMPACT), False)
    found = np.flatnonzero((pieces.kind == IMPACT) & (at_once | (pieces.scheme == CHAIN)))
    return float(pieces.begin[found[0]]) if len(found) else float("inf")


def _without_order(model: Model, record: Record, dt: float) -> tuple[float, str]:
    """First sample after impacts that round-off decides (E21) [s], and the numbers of their bodies."""
    pieces, first = record.pieces, first_without_order(model, record, dt)
    assert pieces is not None
    if first is None:
        return float("inf"), ""
    of_piece = slice(*pieces.first_contact[first : first + 2])
    bodies = sorted({*pieces.body_a[of_piece].tolist(), *pieces.body_b[of_piece].tolist()})
    return _sample_after(record.t, float(pieces.begin[first]), dt), ", ".join(map(str, bodies))


def _sample_after(t: Array, time: float, dt: float) -> float:
    """Return the first of the times ``t`` (s,) after ``time`` [s], by more than round-off of a step; or infinity."""
    after = np.flatnonzero(t > time + 1e-9 * dt)
    return float(t[after[0]]) if len(after) else float("inf")


def _unique(found: Answers) -> str:
    """What is said of other answers; nothing where each solve was searched and has none."""
    if found.begin < np.inf:
        return f"two motions obey the laws from {found.begin:.4g} s: {found.told}"
    if found.unsearched < np.inf:
        return f"uniqueness not searched from {found.unsearched:.4g} s: {found.contacts} contacts in one solve"
    return ""


def _size(model: Model) -> float:
    """Smallest half width of a body [m]; 1 where none has any."""
    least = min(smallest_extent(body.shape) for body in model.bodies)
    return least if np.isfinite(least) else 1.0


def away(model: Model, far: float) -> Change:
    """Return the change of a world that moves it by ``far`` smallest half widths (`AWAY`)."""
    return Change(model.dimension, shift=tuple(far * _size(model) * x for x in AWAY[: model.dimension]))


def _misplaced(
    model: Model, settings: Settings, found: Certificate, steps: int, stride: int
) -> tuple[list[str], Array]:
    """Where a run that holds so far comes out otherwise far from the origin: one sentence for the first such place.

    And how far (s,) coordinates move it where it stands: as far as there, by as much less as they are smaller.
    """
    within, d, rounded = found.t < found.horizon, model.dimension, np.zeros(len(found.t))
    here = float(np.nanmax(np.abs(found.pose[:, :, :d])))
    changes = {f"moved by {far:g} half widths": away(model, far) for far in PLACES}
    if here > PLACES[-1] * _size(model):
        middle = np.mean([body.pose[:d] for body in model.bodies if body.motion == "free"], axis=0)
        changes["moved to the origin"] = Change(d, shift=tuple((-middle).tolist()))
    for where, change in changes.items():
        moved = poses_of(change.model(model), settings, steps, stride)
        apart = distance(model, change.pose(found.pose, found.t), moved)
        # Either run is within X of the truth. What happens a little sooner or later there X may tell a block later.
        error = found.error[np.minimum(np.arange(len(within)) + BLOCK, np.flatnonzero(within)[-1])]
        place = max(here, float(np.nanmax(np.abs(moved[:, :, :d]))))
        allowed = 2.0 * error + found.rounding(place)
        if (within & ~(apart <= allowed)).any():
            allowed += _grazed_there(change.model(model), settings, found, steps, stride, place)
        beyond = np.flatnonzero(within & ~(apart <= allowed))
        if len(beyond):
            k = int(beyond[0])
            said = f"{apart[k]:.3g} m at {found.t[k]:.3g} s, at most {allowed[k]:.3g} m is round-off"
            return [f"{where} it comes out otherwise: {said}"], rounded
        rounded = np.maximum(rounded, apart * (here / place))
    return [], rounded


def _grazed_there(model: Model, settings: Settings, found: Certificate, steps: int, stride: int, place: float) -> Array:
    """Way (s,) of bodies that meet at coordinates of the size ``place`` [m], and need not meet elsewhere [m]."""
    try:
        record = Simulation(model, settings).record(steps, stride, pieces=True)
    except Refused:
        return np.zeros(len(found.t))
    gap = found.gap + COORDINATE_UNITS * float(np.spacing(place))
    return grazes(model, record, settings.dt, gap, np.minimum(found.growth, GROWTH))


def _error(model: Model, run: Simulation, record: Record, steps: int, stride: int, others: Sequence[Array]) -> Array:
    """Bound (s,) of what a run is off for its tolerance [m]; the largest so far."""
    settings = run.settings
    assert settings.tolerance is not None
    error = distance(model, record.pose, _mirrored(model, settings, steps, stride))
    if not (run.is_closed or others):
        beside = tolerances_beside(settings.tolerance)
        others = [poses_of(model, replace(settings, tolerance=each), steps, stride) for each in beside]
    for other in others:
        error = np.maximum(error, 2.0 * distance(model, record.pose, other))
    return _with_ends(model, record, settings.dt, error)


def _with_ends(model: Model, record: Record, dt: float, error: Array) -> Array:
    """Return the error (s,) with round-off, and with what ends of slips and of series leave out [m]."""
    noise = 8.0 * np.spacing(np.abs(record.pose).max(axis=(1, 2)))
    least = _size(model)
    if model.dimension == 3 and len(record.pieces.body_a if record.pieces else ()):
        noise += SLIP_ENDS * least
    for end, at_once, onward in zip(*ends_of_series(model, record, dt), strict=True):
        since = np.maximum(record.t - end, 0.0)
        allowed = SERIES_ENDS * least * (1.0 + since / dt / SERIES_STEPS)
        noise += np.where(record.t >= end, np.maximum(allowed, at_once + onward * since), 0.0)
    return np.maximum.accumulate(error + noise)


def _mirrored(model: Model, settings: Settings, steps: int, stride: int) -> Array:
    """Poses (s, n, 3 | 7) of the run of the mirrored world, its bodies in reverse order, as seen in this one [m]."""
    d = model.dimension
    mirror = Change(d, signs=(-1.0,) + (1.0,) * (d - 1))
    backwards = list(range(len(model.bodies)))[::-1]
    pose = poses_of(mirror.model(permuted(model, backwards)), settings, steps, stride)
    return mirror.pose(pose[:, backwards], np.multiply(stride * settings.dt, np.arange(len(pose)), dtype=np.float64))


def _horizon(
    model: Model, settings: Settings, record: Record, steps: int, stride: int
) -> tuple[Array, float, Array, float]:
    """Growth (s,) of a disturbance of all free bodies' velocities, when it is too large, what it moves, its size."""
    d = model.dimension
    fastest = float(np.abs(record.twist[:, :, :d]).max())
    size = DISTURBANCE * (fastest if np.isfinite(fastest) and fastest > 0.0 else 1.0)
    pieces = record.pieces
    assert pieces is not None
    # Motions that part may be together again where the run is looked at: they are compared once a blow at least.
    often = max(1, -(-len(np.unique(pieces.begin[pieces.kind == IMPACT])) // steps))
    each, pose = replace(settings, dt=settings.dt / often), record.pose
    if often * stride > 1:
        pose = poses_of(model, each, steps * often, 1)
    ways = [distance(model, pose, poses_of(other, each, steps * often, 1)) for other in _disturbed(model, size)]
    apart = np.maximum(*ways)
    noise = 8.0 * np.spacing(np.abs(pose).max(axis=(1, 2)))
    free_flight = size * np.sqrt(d) * max(record.t[-1], settings.dt) + noise
    growth = np.maximum.accumulate(np.where(np.isfinite(apart), apart, np.inf) / free_flight)
    apart, growth = (np.maximum.accumulate(x)[:: often * stride] for x in (apart, growth))
    over = np.flatnonzero(growth >= GROWTH)
    return growth, float(record.t[over[0]]) if len(over) else float("inf"), apart, size


def _disturbed(model: Model, size: float) -> list[Model]:
    """Two worlds whose free bodies are faster by ``size`` along each axis [m/s], in the second one a quarter turn on.

    Errors that grow across one disturbance only are seen by the other.
    """
    d, random, found = model.dimension, np.random.default_rng(SEED), []
    free = np.array([body.motion == "free" for body in model.bodies])
    change = np.zeros((len(free), d))
    change[free] = size * random.choice([-1.0, 1.0], (free.sum(), d))
    for _ in range(2):
        twists = [twist_of(body).copy() for body in model.bodies]
        for twist, more in zip(twists, change, strict=True):
            twist[:d] += more
        bodies = [replace(body, twist=tuple(twist)) for body, twist in zip(model.bodies, twists, strict=True)]
        found.append(replace(model, bodies=bodies))
        change[:, :2] = np.stack([-change[:, 1], change[:, 0]], axis=1)
    return found


def distance(model: Model, one: Array, other: Array) -> Array:
    """Return how far (s,) any point of a free body is from where it is in another run, at most [m].

    Infinite where either is no number: a run that ended is as far from any other as can be.
    """
    d = model.dimension
    known = np.asarray(np.isfinite(one).all(axis=(1, 2)) & np.isfinite(other).all(axis=(1, 2)))
    one, other = one[known], other[known]
    worst = np.zeros(len(one))
    for i, body in enumerate(model.bodies):
        if body.motion != "free":
            continue
        apart = np.linalg.norm(one[:, i, :d] - other[:, i, :d], axis=1)
        turned = rotation(one[:, i]) - rotation(other[:, i])
        worst = np.maximum(worst, apart + reach(body.shape) * np.linalg.norm(turned, ord=2, axis=(1, 2)))
    found = np.full(len(known), np.inf)
    found[known] = worst
    return found
