"""Numbers of DART as it ships them."""

from __future__ import annotations

#: Compliance of a contact, as a share of its own response. [`ContactConstraint`, constraint force mixing]
MIXING = 1e-5
#: Approach up to which nothing rebounds [m/s]. [`ContactConstraint`, bounce velocity threshold]
THRESHOLD = 0.1
#: Largest speed at which an overlap is pushed out, where nothing rebounds [m/s]; measured: 2.0 m/s leave 1e-3 m/s.
PUSH_OUT = 1e-3
#: What a solver that stops at a tolerance may leave of a single contact, as a share: ten times the coarsest, 1e-8.
SOLVED = 1e-7


def restitution(e: float, speed: float) -> float:
    """Restitution that comes out at an approach of ``speed`` [m/s]: the impulse is smaller by the compliance."""
    return (1.0 + (e if speed > THRESHOLD else 0.0)) / (1.0 + MIXING) - 1.0
