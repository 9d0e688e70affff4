"""Runs cells in worker processes: an abort, a hang or a leak costs that one cell.

    parent --(slot)--> worker: execute() with its output in a log file --(observation)--> parent
       ^ a worker that dies, hangs or runs out of memory becomes a row with the signal and the log's last lines

Pebble replaces a dead worker and loses only the cell it was running. Workers are spawned (no inherited state), ask
the kernel to die with their parent, and have a memory limit.
"""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import signal
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, TimeoutError, wait
from dataclasses import replace
from pathlib import Path
from typing import Any

from pebble import ProcessExpired, ProcessPool

from validation.cells import Observation, Outcome, Slot, observation_from_dict, prepare, slot_from_dict

#: Seconds after which a cell counts as hanging: the slowest healthy one needs seconds, plus a cold compilation.
TIMEOUT = 300.0
#: Address space of a worker [bytes]; all engines together reserve about 3 GiB.
MEMORY = 8 * 2**30
_PR_SET_PDEATHSIG = 1  # <linux/prctl.h>
LOG_LINES = 5


def _start_worker(parent: int, memory: int) -> None:
    if sys.platform == "linux":
        import resource

        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if os.getppid() != parent:  # it died before we asked
        os._exit(1)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's business


def _work(slot: dict[str, Any], log: str, keep: str | None) -> dict[str, Any]:
    from validation.execution import execute

    with Path(log).open("wb") as stream:
        sys.stdout.flush()
        sys.stderr.flush()
        saved = os.dup(1), os.dup(2)
        os.dup2(stream.fileno(), 1)
        os.dup2(stream.fileno(), 2)
        try:
            return execute(slot_from_dict(slot), Path(keep) if keep else None).as_dict()
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os.dup2(saved[0], 1)
            os.dup2(saved[1], 2)
            os.close(saved[0])
            os.close(saved[1])


def run_cells(
    slots: Sequence[Slot],
    jobs: int = 1,
    timeout: float = TIMEOUT,
    memory: int = MEMORY,
    keep: Callable[[Slot], Path | None] = lambda slot: None,
) -> Iterator[Observation]:
    """Yield an observation per slot, in the order in which they finish.

    Parameters
    ----------
    jobs
        Worker processes.
    timeout, memory
        Limits per cell [s] and per worker [bytes].
    keep
        Path for the trajectory of a slot, or None.
    """
    context = multiprocessing.get_context("spawn")
    with tempfile.TemporaryDirectory(prefix="crosscheck-") as logs:
        pool = ProcessPool(jobs, initializer=_start_worker, initargs=(os.getpid(), memory), context=context)
        waiting = list(reversed(slots))
        running: dict[Future[Any], tuple[Slot, Path]] = {}
        try:
            while waiting or running:
                while waiting and len(running) < 2 * jobs:  # one ahead, so that no worker idles
                    slot = waiting.pop()
                    log, path = Path(logs, slot.key()), keep(slot)
                    args = [slot.as_dict(), str(log), str(path) if path else None]
                    running[pool.schedule(_work, args=args, timeout=timeout)] = (slot, log)
                for future in wait(list(running), return_when=FIRST_COMPLETED).done:
                    slot, log = running.pop(future)
                    yield _collect(future, slot, log, timeout)
                    log.unlink(missing_ok=True)
            pool.close()
        finally:
            pool.stop()
            pool.join()


def _collect(future: Future[Any], slot: Slot, log: Path, timeout: float) -> Observation:
    try:
        observation = observation_from_dict(future.result())
        return replace(observation, log=_tail(log)) if observation.outcome is Outcome.CRASHED else observation
    except TimeoutError:
        return _lost(slot, Outcome.TIMED_OUT, f"no answer after {timeout:g} s", log)
    except ProcessExpired as error:
        return _lost(slot, Outcome.CRASHED, _cause(error.exitcode), log)
    except Exception as error:
        return _lost(slot, Outcome.CRASHED, f"{type(error).__name__}: {error}".splitlines()[0], log)


def _cause(code: int | None) -> str:
    if code is not None and code < 0:
        return f"the process was killed by {signal.Signals(-code).name}"
    return f"the process ended with exit code {code}"


def _lost(slot: Slot, outcome: Outcome, reason: str, log: Path) -> Observation:
    prepared = prepare(slot)
    cell = prepared.cell
    return Observation(slot, cell.key(), prepared.scene.version, cell.engine_version, outcome, reason, log=_tail(log))


def _tail(log: Path) -> str:
    try:
        return "\n".join(log.read_text(errors="replace").splitlines()[-LOG_LINES:])
    except OSError:
        return ""
