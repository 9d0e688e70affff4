"""Impacts: Newton's law for all that approaches at once, again until nothing that touches approaches (E21)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from reference_solver.exact.bodies import State, World
from reference_solver.exact.forces import accelerations
from reference_solver.exact.motion import free_acceleration
from reference_solver.exact.problem import NONE, ROUND_OFF, Problem
from reference_solver.exact.record import Blow
from reference_solver.exact.refusals import NoImpulses, NoSolution, TooManyImpacts
from reference_solver.exact.rows import Contacts
from reference_solver.exact.series import height
from reference_solver.model import Array
from reference_solver.pieces import CHAIN, FROZEN

#: Impacts of one instant, after which 32 looks have found no cycle that slows down; a look compares the speeds of this
#: many with those of as many before.
MOST, LOOK_BACK = 4096, 64
#: A contact without restitution that parts more slowly than this share of the fastest approach takes part (E21).
SLOW = 1e-6
#: A point that parts so many times as fast as the fastest approaches has no part in an impact: no lever stops it, and
#: its speed is no measure of the others.
FAST = 1e6


def strike(world: World, state: State, contacts: Contacts) -> list[Blow]:
    """Return all impacts of the instant, one after the other; none where nothing that touches approaches.

    Raises
    ------
    NoImpulses, TooManyImpacts
        If bodies cannot part, or impacts do not end.
    Undecided, Unlawful, Unconverged
        See `Problem.solved`.
    """
    blows: list[Blow] = []
    if not (contacts.at_state(state).rows.speed[:, 0] < -world.still).any():
        return blows
    known, pair = np.unique(contacts.features[:, :2] @ (world.shape[0], 1), return_inverse=True)
    stopped, cycle = np.zeros((2, len(known)), bool)  # pairs whose rebounds are over, and those that a cycle strikes
    fastest: list[float] = []
    for count in range(MOST):
        speeds = contacts.at_state(state).rows.speed[:, 0].copy()
        closing = np.bincount(pair, speeds < -world.still) > 0.0
        if not closing.any():
            return blows
        fastest.append(-float(speeds.min()))
        answer, scheme = closing, FROZEN  # all points of a pair that meets answer together
        look = count % (2 * LOOK_BACK)  # the second half of these impacts is compared with the first
        if look >= LOOK_BACK:
            cycle |= closing
        if look == 2 * LOOK_BACK - 1:
            # Impacts that repeat, ever more slowly, sum up to one of all of them without rebound (E22).
            if max(fastest[-LOOK_BACK:]) < max(fastest[-2 * LOOK_BACK : -LOOK_BACK]):
                answer, stopped, scheme = cycle, stopped | cycle, CHAIN
            cycle = np.zeros(len(known), bool)
        lies = speeds < np.where(contacts.restitution == 0.0, max(world.still, SLOW * fastest[-1]), world.still)
        takes_part = answer[pair] | lies if scheme == FROZEN else answer[pair]
        which = np.flatnonzero(takes_part & (speeds < FAST * fastest[-1]))
        part, rebounds = contacts.chosen(which), np.where(stopped[pair], 0.0, contacts.restitution)[which]
        try:
            blow = _struck(state, part, rebounds)
        except NoImpulses:
            # A wedge cannot rebound from both sides at once; to and fro it can, and ends at rest where that is low.
            high = fastest[-1] ** 2 > 2.0 * world.pull * height(world, state)
            if high or not rebounds.any():
                raise
            stopped[pair[which]] = True
            blow = _struck(state, part, 0.0 * rebounds)
        if np.array_equal(blow.after.velocity, state.velocity):
            return blows  # beside the slip an approach is round-off, which goes where forces are decided
        blows.append(replace(blow, scheme=scheme))
        state = blow.after
    raise TooManyImpacts(count=MOST, t=state.t)


def _struck(state: State, part: Contacts, rebounds: Array) -> Blow:
    """Return one impact of contacts with restitutions e (m,): those that approach with u- leave with u+ >= -e u-.

    Loads do nothing in it. A speed of contact is a difference of velocities, and known to the last places of those.
    """
    free = part.rows.speed.copy()
    free[:, 0] += rebounds * np.minimum(free[:, 0], 0.0)
    known = float((np.abs(part.matrices[0]) @ np.abs(state.velocity.ravel())).max()) * ROUND_OFF / NONE
    try:
        impulses = Problem(part, free.ravel(), np.zeros_like(free[:, 1:]), known).solved(state.t).forces
    except NoSolution:
        raise NoImpulses(t=state.t) from None
    return Blow.of(state.moving(state.velocity + part.changes(impulses)), part, impulses)


def jam(world: World, state: State, contacts: Contacts, instant: float) -> Blow:
    """Return the impulses of an instant [s] without forces: an impact without a collision (E54).

    Raises
    ------
    NoSolution
        If there are no such impulses.
    Undecided, Unlawful, Unconverged
        See `Problem.solved`.
    """
    contacts.at_state(state)
    rates = accelerations(contacts, free_acceleration(world, state.axes, state.velocity))
    free = contacts.rows.speed.ravel() + instant * rates
    impulses = Problem(contacts, free, np.zeros_like(contacts.rows.speed[:, 1:])).solved(state.t).forces
    return Blow.of(state.moving(state.velocity + contacts.changes(impulses)), contacts, impulses)
