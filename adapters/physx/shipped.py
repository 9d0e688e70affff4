"""Defaults of PhysX in SAPIEN."""

from __future__ import annotations

#: Iterations over contacts with and without position correction. [`physx.get_body_config`]
ITERATIONS, VELOCITY_ITERATIONS = 10, 1
#: Threshold speed of restitution [m/s]. [`physx.get_scene_config`]
BOUNCE_THRESHOLD = 2.0
#: Contact distance of each of two shapes [m]. [`physx.get_shape_config`]
CONTACT_OFFSET = 0.01
#: Typical size for the engine [m]. [sapien/physx/physx_engine.h, `PhysxEngine::Get`]
TOLERANCE_LENGTH = 0.1
#: Gap at the start of a step up to which a contact has friction, as a share of that size. [PxSceneDesc,
#: frictionOffsetThreshold; measured: 0.00399 m have it, 0.00401 m have none]
FRICTION_GAP = 0.04
#: Share of a spin lost in a second, and the fastest spin [rad/s]. [measured: `PhysxRigidDynamicComponent`]
ANGULAR_DAMPING, FASTEST_SPIN = 0.05, 100.0
#: Largest correction speed of overlaps: unlimited [m/s]. [measured: `max_depenetration_velocity`]
PUSH_OUT = 1e32
