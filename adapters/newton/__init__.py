"""Newton's XPBD solver on the CPU, through Warp; what stands where is told in `adapters.engine_folder`.

shipped        numbers of the engine
profiles       settings with their reasons
simulation     one world
engine         the adapter
"""

from adapters.newton.engine import NewtonEngine

__all__ = ["NewtonEngine"]
