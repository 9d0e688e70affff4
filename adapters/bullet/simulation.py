"""One world of Bullet, stepped by `stepSimulation` in its own DIRECT client."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from functools import cache
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from adapters.bullet import clipped
from adapters.bullet.profiles import by_call
from adapters.bullet.translation import Z_TO_X, factors, moments, placement
from adapters.copied import Copied
from adapters.engine import Array, Contacts, EngineError
from adapters.scene import Body, Box, Capsule, Cylinder, HalfSpace, Hull, Scene, Sphere
from adapters.scene.drives import velocity_over

#: Waiting places of bodies while their inertia takes effect [m]: far from each other and from every scene.
WAITING_ROOM = 1e5
#: Mass of a prescribed body over the heaviest free one; its recoil is then round-off of a velocity change.
HEAVY = 1e15


@cache
def pybullet_here() -> ModuleType:
    """Import the engine without the line that it prints on file descriptor 2 while loading."""
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        import pybullet
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)
    module: ModuleType = pybullet
    return module


class BulletSimulation(Copied):
    """One world in its own DIRECT client."""

    def __init__(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> None:
        world, material = by_call(settings)
        self._p = pybullet_here()
        self._scene, self._dt = scene, dt
        self._world, self._material = world, material
        self._maximal = int(settings.get("useMaximalCoordinates", 0))
        #: Contacts farther apart than this are not solved, but still report the impulse of their last solution.
        self._solved_gap = float(material.get("contactProcessingThreshold", math.inf))
        self._client = self._p.connect(self._p.DIRECT)
        if self._client < 0:
            raise EngineError("client: bullet allows 1024 clients in a process, and none is free")
        try:
            self._build()
        except self._p.error as error:
            self.close()
            raise EngineError(f"build: {error}") from None
        except BaseException:
            self.close()
            raise

    # -- building --

    def _build(self) -> None:
        """Make the world; bodies wait far away for one step, so that the stated inertia holds at contact.

        After a change of inertia or orientation a body keeps the old inverse inertia in world axes for its next step,
        and a reset of its pose does not update it: bodies wait in their final orientation.
        """
        p, scene, client = self._p, self._scene, self._client
        p.setPhysicsEngineParameter(fixedTimeStep=self._dt, **self._world, physicsClientId=client)
        p.setGravity(0.0, 0.0, 0.0, physicsClientId=client)
        heaviest = max((body.mass for body in scene.bodies if body.motion == "free"), default=1.0)
        restitution, friction = factors(scene, "restitution"), factors(scene, "friction")
        if restitution is None or friction is None:
            raise EngineError("pairs: this table of materials is no product of two bodies' values")
        self._ids: list[int] = []
        self._mass: list[float] = []
        self._offset: list[tuple[float, ...]] = []  # offset of the centre of Bullet's body from the scene's pose
        faces = [(i, body.pose[3:]) for i, body in enumerate(scene.bodies) if isinstance(body.shape, HalfSpace)]
        self._faces = [i for i, _ in faces]
        self._normals = np.array([turn for _, turn in faces]).reshape(-1, 4)
        for i, body in enumerate(scene.bodies):
            self._add(i, body, heaviest, restitution[i], friction[i])
        self._index = {identifier: i for i, identifier in enumerate(self._ids)}
        self._ignore_pairs_that_cannot_move()
        p.stepSimulation(physicsClientId=client)
        for i, body in enumerate(scene.bodies):
            self._place(i, body)
        p.setGravity(*scene.gravity, physicsClientId=client)
        self._loads, self._made = self._constant_loads(), 0
        self._driven = [i for i, body in enumerate(scene.bodies) if body.motion == "prescribed"]
        if self._driven:
            names = ", ".join(scene.bodies[i].name for i in self._driven)
            self.initial_change = (
                f"prescribed motion of {names}: a body of {HEAVY:g} times the heaviest mass whose velocity is set anew"
                " before every step",
            )
        self._check_readback(restitution, friction)

    def _add(self, index: int, body: Body, heaviest: float, restitution: float, friction: float) -> None:
        p, client = self._p, self._client
        sizes, position, quaternion = placement(body, self._scene)
        mass = {"free": body.mass, "fixed": 0.0, "prescribed": HEAVY * heaviest}[body.motion]
        waiting = (WAITING_ROOM * (index + 1), WAITING_ROOM, WAITING_ROOM)
        common = {"useMaximalCoordinates": self._maximal, "physicsClientId": client}
        if "enableSAT" in self._world and isinstance(body.shape, Box | HalfSpace | Hull):
            known = bool(self._world["enableSAT"])
            identifier = clipped.made(p, body.shape, sizes, mass, known, waiting, quaternion, **common)
        else:
            shape = self._shape(body, sizes)
            identifier = p.createMultiBody(mass, shape, -1, waiting, quaternion, **common)
        self._ids.append(identifier)
        self._mass.append(mass)
        # A half-space is a box whose centre lies below the face; the scene's pose is that of the face.
        shift = np.subtract(position, body.pose[:3]) if isinstance(body.shape, HalfSpace) else np.zeros(3)
        self._offset.append(tuple(float(s) for s in shift))
        p.changeDynamics(
            identifier,
            -1,
            restitution=restitution,
            lateralFriction=friction,
            **self._material,
            physicsClientId=client,
        )
        if body.motion != "fixed":
            # The rigid-body path overwrites the mass with -1 unless mass and inertia are set together.
            inertia = moments(body, mass)
            p.changeDynamics(identifier, -1, mass=mass, localInertiaDiagonal=inertia, physicsClientId=client)
        if body.motion == "prescribed":
            p.changeDynamics(identifier, -1, linearDamping=0.0, angularDamping=0.0, physicsClientId=client)

    def _shape(self, body: Body, sizes: tuple[float, ...]) -> int:
        p, client = self._p, self._client
        how: dict[str, Any]
        if isinstance(body.shape, Sphere):
            kind, how = p.GEOM_SPHERE, {"radius": sizes[0]}
        elif isinstance(body.shape, Capsule | Cylinder):
            kind = p.GEOM_CAPSULE if isinstance(body.shape, Capsule) else p.GEOM_CYLINDER
            how = {"radius": sizes[0], "height": sizes[1], "collisionFrameOrientation": Z_TO_X}
        elif isinstance(body.shape, Hull):
            kind, how = p.GEOM_MESH, {"vertices": body.shape.vertices}
        else:
            kind, how = p.GEOM_BOX, {"halfExtents": sizes}
        return int(p.createCollisionShape(kind, **how, physicsClientId=client))

    def _ignore_pairs_that_cannot_move(self) -> None:
        """Prescribed bodies pass through fixed and prescribed ones."""
        driven = [i for i, body in enumerate(self._scene.bodies) if body.motion != "free"]
        for i in driven:
            for j in driven:
                if i < j:
                    pair = (self._ids[i], self._ids[j], -1, -1, 0)
                    self._p.setCollisionFilterPair(*pair, physicsClientId=self._client)

    def _place(self, index: int, body: Body) -> None:
        _, position, quaternion = placement(body, self._scene)
        identifier, client = self._ids[index], self._client
        # Pose first: it zeroes the velocity.
        self._p.resetBasePositionAndOrientation(identifier, position, quaternion, physicsClientId=client)
        if body.motion != "fixed":
            velocity = velocity_over(body, self._dt, 0)
            self._p.resetBaseVelocity(identifier, velocity, body.twist[3:], physicsClientId=client)

    def _constant_loads(self) -> list[tuple[int, tuple[float, ...], tuple[float, ...]]]:
        """External force and torque of each loaded body; gravity on a prescribed body is cancelled."""
        loads = []
        for i, body in enumerate(self._scene.bodies):
            force, torque = body.force, body.torque
            if body.motion == "prescribed":
                force, torque = tuple(-self._mass[i] * g for g in self._scene.gravity), (0.0, 0.0, 0.0)
            if body.motion != "fixed" and any((*force, *torque)):
                loads.append((i, force, torque))
        return loads

    def _check_readback(self, restitution: list[float], friction: list[float]) -> None:
        """Raise `EngineError` unless Bullet has the given values: it silently drops invalid ones."""
        for i, body in enumerate(self._scene.bodies):
            info = self._dynamics(i)
            asked: dict[str, Any] = {"friction": friction[i], "mass": self._mass[i]}
            if "restitution" in info:
                asked["restitution"] = restitution[i]
            if body.motion != "fixed":
                asked["inertia"] = moments(body, self._mass[i])
            for name, value in asked.items():
                # 1e-12: the rigid-body path stores reciprocals.
                if not np.allclose(info[name], value, rtol=1e-12, atol=0.0):
                    raise EngineError(f"{body.name}.{name}: bullet holds {info[name]!r}, asked for {value!r}")

    # -- running --

    def advance(self, steps: int) -> None:
        """Step; external loads last for one step in Bullet and are applied again before each."""
        step, client = self._p.stepSimulation, self._client
        if not (self._loads or self._driven):
            for _ in range(steps):
                step(physicsClientId=client)
            return
        for _ in range(steps):
            self._apply_loads()
            step(physicsClientId=client)

    def _apply_loads(self) -> None:
        p, client = self._p, self._client
        for i in self._driven:
            body = self._scene.bodies[i]
            velocity = velocity_over(body, self._dt, self._made)
            p.resetBaseVelocity(self._ids[i], velocity, body.twist[3:], physicsClientId=client)
        self._made += 1
        for i, force, torque in self._loads:
            centre, _ = p.getBasePositionAndOrientation(self._ids[i], physicsClientId=client)
            p.applyExternalForce(self._ids[i], -1, force, centre, p.WORLD_FRAME, physicsClientId=client)
            p.applyExternalTorque(self._ids[i], -1, torque, p.WORLD_FRAME, physicsClientId=client)

    # -- reading --

    # Copies are lists of numbers or arrays: millions of tuples that stay are work for the garbage collector.

    def copy_pose(self) -> list[float]:
        """Position of each body, and its orientation with w last."""
        ask, client, told = self._p.getBasePositionAndOrientation, self._client, []
        for identifier in self._ids:
            place, turn = ask(identifier, client)
            told += place
            told += turn
        return told

    def poses_of(self, copies: Sequence[list[float]]) -> Array:
        """Poses; that of a half-space without the shift to its box."""
        pose = np.array(copies).reshape(len(copies), -1, 7)[:, :, [0, 1, 2, 6, 3, 4, 5]]
        pose[..., :3] -= self._offset
        pose[:, self._faces, 3:] = self._normals
        return pose

    def copy_twist(self) -> list[float]:
        """Velocity and angular velocity of each body."""
        ask, client, told = self._p.getBaseVelocity, self._client, []
        for identifier in self._ids:
            velocity, spin = ask(identifier, client)
            told += velocity
            told += spin
        return told

    def twists_of(self, copies: Sequence[list[float]]) -> Array:
        """Twists of the centres of mass in world axes."""
        return np.array(copies).reshape(len(copies), -1, 6)

    def copy_contacts(self) -> Array:
        """A row for each contact point: the values of `getContactPoints` from number 5 on, and its two bodies."""
        told = self._p.getContactPoints(physicsClientId=self._client)
        rows = [x[5] + x[6] + x[7] + x[8:11] + x[11] + x[12:13] + x[13] + x[1:3] for x in told]
        return np.array(rows, float).reshape(-1, 21)

    def contacts_of(self, copies: Sequence[Array]) -> tuple[NDArray[np.int64], Contacts]:
        """Contact points with normal and friction impulses; gaps are those at the start of the last step."""
        counts = np.array([len(rows) for rows in copies], np.int64)
        told = np.concatenate(copies)
        on_a, on_b, normal, along, across = (told[:, k : k + 3] for k in (0, 3, 6, 12, 16))
        gap, *forces = (told[:, [k]] for k in (9, 10, 11, 15))
        # Bullet's impulses act on A, along the normal that points from B to A. The sum starts from zero, so a sum of
        # negative zeros is zero.
        pushed = 0.0 + forces[0] * normal + forces[1] * along + forces[2] * across
        impulse = np.where(gap <= self._solved_gap, -self._dt * pushed, 0.0)
        a, b = (np.array([self._index[body] for body in told[:, k].astype(int).tolist()], np.int64) for k in (19, 20))
        return counts, Contacts.turned(a, b, 0.5 * (on_a + on_b), -normal, impulse, gap[:, 0])

    def _dynamics(self, index: int) -> dict[str, Any]:
        info = self._p.getDynamicsInfo(self._ids[index], -1, physicsClientId=self._client)
        names = {"mass": 0, "friction": 1, "inertia": 2, "rolling_friction": 6, "spinning_friction": 7, "margin": 11}
        if not self._maximal:  # not filled in for rigid bodies: it would be a value of an older call
            names["restitution"] = 5
        return {name: info[column] for name, column in names.items()}

    def readback(self) -> dict[str, Any]:
        """All readable values of Bullet; most solver parameters are write-only and are in the settings only."""
        parameters = self._p.getPhysicsEngineParameters(physicsClientId=self._client)
        names = [body.name for body in self._scene.bodies]
        return {
            **parameters,
            "bodies": {name: self._dynamics(i) for i, name in enumerate(names)},
        }

    def close(self) -> None:
        """Disconnect the client; it frees its world."""
        if self._client >= 0:
            self._p.disconnect(self._client)
            self._client = -1
