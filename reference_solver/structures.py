"""Named tuples of arrays, as kernels see them: one pointer each.

numba passes a named tuple by value, each array of it as some nine numbers. The bodies, rows and rooms of a step are
hundreds of numbers then, taken apart by every caller and put together by whatever is called: most instructions did
nothing else, and compiled code moved them through the stack at every call. A class under `structure` is laid
out in memory once, where it is made, and is one pointer from there on; what it holds is read where it is asked for, and
what is a structure in it is a pointer into it. Nothing writes to it, as nothing writes to a tuple.

Memory is that of the function that makes a structure, one place for each expression that makes one: another turn of a
loop writes over what the turn before made, and what is returned is copied to who called. numba is told by its own means
of extension, of which data models and the convention of calls are not public: as `linking.py` this rests on the
releases that `TRIED` names. On any other, and with ``NUMBA_DISABLE_JIT=1``, a structure is a named tuple.

Here is what names a structure, and asks for no compiler: records and models are read without one. `structure_types.py`
tells numba.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from typing import Any, TypeVar

T = TypeVar("T", bound=type[tuple[Any, ...]])


#: Releases of numba of whose inner workings `linking.py` and `structure_types.py` know: each was tried.
TRIED = ("0.68.1",)


def _known() -> bool:
    try:
        return version("numba") in TRIED
    except PackageNotFoundError:
        return False


#: Whether numba is one of those; otherwise kernels are compiled by what it offers to all.
KNOWN = _known()


class Kind(type):
    """The class of classes that are structures: by it numba tells them from other named tuples."""


#: All structures there are, and who is told of the next one: `structure_types.py`, once it is imported.
DECLARED: list[Any] = []
LISTENERS: list[Callable[[Any], None]] = []


def structure(plain: T) -> T:
    """Have kernels pass a class of named tuples by one pointer."""
    if not KNOWN:
        return plain
    alike = {name: getattr(plain, name) for name in ("__module__", "__qualname__", "__doc__")}
    kind: Any = Kind(plain.__name__, (plain,), {"__slots__": ()} | alike)
    DECLARED.append(kind)
    for listener in LISTENERS:
        listener(kind)
    found: T = kind
    return found
