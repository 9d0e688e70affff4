"""Lasting contact: constant forces while bodies lie, slide or roll, and when sliding ends (O13 to O15)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from reference_solver.exact_contact import MOST_WITH_FRICTION, MOST_WITHOUT, coulomb_solutions, frictionless_solutions
from reference_solver.model import Array
from tests.verification.event_driven.bodies import PLANE, Bodies
from tests.verification.event_driven.contacts import Contact, Geometry, Key, Rows
from tests.verification.event_driven.errors import ContactParadox, LeavesClosedForm
from tests.verification.event_driven.flight import Flight

#: Relative speeds below this share of the bodies' speeds are round-off: 64 units in the last place.
STILL = 64.0 * 2.220446049250313e-16
#: Accelerations below this share of the loads are round-off of a small linear system.
BALANCED = 1e-12


class Rest:
    """Contacts that press, and the accelerations that they leave to their bodies.

    Attributes
    ----------
    sticking
        Pressing contact -> time [s] at which its sliding ends; inf where it does not slide or never stops.
    solutions
        Smallest and largest number of solutions that a problem of forces had.
    """

    def __init__(self, bodies: Bodies, flight: Flight, geometry: Geometry) -> None:
        self.bodies, self.flight, self.geometry = bodies, flight, geometry
        self.sticking: dict[Key, float] = {}
        self.solutions = (1, 1)

    def settle(self, changed: Sequence[int], t: float) -> set[int]:
        """Find forces anew around bodies whose velocity changed at t; return all bodies whose flight changed.

        Raises
        ------
        LeavesClosedForm, ContactParadox
            If what follows has no closed form, or no solution.
        """
        group, contacts = self._group(changed, t)
        for key in [key for key in self.sticking if key[0] in group or key[1] in group]:
            del self.sticking[key]
            self._skip(key, 0)
        for i in group:
            self.flight.anchor(i, t)
            self.flight.a0[i], self.flight.b0[i] = self.bodies.load[i], self.bodies.turning_load[i]
        if contacts:
            self._press(contacts, t)
        return group

    def stick(self, key: Key, t: float) -> set[int]:
        """End the sliding of a contact at t."""
        contact = next(c for c in self.geometry.between(key[0], key[1], t, always=True) if c.key == key)
        body = contact.b if self.bodies.free[contact.b] else contact.a
        for i in (contact.a, contact.b):
            self.flight.anchor(i, t)
        slip, _size = self._slip(contact)
        if self.bodies.box == body:
            self.flight.v0[body] -= (1.0 if body == contact.b else -1.0) * slip
        else:
            self._stop_ball(contact, slip)
        return self.settle([i for i in (contact.a, contact.b) if self.bodies.free[i]], t)

    def _stop_ball(self, c: Contact, slip: Array) -> None:
        """Take away the last slip, which is round-off, by the impulse that a contact of balls needs for it."""
        b, f = self.bodies, self.flight
        k = b.inverse_mass[c.a] + b.inverse_mass[c.b]
        for body, lever in ((c.a, c.lever_a), (c.b, c.lever_b)):
            k += lever @ lever * b.inverse_inertia[body]
        for body, lever, sign in ((c.a, c.lever_a, 1.0), (c.b, c.lever_b, -1.0)):
            f.v0[body] += sign * b.inverse_mass[body] / k * slip
            f.w0[body] += sign * b.inverse_inertia[body] / k * b.turn(lever, slip)

    def _slip(self, c: Contact) -> tuple[Array, float]:
        """Tangential velocity of b against a (d,) at anchors, and the speeds that made it."""
        f = self.flight
        u = f.v0[c.b] - f.v0[c.a] + _swept(f.w0[c.b], c.lever_b) - _swept(f.w0[c.a], c.lever_a)
        size = sum(float(np.abs(f.v0[i]).sum()) for i in (c.a, c.b))
        size += float(np.abs(_swept(f.w0[c.b], c.lever_b)).sum() + np.abs(_swept(f.w0[c.a], c.lever_a)).sum())
        return u - (u @ c.normal) * c.normal, size

    def _group(self, changed: Sequence[int], t: float) -> tuple[set[int], list[Contact]]:
        """Free bodies that are connected with the changed ones by contacts at rest along their normal."""
        group, waiting = set(changed), list(changed)
        contacts: dict[Key, Contact] = {}
        known: set[tuple[int, int]] = set()
        while waiting:
            for c in self.geometry.around(waiting.pop(), t, known):
                known.add((c.a, c.b))
                if not self._still(c, t):
                    continue
                contacts[c.key] = c
                for i in (c.a, c.b):
                    if self.bodies.free[i] and i not in group:
                        group.add(i)
                        waiting.append(i)
        return group, [contacts[key] for key in sorted(contacts)]

    def _still(self, c: Contact, t: float) -> bool:
        f = self.flight
        va, vb = f.velocity(c.a, t), f.velocity(c.b, t)
        sa, sb = _swept(f.spin(c.a, t), c.lever_a), _swept(f.spin(c.b, t), c.lever_b)
        size = sum(float(np.abs(part).sum()) for part in (va, vb, sa, sb))
        return abs(float(c.normal @ (vb + sb - va - sa))) <= STILL * size

    def _press(self, contacts: list[Contact], t: float) -> None:
        """Set the accelerations of a group from the forces of its contacts."""
        mu = [float(self.bodies.friction[c.a, c.b]) for c in contacts]
        slips = [self._slip(c) for c in contacts]
        slides = [float(np.abs(slip).max()) > STILL * size for slip, size in slips]
        if any(mu) and self.bodies.spatial():
            pressing = self._rough_spatial(contacts, mu[0], slips[0][0], slides[0], t)
        else:
            pressing = self._planar_or_smooth(contacts, mu, [slip for slip, _ in slips], slides, t)
        for k, c in enumerate(contacts):
            if pressing[k]:
                self._require_straight(c, t)
                self.sticking[c.key] = self._end_of_slide(c, slips[k][0], slides[k] and mu[k] > 0.0, t)
                self._skip(c.key, 1)

    def _planar_or_smooth(
        self, contacts: list[Contact], mu: list[float], slips: list[Array], slides: list[bool], t: float
    ) -> list[bool]:
        rough = any(mu)
        most = MOST_WITH_FRICTION if rough else MOST_WITHOUT
        if len(contacts) > most:
            raise LeavesClosedForm(t, f"{len(contacts)} contacts press at once, enumeration ends at {most}")
        rows = Rows(self.bodies, contacts, tangential=rough)
        free = rows.relative(self.flight.a0, self.flight.b0)
        free[:: rows.width] += [self._centrifugal(c, slip) for c, slip in zip(contacts, slips, strict=True)]
        if rough:
            tangents = [direction for _c, direction in rows.directions[1::2]]
            signs = [
                math.copysign(1.0, s @ n) if moving else 0.0
                for s, n, moving in zip(slips, tangents, slides, strict=True)
            ]
            found = coulomb_solutions(rows.matrix, free, mu, signs)
        else:
            found = frictionless_solutions(rows.matrix, free)
        self.solutions = min(self.solutions[0], len(found)), max(self.solutions[1], len(found))
        if not found:
            raise ContactParadox(t, "the forces of lasting contact have no solution: an impact without collision")
        force = min(found, key=lambda solution: float(np.abs(solution.impulse).sum())).impulse
        linear, angular = rows.response(force.ravel())
        parts, turning_parts = rows.bound(force.ravel())
        for k, i in enumerate(rows.involved):
            _add_balanced(self.flight.a0[i], linear[k], parts[k])
            _add_balanced(self.flight.b0[i], angular[k], turning_parts[k])
        scale = BALANCED * max(float(np.abs(force).max()), 1e-300)
        return [float(f[0]) > scale for f in force]

    def _rough_spatial(self, contacts: list[Contact], mu: float, slip: Array, slides: bool, t: float) -> list[bool]:
        """A sphere on a plane: slides straight, or sticks and rolls (O14)."""
        c, b, f = contacts[0], self.bodies, self.flight
        if len(contacts) > 1 or PLANE not in (b.kind[c.a], b.kind[c.b]):
            raise LeavesClosedForm(t, "with friction and in space only one sphere on one plane has a closed form")
        ball, lever, sign = (c.b, c.lever_b, 1.0) if b.free[c.b] else (c.a, c.lever_a, -1.0)
        rate = sign * (f.a0[ball] + _swept(f.b0[ball], lever))
        normal = -float(c.normal @ rate) / b.inverse_mass[ball]
        if normal <= 0.0:
            return [False]
        rate = rate - (c.normal @ rate) * c.normal
        k = b.inverse_mass[ball] + lever @ lever * b.inverse_inertia[ball]
        force = -rate / k
        if slides or np.linalg.norm(force) > mu * normal:
            along = slip / np.linalg.norm(slip) if slides else rate / np.linalg.norm(rate)
            if np.abs(rate - (rate @ along) * along).max() > BALANCED * float(np.abs(b.load[ball]).max()):
                raise LeavesClosedForm(t, "the direction of sliding turns: gravity pulls across it")
            force = -mu * normal * along
        force = sign * (force + normal * c.normal)
        f.a0[ball] += b.inverse_mass[ball] * force
        f.b0[ball] += b.inverse_inertia[ball] * b.turn(lever, force)
        return [True]

    def _centrifugal(self, c: Contact, slip: Array) -> float:
        """Opening acceleration of a contact whose bodies move past each other [m/s^2] (O15)."""
        f, b = self.flight, self.bodies
        if b.box in (c.a, c.b):
            i, lever, sign = (c.a, c.lever_a, -1.0) if b.box == c.a else (c.b, c.lever_b, 1.0)
            return float(-sign * f.w0[i, 0] ** 2 * (c.normal @ lever))
        if PLANE in (b.kind[c.a], b.kind[c.b]):
            return 0.0
        v = f.v0[c.b] - f.v0[c.a]
        across = v - (v @ c.normal) * c.normal
        return float(across @ across / (b.radius[c.a] + b.radius[c.b]))

    def _require_straight(self, c: Contact, t: float) -> None:
        """Pressing contacts stay in closed form where their normal and levers do not turn."""
        f, b = self.flight, self.bodies
        load = BALANCED * max(float(np.abs(b.load[[c.a, c.b]]).max()), float(np.abs(f.a0[[c.a, c.b]]).max()))
        if b.box in (c.a, c.b):
            i = b.box
            if abs(f.b0[i, 0]) * b.reach[i] > load or f.w0[i, 0] != 0.0 or PLANE not in (b.kind[c.a], b.kind[c.b]):
                raise LeavesClosedForm(t, "the box turns about a contact that presses")
            f.b0[i, 0] = 0.0
            return
        if PLANE in (b.kind[c.a], b.kind[c.b]):
            return
        for change, bound in (
            (f.v0[c.b] - f.v0[c.a], STILL * float(np.abs(f.v0[[c.a, c.b]]).max())),
            (f.a0[c.b] - f.a0[c.a], load),
        ):
            if np.abs(change - (change @ c.normal) * c.normal).max() > bound:
                raise LeavesClosedForm(t, "a ball moves over another that it presses on")

    def _end_of_slide(self, c: Contact, slip: Array, slides: bool, t: float) -> float:
        """Time at which the slip of a contact reaches zero [s]."""
        if not slides:
            return math.inf
        f = self.flight
        rate = f.a0[c.b] - f.a0[c.a] + _swept(f.b0[c.b], c.lever_b) - _swept(f.b0[c.a], c.lever_a)
        along = float(rate @ slip)
        return t - float(slip @ slip) / along if along < 0.0 else math.inf

    def _skip(self, key: Key, value: int) -> None:
        if self.bodies.box not in key[:2]:
            self.bodies.skipped[key[0], key[1]] = self.bodies.skipped[key[1], key[0]] = value


def _add_balanced(acceleration: Array, change: Array, parts: Array) -> None:
    """Add, in place; forces in balance leave nothing, where round-off would move resting bodies with t^2."""
    bound = STILL * (np.abs(acceleration).max() + parts.max())
    acceleration += change
    acceleration[np.abs(acceleration) <= bound] = 0.0


def _swept(spin: Array, lever: Array) -> Array:
    """Return omega x r (d,)."""
    if len(lever) == 3:
        return np.cross(spin, lever)
    return spin[0] * np.array([-lever[1], lever[0]])
