"""What PhysX does when nothing is set, as SAPIEN documents it; see `adapters.unset`."""

from __future__ import annotations

from adapters.physx.shipped import ANGULAR_DAMPING, BOUNCE_THRESHOLD, CONTACT_OFFSET, FASTEST_SPIN
from adapters.unset import Unset

_MATERIAL, _SCENE = "sapien, physx_default.cpp", "sapien.physx.get_scene_config"
_PAIR, _BODY = "PxCombineMode::eAVERAGE", "PhysxRigidDynamicComponent"
UNSET = (
    Unset("friction of a pair", "0.3, static and dynamic", _MATERIAL, 0.3),
    Unset("friction of 0.2 and 0.9", "0.55, the mean", _PAIR, 0.55),
    Unset("restitution of a pair", "0.1", _MATERIAL, 0.1),
    Unset("restitution of 0.4 and 0.9", "0.65, the mean", _PAIR, 0.65),
    Unset("no rebound below [m/s]", f"{BOUNCE_THRESHOLD:g}: bounce_threshold", _SCENE, BOUNCE_THRESHOLD),
    Unset("angular damping [1/s]", f"{ANGULAR_DAMPING:g}", _BODY, ANGULAR_DAMPING),
    Unset("no spin above [rad/s]", f"{FASTEST_SPIN:g}", _BODY, FASTEST_SPIN),
    Unset("asleep below [m^2/s^2]", "0.005, kinetic energy over mass: sleep_threshold", _SCENE, 0.005),
    Unset("contacts from this gap on [m]", f"{CONTACT_OFFSET:g} of each shape: contact_offset", _SCENE),
    Unset("gravity, upwards [m/s^2]", "-9.81", _SCENE, -9.81),
)
