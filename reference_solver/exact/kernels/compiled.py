"""The decorators of the kernels of this package."""

from collections.abc import Callable
from typing import Any, TypeVar

from reference_solver.compilation import cache_folder, compiled

F = TypeVar("F", bound=Callable[..., object])

FOLDER = cache_folder("exact/kernels")
OPTIONS: Any = {"cache": True, "error_model": "numpy", "no_cfunc_wrapper": True}


def kernel(function: F) -> F:
    """Compile a function when it is first called; machine code is kept where a folder can be written."""
    return compiled(function, FOLDER, **OPTIONS)


def inner_kernel(function: F) -> F:
    """Compile a function that only kernels call: Python has no access to it."""
    return compiled(function, FOLDER, no_cpython_wrapper=True, **OPTIONS)
