"""Defaults of Box3D, in metres and seconds; `b3DefaultWorldDef` unless another source is given."""

from __future__ import annotations

#: Prefixes of the releases of the bindings on which laws were checked.
CHECKED_ON = ("0.1.",)

#: Substeps of a step, as in its manual and its samples.
SUBSTEPS = 4
#: Spring of a contact between moving bodies [1/s], twice that against others; its damping ratio.
CONTACT_HERTZ, DAMPING_RATIO = 30.0, 10.0
#: Largest correction speed of an overlap [m/s].
PUSH_SPEED = 3.0
#: Threshold speed of restitution [m/s].
RESTITUTION_THRESHOLD = 1.0
#: Largest speed of a body [m/s].
MAXIMUM_SPEED = 400.0
#: Motion below which the contact points of the step before are used again [m]; `B3_CONTACT_RECYCLE_DISTANCE`.
RECYCLED = 0.05
#: Largest rate of a contact's spring, as a share of the rate of the substeps. [`stepWorld`, physics_world.c]
STIFFEST = 0.125
