"""Newton's VBD solver on the CPU: contacts are springs, solved body by body."""

from adapters.newton.vbd.engine import VbdEngine

__all__ = ["VbdEngine"]
