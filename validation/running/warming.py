"""Compiles engines that compile at their first steps, before any clock or time limit starts.

Engines store their kernels on disk (`adapters.engine.Engine.kernels`). One small cell per scene and profile of a plan
makes its first steps and is discarded, in one process per dimension, so that nothing is compiled twice. A mark beside
the kernels lists what was compiled, so the next run of the same sources does not wait.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import multiprocessing
import os
import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from pathlib import Path
from typing import Any

from adapters.engine import Engine
from adapters.isolation import end_with
from adapters.registry import find
from adapters.stepping import run
from adapters.trajectory import Sampling
from validation.cells import Slot, prepare, settings_of, slot_from_dict

#: Steps of each cell. A kernel is compiled at its first call with everything that it calls; two more steps are for data
#: that an engine keeps from the step before.
STEPS = 3

#: Time of a first compilation where none is on record: CPU [s], twice that of the longer of two parts (ours in 3-D, 76
#: s on an idle machine with 2 cores).
FIRST = 152.0


class Warming:
    """The kernels that a plan still needs.

    Parameters
    ----------
    slots
        Cells of the plan.
    """

    def __init__(self, slots: Sequence[Slot]) -> None:
        self._tasks: list[tuple[list[dict[str, object]], Path]] = []
        for (name, dimension), group in _groups(slots).items():
            engine = find(name).engine
            folder = engine.kernels() if isinstance(engine, Engine) else None
            if folder is not None:
                wanted = [slot.as_dict() for slot in group.values()]
                of = repr((dimension, sorted(group))).encode()
                mark = folder / f"warm-{hashlib.sha256(of).hexdigest()[:12]}.json"
                if not mark.is_file():
                    self._tasks.append((wanted, mark))

    @property
    def begun(self) -> bool:
        """Whether all parts have been compiled for other cells: only kernels that those did not call are missing."""
        return all(any(_dimension(path) == wanted[0]["dimension"] for path in mark.parent.glob("warm-*.json"))
                   for wanted, mark in self._tasks)  # fmt: skip

    def __len__(self) -> int:
        """Number of parts, an engine and a dimension each."""
        return len(self._tasks)

    def estimate(self, jobs: int) -> float:
        """Expected time on idle cores [s]: the longest of earlier compilations here and the one on another machine.

        CPU time, which a busy machine hardly changes. Earlier compilations may have found kernels in the cache.
        """
        known = [_seconds(path) for _, mark in self._tasks for path in mark.parent.parent.glob("*/warm-*.json")]
        each = max([*known, FIRST / 2.0])
        return each * -(-len(self._tasks) // max(1, min(jobs, len(self._tasks))))

    def run(self, jobs: int) -> Iterator[str]:
        """Compile; yields the name of each finished part. A failure here is reported later by its cell."""
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(max(1, min(jobs, len(self._tasks))), context, end_with, (os.getpid(),)) as pool:
            running = {pool.submit(_compile, slots): (slots, mark) for slots, mark in self._tasks}
            for future in as_completed(running):
                slots, mark = running[future]
                with contextlib.suppress(BrokenProcessPool, Exception):
                    seconds = future.result()
                    mark.write_text(
                        json.dumps({"cpu_seconds": round(seconds, 1), "dimension": slots[0]["dimension"]}),
                        encoding="utf-8",
                    )
                yield f"{slots[0]['engine']} {slots[0]['dimension']}-D"


def _groups(slots: Sequence[Slot]) -> dict[tuple[str, int], dict[tuple[str, str], Slot]]:
    """First cell of every profile and scene, by engine and dimension, which share kernels."""
    found: dict[tuple[str, int], dict[tuple[str, str], Slot]] = defaultdict(dict)
    for slot in slots:
        found[slot.engine, slot.dimension].setdefault((slot.profile, slot.scene), slot)
    return found


def _compile(slots: Sequence[dict[str, object]]) -> float:
    """Make first steps to fill the cache; return the CPU time [s]."""
    started = time.process_time()
    for slot in slots:
        with contextlib.suppress(Exception):  # the cell itself reports the error
            first_steps(slot_from_dict(slot))
    return time.process_time() - started


def first_steps(slot: Slot) -> None:
    """Run the first `STEPS` steps of a cell and read its contacts: the engine compiles everything there.

    Raises
    ------
    SceneError, EngineError
        If the slot is wrong or the engine refuses it.
    """
    prepared, engine = prepare(slot), find(slot.engine).engine
    if isinstance(engine, Engine):
        values = {setting.name: setting.value for setting in settings_of(engine, slot, prepared.scene)}
        run(engine, replace(prepared.scene, duration=STEPS * slot.dt), slot.dt, values, Sampling(contacts_from=0.0))


def _seconds(mark: Path) -> float:
    try:
        return float(_told(mark)["cpu_seconds"])
    except (ValueError, KeyError, TypeError):
        return 0.0


def _dimension(mark: Path) -> object:
    return _told(mark).get("dimension")


def _told(mark: Path) -> dict[str, Any]:
    """Content of a mark; empty where it cannot be read."""
    try:
        return dict(json.loads(mark.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return {}
