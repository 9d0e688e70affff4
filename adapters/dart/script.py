"""A run on DART as a stand-alone script: the recorded calls of `adapters.dart.simulation`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from adapters.dart.profiles import checked
from adapters.dart.simulation import DartSimulation
from adapters.recording import written
from adapters.scene import Scene
from adapters.script import constants, imports, literal, stepped, text

#: Variables of a script, and the calls that return their values.
_NAMES = {
    "world": "World",
    "held": "getConstraintSolver",
    "rest": "getDeactivationOptions",
    "option": "PgsBoxedLcpSolverOption",
    "second": "getSecondaryBoxedLcpSolver",
    "solver": "NsgsFrictionSolver FbfFrictionSolver",
    "options": "getOptions",
    "skeleton": "Skeleton",
    "joint, node": "createFreeJointAndBodyNodePair createWeldJointAndBodyNodePair",
    "place": "Isometry3",
    "shape": "BoxShape SphereShape",
    "part": "createShapeNode",
    "material": "createDynamicsAspect",
    "": "createCollisionAspect addSkeleton",
}


def python(scene: Scene, dt: float, settings: Mapping[str, Any], steps: int) -> str:
    """Python of a run with dartpy; see `adapters.engine.Writer`."""
    import dartpy

    made, step = written(DartSimulation, dartpy, "dartpy", _NAMES, (scene, dt, checked(settings)))
    lines = [*imports(scene, "import dartpy", "import numpy as np"), *constants(dt, steps)]
    lines.append("# A plane meets a box at one point only: a half-space is a slab, whose upper face is the surface.")
    if settings["solver"] == "pgs":
        lines.append("# PGS has no constructor in Python: another world brings one as its second choice.")
    still = {body.name: body.pose for body in scene.bodies if body.motion != "free"}
    lines += ["bodies = {}", "", *made, "", "# Poses of bodies that do not move.", f"PLACES = {literal(still)}"]
    return text([*lines, *_STATE, *stepped(step)])


#: Lines of the function that reads all bodies.
_STATE = [
    "",
    "",
    "def state():",
    "    found = {}",
    "    for name, node in bodies.items():",
    "        place = node.getTransform()",
    "        q = place.quaternion()",
    "        pose = PLACES.get(name) or (*place.translation(), q.w(), q.x(), q.y(), q.z())",
    "        found[name] = pose, (*node.getLinearVelocity(), *node.getAngularVelocity())",
    "    return found",
]
