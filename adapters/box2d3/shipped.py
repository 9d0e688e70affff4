"""Defaults of Box2D 3.1, in metres and seconds."""

from __future__ import annotations

#: Prefixes of the releases of the bindings on which laws were checked.
CHECKED_ON = ("0.11.",)

#: Substeps of a step, as in its manual and its samples.
SUBSTEPS = 4
#: Spring of a contact between moving bodies [1/s], twice that against others; its damping ratio; `b2DefaultWorldDef`.
CONTACT_HERTZ, DAMPING_RATIO = 30.0, 10.0
#: Largest correction speed of an overlap [m/s]; `b2DefaultWorldDef`, three lengths per second.
PUSH_SPEED = 3.0
#: Threshold speed of restitution [m/s]; `b2DefaultWorldDef`.
RESTITUTION_THRESHOLD = 1.0
#: Largest speed of a body [m/s]; `b2DefaultWorldDef`, 400 lengths per second.
MAXIMUM_SPEED = 400.0
#: Largest rate of a contact's spring, as a share of the rate of the substeps. [`b2PrepareContactsTask`, solver.c]
STIFFEST = 0.25
#: Gap of speculative contacts [m]; `B2_SPECULATIVE_DISTANCE`, four times the slop of 5 mm.
SEEN_AHEAD = 0.02
