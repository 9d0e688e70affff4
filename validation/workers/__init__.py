"""Runs cells in worker processes: an abort, a hang or a leak affects only its cell.

    parent (pool.py) --(slot)--> worker (process.py): execute(), then: has the process changed (running/state.py)?
       ^ observation, recording; or how the worker ended, with the last of what it wrote

A worker runs one engine. It is a separate session, so processes that an engine starts end with it; its memory limit
follows from the machine and the number of workers (limits.py); it ends with its parent. After each cell the state
shared between cells is compared, and a process that an engine has changed is replaced.
"""

from validation.workers.limits import LimitError
from validation.workers.pool import TIMEOUT, run_cells

__all__ = ["TIMEOUT", "LimitError", "run_cells"]
