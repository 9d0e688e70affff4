"""Processes that a script's call starts, without running the script again."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType


@contextmanager
def apart() -> Iterator[None]:
    """Let processes start that do not import the script which is running.

    ``multiprocessing`` starts a process by importing the caller's main module, so that a script without
    ``if __name__ == "__main__":`` would run a second time. What we start needs nothing of that module: meanwhile an
    empty one stands in its place.
    """
    caller = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = caller
