"""Runs a function in a separate process, for questions that a slot cannot express.

Cells run in the pool of `validation.workers`. Other runs of an engine (in another pose, recorded in full) are made
here: an engine that aborts or hangs loses one answer, and the next call starts a new process.
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from types import TracebackType
from typing import Any, TypeVar

from adapters.registry import load_engines_here

T = TypeVar("T")
#: Longest wait for one answer [s].
PATIENCE = 300.0


class Apart:
    """A process that runs one call at a time; use as a context, so that it ends.

    Parameters
    ----------
    patience
        Longest wait for an answer [s].
    """

    def __init__(self, patience: float = PATIENCE) -> None:
        self.patience = patience
        self._pool: ProcessPoolExecutor | None = None

    def __enter__(self) -> Apart:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.stop()

    def ask(self, question: Callable[..., T], *args: Any, fresh: bool = False) -> T | str:
        """Result of ``question(*args)``, or why there is none; with ``fresh`` in a new process."""
        if fresh:
            self.stop()
        if self._pool is None:
            context = multiprocessing.get_context("spawn")
            self._pool = ProcessPoolExecutor(1, mp_context=context, initializer=load_engines_here)
        answer: Future[T] = self._pool.submit(question, *args)
        try:
            return answer.result(self.patience)
        except (BrokenProcessPool, TimeoutError) as error:
            self.stop()
            return f"no answer: {type(error).__name__}"

    def stop(self) -> None:
        """End the process."""
        if self._pool is not None:
            for process in list((self._pool._processes or {}).values()):
                process.kill()
            self._pool.shutdown(wait=False, cancel_futures=True)
            self._pool = None
