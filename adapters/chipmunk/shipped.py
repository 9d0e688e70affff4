"""Numbers of Chipmunk as ``pymunk.Space()`` holds them, and the releases looked at.

The odd digits are single-precision literals in its source. [Munk2D, cpSpace.c, cpSpaceInit]
"""

from __future__ import annotations

#: Prefixes of the releases that laws were checked on.
CHECKED_ON = ("7.3.",)

#: Sweeps per step.
ITERATIONS = 10
#: Overlap that is left alone [m].
COLLISION_SLOP = 0.10000000149011612
#: Share of an overlap that is left after a second: 0.9 to the 60th.
COLLISION_BIAS = 0.0017970074436457143
#: Steps that a contact's impulses outlive it.
COLLISION_PERSISTENCE = 3
