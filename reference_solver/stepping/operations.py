"""What the step asks of a dimension, by name.

A kernel that calls one of these functions is compiled once for each dimension: the callee is chosen by the type of the
first argument, the dimension's ``Bodies``, while numba infers types. Callees are compiled as part of their caller, so
that the caller's machine code is found on disk again by the next process. Uncompiled, a table does the same.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba.extending import overload

from reference_solver.compilation import INNER_OPTIONS, config
from reference_solver.linking import Carried


def operation(function: Callable[..., Any]) -> Any:
    """Make a function of the step out of the documented, empty ``function``; dimensions `provide` what it does."""
    table: dict[type, Any] = {}
    if config.DISABLE_JIT:

        def chosen(first: Any, *others: Any) -> Any:
            return table[type(first)](first, *others)

        chosen.__doc__ = function.__doc__
        chosen.table = table  # type: ignore[attr-defined]
        return chosen

    options: Any = INNER_OPTIONS | {"pipeline_class": Carried}

    @overload(function, jit_options=options, strict=False)
    def pick(first: Any, *others: Any) -> Any:
        found = table.get(getattr(first, "instance_class", type(None)))
        return None if found is None else found.py_func

    function.table = table  # type: ignore[attr-defined]
    return function


def provide(name: Any, bodies: type, kernel: Any) -> None:
    """Let the operation ``name`` be ``kernel`` where the first argument is a ``bodies``."""
    name.table[bodies] = kernel
