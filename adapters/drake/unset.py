"""Drake without any settings; see `adapters.unset`."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

from adapters import unset
from adapters.drake.shipped import DISSIPATION, POINT_STIFFNESS, STICTION
from adapters.unset import (
    BLOW_SPEED,
    DEEP,
    FRICTIONS,
    GRAVITY,
    HALF_HEIGHT,
    HALF_WIDTH,
    RADIUS,
    SETTLING,
    SLIDE_TIME,
    Asked,
    Told,
    Unset,
)

#: Half thickness of the ground's box [m].
DEPTH = 5.0
#: Default friction of a pair.
FRICTION = 0.5


class Bare:
    """A plant with one body above a box of the world; its mass is 1 kg, because there is no default.

    ``pull`` is an acceleration along the ground [m/s^2], given with gravity.
    """

    def __init__(self, asked: Asked, pull: float = 0.0) -> None:
        import pydrake.all

        drake: Any = pydrake.all
        builder = drake.DiagramBuilder()
        plant, _ = drake.AddMultibodyPlant(drake.MultibodyPlantConfig(), builder)
        if asked.gravity is not None:
            plant.mutable_gravity_field().set_gravity_vector([pull, 0.0, -asked.gravity])
        size, inertia = (2.0 * HALF_WIDTH, 2.0 * HALF_WIDTH, 2.0 * HALF_HEIGHT), drake.SpatialInertia
        ball = asked.shape == "ball"
        weight = inertia.SolidSphereWithMass(1.0, RADIUS) if ball else inertia.SolidBoxWithMass(1.0, *size)
        own = drake.Sphere(RADIUS) if ball else drake.Box(*size)
        self._body = plant.AddRigidBody("body", weight)
        ground = plant.world_body(), drake.Box(100.0, 100.0, 2.0 * DEPTH), -DEPTH
        for k, (body, shape, height) in enumerate((ground, (self._body, own, 0.0))):
            held = drake.ProximityProperties()
            if asked.friction is not None:
                mu = asked.friction[k]
                held.AddProperty("material", "coulomb_friction", drake.CoulombFriction(mu, mu))
            place = drake.RigidTransform([0.0, 0.0, height])
            plant.RegisterCollisionGeometry(body, place, shape, f"shape {k}", held)
        plant.Finalize()
        self._plant = plant
        self._simulator: Any = drake.Simulator(builder.Build())
        self._context: Any = plant.GetMyMutableContextFromRoot(self._simulator.get_mutable_context())
        plant.SetFreeBodyPose(self._context, self._body, drake.RigidTransform([0.0, 0.0, asked.height]))
        twist = drake.SpatialVelocity([0.0, 0.0, asked.spin], [asked.along, 0.0, asked.up])
        plant.SetFreeBodySpatialVelocity(self._context, self._body, twist)
        self._lowest = asked.height - asked.gap
        self.dt, self._steps = float(plant.time_step()), 0

    def advance(self, steps: int) -> None:
        """See `adapters.unset.World`."""
        self._steps += steps
        self._simulator.AdvanceTo(self._steps * self.dt)

    @property
    def contacts(self) -> int:
        """Contacts of the last step."""
        found = self._plant.get_contact_results_output_port().Eval(self._context)
        return int(found.num_point_pair_contacts() + found.num_hydroelastic_contacts())

    def told(self) -> Told:
        """See `adapters.unset.World`."""
        twist = self._plant.EvalBodySpatialVelocityInWorld(self._context, self._body)
        height = float(self._plant.EvalBodyPoseInWorld(self._context, self._body).translation()[2])
        velocity, spin = twist.translational(), twist.rotational()
        return Told(height - self._lowest, float(velocity[0]), float(velocity[2]), float(spin[2]))

    @property
    def slip(self) -> float:
        """Speed along the ground of a ball's point of contact [m/s]; it lies halfway into the overlap."""
        spin = float(self._plant.EvalBodySpatialVelocityInWorld(self._context, self._body).rotational()[1])
        told = self.told()
        return told.along - spin * (RADIUS + 0.5 * told.gap)


def _stiffness() -> float:
    """Weight of a ball of 1 kg over the overlap at which it rests [N/m]."""
    return -GRAVITY / unset.ran(Bare, Asked(gap=0.0, gravity=GRAVITY), SETTLING)[0].gap


def _viscous() -> float:
    """Slip [m/s] at which friction is mu N/sqrt(2): it is mu N s/sqrt(s^2 + v^2), with v the tolerance.

    Friction of a rolling ball is two sevenths of the pull.
    """
    world = Bare(Asked(gap=0.0, gravity=GRAVITY), pull=3.5 * FRICTION * GRAVITY / math.sqrt(2.0))
    world.advance(round(SLIDE_TIME / world.dt))
    return world.slip


#: A ball, because a box has one point of contact and rocks; so fast that it does not roll within a time in which one
#: step of delay of friction is negligible [m/s, s].
_SLIDE: tuple[Any, ...] = ("ball", 30.0, 0.25)
_PROPERTIES, _CONFIG = "SceneGraphConfig.default_proximity_properties", "MultibodyPlantConfig"
_LEAVES = f"{_PROPERTIES}, hunt_crossley_dissipation"
_PAIR = "CalcContactFrictionFromSurfaceProperties"
UNSET = (
    Unset("friction of a pair", f"{FRICTION:g}, static and dynamic", _PROPERTIES, FRICTION,
          partial(unset.friction, Bare, None, *_SLIDE)),
    Unset("friction of 0.2 and 0.9", "0.327, the harmonic mean", _PAIR, 0.36 / 1.1,
          partial(unset.friction, Bare, FRICTIONS, *_SLIDE)),
    Unset("friction is viscous below [m/s]", f"{STICTION:g}: stiction_tolerance", _CONFIG, STICTION, _viscous, 1e-6),
    Unset("restitution of a pair at 5 m/s", f"no such number: bodies leave with up to 1/{DISSIPATION:g} m/s", _LEAVES,
          1.0 / DISSIPATION / BLOW_SPEED, partial(unset.restitution, Bare), 1e-4),
    Unset("linear damping [1/s]", "0", _CONFIG, 0.0, partial(unset.damping, Bare, "along"), 1e-9),
    Unset("angular damping [1/s]", "0", _CONFIG, 0.0, partial(unset.damping, Bare, "spin"), 1e-9),
    Unset("limit of speed [m/s]", "none", _CONFIG, math.inf,
          partial(unset.limit, Bare)),
    Unset("at 1 mm/s asleep after [s]", "never: bodies do not sleep", _CONFIG, math.inf, partial(unset.sleep, Bare)),
    Unset("contacts from this gap on [m]", "0: no margin is set", _PROPERTIES, 0.0,
          partial(unset.ahead, Bare), 1e-12),
    Unset("stiffness of a contact [N/m]", f"{0.5 * POINT_STIFFNESS:g}: two of {POINT_STIFFNESS:g} in series",
          f"{_PROPERTIES}, point_stiffness", 0.5 * POINT_STIFFNESS, _stiffness, 1.0),
    Unset("gap below a box on a box after 2 s [m]", "not documented: they have one contact point, and it sinks in",
          f"{_CONFIG}, contact_model", None, partial(unset.rest, Bare)),
    Unset("left of 0.2 m of overlap [m]", f"0.16: corrected at up to 1/{DISSIPATION:g} m/s in 2 s", _LEAVES,
          DEEP - SETTLING / DISSIPATION, partial(unset.left, Bare), 1e-3),
    Unset("gravity, upwards [m/s^2]", "-9.81", "UniformGravityFieldElement", -9.81, partial(unset.gravity, Bare), 1e-9),
    Unset("step [s]", "0.001: time_step", _CONFIG, 0.001, lambda: Bare(Asked()).dt, 1e-12),
)  # fmt: skip
