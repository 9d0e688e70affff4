"""Runs a function in a separate process, for questions that a slot cannot express.

Cells run in the pool of `validation.workers`. Other runs of an engine (in another pose, recorded in full, timed) are
made here: an engine that aborts or hangs loses one answer, and the next call starts a new process; so does one that
changes what calls share (`validation.running.state`). What it starts ends with its process (`adapters.isolation`).
"""

from __future__ import annotations

import os
import pickle
from collections.abc import Callable
from multiprocessing.connection import Connection
from types import TracebackType
from typing import TypeVar, cast

from adapters.isolation import Child, Lost
from adapters.isolation.foreign import said_by
from adapters.registry import load_engines_here
from validation import posed
from validation.running import state

T = TypeVar("T")
#: Longest wait for one answer [s].
PATIENCE = 300.0
#: First byte of an answer: whether the call has changed what calls share.
UNCHANGED, CHANGED = b"0", b"1"


class Apart:
    """A process that runs one call at a time; use as a context, so that it ends.

    Parameters
    ----------
    patience
        Longest wait for an answer [s].
    """

    def __init__(self, patience: float = PATIENCE) -> None:
        self.patience = patience
        self._child: Child | None = None

    def __enter__(self) -> Apart:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.stop()

    def start(self) -> None:
        """Start a process, in place of the previous one; it gets the models that engines have read."""
        self.stop()
        self._child = Child(_serve)
        self.ask(posed.remember, posed.known_texts())

    def ask(self, question: Callable[..., T], *args: object, fresh: bool = False) -> T | str:
        """Result of ``question(*args)``, or why there is none; with ``fresh`` in a new process."""
        if fresh or self._child is None:
            self.start()
        try:
            if self._child is None:
                raise Lost("its process did not start")
            self._child.send(pickle.dumps((question, args)))
            told = self._child.receive(self.patience)
            if told[:1] == CHANGED:
                self.stop()
            return cast(T, pickle.loads(told[1:]))
        except Exception as error:  # what an engine has changed may break even the answer
            self.stop()
            return str(error) if isinstance(error, Lost) else said_by(error)

    def stop(self) -> None:
        """End the process."""
        if self._child is not None:
            self._child.stop()
            self._child = None


def _serve(connection: Connection) -> None:
    """Answer questions until the other end closes; output of engines is discarded."""
    load_engines_here()
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.dup2(null, 2)
    before = state.taken()
    while True:
        try:
            question, args = pickle.loads(connection.recv_bytes())
        except EOFError:
            return
        before = state.still(before)
        try:
            answer = pickle.dumps(question(*args))
        except Exception as error:
            answer = pickle.dumps(said_by(error))
        connection.send_bytes((CHANGED if state.changed(before) else UNCHANGED) + answer)
