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
from adapters.stepping import posed_for, run
from adapters.trajectory import Trajectory
from validation.cells import Observation, Outcome, Prepared, Slot, prepare, settings_of


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
    settings = settings_of(engine, slot, scene)
    shown = tuple(asdict(setting) for setting in settings)
    try:
        # What a profile declares holds for its own settings; an experiment with others is about what they change.
        slips = () if slot.switched else receipts(engine, slot.profile, wanted, slot.dt, slot.iterations)
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
    if trajectory.certificate.get("certified") is False:
        reasons = "; ".join(trajectory.certificate.get("reasons", ()))
        return replace(measured, outcome=Outcome.INVALID, reason=f"certificate: {reasons}")
    broken = [slip for slip in slips if not slip.holds]
    if broken:
        worst = broken[0]
        reason = f"receipt {worst.quantity}: measured {worst.measured:.6g}, declared {worst.declared:.6g}"
        return replace(measured, outcome=Outcome.INVALID, reason=f"{reason} +- {worst.band:.2g}")
    return measured


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
