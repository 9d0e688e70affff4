"""What numba is spared when kernels compile changes no machine code, and is given back."""

import gc
import math
import operator
import re
from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np
import pytest
from llvmlite.binding import ffi
from numba.core import compiler, inline_closurecall, types
from numba.core.compiler import DefaultPassBuilder
from numba.core.errors import TypingError
from numba.core.postproc import PostProcessor
from numba.core.registry import cpu_target
from numba.core.types.functions import BaseFunction

from reference_solver import compile_time, linking
from reference_solver.compilation import config, inner_kernel, kernel, njit, spliced_kernel
from reference_solver.compile_time import NOT_NEEDED, flags_soon_compared, scalars_typed_once, sparing

pytestmark = pytest.mark.skipif(bool(config.DISABLE_JIT), reason="NUMBA_DISABLE_JIT: nothing is compiled")


def made(monkeypatch, spared):
    """A kernel with loops, arrays, scalars of all kinds, calls carried and spliced: its value and its instructions."""

    @spliced_kernel
    def clamped(x, most):
        if x > most:
            return most
        return -most if x < -most else x

    @inner_kernel
    def summed(x, n):
        total, k = 0.0, 0
        while k < n:
            part = x[k] * 2
            if part > 1:
                total += clamped(part, 3.0) // 1
            k += 1
        return total

    def program(x, n, flag):
        found = clamped(summed(x, n), 5.0) + math.sqrt(abs(x[0])) + (n % 3) - (1 if flag and not n > 4 else 2.5)
        for k in range(n):
            found = max(found, clamped(x[k] ** 2, found + min(k, 7)))
        return found

    monkeypatch.setattr(linking, "sparing", spared)
    compiled = njit(program, pipeline_class=linking.Whole)
    value = compiled(np.array([0.25, -2.0, 9.0, 0.75]), 4, True)
    (code,) = compiled.inspect_asm().values()
    lines = [line.strip() for line in code.splitlines() if line.startswith("\t") and not line.startswith("\t.")]
    return value, [re.sub(r"_ZN\w+|NumbaEnv\S*|\.const\.\S*", "name", line) for line in lines]


def test_machine_code_is_the_same_with_and_without(monkeypatch):
    (value, spared), (same, plain) = made(monkeypatch, sparing), made(monkeypatch, nullcontext)
    # By hand: min(3 + 1, 5) + .5 + 1 - 1, then .0625, 4, and of 81 no more than what was found and 2.
    assert value == same == 4.5 + 2.0 and len(plain) > 100 and spared == plain


def test_scalars_have_the_types_that_they_have_without_us():
    kinds = [types.int64, types.intp, types.int32, types.uint8, types.float64, types.float32, types.boolean]
    kinds += [types.literal(3), types.literal(True)]
    context = cpu_target.typing_context
    context.refresh()

    def returned(function, *kinds):
        try:
            signature = context.resolve_function_type(context.resolve_value_type(function), kinds, {})
        except TypingError:
            return "refused"
        return signature.return_type, signature.args

    binary = [operator.add, operator.sub, operator.mul, operator.truediv, operator.floordiv, operator.mod, operator.lt]
    binary += [operator.and_, operator.eq, max, min, math.atan2]
    unary = [operator.neg, operator.not_, abs, math.sqrt, math.sin, math.floor]
    calls = [(f, one, other) for f in binary for one in kinds for other in kinds] + [
        (f, k) for f in unary for k in kinds
    ]
    plain = {call: returned(*call) for call in calls}
    assert len({found for found in plain.values() if found != "refused"}) > 50 and "refused" in plain.values()
    with scalars_typed_once():
        assert {call: returned(*call) for call in calls} == plain
        before = len(compile_time.typed)
        assert {call: returned(*call) for call in calls} == plain and len(compile_time.typed) == before
        # An array is not a scalar: nothing is kept of it.
        vector = types.Array(types.float64, 1, "C")
        assert returned(operator.add, vector, types.float64)[0].ndim == 1 and len(compile_time.typed) == before


def test_a_block_that_fails_leaves_numba_as_it_was():
    def state():
        return (
            (BaseFunction.get_call_type, PostProcessor.run, inline_closurecall.copy, list(ffi.lib._lock._cblist)),
            (compiler.Flags.__eq__, compiler.Flags.__hash__, gc.get_threshold()),
        )

    before = state()
    assert before[0][-1], "numba watches the lock when nothing compiles"
    with pytest.raises(ZeroDivisionError), sparing():
        inside = state()
        with sparing():
            pass
        assert state() == inside
        assert all(one != other for one, other in zip(before[0] + before[1], inside[0] + inside[1], strict=True))
        raise ZeroDivisionError
    assert state() == before


def test_a_kernel_that_compiles_leaves_the_garbage_collector_as_it_was():
    before = gc.get_threshold()

    @kernel
    def fresh(x):
        return x + 2.0

    assert fresh(1.0) == 3.0 and gc.get_threshold() == before
    try:
        gc.set_threshold(0)
        assert fresh(1) == 3.0 and gc.get_threshold() == (0, *before[1:])
        gc.set_threshold(5_000_000, 3, 4)
        assert fresh(True) == 3.0 and gc.get_threshold() == (5_000_000, 3, 4)
    finally:
        gc.set_threshold(*before)


def test_passes_that_are_left_out_are_passes_of_numba():
    """A release that calls them otherwise would run them again, and nobody would see it."""
    state = SimpleNamespace(func_ir=None, flags=compiler.Flags())
    known = {step.__name__ for step, _ in DefaultPassBuilder.define_nopython_pipeline(state).passes}
    assert known >= NOT_NEEDED


def test_flags_compare_as_they_do_without_us_and_are_left_as_they_were():
    def flags(**settings):
        made = compiler.Flags()
        for name, value in settings.items():
            setattr(made, name, value)
        return made

    some = [flags(), flags(nrt=True), flags(nrt=False), flags(nrt=True, boundscheck=True), flags(inline="always")]
    methods = compiler.Flags.__eq__, compiler.Flags.__hash__

    def compared():
        return [[(one == other, hash(one) == hash(other)) for other in [*some, 3]] for one in some]

    plain = compared()
    with pytest.raises(ZeroDivisionError), flags_soon_compared():
        with flags_soon_compared():
            assert compared() == plain
        assert compiler.Flags.__eq__ is not methods[0]
        raise ZeroDivisionError
    assert (compiler.Flags.__eq__, compiler.Flags.__hash__) == methods
    assert flags() == flags(nrt=False) and flags() != flags(nrt=True)
