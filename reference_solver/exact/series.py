"""Ends of series of rebounds: what bounces or rocks too low to be followed is summed up (E22).

A contact that leaves with the speed u under an acceleration -g towards each other rises by u^2 / (2 g). All its
rebounds together leave it closed. As soon as the rise counts as no gap, it stays so for the time that they take.
"""

from __future__ import annotations

import numpy as np

from reference_solver.exact.bodies import NO_GAP, State, World
from reference_solver.exact.forces import Held, accelerations, decide
from reference_solver.exact.motion import free_acceleration
from reference_solver.exact.refusals import Refused
from reference_solver.exact.rows import Contacts


def height(world: World, state: State) -> float:
    """Return how high a rebound may be that is summed [m]: as gaps that are none, or two last places of coordinates."""
    return NO_GAP * world.size + 2.0 * float(np.spacing(np.abs(state.place).max()))


def settling(world: World, state: State, contacts: Contacts) -> Held | None:
    """Return forces under which what rocks or rebounds too low to be followed comes to rest; None if nothing does.

    None as well where such forces are refused: then rebounds are followed. Rebounds of speed u and restitution e take
    ``2 u / (g (1 - e))``. In that time contacts stay closed, and carry so much less that loads take off u.
    """
    parts = contacts.at_state(state).rows.speed[:, 0].copy()
    lies, free = parts < world.still, free_acceleration(world, state.axes, state.velocity)
    if lies.all():
        return None
    try:
        held = decide(world, state, contacts.chosen(lies), free)
        falls = -accelerations(contacts.at_state(state), held.acceleration)[:: world.dimension]
        low = ~lies & (falls > 0.0) & (contacts.restitution < 1.0) & (parts**2 < 2.0 * falls * height(world, state))
        if not low.any():
            return None
        lasts = float((2.0 * parts[low] / falls[low] / (1.0 - contacts.restitution[low])).max())
        held = decide(world, state, contacts.chosen(low | lies), free, lasts)
    except Refused:
        return None
    closed = set(held.contacts.names)
    return held if any(name in closed for name in contacts.chosen(low).names) else None
