"""One ``PhysicsWorld`` and its readings.

A step consists of substeps, each velocity first: poses, velocities and the impulses of the whole step belong together;
points and gaps belong to the poses before it.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any

from adapters.copied import Copied, along_normal
from adapters.readback import free_parts, pair_materials
from adapters.scene import Body, Box, HalfSpace, Scene, Sphere
from adapters.scene.meeting import common_material


class Hooks:
    """Gives each pair its own material before a step is solved."""

    def __init__(self, index: Mapping[Any, int], materials: Mapping[tuple[int, int], tuple[float, float]]) -> None:
        self.index, self.materials = index, materials

    def modify_solver_contacts(self, context: Any) -> None:
        """Overwrite the engine's combination of two colliders' values."""
        i, j = self.index[context.collider1], self.index[context.collider2]
        context.restitution, context.friction = self.materials[min(i, j), max(i, j)]


class RapierSimulation(Copied):
    """One ``PhysicsWorld``; bodies in the scene's order.

    ``module`` is the engine's module, or a recorder of its calls (`adapters.recording`).
    """

    def __init__(self, scene: Scene, dt: float, settings: Mapping[str, Any], module: Any = None) -> None:
        # Its type stubs exist only where it is installed.
        rapier3d = self.rapier3d = module or import_module("rapier3d")
        self.scene, self.dt, self.settings = scene, dt, settings
        self.world: Any = rapier3d.PhysicsWorld(gravity=scene.gravity)
        self._set(dt, settings)
        self.materials = {(i, j): (m.restitution, m.friction) for i, j, m in scene.contact_pairs()}
        self.single = common_material(scene)
        self.index: dict[Any, int] = {}
        self.bodies = [self._made(index, body) for index, body in enumerate(scene.bodies)]
        if self.single is None and self.materials:
            self.world.physics_hooks = Hooks(self.index, self.materials)

    def _set(self, dt: float, settings: Mapping[str, Any]) -> None:
        rapier3d, held = self.rapier3d, self.world.integration_parameters
        held.dt = dt
        held.num_solver_iterations = settings["substeps"]
        held.num_internal_pgs_iterations = settings["iterations"]
        held.num_internal_stabilization_iterations = settings["relaxations"]
        damping = settings["damping_ratio"]
        held.contact_softness = rapier3d.SpringCoefficients(settings["frequency"], damping)
        held.static_contact_softness = rapier3d.SpringCoefficients(settings["static_frequency"], damping)
        held.normalized_allowed_linear_error = settings["allowed_error"]
        held.normalized_prediction_distance = settings["prediction"]
        held.normalized_max_linear_velocity = settings["fastest"]
        held.normalized_max_corrective_velocity = settings["push_out"]
        held.contact_recycling = settings["recycling"]
        held.contact_clustering = settings["clustering"]
        held.friction_model = getattr(rapier3d.FrictionModel, settings["friction_model"].upper())

    def _made(self, index: int, asked: Body) -> Any:
        rapier3d = self.rapier3d
        make = {
            "free": rapier3d.RigidBody.dynamic,
            "fixed": rapier3d.RigidBody.fixed,
            "prescribed": rapier3d.RigidBody.kinematic_velocity_based,
        }[asked.motion]
        x, y, z, qw, qx, qy, qz = asked.pose
        pose = rapier3d.Isometry3((x, y, z), rapier3d.Rotation3(qw, qx, qy, qz))
        builder = make(position=pose, can_sleep=False)
        if asked.motion != "fixed":
            builder = builder.linvel(asked.twist[:3]).angvel(asked.twist[3:])
        if asked.motion == "free":
            assert isinstance(asked.inertia, tuple)
            builder = builder.additional_mass_properties(
                rapier3d.MassProperties((0.0, 0.0, 0.0), asked.mass, asked.inertia)
            )
        handle = self.world.add_body(builder)
        collider = self.world.add_collider(self._shape(asked), handle)
        self.index[collider] = index
        body = self.world.rigid_bodies[handle]
        if asked.motion == "free":
            body.recompute_mass_properties_from_colliders(self.world.colliders)
            if any(asked.force):
                body.add_force(asked.force, True)
            if any(asked.torque):
                body.add_torque(asked.torque, True)
        return handle

    def _shape(self, asked: Body) -> Any:
        rapier3d = self.rapier3d
        restitution, friction = self.single or (0.0, 0.0)
        numbers = {"restitution": restitution, "friction": friction}
        if self.single is None:
            numbers["active_hooks"] = rapier3d.ActiveHooks.MODIFY_SOLVER_CONTACTS
        shape = asked.shape
        if isinstance(shape, HalfSpace):
            place = tuple(shape.offset * n for n in shape.normal)
            return rapier3d.Collider.halfspace(shape.normal, translation=place, **numbers)
        if isinstance(shape, Sphere):
            return rapier3d.Collider.ball(shape.radius, density=0.0, **numbers)
        assert isinstance(shape, Box)
        return rapier3d.Collider.cuboid(*shape.half_extents, density=0.0, **numbers)

    def advance(self, steps: int) -> None:
        """See `Simulation.advance`."""
        step = self.world.step
        for _ in range(steps):
            step()

    def copy_pose(self) -> list[float]:
        """Position and quaternion of each body."""
        told: list[float] = []
        bodies = self.world.rigid_bodies
        for handle in self.bodies:
            body = bodies[handle]
            p, q = body.translation, body.rotation
            told += (p.x, p.y, p.z, q.w, q.i, q.j, q.k)
        return told

    def copy_twist(self) -> list[float]:
        """Velocity and angular velocity of each body."""
        told: list[float] = []
        bodies = self.world.rigid_bodies
        for handle, asked in zip(self.bodies, self.scene.bodies, strict=True):
            v, w = bodies[handle].linvel, bodies[handle].angvel
            told += (v.x, v.y, v.z, w.x, w.y, w.z) if asked.motion != "fixed" else (0.0,) * 6
        return told

    def copy_contacts(self) -> list[tuple[float, ...]]:
        """Up to four points per manifold, with their normal impulses; friction impulses are not available."""
        bodies, rows = self.world.rigid_bodies, []
        for pair in self.world.narrow_phase.contact_pairs():
            i, j = self.index[pair.collider1], self.index[pair.collider2]
            rough = self.materials.get((min(i, j), max(i, j)), (0.0, 0.0))[1] > 0.0
            for manifold in pair.manifolds:
                data = manifold.data
                normal = (data.normal.x, data.normal.y, data.normal.z)
                # A solver's point is relative to a body; in world axes each body has one, in its present pose.
                places = {
                    each.contact_id: data.solver_contact_world_points(each, bodies) for each in data.solver_contacts
                }
                for k, point in enumerate(manifold.points):
                    if k not in places:
                        continue
                    p, q = places[k]
                    middle = (0.5 * (p.x + q.x), 0.5 * (p.y + q.y), 0.5 * (p.z + q.z))
                    rows.append((i, j, *middle, *normal, *along_normal(point.impulse, normal, rough), point.dist))
        return rows

    def readback(self) -> dict[str, Any]:
        """Values of the world, its bodies and colliders."""
        held, bodies = self.world.integration_parameters, self.world.rigid_bodies
        g = self.world.gravity
        told: dict[str, Any] = {
            "dt": held.dt,
            "gravity": [g.x, g.y, g.z],
            "iterations": held.num_internal_pgs_iterations,
            "substeps": held.num_solver_iterations,
            "relaxations": held.num_internal_stabilization_iterations,
            "frequency": held.contact_softness.natural_frequency,
            "static_frequency": held.static_contact_softness.natural_frequency,
            "allowed_error": held.normalized_allowed_linear_error,
            "prediction": held.normalized_prediction_distance,
            "fastest": held.normalized_max_linear_velocity,
            "push_out": held.normalized_max_corrective_velocity,
            "recycling": held.contact_recycling,
            "clustering": held.contact_clustering,
            "friction_model": str(held.friction_model),
            "threads": self.world.num_threads,
            "bodies": {
                name: {"mass": bodies[handle].mass, "damping": bodies[handle].linear_damping}
                for name, handle in free_parts(self.scene, self.bodies)
            },
        }
        if self.single:
            restitutions, frictions = ([number] * len(self.bodies) for number in self.single)
            told["pairs"] = pair_materials(self.scene, (restitutions, max), (frictions, max))
        return told
