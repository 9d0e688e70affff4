"""Kernels carry all code they call, and nothing that only kernels call can be called from Python."""

import gc
from types import SimpleNamespace

import numpy as np
import pytest
from numba.core import compiler

from reference_solver import linking
from reference_solver.compilation import config, inner_kernel, kernel, njit

pytestmark = pytest.mark.skipif(bool(config.DISABLE_JIT), reason="NUMBA_DISABLE_JIT: nothing is compiled")


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


def test_a_function_that_is_first_asked_for_late_is_linked():
    """A linker takes only what was asked for before: callers must come first, however deep they stand."""
    assert trunk(1.0) == 1.0 + 2.0 * 2.0 + 3.0


def test_what_only_kernels_call_refuses_python():
    trunk(1.0)
    with pytest.raises(TypeError):
        leaf(1.0)


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
    known = {step.__name__ for step, _ in linking.DefaultPassBuilder.define_nopython_pipeline(state).passes}
    assert known >= linking.NOT_NEEDED


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
    with pytest.raises(ZeroDivisionError), linking.flags_soon_compared():
        with linking.flags_soon_compared():
            assert compared() == plain
        assert compiler.Flags.__eq__ is not methods[0]
        raise ZeroDivisionError
    assert (compiler.Flags.__eq__, compiler.Flags.__hash__) == methods
    assert flags() == flags(nrt=False) and flags() != flags(nrt=True)


def test_loops_are_neither_unrolled_nor_vectorised():
    """What kernels loop over is short."""

    @njit(pipeline_class=linking.Whole)  # not kept on disk: code that was kept cannot be read
    def total(x):
        found = 0.0
        for k in range(len(x)):
            found += x[k]
        return found

    assert total(np.ones(5)) == 5.0
    (code,) = total.inspect_llvm().values()
    assert code.count(" fadd ") == 1 and " fadd double " in code
