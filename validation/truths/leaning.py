r"""What leans on its contacts and turns from rest: one angle, whose acceleration knows the angle and the spin's square.

            /       phi'' = a(phi, phi'^2)           d(phi'^2)/d(phi) = 2 a(phi, phi'^2)
           /
          /         time = integral of d(phi)/phi',  singular where it starts from rest:
    =====/=====     phi = start + (end - start) s^2  takes that out

Ends that slide with Coulomb's friction are of this kind as long as none stops or lifts: friction is a share of a force
that angle and spin decide. There is no energy to keep, so the square is integrated step by step.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

#: Steps of the classical method of fourth order: twice as many change nothing at 1e-9.
STEPS = 200

#: ``rates(angle, square)`` of an angle [rad] and the square of its rate [1/s^2]: its acceleration [rad/s^2], and
#: something else whose integral over time is asked.
Rates = Callable[[float, float], tuple[float, float]]


@dataclass(frozen=True)
class Turn:
    """A turn from rest: time [s] and |phi'| [rad/s] at its end, what was integrated on the way, and the path.

    ``path`` is the integral of |phi'| d(phi) [rad^2/s]: half of it times arm and step is what steps of first order
    carry a contact away.
    """

    time: float
    spin: float
    gathered: float
    path: float


def turn(rates: Rates, start: float, end: float) -> Turn | None:
    """Turn from rest at ``start`` to ``end`` [rad]; None if it does not go there."""
    way = end - start

    def slopes(s: float, under: float) -> tuple[float, float, float]:
        """Of phi'^2/s^2, of the time and of what is gathered."""
        acceleration, gained = rates(start + way * s * s, max(0.0, under) * s * s)
        pace = 2.0 * abs(way) / math.sqrt(under) if under > 0.0 else math.nan
        return 0.0 if s == 0.0 else (4.0 * acceleration * way - 2.0 * under) / s, pace, gained * pace

    step, time, gathered, path = 1.0 / STEPS, 0.0, 0.0, 0.0
    under = 2.0 * rates(start, 0.0)[0] * way  # phi'^2/s^2 of a start with a constant acceleration
    for k in range(STEPS):
        s, before = k * step, k * step * math.sqrt(max(0.0, under))
        one = slopes(s, under)
        two = slopes(s + 0.5 * step, under + 0.5 * step * one[0])
        three = slopes(s + 0.5 * step, under + 0.5 * step * two[0])
        four = slopes(s + step, under + step * three[0])
        under, time, gathered = (
            total + step / 6.0 * (one[i] + 2.0 * (two[i] + three[i]) + four[i])
            for i, total in enumerate((under, time, gathered))
        )
        path += 0.5 * abs(way) * ((s + step) ** 2 - s * s) * (before + (s + step) * math.sqrt(max(0.0, under)))
    return None if math.isnan(time) else Turn(time, math.sqrt(under), gathered, path)
