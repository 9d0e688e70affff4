"""Newton's XPBD solver on the CPU, through Warp; `adapters.engine_folder` describes the modules.

shipped        default values of the engine
profiles       settings and their reasons
simulation     one world
engine         the adapter
"""

from adapters.newton.engine import NewtonEngine

__all__ = ["NewtonEngine"]
