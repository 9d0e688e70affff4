"""MuJoCo (`mujoco-core` or `mujoco`, >= 4.0.1); what stands where is told in `adapters.engine_folder`.

shipped        numbers of MuJoCo itself, and the releases that were looked at
profiles       settings with their reasons
pairs          what a setting means for a pair of materials
spec           a scene as MuJoCo's own model
simulation     one model and its data
engine         the adapter
releases       what older releases do differently, and how that is handled
contact_law    one contact, as a scalar recurrence; box_on_face, blows and motions build on it
"""

from adapters.mujoco.engine import MujocoEngine

__all__ = ["MujocoEngine"]
