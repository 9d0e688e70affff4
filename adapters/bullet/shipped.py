"""Bullet's own constants: defaults, clamps and ranges, and the reviewed releases.

Source references are to bulletphysics/bullet3 at 6c888f4, the commit of the 3.2.7 wheels.
"""

from __future__ import annotations

import numpy as np

#: Prefixes of the releases on which laws were checked.
CHECKED_ON = ("3.2.7",)

#: Iterations per step (PhysicsServerCommandProcessor.cpp:2800).
ITERATIONS = 50
#: A contact is seen below this share of the smaller shape's bounding radius (PhysicsServerCommandProcessor.cpp:11525).
BREAKING_THRESHOLD = 0.02
#: Drag [1/s] and [1/m] of the multibody path, single precision: a body loses ``DAMPING (1 + |v|) v`` of speed per
#: second (btMultiBody.cpp:843, btMultiBody.h:486).
DAMPING = float(np.float32(0.04))
#: Fraction of an overlap corrected per step (contactERP).
ERP = 0.08
#: Overlap without correction [m].
SLOP = 1e-5
#: Share of the last step's impulses as start of a solve (btContactSolverInfo.h, m_warmstartingFactor).
WARM_STARTING = 0.85
#: Approach speed below which there is no rebound [m/s] (btSequentialImpulseConstraintSolver.cpp:494).
RESTITUTION_THRESHOLD = 0.2
#: Overlap from which the rigid-body path corrects by a velocity for one step only [m] (pybullet.c:1825).
SPLIT_DEPTH = 0.04
#: The multibody path clamps velocities to this after a step [m/s].
LARGEST_SPEED = 100.0

#: Smallest full extent of a body at rest [m]; smaller ones rest at a wrong height or fall through at 1/240 s.
SMALLEST_SIZE = 5e-3
#: Smallest mass [kg] and moment [kg m^2]; the multibody path treats values near 2.2e-16 as singular and freezes.
SMALLEST_INERTIA = 1e-12
#: The combined coefficient of friction is clamped to this (btManifoldResult.cpp:58).
LARGEST_FRICTION = 10.0
