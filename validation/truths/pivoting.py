r"""Boxes that turn about an edge on the floor: one angle, and its time.

       ,+.             phi: of the line from the edge to the centre against the vertical, clockwise
      +   \ c          phi'' = p^2 sin(phi),  p^2 = m g rho/(I + m rho^2) = 3 g/(4 rho) of a uniform box
       \   \/          phi'^2 = start^2 + 2 p^2 (cos(phi_0) - cos(phi))
        \  / \         rho = half the diagonal,  alpha = atan(width/height): phi = -alpha is upright
         \/rho +
    ======+===========

A step moves the centre along the tangent and turns the box, which moves the edge by rho (w dt)^2/2 a step towards the
centre. Gravity reverses the upward part; the part along the floor stays.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from validation import bounds
from validation.canonical import Check
from validation.truths.quadrature import gauss

#: Nodes of the quadrature: the integrands are smooth, and twice as many change nothing at 1e-13.
NODES = 64


@dataclass(frozen=True)
class Pivot:
    """A uniform box on one of its edges under gravity ``g`` [m/s^2]; ``width`` and ``height`` [m]."""

    width: float
    height: float
    g: float

    @property
    def arm(self) -> float:
        """Distance rho of the centre from the edge [m]."""
        return 0.5 * math.hypot(self.width, self.height)

    @property
    def alpha(self) -> float:
        """Angle between the diagonal and the sides [rad]."""
        return math.atan2(self.width, self.height)

    @property
    def rate(self) -> float:
        """p^2 [1/s^2]."""
        return 0.75 * self.g / self.arm

    def speed(self, start: float, spin: float, angle: float) -> float:
        """|phi'| [rad/s] at ``angle``, with ``spin`` at ``start`` [rad]; 0 at angles that it does not reach."""
        return math.sqrt(max(0.0, spin**2 + 2.0 * self.rate * (math.cos(start) - math.cos(angle))))

    def time(self, start: float, spin: float, angle: float) -> float:
        """Time [s] from ``start`` with ``spin`` to ``angle`` [rad] without turning back; a start at rest is allowed.

        The integral of d phi/phi' is singular where the box is at rest: ``phi = start + (angle - start) s^2`` takes
        that out.
        """
        s, weight = _nodes()
        way = angle - start
        # cos(a) - cos(b) = 2 sin((a + b)/2) sin((b - a)/2), without the loss of digits near the start
        turned = way * s * s
        gained = 2.0 * np.sin(start + 0.5 * turned) * np.sin(0.5 * turned)
        return float(weight @ (2.0 * abs(way) * s / np.sqrt(spin**2 + 2.0 * self.rate * gained)))

    def grip(self, start: float, spin: float, angle: float) -> tuple[float, float]:
        """Friction and normal force of the edge over the weight, the friction towards the side it falls to."""
        square = self.speed(start, spin, angle) ** 2 * self.arm / self.g
        turning = 0.75 * math.sin(angle)  # rho phi''/g
        return (
            turning * math.cos(angle) - square * math.sin(angle),
            1.0 - turning * math.sin(angle) - square * math.cos(angle),
        )

    def carried_away(self, start: float, spin: float, angle: float, dt: float) -> float:
        """Motion of the edge by steps of ``dt`` [s] between two angles [m]: rho dt/2 times the integral of w^2."""
        s, weight = _nodes()
        speeds = [self.speed(start, spin, start + (angle - start) * float(each)) for each in s]
        return 0.5 * self.arm * dt * abs(angle - start) * float(weight @ np.array(speeds))

    def spin_off(self, start: float, spin: float, angle: float, dt: float, off: float = 0.0) -> float:
        """Error of the spin at ``angle`` [rad/s] by steps of ``dt`` [s], from a start with ``spin``.

        The spin at the start has the error ``off`` [rad/s] and 1.5 steps of acceleration: half a step by the order of
        the scheme, one for a contact found late. That and the motion of the edge change the energy; the spin is read
        with the same error.
        """
        kick = off + 1.5 * dt * self.rate * math.sin(max(abs(start), abs(angle)))
        carried = self.carried_away(start, spin, angle, dt) + self.g * dt * dt
        energy = spin * kick + 0.5 * kick**2 + self.rate * carried / self.arm
        there = self.speed(start, spin, angle)
        return math.sqrt(there**2 + 2.0 * energy) - there + 1.5 * dt * self.rate * abs(math.sin(angle))

    def time_off(self, start: float, spin: float, angle: float, dt: float, off: float = 0.0) -> float:
        """Error of the time [s] for an error of the initial spin as in `spin_off`.

        Infinite where a box that much slower does not arrive.
        """
        kick = off + 1.5 * dt * self.rate * math.sin(max(abs(start), abs(angle)))
        kick += self.rate * (self.carried_away(start, spin, angle, dt) + self.g * dt * dt) / (self.arm * spin)
        top = 0.0 if start < 0.0 < angle else (start if abs(start) < abs(angle) else angle)
        if self.speed(start, max(0.0, spin - kick), top) == 0.0:
            return math.inf
        true = self.time(start, spin, angle)
        return max(abs(self.time(start, spin + side * kick, angle) - true) for side in (-1.0, 1.0))


def fall_checks(
    on: Pivot,
    start: float,
    end: float,
    dt: float,
    truth: Mapping[str, float],
    tilted: float = 0.0,
    spin: float = 0.0,
) -> list[Check]:
    """Checks of a box that falls over a fixed edge: time and spin at ``end``, motion of the edge.

    For first-order schemes whose contact may be found one step late: half a step of acceleration by the order of the
    scheme, and a whole one where a contact is found late, at the start or after the edge left the floor: 1.5 dt in
    time, and 1.5 steps in spin. Motion of the edge raises the centre or changes its lever arm: energy m g times that,
    and its share of the torque. A start with the tolerance ``tilted`` [rad] has the time of another start. One with
    ``spin`` [rad/s] has the error of `Pivot.spin_off`, and the time of another spin.
    """
    g, passing = on.g, truth["passing_spin"]
    carried = on.carried_away(start, spin, end, dt) + g * dt * dt
    other = 0.0 if tilted == 0.0 else abs(on.time(max(start - tilted, 0.1 * start), 0.0, end) - truth["passing_time"])
    sharp = 1.5 * dt * on.rate * math.sin(end) + on.rate / (on.arm * passing) * carried
    if spin > 0.0:
        other, sharp = on.time_off(start, spin, end, dt), on.spin_off(start, spin, end, dt)
    moved = bounds.Bound(
        carried + bounds.ROUND_OFF * on.arm,
        "a step turns the box and moves its centre along the tangent: rho (w dt)^2/2 each; g dt^2",
    )
    time = bounds.Bound(
        1.5 * dt + truth["passing_time"] * carried / on.arm + other,
        "half a step by the order of the scheme, one for a contact found late, and the torque of an edge that moved",
    )
    speed = bounds.Bound(
        sharp,
        "half a step of the acceleration by the order of the scheme, one for a contact found late, and an edge that "
        "moved",
    )
    source = "energy of a pendulum that is held by an edge; its integral"
    return [
        time.check("passing_time", "s", truth["passing_time"], source),
        speed.check("passing_spin", "rad/s", truth["passing_spin"], source),
        moved.check("edge_moved", "m", truth["edge_moved"], source),
    ]


#: Meaning of these metrics, in words.
WORDS = {
    "passing_time": "falls through the angle after {value}",
    "passing_spin": "turns with {value} there",
    "edge_moved": "its edge moves by {value}",
}


def _nodes() -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights of Gauss' rule on [0, 1]."""
    x, weight = gauss(NODES)
    return 0.5 * (x + 1.0), 0.5 * weight
