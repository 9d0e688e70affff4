"""Number of workers and their memory, from the machine and its settings."""

from __future__ import annotations

import os
import sys
from pathlib import Path

GIB = 2**30
#: Address space that is enough for every engine [bytes]: the compiler reserves most, .65 GiB for the planar kernels.
NEEDED = 2 * GIB
#: Largest address space of a worker [bytes]: a leak is stopped before the machine swaps.
PLENTY = 8 * GIB
#: Largest memory in use by a worker [bytes]: the compiler's.
RESIDENT = GIB
#: Most useful number of workers per core.
PER_CORE = 4


class LimitError(RuntimeError):
    """The machine's limits are too small; one line."""


def cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0)) or 1
    return os.cpu_count() or 1


def workers(asked: int, cells: int) -> int:
    """Number of workers for ``cells`` cells when a user wants ``asked`` (0: one per core)."""
    most = max(1, min(PER_CORE * cores(), installed_memory() // RESIDENT))
    return max(1, min(asked or cores(), cells, most))


def memory(count: int) -> int:
    """Address space of each of ``count`` workers [bytes].

    Raises
    ------
    LimitError
        If a child process cannot have the memory that an engine needs.
    """
    hard = _hard_limit()
    if hard is not None and hard < NEEDED:
        allowed = f"{hard / GIB:.2g} GiB of address space (ulimit -v)"
        raise LimitError(f"memory: this shell allows {allowed}, a worker needs {NEEDED / GIB:g} GiB")
    wanted = min(PLENTY, max(NEEDED, installed_memory() // count))
    return wanted if hard is None else min(wanted, hard)


def installed_memory() -> int:
    """Memory that this process and its children may use together [bytes]: the machine's, or the container's."""
    try:
        most = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return PLENTY
    for name in ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"):
        try:
            most = min(most, int(Path(name).read_text()))
        except (OSError, ValueError):  # no such control group, or "max"
            continue
    return most


def _hard_limit() -> int | None:
    if sys.platform == "win32":
        return None
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    limits = [limit for limit in (soft, hard) if limit != resource.RLIM_INFINITY]
    return min(limits, default=None)
