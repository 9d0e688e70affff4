"""A run on Drake as a stand-alone script: the recorded calls of `adapters.drake.simulation`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from adapters.drake.simulation import DrakeSimulation
from adapters.recording import written
from adapters.scene import Capsule, Cylinder, Scene
from adapters.script import constants, imports, literal, stepped, text

#: Variables of a script, and the calls that return their values.
_NAMES = {
    "builder": "DiagramBuilder",
    "plant, graph": "AddMultibodyPlantSceneGraph",
    "diagram": "Build",
    "simulator": "Simulator",
    "context": "GetMyMutableContextFromRoot",
    "body": "AddRigidBody world_body",
    "place": "RigidTransform MakePose multiply",
    "held": "ProximityProperties",
    "twist": "SpatialVelocity",
    "load": "ExternallyAppliedSpatialForce",
    "port": "get_applied_spatial_force_input_port",
    "": "RegisterCollisionGeometry FixValue Initialize",
}


def python(scene: Scene, dt: float, settings: Mapping[str, Any], steps: int) -> str:
    """Python of a run with pydrake; see `adapters.engine.Writer`."""
    import pydrake.all

    made, _ = written(DrakeSimulation, pydrake.all, "drake", _NAMES, (scene, dt, settings))
    lines = [*imports(scene, "import numpy as np", "import pydrake.all as drake"), *constants(dt, steps)]
    if any(isinstance(body.shape, Capsule | Cylinder) for body in scene.bodies):
        lines.append("# Capsules and cylinders lie along z in Drake, along x in the scene.")
    still = {body.name: body.pose for body in scene.bodies if body.motion != "free"}
    lines += ["bodies = {}", "", *made, "", "# Poses of bodies that belong to the world.", f"PLACES = {literal(still)}"]
    return text([*lines, *_STATE, *stepped(["simulator.AdvanceTo(done * DT)"])])


#: Lines of the function that reads all bodies.
_STATE = [
    "",
    "",
    "def state():",
    "    found = {}",
    "    for name, body in bodies.items():",
    "        place = plant.EvalBodyPoseInWorld(context, body)",
    "        velocity = plant.EvalBodySpatialVelocityInWorld(context, body)",
    "        pose = PLACES.get(name) or (*place.translation(), *place.rotation().ToQuaternion().wxyz())",
    "        found[name] = pose, (*velocity.translational(), *velocity.rotational())",
    "    return found",
]
