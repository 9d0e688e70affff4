"""The full certificate of a run that is judged, and how far its finite step puts each of its metrics off."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from adapters.engine import Engine
from adapters.stepping import run, step_count
from adapters.trajectory import Trajectory
from validation.cells import Prepared, Slot


def fully_certified(
    engine: Engine, prepared: Prepared, slot: Slot, settings: Mapping[str, Any], trajectory: Trajectory
) -> Trajectory:
    """Return ``trajectory`` with the full certificate of its engine entered, where the engine has one.

    Entries are ``full``, what the engine says, ``metric_errors``, and what both make of ``certified`` and ``reasons``.
    Runs that diverged, and those moved by units in the last place, are not judged and keep the light one.
    """
    light = trajectory.certificate
    if slot.ulp or "certified" not in light or trajectory.finish == "diverged":
        return trajectory
    try:
        steps = step_count(prepared.scene.duration, slot.dt)
        full = engine.certify(prepared.scene, slot.dt, settings, steps, trajectory.pose[-1])
        if full is None:
            return trajectory
        entries = {"full": full, "metric_errors": _metric_errors(engine, prepared, slot, settings, trajectory)}
    except Exception as error:  # what cannot be certified is not certified
        full = {"holds": False, "reasons": [f"{type(error).__name__}: {error}".splitlines()[0]]}
        entries = {"full": full}
    said = list(light.get("reasons", ()))
    reasons = said + [reason for reason in full["reasons"] if reason not in said]
    both = {"certified": bool(light["certified"] and full["holds"]), "reasons": reasons}
    return replace(trajectory, certificate={**light, **entries, **both})


def _metric_errors(
    engine: Engine, prepared: Prepared, slot: Slot, settings: Mapping[str, Any], trajectory: Trajectory
) -> dict[str, float | None]:
    """Twice the difference of each metric to that of a run at half the step, at the same times.

    That is at least its error for the step, whatever the order; None where only one of both has the metric.
    """
    scene, sampling = prepared.scene, prepared.canonical.sampling(prepared.scene)
    whole = replace(scene, duration=step_count(scene.duration, slot.dt) * slot.dt)
    if sampling.contacts_from is None:  # the same samples: what a metric owes to their spacing is no error of the run
        sampling = replace(sampling, stride=2 * sampling.stride)
        finer = replace(run(engine, whole, 0.5 * slot.dt, settings, sampling), dt=slot.dt)
    else:  # impulses are those of a step, and metrics know of which
        finer = run(engine, whole, 0.5 * slot.dt, settings, sampling)
    here, there = (prepared.canonical.measure(scene, found) for found in (trajectory, finer))
    return {name: _error(value, there[name][0]) for name, (value, _) in here.items()}


def _error(value: float | None, finer: float | None) -> float | None:
    if value is None or finer is None:
        return 0.0 if value is finer else None
    return 2.0 * abs(value - finer)
