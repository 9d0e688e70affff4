"""Rapier through its Python bindings; what stands where is told in `adapters.engine_folder`.

profiles       settings with their reasons
simulation     one world
engine         the adapter
laws           what it does by design
"""

from adapters.rapier.engine import RapierEngine

__all__ = ["RapierEngine"]
