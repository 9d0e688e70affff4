"""Contacts at one instant: where, which way, and the matrix that maps impulses to velocities (O7)."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from reference_solver.model import Array
from tests.verification.event_driven.bodies import BOX, PLANE, Bodies
from tests.verification.event_driven.box import BoxGaps
from tests.verification.event_driven.flight import Flight
from tests.verification.event_driven.prediction import Flown, touch_length, touching

#: (body_a, body_b, feature): the same contact at another instant has the same key.
Key = tuple[int, int, int]


@dataclass(frozen=True)
class Contact:
    """Touching point of bodies a < b: unit ``normal`` (d,) from a to b, ``levers`` of a and b (d,) [m]."""

    a: int
    b: int
    feature: int
    normal: Array
    lever_a: Array
    lever_b: Array
    gap: float

    @property
    def key(self) -> Key:
        """Bodies and feature."""
        return self.a, self.b, self.feature


class Geometry:
    """Finds contacts along the flight."""

    def __init__(self, bodies: Bodies, flight: Flight) -> None:
        self.bodies, self.flight = bodies, flight
        self.box = BoxGaps(bodies, flight) if bodies.box >= 0 else None
        self._found = np.zeros(bodies.count, np.int64)

    def flown(self) -> Flown:
        """What kernels read of the flight and the shapes."""
        f, b = self.flight, self.bodies
        return Flown(b.kind, f.x0, f.v0, f.a0, f.t0, f.late, b.radius, b.normal, b.offset)

    def overlapping(self, i: int, t: float) -> list[int]:
        """Bodies that body i overlaps with by more than round-off."""
        count = touching(i, t, -1.0, self.flown(), self._found)
        found = [int(j) for j in self._found[:count]]
        if self.box is not None:
            partners = self.box.partners() if i == self.box.box else [self.box.box]
            deepest = {j: min(c.gap for c in self.between(i, j, t, always=True)) for j in partners if j != i}
            found += [j for j, gap in deepest.items() if gap < -self.box.touch(j if i == self.box.box else i, t)]
        return found

    def around(self, i: int, t: float, known: Collection[tuple[int, int]] = ()) -> list[Contact]:
        """Contacts of body i at time t, sorted by key; without those of the ``known`` pairs of bodies."""
        count = touching(i, t, 1.0, self.flown(), self._found)
        partners = [int(j) for j in self._found[:count] if self.bodies.free[i] or self.bodies.free[j]]
        if self.box is not None:
            partners += self.box.partners() if i == self.box.box else [self.box.box]
        partners = [j for j in partners if (min(i, j), max(i, j)) not in known]
        found = [contact for j in partners for contact in self.between(i, j, t)]
        return sorted(found, key=lambda contact: contact.key)

    def between(self, i: int, j: int, t: float, always: bool = False) -> list[Contact]:
        """Contacts of two bodies at time t; ``always``: the nearest point counts whatever its gap."""
        a, b = min(i, j), max(i, j)
        kind = self.bodies.kind
        if BOX in (kind[a], kind[b]):
            return self._box_contacts(a, b, t, always)
        contact = self._plane_contact(a, b, t) if PLANE in (kind[a], kind[b]) else self._ball_contact(a, b, t)
        touch = touch_length(a, b, t, self.flight.x0, self.flight.v0, self.bodies.reach, self.bodies.offset)
        return [contact] if always or contact.gap <= touch else []

    def _ball_contact(self, a: int, b: int, t: float) -> Contact:
        across = self.flight.position(b, t) - self.flight.position(a, t)
        distance = float(np.sqrt(across @ across))
        normal = across / distance
        ra, rb = self.bodies.radius[a], self.bodies.radius[b]
        return Contact(a, b, 0, normal, ra * normal, -rb * normal, distance - float(ra + rb))

    def _plane_contact(self, a: int, b: int, t: float) -> Contact:
        ball, plane = (a, b) if self.bodies.kind[b] == PLANE else (b, a)
        n, radius = self.bodies.normal[plane], float(self.bodies.radius[ball])
        across = self.flight.position(ball, t) - self.flight.position(plane, t)
        gap = float(n @ across - self.bodies.offset[plane]) - radius
        return self._one_sided(ball, plane, 0, n, -radius * n, gap)

    def _one_sided(self, body: int, plane: int, feature: int, n: Array, lever: Array, gap: float) -> Contact:
        """Contact with a plane, which does not turn, so that its own lever is of no consequence."""
        none = np.zeros_like(lever)
        if plane < body:
            return Contact(plane, body, feature, n, none, lever, gap)
        return Contact(body, plane, feature, -n, lever, none, gap)

    def _box_contacts(self, a: int, b: int, t: float, always: bool) -> list[Contact]:
        assert self.box is not None
        i = self.box.box
        j = b if a == i else a
        touch = self.box.touch(j, t)
        if self.bodies.kind[j] == PLANE:
            gaps, levers = self.box.corner_gaps(j, t), self.box.levers(t)
            reach = max(touch, float(gaps.min())) if always else touch
            n = self.bodies.normal[j]
            return [self._one_sided(i, j, k, n, levers[k], float(gaps[k])) for k in range(4) if gaps[k] <= reach]
        gap, lever, n = self.box.nearest(j, t)
        if gap > touch and not always:
            return []
        disc_lever = -self.bodies.radius[j] * n
        if i < j:
            return [Contact(i, j, 0, n, lever, disc_lever, gap)]
        return [Contact(j, i, 0, -n, disc_lever, lever, gap)]


class Rows:
    """Velocity rows of a set of contacts: along normals, and along tangents where the problem is planar.

    Parameters
    ----------
    contacts
        c contacts.
    tangential
        Whether each contact has a tangential row (planar only: the normal turned by +90 degrees).
    """

    def __init__(self, bodies: Bodies, contacts: Sequence[Contact], tangential: bool) -> None:
        self.bodies = bodies
        self.involved = sorted({body for c in contacts for body in (c.a, c.b)})
        self.width = 2 if tangential else 1
        self.directions = []
        for c in contacts:
            self.directions.append((c, c.normal))
            if tangential:
                self.directions.append((c, np.array([-c.normal[1], c.normal[0]])))
        d, r = bodies.dimension, 3 if bodies.spatial() else 1
        where = {body: k * (d + r) for k, body in enumerate(self.involved)}
        self.jacobian = np.zeros((len(self.directions), len(where) * (d + r)))
        for row, (c, direction) in enumerate(self.directions):
            for body, lever, sign in ((c.a, c.lever_a, -1.0), (c.b, c.lever_b, 1.0)):
                at = where[body]
                self.jacobian[row, at : at + d] = sign * direction
                self.jacobian[row, at + d : at + d + r] = sign * bodies.turn(lever, direction)
        weights = [[bodies.inverse_mass[k]] * d + [bodies.inverse_inertia[k]] * r for k in self.involved]
        self.inverse = np.array(weights).ravel()
        self.matrix = (self.jacobian * self.inverse) @ self.jacobian.T

    def relative(self, linear: Array, angular: Array) -> Array:
        """Relative velocity (or acceleration) along each row, from (n, d) and (n, r) of all bodies."""
        motion = np.concatenate([linear[self.involved], angular[self.involved]], axis=1)
        result: Array = self.jacobian @ motion.ravel()
        return result

    def bound(self, impulse: Array) -> tuple[Array, Array]:
        """Sizes of the parts that `response` sums, which its round-off is proportional to."""
        d = self.bodies.dimension
        parts = (self.inverse * (np.abs(self.jacobian).T @ np.abs(impulse))).reshape(len(self.involved), -1)
        return parts[:, :d], parts[:, d:]

    def response(self, impulse: Array) -> tuple[Array, Array]:
        """Change of linear (k, d) and angular (k, r) velocity of the involved bodies."""
        d = self.bodies.dimension
        change = (self.inverse * (self.jacobian.T @ impulse)).reshape(len(self.involved), -1)
        return change[:, :d], change[:, d:]

    def vectors(self, impulse: Array) -> list[Array]:
        """Impulse on body b of each contact as a vector (d,)."""
        parts = [p * direction for p, (_c, direction) in zip(impulse, self.directions, strict=True)]
        return [sum(parts[k : k + self.width]) for k in range(0, len(parts), self.width)]
