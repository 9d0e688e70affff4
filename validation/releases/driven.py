"""Runs in the environment of a release; needs only numpy and the engine.

    stdin    one JSON object: {"engine", "request" or null, "slots", "timed", "compared", "ports", "stated", "jobs",
             "timeout"}
    stdout   one JSON object per line: first what this is ({"told": ...}), then an observation or {"left": ...} each,
             then {"timed": ...} for each lap of what is to be timed, {"compared": ...} for each case on each port

Cells run as usual: `validation.workers` isolates them, and property checks run before each. The parent keeps stdin
open; when it closes, this process and its workers end.
"""

from __future__ import annotations

import json
import os
import platform
import sys
import threading
from collections.abc import Mapping
from importlib import metadata
from typing import Any, TextIO

from adapters import registry
from validation import posed
from validation.cells import Slot, slot_from_dict
from validation.releases.ports import compared
from validation.releases.timing import laps
from validation.running.plan import Request, slots
from validation.workers import run_cells


def main() -> None:
    """Handle one request on stdin."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # output of an engine is no answer
    asked = json.loads(sys.stdin.readline())
    threading.Thread(target=_end_with_parent, daemon=True).start()
    posed.hand_over(asked["stated"])
    found = registry.find(asked["engine"])
    told: dict[str, Any] = {
        "python": platform.python_version(),
        "engine_version": found.version,
        "distribution_version": _version(asked["distribution"]),
        "reason": found.reason,
        "numpy": metadata.version("numpy"),
    }
    if asked["request"] is not None and found.engine is not None:
        told["slots"] = [slot.as_dict() for slot in slots(Request(**asked["request"]))]
    _say(answers, {"told": told})
    if found.engine is not None:
        _run(answers, asked)
    answers.close()


def _version(distribution: str) -> str:
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return ""


def _run(answers: TextIO, asked: Mapping[str, Any]) -> None:
    wanted = [slot_from_dict(data) for data in asked["slots"]]

    def leave(slot: Slot, reason: str) -> None:
        _say(answers, {"left": slot.as_dict(), "reason": reason})

    for observation in run_cells(wanted, asked["jobs"], asked["timeout"], leave=leave):
        _say(answers, observation.as_dict())
    for lap in laps([slot_from_dict(data) for data in asked["timed"]]):
        _say(answers, lap)
    for told in compared([slot_from_dict(data) for data in asked["compared"]], asked["ports"]):
        _say(answers, {"compared": told.as_dict()})


def _say(answers: TextIO, data: Mapping[str, Any]) -> None:
    answers.write(json.dumps(data, default=str) + "\n")
    answers.flush()


def _end_with_parent() -> None:
    """Exit when the other end of stdin closes; the guardians of the workers end these."""
    while sys.stdin.read(4096):
        pass
    os._exit(1)


if __name__ == "__main__":
    main()
