"""Chipmunk (Munk2D) through pymunk; what stands where is told in `adapters.engine_folder`.

shipped        numbers of Chipmunk itself, and the releases that were looked at
profiles       settings with their reasons
translation    a scene in Chipmunk's terms
start          touching bodies, and the overlap they start with
simulation     one space
engine         the adapter
"""

from adapters.chipmunk.engine import ChipmunkEngine

__all__ = ["ChipmunkEngine"]
