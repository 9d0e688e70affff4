"""The parent's side: assigns cells to workers, with time limits, and collects results.

Kernels that cells need are compiled by the same workers first (`validation.running.warming`), outside the cells' time
limits. One worker runs other cells meanwhile, as long as there are any.
"""

from __future__ import annotations

import base64
import json
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing.connection import wait
from pathlib import Path
from typing import Any

from adapters import registry, stages
from adapters.isolation import Child, Lost, Mistaken
from adapters.isolation.foreign import said_by
from adapters.stages import stage
from validation import posed
from validation.cells import ALONE, Observation, Outcome, Slot, observation_from_dict, prepare
from validation.running import warming
from validation.running.tracks import Recording, recording_from_bytes
from validation.workers import limits
from validation.workers.process import READY, serve

#: Seconds after which a cell counts as hanging: the slowest healthy one needs seconds.
TIMEOUT = 300.0
#: Time limit of a compilation [s]: twenty times what our slowest part took on a busy machine with 2 cores.
COMPILING = 3600.0
#: Time limit [s] for the start of a worker: it imports our packages, perhaps on a busy machine with a cold disk.
START = 120.0
#: Time-outs of one engine on one scene after which its other cells there are left out, as they would hang too.
MOST_TIMEOUTS = 3


class Unwritten(OSError):
    """A requested trajectory could not be written."""


@dataclass
class _Seat:
    """A slot of the pool for one worker; the worker changes with the engine.

    ``started``: when it was, by the monotonic clock [s], if it is to measure its stages. ``cells``: how many it ran.
    """

    child: Child | None = None
    engine: str = ""
    started: float | None = None
    cells: int = 0
    work: Slot | warming.Part | None = None
    until: float = 0.0

    def free(self) -> None:
        """End the worker, and everything it started."""
        if self.child is not None:
            self.child.stop()
        self.child, self.engine, self.work = None, "", None


class _Waiting:
    """Cells that have not run, those of them that wait for kernels, and the kernels."""

    def __init__(
        self, slots: Sequence[Slot], parts: Sequence[warming.Part], leave: Callable[[Slot, str], None]
    ) -> None:
        self._leave = leave
        self._timeouts: Counter[tuple[str, str]] = Counter()
        self._repeated: dict[Slot, str] = {}
        self._parts = [*parts]
        self._held: dict[warming.Key, list[Slot]] = {part.key: [] for part in parts}
        self._ready: dict[str, deque[Slot]] = {}
        for slot in slots:
            held = self._held.get(warming.key_of(slot))
            (self._ready.setdefault(slot.engine, deque()) if held is None else held).append(slot)

    def never_started(self) -> Iterator[Observation]:
        """Cells of plugins that end or hang the process that imports them."""
        for engine in list(self._ready):
            found = registry.find(engine)
            if found.fatal:
                for slot in self._ready.pop(engine):
                    yield _lost(slot, Outcome.CRASHED, found.reason, "")

    def next(self, seat: _Seat, seats: Sequence[_Seat]) -> Slot | warming.Part | None:
        """Take the next work of a free seat: kernels, as long as another seat is left for cells that can run.

        Parts of one profile share kernels, which both compile if they are made side by side: another profile's part
        goes first, and only a seat with nothing else to do takes the same profile's. Else a cell of its engine while
        there are any, then of the engine with the most cells left.
        """
        compiling = [other.work.key[:2] for other in seats if isinstance(other.work, warming.Part)]
        while True:
            self._ready = {engine: queue for engine, queue in self._ready.items() if queue}
            apart = (part for part in self._parts if part.key[:2] not in compiling)
            part = next(apart, self._parts[0] if self._parts and not self._ready else None)
            if part and (not self._ready or len(compiling) < len(seats) - 1):
                self._parts.remove(part)
                return part
            if not self._ready:
                return None
            engine = seat.engine
            if engine not in self._ready:
                served = Counter(other.engine for other in seats)
                engine = max(self._ready, key=lambda name: len(self._ready[name]) / (1 + served[name]))
            slot = self.first(engine)
            if slot is not None:
                return slot

    def first(self, engine: str) -> Slot | None:
        """Take the first cell of an engine that should run; those before it are left out."""
        queue = self._ready.get(engine, deque())
        while queue:
            slot = queue.popleft()
            if self._timeouts[slot.engine, slot.scene] < MOST_TIMEOUTS:
                return slot
            self._leave(slot, f"{slot.engine} has timed out {MOST_TIMEOUTS} times on {slot.scene}")
        return None

    def timed_out(self, slot: Slot) -> None:
        """Count a time-out."""
        self._timeouts[slot.engine, slot.scene] += 1

    def again(self, slot: Slot, why: str) -> bool:
        """Let a cell run once more, next of its engine; False if it has."""
        if slot in self._repeated:
            return False
        self._repeated[slot] = why
        self._ready.setdefault(slot.engine, deque()).appendleft(slot)
        return True

    def told(self, observation: Observation) -> Observation:
        """With what happened before, where a cell that was repeated runs alone."""
        why = self._repeated.get(observation.slot)
        if why is None or observation.outcome in (Outcome.CRASHED, Outcome.TIMED_OUT):
            return observation
        return replace(observation, reason="; ".join(filter(None, (observation.reason, f"{why}; {ALONE}"))))

    def compiled(self, part: warming.Part) -> bool:
        """Let the cells start that waited for these kernels; whether others are left to compile.

        Where they could not be compiled, the cells report why.
        """
        self._ready.setdefault(part.key[0], deque()).extend(self._held.pop(part.key))
        return bool(self._parts)


def run_cells(
    slots: Sequence[Slot],
    jobs: int = 1,
    timeout: float = TIMEOUT,
    memory: int | None = None,
    keep: Callable[[Slot], Path | None] = lambda slot: None,
    shown: Set[Slot] = frozenset(),
    record: Callable[[Slot, Recording], None] = lambda slot, recording: None,
    leave: Callable[[Slot, str], None] = lambda slot, reason: None,
    parts: Sequence[warming.Part] | None = None,
    compiled: Callable[[warming.Part], None] = lambda part: None,
) -> Iterator[Observation]:
    """Yield an observation per slot, in the order in which they finish.

    A cell whose worker answers for another one runs again in a new process, once; so does one that ends a worker which
    has run others, as they may be the cause; its observation tells both.

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
    parts
        Kernels to compile, in this order; None: those that the slots need and that are missing.
    compiled
        Called with each part when it is done, before a cell that needs it starts.

    Raises
    ------
    LimitError
        If the machine allows too little memory, or no worker can be started.
    IsolationError
        If no process can be started.
    Unwritten
        If a requested trajectory cannot be written.
    """
    parts = warming.missing(slots) if parts is None else parts
    if not slots and not parts:
        return
    jobs = limits.workers(jobs, len(slots) + len(parts))
    memory = limits.memory(jobs) if memory is None else memory
    waiting = _Waiting(slots, parts, leave)
    seats = [_Seat() for _ in range(jobs)]
    try:
        yield from waiting.never_started()

        failure: Exception | None = None  # no new cell is started; raised after the running ones have ended

        def ask(seat: _Seat, choose: Callable[[], Slot | warming.Part | None]) -> None:
            nonlocal failure
            try:
                work = choose()
                if work is None:
                    return
                if isinstance(work, warming.Part):
                    _engage(seat, work.key[0], memory)
                    _send(seat, work, {"compile": [slot.as_dict() for slot in work.slots]}, work.slots, COMPILING)
                else:
                    _engage(seat, work.engine, memory)
                    _send(seat, work, _job(work, keep(work), work in shown), [work], timeout)
            except Exception as error:  # no worker can be started, or the caller cannot store results
                failure = failure or error

        while True:
            for seat in seats:
                if seat.work is None and failure is None:
                    ask(seat, partial(waiting.next, seat, seats))
                    if seat.work is None:
                        seat.free()
            busy = [seat for seat in seats if seat.work is not None]
            if not busy:
                if failure is not None:
                    raise failure
                return
            for seat in _ready(busy):
                work = seat.work
                assert work is not None
                if isinstance(work, warming.Part):
                    if _compiled(seat):
                        work.keep()
                    compiled(work)
                    if not waiting.compiled(work):
                        seat.free()  # compiling leaves up to .95 GB in use, a cell needs a quarter of that
                    continue
                others, seat.cells = seat.cells, seat.cells + 1
                try:
                    observation, recording = _collect(seat, work, timeout)
                except Unwritten as error:
                    failure = failure or error
                    continue
                except Mistaken as mistaken:
                    if waiting.again(work, str(mistaken)):
                        continue
                    observation, recording = _lost(work, Outcome.CRASHED, str(mistaken), ""), None
                # A process that has run others may end because of what they left in it.
                why = f"in a process that had run others ({others}): {observation.reason}"
                ended = observation.outcome is Outcome.CRASHED and seat.child is None
                if ended and others and waiting.again(work, why):
                    continue
                observation = waiting.told(observation)
                if observation.outcome is Outcome.TIMED_OUT:
                    waiting.timed_out(work)
                # Before the result is used, so that a worker does not wait while it is stored. No worker is started
                # meanwhile, which takes seconds.
                if seat.child is not None and failure is None:
                    ask(seat, partial(waiting.first, seat.engine))
                if recording is not None:
                    try:
                        record(work, recording)
                    except Exception as error:  # as if it had not run: it runs again when the run is resumed
                        failure = failure or error
                        continue
                yield observation
    finally:
        for seat in seats:
            seat.free()


def _engage(seat: _Seat, engine: str, memory: int) -> None:
    """Give a seat a worker for an engine, if it has none."""
    if seat.engine != engine or seat.child is None:
        seat.free()
        seat.started = time.monotonic() if stages.is_on() else None
        seat.child, seat.engine, seat.cells = _started(memory), engine, 0


@stage("starting processes")
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


def _job(slot: Slot, keep: Path | None, record: bool) -> dict[str, Any]:
    return {
        "slot": slot.as_dict(),
        "keep": str(keep) if keep else None,
        "record": record,
        "installed": registry.find(slot.engine).engine is not None,
    }


def _send(
    seat: _Seat, work: Slot | warming.Part, job: Mapping[str, Any], slots: Sequence[Slot], timeout: float
) -> None:
    """Send a job with the scene files of its slots."""
    scenes = [slot.scene for slot in slots]
    told = {**job, "scenes": posed.texts_of(scenes), "stated": posed.handed(scenes), "started": seat.started}
    assert seat.child is not None
    seat.child.written = b""
    seat.child.send(json.dumps(told).encode())
    seat.work, seat.until = work, time.monotonic() + timeout


@stage("waiting for processes")
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


@stage("reading answers")
def _collect(seat: _Seat, slot: Slot, timeout: float) -> tuple[Observation, Recording | None]:
    child = seat.child
    assert child is not None
    seat.work = None
    try:
        if not child.has_answer() and not child.ended():
            child.stop()
            seat.child = None
            return _lost(slot, Outcome.TIMED_OUT, f"no answer after {timeout:g} s", child.tail()), None
        answer = json.loads(child.receive(5.0))  # it has arrived, or the child has ended
        if answer["unwritten"]:
            raise Unwritten(*answer["unwritten"])
        stages.add(answer["stages"])
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


def _compiled(seat: _Seat) -> bool:
    """Whether a seat has compiled its kernels; its worker is renewed if it ended or hangs."""
    assert seat.child is not None
    seat.work = None
    try:
        answer = json.loads(seat.child.receive(0.0))
        stages.add(answer["stages"])
        return bool(answer["compiled"])
    except Exception:
        seat.free()
        return False


def _lost(slot: Slot, outcome: Outcome, reason: str, log: str) -> Observation:
    """Observation of a cell without a result; for a broken plugin even the cell may be unknown."""
    try:
        prepared = prepare(slot)
        key, scene_version, version = prepared.cell.key(), prepared.scene.version, prepared.cell.engine_version
    except Exception:
        key, scene_version, version = "", 0, registry.find(slot.engine).version
    return Observation(slot, key, scene_version, version, outcome, reason, log=log)
