"""Impacts: Newton's law for pairs of bodies, one after the other until nothing that touches approaches (E21)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from reference_solver.exact import series
from reference_solver.exact.bodies import State, World
from reference_solver.exact.cones import NoSolution
from reference_solver.exact.forces import STILL, accelerations
from reference_solver.exact.motion import free_acceleration
from reference_solver.exact.problem import Problem
from reference_solver.exact.record import Blow
from reference_solver.exact.refusals import NoImpulses, TooManyImpacts
from reference_solver.exact.rows import Contacts
from reference_solver.model import Array
from reference_solver.pieces import CHAIN, FROZEN

#: Impacts of one instant, and of how many of them the speeds are compared to tell a cycle.
MOST, LOOK_BACK = 4096, 64
#: A pair without restitution that parts more slowly than this share of the fastest approach takes part (E21).
SLOW = 1e-6
#: A point that parts so many times as fast as the fastest approaches has no part in an impact: no lever stops it, and
#: its speed is no measure of the others.
FAST = 1e6

Pair = tuple[int, int]


def strike(world: World, state: State, contacts: Contacts) -> list[Blow]:
    """Return all impacts of the instant, one after the other; none where nothing that touches approaches.

    Raises
    ------
    NoImpulses, TooManyImpacts
        If bodies cannot part, or impacts do not end.
    """
    blows: list[Blow] = []
    if not len(contacts):
        return blows
    pairs = contacts.pairs
    stopped: set[Pair] = set()  # pairs whose rebounds are over
    cycle: set[Pair] = set()
    fastest: list[float] = []
    for count in range(MOST):
        contacts.at_state(state)
        approach = _least_of_pairs(pairs, contacts.rows.speed[:, 0])
        closing = {pair for pair, speed in approach.items() if speed < -STILL}
        if not closing:
            last = series.settled(world, state, contacts) if blows else None
            return blows if last is None else [*blows, last]
        fastest.append(-min(approach.values()))
        takes_part = {pair for pair, speed in approach.items() if speed < _parting(world, pair, fastest[-1])}
        scheme = FROZEN
        if count % (2 * LOOK_BACK) >= LOOK_BACK:
            cycle |= closing
        if count % (2 * LOOK_BACK) == 2 * LOOK_BACK - 1:
            # Impacts that repeat, ever more slowly, sum up to one of all of them without rebound (E22).
            if max(fastest[-LOOK_BACK:]) < max(fastest[-2 * LOOK_BACK : -LOOK_BACK]):
                takes_part, stopped, scheme = cycle, stopped | cycle, CHAIN
            cycle = set()
        near = contacts.rows.speed[:, 0] < FAST * fastest[-1]
        part = contacts.chosen(np.array([pair in takes_part for pair in pairs]) & near)
        try:
            blow = _struck(state, part, stopped)
        except NoImpulses:
            # A wedge cannot rebound from both sides at once; to and fro it can, and ends at rest where that is low.
            high = fastest[-1] ** 2 > 2.0 * world.weight * series.height(world, state)
            if high or stopped.issuperset(part.pairs):
                raise
            stopped |= set(part.pairs)
            blow = _struck(state, part, stopped)
        low = series.too_low(world, blow.after, part) - stopped
        if low:  # the impact again, without the rebounds that are too low
            stopped |= low
            blow = _struck(state, part, stopped)
        blows.append(replace(blow, scheme=scheme))
        state = blow.after
    raise TooManyImpacts(count=MOST, t=state.t)


def _parting(world: World, pair: Pair, fastest: float) -> float:
    """Return the speed of parting below which a pair takes part [m/s]."""
    return max(STILL, SLOW * fastest) if world.restitution[pair] == 0.0 else STILL


def _least_of_pairs(pairs: list[Pair], speeds: Array) -> dict[Pair, float]:
    least: dict[Pair, float] = {}
    for pair, speed in zip(pairs, speeds.tolist(), strict=True):
        least[pair] = min(speed, least.get(pair, np.inf))
    return least


def _struck(state: State, part: Contacts, stopped: set[Pair]) -> Blow:
    """Return one impact of contacts, solved without forces: u+ >= -e u- of each that approaches."""
    part.at_state(state)
    rebounds = np.array([pair not in stopped for pair in part.pairs]) * part.restitution
    wanted = part.rows.speed.copy()
    wanted[:, 0] += rebounds * np.minimum(wanted[:, 0], 0.0)
    try:
        impulses = Problem.of(part, wanted.ravel()).solved(state.t).forces
    except NoSolution:
        raise NoImpulses(t=state.t) from None
    return Blow.of(replace(state, velocity=state.velocity + part.changes(impulses)), part, impulses)


def jam(world: World, state: State, contacts: Contacts, instant: float) -> Blow:
    """Return the impulses of an instant [s] without forces: an impact without a collision (E54).

    Raises
    ------
    NoSolution
        If there are no such impulses.
    """
    contacts.at_state(state)
    free = free_acceleration(world, state.axes, state.velocity)
    wanted = contacts.rows.speed.ravel() + instant * accelerations(contacts, free)
    impulses = Problem.of(contacts, wanted).solved(state.t).forces
    return Blow.of(replace(state, velocity=state.velocity + contacts.changes(impulses)), contacts, impulses)
