"""What is round-off and not physics, for all of the step; each number with its reason."""

from __future__ import annotations

#: Gaps and overlaps below this fraction of the smaller half width are round-off, not geometry.
ROUND_OFF = 1e-12
#: The same for coordinates far from the origin: some ten units in their last place.
COORDINATE_NOISE = 2e-15
#: Normal and tangential velocities below this share of a contact's reference speed are round-off of the solve, whose
#: residual is 1e-13 of it: neither an approach, nor a parting, nor a slip.
NOISE = 1e-11
#: A gap that its own approach closes within this share of the time left is closed: a few units in the last place of
#: the time of impact.
LATE = 1e-15
#: What is left of a step below this share of it is nothing.
NOTHING_LEFT = 1e-14
#: Share of a contact's usual force below which a force is none; stage forces are known to 1e-13 of it, and events are
#: located to 1e-11.
FORCE_NOISE = 1e-9
#: An entry of a row that changes by less than this share of its body's reach along a path stays what it is: what that
#: leaves out of the motion is as much of h a.
FROZEN = 1e-13
