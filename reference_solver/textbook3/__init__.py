"""The textbook in space: six degrees of freedom, contacts of one to eight points."""

from reference_solver.textbook3.world import World

__all__ = ["World"]
