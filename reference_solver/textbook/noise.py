"""What is round-off and not physics, in a time step; each number with its reason."""

from __future__ import annotations

#: Gaps and overlaps below this fraction of the smaller half width are round-off, not geometry.
ROUND_OFF = 1e-12
#: The same for coordinates far from the origin: some ten units in their last place.
COORDINATE_NOISE = 2e-15
#: few units in the last place of where it is.
STILL = 1e-15
#: 1e-13 it allows 5e-15 of them, about 20 units in the last place.
SPEED_SHARE = 0.05
#: moves in a step.
TOUCHING = 1e-9
#: fifty units in the last place, which is what summing the impulses of a body costs itself.
MENDED = 1e-14
