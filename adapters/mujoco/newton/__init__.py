"""Newton's MuJoCo solver (`newton`, >= 1.8): a port of MuJoCo."""

from adapters.mujoco.newton.engine import NewtonMujocoEngine

__all__ = ["NewtonMujocoEngine"]
