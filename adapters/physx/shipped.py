"""Numbers of PhysX as SAPIEN ships them."""

from __future__ import annotations

#: Sweeps over contacts with and without their positions. [`physx.get_body_config`]
ITERATIONS, VELOCITY_ITERATIONS = 10, 1
#: Speed of approach up to which nothing rebounds [m/s]. [`physx.get_scene_config`]
BOUNCE_THRESHOLD = 2.0
#: Distance at which contacts are made, of each of two shapes [m]. [`physx.get_shape_config`]
CONTACT_OFFSET = 0.01
#: Size of what is simulated, as the engine is told [m]. [sapien/physx/physx_engine.h, `PhysxEngine::Get`]
TOLERANCE_LENGTH = 0.1
#: Gap at the start of a step up to which a contact has friction, as a share of that size. [PxSceneDesc,
#: frictionOffsetThreshold; measured: 0.00399 m have it, 0.00401 m have none]
FRICTION_GAP = 0.04
#: Share of a spin that is lost in a second, and the fastest spin [rad/s]. [measured: `PhysxRigidDynamicComponent`]
ANGULAR_DAMPING, FASTEST_SPIN = 0.05, 100.0
#: Speed at which overlaps are pushed out at most: none [m/s]. [measured: `max_depenetration_velocity`]
PUSH_OUT = 1e32
