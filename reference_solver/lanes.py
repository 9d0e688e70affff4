"""A number of kernels that is several: one for each of `LANES` manifolds that are solved side by side.

It is a vector of the processor. Kernels calculate with it as with a float, so that one source serves both. Each lane
holds, to the bit, what the same operations give for its float.

numba's low-level extension interface (types, data models, lowering) makes it known to kernels.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from inspect import Parameter, Signature
from itertools import product
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.imputils import impl_ret_borrowed
from numba.core.typeconv import Conversion
from numba.extending import (
    intrinsic,
    lower_builtin,
    lower_cast,
    models,
    register_model,
    type_callable,
)
from numpy.typing import NDArray

#: Numbers side by side: eight doubles fill a register of AVX-512, two of AVX2.
LANES = 8


def room(*shape: int) -> NDArray[np.float64]:
    """Zeros of a shape whose last axis are lanes, where each vector is in one line of the cache (64 bytes)."""
    size = math.prod(shape)
    memory = np.zeros(size + 8)
    first = -memory.ctypes.data % 64 // 8
    return memory[first : first + size].reshape(shape)


class LanesType(types.Type):
    """One float for each lane."""

    def __init__(self) -> None:
        super().__init__(f"lanes{LANES}")

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        """Return how a float becomes lanes: all are the same."""
        return Conversion.safe if isinstance(other, types.Float) else None

    def unify(self, typingctx: Any, other: Any) -> Any:
        """A variable that is a float here and lanes there is lanes."""
        return self if isinstance(other, types.Float) else None


LANE, FLOAT = LanesType(), types.float64
DOUBLES = ir.VectorType(ir.DoubleType(), LANES)


@register_model(LanesType)
class LanesModel(models.PrimitiveModel):
    """A vector of doubles."""

    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, DOUBLES)


def splat(builder: Any, value: Any) -> Any:
    """Return a vector of one number."""
    first = builder.insert_element(ir.Constant(DOUBLES, ir.Undefined), value, ir.IntType(32)(0))
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    return builder.shuffle_vector(first, ir.Constant(DOUBLES, ir.Undefined), zeros)


@lower_cast(types.Float, LanesType)
def from_float(context: Any, builder: Any, source: Any, target: Any, value: Any) -> Any:
    """A float is the same in all lanes."""
    return splat(builder, context.cast(builder, value, source, FLOAT))


def of_lanes(function: Any, count: int, write: Callable[..., Any]) -> None:
    """Let kernels call ``function`` with ``count`` lanes, some of which may be floats; ``write``: its instructions."""

    @type_callable(function)
    def typed(context: Any) -> Any:
        def typer(*given: Any) -> Any:
            fits = all(each == LANE or isinstance(each, types.Float) for each in given)
            return LANE if len(given) == count and LANE in given and fits else None

        named = [Parameter(f"value{k}", Parameter.POSITIONAL_ONLY) for k in range(count)]
        typer.pysig = Signature(named)  # type: ignore[attr-defined]
        return typer

    def lowered(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        told = zip(values, sig.args, strict=True)
        return write(builder, *(context.cast(builder, value, kind, LANE) for value, kind in told))

    for chosen in product((LANE, FLOAT), repeat=count):
        if LANE in chosen:
            lower_builtin(function, *chosen)(lowered)


def better(comparison: str) -> Callable[..., Any]:
    """Write `max` (``>``) or `min` (``<``) as of floats: the second number only where it is better."""

    def write(builder: Any, one: Any, other: Any) -> Any:
        return builder.select(builder.fcmp_ordered(comparison, other, one), other, one)

    return write


for operation in (operator.add, operator.iadd):
    of_lanes(operation, 2, lambda builder, one, other: builder.fadd(one, other))
for operation in (operator.sub, operator.isub):
    of_lanes(operation, 2, lambda builder, one, other: builder.fsub(one, other))
of_lanes(operator.mul, 2, lambda builder, one, other: builder.fmul(one, other))
of_lanes(operator.neg, 1, lambda builder, one: builder.fneg(one))
of_lanes(max, 2, better(">"))
of_lanes(min, 2, better("<"))


def _seen_in_lanes(typingctx: Any, array: Any) -> Any:
    """An array of floats, the last axis of which are lanes, as an array of `Lanes` with one axis less."""
    seen = types.Array(LANE, array.ndim - 1, array.layout, aligned=False)

    def write(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        given = context.make_array(sig.args[0])(context, builder, values[0])
        made = context.make_array(seen)(context, builder)
        made.meminfo, made.parent = given.meminfo, given.parent
        made.nitems = builder.udiv(given.nitems, given.nitems.type(LANES))
        made.itemsize = given.itemsize.type(8 * LANES)
        made.data = builder.bitcast(given.data, made.data.type)
        for name in ("shape", "strides"):
            setattr(made, name, cgutils.pack_array(builder, cgutils.unpack_tuple(builder, getattr(given, name))[:-1]))
        return impl_ret_borrowed(context, builder, seen, made._getvalue())

    return seen(array), write


lanes: Any = intrinsic(_seen_in_lanes)


def _transposed(builder: Any, rows: list[Any]) -> list[Any]:
    """Vectors of rows as vectors of columns, of as many rows as lanes."""
    step = 1
    while step < LANES:
        for i in (i for i in range(LANES) if not i & step):
            one, other = rows[i], rows[i + step]
            for k, start in ((i, 0), (i + step, step)):
                picked = [(j & ~step) + start + (LANES if j & step else 0) for j in range(LANES)]
                mask = ir.Constant(ir.VectorType(ir.IntType(32), LANES), picked)
                rows[k] = builder.shuffle_vector(one, other, mask)
        step *= 2
    return rows


def _row(builder: Any, array: Any, index: Any) -> Any:
    """Address of the first numbers of ``array[index]``, as that of a vector."""
    stride = cgutils.unpack_tuple(builder, array.strides)[0]
    place = builder.bitcast(array.data, ir.IntType(8).as_pointer())
    return builder.bitcast(builder.gep(place, [builder.mul(stride, index)]), DOUBLES.as_pointer())


def _moved(into: bool) -> Any:
    """Intrinsic that moves rows of an array into lanes, or out of them: (from, which rows, to)."""

    def move(typingctx: Any, source: Any, index: Any, target: Any) -> Any:
        def write(context: Any, builder: Any, sig: Any, values: Any) -> Any:
            given, which, wanted = (
                context.make_array(kind)(context, builder, value) for kind, value in zip(sig.args, values, strict=True)
            )
            vectors, rows = (wanted, given) if into else (given, wanted)
            places = [builder.load(builder.gep(which.data, [ir.IntType(64)(k)])) for k in range(LANES)]
            outside = [_row(builder, rows, place) for place in places]
            inside = [builder.gep(vectors.data, [ir.IntType(64)(k)]) for k in range(LANES)]
            start, end = (outside, inside) if into else (inside, outside)
            moved = _transposed(builder, [builder.load(place, align=8) for place in start])
            for place, value in zip(end, moved, strict=True):
                builder.store(value, place, align=8)
            return context.get_dummy_value()

        return types.none(source, index, target), write

    return intrinsic(move)


#: ``into_lanes(array, rows, columns)``: lane l of ``columns[k]`` is ``array[rows[l], k]``, for the first `LANES` k.
into_lanes: Any = _moved(into=True)
#: ``from_lanes(columns, rows, array)``: the inverse.
from_lanes: Any = _moved(into=False)
