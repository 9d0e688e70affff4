"""Bullet through PyBullet 3.2.7, stepped by `stepSimulation` in a DIRECT client of its own.

    default   Featherstone multibody path, as shipped: what `createMultiBody` gives whoever changes nothing
    tuned     rigid-body path; settings for rebounds where the scene has impacts, else settings for rest
    one       rigid-body path, one compromise for every scene

Source references are to bulletphysics/bullet3 at 6c888f4, the commit that the 3.2.7 wheels were built from.
"""

from __future__ import annotations

import math
import os
from collections.abc import Collection, Mapping
from functools import cache
from importlib.metadata import version
from types import MappingProxyType, ModuleType
from typing import Any

import numpy as np

from adapters.bullet_law import DEFAULT, ONE, loss_in_one_second, rebound_range
from adapters.engine import (
    Array,
    Contacts,
    Declared,
    Engine,
    EngineError,
    EngineFacts,
    Quirk,
    Scheme,
    Setting,
    Simulation,
)
from adapters.needs import Needs
from adapters.probes import REBOUND_LEAD, REBOUND_RADIUS, REBOUND_SPEED, REBOUND_TIME
from adapters.scene import Body, Box, HalfSpace, Scene, Sphere

#: Half thickness of the box that stands for a half-space [m]: thicker than any step is long, and thin enough that
#: contact distances, computed relative to its centre, keep 1e-14 m.
FLOOR_DEPTH = 20.0
#: Half width of that box beyond the outermost body [m]: a body may slide 100 m and stay on it.
FLOOR_REACH = 200.0
#: Where bodies wait while their inertia takes effect [m]: far from each other and from every scene.
WAITING_ROOM = 1e5
#: A prescribed body outweighs the heaviest free one by this factor; its recoil is then 1e-9 of a velocity change.
HEAVY = 1e9
#: Smallest full extent that stands still [m]; smaller ones rest at a wrong height or fall through at 1/240 s.
SMALLEST_SIZE = 5e-3
#: Smallest mass [kg] and moment [kg m^2]; the multibody path treats what is near 2.2e-16 as singular and freezes.
SMALLEST_INERTIA = 1e-12
#: The combined coefficient of friction is clamped to this (btManifoldResult.cpp:58).
LARGEST_FRICTION = 10.0

_WORLD = frozenset(
    {
        "contactBreakingThreshold",
        "contactERP",
        "contactSlop",
        "deterministicOverlappingPairs",
        "numSubSteps",
        "restitutionVelocityThreshold",
        "solverResidualThreshold",
        "splitImpulsePenetrationThreshold",
        "useSplitImpulse",
        "warmStartingFactor",
    }
)
_BODY = frozenset(
    {"angularDamping", "contactProcessingThreshold", "linearDamping", "rollingFriction", "spinningFriction"}
)


@cache
def _pybullet() -> ModuleType:
    """Import the engine; the line that it prints on file descriptor 2 while loading is dropped."""
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        import pybullet
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)
    return pybullet


# ---- profiles ----------------------------------------------------------------------------------------------------


def _breaking_threshold() -> Setting:
    because = "shipped value; set because it is a C global that every client of the process shares"
    return Setting("contactBreakingThreshold", 0.02, because, "PhysicsServerCommandProcessor.cpp:11525")


def _wide_breaking_threshold() -> Setting:
    because = (
        "contact points that drift farther in a step than this share of the body are dropped: the shipped 0.02 loses "
        "some of a box that slides 1.7 cm a step, and friction with them. Nothing is solved at a distance: "
        "contactProcessingThreshold is 0"
    )
    return Setting("contactBreakingThreshold", 0.1, because, "crosscheck tune bullet --group slide; also --profile one")


def default(needs: Needs, dt: float) -> list[Setting]:
    """As shipped: multibody path, damping 0.04, contact ERP 0.08, speculative contacts."""
    return [
        Setting("useMaximalCoordinates", 0, "shipped: createMultiBody makes a Featherstone multibody"),
        Setting("iterations", 50, "shipped", "PhysicsServerCommandProcessor.cpp:2800"),
        _breaking_threshold(),
    ]


def _rigid_body() -> list[Setting]:
    """Settings that every tuned scene shares."""
    solver = "btSequentialImpulseConstraintSolver.cpp"
    return [
        Setting(
            "useMaximalCoordinates",
            1,
            "the multibody path cannot warm start or split impulses, and restitutes gravity's own g dt",
            "btMultiBodyConstraintSolver.cpp:779,812",
        ),
        Setting("iterations", 50, "shipped; ten boxes carry their weight to 1e-8"),
        Setting("solverResidualThreshold", 0.0, "shipped 1e-7 stops at 3e-4 m/s per row"),
        Setting("warmStartingFactor", 0.85, "shipped 0.1 hardly warm starts, 1.0 adds energy", f"{solver}:988"),
        Setting("restitutionVelocityThreshold", 1e-4, "shipped 0.2 m/s swallows slow rebounds", f"{solver}:494"),
        Setting("deterministicOverlappingPairs", 1, "order of pairs is part of a Gauss-Seidel answer"),
        Setting("numSubSteps", 0, "with substeps contact forces are reported wrong", "bullet3 #2797"),
        _wide_breaking_threshold(),
        Setting("linearDamping", 0.0, "no drag in the scene"),
        Setting("angularDamping", 0.0, "no drag in the scene"),
        Setting("rollingFriction", 0.0, "no rolling resistance in the scene"),
        Setting("spinningFriction", 0.0, "no torsional resistance in the scene"),
        Setting(
            "contactProcessingThreshold",
            0.0,
            "speculative contacts take gap/dt off a rebound",
            f"{solver}:949-953; bullet3 #3094",
        ),
    ]


def tuned(needs: Needs, dt: float) -> list[Setting]:
    """Choose between settings for impacts and for rest: one knob, the split impulse, helps one and harms the other."""
    if needs.regime == "rest":
        return [
            *_rigid_body(),
            Setting("contactSlop", 1e-5, "shipped; keeps resting contacts closed"),
        ]
    return [
        *_rigid_body(),
        Setting("useSplitImpulse", 1, "overlap is pushed out without adding to a rebound"),
        Setting(
            "splitImpulsePenetrationThreshold",
            0.0,
            "split every overlap, not only those beyond 4 cm, so that none adds to a rebound; not for rest",
            "pybullet.c:1825",
        ),
        Setting(
            "contactERP",
            0.0,
            "no push-out: it adds potential energy to every impact found late, so that e = 1 grows",
            "crosscheck tune bullet --group impact",
        ),
        Setting("contactSlop", 1e-6, "a rebound met within the slop loses slop/dt; 0 makes resting boxes chatter"),
    ]


def one(needs: Needs, dt: float) -> list[Setting]:
    """One setting for all scenes: rebounds within 1 %, stacks of ten stand."""
    return [
        *_rigid_body(),
        Setting("contactSlop", 1e-5, "shipped; keeps resting contacts closed"),
        Setting("contactERP", 0.01, "a rebound gains at most this fraction of v; still pushes stacks apart"),
    ]


# ---- translation -------------------------------------------------------------------------------------------------


def _settings(settings: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """World and body parameters of a profile, validated: PyBullet ignores a bad value without a word.

    Raises
    ------
    EngineError
        Naming an unknown setting, a negative or a not finite value, or an iteration count below 1.
    """
    for name, value in settings.items():
        if name not in _WORLD | _BODY | {"useMaximalCoordinates", "iterations"}:
            raise EngineError(f"{name}: bullet has no such setting")
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise EngineError(f"{name}: {value!r} is not a number")
        if not (math.isfinite(value) and value >= 0.0):
            raise EngineError(f"{name}: {value!r} must be finite and not negative, bullet ignores it otherwise")
    iterations = settings.get("iterations", 50)
    if iterations != int(iterations) or iterations < 1:
        raise EngineError(f"iterations: {iterations!r} must be a whole number of at least 1")
    world = {name: value for name, value in settings.items() if name in _WORLD}
    body = {name: value for name, value in settings.items() if name in _BODY}
    return world | {"numSolverIterations": int(iterations)}, body


def _shares(scene: Scene, coefficient: str) -> list[float] | None:
    """Values per body whose products are the coefficients of all pairs that can meet; None if there are none.

    Bullet multiplies the coefficients of two bodies (btManifoldResult.cpp:58,70). With one free body its partners
    carry the pair's value and it carries 1, which is exact. Otherwise the logarithms of the positive pairs solve a
    linear system, and a pair of 0 needs a body that is in no positive pair.
    """
    pairs = [(i, j, float(getattr(material, coefficient))) for i, j, material in scene.contact_pairs()]
    free = [i for i, body in enumerate(scene.bodies) if body.motion == "free"]
    shares = [0.0] * len(scene.bodies)
    if len(free) == 1:
        shares[free[0]] = 1.0
        for i, j, value in pairs:
            shares[i if j == free[0] else j] = value
        return shares
    values = {value for _, _, value in pairs}
    if len(values) == 1:
        return [math.sqrt(values.pop())] * len(scene.bodies)
    positive = [(i, j, value) for i, j, value in pairs if value > 0.0]
    rows = np.zeros((len(positive), len(scene.bodies)))
    for row, (i, j, _) in enumerate(positive):
        rows[row, i] = rows[row, j] = 1.0
    logs = np.linalg.lstsq(rows, np.log([value for _, _, value in positive]), rcond=None)[0]
    for body in np.flatnonzero(rows.any(axis=0)):
        shares[body] = float(np.exp(logs[body]))
    # 1e-12: round-off of the logarithms; anything larger is a table that no product can represent.
    return shares if all(abs(shares[i] * shares[j] - value) <= 1e-12 for i, j, value in pairs) else None


def _turn_up_to(normal: tuple[float, ...]) -> tuple[float, float, float, float]:
    """Quaternion (x, y, z, w) that turns the z axis into ``normal``."""
    x, y, z = normal
    if z <= -1.0 + 1e-15:
        return (1.0, 0.0, 0.0, 0.0)
    q = np.array([-y, x, 0.0, 1.0 + z])
    qx, qy, qz, qw = (float(c) for c in q / np.linalg.norm(q))
    return (qx, qy, qz, qw)


def _placement(body: Body, scene: Scene) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
    """Half extents (or radius), position and quaternion (x, y, z, w) of a body as Bullet gets it."""
    w, x, y, z = body.pose[3:]
    if isinstance(body.shape, Sphere):
        return (body.shape.radius,), body.pose[:3], (x, y, z, w)
    if isinstance(body.shape, Box):
        return body.shape.half_extents, body.pose[:3], (x, y, z, w)
    assert isinstance(body.shape, HalfSpace)
    width = FLOOR_REACH + max(math.hypot(*other.pose[:3]) for other in scene.bodies)
    centre = tuple((body.shape.offset - FLOOR_DEPTH) * n for n in body.shape.normal)
    return (width, width, FLOOR_DEPTH), centre, _turn_up_to(body.shape.normal)


def _moments(body: Body, mass: float) -> tuple[float, ...]:
    """Principal moments as stated; equal ones for a prescribed body, so that its spin does not precess."""
    if body.motion == "free":
        assert isinstance(body.inertia, tuple)
        return body.inertia
    return (mass * body.shape.smallest_size**2,) * 3


class BulletSimulation(Simulation):
    """One world in a DIRECT client of its own."""

    def __init__(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> None:
        world, material = _settings(settings)
        self._p = _pybullet()
        self._scene, self._dt = scene, dt
        self._world, self._material = world, material
        self._maximal = int(settings.get("useMaximalCoordinates", 0))
        #: Contacts farther apart than this are not solved, yet keep reporting the impulse of their last solution.
        self._solved_gap = float(material.get("contactProcessingThreshold", math.inf))
        self._client = self._p.connect(self._p.DIRECT)
        if self._client < 0:
            raise EngineError("client: bullet has no free client, 1024 are the limit of a process")
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
        """Make the world; bodies wait far away for one step, so that the stated inertia is in force on contact.

        A body that changes its inertia or its orientation keeps the old inverse inertia in world axes through its
        next step, and a reset of its pose does not refresh it: bodies wait in their final orientation.
        """
        p, scene, client = self._p, self._scene, self._client
        p.setPhysicsEngineParameter(fixedTimeStep=self._dt, **self._world, physicsClientId=client)
        p.setGravity(0.0, 0.0, 0.0, physicsClientId=client)
        heaviest = max((body.mass for body in scene.bodies if body.motion == "free"), default=1.0)
        restitution, friction = _shares(scene, "restitution"), _shares(scene, "friction")
        if restitution is None or friction is None:
            raise EngineError("pairs: no product of two bodies' values gives this table of materials")
        self._ids: list[int] = []
        self._mass: list[float] = []
        self._offset: list[tuple[float, ...]] = []
        for i, body in enumerate(scene.bodies):
            self._add(i, body, heaviest, restitution[i], friction[i])
        self._index = {identifier: i for i, identifier in enumerate(self._ids)}
        self._ignore_pairs_that_cannot_move()
        p.stepSimulation(physicsClientId=client)
        for i, body in enumerate(scene.bodies):
            self._place(i, body)
        p.setGravity(*scene.gravity, physicsClientId=client)
        self._loads = self._constant_loads()
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
        sizes, position, quaternion = _placement(body, self._scene)
        if isinstance(body.shape, Sphere):
            shape = p.createCollisionShape(p.GEOM_SPHERE, radius=sizes[0], physicsClientId=client)
        else:
            shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=sizes, physicsClientId=client)
        mass = {"free": body.mass, "fixed": 0.0, "prescribed": HEAVY * heaviest}[body.motion]
        waiting = (WAITING_ROOM * (index + 1), WAITING_ROOM, WAITING_ROOM)
        identifier = p.createMultiBody(
            mass, shape, -1, waiting, quaternion, useMaximalCoordinates=self._maximal, physicsClientId=client
        )
        self._ids.append(identifier)
        self._mass.append(mass)
        # A half-space is drawn as a box whose centre lies below the face: the scene's pose is its own.
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
            # The rigid-body path overwrites the mass with -1 unless it comes with the inertia.
            inertia = _moments(body, mass)
            p.changeDynamics(identifier, -1, mass=mass, localInertiaDiagonal=inertia, physicsClientId=client)
        if body.motion == "prescribed":
            p.changeDynamics(identifier, -1, linearDamping=0.0, angularDamping=0.0, physicsClientId=client)

    def _ignore_pairs_that_cannot_move(self) -> None:
        """Prescribed bodies pass through fixed and prescribed ones."""
        driven = [i for i, body in enumerate(self._scene.bodies) if body.motion != "free"]
        for i in driven:
            for j in driven:
                if i < j:
                    pair = (self._ids[i], self._ids[j], -1, -1, 0)
                    self._p.setCollisionFilterPair(*pair, physicsClientId=self._client)

    def _place(self, index: int, body: Body) -> None:
        _, position, quaternion = _placement(body, self._scene)
        identifier, client = self._ids[index], self._client
        # Pose first: it zeroes the velocity.
        self._p.resetBasePositionAndOrientation(identifier, position, quaternion, physicsClientId=client)
        if body.motion != "fixed":
            self._p.resetBaseVelocity(identifier, body.twist[:3], body.twist[3:], physicsClientId=client)

    def _constant_loads(self) -> list[tuple[int, tuple[float, ...], tuple[float, ...]]]:
        """External force and torque of every body that has any; a prescribed body is held against gravity."""
        loads = []
        for i, body in enumerate(self._scene.bodies):
            force, torque = body.force, body.torque
            if body.motion == "prescribed":
                force, torque = tuple(-self._mass[i] * g for g in self._scene.gravity), (0.0, 0.0, 0.0)
            if body.motion != "fixed" and any((*force, *torque)):
                loads.append((i, force, torque))
        return loads

    def _check_readback(self, restitution: list[float], friction: list[float]) -> None:
        """Raise `EngineError` unless Bullet holds what it was given: it drops what it dislikes in silence."""
        for i, body in enumerate(self._scene.bodies):
            info = self._dynamics(i)
            asked: dict[str, Any] = {"friction": friction[i], "mass": self._mass[i]}
            if "restitution" in info:
                asked["restitution"] = restitution[i]
            if body.motion != "fixed":
                asked["inertia"] = _moments(body, self._mass[i])
            for name, value in asked.items():
                # 1e-12: the rigid-body path keeps reciprocals.
                if not np.allclose(info[name], value, rtol=1e-12, atol=0.0):
                    raise EngineError(f"{body.name}.{name}: bullet holds {info[name]!r}, asked for {value!r}")

    # -- running --

    def advance(self, steps: int) -> None:
        """Step; external loads last for one step in Bullet and are applied anew before each."""
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
            twist = self._scene.bodies[i].twist
            p.resetBaseVelocity(self._ids[i], twist[:3], twist[3:], physicsClientId=client)
        for i, force, torque in self._loads:
            centre, _ = p.getBasePositionAndOrientation(self._ids[i], physicsClientId=client)
            p.applyExternalForce(self._ids[i], -1, force, centre, p.WORLD_FRAME, physicsClientId=client)
            p.applyExternalTorque(self._ids[i], -1, torque, p.WORLD_FRAME, physicsClientId=client)

    # -- reading --

    def pose(self) -> Array:
        """Poses (n, 7); that of a half-space without the shift to the box that stands for it."""
        pose = np.empty((len(self._ids), 7))
        for i, identifier in enumerate(self._ids):
            position, (x, y, z, w) = self._p.getBasePositionAndOrientation(identifier, physicsClientId=self._client)
            pose[i, :3] = np.subtract(position, self._offset[i])
            half_space = isinstance(self._scene.bodies[i].shape, HalfSpace)
            pose[i, 3:] = self._scene.bodies[i].pose[3:] if half_space else (w, x, y, z)
        return pose

    def twist(self) -> Array:
        """Twists (n, 6) of the centres of mass in world axes."""
        twist = np.empty((len(self._ids), 6))
        for i, identifier in enumerate(self._ids):
            linear, angular = self._p.getBaseVelocity(identifier, physicsClientId=self._client)
            twist[i, :3], twist[i, 3:] = linear, angular
        return twist

    def contacts(self) -> Contacts:
        """Contact points with normal and friction impulses; gaps are those at the start of the last step."""
        rows = []
        for point in self._p.getContactPoints(physicsClientId=self._client):
            a, b = point[1], point[2]
            on_a, on_b, normal_on_b, gap = point[5:9]
            impulse = np.zeros(3)
            if gap <= self._solved_gap:
                forces = ((point[9], normal_on_b), (point[10], point[11]), (point[12], point[13]))
                # Bullet's impulses act on A, along the normal that points from B to A.
                impulse = -self._dt * sum(f * np.asarray(direction) for f, direction in forces)
            middle = 0.5 * np.add(on_a, on_b)
            rows.append((self._index[a], self._index[b], middle, np.negative(normal_on_b), impulse, gap))
        return Contacts.from_rows(rows, 3)

    def _dynamics(self, index: int) -> dict[str, Any]:
        info = self._p.getDynamicsInfo(self._ids[index], -1, physicsClientId=self._client)
        names = {"mass": 0, "friction": 1, "inertia": 2, "rolling_friction": 6, "spinning_friction": 7, "margin": 11}
        if not self._maximal:  # not filled in for rigid bodies: it would be what an older answer left there
            names["restitution"] = 5
        return {name: info[column] for name, column in names.items()}

    def readback(self) -> dict[str, Any]:
        """All that Bullet tells; most solver parameters are write-only and stand in the settings alone."""
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


# ---- the engine --------------------------------------------------------------------------------------------------

_QUIRKS = (
    Quirk(
        "coefficients of two bodies multiply",
        "values per body are solved from the pairs; a table that no product gives is refused",
        "btManifoldResult.cpp:58,70",
    ),
    Quirk(
        "a plane gives a box one contact point per step and spins it up",
        "a half-space is a thick static box, in every profile",
        "btConvexPlaneCollisionAlgorithm.cpp:92; bullet3 #1514",
    ),
    Quirk(
        "a new inertia or orientation acts a step late, and an inertia without a mass wipes a rigid body's mass",
        "bodies wait far away, already turned, for one step without gravity; mass and inertia are set together",
        "measured: a touching disc rolls at 5/7 instead of 2/3, a turned body answers a torque by its unturned inertia",
    ),
    Quirk(
        "contactBreakingThreshold is a C global that survives disconnect",
        "every profile sets it",
        "PhysicsServerCommandProcessor.cpp:11525",
    ),
    Quirk(
        "negative and NaN values are ignored without a word",
        "all numbers are validated before, and read back after, they are set",
        "pybullet.c:1825",
    ),
    Quirk(
        "contacts beyond contactProcessingThreshold keep reporting their last impulse",
        "their impulse counts as zero",
        "measured: an impulse sum six times too large after one rebound",
    ),
    Quirk(
        "getDynamicsInfo does not fill in restitution and dampings of rigid bodies: they are left from older answers",
        "not read back on that path; receipts measure them",
        "measured: 0.7 asked, 0.0 or an older body's value reported",
    ),
    Quirk(
        "contact distances are those before the step, forces those of the step",
        "said in the contact record; states are read after the step",
        "PhysicsServerCommandProcessor.cpp:8663",
    ),
    Quirk("external loads last for one step", "applied anew before every step", "PyBullet Quickstart Guide"),
    Quirk(
        "there is no kinematic body in Python and rigid static bodies ignore a velocity",
        "a prescribed body is a free one of 1e9 times the heaviest mass, its velocity set anew before every step",
        "measured: recoil 1e-9",
    ),
)


class BulletEngine(Engine):
    """Bullet 3 through PyBullet."""

    facts = EngineFacts(
        name="bullet",
        title="Bullet 3 (PyBullet)",
        package="pybullet",
        dimensions=frozenset({3}),
        scheme=Scheme("contacts at the old pose -> velocity (forces, then impulses) -> position", +1),
        customary_dt=1.0 / 240.0,
        quirks=_QUIRKS,
    )
    profiles = MappingProxyType({"default": default, "tuned": tuned, "one": one})

    def version(self) -> str:
        """Version of the installed wheel; PyBullet itself does not know it."""
        return version("pybullet")

    def refuses(self, scene: Scene, profile: str) -> str | None:
        """Refuse sizes and moments that Bullet cannot hold, too much friction, and unfactorable materials."""
        for body in scene.bodies:
            if body.shape.smallest_size < SMALLEST_SIZE:
                return f"{body.name}.shape: bullet needs sizes of at least {SMALLEST_SIZE:g} m"
            if body.motion == "free" and min(body.mass, *_moments(body, body.mass)) < SMALLEST_INERTIA:
                return f"{body.name}: bullet needs masses and moments of at least {SMALLEST_INERTIA:g}"
        if max((m.friction for _, _, m in scene.contact_pairs()), default=0.0) > LARGEST_FRICTION:
            return f"friction: bullet clamps coefficients to {LARGEST_FRICTION:g}"
        for coefficient in ("restitution", "friction"):
            if _shares(scene, coefficient) is None:
                return f"{coefficient}: bullet multiplies values of bodies, no product gives this table of pairs"
        return None

    def build(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> BulletSimulation:
        """Make a world in a new DIRECT client.

        Raises
        ------
        EngineError
            For a setting or a step that Bullet would ignore, or a scene that `refuses` names.
        """
        if not (math.isfinite(dt) and dt > 0.0):
            raise EngineError(f"dt: {dt!r} must be a positive, finite number of seconds")
        if refusal := self.refuses(scene, ""):
            raise EngineError(refusal)
        return BulletSimulation(scene, dt, settings)

    def snippet(self, settings: Mapping[str, Any], names: Collection[str], scene: Scene, dt: float) -> str:
        """Python: parameters of the world, of how bodies are made, and of each body."""
        lines = [f"# p: pybullet; fixedTimeStep={dt:.9g}; body: each of your bodies"]
        world = [f"numSolverIterations={settings[n]}" if n == "iterations" else f"{n}={settings[n]!r}"
                 for n in names if n in _WORLD | {"iterations"}]  # fmt: skip
        if world:
            lines.append(f"p.setPhysicsEngineParameter({', '.join(world)})")
        if "useMaximalCoordinates" in names:
            lines.append(f"p.createMultiBody(..., useMaximalCoordinates={settings['useMaximalCoordinates']})")
        body = [f"{n}={settings[n]!r}" for n in names if n in _BODY]
        if body:
            lines.append(f"p.changeDynamics(body, -1, {', '.join(body)})")
        return "\n".join(lines)

    def declares(self, profile: str, needs: Needs, dt: float) -> dict[str, Declared]:
        """Drag and the rebounds of the multibody path as shipped; the rebounds that `one` gains from Baumgarte."""
        if profile == "one":
            return {"restitution": _gain_of_one(needs.restitution, dt)}
        if profile != "default":
            return {}
        # 1e-12: round-off of up to a thousand steps.
        loss = Declared(loss_in_one_second(DEFAULT, dt), 1e-12, "drag of a multibody, 0.04 (1 + v) v, for spin as well")
        time = (REBOUND_LEAD + 4) * dt + REBOUND_TIME
        ball = (REBOUND_RADIUS, REBOUND_SPEED, needs.restitution, dt, REBOUND_LEAD, time)
        least, greatest = rebound_range(DEFAULT, *ball)
        because = "speculative contact takes gap/dt off a rebound, by the phase of the step: recurrence over all phases"
        rebound = Declared(0.5 * (least + greatest), 0.5 * (greatest - least), because)
        return {"linear_damping": loss, "angular_damping": loss, "restitution": rebound}


def _gain_of_one(e: float, dt: float) -> Declared:
    """An impact is found 0 .. v dt deep: Baumgarte adds up to erp v, and one met within the slop loses slop/dt."""
    lost = ONE.slop / (REBOUND_SPEED * dt)
    because = "found 0 .. v dt deep, of which contactERP per step becomes speed; within the slop, slop/dt is lost"
    return Declared(e + 0.5 * (ONE.erp - lost), 0.5 * (ONE.erp + lost), because)
