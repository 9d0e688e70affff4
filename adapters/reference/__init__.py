"""Our own solver (`reference_solver`); `adapters.engine_folder` describes the modules.

profiles       settings and their reasons
simulation     a scene as the solver's model, and one simulation of it
engine         the adapter
"""

from adapters.reference.engine import ReferenceEngine

__all__ = ["ReferenceEngine"]
