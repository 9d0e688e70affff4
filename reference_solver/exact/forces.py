"""Forces at an instant: which contacts hold, stick and slip, and what bodies do under them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from reference_solver.exact.bodies import State, World
from reference_solver.exact.kernels.forces import solve_groups
from reference_solver.exact.problem import (
    OPEN,
    ROUND_OFF,
    SLIP,
    STICK,
    Answer,
    Problem,
    all_open,
    directed,
    loads_shared,
)
from reference_solver.exact.rows import Contacts
from reference_solver.model import Array
from reference_solver.pieces import Indices

#: Loads and accelerations below this share of the largest are round-off where a mode ends. The largest load counts as
#: this share of the lightest body's weight at least: contacts that carry nothing have no scale of their own.
NONE, LEAST = 1e-9, 1e-3
#: Forces of contacts that accelerate a body by so many times the largest load, as those of a heavy body do a light one
#: below it, leave by round-off what becomes a blow (`record.NO_BLOW`) in the world's time: what is left is solved for.
UNEVEN = 450.0
#: Turn of a slip that shows how forces change with it [rad].
TURN = 1e-6


@dataclass
class Held:
    """Closed contacts with their modes and forces, and how bodies accelerate under them.

    Parameters
    ----------
    contacts
        All of them closed.
    answer
        Modes, directions of slips and forces.
    acceleration
        (n, q) of all bodies.
    lasts
        How long a series of rebounds lasts in which they stay closed [s] (E22); None where there is none.
    opened
        Contacts that touch where the piece begins, and open there: they carry nothing.
    slipped
        Features of contacts that stuck until the piece begins and slip from there on.
    """

    contacts: Contacts
    answer: Answer
    acceleration: Array
    lasts: float | None = None
    opened: tuple[Contacts, ...] = ()
    slipped: frozenset[tuple[int, ...]] = frozenset()

    @property
    def pressure(self) -> Array:
        """(n, q): how much forces of contacts accelerate bodies along any axis, their sizes added up.

        [m/s^2] and [rad/s^2], the largest of all axes for each.
        """
        if not len(self.contacts):
            return np.zeros(self.acceleration.shape)
        d = self.contacts.world.dimension
        added = np.abs(self.contacts.matrices[1]) @ np.abs(self.answer.forces.ravel())
        found = added.reshape(self.acceleration.shape)
        found[:, :d], found[:, d:] = (part.max(axis=1, keepdims=True) for part in (found[:, :d], found[:, d:]))
        return np.asarray(found)

    def follow(
        self, place: Array, axes: Array, velocity: Array, free: Array, directions: Array | None = None
    ) -> tuple[Array, Array]:
        """Bring the contacts to another state; return forces (m, d) along frames and accelerations (n, q) there.

        Parameters
        ----------
        place, axes, velocity
            (n, d) [m], (n, d, d), (n, q): the state.
        free
            (n, q) accelerations without contacts.
        directions
            (m, d - 1) of slips, where they are not those of the velocities.
        """
        if not len(self.contacts):
            return self.answer.forces, free
        contacts = self.contacts.at(place, axes, velocity)
        return self._solved(free, self.onward(contacts) if directions is None else directions)

    @property
    def shares_loads(self) -> bool:
        """Whether contacts can share their loads in more than one way (E37), where they are now."""
        slips = np.zeros(self.answer.directions.shape)
        problem = Problem(self.contacts, np.zeros(self.answer.forces.size), slips)
        rows, columns = problem.equations(self.answer.modes, self.answer.directions)
        return bool(np.linalg.matrix_rank(columns) < len(rows))

    def at(self, state: State, free: Array) -> Held:
        """Bring the contacts to another state; return them with the same modes, and forces and accelerations there.

        ``free``: (n, q) accelerations without contacts.
        """
        forces, acceleration = self.follow(state.place, state.axes, state.velocity, free)
        return Held(self.contacts, Answer(self.answer.modes, self.onward(self.contacts), forces), acceleration)

    def onward(self, contacts: Contacts) -> Array:
        """Return directions of slips (m, d - 1) where contacts are now: in space they turn with their velocities."""
        before, slips = self.answer.directions, self.answer.modes == SLIP
        if contacts.world.dimension == 2 or not slips.any():
            return before
        now = directed(contacts.rows.speed[:, 1:], contacts.world.slipping, before)
        return np.where(slips[:, None], now, before)

    @property
    def slips_end(self) -> bool:
        """Whether a slip in space ends where the contacts are now: hardly any is left, and it is being slowed down."""
        contacts, answer = self.contacts, self.answer
        if not len(contacts) or contacts.world.dimension == 2:
            return False
        change = accelerations(contacts, self.acceleration).reshape(answer.forces.shape)[:, 1:]
        over = np.linalg.norm(contacts.rows.speed[:, 1:], axis=1) < 2.0 * contacts.world.slipping
        return bool((over & ((change * answer.directions).sum(axis=1) < 0.0))[answer.modes == SLIP].any())

    def turned(self, slip: int, free: Array, directions: Array) -> Array:
        """Return by how much accelerations (N,) change as one slip in space turns [1/rad], where contacts are now.

        Parameters
        ----------
        slip
            Number of its contact.
        free, directions
            (n, q) accelerations without contacts; (m, d - 1) of all slips.
        """
        turned = directions.copy()
        turned[slip] += TURN * np.array([-directions[slip, 1], directions[slip, 0]])
        return (self._solved(free, turned)[1] - self._solved(free, directions)[1]).ravel() / TURN

    def _solved(self, free: Array, directions: Array) -> tuple[Array, Array]:
        """Return forces (m, d) and accelerations (n, q) where the contacts are now."""
        contacts, answer = self.contacts, self.answer
        forces, acceleration = np.zeros(answer.forces.shape), np.empty(free.shape)
        groups, shared, uneven = self._groups
        held = answer.modes, directions, contacts.friction, answer.forces, shared
        solve_groups(contacts.features, held, contacts.rows, free, groups, forces, acceleration)
        if uneven:  # what round-off leaves of accelerations, for which forces have no digits
            held = answer.modes, directions, contacts.friction, np.zeros(forces.shape), shared
            left, more = acceleration.copy(), np.zeros(forces.shape)
            solve_groups(contacts.features, held, contacts.rows, left, groups, more, acceleration)
            forces += more
        return forces, acceleration

    @cached_property
    def _groups(self) -> tuple[tuple[Indices, Indices], Array, bool]:
        """Contacts of all groups and where each begins, how changes of redundant forces are weighed, and `UNEVEN`."""
        groups = self.contacts.groups
        ends = np.concatenate(groups), np.cumsum([0, *map(len, groups)])
        uneven = bool(self.pressure.max() > UNEVEN * self.contacts.world.pull)
        return ends, loads_shared(self.contacts, self.answer.forces), uneven


def accelerations(contacts: Contacts, free: Array) -> Array:
    """Return accelerations of contacts along their frames (m d,) [m/s^2], under those of bodies (n, q)."""
    return np.asarray(contacts.matrices[0] @ free.ravel() + contacts.rows.rate.ravel())


def held_by(contacts: Contacts, answer: Answer, free: Array) -> Held:
    """Return the contacts that stay closed, and accelerations under their forces and ``free`` (n, q)."""
    stays = answer.modes != OPEN
    acceleration = free + contacts.changes(answer.forces)
    if stays.all():
        return Held(contacts, answer, acceleration)
    return Held(contacts.chosen(stays), answer.chosen(stays), acceleration, opened=(contacts.chosen(~stays),))


def decide(world: World, state: State, contacts: Contacts, free: Array, lasts: float | None = None) -> Held:
    """Return which of contacts that do not part stay closed, and which of these stick and slip.

    In space the frames of ``contacts`` are turned, so that slips lie along their first tangents.

    Parameters
    ----------
    free
        (n, q) accelerations without contacts.
    lasts
        Time in which a series of rebounds takes off the speeds of the contacts [s], slips as far as friction can.

    Raises
    ------
    NoSolution
        If no forces obey the laws (E54).
    Refused
        See `Problem.solved`.
    """
    if not len(contacts):
        return Held(contacts, all_open(0, world.dimension), free)
    directions = directed(contacts.rows.speed[:, 1:], world.slipping if lasts is None else np.inf)
    slips = np.asarray(directions.any(axis=1))
    if world.dimension == 3 and slips.any():
        # Frames take up the slip, so that its rows are along and across it.
        tangents = np.einsum("mk,mkp->mp", directions, contacts.rows.frame[:, 1:])
        contacts.along = np.where(slips[:, None], tangents, contacts.along)
        contacts.at_state(state)
        directions = np.where(slips[:, None], np.array([1.0, 0.0]), 0.0)
    rates = accelerations(contacts, free) + (0.0 if lasts is None else contacts.rows.speed.ravel() / lasts)
    if np.abs(rates).max() < ROUND_OFF * world.pull:
        rates[:] = 0.0
    return replace(held_by(contacts, Problem(contacts, rates, directions).solved(state.t), free), lasts=lasts)


def changed(held: Held, modes: dict[int, int], free: Array, *, strictly: bool = True) -> Held | None:
    """Return the contacts with some modes changed, their forces nearest to those now (E39).

    None if there are no such forces, or if they break a law.

    Parameters
    ----------
    modes
        By the number of a contact: `OPEN` where its load ends, `SLIP` where its friction does, `STICK` where its slip
        would turn back.
    free
        (n, q) accelerations without contacts.
    strictly
        Whether laws may not be broken. Where a mode ends as soon as it begins, what breaks them is round-off.
    """
    contacts, answer = held.contacts, held.answer
    now, directions = answer.modes.copy(), answer.directions.copy()
    for k, mode in modes.items():
        now[k] = mode
        if mode == SLIP:
            friction = answer.forces[k, 1:]
            directions[k] = -friction / max(float(np.linalg.norm(friction)), 1e-300)
    problem = Problem(contacts, accelerations(contacts, free), np.where((now == SLIP)[:, None], directions, 0.0))
    found = problem.with_modes(now, directions, answer.forces)
    if found is None:
        return None
    now_held = held_by(contacts, found, free)
    now_held.opened += held.opened
    now_held.slipped = held.slipped | {contacts.names[k] for k, mode in modes.items() if mode == SLIP}
    after = (problem.rows @ (problem.yields @ found.forces.ravel()) + problem.free).reshape(found.forces.shape)
    force, load = np.abs(found.forces).max(), found.forces[:, 0]
    least = -NONE * (LEAST * contacts.world.least_weight + force)
    small = -NONE * (contacts.world.pull + np.abs(after).max())
    friction = np.linalg.norm(found.forces[:, 1:], axis=1)
    holds = load.min() >= least and after[:, 0].min() >= small
    holds &= not ((now == STICK) & (friction > contacts.friction * load - least)).any()
    holds &= all((after[k, 1:] * directions[k]).sum() >= small for k, mode in modes.items() if mode == SLIP)
    return now_held if holds or not strictly else None
