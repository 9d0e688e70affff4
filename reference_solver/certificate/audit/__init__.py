"""The audit of a run: what it did against the model alone, by code that shares nothing with the solver.

`audit` reads the pieces of a run (`reference_solver.pieces`) and a `Model`, computes masses, levers, laws and gaps
anew, and returns one `Finding` for each check. Nothing here imports ``exact/``, a textbook or ``direct/``.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from reference_solver.certificate.audit import answers as other_answers
from reference_solver.certificate.audit import chains, contact, energy, motion, order, rates, sharing, space, touching
from reference_solver.certificate.audit.answers import Answers
from reference_solver.certificate.audit.run import Run
from reference_solver.certificate.audit.unexplained import Unexplained
from reference_solver.model import Model
from reference_solver.records import Record


class Check(NamedTuple):
    """Largest value of one quantity with which a run may pass, and what is wrong when it is exceeded."""

    limit: float
    meaning: str


class Finding(NamedTuple):
    """What one check measured."""

    name: str
    value: float
    limit: float
    meaning: str

    @property
    def holds(self) -> bool:
        """Whether the value is within its limit; nan is not."""
        return bool(self.value <= self.limit)

    def __str__(self) -> str:
        return f"{self.meaning}: {self.name} {self.value:.3g}, at most {self.limit:.3g}"


#: All checks. Shares are of the contact's or body's own scale.
CHECKS = {
    "finite": Check(0.0, "a state or an impulse is no number"),
    # Pieces hand over the very numbers.
    "joined": Check(0.0, "bodies do not go on where they were"),
    # Begins and lengths are rounded once each.
    "time": Check(1e-12, "pieces do not fill the time"),
    # Velocities are integrals of the forces. Where contacts share loads impulses are by Gauss' rule: off by 5e-11.
    "momentum": Check(1e-10, "impulses and loads do not explain a change of momentum"),
    # As momentum, and moments of a piece that turns are by Gauss' rule: (w h)^6 of a body that turns .03 rad in it.
    "spin": Check(1e-9, "moments and torques do not explain a change of angular momentum"),
    # Free flight is a parabola, to round-off, as a share of the body.
    "flight": Check(1e-12, "a body in free flight leaves its parabola"),
    # Ways and velocities within a step are interpolated each by itself, to its tolerance: off by 1e-10.
    "path": Check(1e-9, "a body's way is not that of its velocity"),
    # The independent integration is exact to 1e-10 of a turn of .3 rad.
    "turn": Check(1e-9, "a body that nothing touches does not turn by Euler's equations"),
    "prescribed": Check(1e-12, "a body that is not free does not move as prescribed"),
    # Clamped at zero, which is exact.
    "pull": Check(1e-14, "a contact pulls"),
    # Clamped with four roundings; turned into world axes with as many.
    "cone": Check(1e-12, "friction exceeds mu p_n"),
    # A solve's residual, 1e-13, over the ratio of the two scales that it and the audit use.
    "normal": Check(1e-9, "normal impulses do not obey restitution and complementarity"),
    "friction": Check(1e-9, "friction does not oppose the slip"),
    # A way known to 1e-11 of a half width over a step h tells a force to 1e-11 (T/h)^2 of the loads, with the time T in
    # which they move a body by it: that of h = T/300. X contains what is below it (`unexplained`).
    "rates": Check(1e-6, "forces between two pieces do not obey friction, or act beside their points"),
    # Exact where rows stand still; a point that moves is known to as much where they turn.
    "moment": Check(1e-9, "moments are not those of the impulses at their points"),
    # A wedge or a lever multiplies impulses; a million times the momentum at hand is none of either.
    "scale": Check(1e6, "an impulse is beyond any physical scale"),
    "unknown": Check(0.0, "impulses act on bodies that their piece does not hold"),
    # A thousandth of the overlap that is allowed.
    "apart": Check(1e-9, "an impulse acts between bodies that do not touch"),
    # Loss of separation along the solver's normal, as a share of the body.
    "direction": Check(1e-9, "the normal at a contact, as at a corner, is not unique"),
    "place": Check(1e-9, "a contact's point is on no surface of its bodies"),
    # As ``apart``, and speeds as those after a solve.
    "stays": Check(1e-9, "a contact carries beyond where a face, an edge or a corner of its bodies ends"),
    # Velocities of an impact's start, as shares of the speeds there.
    "choice": Check(1e-9, "corners meet along a normal that they do not close along last"),
    # Speeds after a solve: its residual.
    "together": Check(1e-9, "an impact leaves out what touches as well"),
    # Each such impact is proven from its own velocities, or is not.
    "endless": Check(0.0, "impacts are summed up as if they had no end, and that is not so"),
    # Coordinates must resolve the overlap that is allowed ten times over.
    "resolution": Check(1e-7, "bodies are so far out that their places are no longer resolved"),
    # Located impacts happen at a gap of round-off, ten times less.
    "overlap": Check(1e-11, "bodies are in each other: a contact or an impact was missed"),
    "start": Check(1e-6, "bodies overlap at the start"),
    # Two motions are one while they differ by no more than bodies may overlap at the start.
    "shared": Check(1e-6, "the motion is not determined"),
    # Energies are squares of momenta; a piece that turns gains or loses what its step leaves: 5e-11 where bodies rock.
    "gained": Check(1e-9, "energy was gained"),
    # As much as may be gained.
    "lost": Check(1e-9, "energy was lost that friction does not take"),
}


def audit(model: Model, record: Record, dt: float) -> list[Finding]:
    """Return what all checks measured of a recorded run from its start.

    Parameters
    ----------
    model
        What was to be simulated.
    record
        Of `Simulation.record` with ``pieces=True``, from the first step on.
    dt
        Step [s].

    Raises
    ------
    ValueError
        If the record has no pieces.
    """
    return audited(model, record, dt)[0]


def audited(model: Model, record: Record, dt: float) -> tuple[list[Finding], np.ndarray]:
    """Return what `audit` does, and how far (s,) what it measured moves bodies [m] (`Unexplained`).

    Raises ValueError if the record has no pieces.
    """
    run = _run_of(model, record, dt)
    left, start = Unexplained(run), np.array([body.pose for body in model.bodies], dtype=float)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        measured = [each for each in _measured(run, start, record, left) if each[0] in CHECKS]
        return [Finding(name, value, *CHECKS[name]) for name, value in measured], left.distances(record.t)


def _run_of(model: Model, record: Record, dt: float) -> Run:
    if record.pieces is None:
        raise ValueError("record: has no pieces, record(..., pieces=True) keeps them")
    return Run(model, record.pieces, dt)


def ends_of_series(model: Model, record: Record, dt: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return when a recorded run of `audit` ends series of rebounds whose contacts turn meanwhile.

    Times (k,) [s]; what is left out there (k,) [m]; and what that goes on by (k,) [m/s] (`left_out_by_series`). Raises
    ValueError if the record has no pieces.
    """
    run = _run_of(model, record, dt)
    ends = contact.ends_of_series(run)
    which, place = np.unique(run.contact_owner[ends], return_inverse=True)
    sums = [np.bincount(place, part[ends], len(which)) for part in contact.left_out_by_series(run, ends)]
    return run.pieces.begin[which], sums[0], sums[1]


def slips_taken_out(model: Model, record: Record, dt: float) -> np.ndarray:
    """Return how far (s,) a recorded run is off where slips end within pieces that stick all along [m].

    The sum of all pieces that have begun (`contact.slips_taken_out`). Raises ValueError if the record has no pieces.
    """
    run = _run_of(model, record, dt)
    ways = contact.slips_taken_out(run)
    off = np.flatnonzero(ways)
    first = np.searchsorted(record.t, run.pieces.begin[run.contact_owner[off]])
    return np.bincount(first, ways[off], len(record.t) + 1)[: len(record.t)].cumsum()


def first_without_order(model: Model, record: Record, dt: float) -> int | None:
    """Return the first piece of a recorded run at which the motion hangs on round-off (`chains`, `order`), if any.

    Raises ValueError if the record has no pieces.
    """
    run = _run_of(model, record, dt)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        return order.first_without_order(run, chains.without_order(run))


def answers(model: Model, record: Record, dt: float) -> Answers:
    """Return when a recorded run first has another answer, and when the search for one ended (`answers`).

    Raises ValueError if the record has no pieces.
    """
    run = _run_of(model, record, dt)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        return other_answers.answers(run)


def grazes(model: Model, record: Record, dt: float, noise: float, growth: np.ndarray) -> np.ndarray:
    """Return how far (s,) impacts move bodies of which round-off decides whether they are [m] (`contact.grazes`).

    Gaps below ``noise`` [m] count as none. What an impact moves until the sample after it grows as disturbances do
    (``growth``), or as in free flight where that is more. Raises ValueError if the record has no pieces.
    """
    moved, growth = np.zeros(len(record.t)), np.maximum(growth, 1.0)
    for begin, speed in zip(*contact.grazes(_run_of(model, record, dt), record.t, record.pose, noise), strict=True):
        since = np.maximum(record.t - begin, 0.0)
        first = int(np.searchsorted(record.t, begin, side="right"))
        grown = np.where(since > 0.0, since[first] * growth / growth[first], 0.0)
        moved += speed * np.maximum(since, grown)
    return moved


def late_blows(model: Model, record: Record, dt: float, none: float) -> np.ndarray:
    """Return how far (s,) blows of a recorded run move bodies that come too late or too soon, over the gap of each.

    Rebounds no higher than ``none`` [m] have no part (`contact.late_blows`). Raises ValueError if the record has no
    pieces.
    """
    moved = np.zeros(len(record.t))
    with np.errstate(divide="ignore"):
        blows = contact.late_blows(_run_of(model, record, dt), none)
    for begin, change, lasts in zip(*blows, strict=True):
        moved += change * np.clip(record.t - begin, 0.0, lasts)
    return moved


def joint_blows(model: Model, record: Record, dt: float, none: np.ndarray) -> np.ndarray:
    """Return how far (s,) bodies move since contacts are struck with others that are still open [m].

    They are open by ``none`` (n, n) [m] of their pair at most. What is struck late gets its change of velocity so much
    later; loads act until then, and where it rebounds count twice. Raises ValueError if the record has no pieces.
    """
    moved, pull = np.zeros(len(record.t)), float(np.linalg.norm(model.gravity))
    for begin, late, speed in zip(*contact.joint_blows(_run_of(model, record, dt), none), strict=True):
        since = record.t - begin
        moved += np.where(since > 0.0, late * (speed + 2.0 * pull * since), 0.0)
    return moved


def shared_loads(model: Model, record: Record, dt: float, until: float) -> tuple[np.ndarray, Finding]:
    """Return how far apart (s,) two motions can be that both obey the laws [m], and what is found of it.

    They differ where contacts share a load in more than one way and friction follows the shares (`sharing`). The
    finding is the distance before ``until`` [s], as a share of the smallest half width.

    Raises
    ------
    ValueError
        If the record has no pieces.
    """
    run = _run_of(model, record, dt)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        apart, told = sharing.distances(run, record.t)
    limit, meaning = CHECKS["shared"]
    return apart, Finding("shared", float(apart[record.t < until].max(initial=0.0) / run.size), limit, told or meaning)


def _measured(run: Run, start: np.ndarray, record: Record, left: Unexplained) -> Iterator[tuple[str, float]]:
    yield from motion.measured(run, start, record, left)
    yield from contact.measured(run, left)
    yield from rates.measured(run, left)
    yield from touching.measured(run, left)
    yield from chains.measured(run)
    yield from space.measured(run, start)
    yield from energy.measured(run)
