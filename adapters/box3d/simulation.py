"""One Box3D world and its readings, by Box3D's public C functions as robox3d hands them on.

A step consists of substeps, each velocity first: poses and velocities belong together; contacts belong to the poses
before the step. Lengths in the engine have the units of the profile; readings are in metres.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from importlib import import_module
from types import SimpleNamespace
from typing import Any

import numpy as np

from adapters.copied import Copied, along_normal
from adapters.engine import Array
from adapters.readback import free_parts
from adapters.scene import Body, Box, Capsule, HalfSpace, Hull, Scene, Sphere
from adapters.scene.drives import velocity_over
from adapters.scene.ground import reach
from adapters.scene.meeting import common_material, told_pairs


class Box3DSimulation(Copied):
    """One world; bodies in the scene's order."""

    def __init__(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> None:
        robox3d, core = import_module("robox3d"), import_module("robox3d.core.world")
        self.ffi, self.lib = core.ffi, core.lib
        self.scene, self.dt, self.settings = scene, dt, settings
        units = self.units = float(settings["units_per_metre"])
        asked = self.lib.b3DefaultWorldDef()
        asked.gravity = self._vector(scene.gravity, units)
        asked.restitutionThreshold = settings["restitution_threshold"] * units
        asked.contactHertz, asked.contactDampingRatio = settings["hertz"], settings["damping_ratio"]
        asked.contactSpeed = settings["push_speed"] * units
        asked.maximumLinearSpeed = settings["maximum_speed"] * units
        asked.enableContinuous, asked.enableSleep, asked.workerCount = settings["continuous"], False, 1
        self.materials = {(i, j): (m.restitution, m.friction) for i, j, m in scene.contact_pairs()}
        #: Functions that the engine calls; they must live as long as the world.
        self.rules = [
            self.ffi.callback(f"b3{kind}Callback", self._rule(which))
            for kind, which in (("Restitution", 0), ("Friction", 1))
        ]
        self.single = common_material(scene)
        if self.single is None:
            asked.restitutionCallback, asked.frictionCallback = self.rules
        self.world: Any = self.lib.b3CreateWorld(self.ffi.addressof(asked))
        self.lib.b3World_EnableWarmStarting(self.world, settings["warm_starting"])
        self.lib.b3World_SetContactRecycleDistance(self.world, settings["recycle_distance"] * units)
        self.reach = reach(scene)
        self.index: dict[int, int] = {}
        self.bodies = [self._made(index, body) for index, body in enumerate(scene.bodies)]
        self.held = robox3d.BodyGroup([SimpleNamespace(id=body) for body in self.bodies])
        self.loads = [
            (self.bodies[i], self._vector(body.force, units), self._vector(body.torque, units**2))
            for i, body in enumerate(scene.bodies)
            if body.is_loaded
        ]
        self.driven = [k for k, body in enumerate(scene.bodies) if body.course is not None]
        self.steps = 0
        self.before = self.copy_pose()

    def _vector(self, v: Sequence[float] | Array, factor: float = 1.0) -> Any:
        return self.ffi.new("b3Vec3*", [float(x) * factor for x in v])[0]

    def _rule(self, which: int) -> Any:
        """Material of a pair: bodies are numbered from 1 in the scene's order."""
        return lambda a, i, b, j: self.materials.get((min(i, j) - 1, max(i, j) - 1), (0.0, 0.0))[which]

    def _made(self, index: int, asked: Body) -> Any:
        lib, units = self.lib, self.units
        made = lib.b3DefaultBodyDef()
        made.type = {"free": lib.b3_dynamicBody, "fixed": lib.b3_staticBody, "prescribed": lib.b3_kinematicBody}[
            asked.motion
        ]
        place, turn = asked.pose[:3], asked.pose[3:]
        if isinstance(asked.shape, HalfSpace):
            place, turn = tuple(asked.shape.offset * n for n in asked.shape.normal), _turn(asked.shape.normal)
        made.position = self._vector(place, units)
        made.rotation.s, (made.rotation.v.x, made.rotation.v.y, made.rotation.v.z) = turn[0], turn[1:]
        made.enableSleep, made.allowFastRotation = False, self.settings["fast_rotation"]
        if asked.motion != "fixed":
            made.linearVelocity = self._vector(velocity_over(asked, self.dt, 0), units)
            made.angularVelocity = self._vector(asked.twist[3:])
        body = lib.b3CreateBody(self.world, self.ffi.addressof(made))
        shape = lib.b3DefaultShapeDef()
        own = shape.baseMaterial
        own.restitution, own.friction = self.single or (0.0, 0.0)
        own.userMaterialId = index + 1
        if any(asked.surface_velocity):
            back = np.array([turn[0], *(-x for x in turn[1:])])
            own.tangentVelocity = self._vector(_rotated(back, np.array(asked.surface_velocity)), units)
        self.index[self._shape(body, self.ffi.addressof(shape), asked).index1] = index
        if asked.motion == "free":
            assert isinstance(asked.inertia, tuple)
            held = self.ffi.new("b3MassData*")
            held.mass = asked.mass
            held.inertia.cx.x, held.inertia.cy.y, held.inertia.cz.z = (moment * units**2 for moment in asked.inertia)
            lib.b3Body_SetMassData(body, held[0])
            # Moments in world axes follow from a new pose only.
            lib.b3Body_SetTransform(body, made.position, made.rotation)
        return body

    def _shape(self, body: Any, how: Any, asked: Body) -> Any:
        lib, ffi, units, shape = self.lib, self.ffi, self.units, asked.shape
        if isinstance(shape, Sphere):
            return lib.b3CreateSphereShape(body, how, ffi.new("b3Sphere*", {"radius": shape.radius * units}))
        if isinstance(shape, Capsule):
            ends = (self._vector((side * shape.half_length, 0.0, 0.0), units) for side in (-1.0, 1.0))
            return lib.b3CreateCapsuleShape(body, how, ffi.new("b3Capsule*", [*ends, shape.radius * units]))
        if isinstance(shape, Hull):
            points = ffi.new("b3Vec3[]", [tuple(x * units for x in vertex) for vertex in shape.vertices])
            hull = lib.b3CreateHull(points, len(points), len(points))
            try:
                return lib.b3CreateHullShape(body, how, hull)
            finally:
                lib.b3DestroyHull(hull)
        if isinstance(shape, Box):
            box = lib.b3MakeBoxHull(*(x * units for x in shape.half_extents))
        else:
            # In its own frame, with the surface through its origin, so single precision loses nothing.
            assert isinstance(shape, HalfSpace)
            wide = self.reach * units
            box = lib.b3MakeOffsetBoxHull(wide, wide, wide, self._vector(_axis(shape.normal), -wide))
        kept = ffi.new("b3BoxHull*", box)  # a part of it does not keep it alive
        return lib.b3CreateHullShape(body, how, ffi.addressof(kept.base))

    def advance(self, steps: int) -> None:
        """See `Simulation.advance`; forces are cleared by every step."""
        lib, count = self.lib, self.settings["substeps"]
        for k in range(steps):
            for body, force, torque in self.loads:
                lib.b3Body_ApplyForceToCenter(body, force, True)
                lib.b3Body_ApplyTorque(body, torque, True)
            for index in self.driven:
                velocity = velocity_over(self.scene.bodies[index], self.dt, self.steps)
                lib.b3Body_SetLinearVelocity(self.bodies[index], self._vector(velocity, self.units))
            if self.observed and k == steps - 1:
                self.before = self.copy_pose()
            lib.b3World_Step(self.world, self.dt, count)
            self.steps += 1

    def copy_pose(self) -> Any:
        """Position [units] and quaternion (x, y, z, w) of each body."""
        return self.held.poses()

    def poses_of(self, copies: Sequence[Any]) -> Array:
        """See `Copied.poses_of`; a half-space's own pose is the origin."""
        told = np.array(copies, float)
        poses = np.concatenate([told[..., :3] / self.units, told[..., 6:], told[..., 3:6]], axis=-1)
        poses[:, [isinstance(body.shape, HalfSpace) for body in self.scene.bodies]] = (0, 0, 0, 1, 0, 0, 0)
        return poses

    def copy_twist(self) -> Any:
        """Velocity [units/s] and angular velocity of each body."""
        return self.held.velocities()

    def twists_of(self, copies: Sequence[Any]) -> Array:
        """See `Copied.twists_of`."""
        told = np.array(copies, float)
        told[..., :3] /= self.units
        return told

    def copy_contacts(self) -> list[tuple[float, ...]]:
        """Points that touch, or have pushed within the step; impulses only where one substep is the whole step."""
        lib, rows, units = self.lib, [], self.units
        free = [body.motion == "free" for body in self.scene.bodies]
        for index, body in enumerate(self.bodies):
            room = lib.b3Body_GetContactCapacity(body) if free[index] else 0
            found = self.ffi.new("b3ContactData[]", room) if room else []
            for k in range(lib.b3Body_GetContactData(body, found, room) if room else 0):
                contact = found[k]
                i, j = self.index[contact.shapeIdA.index1], self.index[contact.shapeIdB.index1]
                other = j if i == index else i
                if free[other] and other < index:  # told already
                    continue
                rough = self.materials.get((min(i, j), max(i, j)), (0.0, 0.0))[1] > 0.0
                for m in range(contact.manifoldCount):
                    manifold = contact.manifolds[m]
                    normal = (manifold.normal.x, manifold.normal.y, manifold.normal.z)
                    for p in range(manifold.pointCount):
                        held = manifold.points[p]
                        if held.separation > 0.0 and held.totalNormalImpulse <= 0.0:
                            continue
                        anchors = ((i, held.anchorA), (j, held.anchorB))
                        ends = [self.before[body][:3] + np.array((arm.x, arm.y, arm.z)) for body, arm in anchors]
                        point = (ends[0] + ends[1]) * (0.5 / units)
                        told = held.normalImpulse / units if self.settings["substeps"] == 1 else math.nan
                        given = along_normal(told, normal, rough)
                        rows.append((i, j, *point, *normal, *given, held.separation / units))
        return rows

    def readback(self) -> dict[str, Any]:
        """Values of the world, its bodies and shapes; the spring of contacts cannot be read."""
        lib, units, g = self.lib, self.units, self.lib.b3World_GetGravity(self.world)
        told: dict[str, Any] = {
            "dt": self.dt,
            "substeps": self.settings["substeps"],
            "gravity": [x / units for x in (g.x, g.y, g.z)],
            "restitution_threshold": lib.b3World_GetRestitutionThreshold(self.world) / units,
            "maximum_speed": lib.b3World_GetMaximumLinearSpeed(self.world) / units,
            "continuous": lib.b3World_IsContinuousEnabled(self.world),
            "warm_starting": lib.b3World_IsWarmStartingEnabled(self.world),
            "recycle_distance": lib.b3World_GetContactRecycleDistance(self.world) / units,
            "sleeping": lib.b3World_IsSleepingEnabled(self.world),
            "bodies": {name: self._told(body) for name, body in free_parts(self.scene, self.bodies)},
            "pairs": {
                f"{self.scene.bodies[i].name}-{self.scene.bodies[j].name}": dict(
                    zip(("restitution", "friction"), self.single or self.materials[i, j], strict=True)
                )
                for i, j in told_pairs(self.scene)
            },
        }
        return told

    def _told(self, body: Any) -> dict[str, Any]:
        lib, held = self.lib, self.lib.b3Body_GetMassData(body)
        moments = (held.inertia.cx.x, held.inertia.cy.y, held.inertia.cz.z)
        return {
            "mass": held.mass,
            "inertia": [moment / self.units**2 for moment in moments],
            "damping": [lib.b3Body_GetLinearDamping(body), lib.b3Body_GetAngularDamping(body)],
        }

    def close(self) -> None:
        """Destroy the world: there is room for 128."""
        if self.world is not None:
            self.lib.b3DestroyWorld(self.world)
            self.world = None

    def __del__(self) -> None:
        if getattr(self, "world", None) is not None:
            self.close()


def _axis(normal: Sequence[float]) -> Array:
    """The world's axis, with its sign, that is nearest to a normal."""
    axis = np.zeros(3)
    nearest = int(np.argmax(np.abs(normal)))
    axis[nearest] = math.copysign(1.0, normal[nearest])
    return axis


def _turn(normal: Sequence[float]) -> tuple[float, ...]:
    """Quaternion (w, x, y, z) from `_axis` to a normal: none along an axis, as single precision is not exact."""
    near = _axis(normal)
    turn = np.array([1.0 + near @ normal, *np.cross(near, normal)])
    return tuple(float(x) for x in turn / np.linalg.norm(turn))


def _rotated(q: Array, v: Array) -> Array:
    """A vector rotated by a quaternion (w, x, y, z)."""
    across = 2.0 * np.cross(q[1:], v)
    return np.asarray(v + q[0] * across + np.cross(q[1:], across))
