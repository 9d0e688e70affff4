"""PhysX 5 through SAPIEN's Python bindings; what stands where is told in `adapters.engine_folder`.

shipped        numbers of the engine
profiles       settings with their reasons
translation    poses of half-spaces, and of what turns
simulation     one world
engine         the adapter
laws           what it does by design
"""

from adapters.physx.engine import PhysxEngine

__all__ = ["PhysxEngine"]
