"""How the end of a slide is searched in a frozen force phase (E23, E34)."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel

#: Solves in search of the end of a slide; where contacts keep their modes the second is exact.
STICK_SOLVES = 30
#: Share of the end told by a row that stuck which is tried next, to be on the slipping side of it.
SHORTER = 0.9
#: Friction below this share of its limit sticks.
STUCK = 1.0 - 1e-9
#: Relative accuracy of that instant: some ten units in the last place.
SAME_TIME = 1e-14
#: A length at which a row sticks is the end of its slide if one shorter by no more than this share, at which it still
#: slipped, told it: such a step converges quadratically, and what is left of its error is the square.
CLOSE = 1e-6


@inner_kernel
def closing_speed(gap: float, parts: float, length: float, left: float) -> float:
    """Target of a spatial contact that closes its gap within ``left`` [m/s], of which this sub-step has ``length``.

    A lasting contact parts with ``parts`` because its normal has turned. Loads take that back in all of what is left:
    in a part of it they can take a part, and one that had to be closed at once would lose its load.
    """
    share = length / left
    return (1.0 - share) * max(parts, 0.0) - share * (gap / left)
