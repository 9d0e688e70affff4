"""One DART world and its readings: velocities first, then positions; contacts belong to the step's start."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from operator import mul
from typing import Any

import numpy as np

from adapters.copied import Copied
from adapters.dart.releases import keep_awake, may_sleep, second_choice, splits_impulses
from adapters.dart.translation import frictions, restitutions
from adapters.engine import Array
from adapters.readback import free_parts, pair_materials
from adapters.scene import Body, Box, HalfSpace, Scene, Sphere
from adapters.scene.ground import reach

#: Names of the detectors' classes.
DETECTORS = {
    "fcl": "FCLCollisionDetector",
    "dart": "DARTCollisionDetector",
    "ode": "OdeCollisionDetector",
    "bullet": "BulletCollisionDetector",
}


class DartSimulation(Copied):
    """One world; bodies in the scene's order, one skeleton each.

    ``module`` is the engine's module, or a recorder of its calls (`adapters.recording`).
    """

    def __init__(self, scene: Scene, dt: float, settings: Mapping[str, Any], module: Any = None) -> None:
        dartpy = self.dartpy = module or import_module("dartpy")
        self.scene, self.dt, self.settings = scene, dt, settings
        self.world: Any = dartpy.simulation.World()
        self.world.setTimeStep(dt)
        self.world.setGravity(list(scene.gravity))
        held = self.world.getConstraintSolver()
        held.setCollisionDetector(getattr(dartpy.collision, DETECTORS[settings["detector"]])())
        keep_awake(self.world)
        self.solver: Any = self._solver(held, settings)
        self.reach = reach(scene)
        self.restitutions, self.frictions = restitutions(scene) or [], frictions(scene) or []
        self.nodes: list[Any] = []
        for index, body in enumerate(scene.bodies):
            self.nodes.append(self._made(index, body))
        self.loaded = [
            (node, list(body.force), list(body.torque))
            for node, body in zip(self.nodes, scene.bodies, strict=True)
            if body.is_loaded
        ]
        self.index = {node.getName(): index for index, node in enumerate(self.nodes)}

    def _solver(self, held: Any, settings: Mapping[str, Any]) -> Any:
        """Make and set the solver of the contact problem, and its fallback; Dantzig's is the default."""
        dartpy, name = self.dartpy, settings["solver"]
        option = dartpy.constraint.PgsBoxedLcpSolverOption()
        # Sweeps that end above the tolerance count as failed, and the result of the fallback is used unchecked: for PGS
        # the fallback has the same number of sweeps.
        first = ("iterations", "tolerance") if name == "pgs" else ("second_sweeps", "second_tolerance")
        option.mMaxIteration, option.mRelativeDeltaXTolerance = (settings[key] for key in first)
        option.mDeltaXThreshold = settings[first[1]] * (1.0 if name == "pgs" else 1e-3)
        second = second_choice(held)
        if second is not None:
            second.setOption(option)
        if name == "dantzig":
            return None
        if name == "pgs":
            # Its class has no constructor in Python; every world has one as its fallback.
            self.other = dartpy.simulation.World()
            solver = self.other.getConstraintSolver().getSecondaryBoxedLcpSolver()
            solver.setOption(option)
        else:
            solver = getattr(dartpy.constraint, {"nsgs": "Nsgs", "fbf": "Fbf"}[name] + "FrictionSolver")()
            options = solver.getOptions()
            count = "maxSweeps" if name == "nsgs" else "maxOuterIterations"
            setattr(options, count, settings["iterations"])
            options.tolerance = settings["tolerance"]
            solver.setOptions(options)
        held.setBoxedLcpSolver(solver)
        return solver

    def _made(self, index: int, asked: Body) -> Any:
        dartpy = self.dartpy
        skeleton = dartpy.dynamics.Skeleton(f"body {index}")
        free = asked.motion == "free"
        joint, node = skeleton.createFreeJointAndBodyNodePair() if free else skeleton.createWeldJointAndBodyNodePair()
        node.setName(f"body {index}")
        place = dartpy.math.Isometry3()
        shape = asked.shape
        if isinstance(shape, HalfSpace):
            # A plane touches a box at one point only; here a slab, whose upper face is the surface.
            normal = np.array(shape.normal)
            place.set_rotation(turned(normal))
            place.set_translation(list((shape.offset - self.reach) * normal))
            body = dartpy.dynamics.BoxShape([2.0 * self.reach] * 3)
        else:
            place.set_quaternion(dartpy.math.Quaternion(*asked.pose[3:]))
            place.set_translation(list(asked.pose[:3]))
            if isinstance(shape, Sphere):
                body = dartpy.dynamics.SphereShape(shape.radius)
            else:
                assert isinstance(shape, Box)
                body = dartpy.dynamics.BoxShape([2.0 * half for half in shape.half_extents])
        part = node.createShapeNode(body)
        part.createCollisionAspect()
        material = part.createDynamicsAspect()
        material.setRestitutionCoeff(self.restitutions[index])
        material.setFrictionCoeff(self.frictions[index])
        if free:
            assert isinstance(asked.inertia, tuple)
            node.setInertia(dartpy.dynamics.Inertia(asked.mass, np.zeros(3), np.diag(asked.inertia)))
            joint.setTransform(place)
            joint.setLinearVelocity(list(asked.twist[:3]))
            joint.setAngularVelocity(list(asked.twist[3:]))
        else:
            joint.setTransformFromParentBodyNode(place)
        self.world.addSkeleton(skeleton)
        return node

    def advance(self, steps: int) -> None:
        """See `Simulation.advance`; loads are cleared by every step."""
        step = self.world.step
        for _ in range(steps):
            for node, force, torque in self.loaded:
                node.setExtForce(force, [0.0, 0.0, 0.0], False, True)
                node.setExtTorque(torque, False)
            step()

    def copy_pose(self) -> list[float]:
        """Position and quaternion of each body; a half-space's own pose is the origin."""
        told: list[float] = []
        for node, asked in zip(self.nodes, self.scene.bodies, strict=True):
            if asked.motion == "free":
                place = node.getTransform()
                q = place.quaternion()
                told += (*place.translation(), q.w(), q.x(), q.y(), q.z())
            else:
                told += asked.pose
        return told

    def copy_twist(self) -> list[float]:
        """Velocity and angular velocity of each body."""
        return [x for node in self.nodes for v in (node.getLinearVelocity(), node.getAngularVelocity()) for x in v]

    def copy_contacts(self) -> list[tuple[float, ...]]:
        """Contacts of the last step; the force is on the first body, along a normal that points to it."""
        rows: list[tuple[float, ...]] = []
        for contact in self.world.getLastCollisionResult().getContacts():
            frames = contact.collisionObject1.getShapeFrame(), contact.collisionObject2.getShapeFrame()
            first, second = (self.index[frame.getBodyNode().getName()] for frame in frames)
            impulse = np.multiply(self.dt, contact.force)
            rows.append((second, first, *contact.point, *contact.normal, *impulse, -contact.penetrationDepth))
        return rows

    def readback(self) -> dict[str, Any]:
        """Values of the world and its bodies."""
        held = self.world.getConstraintSolver()
        return {
            "dt": self.world.getTimeStep(),
            "gravity": [float(g) for g in self.world.getGravity()],
            "solver": type(held.getBoxedLcpSolver()).__name__,
            "detector": type(held.getCollisionDetector()).__name__,
            "may_sleep": may_sleep(self.world),
            "split_impulse": splits_impulses(held),
            "bodies": {
                name: {
                    "mass": node.getMass(),
                    "inertia": [float(x) for x in np.diag(node.getInertia().getMoment())],
                }
                for name, node in free_parts(self.scene, self.nodes)
            },
            "pairs": pair_materials(self.scene, (self.restitutions, mul), (self.frictions, min)),
        }


def turned(normal: Array) -> Array:
    """Rotation that takes the z axis to ``normal``; exact along the axes."""
    helper = np.eye(3)[int(np.argmin(np.abs(normal)))]
    x = np.cross(helper, normal)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(normal, x), normal])
