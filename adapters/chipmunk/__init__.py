"""Chipmunk (Munk2D) through pymunk; `adapters.engine_folder` describes the modules.

shipped        Chipmunk's own constants, and the reviewed releases
profiles       settings and their reasons
translation    a scene for Chipmunk
start          touching bodies, and their overlap at the start
simulation     one space
engine         the adapter
"""

from adapters.chipmunk.engine import ChipmunkEngine

__all__ = ["ChipmunkEngine"]
