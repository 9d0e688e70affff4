"""Kernels carry all code they call, and nothing that only kernels call can be called from Python."""

import gc

import pytest

from reference_solver.compilation import config, inner_kernel, kernel

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
