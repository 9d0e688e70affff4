"""Box2D 3.1 through pyb2d3; `adapters.engine_folder` describes the modules.

shipped        Box2D's own defaults
profiles       settings and their reasons
translation    materials of pairs from one value per body
ball_on_plane  a ball's motion in substeps, for laws
simulation     one world
drawing        contacts, from the engine's debug drawing
engine         the adapter
"""

from adapters.box2d3.engine import Box2D3Engine

__all__ = ["Box2D3Engine"]
