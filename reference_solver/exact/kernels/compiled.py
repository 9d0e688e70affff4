"""The decorator of the kernels of this package, and the folder that keeps their machine code.

numba keeps machine code by the file a kernel stands in. So that callers of a changed kernel are compiled anew as well,
the folder is named after a hash of that file and of those whose kernels it imports.
"""

from __future__ import annotations

import hashlib
import inspect
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba

from reference_solver.compilation import base_folder

F = TypeVar("F", bound=Callable[..., object])

# numba's type hints know neither its configuration's attributes nor all options of njit.
config: Any = numba.config
njit: Any = numba.njit


def source_hash(path: Path) -> str:
    """Return 16 hex digits: a hash of a file, of those that it imports from here, and of versions."""
    digest = hashlib.sha256(f"{sys.implementation.cache_tag} {numba.__version__}".encode())
    for each in sorted(_imported(path)):
        digest.update(each.name.encode() + each.read_bytes())
    return digest.hexdigest()[:16]


def _imported(path: Path) -> set[Path]:
    """Return a file and all files of this package that it imports, at first hand or not."""
    names = re.findall(rf"^from {re.escape(__package__)}\.(\w+) import", path.read_text(), re.MULTILINE)
    return {path}.union(*(_imported(path.with_name(f"{name}.py")) for name in names))


def _compiled(function: F, **options: bool) -> F:
    before = config.CACHE_DIR
    folder = base_folder() / f"exact-{source_hash(Path(inspect.getfile(function)))}"
    options |= {"no_cfunc_wrapper": True}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        config.CACHE_DIR = str(folder)
        result: F = njit(function, cache=True, error_model="numpy", **options)
    except OSError:
        result = njit(function, error_model="numpy", **options)
    finally:
        config.CACHE_DIR = before
    return result


def kernel(function: F) -> F:
    """Compile a function when it is first called; machine code is kept where a folder can be written."""
    return _compiled(function)


def inner_kernel(function: F) -> F:
    """Compile a function that only kernels call: Python has no access to it."""
    return _compiled(function, no_cpython_wrapper=True)
