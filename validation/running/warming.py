"""Makes engines that compile at their first steps do so before any clock or time limit starts.

Kernels are kept on disk by their engine (`adapters.engine.Engine.kernels`). One small cell per scene and profile of a
plan is run and thrown away, dimension by dimension in processes of their own, so that nothing is compiled twice. A
mark beside the kernels says what was compiled: the next run of the same sources waits for nothing.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import multiprocessing
import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

from adapters.engine import Engine
from adapters.registry import find
from validation.cells import Slot

#: What a first compilation takes where no earlier one has left its time: CPU [s], twice that of the longer one of two
#: parts (ours in space, 111 s on a machine of 2 cores that had nothing else to do).
FIRST = 225.0


class Warming:
    """What is left to compile for a plan.

    Parameters
    ----------
    slots
        Cells that are going to run.
    """

    def __init__(self, slots: Sequence[Slot]) -> None:
        self._tasks: list[tuple[list[dict[str, object]], Path]] = []
        for (name, _), group in _groups(slots).items():
            engine = find(name).engine
            folder = engine.kernels() if isinstance(engine, Engine) else None
            if folder is not None:
                wanted = [slot.as_dict() for slot in group.values()]
                mark = folder / f"warm-{hashlib.sha256(repr(sorted(group)).encode()).hexdigest()[:12]}.json"
                if not mark.is_file():
                    self._tasks.append((wanted, mark))

    def __len__(self) -> int:
        """Number of parts, an engine and a dimension each."""
        return len(self._tasks)

    def estimate(self, jobs: int) -> float:
        """Expected time on idle cores [s]: the longest of earlier compilations here and the one on another machine.

        CPU time, which a busy machine hardly changes. Earlier ones may have found their kernels ready, and took less
        than the next will.
        """
        known = [_seconds(path) for _, mark in self._tasks for path in mark.parent.parent.glob("*/warm-*.json")]
        each = max([*known, FIRST / 2.0])
        return each * -(-len(self._tasks) // max(1, min(jobs, len(self._tasks))))

    def run(self, jobs: int) -> Iterator[str]:
        """Compile; yields the name of each part that is done. What fails here fails again, and is told, as a cell."""
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(max(1, min(jobs, len(self._tasks))), context) as pool:
            running = {pool.submit(_compile, slots): (slots, mark) for slots, mark in self._tasks}
            for future in as_completed(running):
                slots, mark = running[future]
                with contextlib.suppress(BrokenProcessPool, Exception):
                    seconds = future.result()
                    mark.write_text(json.dumps({"cpu_seconds": round(seconds, 1)}), encoding="utf-8")
                yield f"{slots[0]['engine']} {slots[0]['dimension']}-D"


def _groups(slots: Sequence[Slot]) -> dict[tuple[str, int], dict[tuple[str, str], Slot]]:
    """First cell of every profile and scene, by engine and dimension: what shares kernels stays together."""
    found: dict[tuple[str, int], dict[tuple[str, str], Slot]] = defaultdict(dict)
    for slot in slots:
        found[slot.engine, slot.dimension].setdefault((slot.profile, slot.scene), slot)
    return found


def _compile(slots: Sequence[dict[str, object]]) -> float:
    """Run cells for what they leave in the cache; return the CPU time that took [s]."""
    from validation.cells import slot_from_dict
    from validation.running.execution import execute

    started = time.process_time()
    for slot in slots:
        execute(slot_from_dict(slot))
    return time.process_time() - started


def _seconds(mark: Path) -> float:
    try:
        return float(json.loads(mark.read_text(encoding="utf-8"))["cpu_seconds"])
    except (OSError, ValueError, KeyError, TypeError):
        return 0.0
