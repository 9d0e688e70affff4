"""Kernels carry all code they call, and nothing that only kernels call can be called from Python."""

import numpy as np
import pytest

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
