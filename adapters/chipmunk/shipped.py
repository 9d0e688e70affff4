"""Defaults of Chipmunk in ``pymunk.Space()``, and the reviewed releases.

The odd digits are single-precision literals in its source. [Munk2D, cpSpace.c, cpSpaceInit]
"""

from __future__ import annotations

#: Prefixes of the releases on which laws were checked.
CHECKED_ON = ("7.3.",)

#: Iterations per step.
ITERATIONS = 10
#: Overlap without correction [m].
COLLISION_SLOP = 0.10000000149011612
#: Share of an overlap left after a second: 0.9 to the 60th.
COLLISION_BIAS = 0.0017970074436457143
#: Steps for which the impulses of an open contact are kept.
COLLISION_PERSISTENCE = 3
