"""Kernels that only kernels call, made callable for tests."""

import numba

from reference_solver.compilation import config
from reference_solver.linking import Whole


def from_python(inner):
    """Return a function that calls the inner kernel ``inner`` with what it is given."""
    if config.DISABLE_JIT:
        return inner

    def call(*arguments):
        return inner(*arguments)

    return numba.njit(call, pipeline_class=Whole, error_model="numpy")
