"""The textbook in the plane: three degrees of freedom, contacts of one or two points."""

from reference_solver.textbook2.world import World

__all__ = ["World"]
