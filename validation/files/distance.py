"""Error of a scene from a file, which has no closed form: how far from the certified run of our own solver it ends.

    error      largest distance of a free body's centre, at the end, from where the certified run has it [m]

The certified run is a case of its own, at half the finest step that is measured, so that no case is its own truth, our
solver's included. Where its certificate does not hold until the end there is no error, and a reason.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from adapters.registry import profile_of, solver
from adapters.scene import Scene, SceneError
from validation.canonical import Measured, Primary
from validation.catalogue import CATALOGUE
from validation.cells import Observation, Outcome, Slot
from validation.files.stated import metric_of
from validation.metrics import largest
from validation.posed import is_file, resolve

#: Begin of the names of the certified run's metrics, beside those of the run that is measured.
CERTIFIED = "certified "
_AXES = "xyz"


def _error(scene: Scene, dt: float, metrics: Mapping[str, Measured]) -> Measured:
    distances = []
    for body in (body for body in scene.bodies if body.motion == "free"):
        names = [metric_of(f"{body.name}.{axis}") for axis in _AXES[: scene.dimension]]
        here, there = ([metrics[prefix + name] for name in names] for prefix in ("", CERTIFIED))
        lost = next((reason for value, reason in (*here, *there) if value is None), None)
        if lost is not None:
            return None, lost
        distances.append(math.dist(*([float(value or 0.0) for value, _ in place] for place in (here, there))))
    return (largest(distances), "") if distances else (None, "no body moves freely")


#: The error by which a bench compares engines on a scene from a file.
DISTANCE = Primary(
    name="distance from the certified run",
    unit="m",
    law="largest distance of a free body's centre, at the end, from where our solver's certified run has it",
    because="a scene from a file has no closed form; the certificate bounds the error of that run",
    variations=lambda dt: [{}],
    error=_error,
    state="the whole scene",
)


def primary_of(argument: str) -> Primary:
    """Return the declared error of a scene; of one from a file the distance from the certified run.

    Raises
    ------
    SceneError
        If none is declared: a bench needs one number.
    """
    found = resolve(argument).primary
    if found is None and is_file(argument):
        return DISTANCE
    if found is None:
        declared = [name for name, scene in CATALOGUE.items() if scene.primary]
        raise SceneError(f"scene: no primary error is declared for {argument!r}, only for {', '.join(declared)}")
    return found


@dataclass(frozen=True)
class CertifiedRun:
    """The run that others are measured from: its slot, its metrics, and why it is none, else empty."""

    slot: Slot
    metrics: Mapping[str, Measured]
    reason: str


#: Certified runs by what was asked (`posed`).
CertifiedRuns = Mapping[tuple[object, ...], CertifiedRun]


def certified_slot(slot: Slot, dt: float) -> Slot:
    """The case of our own solver's solution that asks what ``slot`` asks, at step ``dt`` [s]."""
    ours = solver()
    return Slot(slot.scene, slot.params, slot.dimension, ours, profile_of(ours, "solution") or "", dt)


def posed(slot: Slot) -> tuple[object, ...]:
    """What a slot asks of every engine: scene, parameters and dimension."""
    return slot.scene, slot.params, slot.dimension


def certified_runs(observations: Iterable[Observation]) -> CertifiedRuns:
    """The certified runs among observations of scenes from files: of each such scene the case of the smallest step."""
    finest: dict[tuple[object, ...], Observation] = {}
    for observation in observations:
        key = posed(observation.slot)
        if key not in finest or observation.slot.dt < finest[key].slot.dt:
            finest[key] = observation
    return {
        key: CertifiedRun(each.slot, {CERTIFIED + name: value for name, value in each.metrics.items()}, _why_not(each))
        for key, each in finest.items()
        if each.slot == certified_slot(each.slot, each.slot.dt)
    }


def _why_not(observation: Observation) -> str:
    if observation.outcome is Outcome.OK and observation.certificate.get("certified"):
        return ""
    said = observation.reason or "it has no certificate"
    return f"no certified run to measure from: {said}"
