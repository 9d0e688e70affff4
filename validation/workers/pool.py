"""The parent's side: assigns cells to workers, with time limits, and collects results."""

from __future__ import annotations

import base64
import json
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence, Set
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing.connection import wait
from pathlib import Path

from adapters import registry
from adapters.foreign import said_by
from adapters.isolation import Child, Lost, Mistaken
from validation import posed
from validation.cells import Observation, Outcome, Slot, observation_from_dict, prepare
from validation.running.tracks import Recording, recording_from_bytes
from validation.workers import limits
from validation.workers.process import READY, serve

#: Seconds after which a cell counts as hanging: the slowest healthy one needs seconds, plus a cold compilation.
TIMEOUT = 300.0
#: Time limit [s] for the start of a worker: it imports our packages, perhaps on a busy machine with a cold disk.
START = 120.0
#: Time-outs of one engine on one scene after which its other cells there are left out, as they would hang too.
MOST_TIMEOUTS = 3


class Unwritten(OSError):
    """A requested trajectory could not be written."""


@dataclass
class _Seat:
    """A slot of the pool for one worker; the worker changes with the engine."""

    child: Child | None = None
    engine: str = ""
    slot: Slot | None = None
    until: float = 0.0

    def free(self) -> None:
        """End the worker, and everything it started."""
        if self.child is not None:
            self.child.stop()
        self.child, self.engine, self.slot = None, "", None


def run_cells(
    slots: Sequence[Slot],
    jobs: int = 1,
    timeout: float = TIMEOUT,
    memory: int | None = None,
    keep: Callable[[Slot], Path | None] = lambda slot: None,
    shown: Set[Slot] = frozenset(),
    record: Callable[[Slot, Recording], None] = lambda slot, recording: None,
    leave: Callable[[Slot, str], None] = lambda slot, reason: None,
) -> Iterator[Observation]:
    """Yield an observation per slot, in the order in which they finish.

    A cell whose worker answers for another one runs again in a new process, once.

    An error while cells run is raised after all running cells have ended, so that no result is lost except of cells
    whose trajectory or recording could not be stored. Later errors are not reported.

    Parameters
    ----------
    jobs
        Worker processes; fewer where the machine's memory is too small.
    timeout, memory
        Limits per cell [s] and per worker [bytes]; None: from `validation.workers.limits`.
    keep
        Path for the trajectory of a slot, or None.
    shown, record
        Slots whose motion is recorded, and a function called with each recording before its observation is yielded.
    leave
        Called with the reason for every slot that is left out after three time-outs of its engine on its scene.

    Raises
    ------
    LimitError
        If the machine allows too little memory, or no worker can be started.
    IsolationError
        If no process can be started.
    Unwritten
        If a requested trajectory cannot be written.
    """
    if not slots:
        return
    jobs = limits.workers(jobs, len(slots))
    memory = limits.memory(jobs) if memory is None else memory
    texts = posed.texts_of(slot.scene for slot in slots)
    waiting: dict[str, deque[Slot]] = {}
    for wanted in slots:
        waiting.setdefault(wanted.engine, deque()).append(wanted)
    timeouts: Counter[tuple[str, str]] = Counter()
    repeated: set[Slot] = set()
    seats = [_Seat() for _ in range(jobs)]
    try:
        yield from _never_started(waiting)

        failure: Exception | None = None  # no new cell is started; raised after the running ones have ended

        def ask(seat: _Seat, choose: Callable[[], Slot | None]) -> None:
            nonlocal failure
            try:
                slot = choose()
                if slot is not None:
                    _ask(seat, slot, texts, timeout, keep(slot), slot in shown)
            except Exception as error:  # no worker can be started, or the caller cannot store results
                failure = failure or error

        while True:
            for seat in seats:
                if seat.slot is None and failure is None:
                    ask(seat, partial(_next, seat, seats, waiting, timeouts, leave, memory))
            busy = [seat for seat in seats if seat.slot is not None]
            if not busy:
                if failure is not None:
                    raise failure
                return
            for seat in _ready(busy):
                slot = seat.slot
                assert slot is not None
                try:
                    observation, recording = _collect(seat, slot, timeout)
                except Unwritten as error:
                    failure = failure or error
                    continue
                except Mistaken as mistaken:
                    if slot not in repeated:
                        repeated.add(slot)
                        waiting.setdefault(slot.engine, deque()).appendleft(slot)
                        continue
                    observation, recording = _lost(slot, Outcome.CRASHED, str(mistaken), ""), None
                if observation.outcome is Outcome.TIMED_OUT:
                    timeouts[slot.engine, slot.scene] += 1
                # Before the result is used, so that a worker does not wait while it is stored. No worker is started
                # meanwhile, which takes seconds.
                if seat.child is not None and failure is None:
                    ask(seat, partial(_first, waiting.get(seat.engine, deque()), timeouts, leave))
                if recording is not None:
                    try:
                        record(slot, recording)
                    except Exception as error:  # as if it had not run: it runs again when the run is resumed
                        failure = failure or error
                        continue
                yield observation
    finally:
        for seat in seats:
            seat.free()


def _never_started(waiting: dict[str, deque[Slot]]) -> Iterator[Observation]:
    """Cells of plugins that end or hang the process that imports them."""
    for engine in list(waiting):
        found = registry.find(engine)
        if found.fatal:
            for slot in waiting.pop(engine):
                yield _lost(slot, Outcome.CRASHED, found.reason, "")


def _next(
    seat: _Seat,
    seats: Sequence[_Seat],
    waiting: dict[str, deque[Slot]],
    timeouts: Counter[tuple[str, str]],
    leave: Callable[[Slot, str], None],
    memory: int,
) -> Slot | None:
    """Next cell of a free seat: of its engine while there are any, else of the one with the most cells left.

    The seat has a worker for it then.
    """
    slot = None
    while slot is None:
        for engine in [engine for engine, queue in waiting.items() if not queue]:
            del waiting[engine]
        if not waiting:
            seat.free()
            return None
        engine = seat.engine
        if engine not in waiting:
            served = Counter(other.engine for other in seats)
            engine = max(waiting, key=lambda name: len(waiting[name]) / (1 + served[name]))
        slot = _first(waiting[engine], timeouts, leave)
    if seat.engine != engine or seat.child is None:
        seat.free()
        seat.child, seat.engine = _started(memory), engine
    return slot


def _first(queue: deque[Slot], timeouts: Counter[tuple[str, str]], leave: Callable[[Slot, str], None]) -> Slot | None:
    """Take the first cell that should run; those before it are left out."""
    while queue:
        slot = queue.popleft()
        if timeouts[slot.engine, slot.scene] < MOST_TIMEOUTS:
            return slot
        leave(slot, f"{slot.engine} has timed out {MOST_TIMEOUTS} times on {slot.scene}")
    return None


def _started(memory: int) -> Child:
    """Start a worker; a failure to start is not an engine's fault.

    Raises
    ------
    LimitError
        With its last output.
    """
    child = Child(serve, memory)
    try:
        if child.receive(START) == READY:
            child.written = b""
            return child
        raise Lost("it did not become ready")
    except Lost as lost:
        child.stop()
        said = child.tail().rpartition("\n")[2]
        raise limits.LimitError(f"worker: cannot start: {lost}" + (f": {said}" if said else "")) from None


def _ask(seat: _Seat, slot: Slot, texts: dict[str, str], timeout: float, keep: Path | None, record: bool) -> None:
    job = {
        "slot": slot.as_dict(),
        "scenes": {name: text for name, text in texts.items() if name == slot.scene},
        "stated": posed.handed([slot.scene]),
        "keep": str(keep) if keep else None,
        "record": record,
        "installed": registry.find(slot.engine).engine is not None,
    }
    assert seat.child is not None
    seat.child.written = b""
    seat.child.send(json.dumps(job).encode())
    seat.slot, seat.until = slot, time.monotonic() + timeout


def _ready(busy: Sequence[_Seat]) -> list[_Seat]:
    """Seats whose worker has answered, ended, or run out of time; waits until there is one."""
    while True:
        ready = [seat for seat in busy if seat.child is not None and seat.child.has_answer()]
        ready += [seat for seat in busy if seat not in ready and time.monotonic() > seat.until]
        if ready:
            return ready
        left = max(0.0, min(seat.until for seat in busy) - time.monotonic())
        watched = [item for seat in busy if seat.child is not None for item in seat.child.sentinels]
        wait(watched, left)
        for seat in busy:
            if seat.child is not None and seat.child.ended():
                return [seat]


def _collect(seat: _Seat, slot: Slot, timeout: float) -> tuple[Observation, Recording | None]:
    child = seat.child
    assert child is not None
    seat.slot = None
    try:
        if not child.has_answer() and not child.ended():
            child.stop()
            seat.child = None
            return _lost(slot, Outcome.TIMED_OUT, f"no answer after {timeout:g} s", child.tail()), None
        answer = json.loads(child.receive(5.0))  # it has arrived, or the child has ended
        if answer["unwritten"]:
            raise Unwritten(*answer["unwritten"])
        observation = observation_from_dict(answer["observation"])
        if observation.slot != slot:
            raise Mistaken("its process answered for another case")
        recording = recording_from_bytes(base64.b64decode(answer["recording"])) if answer["recording"] else None
        changed = answer["changed"]
    except Lost as lost:
        seat.child = None
        child.stop()
        if isinstance(lost, Mistaken):
            raise
        return _lost(slot, Outcome.CRASHED, str(lost), child.tail()), None
    except Unwritten:
        raise
    except Exception as error:  # an engine that changes our modules can break even the answer
        child.stop()
        seat.child = None
        return _lost(slot, Outcome.CRASHED, f"its answer cannot be read: {said_by(error)}", child.tail()), None
    log = child.tail()
    if changed:  # the next cell gets a new process
        seat.free()
    if observation.outcome is not Outcome.CRASHED:
        return observation, recording
    if not observation.cell:
        observation = _lost(slot, observation.outcome, observation.reason, "")
    return replace(observation, log=log), recording


def _lost(slot: Slot, outcome: Outcome, reason: str, log: str) -> Observation:
    """Observation of a cell without a result; for a broken plugin even the cell may be unknown."""
    try:
        prepared = prepare(slot)
        key, scene_version, version = prepared.cell.key(), prepared.scene.version, prepared.cell.engine_version
    except Exception:
        key, scene_version, version = "", 0, registry.find(slot.engine).version
    return Observation(slot, key, scene_version, version, outcome, reason, log=log)
