"""Planar bodies: three degrees of freedom, contacts of one or two points."""

from reference_solver.planar import located  # provides what a located step asks of the plane
from reference_solver.planar.world import World

__all__ = ["World", "located"]
