"""A scene as MuJoCo's own model."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from adapters.engine import Array, EngineError
from adapters.mujoco.moving import is_moved_face
from adapters.mujoco.options import set_own
from adapters.mujoco.pairs import pair_solref, pair_solreffriction
from adapters.mujoco.profiles import own_settings
from adapters.mujoco.releases import empty_spec, geom_margin, no_autoreset
from adapters.mujoco.shipped import NOSLIP_TOLERANCE
from adapters.scene import Body, Box, Capsule, Cylinder, HalfSpace, Hull, Scene, Sphere
from adapters.scene.drives import velocity_over

#: Mass of a prescribed body over the largest free mass: a blow changes its velocity by 1e-15 of the free body's, far
#: below the round-off in every tolerance.
PRESCRIBED_MASS = 1e15
#: MuJoCo's capsules and cylinders lie along their z axis, ours along the body's x.
Z_TO_X = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)


def moments(body: Body) -> tuple[float, float, float]:
    """Principal moments of a body [kg m^2]."""
    assert isinstance(body.inertia, tuple), "MuJoCo is a 3-D engine: 2-D scenes must be embedded in 3-D before"
    return body.inertia


def has_joint(body: Body) -> bool:
    """Whether MuJoCo moves a body: free ones, and prescribed ones except half-spaces."""
    return body.motion != "fixed" and not is_moved_face(body)


def rotation(quaternion: Array) -> Array:
    """Matrices (n, 3, 3) of unit quaternions (n, 4)."""
    w, x, y, z = (quaternion / np.sqrt((quaternion * quaternion).sum(axis=1, keepdims=True))).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.array(rows).transpose(2, 0, 1)


def _turn_z_to(normal: tuple[float, ...]) -> list[float]:
    """Unit quaternion of the shortest turn from +z to ``normal``."""
    x, y, z = normal
    if z < -1.0 + 1e-12:
        return [0.0, 1.0, 0.0, 0.0]
    w = math.sqrt(0.5 * (1.0 + z))
    return [w, -0.5 * y / w, 0.5 * x / w, 0.0]


class Spec:
    """Writes a scene as an `MjSpec`: bodies, then either one material on all geoms or one entry per pair."""

    def __init__(self, scene: Scene, dt: float, settings: Mapping[str, Any], spec: Any = None) -> None:
        import mujoco

        self.mujoco, self.scene, self.dt, self.settings = mujoco, scene, dt, settings
        self.spec = spec or empty_spec(mujoco)
        materials = scene.materials()
        #: Softness of pairs with their own: solref, solimp, solreffriction, margin.
        self.apart = {(row[0], row[1]): row[2:] for row in settings.get("apart", ())}
        one = len(materials) == 1 and settings["solreffriction"] is None and not self.apart
        self.shared = materials.pop() if one else None
        self.hulls: list[str] = []
        self._options()
        free = [body for body in scene.bodies if body.motion == "free"]
        self.heavy = PRESCRIBED_MASS * max((b.mass for b in free), default=1.0)
        self.heavy_moment = PRESCRIBED_MASS * max((max(moments(b)) for b in free), default=1.0)
        for index, body in enumerate(scene.bodies):
            self._body(index, body)
        self._tolerances()
        if self.shared is None:
            for a, b, material in scene.contact_pairs():
                self._pair(a, b, material.restitution, material.friction)

    def _tolerances(self) -> None:
        """Scale tolerances so that solvers stop as with mocap bodies: by the gain of free bodies.

        Solvers stop where a step gains less than a tolerance times the sum of all moving masses and moments, which with
        prescribed ones is at once. Islands without a prescribed body are solved more strictly than otherwise.
        [engine_solver.c, mj_solPrimal; from 3.3.6 on it is the sum of an island, and ``stat.meaninertia`` is not read]
        """
        moving = [body for body in self.scene.bodies if has_joint(body)]
        free = sum(3.0 * body.mass + sum(moments(body)) for body in moving if body.motion == "free")
        driven = sum(body.motion == "prescribed" for body in moving)
        if driven:
            share = free / (free + driven * 3.0 * (self.heavy + self.heavy_moment))
            self.spec.option.tolerance = share * self.settings["tolerance"]
            self.spec.option.noslip_tolerance = share * self.settings.get("noslip_tolerance", NOSLIP_TOLERANCE)

    def _options(self) -> None:
        mj, option, settings = self.mujoco, self.spec.option, self.settings
        option.timestep = self.dt
        option.gravity = self.scene.gravity
        option.integrator = getattr(mj.mjtIntegrator, f"mjINT_{settings['integrator'].upper()}")
        option.cone = getattr(mj.mjtCone, f"mjCONE_{settings['cone'].upper()}")
        for name in ("impratio", "iterations", "tolerance", "noslip_iterations"):
            setattr(option, name, settings[name])
        option.disableflags = no_autoreset(mj)
        for name in settings.get("disabled", ()):
            option.disableflags |= int(getattr(mj.mjtDisableBit, f"mjDSBL_{name.upper()}"))
        if "solver" in settings:
            option.solver = getattr(mj.mjtSolver, f"mjSOL_{settings['solver'].upper()}")
        set_own(mj, option, own_settings(settings))

    def _body(self, index: int, body: Body) -> None:
        world = self.spec.worldbody
        if is_moved_face(body):
            made = world.add_body(name=f"body{index}", mocap=True)
        elif isinstance(body.shape, HalfSpace):
            made = world
        else:
            made = world.add_body(name=f"body{index}", pos=body.pose[:3], quat=body.pose[3:])
        if has_joint(body):
            made.add_freejoint()
            made.explicitinertial = True
            made.ipos, made.iquat = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)  # undefined ones become pos and quat
            free = body.motion == "free"
            made.mass = body.mass if free else self.heavy
            made.inertia = moments(body) if free else (self.heavy_moment,) * 3
            made.gravcomp = 0.0 if free else 1.0
        # Two geoms meet if one's contype has a bit of the other's conaffinity: only free bodies have one.
        filtered = {"contype": 0, "conaffinity": 0}
        if self.shared is not None:
            filtered = {"contype": 1, "conaffinity": int(body.motion == "free")} | self._geom_material()
        made.add_geom(name=f"geom{index}", **self._shape(body), **filtered)

    def _shape(self, body: Body) -> dict[str, Any]:
        kinds, shape = self.mujoco.mjtGeom, body.shape
        if isinstance(shape, Sphere):
            return {"type": kinds.mjGEOM_SPHERE, "size": [shape.radius, 0.0, 0.0]}
        if isinstance(shape, Box):
            return {"type": kinds.mjGEOM_BOX, "size": list(shape.half_extents)}
        if isinstance(shape, Capsule | Cylinder):
            kind = kinds.mjGEOM_CAPSULE if isinstance(shape, Capsule) else kinds.mjGEOM_CYLINDER
            return {"type": kind, "size": [shape.radius, shape.half_length, 0.0], "quat": Z_TO_X}
        if isinstance(shape, Hull):
            name = f"hull{len(self.hulls)}"
            self.hulls.append(name)
            self.spec.add_mesh(name=name, uservert=[x for vertex in shape.vertices for x in vertex])
            return {"type": kinds.mjGEOM_MESH, "meshname": name}
        assert isinstance(shape, HalfSpace)
        foot = [shape.offset * n for n in shape.normal]
        plane = {"type": kinds.mjGEOM_PLANE, "size": [0.0, 0.0, 1.0]}  # 0: without end, and exact
        return plane | {"pos": foot, "quat": _turn_z_to(shape.normal)}

    def _condim(self, friction: float) -> int:
        return 3 if friction > 0.0 else int(self.settings["smooth_condim"])

    def _geom_material(self) -> dict[str, Any]:
        assert self.shared is not None
        restitution, friction = self.shared
        return {
            "friction": [friction, 0.0, 0.0],
            "condim": self._condim(friction),
            "solref": pair_solref(self.settings, restitution, self.dt),
            "solimp": self.settings["solimp"],
            "margin": geom_margin(self.mujoco, self.settings["margin"]),
        }

    def _pair(self, a: int, b: int, restitution: float, friction: float) -> None:
        if all(isinstance(self.scene.bodies[i].shape, HalfSpace) for i in (a, b)):
            return
        settings = self.settings
        usual = (
            pair_solref(settings, restitution, self.dt),
            settings["solimp"],
            pair_solreffriction(settings, self.dt),
            settings["margin"],
        )
        solref, solimp, solreffriction, margin = self.apart.get((a, b), usual)
        self.spec.add_pair(
            name=f"pair{a}-{b}",
            geomname1=f"geom{a}",
            geomname2=f"geom{b}",
            condim=self._condim(friction),
            friction=[friction, friction, 0.0, 0.0, 0.0],
            solref=solref,
            solreffriction=solreffriction or (0.0, 0.0),  # MuJoCo's own way of saying: as solref
            solimp=solimp,
            margin=margin,
        )

    def compile(self) -> Any:
        """Compile the model; MuJoCo's error becomes one line."""
        try:
            return self.spec.compile()
        except ValueError as error:
            raise EngineError(f"scene: MuJoCo does not compile it: {' '.join(str(error).split())}") from None


def start(scene: Scene, dt: float) -> tuple[list[float], list[float]]:
    """``qpos`` and ``qvel`` of the moving bodies at the start; MuJoCo keeps angular velocity in body axes."""
    qpos: list[float] = []
    qvel: list[float] = []
    for body in scene.bodies:
        if has_joint(body):
            turn = rotation(np.array([body.pose[3:]]))[0]
            qpos += map(float, body.pose)
            qvel += map(float, (*velocity_over(body, dt, 0), *(turn.T @ np.array(body.twist[3:]))))
    return qpos, qvel
