"""Ends of series of rebounds: what bounces or rocks too low to be followed is summed up (E22).

A contact that leaves with the speed u under an acceleration -g towards each other rises by u^2 / (2 g). All its
rebounds together leave it closed, with the velocities of an impact without restitution. That is taken as soon as the
rise is less than round-off of a gap can tell.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from reference_solver.exact.bodies import State, World
from reference_solver.exact.forces import STILL, accelerations, decide
from reference_solver.exact.motion import free_acceleration
from reference_solver.exact.problem import OPEN, SLIP, STICK, Problem, directed
from reference_solver.exact.record import Blow
from reference_solver.exact.refusals import Refused
from reference_solver.exact.rows import Contacts
from reference_solver.pieces import ROCKING

#: Rebounds no higher than this share of the smallest half width are summed, and than what coordinates resolve.
LOW = 1e-13


def height(world: World, state: State) -> float:
    """Return how high a rebound may be that is summed [m]."""
    return LOW * world.size + 2.0 * float(np.spacing(np.abs(state.place).max()))


def _low(world: World, state: State, contacts: Contacts) -> tuple[NDArray[np.bool_], set[tuple[int, ...]]]:
    """Which contacts (m,) part so slowly that they do not rise by `height`, and the names of those that stay closed."""
    contacts.at_state(state)
    none: set[tuple[int, ...]] = set()
    parts = contacts.rows.speed[:, 0]
    if not (parts > STILL).any():
        return np.zeros(len(contacts), bool), none
    free = free_acceleration(world, state.axes, state.velocity)
    try:
        held = decide(world, state, contacts, free)
    except Refused:
        return np.zeros(len(contacts), bool), none
    falls = -accelerations(contacts.at_state(state), held.acceleration)[:: world.dimension]
    low = (parts > STILL) & (falls > 0.0) & (parts**2 < 2.0 * falls * height(world, state))
    return low, set(held.contacts.names)


def too_low(world: World, state: State, contacts: Contacts) -> set[tuple[int, int]]:
    """Return the pairs with restitution that part too slowly to be followed with all contacts that part."""
    if not (contacts.restitution > 0.0).any():
        return set()
    low, _ = _low(world, state, contacts)
    high = (contacts.rows.speed[:, 0] > STILL) & ~low

    def pairs(which: NDArray[np.bool_]) -> set[tuple[int, int]]:
        return {pair for pair, is_one in zip(contacts.pairs, which, strict=True) if is_one}

    return pairs(low & (contacts.restitution > 0.0)) - pairs(high)


def settled(world: World, state: State, contacts: Contacts) -> Blow | None:
    """Return impulses that close contacts which rock or rebound too low to be followed; None if there are none."""
    low, stay = _low(world, state, contacts)
    if not low.any():
        return None
    closed = low | np.array([name in stay for name in contacts.names])
    directions = directed(contacts.rows.speed[:, 1:], STILL)
    modes = np.where(closed, np.where(low | directions.any(axis=1), SLIP, STICK), OPEN)
    found = Problem.of(contacts, contacts.rows.speed.ravel()).with_modes(modes, directions)
    if found is None:
        return None
    after = replace(state, velocity=state.velocity + contacts.changes(found.forces))
    if contacts.at_state(after).rows.speed[:, 0].min() <= -STILL:
        return None
    return Blow.of(after, contacts, found.forces, ROCKING)
