"""Rapier through its Python bindings; `adapters.engine_folder` describes the modules.

profiles       settings and their reasons
simulation     one world
engine         the adapter
laws           designed deviations
"""

from adapters.rapier.engine import RapierEngine

__all__ = ["RapierEngine"]
