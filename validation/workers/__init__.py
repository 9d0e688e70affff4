"""Runs cells in worker processes: an abort, a hang or a leak costs that one cell, of that one engine.

    parent (pool.py) --(slot)--> worker (process.py): execute(), then: is the process still what it was (state.py)?
       ^ observation, recording; or how the worker ended, with the last of what it wrote

A worker serves one engine. It is a session of its own, so that what an engine starts ends with it; it has a limit of
memory that follows from the machine and the number of workers (limits.py); it dies with its parent. After each cell
the state that cells share is compared, and a process that an engine has changed is replaced.
"""

from validation.workers.limits import LimitError
from validation.workers.pool import TIMEOUT, run_cells

__all__ = ["TIMEOUT", "LimitError", "run_cells"]
