"""Numbers of Box2D 3.1 as it ships them, in metres and seconds."""

from __future__ import annotations

#: Prefixes of the releases of the bindings that laws were checked on.
CHECKED_ON = ("0.11.",)

#: Small steps of a step, as its manual and its samples make them.
SUBSTEPS = 4
#: Spring of a contact between moving bodies [1/s], twice that against others; its damping ratio; `b2DefaultWorldDef`.
CONTACT_HERTZ, DAMPING_RATIO = 30.0, 10.0
#: Largest speed at which an overlap is pushed out [m/s]; `b2DefaultWorldDef`, three lengths a second.
PUSH_SPEED = 3.0
#: Approach below which nothing rebounds [m/s]; `b2DefaultWorldDef`.
RESTITUTION_THRESHOLD = 1.0
#: Fastest that a body moves [m/s]; `b2DefaultWorldDef`, 400 lengths a second.
MAXIMUM_SPEED = 400.0
#: A contact's spring is no stiffer than this share of the rate of the small steps. [`b2PrepareContactsTask`, solver.c]
STIFFEST = 0.25
#: Gap at which a contact is seen ahead [m]; `B2_SPECULATIVE_DISTANCE`, four times the slop of 5 mm.
SEEN_AHEAD = 0.02
