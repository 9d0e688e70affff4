"""One Drake plant and its readings: contacts are found at the start of the step, velocities come before positions."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any

import numpy as np

from adapters.copied import Copied
from adapters.drake.profiles import APPROXIMATIONS, CONTINUOUS, OWN
from adapters.drake.translation import frictions, pair_of
from adapters.engine import EngineError
from adapters.readback import free_parts
from adapters.scene import Body, Box, Capsule, Cylinder, HalfSpace, Scene, Sphere


class DrakeSimulation(Copied):
    """One plant and its simulator; bodies in the scene's order, fixed ones belong to the world.

    ``module`` is the engine's module, or a recorder of its calls (`adapters.recording`).
    """

    def __init__(self, scene: Scene, dt: float, settings: Mapping[str, Any], module: Any = None) -> None:
        drake = self.drake = module or import_module("pydrake.all")
        self.scene, self.dt, self.settings = scene, dt, settings
        builder = drake.DiagramBuilder()
        stepped = settings["approximation"] != CONTINUOUS
        self.plant, self.graph = drake.AddMultibodyPlantSceneGraph(builder, dt if stepped else 0.0)
        plant = self.plant
        if stepped:
            approximation = getattr(drake.DiscreteContactApproximation, APPROXIMATIONS[settings["approximation"]])
            plant.set_discrete_contact_approximation(approximation)
        plant.set_contact_model(drake.ContactModel.kHydroelasticWithFallback)
        plant.set_stiction_tolerance(settings["stiction_tolerance"])
        plant.mutable_gravity_field().set_gravity_vector(list(scene.gravity))
        self.materials = made_of(scene, settings)
        self.owner: dict[Any, int] = {}
        self.bodies = [self._made(index, body) for index, body in enumerate(scene.bodies)]
        plant.Finalize()
        diagram = builder.Build()
        self.simulator: Any = drake.Simulator(diagram)
        if not stepped:
            scheme = {"integration_scheme": CONTINUOUS, "max_step_size": dt, "accuracy": settings["accuracy"]}
            drake.ApplySimulatorConfig(drake.SimulatorConfig(**scheme), self.simulator)
        #: What a force of the plant is multiplied by: of a continuous plant it is that of an instant, of no step [s].
        self.acting = dt if stepped else np.nan
        self.context: Any = plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())
        for body, asked in zip(self.bodies, scene.bodies, strict=True):
            if asked.motion == "free":
                plant.SetFreeBodyPose(self.context, body, self._place(asked))
                twist = drake.SpatialVelocity(np.array(asked.twist[3:]), np.array(asked.twist[:3]))
                plant.SetFreeBodySpatialVelocity(self.context, body, twist)
        self._load()
        self.simulator.Initialize()
        self.steps = 0

    def _place(self, asked: Body) -> Any:
        turn = np.array(asked.pose[3:], float)
        quaternion = self.drake.Quaternion(turn / float(np.linalg.norm(turn)))
        return self.drake.RigidTransform(quaternion, np.array(asked.pose[:3], float))

    def _made(self, index: int, asked: Body) -> Any:
        """Register a body and its shape."""
        drake, shape = self.drake, asked.shape
        free = asked.motion == "free"
        if free:
            assert isinstance(asked.inertia, tuple)
            unit = drake.UnitInertia(*np.divide(asked.inertia, asked.mass))
            body = self.plant.AddRigidBody(f"body {index}", drake.SpatialInertia(asked.mass, [0.0, 0.0, 0.0], unit))
            place = drake.RigidTransform()
        else:
            body, place = self.plant.world_body(), self._place(asked)
        held = self._held(index, shape)
        if isinstance(shape, HalfSpace):
            normal = np.array(shape.normal)
            place = drake.HalfSpace.MakePose(normal, shape.offset * normal)
            made: Any = drake.HalfSpace()
        elif isinstance(shape, Sphere):
            made = drake.Sphere(shape.radius)
        elif isinstance(shape, Capsule | Cylinder):
            kind = drake.Capsule if isinstance(shape, Capsule) else drake.Cylinder
            made = kind(shape.radius, 2.0 * shape.half_length)
            # Drake's lie along z, the scene's along x.
            place = place.multiply(drake.RigidTransform(drake.RotationMatrix.MakeYRotation(0.5 * np.pi), np.zeros(3)))
        else:
            assert isinstance(shape, Box)
            made = drake.Box(*(2.0 * half for half in shape.half_extents))
        geometry = self.plant.RegisterCollisionGeometry(body, place, made, f"shape {index}", held)
        self.owner[geometry] = index
        return body

    def _held(self, index: int, shape: Any) -> Any:
        """Contact parameters of a body."""
        drake, held = self.drake, self.drake.ProximityProperties()
        friction, kind, resolution, modulus, stiffness, dissipation, relaxation = self.materials[index]
        drake.AddContactMaterial(
            dissipation=dissipation,
            point_stiffness=stiffness,
            friction=drake.CoulombFriction(friction, friction),
            properties=held,
        )
        held.AddProperty("material", "relaxation_time", relaxation)
        if kind == "compliant":
            drake.AddCompliantHydroelasticProperties(resolution, modulus, held)
        elif kind == "rigid" and isinstance(shape, HalfSpace):
            drake.AddRigidHydroelasticProperties(held)
        elif kind == "rigid":
            drake.AddRigidHydroelasticProperties(resolution, held)
        return held

    def _load(self) -> None:
        """Constant forces and torques of the scene."""
        drake, loads = self.drake, []
        for body, asked in zip(self.bodies, self.scene.bodies, strict=True):
            if asked.motion == "free" and (any(asked.force) or any(asked.torque)):
                load = drake.ExternallyAppliedSpatialForce()
                load.body_index = body.index()
                load.p_BoBq_B = [0.0, 0.0, 0.0]
                load.F_Bq_W = drake.SpatialForce(list(asked.torque), list(asked.force))
                loads.append(load)
        if loads:
            port = self.plant.get_applied_spatial_force_input_port()
            port.FixValue(self.context, drake.Value(loads))

    def advance(self, steps: int) -> None:
        """See `Simulation.advance`."""
        for _ in range(steps):
            self.steps += 1
            self.simulator.AdvanceTo(self.steps * self.dt)

    def copy_pose(self) -> list[float]:
        """Position and quaternion of each body."""
        told: list[float] = []
        for body, asked in zip(self.bodies, self.scene.bodies, strict=True):
            if asked.motion != "free":
                told += asked.pose
                continue
            place = self.plant.EvalBodyPoseInWorld(self.context, body)
            told += (*place.translation(), *place.rotation().ToQuaternion().wxyz())
        return told

    def copy_twist(self) -> list[float]:
        """Velocity and angular velocity of each body."""
        told: list[float] = []
        for body in self.bodies:
            velocity = self.plant.EvalBodySpatialVelocityInWorld(self.context, body)
            told += (*velocity.translational(), *velocity.rotational())
        return told

    def copy_contacts(self) -> list[tuple[float, ...]]:
        """Contacts of the last step: of a pair with a ball its point, of others the centroid of their surface."""
        rows: list[tuple[float, ...]] = []
        if self.steps == 0:
            return rows
        found = self.plant.get_contact_results_output_port().Eval(self.context)
        for k in range(found.num_point_pair_contacts()):
            info = found.point_pair_contact_info(k)
            pair = info.point_pair()
            first, second = self.owner[pair.id_A], self.owner[pair.id_B]
            # The normal points from B to A, and the force is on B.
            impulse = np.multiply(self.acting, info.contact_force())
            rows.append((first, second, *info.contact_point(), *-pair.nhat_BA_W, *impulse, -pair.depth))
        for k in range(found.num_hydroelastic_contacts()):
            info = found.hydroelastic_contact_info(k)
            surface = info.contact_surface()
            first, second = self.owner[surface.id_M()], self.owner[surface.id_N()]
            force = info.F_Ac_W()
            # The force is on M; faces look out of N, into M.
            normal = np.sum([surface.area(f) * surface.face_normal(f) for f in range(surface.num_faces())], axis=0)
            normal = normal / np.linalg.norm(normal)
            impulse = np.multiply(self.acting, force.translational())
            rows.append((second, first, *surface.centroid(), *normal, *impulse, np.nan))
        return rows

    def readback(self) -> dict[str, Any]:
        """Values of the plant, its bodies and their shapes."""
        plant, inspector = self.plant, self.graph.model_inspector()
        held = {index: inspector.GetProximityProperties(geometry) for geometry, index in self.owner.items()}
        own = [
            float(held[index].GetProperty("material", "coulomb_friction").dynamic_friction())
            for index in range(len(held))
        ]
        inertias = {
            name: body.CalcSpatialInertiaInBodyFrame(self.context) for name, body in free_parts(self.scene, self.bodies)
        }
        if plant.time_step() > 0.0:
            how = {"dt": float(plant.time_step()), "approximation": plant.get_discrete_contact_approximation().name}
        else:
            integrator = self.simulator.get_integrator()
            how = {
                "dt": float(integrator.get_maximum_step_size()),
                "approximation": type(integrator).__name__,
                "accuracy": float(integrator.get_target_accuracy()),
            }
        return how | {
            "gravity": [float(g) for g in plant.gravity_field().gravity_vector()],
            "contact_model": plant.get_contact_model().name,
            "bodies": {
                name: {
                    "mass": float(inertia.get_mass()),
                    "inertia": [float(x) for x in inertia.CalcRotationalInertia().get_moments()],
                }
                for name, inertia in inertias.items()
            },
            "pairs": {
                f"{self.scene.bodies[i].name}-{self.scene.bodies[j].name}": {"friction": pair_of(own[i], own[j])}
                for i, j, _ in self.scene.contact_pairs()
            },
        }


def made_of(scene: Scene, settings: Mapping[str, Any]) -> list[tuple[Any, ...]]:
    """Contact parameters of each body, a row as in `OWN`: from its model, or from the settings.

    Raises
    ------
    EngineError
        If the number of a model's rows differs from that of the bodies.
    """
    own = settings.get(OWN)
    if own is not None and len(own) != len(scene.bodies):
        raise EngineError(f"{OWN}: has {len(own)} rows, needs one for each of {len(scene.bodies)} bodies")
    if own is not None:
        return list(own)
    # Two in series: each has twice the pair's. Times of a pair add up.
    stiffness, relaxation = 2.0 * settings["point_stiffness"], 0.5 * settings["relaxation_time"]
    modulus, dissipation = settings["modulus"], settings["dissipation"]
    rows: list[tuple[Any, ...]] = []
    for body, friction in zip(scene.bodies, frictions(scene) or [], strict=True):
        surface = settings["boxes"] == "hydroelastic" and isinstance(body.shape, Box | HalfSpace)
        kind = "none" if not surface else "compliant" if body.motion == "free" else "rigid"
        rows.append((friction, kind, body.shape.smallest_size, modulus, stiffness, dissipation, relaxation))
    return rows
