"""Spatial bodies: six degrees of freedom, contacts of one to eight points."""

from reference_solver.spatial import located  # provides what a located step asks of space
from reference_solver.spatial.world import World

__all__ = ["World", "located"]
