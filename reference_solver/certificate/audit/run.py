"""What an audit looks at: the model, the pieces of a run, and what both say about every row of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from reference_solver.geometry import reach, rotation
from reference_solver.model import Array, Body, Model
from reference_solver.pieces import CHAIN, FORCES, IMPACT, ROCKING, TURNING, Pieces
from reference_solver.shapes import smallest_extent

Indices = NDArray[np.int64]


#: Share of the smallest half width that is a few units in the last place of a place.
UNITS = 1e-15


class _Point:
    """A shape without extent: its distance from a body is that of a place."""

    radius = 0.0


POINT = _Point()


def placed(point: Array, d: int) -> Array:
    """Poses (s, 3 | 7) of places (s, d)."""
    return np.concatenate(
        [point, np.zeros((len(point), 1))] if d == 2 else [point, np.tile(np.eye(4)[0], (len(point), 1))], axis=1
    )


@dataclass(frozen=True)
class Run:
    """A model and the pieces of one run of it, with what follows for each *row*: one body in one piece.

    Parameters
    ----------
    model
        What was to be simulated; masses, laws and loads are read from here only.
    pieces
        What the solver says it did.
    dt
        Step [s].
    """

    model: Model
    pieces: Pieces
    dt: float

    @cached_property
    def d(self) -> int:
        """Dimension."""
        return self.model.dimension

    @cached_property
    def free(self) -> NDArray[np.bool_]:
        """(n,) whether a body is free."""
        return np.array([body.motion == "free" for body in self.model.bodies])

    @cached_property
    def mass(self) -> Array:
        """(n,) [kg]; 1 where it does not matter."""
        return np.array([body.mass if body.motion == "free" else 1.0 for body in self.model.bodies])

    @cached_property
    def moments(self) -> Array:
        """(n, 1 | 3) principal moments [kg m^2]; 1 where they do not matter."""
        size = 1 if self.d == 2 else 3
        known = [body.inertia if body.motion == "free" else 1.0 for body in self.model.bodies]
        return np.array([np.broadcast_to(np.array(inertia, dtype=float), size) for inertia in known])

    @cached_property
    def extent(self) -> Array:
        """(n,) smallest half width [m]; infinite for half-spaces."""
        return np.array([smallest_extent(body.shape) for body in self.model.bodies])

    @cached_property
    def size(self) -> float:
        """Smallest half width of all bodies that have one [m]."""
        finite = self.extent[np.isfinite(self.extent)]
        return float(finite.min()) if len(finite) else 1.0

    @cached_property
    def still(self) -> Array:
        """(n,) speed [m/s] below which a body stands still: last places of its size in a step, and of its impulses."""
        struck = np.zeros(len(self.model.bodies))
        np.maximum.at(struck, self.pieces.body, self.pushed[2])
        return UNITS * (self.extent / self.dt + struck / self.mass)

    @cached_property
    def reach(self) -> Array:
        """(n,) largest distance of a point from the centre of mass [m]; infinite for half-spaces."""
        return np.array([reach(body.shape) for body in self.model.bodies])

    @cached_property
    def force(self) -> Array:
        """(n, d) weight and constant force [N]; zero unless free."""
        own = np.array([body.force for body in self.model.bodies], dtype=float)
        return np.where(self.free[:, None], own + self.mass[:, None] * np.array(self.model.gravity), 0.0)

    @cached_property
    def torque(self) -> Array:
        """(n, 1 | 3) constant torque [N m]; zero unless free."""
        own = np.array([np.ravel(np.array(body.torque, dtype=float)) for body in self.model.bodies])
        return np.where(self.free[:, None], own, 0.0)

    @cached_property
    def pull(self) -> float:
        """Largest acceleration that loads give to a point of a body [m/s^2]."""
        arm = np.where(np.isfinite(self.reach), self.reach, 0.0)
        straight = np.linalg.norm(self.force, axis=1) / self.mass
        turning = arm * np.linalg.norm(self.torque, axis=1) / self.moments.min(axis=1)
        return float((straight + turning).max())

    @cached_property
    def owner(self) -> Indices:
        """(m,) piece of each row."""
        return np.repeat(np.arange(len(self.pieces)), np.diff(self.pieces.first_body))

    @cached_property
    def contact_owner(self) -> Indices:
        """(c,) piece of each contact."""
        return np.repeat(np.arange(len(self.pieces)), np.diff(self.pieces.first_contact))

    @cached_property
    def side(self) -> tuple[Indices, Indices]:
        """(c,) rows of body A and of body B of each contact; -1 where the piece does not hold the body."""
        n = len(self.model.bodies)
        keys = self.owner * n + self.pieces.body
        order = np.argsort(keys, kind="stable")
        found = []
        for body in (self.pieces.body_a, self.pieces.body_b):
            wanted = self.contact_owner * n + body
            at = np.searchsorted(keys[order], wanted)
            row = order[np.minimum(at, len(order) - 1)] if len(order) else np.zeros(len(wanted), int)
            found.append(np.where((at < len(order)) & (keys[row] == wanted), row, -1) if len(order) else row - 1)
        return found[0], found[1]

    @cached_property
    def length(self) -> Array:
        """(m,) length of the piece of each row [s]."""
        return self.pieces.length[self.owner]

    @cached_property
    def is_forces(self) -> NDArray[np.bool_]:
        """(p,) whether a piece is a force phase."""
        return np.asarray(self.pieces.kind == FORCES)

    @cached_property
    def is_frozen(self) -> NDArray[np.bool_]:
        """(p,) whether rows of the contacts stood still in a piece: all but those that turn."""
        return np.asarray((self.pieces.length == 0.0) | (self.pieces.scheme != TURNING))

    @cached_property
    def is_rocking(self) -> NDArray[np.bool_]:
        """(p,) whether a piece sums up low rebounds, or holds what they leave at its end."""
        return np.asarray(self.pieces.scheme == ROCKING)

    @cached_property
    def is_correction(self) -> NDArray[np.bool_]:
        """(p,) whether a piece takes out what is left of speeds at contacts that stay closed."""
        return np.asarray(self.is_rocking & (self.pieces.length == 0.0))

    @cached_property
    def is_impact(self) -> NDArray[np.bool_]:
        """(p,) whether a piece is an impact."""
        return np.asarray(self.pieces.kind == IMPACT)

    @cached_property
    def is_chain(self) -> NDArray[np.bool_]:
        """(p,) whether a piece is the sum of a chain of impacts without end."""
        return np.asarray(self.is_impact & (self.pieces.scheme == CHAIN))

    @cached_property
    def is_followed(self) -> NDArray[np.bool_]:
        """(p,) whether a piece is an impact after which the same bodies have another one at the same instant."""
        pieces, first = self.pieces, self.pieces.body[self.pieces.first_body[:-1]]
        same = np.zeros(len(pieces), bool)
        same[:-1] = (pieces.begin[1:] == pieces.begin[:-1]) & (first[1:] == first[:-1])
        return np.asarray(same & self.is_impact & np.append(self.is_impact[1:], False))

    @cached_property
    def spin(self) -> tuple[Array, Array]:
        """(m, 1 | 3) angular momentum about the own centre before and after [kg m^2/s]."""
        return (
            self._spin(self.pieces.pose_before, self.pieces.twist_before),
            self._spin(self.pieces.pose_after, self.pieces.twist_after),
        )

    def _spin(self, pose: Array, twist: Array) -> Array:
        moments, w = self.moments[self.pieces.body], twist[:, self.d :]
        if self.d == 2:
            return moments * w
        return scaled_along(rotation(pose), moments, w)

    @cached_property
    def pushed(self) -> tuple[Array, Array, Array, Array]:
        """Of each row: sum of impulses (m, d) and of their moments about its start place (m, 1 | 3), and of sizes."""
        pieces, m = self.pieces, len(self.pieces.body)
        linear, size = np.zeros((m, self.d)), np.zeros(m)
        turning, turning_size = np.zeros((m, pieces.moment.shape[1])), np.zeros(m)
        for row, sign in zip(self.side, (-1.0, 1.0), strict=True):
            known = row >= 0
            at, impulse = row[known], sign * pieces.impulse[known]
            arm = pieces.pose_before[at, : self.d]
            moment = sign * pieces.moment[known] - cross(arm, impulse)
            np.add.at(linear, at, impulse)
            np.add.at(turning, at, moment)
            np.add.at(size, at, np.linalg.norm(impulse, axis=1))
            # Point and place are differences of coordinates: their round-off is of the coordinates' size.
            np.add.at(turning_size, at, np.linalg.norm(moment, axis=1) + self.noise * np.linalg.norm(impulse, axis=1))
        return linear, turning, size, turning_size

    @cached_property
    def noise(self) -> float:
        """Largest coordinate times ten units in the last place, as a length whose round-off is 1e-12 of it [m]."""
        places = np.abs(self.pieces.pose_before[:, : self.d]) if len(self.pieces.body) else np.zeros((1, 1))
        return float(places.max() * 1e-3)

    def prescribed_pose(self, i: int, t: Array) -> Array:
        """Poses (s, P) of a body that is not free at times t (s,): its start moved by its constant twist."""
        body, d = self.model.bodies[i], self.d
        start, twist = np.array(body.pose, dtype=float), twist_of(body)
        place = start[:d] + t[:, None] * twist[:d]
        if d == 2:
            return np.column_stack([place, start[2] + t * twist[2]])
        spin = float(np.linalg.norm(twist[3:]))
        axis = twist[3:] / spin if spin > 0.0 else np.zeros(3)
        c, s = np.cos(0.5 * spin * t)[:, None], np.sin(0.5 * spin * t)[:, None]
        w, v = start[3], start[4:]
        vector = c * v + s * (w * axis + np.cross(axis, v))
        return np.concatenate([place, c * w - s * (axis @ v), vector], axis=1)

    def velocity_at(self, row: Indices, body: Indices, point: Array, after: bool, late: bool = False) -> Array:
        """Velocities (c, d) of ``point`` on the bodies of ``row``; a body that the piece does not hold is at rest.

        Those before or ``after`` the piece, for levers from where bodies were as it began or, ``late``, as it ended.
        """
        twist = self.pieces.twist_after if after else self.pieces.twist_before
        pose = self.pieces.pose_after if late else self.pieces.pose_before
        known = (row >= 0)[:, None]
        motion = np.where(known, twist[row], 0.0)
        arm = point - np.where(known, pose[row, : self.d], point)
        return motion[:, : self.d] + turned(motion[:, self.d :], arm)

    def meeting_velocity(self, after: bool) -> Array:
        """Velocities (c, d) of body B against body A where they meet, before or ``after`` the piece [m/s]."""
        a, b, point = self.pieces.body_a, self.pieces.body_b, self.pieces.point
        return self.velocity_at(self.side[1], b, point, after) - self.velocity_at(self.side[0], a, point, after)


def twist_of(body: Body) -> Array:
    """Twist of a body at the start, zeros where it has none."""
    return np.asarray(np.zeros(3 if body.dimension == 2 else 6) if body.twist is None else body.twist, dtype=float)


def scaled_along(axes: Array, factor: Array, vector: Array) -> Array:
    """Vectors (s, 3), each part along one of the own ``axes`` (s, 3, 3), which are columns, times its factor (s, 3)."""
    own = factor * np.einsum("sij,si->sj", axes, vector)
    return np.asarray(np.einsum("sij,sj->si", axes, own))


def cross(a: Array, b: Array) -> Array:
    """Cross products of rows: (s, 1) in the plane, (s, 3) in space."""
    if a.shape[1] == 2:
        return (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])[:, None]
    return np.cross(a, b)


def turned(w: Array, arm: Array) -> Array:
    """Velocities w x arm of rows."""
    if arm.shape[1] == 2:
        return np.column_stack([-w[:, 0] * arm[:, 1], w[:, 0] * arm[:, 0]])
    return np.cross(w, arm)
