"""A run on Rapier as a stand-alone script: the recorded calls of `adapters.rapier.simulation`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from adapters.rapier.simulation import Hooks, RapierSimulation
from adapters.recording import written
from adapters.scene import Scene
from adapters.scene.meeting import common_material
from adapters.script import constants, imports, literal, materials, stepped, text

#: Variables of a script, and the calls and attributes of their values.
_NAMES = {
    "world": "PhysicsWorld",
    "held": "integration_parameters",
    "pose": "Isometry3",
    "builder": "dynamic fixed kinematic_velocity_based angvel additional_mass_properties",
    "handle": "add_body",
    "collider": "halfspace ball cuboid",
    "": "add_collider",
}


def python(scene: Scene, dt: float, settings: Mapping[str, Any], steps: int) -> str:
    """Python of a run with rapier3d; see `adapters.engine.Writer`."""
    import rapier3d

    world = (scene, dt, settings)
    made, step = written(RapierSimulation, rapier3d, "rapier3d", _NAMES, world, {Hooks: "Hooks()"})
    own = materials(scene) if common_material(scene) is None else []
    still = literal([body.name for body in scene.bodies if body.motion == "fixed"])
    lines = [*imports(scene, "import rapier3d"), *constants(dt, steps), "bodies = {}", ""]
    lines += [*own, *_HOOKS, *made, "", _NUMBERS] if own else [*made, ""]
    return text([*lines, f"FIXED = {still}  # their twists are 0 by definition", *_STATE, *stepped(step)])


#: Line that numbers the shapes of bodies, and lines that give each pair its own material.
_NUMBERS = "numbers = {world.rigid_bodies[handle].colliders[0]: k for k, handle in enumerate(bodies.values())}"
_HOOKS = [
    "class Hooks:",
    "    def modify_solver_contacts(self, context):",
    "        own = material(numbers[context.collider1], numbers[context.collider2])",
    "        context.restitution, context.friction = own",
    "",
    "",
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
