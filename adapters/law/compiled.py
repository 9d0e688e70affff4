"""Compiles loops of contact laws, with the decorators of our solver's kernels; imported only where needed."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel, kernel

__all__ = ["inner_kernel", "kernel"]
