"""Pieces of motion between two events, as polynomials in the share of the piece that is over."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.integrate import DOP853

from reference_solver.exact.bodies import State, World
from reference_solver.exact.forces import Held, accelerations
from reference_solver.exact.kernels.motion import write_free_acceleration, write_moved
from reference_solver.exact.problem import ROUND_OFF, SLIP
from reference_solver.exact.refusals import NoStep
from reference_solver.exact.rotation import turned
from reference_solver.exact.rows import Contacts
from reference_solver.model import Array

#: Changes of rows below this share of their size are round-off, and so are accelerations below this share of what
#: forces of contacts make one by one.
STEADY, REST = 1e-13, 1e-12
#: Errors of speeds are relative to the speeds at the start of a step and this share of the world's speed: what starts
#: from rest would have no scale.
LEAST = 1e-2
#: How much shorter or longer than the last a step may be, and what is left to safety.
SHORTER, LONGER, SAFE = 0.2, 5.0, 0.9
#: Shortest step that is tried, as a share of the world's time: it moves nothing by a last place.
SHORTEST = 1e-20


def free_acceleration(world: World, axes: Array, velocity: Array) -> Array:
    """Return accelerations (n, q) without contacts [m/s^2], [rad/s^2], with axes (n, d, d) and twists (n, q)."""
    out = np.zeros(velocity.shape)
    write_free_acceleration(world.bodies, axes, velocity, out)
    return out


@dataclass(frozen=True)
class Piece:
    """Motion of all bodies from a state on, for ``length`` [s].

    Parameters
    ----------
    start
        State at the beginning.
    way, velocity
        (n, q, k): coefficients of displacements and turns since the start, and of twists, by powers of the share s of
        the piece, 0 <= s <= 1.
    held
        Contacts that stay closed in it, with their forces at the beginning.
    turns
        Whether rows of contacts turn, so that forces follow.
    push
        (m, d, k) of a piece that turns: coefficients of impulses of its contacts in world axes.
    """

    start: State
    length: float
    way: Array
    velocity: Array
    held: Held
    turns: bool
    push: Array = field(default_factory=lambda: np.zeros((0, 0, 0)))

    @cached_property
    def own_contacts(self) -> Contacts:
        """A copy of the contacts, which may be brought to any state."""
        return self.held.contacts.chosen(np.arange(len(self.held.contacts)))

    def at(self, s: float) -> tuple[Array, Array, Array]:
        """Return places (n, d), axes (n, d, d) and twists (n, q) at a share."""
        way = self.way @ s ** np.arange(self.way.shape[2])
        moved = np.empty(self.start.place.shape), np.empty(self.start.axes.shape), np.empty(way.shape)
        velocity = self.velocity @ s ** np.arange(self.velocity.shape[2])
        write_moved(self.start.place, self.start.axes, way, velocity, moved)
        return moved[0], moved[1], velocity

    def impulse(self, s: float, rate: bool = False) -> Array:
        """Return impulses (m, d) up to a share of a piece that turns [N s], or their rates by the share."""
        powers = np.arange(self.push.shape[2])
        return np.asarray(self.push @ (powers * s ** np.maximum(powers - 1, 0) if rate else s**powers))

    def way_at(self, shares: Array) -> tuple[Array, Array]:
        """Return ways and twists (k, n, q) at shares (k,).

        Products by share and body, so that the bits of one state do not depend on which others are asked for.
        """
        shape = (len(shares), *self.start.velocity.shape)
        way, velocity = (
            np.matmul(each, (shares[:, None] ** np.arange(each.shape[2]))[:, None, :, None]).reshape(shape)
            for each in (self.way, self.velocity)
        )
        return way, velocity

    def states(self, shares: Array) -> tuple[Array, Array, Array]:
        """Return places (k, n, d), orientations (k, n, 1 | 4) and twists (k, n, q) at shares (k,)."""
        d = self.start.place.shape[1]
        way, velocity = self.way_at(shares)
        return self.start.place + way[..., :d], turned(self.start.orientation, way[..., d:]), velocity

    def looked_at(self, shares: Array) -> tuple[Array, Array]:
        """Return poses (k, n, 3 | 7) and twists (k, n, q) at shares (k,)."""
        place, orientation, velocity = self.states(shares)
        return np.concatenate([place, orientation], axis=2), velocity

    def state(self, s: float) -> State:
        """Return the state at a share of the piece."""
        place, orientation, velocity = self.states(np.array([s]))
        return State(self.start.t + s * self.length, place[0], orientation[0], velocity[0])

    def cut(self, share: float) -> Piece:
        """Return the piece up to a share of it; contacts and forces are the same."""
        way, velocity, push = (
            each * share ** np.arange(each.shape[2]) for each in (self.way, self.velocity, self.push)
        )
        return replace(self, length=share * self.length, way=way, velocity=velocity, push=push)


def steady(state: State, held: Held, acceleration: Array, length: float) -> Piece:
    """Return the piece under accelerations (n, q) that stay."""
    way = np.stack([np.zeros(acceleration.shape), length * state.velocity, 0.5 * length**2 * acceleration], axis=2)
    velocity = np.stack([state.velocity, length * acceleration], axis=2)
    return Piece(state, length, way, velocity, held, turns=False)


def constant(world: World, state: State, held: Held, length: float) -> Piece | None:
    """Return the piece of a length [s] under constant accelerations, which is exact; None where they are not constant.

    They are if no body precesses, no slip turns, and no row of a free body does: neither now (gamma, E36), nor
    half-way, nor at the end.
    """
    acceleration = held.acceleration
    if len(held.contacts):
        # A heavy body goes along with what round-off makes of a light one that it presses on; errors of all contacts of
        # a pile add up towards its top.
        most, pressure = max(map(len, held.contacts.groups)), held.pressure
        noise = np.maximum(REST * pressure, most * ROUND_OFF * pressure.max(axis=0))
        acceleration = np.where(np.abs(acceleration) < noise, 0.0, acceleration)
    if world.dimension == 3 and not _turns_steadily(world, state, acceleration):
        return None
    piece = steady(state, held, acceleration, length)
    if not len(held.contacts):
        return piece
    rows = held.contacts.rows
    if np.abs(rows.rate).max() > STEADY * world.pull or not _slips_straight(held):
        return None
    before, contacts = rows.yields.copy(), held.contacts
    turns = False
    for s in (0.5, 1.0):
        now = contacts.at(*piece.at(s)).rows.yields
        turns |= bool(np.abs(now - before).max() > STEADY * np.abs(before).max())
    contacts.at_state(state)
    return None if turns else piece


def _slips_straight(held: Held) -> bool:
    """Whether slips with friction keep their directions: planar ones do, those in space under a pull along them."""
    answer, contacts = held.answer, held.contacts
    rubs = (answer.modes == SLIP) & (contacts.friction > 0.0)
    change = accelerations(contacts, held.acceleration).reshape(answer.forces.shape)[:, 1:]
    along = (change * answer.directions).sum(axis=1, keepdims=True)
    return not (np.abs(change - along * answer.directions).max(axis=1)[rubs] > REST * contacts.world.pull).any()


def _turns_steadily(world: World, state: State, acceleration: Array) -> bool:
    """Whether spins keep their directions, and those of bodies with different moments are none."""
    spin, change, moment = state.velocity[:, 3:], acceleration[:, 3:], world.bodies.moment
    free = world.bodies.free == 1
    bent = change.any() and np.abs(np.cross(spin, change)).max() > 1e-14 * np.abs(spin).max() * np.abs(change).max()
    torque = (world.bodies.torque[free] != 0.0).any()
    unequal = free & (np.ptp(np.where(free[:, None], moment, 1.0), axis=1) > 0.0)
    return not bent and not torque and not (spin[unequal] != 0.0).any() and not (change[unequal] != 0.0).any()


class Turning:
    """Motion while rows of contacts turn: accelerations are solved for anew wherever they are asked for.

    Parameters
    ----------
    state, held
        Where the step begins, and contacts whose modes are held.
    tolerance
        Error of a step, as a share of the smallest half width or of the speeds and ways in it.
    """

    def __init__(self, world: World, state: State, held: Held, tolerance: float) -> None:
        self._world, self._state, self._held, self._tolerance = world, state, held, tolerance
        n, d = state.place.shape
        self._moved = np.empty((n, d)), np.empty((n, d, d)), np.empty(state.velocity.shape)

    def after(self, way: Array, velocity: Array, directions: Array | None = None) -> tuple[Array, Array, Array, Array]:
        """Return what moves bodies after ways, with twists (n, q).

        That is rates of ways, accelerations without contacts and with them (n, q), and forces (m, d) in world axes.
        ``directions``: (m, d - 1) of slips, where they are not those of the velocities.
        """
        write_moved(self._state.place, self._state.axes, way, velocity, self._moved)
        place, axes, rate = self._moved
        free = free_acceleration(self._world, axes, velocity)
        forces, acceleration = self._held.follow(place, axes, velocity, free, directions)
        return rate, free, acceleration, self._held.contacts.along_axes(forces)

    def _rates(self, y: Array) -> Array:
        """Rates (2 N + m d,) of ways and twists, and of impulses of contacts."""
        way, velocity = y[: 2 * self._state.velocity.size].reshape(2, *self._state.velocity.shape)
        rate, _, acceleration, pushes = self.after(way, velocity)
        return np.concatenate([rate.ravel(), acceleration.ravel(), pushes.ravel()])

    def step(self, length: float) -> tuple[Piece, float]:
        """Return a piece of at most a length [s], as long as the error stays below the tolerance, and the next length.

        E. Hairer, S. Nørsett, G. Wanner, *Solving Ordinary Differential Equations I*, 1993, II.10: order 8, with an
        interpolant of order 7.

        Raises
        ------
        NoStep
            If steps become shorter than `SHORTEST`.
        """
        count = self._state.velocity.size
        each = np.tile(self._world.per_length, len(self._state.velocity))
        pushes = np.zeros(self._held.answer.forces.shape)
        start = np.concatenate([np.zeros(count), self._state.velocity.ravel(), pushes.ravel()])
        floor = LEAST * self._world.speed * each
        least = np.concatenate([self._world.size * each, floor + np.abs(start[count : 2 * count])])
        rates = np.zeros((16, len(start)))
        rates[0] = self._rates(start)
        while True:
            for k in range(1, 12):
                rates[k] = self._rates(start + length * (DOP853.A[k, :k] @ rates[:k]))
            change = length * (DOP853.B @ rates[:12])
            rates[12] = self._rates(start + change)
            error = np.inf  # where that is so far ahead that there are no numbers
            if np.isfinite(rates).all():
                scale, moves = self._tolerance * (least + np.abs(change[: 2 * count])), rates[:13, : 2 * count]
                fifth = ((DOP853.E5 @ moves / scale) ** 2).sum()
                third = ((DOP853.E3 @ moves / scale) ** 2).sum()
                error = length * fifth / np.sqrt((fifth + 0.01 * third) * len(scale)) if fifth > 0.0 else 0.0
            factor = min(LONGER, SAFE * error**-0.125) if error > 0.0 else LONGER
            if error <= 1.0:
                break
            length *= max(SHORTER, factor)
            if length < SHORTEST * self._world.time:
                raise NoStep(t=self._state.t)
        for k, row in enumerate(DOP853.A_EXTRA, 13):
            rates[k] = self._rates(start + length * (row[:k] @ rates[:k]))
        # The interpolant: coefficients of the terms of `_powers`.
        dense = np.zeros((7, len(start)))
        dense[0] = change
        dense[1] = length * rates[0] - change
        dense[2] = 2.0 * change - length * (rates[12] + rates[0])
        dense[3:] = length * (DOP853.D @ rates)
        every = dense.T @ POWERS
        way, velocity = every[: 2 * count].reshape(2, *self._state.velocity.shape, 8)
        velocity[..., 0] = self._state.velocity
        push = every[2 * count :].reshape(*pushes.shape, 8)
        return Piece(self._state, length, way, velocity, self._held, turns=True, push=push), factor * length


def _powers() -> Array:
    """Terms s, s (1 - s), s^2 (1 - s), ... of the interpolant as polynomials (7, 8), lowest power first."""
    term, out = np.ones(1), np.zeros((7, 8))
    for k in range(7):
        term = np.convolve(term, (0.0, 1.0) if k % 2 == 0 else (1.0, -1.0))
        out[k, : len(term)] = term
    return out


POWERS = _powers()
