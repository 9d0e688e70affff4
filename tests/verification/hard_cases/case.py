"""What a hard case is, and the verdict on a run: a certified answer, or DIVERGED with its reason."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from reference_solver.certificate.audit import audit
from reference_solver.model import Array, HalfSpace, Model, smallest_extent
from reference_solver.records import Record
from reference_solver.settings import Settings
from reference_solver.simulation import Simulation
from reference_solver.tally_summary import GATES

#: Energy that a run may gain, of its own scale (`energy_scale`). A step of 1/240 s, first order in time, is right to
#: g dt / v, some thousandths; what breaks down gains more within a few steps.
ENERGY_GAIN = 0.01
#: Overlap at the end of a run, of the smaller half width: what has sunk in deeper has not been carried.
OVERLAP = 0.01


@dataclass(frozen=True)
class Run:
    """What a verdict is given on: model, settings, samples with contacts, certificate of steps."""

    model: Model
    settings: Settings
    record: Record
    certificate: dict[str, Any]

    def impulse(self, sample: int, a: int, b: int) -> Array:
        """Impulse (d,) of the step before a sample (-1: the last) on body b, of all contacts of a < b [N s]."""
        contacts, sample = self.record.contacts, sample % len(self.record.t)
        rows = slice(self.record.offset[sample], self.record.offset[sample + 1])
        chosen = (contacts.body_a[rows] == a) & (contacts.body_b[rows] == b)
        return np.asarray(contacts.impulse[rows][chosen].sum(axis=0))


@dataclass(frozen=True)
class Verdict:
    """Certified numbers, or DIVERGED.

    Parameters
    ----------
    certified
        Whether the numbers may be used.
    measured
        Name with unit: value. What is not certified is kept for gates to show, nothing else.
    reason
        What the certificate rests on, or why the run is void.
    limits
        Name: largest value that a certified answer may have.
    """

    certified: bool
    measured: dict[str, float]
    reason: str
    limits: dict[str, float] = field(default_factory=dict)

    @property
    def answer(self) -> dict[str, float]:
        """The certified numbers; none where there is no certificate."""
        return self.measured if self.certified else {}

    def __str__(self) -> str:
        if not self.certified:
            return f"DIVERGED: {self.reason}"
        return "; ".join(f"{name} = {value:.6g}" for name, value in self.answer.items()) + f" ({self.reason})"


def diverged(reason: str) -> Verdict:
    """Return the verdict on a run whose numbers must not be used."""
    return Verdict(False, {}, reason)


def within(limits: dict[str, float], measured: dict[str, float], reason: str) -> Verdict:
    """Return numbers as certified where all of the limited ones keep their limits, else DIVERGED by the first."""
    for name, limit in limits.items():
        if not abs(measured[name]) <= limit:
            return Verdict(False, measured, f"{name} {measured[name]:.2g}, at most {limit:.2g}", limits)
    return Verdict(True, measured, reason, limits)


@dataclass(frozen=True)
class HardCase:
    """A scene that solvers get wrong.

    Parameters
    ----------
    name, shows
        Title, and one sentence on what it shows.
    model
        Builder.
    settings
        Those of the reference answer; `run` takes others.
    duration
        Simulated time [s].
    judge
        Reads the answer of a run that `doubts` has let pass.
    stride
        Steps between samples.
    excused
        What the scene is about and does not count against it: ``gain`` of energy.
    """

    name: str
    shows: str
    model: Callable[[], Model]
    settings: Settings
    duration: float
    judge: Callable[[Run], Verdict]
    stride: int = 1
    excused: tuple[str, ...] = ()

    def run(self, settings: Settings | None = None) -> Verdict:
        """Step the scene and give the verdict; other settings must have the same step."""
        return self.verdict(self.played(settings or self.settings))

    def played(self, settings: Settings) -> Run:
        """Return the run that a verdict is given on."""
        simulation = Simulation(self.model(), settings)
        steps = max(1, round(self.duration / settings.dt))
        of_loop = settings.tolerance is not None
        record = simulation.record(steps, self.stride, contacts=True, pieces=of_loop)
        return Run(simulation.model, settings, record, {} if of_loop else simulation.certificate)

    def verdict(self, run: Run) -> Verdict:
        """Return the case's own verdict, or DIVERGED where the run as such is in doubt."""
        doubt = doubts(run, self.excused)
        return diverged(doubt) if doubt else self.judge(run)


def doubts(run: Run, excused: tuple[str, ...] = ()) -> str:
    """Return why a run cannot be believed, whatever it shows; empty if nothing speaks against it."""
    record, certificate = run.record, run.certificate
    if not (np.isfinite(record.pose).all() and np.isfinite(record.twist).all()):
        return "positions or velocities are not finite"
    if record.pieces is not None:  # of the loop of events, which counts nothing
        broken = [finding for finding in audit(run.model, record, run.settings.dt) if not finding.holds]
        if broken:
            return str(broken[0])
    for gate in GATES if certificate else ():
        if not certificate[gate.name] <= gate.limit:
            return f"{gate.meaning}: {gate.name} {certificate[gate.name]:.2g}, at most {gate.limit:.2g}"
    gain = energy_gain(run)
    if "gain" not in excused and gain > ENERGY_GAIN:
        return f"energy grew by {gain:.2g} of the largest kinetic energy or of weights times half widths"
    sunk = deepest(run)
    if sunk > OVERLAP:
        return f"bodies overlap by {sunk:.2g} of the smaller half width at the end"
    return ""


def energy(model: Model, pose: Array, twist: Array) -> Array:
    """Kinetic and potential energy of the free bodies, (s,) of (s, n, .) [J]; planar, or spheres (equal moments)."""
    d = model.dimension
    total = np.zeros(len(pose))
    for i, body in enumerate(model.bodies):
        if body.motion == "free":
            inertia = np.atleast_1d(np.array(body.inertia, dtype=np.float64))[0]
            total += 0.5 * body.mass * (twist[:, i, :d] ** 2).sum(axis=1)
            total += 0.5 * inertia * (twist[:, i, d:] ** 2).sum(axis=1)
            load = body.mass * np.array(model.gravity) + np.array(body.force)
            total -= pose[:, i, :d] @ load
    return total


def energy_scale(run: Run) -> float:
    """Largest kinetic energy of the run, or all weights times their half widths, whichever is more [J]."""
    model, record = run.model, run.record
    still = Model(model.dimension, model.bodies, (0.0,) * model.dimension, model.restitution, model.friction)
    weight = np.hypot.reduce(model.gravity)
    free = [body for body in model.bodies if body.motion == "free"]
    standing = sum(body.mass * weight * smallest_extent(body.shape) for body in free)
    return max(float(energy(still, record.pose, record.twist).max()), standing, 1e-300)


def energy_gain(run: Run) -> float:
    """Largest energy above that of the start, of `energy_scale`; 0 where moving walls may do work."""
    if any(body.motion == "prescribed" and any(body.twist or ()) for body in run.model.bodies):
        return 0.0
    total = energy(run.model, run.record.pose, run.record.twist)
    return float((total - total[0]).max()) / energy_scale(run)


def deepest(run: Run) -> float:
    """Deepest overlap at the last sample, of the smaller half width of its pair."""
    first = run.record.offset[-2] if len(run.record.offset) > 1 else 0
    contacts, worst = run.record.contacts, 0.0
    for c in range(first, run.record.offset[-1]):
        shapes = [run.model.bodies[i].shape for i in (contacts.body_a[c], contacts.body_b[c])]
        extent = min(smallest_extent(shape) for shape in shapes if not isinstance(shape, HalfSpace))
        worst = max(worst, -float(contacts.gap[c]) / extent)
    return worst
