"""A run on DART as a stand-alone script: the calls of `adapters.dart.simulation`, with their numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from adapters.dart.profiles import checked
from adapters.dart.simulation import DETECTORS, turned
from adapters.dart.translation import frictions, restitutions
from adapters.ground import reach
from adapters.scene import Body, Box, HalfSpace, Scene, Sphere
from adapters.script import constants, imports, literal, stepped, text


def python(scene: Scene, dt: float, settings: Mapping[str, Any], steps: int) -> str:
    """Python of a run with dartpy; see `adapters.engine.Writer`."""
    chosen = checked(settings)
    lines = [*imports(scene, "import dartpy", "import numpy as np"), *constants(dt, steps), ""]
    lines += ["world = dartpy.simulation.World()", "world.setTimeStep(DT)"]
    lines.append(f"world.setGravity({literal(scene.gravity)})")
    lines.append(f"world.setCollisionDetector(dartpy.collision.{DETECTORS[chosen['detector']]}())")
    lines += ["rest = world.getDeactivationOptions()", "rest.mEnabled = False", "world.setDeactivationOptions(rest)"]
    lines += _solver(chosen)
    lines += ["# Bodies, and the poses of those that do not move.", "bodies, places = {}, {}"]
    own = zip(restitutions(scene) or [], frictions(scene) or [], strict=True)
    for index, (body, numbers) in enumerate(zip(scene.bodies, own, strict=True)):
        lines += ["", *_made(index, body, scene, numbers)]
    loads = []
    for body in scene.bodies:
        if body.is_loaded:
            node = f"bodies[{body.name!r}]"
            loads.append(f"{node}.setExtForce({literal(body.force)}, (0.0, 0.0, 0.0), False, True)")
            loads.append(f"{node}.setExtTorque({literal(body.torque)}, False)")
    return text([*lines, *_STATE, *stepped([*loads, "world.step()"])])


def _solver(settings: Mapping[str, Any]) -> list[str]:
    """Lines that make and set the solver of the contact problem, and who answers where it finds none."""
    name = settings["solver"]
    first = ("iterations", "tolerance") if name == "pgs" else ("second_sweeps", "second_tolerance")
    sweeps, share = (settings[key] for key in first)
    lines = [
        "held = world.getConstraintSolver()",
        "option = dartpy.constraint.PgsBoxedLcpSolverOption()",
        f"option.mMaxIteration, option.mRelativeDeltaXTolerance = {sweeps!r}, {share!r}",
        f"option.mDeltaXThreshold = {share * (1.0 if name == 'pgs' else 1e-3)!r}",
        "held.getSecondaryBoxedLcpSolver().setOption(option)",
    ]
    if name == "pgs":
        lines += [
            "# It has no constructor in Python: another world brings one as its second choice.",
            "other = dartpy.simulation.World()",
            "solver = other.getConstraintSolver().getSecondaryBoxedLcpSolver()",
            "solver.setOption(option)",
        ]
    elif name != "dantzig":
        kind, count = {"nsgs": ("Nsgs", "maxSweeps"), "fbf": ("Fbf", "maxOuterIterations")}[name]
        lines += [
            f"solver = dartpy.constraint.{kind}FrictionSolver()",
            "options = solver.getOptions()",
            f"options.{count}, options.tolerance = {settings['iterations']!r}, {settings['tolerance']!r}",
            "solver.setOptions(options)",
        ]
    return lines if name == "dantzig" else [*lines, "held.setBoxedLcpSolver(solver)"]


def _made(index: int, asked: Body, scene: Scene, numbers: tuple[float, float]) -> list[str]:
    """Lines that make a body with its shape; ``numbers`` are its restitution and friction."""
    free, shape = asked.motion == "free", asked.shape
    joint = "createFreeJointAndBodyNodePair" if free else "createWeldJointAndBodyNodePair"
    lines = [
        f"skeleton = dartpy.dynamics.Skeleton('body {index}')",
        f"joint, node = skeleton.{joint}()",
        f"node.setName('body {index}')",
        "place = dartpy.math.Isometry3()",
    ]
    if isinstance(shape, HalfSpace):
        wide, normal = reach(scene), np.array(shape.normal)
        lines += [
            "# A plane meets a box at one point only: a slab, whose upper face is the surface.",
            f"place.set_rotation(np.array({literal(turned(normal))}))",
            f"place.set_translation({literal((shape.offset - wide) * normal)})",
        ]
        made = f"BoxShape({literal([2.0 * wide] * 3)})"
    else:
        w, x, y, z = (literal(part) for part in asked.pose[3:])
        lines.append(f"place.set_quaternion(dartpy.math.Quaternion({w}, {x}, {y}, {z}))")
        lines.append(f"place.set_translation({literal(asked.pose[:3])})")
        if isinstance(shape, Sphere):
            made = f"SphereShape({literal(shape.radius)})"
        else:
            assert isinstance(shape, Box)
            made = f"BoxShape({literal([2.0 * half for half in shape.half_extents])})"
    lines += [
        f"part = node.createShapeNode(dartpy.dynamics.{made})",
        "part.createCollisionAspect()",
        "material = part.createDynamicsAspect()",
        f"material.setRestitutionCoeff({literal(numbers[0])})",
        f"material.setFrictionCoeff({literal(numbers[1])})",
    ]
    if free:
        inertia = f"{literal(asked.mass)}, np.zeros(3), np.diag({literal(asked.inertia)})"
        lines += [
            f"node.setInertia(dartpy.dynamics.Inertia({inertia}))",
            "joint.setTransform(place)",
            f"joint.setLinearVelocity({literal(asked.twist[:3])})",
            f"joint.setAngularVelocity({literal(asked.twist[3:])})",
        ]
    else:
        lines += ["joint.setTransformFromParentBodyNode(place)", f"places[{asked.name!r}] = {literal(asked.pose)}"]
    return [*lines, "world.addSkeleton(skeleton)", f"bodies[{asked.name!r}] = node"]


#: Lines of the function that reads all bodies.
_STATE = [
    "",
    "",
    "def state():",
    "    found = {}",
    "    for name, node in bodies.items():",
    "        place = node.getTransform()",
    "        q = place.quaternion()",
    "        pose = places.get(name) or (*place.translation(), q.w(), q.x(), q.y(), q.z())",
    "        found[name] = pose, (*node.getLinearVelocity(), *node.getAngularVelocity())",
    "    return found",
]
