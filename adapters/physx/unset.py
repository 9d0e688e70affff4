"""PhysX without any settings, as SAPIEN ships it; see `adapters.unset`."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np

from adapters import unset
from adapters.physx.shipped import (
    ANGULAR_DAMPING,
    BOUNCE_THRESHOLD,
    CONTACT_OFFSET,
    FASTEST_SPIN,
    FRICTION_GAP,
    TOLERANCE_LENGTH,
)
from adapters.physx.simulation import imported
from adapters.physx.translation import turn_to
from adapters.unset import (
    FRICTIONS,
    HALF_HEIGHT,
    HALF_WIDTH,
    HALVINGS,
    LONG,
    RADIUS,
    RESTITUTIONS,
    SLIDE_SPEED,
    Asked,
    Told,
    Unset,
)


class Bare:
    """A world on the CPU with one body above a plane."""

    def __init__(self, asked: Asked) -> None:
        sapien: Any = imported()
        physx = sapien.physx
        # A world's values are those of the process, which the adapter sets; calls without arguments restore the
        # defaults.
        made = {} if asked.gravity is None else {"gravity": np.array((0.0, 0.0, -asked.gravity), np.float32)}
        physx.set_scene_config(**made)
        self._system: Any = physx.PhysxCpuSystem()
        self._world: Any = sapien.Scene([self._system])
        shipped, box = physx.get_default_material(), (HALF_WIDTH, HALF_WIDTH, HALF_HEIGHT)
        for k, part in enumerate((physx.PhysxRigidStaticComponent(), physx.PhysxRigidDynamicComponent())):
            mu = asked.friction[k] if asked.friction else shipped.dynamic_friction
            e = asked.restitution[k] if asked.restitution else shipped.restitution
            material = physx.PhysxMaterial(mu, mu, e)
            if k == 0:
                shape, place, turn = physx.PhysxCollisionShapePlane(material), 0.0, turn_to((0.0, 0.0, 1.0))
            else:
                ball, place, turn = asked.shape == "ball", asked.height, (1.0, 0.0, 0.0, 0.0)
                own = physx.PhysxCollisionShapeSphere if ball else physx.PhysxCollisionShapeBox
                shape = own(RADIUS if ball else box, material)
            part.attach(shape)
            entity = sapien.Entity()
            entity.add_component(part)
            entity.pose = sapien.Pose([0.0, 0.0, place], list(turn))
            self._world.add_entity(entity)
        part.linear_velocity, part.angular_velocity = (asked.along, 0.0, asked.up), (0.0, 0.0, asked.spin)
        self._entity, self._body = entity, part
        self._lowest = asked.height - asked.gap
        self.dt = float(self._system.timestep)

    def advance(self, steps: int) -> None:
        """See `adapters.unset.World`."""
        for _ in range(steps):
            self._system.step()

    @property
    def contacts(self) -> int:
        """Pairs of bodies with contacts in the last step."""
        return len(self._system.get_contacts())

    @property
    def mass(self) -> float:
        """Mass of the body [kg]."""
        return float(self._body.mass)

    def told(self) -> Told:
        """See `adapters.unset.World`."""
        velocity, spin = self._body.linear_velocity, self._body.angular_velocity
        gap = float(self._entity.pose.p[2]) - self._lowest
        return Told(gap, float(velocity[0]), float(velocity[2]), float(spin[2]))


def _rubs(gap: float) -> bool:
    """Whether a box that falls through a gap within half a step is slowed down along the ground."""
    blow = Asked("box", gap, along=SLIDE_SPEED, up=-2.0 * gap / Bare(Asked()).dt)
    return unset.ran(Bare, blow, 0.0)[0].along < SLIDE_SPEED


def _falls_asleep(speed: float) -> bool:
    return unset.ran(Bare, Asked(along=speed), LONG)[0].along == 0.0


#: Error of a value found by bisection of an interval of `RADIUS`.
_HALVED = RADIUS / 2**HALVINGS
#: Energy over mass above which a body stays awake [m^2/s^2], and the number of steps with summed velocities.
_AWAKE, _SUMMED = 0.005, 20
_MATERIAL, _SCENE = "sapien, physx_default.cpp", "sapien.physx.get_scene_config"
_PAIR, _BODY = "PxCombineMode::eAVERAGE", "PhysxRigidDynamicComponent"
_ASLEEP = "DySleep.cpp, updateWakeCounter"
UNSET = (
    Unset("friction of a pair", "0.3, static and dynamic", _MATERIAL, 0.3, partial(unset.friction, Bare)),
    Unset("friction of 0.2 and 0.9", "0.55, the mean", _PAIR, 0.55, partial(unset.friction, Bare, FRICTIONS)),
    Unset("friction up to this gap [m]", "0.004: 0.04 of tolerance_length", "PxSceneDesc, frictionOffsetThreshold",
          FRICTION_GAP * TOLERANCE_LENGTH, partial(unset.reach, _rubs), _HALVED),
    Unset("restitution of a pair", "0.1", _MATERIAL, 0.1, partial(unset.restitution, Bare)),
    Unset("restitution of 0.4 and 0.9", "0.65, the mean", _PAIR, 0.65, partial(unset.restitution, Bare, RESTITUTIONS)),
    Unset("no rebound below [m/s]", f"{BOUNCE_THRESHOLD:g}: bounce_threshold", _SCENE, BOUNCE_THRESHOLD,
          partial(unset.least_rebound, Bare)),
    Unset("linear damping [1/s]", "0", _BODY, 0.0, partial(unset.damping, Bare, "along"), 1e-6),
    Unset("angular damping [1/s]", f"{ANGULAR_DAMPING:g}", _BODY, ANGULAR_DAMPING,
          partial(unset.damping, Bare, "spin"), 1e-4),
    Unset("limit of speed [m/s]", "none", _BODY, math.inf,
          partial(unset.limit, Bare)),
    Unset("no spin above [rad/s]", f"{FASTEST_SPIN:g}", _BODY, FASTEST_SPIN,
          lambda: unset.ran(Bare, Asked(spin=10.0 * FASTEST_SPIN), 0.0)[0].spin, 1e-4),
    Unset("at 1 mm/s asleep after [s]", "0.4: wakeCounterResetTime", _ASLEEP, 0.4, partial(unset.sleep, Bare), 0.025),
    Unset("asleep at last below [m/s]",
          f"0.005: velocities of {_SUMMED} steps, summed, have an energy over mass of {_AWAKE:g} m^2/s^2",
          f"{_BODY}.sleep_threshold; {_ASLEEP}", math.sqrt(2.0 * _AWAKE) / _SUMMED,
          partial(unset.reach, _falls_asleep), _HALVED),
    Unset("contacts from this gap on [m]", f"{2.0 * CONTACT_OFFSET:g}: {CONTACT_OFFSET:g} of each shape",
          "sapien.physx.get_shape_config, contact_offset", 2.0 * CONTACT_OFFSET, partial(unset.ahead, Bare), _HALVED),
    Unset("gap at rest [m]", "0: rest_offset", "sapien.physx.get_shape_config", 0.0, partial(unset.rest, Bare), 1e-6),
    Unset("left of 0.2 m of overlap [m]", "0: max_depenetration_velocity of 1e32 m/s", _BODY, 0.0,
          partial(unset.left, Bare), 1e-6),
    Unset("gravity, upwards [m/s^2]", "-9.81", _SCENE, -9.81, partial(unset.gravity, Bare), 1e-5),
    Unset("step [s]", "0.01", "sapien.physx.PhysxSystem, timestep", 0.01, lambda: Bare(Asked()).dt, 1e-8),
    Unset("mass of a cubic metre [kg]", "1000: density", "sapien.physx.PhysxCollisionShape", 1000.0,
          lambda: Bare(Asked("box")).mass / (8.0 * HALF_WIDTH**2 * HALF_HEIGHT), 1e-3),
)  # fmt: skip
