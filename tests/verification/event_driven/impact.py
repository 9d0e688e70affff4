"""Impacts under the declared law: all contacts at once (N-SIM) or one after the other (N-SEQ) (O8 to O12)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from reference_solver.exact_contact import (
    MOST_WITH_FRICTION,
    MOST_WITHOUT,
    ContactSolution,
    coulomb_solutions,
    frictionless_solutions,
)
from reference_solver.model import Array
from tests.verification.event_driven.bodies import Bodies
from tests.verification.event_driven.contacts import Contact, Rows
from tests.verification.event_driven.errors import ContactParadox, LeavesClosedForm
from tests.verification.event_driven.flight import Flight

#: A rebound slower than this share of the fastest impact that its bodies ever had ends an accumulation of impacts:
#: what is left of it is below round-off in position (its square) and in time.
REST_SPEED = 1e-13

#: A sum below this share of its parts is zero: 16 units in the last place.
CANCELLED = 16.0 * 2.220446049250313e-16


@dataclass(frozen=True)
class Struck:
    """What an impact did at one contact.

    Parameters
    ----------
    contact
        Where.
    impulse
        (d,) on body b [N s].
    approach
        Normal velocity before [m/s], negative.
    work
        Kinetic energy gained through this contact, 1/2 p . (u+ + u-) [J]; above zero is Kane's paradox.
    solutions
        How many solutions the law has.
    came_to_rest
        Whether an accumulation of impacts was ended here.
    """

    contact: Contact
    impulse: Array
    approach: float
    work: float
    solutions: int
    came_to_rest: bool


class Impacts:
    """Applies impacts to the anchors of a flight.

    Attributes
    ----------
    fastest
        (n,) largest approach speed of an impact per body so far [m/s].
    """

    def __init__(self, bodies: Bodies, flight: Flight) -> None:
        self.bodies, self.flight = bodies, flight
        self.fastest = np.zeros(bodies.count)

    def resolve(self, contacts: Sequence[Contact], t: float) -> list[Struck]:
        """Solve all ``contacts`` together, change the velocities of bodies anchored at t, and tell.

        Raises
        ------
        ContactParadox
            If the law has no solution.
        LeavesClosedForm
            For several spatial contacts with friction.
        """
        bodies, flight = self.bodies, self.flight
        friction = [float(bodies.friction[c.a, c.b]) for c in contacts]
        rough = any(friction)
        if len(contacts) == 1 and not rough and bodies.box not in (contacts[0].a, contacts[0].b):
            return [self._central(contacts[0])]
        if rough and bodies.spatial():
            return self._rough_spatial(contacts, friction[0], t)
        rows = Rows(bodies, contacts, tangential=rough)
        before = rows.relative(flight.v0, flight.w0)
        approach = before[:: rows.width]
        restitution, resting = self._restitution(contacts, approach)
        free = before.copy()
        free[:: rows.width] += restitution * np.minimum(approach, 0.0)
        impulse, count = _solve(rows, free, friction, t)
        self._apply(rows, impulse)
        middle = before + 0.5 * (rows.matrix @ impulse)
        work = (impulse * middle).reshape(-1, rows.width).sum(axis=1)
        vectors = rows.vectors(impulse)
        return [
            Struck(c, vectors[k], float(approach[k]), float(work[k]), count, bool(resting[k]))
            for k, c in enumerate(contacts)
        ]

    def _restitution(self, contacts: Sequence[Contact], approach: Array) -> tuple[Array, Array]:
        """Restitution of each contact, zero where the rebound is too slow to tell from rest; and where that was so."""
        e = np.array([self.bodies.restitution[c.a, c.b] for c in contacts])
        resting = np.zeros(len(contacts), bool)
        for k, c in enumerate(contacts):
            if approach[k] < 0.0:
                self.fastest[[c.a, c.b]] = np.maximum(self.fastest[[c.a, c.b]], -approach[k])
                reference = max(self.fastest[c.a], self.fastest[c.b])
                resting[k] = 0.0 < -e[k] * approach[k] < REST_SPEED * reference
        return np.where(resting, 0.0, e), resting

    def _central(self, c: Contact) -> Struck:
        """Smooth impact of two balls, or of a ball and a plane: S-A2, the case that long runs consist of."""
        v, inverse_a, inverse_b = self.flight.v0, self.bodies.inverse_mass[c.a], self.bodies.inverse_mass[c.b]
        approach = float(c.normal @ (v[c.b] - v[c.a]))
        e, resting = self._restitution((c,), np.array([approach]))
        size = float((1.0 + e[0]) * max(-approach, 0.0) / (inverse_a + inverse_b))
        impulse = size * c.normal
        v[c.a] -= inverse_a * impulse
        v[c.b] += inverse_b * impulse
        work = 0.5 * size * (1.0 - float(e[0])) * approach
        return Struck(c, impulse, approach, work, 1, bool(resting[0]))

    def _apply(self, rows: Rows, impulse: Array) -> None:
        """Change velocities; what is left of parts that cancel is zero, or flat boxes would turn by round-off."""
        pairs = zip((self.flight.v0, self.flight.w0), rows.response(impulse), rows.bound(impulse), strict=True)
        for velocity, change, bound in pairs:
            before = velocity[rows.involved]
            after = before + change
            velocity[rows.involved] = np.where(np.abs(after) <= CANCELLED * (np.abs(before) + bound), 0.0, after)

    def _rough_spatial(self, contacts: Sequence[Contact], mu: float, t: float) -> list[Struck]:
        """Coulomb's law at one contact of spheres, in closed form: stick or slip (O12)."""
        if len(contacts) > 1:
            raise LeavesClosedForm(t, "several spatial contacts with friction at once have no closed form here")
        c, bodies, flight = contacts[0], self.bodies, self.flight
        k_normal = bodies.inverse_mass[c.a] + bodies.inverse_mass[c.b]
        k_tangent = k_normal
        u = flight.v0[c.b] - flight.v0[c.a]
        for body, lever, sign in ((c.b, c.lever_b, 1.0), (c.a, c.lever_a, -1.0)):
            u = u + sign * np.cross(flight.w0[body], lever)
            k_tangent = k_tangent + lever @ lever * bodies.inverse_inertia[body]
        approach = float(c.normal @ u)
        tangential = u - approach * c.normal
        e, resting = self._restitution(contacts, np.array([approach]))
        normal = max(-(approach + e[0] * min(approach, 0.0)) / k_normal, 0.0)
        slip, needed = float(np.linalg.norm(tangential)), float(np.linalg.norm(tangential)) / k_tangent
        share = 1.0 if needed <= mu * normal else mu * normal / needed
        impulse = normal * c.normal - (share / k_tangent if slip > 0.0 else 0.0) * tangential
        for body, lever, sign in ((c.b, c.lever_b, 1.0), (c.a, c.lever_a, -1.0)):
            flight.v0[body] += sign * bodies.inverse_mass[body] * impulse
            flight.w0[body] += sign * bodies.inverse_inertia[body] * np.cross(lever, impulse)
        after = (1.0 - share) * tangential + (approach + k_normal * normal) * c.normal
        return [Struck(c, impulse, approach, float(0.5 * impulse @ (u + after)), 1, bool(resting[0]))]


def _solve(rows: Rows, free: Array, friction: Sequence[float], t: float) -> tuple[Array, int]:
    """Impulses of the law's solution, the smallest where there are several, and how many there are."""
    if len(free) == 1:
        return np.maximum(-free / rows.matrix[0], 0.0), 1
    most = MOST_WITHOUT if rows.width == 1 else MOST_WITH_FRICTION
    if len(friction) > most:
        raise LeavesClosedForm(t, f"{len(friction)} contacts at once, enumeration ends at {most}")
    found: list[ContactSolution]
    if rows.width == 1:
        found = frictionless_solutions(rows.matrix, free)
    else:
        found = coulomb_solutions(rows.matrix, free, friction)
    if not found:
        raise ContactParadox(t, f"the impact law has no solution at {len(friction)} contacts")
    best = min(found, key=lambda solution: float(np.abs(solution.impulse).sum()))
    return best.impulse.ravel(), len(found)
