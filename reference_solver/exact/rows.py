"""Gaps, rows and their rates for contacts of any kind (E1, E2, E36), and contacts with what was found of them.

The normal n leads from A to B. The place of contact moves along both bodies; its lever r on either has the rate r'.
With the spin matrices O the points of both bodies there have the relative velocity
``u = v_B + O_B r_B - v_A - O_A r_A``, and its components ``n.u``, ``t.u`` change by

    d(n.u)/dt = G_n a + n.beta + n'.u,    d(t.u)/dt = G_t a + t.beta - (t.n') (n.u),
    beta = O_B r_B' - O_A r_A',

where G a collects the accelerations a of the bodies. A kind of contact tells n, n', the place and its velocity alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference_solver.exact.bodies import State, World
from reference_solver.exact.features import TOUCH, find, no_gap
from reference_solver.exact.kernels.features import LINE
from reference_solver.exact.kernels.motion import write_along
from reference_solver.exact.kernels.rows import write_rows
from reference_solver.model import Array
from reference_solver.pieces import Indices


class Rows(NamedTuple):
    """What is known of m contacts at a state, in d dimensions, for twists of q numbers.

    Parameters
    ----------
    gap
        (m,) distances of the surfaces, < 0 where they overlap [m].
    frame
        (m, d, d): normal, then tangents. In space ``frame[:, 1]`` comes in as the tangent that is wished.
    place
        (m, d) places of contact, world axes [m].
    row
        (m, d, 2, q): G of each direction for bodies a and b.
    yields
        (m, d, 2, q): M^-1 G'.
    speed
        (m, d): u along the frame [m/s].
    rate
        (m, d): its acceleration without that of bodies, gamma [m/s^2].
    """

    gap: Array
    frame: Array
    place: Array
    row: Array
    yields: Array
    speed: Array
    rate: Array


def empty_rows(count: int, d: int, q: int) -> Rows:
    """Return rows of zeros for ``count`` contacts in d dimensions, with q numbers of a twist."""
    shapes = ((), (d, d), (d,), (d, 2, q), (d, 2, q), (d,), (d,))
    return Rows(*(np.zeros((count, *shape)) for shape in shapes))


@dataclass
class Contacts:
    """Features that touch, the laws of their pairs, and their rows at the state they were last brought to.

    Parameters
    ----------
    world
        What they belong to.
    features
        (m, 6), see `features`.
    along
        (m, d) tangents that frames take up, in world axes; zeros where any will do.
    rows
        Where the contacts were last brought to.
    """

    world: World
    features: Indices
    along: Array
    rows: Rows

    @classmethod
    def of(cls, world: World, features: Indices) -> Contacts:
        """Return contacts with frames of their own, whose rows are to be brought to a state."""
        d, q = world.dimension, world.shape[1]
        return cls(world, features, np.zeros((len(features), d)), empty_rows(len(features), d, q))

    def __post_init__(self) -> None:
        self._matrices: tuple[Array, Array] | None = None

    @cached_property
    def friction(self) -> Array:
        """(m,) of the pairs."""
        return self.world.friction[self.features[:, 0], self.features[:, 1]]

    @cached_property
    def restitution(self) -> Array:
        """(m,) of the pairs."""
        return self.world.restitution[self.features[:, 0], self.features[:, 1]]

    def __len__(self) -> int:
        return len(self.features)

    def at(self, place: Array, axes: Array, velocity: Array) -> Contacts:
        """Bring rows to a state; return itself."""
        if len(self):
            self.rows.frame[:, 1] = self.along
            write_rows(self.world.bodies, (place, axes, velocity), self.features, self.rows)
            self._matrices = None
        return self

    def at_state(self, state: State) -> Contacts:
        """Bring rows to a state; return itself."""
        return self.at(state.place, state.axes, state.velocity)

    def along_way(self, way: Array, velocity: Array, start: State) -> tuple[Array, Array, Array]:
        """Return gaps (k, m), places (k, m, d), frames (k, m, d, d) after ways (k, n, q) from a start, with twists."""
        count, m, d = len(way), len(self), self.world.dimension
        k = count if way.any() else 1  # bodies at rest are looked at once
        way, velocity = way[:k], velocity[:k]
        found = np.empty((k, m)), np.empty((k, m, d)), np.empty((k, m, d, d))
        write_along(
            self.world.bodies, start.place, start.axes, way, velocity, (self.features, self.along), self.rows, found
        )
        self._matrices = None
        gap, place, frame = (np.broadcast_to(each, (count, *each.shape[1:])) for each in found)
        return gap, place, frame

    def chosen(self, which: NDArray[Any]) -> Contacts:
        """Return some of the contacts, by numbers or by a mask, with their rows."""
        if not len(self):
            return self
        rows = Rows(*(each[which] for each in self.rows))
        return Contacts(self.world, self.features[which], self.along[which], rows)

    def touch(self, none: Array) -> NDArray[np.bool_]:
        """Return which contacts (m,) have a gap that counts as none: up to ``none`` of their pair (n, n) [m]."""
        return np.asarray(self.rows.gap <= none[self.features[:, 0], self.features[:, 1]])

    @property
    def names(self) -> list[tuple[int, ...]]:
        """Rows of ``features`` as m tuples, to look contacts up by."""
        return [tuple(row) for row in self.features.tolist()]

    @property
    def pairs(self) -> list[tuple[int, int]]:
        """Bodies (a, b) of each of m contacts."""
        return [(a, b) for a, b in self.features[:, :2].tolist()]

    @cached_property
    def groups(self) -> list[Indices]:
        """Numbers of the contacts of each group: contacts share free bodies, directly or through others."""
        free = self.world.bodies.free.tolist()
        label = labels(free, self.pairs)
        of: dict[int, list[int]] = {}
        for k, (a, b) in enumerate(self.pairs):
            of.setdefault(label[a if free[a] else b], []).append(k)
        return [np.array(each) for each in of.values()]

    def _spread(self, blocks: Array) -> Array:
        """Return rows (m, d, 2, q) as a matrix (m d, n q)."""
        m, d, _, q = blocks.shape
        n = self.world.shape[0]
        out = np.zeros((m, d, n, q))
        which = np.arange(m)
        for turn in range(2):
            out[which, :, self.features[:, turn]] += blocks[:, :, turn]
        return out.reshape(m * d, n * q)

    def changes(self, forces: Array) -> Array:
        """Return accelerations (n, q) [m/s^2], [rad/s^2] by forces (m, d) along the frames [N].

        Of impulses [N s], changes of velocities.
        """
        return np.asarray((self.matrices[1] @ forces.ravel()).reshape(self.world.shape))

    def along_axes(self, forces: Array) -> Array:
        """Return forces (m, d) in world axes, from their components along the frames; same unit."""
        return np.asarray(np.einsum("mk,mkp->mp", forces, self.rows.frame))

    @property
    def matrices(self) -> tuple[Array, Array]:
        """G (m d, n q) and H = M^-1 G' (n q, m d)."""
        if self._matrices is None:
            rows, yields = self._spread(self.rows.row), self._spread(self.rows.yields)
            self._matrices = rows, np.ascontiguousarray(yields.T)
        return self._matrices


def labels(free: Sequence[int], pairs: Iterable[Sequence[int]]) -> list[int]:
    """Return a number for each of n bodies, the same for free ones that pairs join, directly or through others."""
    label = list(range(len(free)))
    for a, b in pairs:
        if free[a] and free[b] and label[a] != label[b]:
            old, new = label[b], label[a]
            label = [new if each == old else each for each in label]
    return label


def moments(place: Array, force: Array) -> Array:
    """Return moments (..., 1 | 3) [N m] about the origin, of forces (..., d) [N] at places (..., d) [m]."""
    parts = ((0, 1),) if place.shape[-1] == 2 else ((1, 2), (2, 0), (0, 1))
    return np.stack([place[..., i] * force[..., j] - place[..., j] * force[..., i] for i, j in parts], axis=-1)


def touching_contacts(world: World, state: State, ended: frozenset[tuple[int, ...]] = frozenset()) -> Contacts:
    """Return the contacts of a state, of those of a pair at the same place only one.

    What lies on a corner touches both faces beside it: of these the one counts along which the bodies close last. Edges
    that cross count at one place each: where a corner leaves a face two begin, which part.
    """
    features = find(world, state, ended)
    contacts = Contacts.of(world, features).at_state(state)
    if not len(features):
        return contacts
    crosses = (features[:, 2] == LINE) & (features[:, 4] == LINE)
    place = contacts.rows.place
    # At corners of three degrees or more places are off by less than twenty gaps.
    tol = 20.0 * TOUCH * world.size
    of: dict[tuple[int, int], list[int]] = {}
    keep: list[int] = []
    gap = np.where(contacts.touch(no_gap(world, state.place)), 0.0, contacts.rows.gap)
    closes = np.maximum(-contacts.rows.speed[:, 0], world.still)
    pairs = contacts.pairs
    for k in np.lexsort((closes, -gap)).tolist():  # the widest gap first; of those that are none, what closes last
        others = of.setdefault(pairs[k], [])
        if all((crosses[j] and crosses[k]) or np.abs(place[j] - place[k]).max() >= tol for j in others):
            others.append(k)
            keep.append(k)
    return contacts if len(keep) == len(features) else contacts.chosen(np.array(sorted(keep)))
