"""MuJoCo (`mujoco-core` or `mujoco`, >= 4.0.1); `adapters.engine_folder` describes the files.

shipped        constants of MuJoCo, and the checked releases
profiles       settings with their reasons
pairs          meaning of settings for a pair of materials
spec           a scene as MuJoCo's own model
simulation     one model and its data
engine         the adapter
releases       differences of older releases, and their handling
contact_law    one contact, as a scalar recurrence; box_on_face, ball_on_face, blows and motions build on it
"""

from adapters.mujoco.engine import MujocoEngine

__all__ = ["MujocoEngine"]
