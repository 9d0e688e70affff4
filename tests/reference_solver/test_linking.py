"""Kernels carry all code they call, and nothing that only kernels call can be called from Python."""

import gc
from types import SimpleNamespace

import numpy as np
import pytest

from reference_solver.compilation import KERNEL, config, inner_kernel, kernel, njit
from reference_solver.structures import KNOWN

pytestmark = pytest.mark.skipif(bool(config.DISABLE_JIT) or not KNOWN, reason="nothing is linked")


@inner_kernel
def leaf(x):
    return x + 1.0


@inner_kernel
def with_a_call_that_is_optimised_away(x):
    y = 0.0
    if y > 1.0:
        y = leaf(x)
    return x + y


@inner_kernel
def branch(x):
    return 2.0 * leaf(x)


@inner_kernel
def bough(x):
    return branch(x) + 3.0


@kernel
def trunk(x):
    return with_a_call_that_is_optimised_away(x) + bough(x)


def test_linking_of_a_function_asked_for_late():
    """A linker takes only what was asked for before: callers must come first, however deep they stand."""
    assert trunk(1.0) == 1.0 + 2.0 * 2.0 + 3.0


def test_what_only_kernels_call_refuses_python():
    trunk(1.0)
    with pytest.raises(TypeError):
        leaf(1.0)


def test_loops_are_neither_unrolled_nor_vectorised():
    """What kernels loop over is short."""

    @njit(**KERNEL)  # not kept on disk: code that was kept cannot be read
    def total(x):
        found = 0.0
        for k in range(len(x)):
            found += x[k]
        return found

    assert total(np.ones(5)) == 5.0
    (code,) = total.inspect_llvm().values()
    assert code.count(" fadd ") == 1 and " fadd double " in code


def test_garbage_collector_after_a_compilation():
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


def test_names_of_passes_left_out():
    """A release that calls them otherwise would run them again, and nobody would see it."""
    from numba.core import compiler

    from reference_solver.linking import NOT_NEEDED

    state = SimpleNamespace(func_ir=None, flags=compiler.Flags())
    known = {step.__name__ for step, _ in compiler.DefaultPassBuilder.define_nopython_pipeline(state).passes}
    assert known >= NOT_NEEDED
