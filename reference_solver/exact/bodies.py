"""Bodies as arrays shaped by the dimension, and the state that the loop changes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference_solver.exact.rotation import GENERATORS, turned
from reference_solver.exact.shapes import Core, core
from reference_solver.geometry import rotation
from reference_solver.model import Array, Model
from reference_solver.pieces import Indices
from reference_solver.shapes import smallest_extent

#: Shares of the speed of `World` below which speeds are none, and slips have no direction.
STILL, SLIPPING = 1e-12, 1e-11
#: Gaps below this share of the smaller half width of a pair are none.
NO_GAP = 1e-13


class Bodies(NamedTuple):
    """What does not change: n bodies in d dimensions with s spins each, as kernels read them.

    Features are told in body axes. Rows beyond a body's own number of points, faces or lines are zeros.

    Parameters
    ----------
    point, points
        (n, p, d) corners of the cores, and how many there are (n,).
    normal, offset, faces
        (n, f, d) and (n, f): a core lies in ``normal . x <= offset`` of all its faces (n,).
    side, limit, sides
        (n, f, k, d) and (n, f, k): a place is over a face where ``side . x <= limit`` for all its sides, of which there
        are (n, f).
    line, lines
        (n, l, 2) numbers of the points that edges join, and how many there are (n,).
    radius, reach
        (n,) what cores are grown by; distance of the farthest point of a core from its centre [m].
    free
        (n,) whether loads and contacts move a body.
    inverse_mass, moment
        (n,) [1/kg] and (n, s) principal moments [kg m^2]; zero and infinite unless free.
    load
        (n, d + s) accelerations by gravity, force and, in the plane, torque in world axes [m/s^2], [rad/s^2].
    torque
        (n, s) in world axes [N m]; in space what it accelerates by turns with the body.
    generator
        (s, d, d): under a spin w a point r has the velocity ``sum_k w_k E_k r``.
    """

    point: Array
    points: Indices
    normal: Array
    offset: Array
    faces: Indices
    side: Array
    limit: Array
    sides: Indices
    line: Indices
    lines: Indices
    radius: Array
    reach: Array
    free: Indices
    inverse_mass: Array
    moment: Array
    load: Array
    torque: Array
    generator: Array


@dataclass
class State:
    """Where bodies are and how they move, at the time ``t`` [s].

    Parameters
    ----------
    place, orientation
        (n, d) [m] and (n, 1 | 4).
    velocity
        (n, d + s) twists in world axes [m/s], [rad/s].
    """

    t: float
    place: Array
    orientation: Array
    velocity: Array

    def __post_init__(self) -> None:
        self._axes: Array | None = None

    @property
    def axes(self) -> Array:
        """(n, d, d): columns are the body axes."""
        if self._axes is None:
            self._axes = np.ascontiguousarray(rotation(self.pose))
        return self._axes

    @property
    def pose(self) -> Array:
        """(n, 3 | 7)."""
        return np.concatenate([self.place, self.orientation], axis=1)

    @property
    def numbers(self) -> Array:
        """(n, 3 + q | 7 + q): poses and twists, as the record has them."""
        return np.concatenate([self.place, self.orientation, self.velocity], axis=1)

    def moving(self, velocity: Array) -> State:
        """Return the same places with other twists (n, d + s) [m/s], [rad/s]."""
        found = State(self.t, self.place, self.orientation, velocity)
        found._axes = self._axes
        return found

    def moved(self, way: Array) -> State:
        """Return the state after displacements and turns (n, d + s) [m], [rad], with the same twists."""
        d = self.place.shape[1]
        return State(self.t, self.place + way[:, :d], turned(self.orientation, way[:, d:]), self.velocity)


@dataclass(frozen=True)
class World:
    """A model as the loop reads it: its bodies, the laws of their pairs, and lengths that round-off is measured by.

    Parameters
    ----------
    shapes
        Of the bodies.
    restitution, friction
        (n, n).
    extent, size
        Half widths of the bodies (n,), and the smallest of them [m].
    pull
        Largest acceleration by loads [m/s^2], also of points at a distance of ``size`` from the centre of a body that
        they turn. Without loads, v^2 / ``size`` with the largest speed v at the start; 1 if nothing moves.
    least_weight
        What the lightest body weighs [N].
    """

    bodies: Bodies
    shapes: tuple[object, ...]
    restitution: Array
    friction: Array
    extent: Array
    size: float
    pull: float
    least_weight: float

    @cached_property
    def time(self) -> float:
        """Time in which a body falls through half of ``size`` [s]."""
        return math.sqrt(self.size / self.pull)

    @cached_property
    def speed(self) -> float:
        """Speed that is reached by then [m/s]."""
        return math.sqrt(self.size * self.pull)

    @cached_property
    def per_length(self) -> Array:
        """(q,): 1 for ways, and for turns the angle that moves a point at a distance of ``size`` by 1 m [rad/m]."""
        q, d = self.shape[1], self.dimension
        return np.array([1.0] * d + [1.0 / self.size] * (q - d))

    @cached_property
    def still(self) -> float:
        """Speeds below this are none [m/s]."""
        return STILL * self.speed

    @cached_property
    def slipping(self) -> float:
        """Slips below this have no direction [m/s]."""
        return SLIPPING * self.speed

    @cached_property
    def no_gap(self) -> Array:
        """(n, n): gaps of pairs up to which they count as none [m], `NO_GAP` smaller half widths."""
        least = np.minimum.outer(self.extent, self.extent)
        return np.where(np.isfinite(least), NO_GAP * least, 0.0)

    @cached_property
    def pairs(self) -> Indices:
        """(2, k): numbers of all pairs of which one is free, the smaller one first."""
        free = self.bodies.free == 1
        return np.array(np.nonzero(np.triu(free[:, None] | free, 1)))

    @cached_property
    def edged(self) -> NDArray[np.bool_]:
        """(n, n) whether two bodies can meet edge on edge: in space, if both have edges."""
        edged = (self.bodies.points > 1) & (self.dimension == 3)
        return np.asarray(edged[:, None] & edged)

    @cached_property
    def mass(self) -> Array:
        """(f, d + s): masses and principal moments of free bodies [kg], [kg m^2]."""
        free = self.bodies.free == 1
        masses = np.repeat(1.0 / self.bodies.inverse_mass[free, None], self.dimension, axis=1)
        return np.concatenate([masses, self.bodies.moment[free]], axis=1)

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return self.bodies.generator.shape[1]

    @property
    def shape(self) -> tuple[int, int]:
        """Bodies, and numbers of a twist."""
        n, q = self.bodies.load.shape
        return n, q


def world_of(model: Model) -> World:
    """Return a model as arrays."""
    d = model.dimension
    generator = GENERATORS[d]
    n, s = len(model.bodies), len(generator)
    cores = [core(body.shape, d) for body in model.bodies]
    free = [body.motion == "free" for body in model.bodies]
    load, torque = np.zeros((n, d + s)), np.zeros((n, s))
    moment = np.full((n, s), np.inf)
    for i, body in enumerate(model.bodies):
        if free[i]:
            moment[i] = body.inertia
            load[i, :d] = np.array(model.gravity) + np.array(body.force if body.force is not None else 0.0) / body.mass
            torque[i] = body.torque if body.torque is not None else 0.0
    if s == 1:
        load[:, d:] = torque / moment
    extent = np.array([smallest_extent(body.shape) for body in model.bodies])
    size = float(extent[np.isfinite(extent)].min(initial=np.inf))
    size = size if np.isfinite(size) else 1.0
    side, limit, sides = _sides(cores, d)
    bodies = Bodies(
        _table([c.points for c in cores], d),
        _counts([c.points for c in cores]),
        _table([c.normals for c in cores], d),
        _table([c.offsets for c in cores], None),
        _counts([c.offsets for c in cores]),
        side,
        limit,
        sides,
        _table([c.lines for c in cores], 2).astype(np.int64),
        _counts([c.lines for c in cores]),
        np.array([c.radius for c in cores]),
        np.array([c.reach for c in cores]),
        np.array(free, np.int64),
        np.array([1.0 / body.mass if body.motion == "free" else 0.0 for body in model.bodies]),
        moment,
        load,
        torque,
        generator,
    )
    twist = np.abs(start_of(model).velocity)
    fastest = max(float(twist[:, :d].max()), size * float(twist[:, d:].max()))
    pull = max(float(np.abs(load[:, :d]).max()), size * float(np.abs(torque / moment).max()))
    pull = pull or fastest**2 / size or 1.0
    lightest = min((body.mass for body in model.bodies if body.motion == "free"), default=0.0)
    shapes = tuple(body.shape for body in model.bodies)
    return World(
        bodies, shapes, np.array(model.restitution), np.array(model.friction), extent, size, pull, lightest * pull
    )


def start_of(model: Model) -> State:
    """Return the state at the start."""
    d = model.dimension
    pose = np.array([body.pose for body in model.bodies], float)
    s = len(GENERATORS[d])
    twist = [body.twist if body.twist is not None else (0.0,) * (d + s) for body in model.bodies]
    # Contiguous as all later ones: a view would be another type, for which kernels would be compiled once more.
    return State(0.0, np.ascontiguousarray(pose[:, :d]), pose[:, d:], np.array(twist, float))


def _table(rows: Sequence[NDArray[Any]], width: int | None) -> Array:
    """Rows of every body in one table, zeros behind them."""
    most = max([1, *(len(each) for each in rows)])
    table = np.zeros((len(rows), most) if width is None else (len(rows), most, width))
    for own, each in zip(table, rows, strict=True):
        own[: len(each)] = each
    return table


def _counts(rows: Sequence[NDArray[Any]]) -> Indices:
    return np.array([len(each) for each in rows])


def _sides(cores: Sequence[Core], d: int) -> tuple[Array, Array, Indices]:
    most = max([1, *(len(c.sides[f]) for c in cores for f in range(len(c.normals)))])
    faces = max([1, *(len(c.normals) for c in cores)])
    side, limit = np.zeros((len(cores), faces, most, d)), np.zeros((len(cores), faces, most))
    count = np.zeros((len(cores), faces), np.int64)
    for i, each in enumerate(cores):
        for f in range(len(each.normals)):
            for k, (normal, end) in enumerate(each.sides[f]):
                side[i, f, k], limit[i, f, k] = normal, end
            count[i, f] = len(each.sides[f])
    return side, limit, count
