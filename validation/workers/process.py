"""The worker's side: runs one cell after the other and returns plain data, whatever the engine does."""

from __future__ import annotations

import base64
import contextlib
import json
import sys
import time
from collections.abc import Mapping
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from adapters import registry, stages
from adapters.isolation.foreign import said_by
from adapters.stages import stage
from validation import posed
from validation.cells import Observation, Outcome, Slot, slot_from_dict
from validation.running import state

READY = b"ready"


def serve(connection: Connection) -> None:
    """Run cells, and compile kernels, until the other end closes."""
    from validation.running.execution import perform  # noqa: F401  (loaded before the first cell's clock starts)

    registry.load_engines_here()
    connection.send_bytes(READY)
    before: state.State | None = None
    ready = time.monotonic()
    while True:
        try:
            with stage("waiting for work"):
                job = json.loads(connection.recv_bytes())
        except EOFError:
            return
        if job["started"] is not None and not stages.is_on():
            stages.begin(ready - job["started"])
        if "compile" in job:
            answer = _compiled(job)
        else:
            answer, before = _answer(job, before)
        answer["stages"] = stages.taken()
        with stage("sending answers"):
            connection.send_bytes(json.dumps(answer).encode())


def _compiled(job: Mapping[str, Any]) -> dict[str, Any]:
    """Compile the kernels that the cells of a job call; whether that worked."""
    from validation.running.warming import compile_one

    _learn(job)
    return {"compiled": compile_one([slot_from_dict(data) for data in job["compile"]])}


def _learn(job: Mapping[str, Any]) -> None:
    """Scene files that the parent has read."""
    posed.remember(job["scenes"])
    posed.hand_over(job["stated"])


def _answer(job: Mapping[str, Any], before: state.State | None) -> tuple[dict[str, Any], state.State | None]:
    """Result of one cell, and the process state for comparison with the next, if this one did not change it.

    A process that a cell has changed gets no further cell.
    """
    slot, recording, changed, unwritten = slot_from_dict(job["slot"]), None, "", None
    try:
        _learn(job)
        found = registry.find(slot.engine)
        before = state.taken() if before is None else state.still(before)
        try:
            observation, recording = _cell(slot, job)
        finally:
            _flush()
            changed = state.changed(before)
        if found.engine is None and job["installed"]:
            reason = f"it can be loaded, but not in its worker process: {found.reason}"
            observation = replace(observation, outcome=Outcome.CRASHED, reason=reason)
    except OSError as error:  # errors of an engine are outcomes by now: this is about the requested file
        unwritten = [error.errno or 0, error.strerror or said_by(error), str(error.filename or job["keep"])]
        observation = Observation(slot, "", 0, "", Outcome.CRASHED, said_by(error))
    except BaseException as error:  # an exit or an interrupt that an engine raises is a crash of its cell
        observation = Observation(slot, "", 0, "", Outcome.CRASHED, said_by(error))
        changed = changed or "what was raised"
    told = observation.as_dict()
    return {"observation": told, "recording": recording, "changed": changed, "unwritten": unwritten}, before


def _cell(slot: Slot, job: Mapping[str, Any]) -> tuple[Observation, str | None]:
    from validation.running.execution import perform

    keep = Path(job["keep"]) if job["keep"] else None
    observation, recording = perform(slot, keep, job["record"])
    return observation, base64.b64encode(recording.to_bytes()).decode() if recording else None


def _flush() -> None:
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError, AttributeError):  # closed by an engine, which the state shows
            stream.flush()
