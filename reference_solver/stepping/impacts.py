"""What an instant brings, and how rebounds go on (E21, E22)."""

from __future__ import annotations

#: How a rebound goes on: it flies; its series of bounces ends within the sub-step; it is held until the end of the
#: sub-step and released there.
OPEN_ENDED, SERIES_ENDS, RELEASED = 0, 1, 2
#: What an instant brings: nothing, contacts whose normals turned (spatial), impacts no faster than what loads do in a
#: step with e = 0, such with e > 0, faster ones.
NO_IMPACT, TURNED, LANDED, REBOUNDED, STRUCK = 0, 1, 2, 3, 4
#: A rebound that would return this many times within what is left of the step is not followed bounce by bounce.
BOUNCES = 32
#: An impact is soft that closes no more than this share of the smaller half width in a step. Without loads all others
#: are hard, and of bodies caught between others they have no end, each slower than the one before.
CREEP = 1e-6
#: Passes that mark ending series of rebounds; each marks at least one row more.
SERIES_PASSES = 4
