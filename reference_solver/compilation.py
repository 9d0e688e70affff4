"""The decorators of kernels, and the folders that keep their machine code.

numba's own cache key covers only the file a kernel stands in: after an edit elsewhere a caller would run stale
code. A folder is therefore named after a hash of *all* its sources and the versions of numba and Python. If no
folder is writable, kernels compile anew in every process: slower, never wrong, and an import never fails for it.
"""

from __future__ import annotations

import hashlib
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core import config as numba_config
from numba.core.caching import UserProvidedCacheLocator

from reference_solver.caches import base_folder

F = TypeVar("F", bound=Callable[..., object])

# numba's type hints know neither its configuration's attributes nor all options of njit.
config: Any = numba_config
njit: Any = numba.njit


#: What stands beside the solver and holds none of its kernels: an edit there compiles nothing anew.
WITHOUT_KERNELS = ("certificate", "geometry.py", "piles.py")
#: The same, and the loop over events, whose kernels call no others and have a folder of their own.
APART = (*WITHOUT_KERNELS, "exact")


def source_hash(place: str = "", without: Sequence[str] = APART) -> str:
    """Return 16 hex digits: a hash of the sources below ``place``, and of the versions of Python and numba."""
    root = Path(__file__).parent / place
    digest = hashlib.sha256(f"{sys.implementation.cache_tag} {numba.__version__}".encode())
    for path in sorted(root.rglob("*.py")):
        if path.relative_to(root).parts[0] in without:
            continue
        digest.update(path.relative_to(root).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cache_folder(place: str = "", without: Sequence[str] = APART) -> Path | None:
    """Return the folder for this state of the sources, created and proved writable; None if there is none.

    It is below ``NUMBA_CACHE_DIR`` where that is set.
    """
    try:
        folder = Path(config.CACHE_DIR or base_folder()) / f"kernels-{source_hash(place, without)}"
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except (OSError, RuntimeError):  # RuntimeError: no home directory can be determined
        return None


def cache_folders() -> tuple[Path, ...]:
    """Return the folders of the solver's and of the loop's kernels; the first is named after the sources of both.

    It is for marks that all are compiled.
    """
    found = cache_folder(without=WITHOUT_KERNELS), cache_folder(), cache_folder("exact/kernels")
    return tuple(folder for folder in found if folder is not None)


CACHE_FOLDER = cache_folder()


class PerModule(UserProvidedCacheLocator):
    """Keeps a kernel below its module's name: checkouts and installations of the same sources share machine code.

    numba keeps it below a hash of where the source lies. What decides here is what the source says, and the folder's
    name covers all of that.
    """

    def __init__(self, function: Callable[..., object], file: str) -> None:
        super().__init__(function, file)
        self._cache_path = str(Path(config.CACHE_DIR) / function.__module__)


#: Setting of numba that makes it use `PerModule`.
LOCATION = {"CACHE_LOCATOR_CLASSES": f"{PerModule.__module__}.{PerModule.__qualname__}"}

#: Options of numba for kernels. "numpy": no branch for divisions by zero, since validation excludes zero denominators.
#: "_nrt": arrays are not counted, which cost two thirds of the time; kernels allocate nothing. It is not documented.
KERNEL: Any = {"error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}
#: The same for functions that only kernels call: Python has no access to them.
INNER: Any = KERNEL | {"no_cpython_wrapper": True}


def compiled(function: F, folder: Path | None, *, cache: bool, **options: Any) -> F:
    """Compile a function; ``folder`` keeps its machine code."""
    told = {} if folder is None else {"CACHE_DIR": str(folder)} | LOCATION
    before = {name: getattr(config, name) for name in told}
    try:
        vars(config).update(told)
        result: F = njit(function, cache=cache and folder is not None, **options)
        return result
    finally:
        vars(config).update(before)


def kernel(function: F) -> F:
    """Compile a module-level function in double precision, IEEE order kept (no fastmath), cached on disk.

    With ``NUMBA_DISABLE_JIT=1`` the function stays plain Python. Kernels take flags as integer arguments, allocate
    nothing, and call other kernels as module globals: a closure over a compiled function would miss the cache in
    every run.
    """
    return compiled(function, CACHE_FOLDER, cache=True, **KERNEL)


def inner_kernel(function: F) -> F:
    """Compile like `kernel`, for functions that only kernels call.

    Without the wrapper that unpacks Python arguments they compile in two thirds of the time.
    """
    return compiled(function, CACHE_FOLDER, cache=False, **INNER)


def spliced_kernel(function: F) -> F:
    """Compile like `inner_kernel`, as part of each caller.

    numba passes a named tuple by value, each array of it as some nine numbers: a call of a function that is handed
    bodies and rows moves a hundred and fifty of them. Of functions that a step calls for each contact this cost up to
    half of its time.
    """
    return compiled(function, CACHE_FOLDER, cache=False, forceinline=True, **INNER)


def from_python(function: F) -> F:
    """Return a function that calls, from Python, what only kernels call; compiled at its first call, and not kept."""

    def call(*arguments: Any) -> Any:
        return function(*arguments)

    if not hasattr(function, "py_func"):  # not compiled: NUMBA_DISABLE_JIT
        return function
    compiled: F = njit(call, **KERNEL)
    return compiled
