"""PhysX 5 through SAPIEN's Python bindings; `adapters.engine_folder` describes the modules.

shipped        default values of the engine
profiles       settings and their reasons
translation    poses of half-spaces, and of turning bodies
simulation     one world
engine         the adapter
laws           designed deviations
"""

from adapters.physx.engine import PhysxEngine

__all__ = ["PhysxEngine"]
