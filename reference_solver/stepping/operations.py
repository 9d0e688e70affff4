"""What the step asks of a dimension, by name.

A kernel that calls one of these functions is compiled once for each dimension: the callee is chosen by the type of the
first argument, the dimension's ``Bodies``, while numba infers types. Callees are compiled as part of their caller, so
that the caller's machine code is found on disk again by the next process. Uncompiled, a table does the same.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

from numba.extending import overload

from reference_solver.compilation import INNER_OPTIONS, config
from reference_solver.linking import Carried

#: The bodies of either dimension: what operations are chosen by.
Bodies: TypeAlias = Any


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


@operation
def is_free(bodies: Any, i: int) -> bool:
    """Whether forces move body i."""
    raise NotImplementedError


@operation
def hold(bodies: Any, rows: Any, lasting: Any, c: int, k: int) -> None:
    """Note the touching features of row c as contact k: bodies, friction, and features in body axes.

    Fills ``lasting.body[k]``, ``lasting.friction[k]``, ``lasting.kind[k]``, ``lasting.place[k]``; bodies stand at the
    start of the phase.
    """


@operation
def evaluate(bodies: Any, lasting: Any) -> None:
    """Follow the noted features of all contacts at the present poses and twists.

    Fills gap, frame, jacobian, response (rows of J M^-1), speed (u = J v) and gamma = (dJ/dt) v of every contact.
    """


@operation
def free_accelerations(bodies: Any, lasting: Any) -> None:
    """Fill ``lasting.free``: accelerations of all bodies without contacts, at the present poses and twists."""


@operation
def displace(bodies: Any, lasting: Any, i: int) -> None:
    """Put body i at ``lasting.base[i]`` moved by ``lasting.displacement[i]``."""


@operation
def displacement_rate(bodies: Any, lasting: Any, i: int, stage: int) -> None:
    """Fill ``lasting.rate[stage, i]`` from the displacement and ``bodies.twist[i]``."""


@operation
def displacement_curvature(bodies: Any, lasting: Any, i: int, end: int) -> None:
    """Fill ``lasting.bend[end, i]``, second derivative of the displacement, also from ``lasting.acceleration[i]``."""


@operation
def feature_limit(bodies: Any, lasting: Any, k: int) -> float:
    """Least distance of contact k from where its features end: positive within, infinite where they have no end [m]."""
    raise NotImplementedError
