"""Numbers of Box2D 2.3 as it ships them. Those of b2Settings.h are compiled in: nobody can set them."""

from __future__ import annotations

#: Prefixes of the releases that laws were checked on.
CHECKED_ON = ("2.3.",)

#: Sweeps over velocities and over positions in each step, as its manual and its testbed suggest them.
VELOCITY_ITERATIONS, POSITION_ITERATIONS = 8, 3
#: Overlap that is left alone [length]; `b2_linearSlop`.
LINEAR_SLOP = 0.005
#: Skin around each polygon [length]; `b2_polygonRadius` is twice the slop.
POLYGON_RADIUS = 2.0 * LINEAR_SLOP
#: Approach below which nothing rebounds [length/s]; `b2_velocityThreshold`.
VELOCITY_THRESHOLD = 1.0
#: Farthest that a body moves in a step [length]; `b2_maxTranslation` cuts what is faster.
MAX_TRANSLATION = 2.0
#: Farthest that a body turns in a step [rad]; `b2_maxRotation`, a quarter of a turn.
MAX_ROTATION = 1.5707963267948966
