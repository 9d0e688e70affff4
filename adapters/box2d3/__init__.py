"""Box2D 3.1 through pyb2d3; what stands where is told in `adapters.engine_folder`.

shipped        numbers of Box2D itself
profiles       settings with their reasons
translation    materials of pairs as one number per body
ball_on_plane  a motion that the small steps make, for laws
simulation     one world
drawing        contacts, as the engine draws them
engine         the adapter
"""

from adapters.box2d3.engine import Box2D3Engine

__all__ = ["Box2D3Engine"]
