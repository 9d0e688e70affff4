"""Defaults of Box2D 2.3. Those of b2Settings.h are compiled in and cannot be set."""

from __future__ import annotations

#: Prefixes of the releases on which laws were checked.
CHECKED_ON = ("2.3.",)

#: Iterations over velocities and over positions in each step, as in its manual and its testbed.
VELOCITY_ITERATIONS, POSITION_ITERATIONS = 8, 3
#: Overlap without correction [length]; `b2_linearSlop`.
LINEAR_SLOP = 0.005
#: Skin around each polygon [length]; `b2_polygonRadius` is twice the slop.
POLYGON_RADIUS = 2.0 * LINEAR_SLOP
#: Threshold speed of restitution [length/s]; `b2_velocityThreshold`.
VELOCITY_THRESHOLD = 1.0
#: Largest motion of a body in a step [length]; `b2_maxTranslation` clamps faster ones.
MAX_TRANSLATION = 2.0
#: Largest rotation of a body in a step [rad]; `b2_maxRotation`, a quarter of a turn.
MAX_ROTATION = 1.5707963267948966
