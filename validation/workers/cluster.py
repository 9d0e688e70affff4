"""Runs cells on a Dask cluster, in batches, each in a ``run-cell --batch`` process.

    plan -> batches of one engine --(Dask task)--> worker: run-cell --batch --(a line per cell)--> here -> store

A crash affects only its cell, as everywhere (`validation.workers`); Dask only distributes batches. Each observation
returns when its cell ends, as an event of its worker, so no finished cell is lost when a worker or the scheduler dies.
Unfinished cells of a lost batch are sent again, in halves, by this module and not by Dask; the journal has a line for
every batch that began, was lost or ended, so every repeated cell is recorded.
"""

from __future__ import annotations

import json
import re
import time
from collections import defaultdict, deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any
from uuid import uuid4

from adapters.engine import EngineError
from adapters.extras import install
from adapters.plain import one_line
from adapters.scene import SceneError
from validation import posed
from validation.cells import Observation, Outcome, Slot, observation_from_dict, prepare
from validation.workers.batch import run_batch
from validation.workers.limits import LimitError

ADDRESS = re.compile(r"local:(?P<count>[1-9]\d{0,3})|(?:tcp|tls)://[^\s/]+:\d{1,5}")
#: Batches per worker if all take equally long: fewer leave workers idle at the end, more start more processes.
PER_WORKER = 4
#: Fewest and most cells of a batch: a process takes a second or two of CPU to start, a cell some hundredths; and
#: unfinished cells of a lost worker run again.
LEAST, MOST = 25, 250
#: Times that a cell may be lost with its worker before it counts as the cause.
MOST_LOST = 3
#: Time limit [s] for a first worker, and for an answer of the scheduler.
PATIENCE, SILENCE = 60.0, 20.0


@dataclass
class _Batch:
    """Cells of one process, those without a result yet, and how often they were lost."""

    name: str
    slots: list[Slot]
    lost: int = 0
    begun: int = 0


def checked(address: str) -> str:
    """Return ``address`` if it is valid.

    Raises
    ------
    SceneError
        If it is neither ``local:N`` nor ``tcp://HOST:PORT``.
    EngineError
        If Dask is not installed.
    """
    if not ADDRESS.fullmatch(address):
        raise SceneError(f"cluster: {one_line(address, 80)!r} is neither local:N nor tcp://HOST:PORT")
    if find_spec("distributed") is None:
        raise EngineError(f"cluster: distributed is missing; {install('dask')}")
    return address


def run_cells_on(
    address: str,
    slots: Sequence[Slot],
    timeout: float,
    journal: Path,
    leave: Callable[[Slot, str], None] = lambda slot, reason: None,
) -> Iterator[Observation]:
    """Yield an observation per slot, in the order in which they finish.

    Parameters
    ----------
    address
        ``local:N`` for N processes here, or that of a scheduler.
    timeout
        Per cell [s].
    journal
        File to which a line of JSON is added for every batch that begins, is lost or ends.
    leave
        Called for every slot that is left out, with the reason.

    Raises
    ------
    LimitError
        If no worker appears, the scheduler ends, or a worker has other code or another engine.
    """
    checked(address)
    if not slots:
        return
    with ExitStack() as stack:
        client = stack.enter_context(_client(address, stack))
        stream = stack.enter_context(journal.open("a", encoding="utf-8"))
        yield from _Driver(client, stream, timeout, leave).run(slots)


def _client(address: str, stack: ExitStack) -> Any:
    import dask
    from distributed import Client, LocalCluster

    # A lost batch is sent again by this module: Dask would start all of it again, and count its worker's death against
    # it.
    stack.enter_context(dask.config.set({"distributed.scheduler.allowed-failures": 0,
                                         "distributed.scheduler.worker-saturation": 1.0}))  # fmt: skip
    local = ADDRESS.fullmatch(address)
    count = local["count"] if local else None
    try:
        if count is None:
            return Client(address, timeout=SILENCE, set_as_default=False)
        cluster = LocalCluster(n_workers=int(count), threads_per_worker=1, dashboard_address=None, silence_logs=50)
        return Client(stack.enter_context(cluster), set_as_default=False)
    except (OSError, TimeoutError, RuntimeError) as error:
        raise LimitError(f"cluster: {address} does not answer: {one_line(error)}") from None


class _Driver:
    """Sends batches to a cluster and collects results."""

    def __init__(self, client: Any, journal: Any, timeout: float, leave: Callable[[Slot, str], None]) -> None:
        self.client, self.journal, self.timeout, self.leave = client, journal, timeout, leave
        self.topic = f"crosscheck-{uuid4().hex}"
        self.events: SimpleQueue[tuple[str, Any]] = SimpleQueue()
        self.batches: dict[str, _Batch] = {}
        self.futures: dict[str, Any] = {}
        self.made = 0
        self.same: set[tuple[str, str]] = set()

    def run(self, slots: Sequence[Slot]) -> Iterator[Observation]:
        """Run until each slot has a result or is left out."""
        try:
            self.client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            raise LimitError(f"cluster: no worker came within {PATIENCE:g} s") from None
        self.client.subscribe_topic(self.topic, lambda event: self.events.put(("event", event[1])))
        workers = max(1, sum(self.client.nthreads().values()))
        for batch in _batches(slots, workers):
            self._submit(batch)
        silent = time.monotonic()
        while self.batches:
            try:
                kind, said = self.events.get(timeout=0.5)
            except Empty:
                silent = time.monotonic() if self.client.status == "running" else silent
                self._check(silent)
                continue
            if kind == "event":
                yield from self._heard(said)
            else:
                yield from self._ended(said)
        self.client.unsubscribe_topic(self.topic)

    def _submit(self, slots: list[Slot], lost: int = 0) -> None:
        self.made += 1
        batch = _Batch(f"{self.topic}-{self.made}", slots, lost)
        self.batches[batch.name] = batch
        texts = posed.texts_of(slot.scene for slot in slots)
        lines = [json.dumps({"scenes": texts}), *(json.dumps(slot.as_dict()) for slot in slots)]
        future = self.client.submit(
            run_batch, "\n".join(lines), self.timeout, self.topic, batch.name, key=batch.name, pure=False, retries=0
        )
        self.futures[batch.name] = future
        future.add_done_callback(lambda done, name=batch.name: self.events.put(("done", name)))

    def _check(self, silent: float) -> None:
        if self.client.status == "closed" or time.monotonic() - silent > SILENCE:
            raise LimitError("cluster: the scheduler is gone; finished cases are kept, the same command resumes")

    def _heard(self, said: dict[str, Any]) -> Iterator[Observation]:
        """A batch began, or one of its cells returned."""
        batch = self.batches.get(said.get("batch", ""))
        if batch is None:
            return
        if "begun" in said:
            batch.begun += 1
            self._note("begun" if batch.begun == 1 else "again", batch, worker=said["begun"])
        elif "line" in said:
            yield from self._line(batch, said["line"], str(said.get("worker", "")))

    def _line(self, batch: _Batch, line: str, worker: str) -> Iterator[Observation]:
        """Output of ``run-cell`` for one cell: its observation, or why it was left out."""
        try:
            data = json.loads(line)
            if "error" in data:
                return  # cells that were left out are missing at the end
            observation = observation_from_dict(data)
        except (ValueError, TypeError, KeyError):
            return  # half a line of a process that died
        if observation.slot in batch.slots:
            self._compare(observation, worker)
            batch.slots.remove(observation.slot)
            yield observation

    def _compare(self, observation: Observation, worker: str) -> None:
        """Check the first cell of each engine and worker: it must equal the cell on this machine."""
        key = (worker, observation.slot.engine)
        if key in self.same or not observation.cell:
            return
        here = prepare(observation.slot).cell
        if here.key() != observation.cell:
            said = f"{observation.slot.engine} {observation.engine_version} there, {here.engine_version} here"
            raise LimitError(f"cluster: {worker} has other code than this machine ({said}); its results would differ")
        self.same.add(key)

    def _ended(self, name: str) -> Iterator[Observation]:
        """A batch is over; its missing cells are sent again or left out."""
        batch, future = self.batches[name], self.futures.pop(name)
        if future.status == "cancelled":
            raise LimitError("cluster: the scheduler is gone; finished cases are kept, the same command resumes")
        told: dict[str, Any] | None = future.result() if future.status == "finished" else None
        if told is not None:
            for line in told["lines"]:  # cells whose events have not arrived yet
                yield from self._line(batch, line, told["worker"])
        del self.batches[name]
        future.release()
        if not batch.slots:
            self._note("ended", batch)
            return
        if told is not None and told["left"]:
            for slot in batch.slots:
                self.leave(slot, one_line(told["left"]))
            self._note("left", batch, reason=one_line(told["left"]))
            return
        reason = str(told["said"]) if told is not None else _why(future)
        self._note("lost", batch, reason=one_line(reason))
        if len(batch.slots) == 1 and batch.lost + 1 >= MOST_LOST:
            slot = batch.slots[0]
            yield Observation(
                slot, "", 0, "", Outcome.CRASHED, one_line(f"lost with its worker {MOST_LOST} times: {reason}")
            )
            return
        half = (len(batch.slots) + 1) // 2
        for part in (batch.slots[:half], batch.slots[half:]):
            if part:
                self._submit(part, batch.lost + 1 if len(batch.slots) == 1 else 0)

    def _note(self, event: str, batch: _Batch, **more: Any) -> None:
        keys = [slot.key() for slot in batch.slots]
        entry = {"time": round(time.time(), 3), "event": event, "batch": batch.name, **more, "cells": keys}
        self.journal.write(json.dumps(entry) + "\n")
        self.journal.flush()


def _why(future: Any) -> str:
    error = future.exception()
    return f"{type(error).__name__}: {one_line(error)}"


def _batches(slots: Sequence[Slot], workers: int) -> Iterator[list[Slot]]:
    """Batches of one engine each, alternating between engines."""
    size = max(LEAST, min(MOST, -(-len(slots) // (PER_WORKER * workers))))
    engines: dict[str, deque[Slot]] = defaultdict(deque)
    for slot in slots:
        engines[slot.engine].append(slot)
    while engines:
        for engine in list(engines):
            queue = engines[engine]
            yield [queue.popleft() for _ in range(min(size, len(queue)))]
            if not queue:
                del engines[engine]
