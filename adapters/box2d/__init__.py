"""Box2D 2.3 through its Python bindings; what stands where is told in `adapters.engine_folder`.

shipped        numbers of Box2D itself, most of them fixed when it was compiled
profiles       settings with their reasons
simulation     one world
listening      contacts, as they can be heard while a step is made
engine         the adapter
"""

from adapters.box2d.engine import Box2DEngine

__all__ = ["Box2DEngine"]
