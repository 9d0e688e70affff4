"""State shared by all cells of a process, and detection of changes by a cell.

An engine may set the rounding mode, close streams, lower a limit, change the folder, install a signal handler or
replace a function of another module. Its own result stands; the next cell must not be affected.
"""

from __future__ import annotations

import ctypes
import gc
import locale
import os
import signal
import sys
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import ModuleType
from typing import Any

import numpy as np

from adapters.stages import stage

#: Modules whose functions and classes are watched besides ours: those used to measure and judge.
WATCHED = ("builtins", "math", "random", "time", "json", "os", "sys", "copy", "dataclasses", "numpy", "numpy.linalg")
OURS = ("adapters", "validation")
#: Files that may stay open beyond those before the first cell: engines keep caches and libraries open. A sixteenth of
#: the 1024 of a Linux process.
SPARE_FILES = 64
OPEN_FILES = "open files"
#: What a reader of `adapters.stages` calls a look at the process.
COMPARING = "looking at what cases share"


@dataclass(frozen=True)
class State:
    """A snapshot of the process: plain facts by name, and the objects behind names of watched modules and classes.

    ``sizes`` is the number of names in each of them, ``modules`` the number of modules.
    """

    facts: Mapping[str, Any]
    names: Mapping[str, tuple[Mapping[str, Any], dict[str, Any]]]
    sizes: Mapping[str, int]
    modules: int


@stage(COMPARING)
def taken() -> State:
    """Take a snapshot of this process."""
    facts = {name: look() for name, look in _FACTS.items()}  # first of all: a snapshot may import modules
    modules, names = len(sys.modules), _names()
    sizes = {place: len(now) for place, (now, _) in names.items()}
    return State(facts, names, sizes, modules)


@stage(COMPARING)
def still(before: State) -> State:
    """Snapshot to compare with the next cell, after one that changed nothing: the same, as a new one costs 3 ms.

    A new one if modules or names were added, as by the imports of a first cell. Open files are still counted from the
    first snapshot, because their sum is limited, whether one cell opened them or each a few. So a leak of one file a
    cell ends the process after `SPARE_FILES` cells, and so do libraries that slowly open as many. No cell is blamed:
    its result stands, and the next one gets a new process within a second or two.
    """
    come = len(sys.modules) != before.modules or any(
        len(now) != before.sizes[place] for place, (now, _) in before.names.items()
    )
    if not come:
        return before
    now = taken()
    return replace(now, facts={**now.facts, OPEN_FILES: before.facts[OPEN_FILES]})


@stage(COMPARING)
def changed(before: State) -> str:
    """Differences from ``before``, in a few words; empty if there are none."""
    found = [name for name, look in _FACTS.items() if not _same(name, before.facts[name], look())]
    if len(sys.modules) < before.modules:
        found.append("modules")
    for place, (now, then) in before.names.items():
        replaced = [name for name, value in then.items() if now.get(name) is not value]
        found += [f"{place}.{name}" for name in replaced[:3]]
    return ", ".join(found[:8])


def _same(name: str, before: Any, now: Any) -> bool:
    if name == OPEN_FILES:
        return bool(now <= before + SPARE_FILES)
    return bool(before == now)


def _rounding() -> tuple[Any, ...]:
    """Rounding, denormals and traps of both floating-point units, from arithmetic and from C."""
    one, tiny = np.array([1.0, -1.0]), np.array([2.2250738585072014e-308])
    part = np.array([1.7e-16])  # just beyond half of each spacing next to 1: no other rounding gives all four sums
    long = np.longdouble(1.0) + np.longdouble(1e-19)
    numbers = (*(one + part), *(one - part), float((tiny * 0.5)[0]) != 0.0, long)
    said = tuple(getattr(_C, name)() for name in ("fegetround", "fegetexcept") if hasattr(_C, name))
    return numbers + said + tuple(sorted(np.geterr().items()))


def _libm() -> Any:
    try:
        return ctypes.CDLL("libm.so.6" if sys.platform == "linux" else None)
    except (OSError, TypeError):
        return None


_C = _libm()


def _streams() -> tuple[Any, ...]:
    return (*(_file(number) for number in (0, 1, 2)), sys.stdin, sys.stdout, sys.stderr)


def _file(number: int) -> tuple[int, ...] | None:
    try:
        found = os.fstat(number)
    except OSError:
        return None
    return found.st_dev, found.st_ino, found.st_mode


def _open_files() -> int:
    try:
        return len(os.listdir("/proc/self/fd"))
    except OSError:
        return 0


def _limits() -> tuple[Any, ...]:
    if sys.platform == "win32":
        return ()
    import resource

    kinds = sorted(name for name in dir(resource) if name.startswith("RLIMIT_"))
    return tuple(resource.getrlimit(getattr(resource, name)) for name in kinds)


def _folder() -> str | None:
    try:
        return os.getcwd()
    except OSError:
        return None


def _mask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _handlers() -> tuple[Any, ...]:
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, ()) if hasattr(signal, "pthread_sigmask") else set()
    timers = signal.getitimer(signal.ITIMER_REAL)[1] if hasattr(signal, "getitimer") else 0.0
    return (*(signal.getsignal(number) for number in sorted(signal.valid_signals())), frozenset(blocked), timers)


def _interpreter() -> tuple[Any, ...]:
    return sys.getrecursionlimit(), gc.isenabled(), sys.gettrace(), sys.getprofile(), tuple(sys.path), sys.excepthook


def _locale() -> str:
    return locale.setlocale(locale.LC_ALL)


_FACTS: dict[str, Callable[[], Any]] = {
    "floating point": _rounding,
    "streams": _streams,
    OPEN_FILES: _open_files,
    "limits": _limits,
    "environment": lambda: dict(os.environ),
    "folder": _folder,
    "file mode mask": _mask,
    "signal handlers": _handlers,
    "interpreter": _interpreter,
    "locale": _locale,
    "threads": threading.active_count,  # one that goes on may change what later cells share
}


def _names() -> dict[str, tuple[Mapping[str, Any], dict[str, Any]]]:
    """Functions, classes and modules by place: present names and their objects."""
    found: dict[str, tuple[Mapping[str, Any], dict[str, Any]]] = {}
    for name, module in list(sys.modules.items()):
        if module is None or not (name in WATCHED or name.partition(".")[0] in OURS):
            continue
        found[name] = vars(module), _fixed(vars(module))
        for cls in vars(module).copy().values():
            if isinstance(cls, type) and getattr(cls, "__module__", "") == name and name not in WATCHED:
                found[f"{name}.{cls.__name__}"] = vars(cls), _fixed(vars(cls))
    return found


def _fixed(names: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in dict(names).items() if callable(value) or isinstance(value, ModuleType)}
