"""Newton's semi-implicit solver on the CPU: contacts are explicit springs and dampers."""

from adapters.newton.semi_implicit.engine import SemiImplicitEngine

__all__ = ["SemiImplicitEngine"]
