"""Loops of laws as machine code, by the decorators of our solver's kernels; only what compiles something imports it."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel, kernel

__all__ = ["inner_kernel", "kernel"]
