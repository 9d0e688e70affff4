"""The full certificate of a judged run, and the error of each metric by the finite tolerance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from adapters.engine import Engine
from adapters.stages import stage
from adapters.stepping import run, step_count
from adapters.trajectory import Trajectory
from validation.cells import Prepared, Slot


@stage("certificate", whole=True)
def fully_certified(
    engine: Engine, prepared: Prepared, slot: Slot, settings: Mapping[str, Any], trajectory: Trajectory
) -> Trajectory:
    """Return ``trajectory`` with the full certificate of its engine entered, where the engine has one.

    Entries are ``full`` (from the engine), ``metric_errors``, and the resulting ``certified`` and ``reasons``. Runs
    that diverged, and those with a moved start, are not judged and have none.
    """
    light = trajectory.certificate
    if slot.ulp or trajectory.finish == "diverged":
        return trajectory
    try:
        steps = step_count(prepared.scene.duration, slot.dt)
        sampling = prepared.canonical.sampling(prepared.scene)
        others = [
            run(engine, prepared.scene, slot.dt, other, sampling)
            for other in engine.at_other_tolerances(settings, light)
        ]
        known = [other.pose for other in others] if sampling.stride == 1 else []
        full = engine.certify(prepared.scene, slot.dt, settings, steps, trajectory.pose[-1], known)
        if full is None:
            return trajectory
        entries = {"full": full, "metric_errors": _metric_errors(prepared, trajectory, others)}
    except Exception as error:  # a run that cannot be certified is not certified
        full = {"holds": False, "reasons": [f"{type(error).__name__}: {error}".splitlines()[0]]}
        entries = {"full": full}
    said = list(light.get("reasons", ()))
    reasons = said + [reason for reason in full["reasons"] if reason not in said]
    both = {"certified": bool(light.get("certified", True) and full["holds"]), "reasons": reasons}
    return replace(trajectory, certificate={**light, **entries, **both})


def _metric_errors(prepared: Prepared, trajectory: Trajectory, others: Sequence[Trajectory]) -> dict[str, float | None]:
    """Error of each metric: twice its largest difference from the same run to other tolerances.

    An error that goes with a power of the tolerance of at least .31 is at most half as large at a tenth of it: twice
    the difference covers it. None where only one of two runs has the metric.
    """
    canonical, scene = prepared.canonical, prepared.scene
    here = {name: value for name, (value, _) in canonical.measure(scene, trajectory).items()}
    found: dict[str, float | None] = dict.fromkeys(here, 0.0)
    for other in others:
        there = canonical.measure(scene, other)
        for name, value in here.items():
            found[name] = _larger(found[name], _difference(value, there[name][0]))
    return found


def _difference(value: float | None, other: float | None) -> float | None:
    if value is None or other is None:
        return 0.0 if value is other else None
    return 2.0 * abs(value - other)


def _larger(one: float | None, other: float | None) -> float | None:
    return None if one is None or other is None else max(one, other)
