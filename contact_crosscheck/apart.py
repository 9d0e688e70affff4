"""Start worker processes from a script without running the script again."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType


@contextmanager
def apart() -> Iterator[None]:
    """Let processes start without importing the running script.

    ``multiprocessing`` starts a process by importing the caller's main module, so a script without
    ``if __name__ == "__main__":`` would run a second time. Our workers need nothing from that module. Inside this
    context an empty module replaces it.
    """
    caller = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = caller
