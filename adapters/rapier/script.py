"""A run on Rapier as a stand-alone script: the calls of `adapters.rapier.simulation`, with their numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from adapters.meeting import common_material
from adapters.scene import Body, Box, HalfSpace, Scene, Sphere
from adapters.script import constants, imports, keywords, literal, materials, stepped, text

#: Names of parameters by the settings that they are set to.
_HELD = {
    "num_solver_iterations": "substeps",
    "num_internal_pgs_iterations": "iterations",
    "num_internal_stabilization_iterations": "relaxations",
    "normalized_allowed_linear_error": "allowed_error",
    "normalized_prediction_distance": "prediction",
    "normalized_max_linear_velocity": "fastest",
    "normalized_max_corrective_velocity": "push_out",
    "contact_recycling": "recycling",
    "contact_clustering": "clustering",
}
_KINDS = {"free": "dynamic", "fixed": "fixed", "prescribed": "kinematic_velocity_based"}


def python(scene: Scene, dt: float, settings: Mapping[str, Any], steps: int) -> str:
    """Python of a run with rapier3d; see `adapters.engine.Writer`."""
    alike = common_material(scene)
    lines = [*imports(scene, "import rapier3d"), *constants(dt, steps), ""]
    lines += [f"world = rapier3d.PhysicsWorld(gravity={literal(scene.gravity)})", "held = world.integration_parameters"]
    lines += ["held.dt = DT", *(f"held.{name} = {settings[key]!r}" for name, key in _HELD.items())]
    for name, key in (("contact_softness", "frequency"), ("static_contact_softness", "static_frequency")):
        lines.append(f"held.{name} = rapier3d.SpringCoefficients({settings[key]!r}, {settings['damping_ratio']!r})")
    lines.append(f"held.friction_model = rapier3d.FrictionModel.{settings['friction_model'].upper()}")
    lines += ["bodies, numbers = {}, {}", ""]
    for index, body in enumerate(scene.bodies):
        lines += [*_made(index, body, alike), ""]
    own = materials(scene) if alike is None else []
    lines += [*own, *_HOOKS] if own else []
    still = literal([body.name for body in scene.bodies if body.motion == "fixed"])
    lines.append(f"FIXED = {still}  # their twists are 0 by definition")
    return text([*lines, *_STATE, *stepped(["world.step()"])])


def _made(index: int, asked: Body, alike: tuple[float, float] | None) -> list[str]:
    """Lines that make a body with its shape."""
    place, turn = literal(asked.pose[:3]), literal(asked.pose[3:])
    lines = [
        f"pose = rapier3d.Isometry3({place}, rapier3d.Rotation3{turn})",
        f"builder = rapier3d.RigidBody.{_KINDS[asked.motion]}(position=pose, can_sleep=False)",
    ]
    if asked.motion != "fixed":
        lines.append(f"builder = builder.linvel({literal(asked.twist[:3])}).angvel({literal(asked.twist[3:])})")
    if asked.motion == "free":
        own = f"rapier3d.MassProperties((0.0, 0.0, 0.0), {literal(asked.mass)}, {literal(asked.inertia)})"
        lines.append(f"builder = builder.additional_mass_properties({own})")
    lines.append(f"handle = bodies[{asked.name!r}] = world.add_body(builder)")
    lines += [f"collider = {_shape(asked, alike)}", f"numbers[world.add_collider(collider, handle)] = {index}"]
    if asked.motion == "free":
        lines.append("world.rigid_bodies[handle].recompute_mass_properties_from_colliders(world.colliders)")
        for kind, load in (("force", asked.force), ("torque", asked.torque)):
            if any(load):
                lines.append(f"world.rigid_bodies[handle].add_{kind}({literal(load)}, True)")
    return lines


def _shape(asked: Body, alike: tuple[float, float] | None) -> str:
    """Call that makes a collider."""
    restitution, friction = alike or (0.0, 0.0)
    own = keywords({"restitution": restitution, "friction": friction})
    if alike is None:
        own += ", active_hooks=rapier3d.ActiveHooks.MODIFY_SOLVER_CONTACTS"
    shape = asked.shape
    if isinstance(shape, HalfSpace):
        place = tuple(shape.offset * n for n in shape.normal)
        return f"rapier3d.Collider.halfspace({literal(shape.normal)}, translation={literal(place)}, {own})"
    if isinstance(shape, Sphere):
        return f"rapier3d.Collider.ball({literal(shape.radius)}, density=0.0, {own})"
    assert isinstance(shape, Box)
    x, y, z = (literal(half) for half in shape.half_extents)
    return f"rapier3d.Collider.cuboid({x}, {y}, {z}, density=0.0, {own})"


#: Lines that give each pair its own material.
_HOOKS = [
    "class Hooks:",
    "    def modify_solver_contacts(self, context):",
    "        own = material(numbers[context.collider1], numbers[context.collider2])",
    "        context.restitution, context.friction = own",
    "",
    "",
    "world.physics_hooks = Hooks()",
]

#: Lines of the function that reads all bodies.
_STATE = [
    "",
    "",
    "def state():",
    "    found = {}",
    "    for name, handle in bodies.items():",
    "        body = world.rigid_bodies[handle]",
    "        p, q, v, w = body.translation, body.rotation, body.linvel, body.angvel",
    "        twist = (0.0,) * 6 if name in FIXED else (v.x, v.y, v.z, w.x, w.y, w.z)",
    "        found[name] = (p.x, p.y, p.z, q.w, q.i, q.j, q.k), twist",
    "    return found",
]
