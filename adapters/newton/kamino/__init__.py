"""Newton's Kamino solvers on the CPU: rigid contact by ADMM (PADMM) or by sweeps (DVI)."""

from adapters.newton.kamino.engine import KaminoEngine

__all__ = ["KaminoEngine"]
