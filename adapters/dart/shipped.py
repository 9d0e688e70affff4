"""Defaults of DART."""

from __future__ import annotations

from dataclasses import dataclass

#: Compliance of a contact, as a share of its own response. [`ContactConstraint`, constraint force mixing]
MIXING = 1e-5
#: Threshold and largest speed of a rebound [m/s]. [`ContactConstraint`, bouncing velocity threshold, maximal bouncing
#: velocity; measured: with e = 0.2 no rebound from 0.499 m/s, but from 0.501 m/s; with e = 0.8 150 m/s rebound at 100
#: m/s]
THRESHOLD, FASTEST = 0.1, 100.0
#: Threshold of friction. [`ContactConstraint`, friction coefficient threshold; measured: no effect at 0.001, but at
#: 0.00101]
SMOOTH = 1e-3
#: Largest correction speed of an overlap without restitution [m/s]; measured: 1e-3 m/s after an impact at 2.0 m/s.
PUSH_OUT = 1e-3
#: Share of an overlap corrected in a step, up to that speed. [`ContactConstraint`, error reduction parameter]
PUSHED_SHARE = 0.01
#: Relative residual of a solver for a single contact without friction: measured 7e-16 at most, for all four, at
#: ratios of mass from 1e-4 to 1e4 and speeds from 0.3 to 50 m/s; the tolerance of round-off for every engine.
SOLVED = 1e-12


@dataclass(frozen=True)
class Rebound:
    """Restitution at some impact speed; without restitution a body leaves with the correction speed.

    Parameters
    ----------
    push
        Correction speed of an overlap [m/s], from 0 to `PUSH_OUT`.
    mixing
        Compliance of the contact, as a share of its response.
    """

    push: float = 0.0
    mixing: float = MIXING

    def __call__(self, e: float, speed: float) -> float:
        """Restitution at an approach of ``speed`` [m/s]: the impulse is smaller by the compliance.

        Its residual approach speed without restitution vanishes in the next steps.
        """
        if e * speed <= THRESHOLD:
            return self.push / speed
        return (1.0 + min(e * speed, FASTEST) / speed) / (1.0 + self.mixing) - 1.0


def restitution(e: float, speed: float) -> float:
    """Restitution at an approach of ``speed`` [m/s], without overlap."""
    return Rebound()(e, speed)
