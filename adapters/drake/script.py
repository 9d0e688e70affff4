"""A run on Drake as a stand-alone script: the calls of `adapters.drake.simulation`, with their numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from adapters.drake.profiles import APPROXIMATIONS, checked
from adapters.drake.simulation import made_of
from adapters.scene import Body, Box, Capsule, Cylinder, HalfSpace, Scene, Sphere
from adapters.script import constants, imports, keywords, literal, stepped, text


def python(scene: Scene, dt: float, settings: Mapping[str, Any], steps: int) -> str:
    """Python of a run with pydrake; see `adapters.engine.Writer`."""
    chosen = checked(settings)
    materials = made_of(scene, chosen)
    lines = [*imports(scene, "import numpy as np", "import pydrake.all as drake"), *constants(dt, steps), ""]
    approximation = f"drake.DiscreteContactApproximation.{APPROXIMATIONS[chosen['approximation']]}"
    lines += [
        "builder = drake.DiagramBuilder()",
        "plant, graph = drake.AddMultibodyPlantSceneGraph(builder, DT)",
        f"plant.set_discrete_contact_approximation({approximation})",
        "plant.set_contact_model(drake.ContactModel.kHydroelasticWithFallback)",
        f"plant.set_stiction_tolerance({chosen['stiction_tolerance']!r})",
        f"plant.mutable_gravity_field().set_gravity_vector({literal(scene.gravity)})",
        "# Bodies, and the poses of those that belong to the world.",
        "bodies, places = {}, {}",
    ]
    for index, (body, material) in enumerate(zip(scene.bodies, materials, strict=True)):
        lines += ["", *_made(index, body, material)]
    lines += ["", "plant.Finalize()", "diagram = builder.Build()", "simulator = drake.Simulator(diagram)"]
    lines.append("context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())")
    free = [body for body in scene.bodies if body.motion == "free"]
    for body in free:
        held = f"bodies[{body.name!r}]"
        twist = f"drake.SpatialVelocity(np.array({literal(body.twist[3:])}), np.array({literal(body.twist[:3])}))"
        lines.append(f"plant.SetFreeBodyPose(context, {held}, {_place(body)})")
        lines.append(f"plant.SetFreeBodySpatialVelocity(context, {held}, {twist})")
    lines += _loads(free)
    lines.append("simulator.Initialize()")
    return text([*lines, *_STATE, *stepped(["simulator.AdvanceTo(done * DT)"])])


def _place(asked: Body) -> str:
    """Pose of a body; the turn is scaled to length 1 to the last digit."""
    turn = np.array(asked.pose[3:], float)
    unit = literal(turn / float(np.linalg.norm(turn)))
    return f"drake.RigidTransform(drake.Quaternion({unit}), np.array({literal(asked.pose[:3])}))"


def _made(index: int, asked: Body, material: tuple[Any, ...]) -> list[str]:
    """Lines that make a body with its shape; ``material`` is a row of `adapters.drake.simulation.made_of`."""
    shape, free = asked.shape, asked.motion == "free"
    if free:
        x, y, z = (literal(part) for part in np.divide(asked.inertia, asked.mass))
        inertia = f"drake.SpatialInertia({literal(asked.mass)}, (0.0, 0.0, 0.0), drake.UnitInertia({x}, {y}, {z}))"
        lines = [f"body = plant.AddRigidBody('body {index}', {inertia})", "place = drake.RigidTransform()"]
    else:
        lines = [
            f"body, places[{asked.name!r}] = plant.world_body(), {literal(asked.pose)}",
            f"place = {_place(asked)}",
        ]
    lines += _held(material, isinstance(shape, HalfSpace))
    if isinstance(shape, HalfSpace):
        normal = np.array(shape.normal)
        point = literal(shape.offset * normal)
        lines.append(f"place = drake.HalfSpace.MakePose(np.array({literal(normal)}), np.array({point}))")
        made = "HalfSpace()"
    elif isinstance(shape, Sphere):
        made = f"Sphere({literal(shape.radius)})"
    elif isinstance(shape, Capsule | Cylinder):
        lines.append("lying = drake.RotationMatrix.MakeYRotation(0.5 * np.pi)  # from their z to our x")
        lines.append("place = place.multiply(drake.RigidTransform(lying, np.zeros(3)))")
        made = f"{type(shape).__name__}({literal(shape.radius)}, {literal(2.0 * shape.half_length)})"
    else:
        assert isinstance(shape, Box)
        made = f"Box{literal([2.0 * half for half in shape.half_extents])}"
    lines.append(f"plant.RegisterCollisionGeometry(body, place, drake.{made}, 'shape {index}', held)")
    return [*lines, f"bodies[{asked.name!r}] = body"]


def _held(material: tuple[Any, ...], endless: bool) -> list[str]:
    """Lines that say what a shape's contacts are made of."""
    friction, kind, resolution, modulus, stiffness, dissipation, relaxation = material
    own = keywords({"dissipation": dissipation, "point_stiffness": stiffness})
    lines = [
        "held = drake.ProximityProperties()",
        f"friction = drake.CoulombFriction({literal(friction)}, {literal(friction)})",
        f"drake.AddContactMaterial({own}, friction=friction, properties=held)",
        f"held.AddProperty('material', 'relaxation_time', {literal(relaxation)})",
    ]
    if kind == "compliant":
        lines.append(f"drake.AddCompliantHydroelasticProperties({literal(resolution)}, {literal(modulus)}, held)")
    elif kind == "rigid":
        size = "" if endless else f"{literal(resolution)}, "
        lines.append(f"drake.AddRigidHydroelasticProperties({size}held)")
    return lines


def _loads(free: list[Body]) -> list[str]:
    """Lines that give bodies their forces and torques, for good."""
    lines = []
    for body in free:
        if body.is_loaded:
            lines += [
                "load = drake.ExternallyAppliedSpatialForce()",
                f"load.body_index = bodies[{body.name!r}].index()",
                "load.p_BoBq_B = (0.0, 0.0, 0.0)",
                f"load.F_Bq_W = drake.SpatialForce({literal(body.torque)}, {literal(body.force)})",
                "loads.append(load)",
            ]
    if not lines:
        return []
    port = "plant.get_applied_spatial_force_input_port()"
    return ["loads = []", *lines, f"{port}.FixValue(context, drake.Value(loads))"]


#: Lines of the function that reads all bodies.
_STATE = [
    "",
    "",
    "def state():",
    "    found = {}",
    "    for name, body in bodies.items():",
    "        place = plant.EvalBodyPoseInWorld(context, body)",
    "        velocity = plant.EvalBodySpatialVelocityInWorld(context, body)",
    "        pose = places.get(name) or (*place.translation(), *place.rotation().ToQuaternion().wxyz())",
    "        found[name] = pose, (*velocity.translational(), *velocity.rotational())",
    "    return found",
]
