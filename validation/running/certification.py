"""The full certificate of a judged run, and the error of each metric by the finite step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import reduce
from itertools import count
from math import gcd
from typing import Any

from adapters.engine import Engine
from adapters.stages import stage
from adapters.stepping import run, step_count
from adapters.trajectory import Sampling, Trajectory
from validation.cells import Prepared, Slot

#: Fewest steps between two common ends of both runs, and the ratio of their step numbers: the square of the golden
#: mean, whose multiples stay far from whole numbers.
BLOCK, FINER = 13, 2.618


@stage("certificate", whole=True)
def fully_certified(
    engine: Engine, prepared: Prepared, slot: Slot, settings: Mapping[str, Any], trajectory: Trajectory
) -> Trajectory:
    """Return ``trajectory`` with the full certificate of its engine entered, where the engine has one.

    Entries are ``full`` (from the engine), ``metric_errors``, and the resulting ``certified`` and ``reasons``. Runs
    that diverged, and those with a moved start, are not judged and keep the light certificate.
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
    except Exception as error:  # a run that cannot be certified is not certified
        full = {"holds": False, "reasons": [f"{type(error).__name__}: {error}".splitlines()[0]]}
        entries = {"full": full}
    said = list(light.get("reasons", ()))
    reasons = said + [reason for reason in full["reasons"] if reason not in said]
    both = {"certified": bool(light["certified"] and full["holds"]), "reasons": reasons}
    return replace(trajectory, certificate={**light, **entries, **both})


def _metric_errors(
    engine: Engine, prepared: Prepared, slot: Slot, settings: Mapping[str, Any], trajectory: Trajectory
) -> dict[str, float | None]:
    """Error of each metric by the finite step: twice its largest difference from two other runs.

    A scheme of order p has the error C h^p. A run with steps of r h, r <= 1/2, has r^p of it, and the two differ by (1
    - r^p) of it, at least half for every p >= 1.

    The first run divides each step into two. Both runs then decide alike at the ends of whole steps (by the rest of a
    step, or by the state at its end), and share errors of these decisions. So the second run has the steps of
    `_elsewhere`, with few common ends or none.

    An engine whose steps only say when it is looked at is run with the same steps to other tolerances instead.

    None where only one of two runs has the metric.
    """
    canonical, scene = prepared.canonical, prepared.scene
    sampling, steps = canonical.sampling(scene), step_count(scene.duration, slot.dt)

    def finer(steps: int, more: int, sampling: Sampling) -> Trajectory:
        """The time of the first ``steps`` steps again, in ``more`` steps."""
        return run(engine, replace(scene, duration=steps * slot.dt), steps / more * slot.dt, settings, sampling)

    def measured(one: Trajectory) -> dict[str, float | None]:
        return {name: value for name, (value, _) in canonical.measure(scene, one).items()}

    def differences(one: Trajectory, other: Trajectory) -> dict[str, float | None]:
        there = measured(other)
        return {name: _difference(value, there[name]) for name, value in measured(one).items()}

    if others := engine.at_other_tolerances(settings):
        told = [differences(trajectory, run(engine, scene, slot.dt, other, sampling)) for other in others]
        return {name: reduce(_larger, (each[name] for each in told)) for name in told[0]}
    # The same sample times: their spacing is no error of the run.
    states = replace(trajectory, contacts=None)
    apart = Sampling(2 * sampling.stride)
    each, blocks, more = _elsewhere(steps // sampling.stride, sampling.stride)
    halves = differences(states, replace(finer(steps, 2 * steps, apart), dt=slot.dt))
    other = finer(blocks * each * sampling.stride, blocks * more, Sampling(more))
    elsewhere = differences(_told(states, slice(0, blocks * each + 1, each)), replace(other, dt=slot.dt))
    # Metrics that samples this far apart do not show are compared with the halves only.
    found = {name: _larger(value, elsewhere[name]) for name, value in halves.items()}
    if trajectory.contacts is None:
        return found
    # Impulses belong to a step, and so do metrics of them: they are taken at every step of each run.
    here, of_states = measured(trajectory), measured(states)
    halves = differences(trajectory, finer(steps, 2 * steps, sampling))
    elsewhere = differences(trajectory, finer(steps, _coprime(steps), sampling))
    of_steps = [name for name in here if here[name] != of_states[name]]
    return found | {name: _larger(halves[name], elsewhere[name]) for name in of_steps}


def _elsewhere(samples: int, stride: int) -> tuple[int, int, int]:
    """Samples in a block, number of blocks, and steps that another run makes in a block of ``stride`` steps a sample.

    Only the ends of blocks are ends of steps of both runs. Blocks have `BLOCK` to twice as many steps, so that samples
    still resolve the motion; the number with the fewest samples left over at the end.
    """
    least = max(1, -(-BLOCK // stride))
    each = min(samples, min(range(least, 2 * least), key=lambda size: samples % size))
    return each, samples // each, _coprime(each * stride)


def _coprime(steps: int) -> int:
    """Number of steps near `FINER` times ``steps`` of which none but the last ends where one of those does."""
    return next(more for more in count(round(FINER * steps)) if gcd(more, steps) == 1)


def _told(trajectory: Trajectory, at: slice) -> Trajectory:
    """The same run at fewer samples."""
    return replace(trajectory, t=trajectory.t[at], pose=trajectory.pose[at], twist=trajectory.twist[at], contacts=None)


def _difference(value: float | None, other: float | None) -> float | None:
    if value is None or other is None:
        return 0.0 if value is other else None
    return 2.0 * abs(value - other)


def _larger(halves: float | None, others: float | None) -> float | None:
    return halves if halves is None or others is None else max(halves, others)
