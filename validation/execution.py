"""Runs one cell in this process: scene -> receipts -> trajectory -> metrics -> observation."""

from __future__ import annotations

import math
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from adapters.engine import Engine, EngineError
from adapters.needs import needs
from adapters.receipts import receipts
from adapters.registry import find
from adapters.stepping import posed_for, run, step_count
from adapters.trajectory import Sampling, Trajectory
from validation.cells import Observation, Outcome, Prepared, Slot, prepare


def execute(slot: Slot, keep: Path | None = None) -> Observation:
    """Run ``slot`` and measure it.

    Parameters
    ----------
    keep
        Where to write the trajectory (``.npz``), if it is wanted.

    Raises
    ------
    SceneError
        If the slot itself is wrong; what an engine does becomes an outcome, not an exception.
    """
    prepared = prepare(slot)
    version = prepared.cell.engine_version
    blank = Observation(slot, prepared.cell.key(), prepared.scene.version, version, Outcome.OK)
    found = find(slot.engine)
    if found.engine is None:
        return replace(blank, outcome=Outcome.NOT_INSTALLED, reason=found.reason)
    try:
        refusal = found.engine.refuses(posed_for(found.engine, prepared.scene), slot.profile)
    except EngineError as error:
        refusal = str(error)
    if refusal:
        return replace(blank, outcome=Outcome.UNSUPPORTED, reason=refusal)
    return _observe(found.engine, prepared, blank, keep)


def _observe(engine: Engine, prepared: Prepared, blank: Observation, keep: Path | None) -> Observation:
    slot, scene = blank.slot, prepared.scene
    wanted = needs(scene)
    settings = engine.settings(slot.profile, wanted, slot.dt, slot.iterations)
    shown = tuple(asdict(setting) for setting in settings)
    try:
        slips = receipts(engine, slot.profile, wanted, slot.dt, slot.iterations)
        values = {setting.name: setting.value for setting in settings}
        sampling = prepared.canonical.sampling(scene)
        if keep is not None and sampling.stride == 1:  # what is kept is looked at: with its contacts, from the start
            sampling = replace(sampling, contacts_from=0.0)
        trajectory = run(engine, scene, slot.dt, values, sampling)
    except Exception as error:  # whatever an engine raises costs this cell only
        reason = f"{type(error).__name__}: {error}".splitlines()[0]
        return replace(blank, outcome=Outcome.CRASHED, reason=reason, settings=shown)
    if keep is not None:
        trajectory.save(keep)
    measured = replace(blank, settings=shown, receipts=tuple(_plain(slip) for slip in slips))
    measured = _with_trajectory(measured, trajectory)
    if trajectory.finish == "diverged":
        return replace(measured, outcome=Outcome.DIVERGED, reason=trajectory.reason)
    measured = replace(measured, metrics=prepared.canonical.measure(scene, trajectory))
    try:
        measured = _certified(engine, prepared, measured, trajectory, sampling)
    except Exception as error:
        reason = f"certificate: {type(error).__name__}: {error}".splitlines()[0]
        return replace(measured, outcome=Outcome.INVALID, reason=reason)
    if measured.certificate.get("certified") is False:
        reasons = "; ".join(measured.certificate.get("reasons", ()))
        return replace(measured, outcome=Outcome.INVALID, reason=f"certificate: {reasons}")
    broken = [slip for slip in slips if not slip.holds]
    if broken:
        worst = broken[0]
        reason = f"receipt {worst.quantity}: measured {worst.measured:.6g}, declared {worst.declared:.6g}"
        return replace(measured, outcome=Outcome.INVALID, reason=f"{reason} +- {worst.band:.2g}")
    return measured


def _certified(
    engine: Engine, prepared: Prepared, measured: Observation, trajectory: Trajectory, sampling: Sampling
) -> Observation:
    """Enter the full certificate of an engine that has one, and how far its finite step puts each metric off.

    The error of a metric is twice its difference to that of a run at half the step, at the same times: at least the
    error for the step, whatever the order. Runs moved by units in the last place are not judged and not certified.
    """
    slot, scene = measured.slot, prepared.scene
    if slot.ulp or "certified" not in trajectory.certificate:
        return measured
    values = {setting["name"]: setting["value"] for setting in measured.settings}
    steps = step_count(scene.duration, slot.dt)
    full = engine.certify(scene, slot.dt, values, steps, trajectory.pose[-1])
    if full is None:
        return measured
    whole = replace(scene, duration=steps * slot.dt)
    if sampling.contacts_from is None:  # the same samples: what a metric owes to their spacing is no error of the run
        finer = run(engine, whole, 0.5 * slot.dt, values, replace(sampling, stride=2 * sampling.stride))
        finer = replace(finer, dt=slot.dt)
    else:  # impulses are those of a step, and metrics know of which
        finer = run(engine, whole, 0.5 * slot.dt, values, sampling)
    found = prepared.canonical.measure(scene, finer)
    errors = {name: _error(value, found[name][0]) for name, (value, _) in measured.metrics.items()}
    light = trajectory.certificate
    reasons = [*light.get("reasons", ()), *(reason for reason in full["reasons"] if reason not in light["reasons"])]
    certified = bool(light["certified"] and full["holds"])
    entries = {"certified": certified, "reasons": reasons, "full": full, "metric_errors": errors}
    return replace(measured, certificate={**light, **entries})


def _error(value: float | None, finer: float | None) -> float | None:
    """Error of a metric for the step; none where neither run has it, infinite (null) where only one has."""
    if value is None or finer is None:
        return 0.0 if value is finer else None
    return 2.0 * abs(value - finer)


def _plain(slip: Any) -> dict[str, Any]:
    """A receipt as JSON-ready data; what could not be measured is null, JSON has no NaN."""
    return {k: None if isinstance(v, float) and math.isnan(v) else v for k, v in asdict(slip).items()}


def _with_trajectory(observation: Observation, trajectory: Trajectory) -> Observation:
    return replace(
        observation,
        state_hash=trajectory.state_hash(),
        steps=len(trajectory.t) - 1,
        wall_time_s=trajectory.wall_time,
        readback=trajectory.readback,
        certificate=trajectory.certificate,
        initial_change=trajectory.initial_change,
        out_of_plane=trajectory.out_of_plane,
    )
