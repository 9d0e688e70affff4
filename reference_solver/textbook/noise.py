"""What is round-off and not physics, in a time step; each number with its reason."""

from __future__ import annotations

#: Gaps and overlaps below this fraction of the smaller half width are round-off, not geometry.
ROUND_OFF = 1e-12
#: The same for coordinates far from the origin: some ten units in their last place.
COORDINATE_NOISE = 2e-15
#: A body that goes no farther than this share of its smaller half width in a step stands still: that is no more than a
#: few units in the last place of where it is.
STILL = 1e-15
#: Round-off floor of a contact's reference speed, as a share of the speeds of its two points: with a residual of
#: 1e-13 it allows 5e-15 of them, about 20 units in the last place.
SPEED_SHARE = 0.05
#: A gap below this fraction of the smaller half width is touching. Far above round-off, far below what a body
#: moves in a step.
TOUCHING = 1e-9
#: Velocities that differ from those the impulses give by more than this share of all that these can do are mended: some
#: fifty units in the last place, which is what summing the impulses of a body costs itself.
MENDED = 1e-14
