"""One PhysX world and its readings: velocities before positions; contacts belong to the step's start."""

from __future__ import annotations

import warnings
import weakref
from collections.abc import Mapping
from functools import cache
from types import ModuleType
from typing import Any

import numpy as np

from adapters.copied import Copied, along_normal
from adapters.engine import EngineError
from adapters.physx.translation import turn_to, turned
from adapters.readback import free_parts, pair_materials
from adapters.scene import Body, Box, Capsule, HalfSpace, Hull, Scene, Sphere
from adapters.scene.drives import place_after, velocity_over
from adapters.scene.means import mean, means

#: Open worlds, and the typical size of each: there is one engine per process.
_LIVING: weakref.WeakKeyDictionary[PhysxSimulation, float] = weakref.WeakKeyDictionary()


@cache
def imported() -> ModuleType:
    """Import the engine; a missing Vulkan does not matter here."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import sapien
    module: ModuleType = sapien
    return module


class PhysxSimulation(Copied):
    """One CPU world; bodies in the scene's order, one entity each.

    ``module`` is the engine's module, or a recorder of its calls (`adapters.recording`).
    """

    def __init__(self, scene: Scene, dt: float, settings: Mapping[str, Any], module: Any = None) -> None:
        sapien = self.sapien = module or imported()
        self.scene, self.dt, self.settings = scene, dt, settings
        length = settings["tolerance_length"]
        if other := next((held for held in _LIVING.values() if held != length), None):
            raise EngineError(f"tolerance_length: {length:g} m, while another world of this process uses {other:g} m")
        self.engine: Any = sapien.physx.PhysxEngine(length, 0.2)
        _LIVING[self] = length
        self.materials = {(i, j): (m.restitution, m.friction) for i, j, m in scene.contact_pairs()}
        self.restitutions, self.frictions = means(scene, "restitution") or [], means(scene, "friction") or []
        sapien.physx.set_scene_config(
            gravity=np.array(scene.gravity, np.float32),
            bounce_threshold=settings["bounce_threshold"],
            enable_pcm=settings["persistent_manifolds"],
            enable_tgs=settings["solver"] == "tgs",
            enable_ccd=False,
            enable_enhanced_determinism=False,
            enable_friction_every_iteration=settings["friction_every_iteration"],
            cpu_workers=0,
        )
        self.system: Any = sapien.physx.PhysxCpuSystem()
        self.system.timestep = dt
        self.world: Any = sapien.Scene([self.system])
        self.bodies: list[Any] = []
        for index, body in enumerate(scene.bodies):
            self.bodies.append(self._made(index, body))
        self.index = {f"body {index}": index for index in range(len(scene.bodies))}
        loaded = zip(self.bodies, scene.bodies, strict=True)
        self.loads = [(part, body.force, body.torque) for part, body in loaded if body.is_loaded]
        self.driven = [k for k, body in enumerate(scene.bodies) if body.motion == "prescribed"]
        self.steps = 0

    def _made(self, index: int, asked: Body) -> Any:
        """Make one of the scene's bodies, in its own entity."""
        sapien, physx, settings = self.sapien, self.sapien.physx, self.settings
        entity = sapien.Entity()
        entity.name = f"body {index}"
        fixed = asked.motion == "fixed"
        part = physx.PhysxRigidStaticComponent() if fixed else physx.PhysxRigidDynamicComponent()
        shape = self._shape(physx, index, asked)
        shape.contact_offset = settings["contact_offset"]
        shape.rest_offset = 0.0
        part.attach(shape)
        if not fixed:
            part.kinematic = asked.motion == "prescribed"
            part.sleep_threshold = 0.0
            part.solver_position_iterations = settings["iterations"]
            part.solver_velocity_iterations = settings["velocity_iterations"]
            part.linear_damping, part.angular_damping = 0.0, settings["angular_damping"]
            part.max_angular_velocity = settings["fastest_spin"]
            part.max_depenetration_velocity = settings["push_out"]
        if asked.motion == "free":
            part.mass, part.inertia = asked.mass, asked.inertia
            part.linear_velocity, part.angular_velocity = asked.twist[:3], asked.twist[3:]
        entity.add_component(part)
        if isinstance(asked.shape, HalfSpace):
            normal, offset = asked.shape.normal, asked.shape.offset
            entity.pose = sapien.Pose([offset * n for n in normal], list(turn_to(normal)))
        else:
            entity.pose = sapien.Pose(list(asked.pose[:3]), list(asked.pose[3:]))
        self.world.add_entity(entity)
        return part

    def _shape(self, physx: Any, index: int, asked: Body) -> Any:
        friction = self.frictions[index]
        material = physx.PhysxMaterial(friction, friction, self.restitutions[index])
        shape = asked.shape
        if isinstance(shape, HalfSpace):
            return physx.PhysxCollisionShapePlane(material)
        if isinstance(shape, Sphere):
            return physx.PhysxCollisionShapeSphere(shape.radius, material)
        if isinstance(shape, Capsule):
            return physx.PhysxCollisionShapeCapsule(shape.radius, shape.half_length, material)
        if isinstance(shape, Hull):
            held = physx.PhysxCollisionShapeConvexMesh(np.array(shape.vertices, np.float32), (1.0, 1.0, 1.0), material)
            if len(held.vertices) != len(shape.vertices):
                raise EngineError(f"{asked.name}.shape: physx uses {len(held.vertices)} of its vertices")
            return held
        assert isinstance(shape, Box)
        return physx.PhysxCollisionShapeBox(shape.half_extents, material)

    def advance(self, steps: int) -> None:
        """See `Simulation.advance`; every step clears loads, and a prescribed body gets its next pose."""
        step = self.system.step
        for _ in range(steps):
            for part, force, torque in self.loads:
                part.add_force_torque(force, torque)
            self.steps += 1
            for k in self.driven:
                self._lead(k)
            step()

    def _lead(self, k: int) -> None:
        """Set the pose of a prescribed body at the end of the next step."""
        body, time = self.scene.bodies[k], self.steps * self.dt
        place = place_after(body, time)
        self.bodies[k].kinematic_target = self.sapien.Pose(
            list(place), list(turned(body.pose[3:], body.twist[3:], time))
        )

    def copy_pose(self) -> list[float]:
        """Position and quaternion of each body; a half-space's own pose is the origin."""
        told: list[float] = []
        for part, asked in zip(self.bodies, self.scene.bodies, strict=True):
            held = part.entity.pose
            told += asked.pose if isinstance(asked.shape, HalfSpace) else (*held.p.tolist(), *held.q.tolist())
        return told

    def copy_twist(self) -> list[float]:
        """Velocity and angular velocity of each body; those of a prescribed one are known after its first step."""
        told: list[float] = []
        for part, asked in zip(self.bodies, self.scene.bodies, strict=True):
            if asked.motion == "fixed" or (asked.motion == "prescribed" and self.steps == 0):
                told += (*velocity_over(asked, self.dt, 0), *asked.twist[3:])
            else:
                told += (*part.linear_velocity.tolist(), *part.angular_velocity.tolist())
        return told

    def copy_contacts(self) -> list[tuple[float, ...]]:
        """Points with normal impulses on the first body, along a normal that points to it; without friction."""
        rows: list[tuple[float, ...]] = []
        for contact in self.system.get_contacts():
            first, second = (self.index[part.entity.name] for part in contact.bodies)
            rough = self.materials.get((min(first, second), max(first, second)), (0.0, 0.0))[1] > 0.0
            for point in contact.points:
                normal = point.normal.tolist()
                impulse = along_normal(float(point.impulse @ point.normal), normal, rough)
                rows.append((second, first, *point.position.tolist(), *normal, *impulse, point.separation))
        return rows

    def readback(self) -> dict[str, Any]:
        """Values of the world, its bodies and their materials; the typical size cannot be read."""
        config = self.system.config
        held = [part.collision_shapes[0].physical_material for part in self.bodies]
        return {
            "dt": float(self.system.timestep),
            "gravity": [float(g) for g in config.gravity],
            "solver": "tgs" if config.enable_tgs else "pgs",
            "bounce_threshold": float(config.bounce_threshold),
            "friction_every_iteration": bool(config.enable_friction_every_iteration),
            "persistent_manifolds": bool(config.enable_pcm),
            "contact_offset": [float(part.collision_shapes[0].contact_offset) for part in self.bodies],
            "bodies": {
                name: {
                    "mass": float(part.mass),
                    "inertia": [float(x) for x in part.inertia],
                    "damping": [float(part.linear_damping), float(part.angular_damping)],
                    "iterations": int(part.solver_position_iterations),
                    "velocity_iterations": int(part.solver_velocity_iterations),
                    "fastest_spin": float(part.max_angular_velocity),
                    "push_out": float(part.max_depenetration_velocity),
                    "sleep_threshold": float(part.sleep_threshold),
                }
                for name, part in free_parts(self.scene, self.bodies)
            },
            "pairs": pair_materials(
                self.scene, ([own.restitution for own in held], mean), ([own.dynamic_friction for own in held], mean)
            ),
        }

    def close(self) -> None:
        """Close the world: the next one may have another typical size."""
        self.bodies, self.loads = [], []
        self.world = self.system = self.engine = None
        _LIVING.pop(self, None)
