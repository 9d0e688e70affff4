"""Box3D through robox3d; `adapters.engine_folder` describes the modules.

shipped     Box3D's own defaults
profiles    settings and their reasons
simulation  one world
engine      the adapter
"""

from adapters.box3d.engine import Box3DEngine

__all__ = ["Box3DEngine"]
