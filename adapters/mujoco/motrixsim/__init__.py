"""MotrixSim through its Python package; `adapters.engine_folder` describes the modules.

shipped     what a model of MJCF gets
profiles    settings and their reasons
simulation  one world, whose model `adapters.mujoco` writes
engine      the adapter
"""

from adapters.mujoco.motrixsim.engine import MotrixSimEngine

__all__ = ["MotrixSimEngine"]
