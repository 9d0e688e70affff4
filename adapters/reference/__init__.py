"""Our own solver (`reference_solver`); what stands where is told in `adapters.engine_folder`.

profiles       settings with their reasons
simulation     a scene as the solver's model, and one simulation of it
engine         the adapter
"""

from adapters.reference.engine import ReferenceEngine

__all__ = ["ReferenceEngine"]
