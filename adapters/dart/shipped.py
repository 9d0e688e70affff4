"""Numbers of DART as it ships them."""

from __future__ import annotations

from dataclasses import dataclass

#: Compliance of a contact, as a share of its own response. [`ContactConstraint`, constraint force mixing]
MIXING = 1e-5
#: Speed of a rebound up to which there is none, and that is never exceeded [m/s]. [`ContactConstraint`, bouncing
#: velocity threshold, maximal bouncing velocity; measured: 0.2 of 0.499 m/s does not come, of 0.501 m/s it does; 0.8 of
#: 150 m/s leaves 100 m/s]
THRESHOLD, FASTEST = 0.1, 100.0
#: Friction up to which there is none. [`ContactConstraint`, friction coefficient threshold; measured: 0.001 does not
#: come, 0.00101 does]
SMOOTH = 1e-3
#: Largest speed at which an overlap is pushed out, where nothing rebounds [m/s]; measured: 2.0 m/s leave 1e-3 m/s.
PUSH_OUT = 1e-3
#: Share of an overlap that a step pushes out, up to that speed. [`ContactConstraint`, error reduction parameter]
PUSHED_SHARE = 0.01
#: What a solver leaves of a single contact without friction, as a share: measured 7e-16 at most, for all four, at
#: ratios of mass from 1e-4 to 1e4 and speeds from 0.3 to 50 m/s; the round-off that any engine is allowed.
SOLVED = 1e-12


@dataclass(frozen=True)
class Rebound:
    """Restitution that comes out at an approach of some speed; where nothing rebounds, a body is pushed out.

    Parameters
    ----------
    push
        Speed at which an overlap is pushed out [m/s], from 0 to `PUSH_OUT`.
    mixing
        Compliance of what is struck, as a share of its response.
    """

    push: float = 0.0
    mixing: float = MIXING

    def __call__(self, e: float, speed: float) -> float:
        """Restitution at an approach of ``speed`` [m/s]: the impulse is smaller by the compliance.

        What that leaves of an approach without a rebound is gone after the next steps.
        """
        if e * speed <= THRESHOLD:
            return self.push / speed
        return (1.0 + min(e * speed, FASTEST) / speed) / (1.0 + self.mixing) - 1.0


def restitution(e: float, speed: float) -> float:
    """Restitution at an approach of ``speed`` [m/s], where nothing overlaps."""
    return Rebound()(e, speed)
