"""The exact solver as a loop over events, one source for plane and space.

Between two events motion is smooth. So the world goes from event to event, and ``dt`` only says when to look:

    find      which features touch, and their rows             features, rows
    strike    what touches and approaches                      impacts, series
    decide    which contacts hold, stick and slip              problem, cones, forces
    move      to the next event: a contact ends, bodies meet   motion, meeting, events
    record    look at the piece wherever it is asked for       world

`loop` is these lines in Python. Nothing is ever put back. What the loop cannot tell it refuses in one sentence
(`refusals`). Arrays are shaped by the dimension and the number of spins; only shapes, rotations and friction's cone are
written for each dimension.
"""

from reference_solver.exact.refusals import Refused
from reference_solver.exact.world import EventWorld as World

__all__ = ["Refused", "World"]
