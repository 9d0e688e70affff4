"""Box2D 2.3 through its Python bindings; `adapters.engine_folder` describes the modules.

shipped        Box2D's own constants, most of them compiled in
profiles       settings and their reasons
simulation     one world
listening      contacts, from a listener within a step
engine         the adapter
"""

from adapters.box2d.engine import Box2DEngine

__all__ = ["Box2DEngine"]
