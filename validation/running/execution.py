"""Runs one cell in this process: scene -> receipts -> trajectory -> metrics -> observation.

All data of an engine are checked and converted here (`adapters.plain`, `adapters.isolation.foreign`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from adapters.engine import Engine, EngineError
from adapters.isolation.foreign import checked_refusal, said_by
from adapters.needs import needs
from adapters.plain import kind_of, one_line, plain
from adapters.receipts import Receipt, contradictions, receipts
from adapters.registry import find
from adapters.scene import SceneError
from adapters.settings.own import own
from adapters.stages import stage
from adapters.stepping import posed_for, run
from adapters.trajectory import Trajectory
from validation.canonical import Measured
from validation.cells import Observation, Outcome, Prepared, Slot, prepare, settings_of
from validation.metrics import OUT_OF_PLANE, realised
from validation.posed import resolve
from validation.running.certification import fully_certified
from validation.running.tracks import Recording, record

#: Reason of a check that its scene states and does not measure.
UNMEASURED = "it was not measured"


def execute(slot: Slot, keep: Path | None = None) -> Observation:
    """Run ``slot`` and measure it.

    Parameters
    ----------
    keep
        File for the trajectory (``.npz``), or None.

    Raises
    ------
    SceneError
        If the slot itself is wrong; failures of an engine become outcomes, not exceptions.
    """
    return perform(slot, keep)[0]


def perform(slot: Slot, keep: Path | None = None, shown: bool = False) -> tuple[Observation, Recording | None]:
    """Run ``slot`` and measure it; see `execute`. Also record its motion if it is shown.

    Raises
    ------
    OSError
        If the trajectory cannot be written.
    """
    canonical = resolve(slot.scene)
    canonical.scene(slot.dimension, dict(slot.params))  # a wrong slot is the caller's error
    found = find(slot.engine)
    blank = Observation(slot, "", 0, found.version, Outcome.CRASHED)
    try:
        prepared = prepare(slot)
        blank = replace(blank, cell=prepared.cell.key(), scene_version=prepared.scene.version)
        if found.engine is None:
            return replace(blank, outcome=Outcome.NOT_INSTALLED, reason=found.reason), None
        try:
            refusal = found.engine.refusal(posed_for(found.engine, prepared.scene), slot.base, slot.dt)
            if refusal is None and slot.is_own:  # other releases may not have them
                own(found.engine, slot.switched, settings_of(found.engine, slot.stock, prepared.scene))
        except EngineError as error:
            refusal = str(error)
        refusal = checked_refusal(refusal)
        if refusal:
            return replace(blank, outcome=Outcome.UNSUPPORTED, reason=refusal), None
        observation, trajectory = _observe(found.engine, prepared, blank, keep is not None or shown)
        recording = record(prepared.canonical, prepared.scene, trajectory) if shown and trajectory else None
    except SceneError:
        raise
    except BaseException as error:  # an engine may raise anything; only this cell is lost
        return replace(blank, outcome=Outcome.CRASHED, reason=said_by(error)), None
    if keep is not None and trajectory is not None:
        trajectory.save(keep)
    return observation, recording


def _observe(
    engine: Engine, prepared: Prepared, blank: Observation, looked_at: bool
) -> tuple[Observation, Trajectory | None]:
    slot, scene = blank.slot, prepared.scene
    wanted = needs(scene)
    settings = settings_of(engine, slot, scene)
    blank = replace(blank, settings=tuple(plain(vars(setting)) for setting in settings))
    try:
        # Declarations hold for a profile's own settings, not for experiments or a model's settings. With a user's
        # settings nothing is declared, and the measured properties are reported.
        slips: Sequence[Receipt] = ()
        if prepared.canonical.brought(slot.engine, slot.base) is None and (slot.is_own or not slot.switched):
            others = settings if slot.is_own else None
            slips = receipts(engine, slot.base, wanted, slot.dt, slot.iterations, others)
        values = {setting.name: setting.value for setting in settings}
        sampling = prepared.canonical.sampling(scene)
        if looked_at and sampling.stride == 1:  # a recorded cell has its contacts from the start
            sampling = replace(sampling, contacts_from=0.0)
        trajectory = run(engine, scene, slot.dt, values, sampling)
        trajectory = fully_certified(engine, prepared, slot, values, trajectory)
        return _measured(blank, prepared, slips, trajectory), trajectory
    except EngineError as error:
        if engine.facts.roles.get(slot.base) == "solution":
            return replace(blank, outcome=Outcome.REFUSED, reason=one_line(error)), None
        return replace(blank, outcome=Outcome.CRASHED, reason=said_by(error)), None
    except BaseException as error:
        return replace(blank, outcome=Outcome.CRASHED, reason=said_by(error)), None


@stage("measuring")
def _measured(blank: Observation, prepared: Prepared, slips: Sequence[Receipt], trajectory: Trajectory) -> Observation:
    measured = replace(blank, outcome=Outcome.OK, receipts=tuple(_plain(slip) for slip in slips))
    measured = _with_trajectory(measured, trajectory)
    refused = trajectory.certificate.get("certified") is False
    if trajectory.finish == "diverged":  # an engine with a certificate reports why it ended the run
        said = [*_reasons(trajectory), trajectory.reason] if refused else [trajectory.reason, *_reasons(trajectory)]
        outcome = Outcome.REFUSED if refused else Outcome.DIVERGED
        return replace(measured, outcome=outcome, reason=one_line("; ".join(said)))
    # A check without an entry is newer than the run (`metrics.NEWER`), so each has one.
    metrics: dict[str, Measured] = {
        check.metric: (None, UNMEASURED) for check in prepared.canonical.checks(prepared.scene, blank.slot.dt)
    }
    metrics |= prepared.canonical.measure(prepared.scene, trajectory)
    if trajectory.out_of_plane is not None:
        metrics[OUT_OF_PLANE] = trajectory.out_of_plane, ""
    if not blank.slot.is_own:
        metrics |= {realised(slip.quantity): (slip.measured, "") for slip in slips if not slip.holds}
    measured = replace(measured, metrics={name: _finite(*found) for name, found in metrics.items()})
    if refused:
        return replace(measured, outcome=Outcome.REFUSED, reason=one_line("; ".join(_reasons(trajectory))))
    against = [] if blank.slot.is_own else contradictions(slips)
    return replace(measured, outcome=Outcome.INVALID, reason=one_line(against[0])) if against else measured


def _finite(value: float | None, reason: str) -> Measured:
    """A value that is not finite becomes a missing value with a reason: it can be neither judged nor stored."""
    if value is None or math.isfinite(value):
        return (None if value is None else float(value)), reason
    said = f"the value is {float(value)}, not a finite number"
    return None, f"{reason}; {said}" if reason else said


def _plain(slip: Receipt) -> dict[str, Any]:
    """A property check as JSON-ready data; a missing measurement is null, as JSON has no NaN."""
    found = {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in vars(slip).items()}
    return dict(plain(found))


def _table(name: str, given: Any) -> dict[str, Any]:
    if not isinstance(given, Mapping):
        raise EngineError(f"{name}: {kind_of(given)} was given, a table is needed")
    return dict(plain(given))


def _reasons(trajectory: Trajectory) -> list[str]:
    """Why a run is not certified, as its engine reports it."""
    given = trajectory.certificate.get("reasons", ())
    return list(map(str, given if isinstance(given, list | tuple) else [given]))


def _with_trajectory(observation: Observation, trajectory: Trajectory) -> Observation:
    return replace(
        observation,
        state_hash=trajectory.state_hash(),
        steps=len(trajectory.t) - 1,
        wall_time_s=trajectory.wall_time,
        readback=_table("readback", trajectory.readback),
        certificate=_table("certificate", trajectory.certificate),
        initial_change=tuple(one_line(change) for change in trajectory.initial_change),
    )
