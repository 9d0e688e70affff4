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
    directed,
    loads_shared,
    nothing,
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
        How long they hold, where that is known [s]; else 0.
    opened
        What touched as well when these were found, and carries nothing.
    begins
        Features of contacts that stuck up to here and begin to slip.
    """

    contacts: Contacts
    answer: Answer
    acceleration: Array
    lasts: float = 0.0
    opened: tuple[Contacts, ...] = ()
    begins: frozenset[tuple[int, ...]] = frozenset()

    @property
    def pressure(self) -> Array:
        """(n, q): how much forces of contacts accelerate bodies along any axis, added up without their signs."""
        if not len(self.contacts):
            return np.zeros(self.acceleration.shape)
        d = self.contacts.world.dimension
        added = np.abs(self.contacts.matrices[1]) @ np.abs(self.answer.forces.ravel())
        found = added.reshape(self.acceleration.shape)
        found[:, :d], found[:, d:] = (part.max(axis=1, keepdims=True) for part in (found[:, :d], found[:, d:]))
        return np.asarray(found)

    def follow(self, place: Array, axes: Array, velocity: Array, free: Array, directions: Array | None = None) -> Array:
        """Return accelerations (n, q) with the modes held at another state, and keep the forces there.

        Parameters
        ----------
        directions
            (m, d - 1) of slips, where they are not those of the velocities.
        """
        if not len(self.contacts):
            self.forces = self.answer.forces
            return free
        contacts = self.contacts.at(place, axes, velocity)
        self.forces, acceleration = self._solved(free, self.onward(contacts) if directions is None else directions)
        return acceleration

    @property
    def pushes(self) -> Array:
        """(m, d) forces that `follow` found, in world axes."""
        return self.contacts.along_axes(self.forces)

    @property
    def shares_loads(self) -> bool:
        """Whether contacts can share their loads in more than one way (E37), where they are now."""
        slips = np.zeros(self.answer.directions.shape)
        problem = Problem(self.contacts, np.zeros(self.answer.forces.size), slips)
        rows, columns = problem.equations(self.answer.modes, self.answer.directions)
        return bool(np.linalg.matrix_rank(columns) < len(rows))

    def at(self, state: State, free: Array) -> Held:
        """Return the same contacts and modes with forces and accelerations at another state."""
        acceleration = self.follow(state.place, state.axes, state.velocity, free)
        answer = Answer(self.answer.modes, self.onward(self.contacts), self.forces)
        return Held(self.contacts, answer, acceleration)

    def onward(self, contacts: Contacts) -> Array:
        """Return directions of slips (m, d - 1) where contacts are now: in space a slip turns."""
        before, slips = self.answer.directions, self.answer.modes == SLIP
        if contacts.world.dimension == 2 or not slips.any():
            return before
        now = directed(contacts.rows.speed[:, 1:], contacts.world.slipping, before)
        return np.where(slips[:, None], now, before)

    @property
    def slips_end(self) -> bool:
        """Whether, where the contacts are now, a slip in space is over that its acceleration would turn back."""
        contacts, answer = self.contacts, self.answer
        if not len(contacts) or contacts.world.dimension == 2:
            return False
        change = accelerations(contacts, self.acceleration).reshape(answer.forces.shape)[:, 1:]
        over = np.linalg.norm(contacts.rows.speed[:, 1:], axis=1) < 2.0 * contacts.world.slipping
        return bool((over & ((change * answer.directions).sum(axis=1) < 0.0))[answer.modes == SLIP].any())

    def turned(self, slip: int, free: Array, directions: Array) -> Array:
        """Return by how much accelerations (N,) change as one slip in space turns [1/rad], where contacts are now."""
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
        uneven = bool(self.pressure.max() > UNEVEN * self.contacts.world.weight)
        return ends, loads_shared(self.contacts, self.answer.forces), uneven


def accelerations(contacts: Contacts, free: Array) -> Array:
    """Return what contacts would do (m d,) under accelerations (n, q) [m/s^2]."""
    return np.asarray(contacts.matrices[0] @ free.ravel() + contacts.rows.rate.ravel())


def held_by(contacts: Contacts, answer: Answer, free: Array) -> Held:
    """Return the contacts that stay closed, and accelerations under their forces."""
    stays = answer.modes != OPEN
    acceleration = free + contacts.changes(answer.forces)
    if stays.all():
        return Held(contacts, answer, acceleration)
    return Held(contacts.chosen(stays), answer.chosen(stays), acceleration, opened=(contacts.chosen(~stays),))


def decide(world: World, state: State, contacts: Contacts, free: Array, lasts: float = 0.0) -> Held:
    """Return which of contacts without a speed of parting stay closed, and how.

    Parameters
    ----------
    lasts
        Time in which speeds of contacts are taken off [s], slips as far as friction can; 0 where they have none.

    Raises
    ------
    NoSolution
        If no forces obey the laws (E54).
    Refused
        See `Problem.solved`.
    """
    if not len(contacts):
        return Held(contacts, nothing(0, world.dimension), free)
    directions = directed(contacts.rows.speed[:, 1:], np.inf if lasts > 0.0 else world.slipping)
    slips = np.asarray(directions.any(axis=1))
    if world.dimension == 3 and slips.any():
        # Frames take up the slip, so that its rows are along and across it.
        tangents = np.einsum("mk,mkp->mp", directions, contacts.rows.frame[:, 1:])
        contacts.along = np.where(slips[:, None], tangents, contacts.along)
        contacts.at_state(state)
        directions = np.where(slips[:, None], np.array([1.0, 0.0]), 0.0)
    wanted = accelerations(contacts, free) + (contacts.rows.speed.ravel() / lasts if lasts > 0.0 else 0.0)
    if np.abs(wanted).max() < ROUND_OFF * world.weight:
        wanted[:] = 0.0
    return replace(held_by(contacts, Problem(contacts, wanted, directions).solved(state.t), free), lasts=lasts)


def changed(held: Held, modes: dict[int, int], free: Array, *, strictly: bool = True) -> Held | None:
    """Return the contacts with some modes changed, their forces nearest to those now; None if that breaks a law (E38).

    Parameters
    ----------
    modes
        By the number of a contact: `OPEN` where its load ends, `SLIP` where its friction does, `STICK` where its slip
        would turn back.
    free
        (n, q) accelerations without contacts.
    strictly
        Whether the laws are looked at: what ends is known to be round-off where a mode ends as soon as it begins.
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
    now_held.begins = held.begins | {contacts.names[k] for k, mode in modes.items() if mode == SLIP}
    after = (problem.rows @ (problem.yields @ found.forces.ravel()) + problem.free).reshape(found.forces.shape)
    force, load = np.abs(found.forces).max(), found.forces[:, 0]
    least = -NONE * (LEAST * contacts.world.load + force)
    small = -NONE * (contacts.world.weight + np.abs(after).max())
    friction = np.linalg.norm(found.forces[:, 1:], axis=1)
    holds = load.min() >= least and after[:, 0].min() >= small
    holds &= not ((now == STICK) & (friction > contacts.friction * load - least)).any()
    holds &= all((after[k, 1:] * directions[k]).sum() >= small for k, mode in modes.items() if mode == SLIP)
    return now_held if holds or not strictly else None
