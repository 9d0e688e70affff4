"""Event-driven oracle: few bodies, exact flight, impacts under a declared law.

It is the independent truth for the time-stepping schemes: it shares no code with them but the model.

>>> from reference_solver import Body, Disc, HalfSpace, Model
>>> from reference_solver.verification.event_driven import EventDriven
>>> floor = Body(HalfSpace((0.0, 1.0)), motion="fixed")
>>> ball = Body(Disc(0.5), mass=1.0, inertia=0.125, pose=(0.0, 1.5, 0.0))
>>> oracle = EventDriven(Model(2, [floor, ball], gravity=(0.0, -10.0), restitution=0.5, friction=0.0))
>>> oracle.run()
>>> round(oracle.events[-1].t, 12) == round(0.2**0.5 * 3.0, 12)  # sqrt(2 h / g) (1 + e) / (1 - e)
True
"""

from reference_solver.verification.event_driven.errors import (
    ContactParadox,
    LeavesClosedForm,
    OracleError,
    TooManyEvents,
)
from reference_solver.verification.event_driven.oracle import Event, EventDriven, Law

__all__ = ["ContactParadox", "Event", "EventDriven", "Law", "LeavesClosedForm", "OracleError", "TooManyEvents"]
