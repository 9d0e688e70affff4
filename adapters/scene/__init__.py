"""Scenes: the input of every engine.

Conventions of the whole project
    * SI units: m, kg, s, rad, N, N s.
    * Planar scenes (``dimension = 2``): y points up, a pose is ``(x, y, theta)``, a twist ``(vx, vy, omega)``.
    * Spatial scenes (``dimension = 3``): z points up, a pose is ``(x, y, z, qw, qx, qy, qz)``, a twist
      ``(vx, vy, vz, wx, wy, wz)``, both in world axes, of the centre of mass.
    * Angles turn counter-clockwise; quaternions are ``(w, x, y, z)`` and rotate body axes into world axes.
    * Contact normals point from body A to body B, impulses act on B, a separation < 0 is an overlap.
    * Restitution and friction belong to the PAIR that touches, not to a body.

        y (2-D) / z (3-D)
        ^        +-----+
        |        |  o  |  Body: shape, mass, inertia, pose, twist
        |        +-----+
        |   ~~~~~~~~~~~~~~~~~  HalfSpace: solid where normal . x <= offset
        +----------------> x
"""

from __future__ import annotations

import hashlib
import json
import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property
from itertools import combinations
from typing import Any, Literal

from adapters.plain import NAME, REASON, is_visible, kind_of, one_line
from adapters.scene.materials import Materials, Pair, single
from adapters.scene.shapes import (
    SHAPE_NAMES,
    SHAPES,
    SHAPES_OF,
    Box,
    Capsule,
    Cylinder,
    Disc,
    HalfSpace,
    Hull,
    Polygon,
    SceneError,
    Shape,
    Sphere,
    check_finite,
    check_length,
    check_positive,
)

__all__ = [
    "Body",
    "Box",
    "Capsule",
    "Cylinder",
    "Disc",
    "HalfSpace",
    "Harmonic",
    "Hull",
    "ImpactLaw",
    "Motion",
    "Pair",
    "Polygon",
    "Scene",
    "SceneError",
    "Shape",
    "Sphere",
]

Motion = Literal["free", "fixed", "prescribed"]
ImpactLaw = Literal["N-SIM", "N-SEQ"]

#: Largest restitution of a scene that gains energy on purpose: a blow doubles the speed.
MOST_RESTITUTION = 2.0


@dataclass(frozen=True)
class Harmonic:
    """Oscillation of a prescribed body: ``amplitude`` [m] along the world axes, ``frequency`` [Hz], ``phase`` [rad]."""

    amplitude: tuple[float, ...]
    frequency: float
    phase: float = 0.0

    @property
    def top_speed(self) -> float:
        """Largest speed of the oscillation [m/s]."""
        return 2.0 * math.pi * self.frequency * math.hypot(*self.amplitude)


@dataclass(frozen=True)
class Body:
    """One rigid body.

    Parameters
    ----------
    name
        Unique within the scene.
    shape
        A shape of the scene's dimension.
    mass
        [kg]; read only if the body is free.
    inertia
        About the centre of mass [kg m^2]: one number (planar), three principal moments in body axes (spatial).
    pose, twist
        As in the module's conventions. An empty pose is the origin, an empty twist is rest.
    motion
        ``free``; ``fixed``; or ``prescribed`` (moves with its constant twist in any collision). A half-space is not
        free; it turns about the origin, which moves with it.
    force, torque
        Constant external load in world axes [N], [N m]; torque is a 1-tuple in the plane.
    surface_velocity
        Of a body that is not free: velocity of its surface relative to the body [m/s], world axes; the component along
        the touched face drags by friction (a conveyor).
    course
        Of a prescribed body: oscillation that is added to its twist (`adapters.scene.drives`).
    """

    name: str
    shape: Shape
    mass: float = 1.0
    inertia: float | tuple[float, float, float] = 1.0
    pose: tuple[float, ...] = ()
    twist: tuple[float, ...] = ()
    motion: Motion = "free"
    force: tuple[float, ...] = ()
    torque: tuple[float, ...] = ()
    surface_velocity: tuple[float, ...] = ()
    course: Harmonic | None = None

    @property
    def is_loaded(self) -> bool:
        """Whether it is free and has an external load."""
        return self.motion == "free" and (any(self.force) or any(self.torque))


@dataclass(frozen=True)
class Scene:
    """A frozen, validated scene; see the module's docstring for conventions.

    Parameters
    ----------
    name, version
        Identity; a change of physics is a new version.
    dimension
        2 or 3.
    bodies, pairs
        At least one body; the pairs' materials.
    gravity
        Acceleration [m/s^2] with ``dimension`` components.
    duration
        Simulated time [s].
    params
        Parameters from which `validation` made it; for identity and display.
    impact_law
        Law for several simultaneous contacts: ``N-SIM`` or ``N-SEQ``.
    gaining
        Whether restitution above 1 is intended: such contacts gain energy, and not every engine supports them.

    Raises
    ------
    SceneError
        Naming the offending field, for example ``ball.mass``.
    """

    name: str
    version: int
    dimension: int
    bodies: tuple[Body, ...]
    pairs: tuple[Pair, ...]
    gravity: tuple[float, ...]
    duration: float
    params: Mapping[str, float] = field(default_factory=dict)
    impact_law: ImpactLaw = "N-SIM"
    gaining: bool = False

    def __post_init__(self) -> None:
        if self.dimension not in (2, 3):
            raise SceneError(f"dimension: {self.dimension!r} must be 2 or 3")
        object.__setattr__(self, "bodies", tuple(_complete(b, self.dimension) for b in self.bodies))
        _validate_scene(self)

    def index(self, name: str) -> int:
        """Position of the body called ``name``."""
        return self.places[name]

    @cached_property
    def places(self) -> Mapping[str, int]:
        """Position of each body by its name."""
        return {body.name: k for k, body in enumerate(self.bodies)}

    def material(self, a: str, b: str) -> Pair:
        """Material of the pair (a, b): the most specific entry wins, the default is smooth and plastic.

        Raises
        ------
        SceneError
            If two equally specific entries differ.
        """
        return Pair(a, b, *single(a, b, self._table.said(a, b)))

    def materials(self) -> set[tuple[float, float]]:
        """Restitution and friction of all pairs that can touch, without a loop over all pairs.

        Raises
        ------
        SceneError
            As `material`, for the first pair with two different entries.
        """
        return self._table.materials({body.name: body.motion == "free" for body in self.bodies})

    @cached_property
    def _table(self) -> Materials:
        return Materials(self.pairs)

    def contact_pairs(self) -> Iterator[tuple[int, int, Pair]]:
        """Yield ``(i, j, material)`` for every pair of bodies of which at least one is free."""
        for i, j in combinations(range(len(self.bodies)), 2):
            if "free" in (self.bodies[i].motion, self.bodies[j].motion):
                yield i, j, self.material(self.bodies[i].name, self.bodies[j].name)

    def as_dict(self) -> dict[str, Any]:
        """Plain data (JSON-ready) that `scene_from_dict` reads back; drives and gains only where they exist."""
        data = asdict(self)
        for body, raw in zip(self.bodies, data["bodies"], strict=True):
            raw["shape"] = {"type": SHAPE_NAMES[type(body.shape)], **raw["shape"]}
            if not any(body.surface_velocity):
                del raw["surface_velocity"]
            if body.course is None:
                del raw["course"]
        if not self.gaining:
            del data["gaining"]
        data["params"] = dict(self.params)
        return data

    def hash(self) -> str:
        """Sixteen hex digits of the SHA-256 over all physics of the scene (parameters' labels aside)."""
        data = {key: _canonical(value) for key, value in self.as_dict().items() if key != "params"}
        return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()[:16]


def scene_from_dict(data: Mapping[str, Any]) -> Scene:
    """Inverse of `Scene.as_dict`; the file boundary (`validation.files.scene_files`) checks types before."""
    bodies = [body_from_dict(raw) for raw in data["bodies"]]
    rest = {key: _as_tuple(value) for key, value in data.items() if key not in ("bodies", "pairs", "params")}
    pairs = tuple(Pair(**pair) for pair in data["pairs"])
    return Scene(bodies=tuple(bodies), pairs=pairs, params=dict(data.get("params", {})), **rest)


def body_from_dict(raw: Mapping[str, Any]) -> Body:
    """One body of `Scene.as_dict`'s data, not yet checked."""
    shape = dict(raw["shape"])
    cls = SHAPES[shape.pop("type")]
    values = {**raw, "shape": cls(**{k: _as_tuple(v) for k, v in shape.items()})}
    if values.get("course") is not None:
        values["course"] = Harmonic(**{k: _as_tuple(v) for k, v in values["course"].items()})
    return Body(**{key: _as_tuple(value) for key, value in values.items()})


def check_body(body: Body, dimension: int) -> None:
    """Raise `SceneError`, naming the field, unless ``body`` is valid in a scene of this dimension."""
    _validate_body(_complete(body, dimension), dimension)


def _canonical(value: Any) -> Any:
    """Numbers as floats without a negative zero, so that equal scenes have equal hashes (1 is 1.0, -0.0 is 0.0)."""
    if isinstance(value, dict):
        return {key: _canonical(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_canonical(item) for item in value]
    return float(value) + 0.0 if isinstance(value, int | float) else value


def _as_tuple(value: Any) -> Any:
    return tuple(map(_as_tuple, value)) if isinstance(value, list | tuple) else value


def _identity(dimension: int) -> tuple[float, ...]:
    """Pose at the origin, not rotated."""
    return (0.0, 0.0, 0.0) if dimension == 2 else (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


def _complete(body: Body, dimension: int) -> Body:
    """Fill an empty pose, twist, force, torque or surface velocity with rest at the origin and no load."""
    return Body(
        body.name,
        body.shape,
        body.mass,
        body.inertia,
        body.pose or _identity(dimension),
        body.twist or (0.0,) * (3 if dimension == 2 else 6),
        body.motion,
        body.force or (0.0,) * dimension,
        body.torque or (0.0,) * (1 if dimension == 2 else 3),
        body.surface_velocity or (0.0,) * dimension,
        body.course,
    )


def _validate_scene(scene: Scene) -> None:
    if not isinstance(scene.name, str) or not is_visible(scene.name) or len(scene.name) > REASON:
        raise SceneError(f"name: {one_line(scene.name, NAME)!r} cannot be the name of a scene")
    check_positive("duration", scene.duration)
    check_finite("gravity", scene.gravity)
    check_length("gravity", scene.gravity, scene.dimension)
    if not scene.bodies:
        raise SceneError("bodies: a scene needs at least one body")
    names = Counter(body.name for body in scene.bodies)
    for name, count in names.items():
        if not isinstance(name, str) or not 0 < len(name) <= NAME or name == "*" or not is_visible(name):
            raise SceneError(f"bodies: {one_line(name, NAME)!r} cannot be the name of a body")
        if count > 1:
            raise SceneError(f"bodies: the name {name!r} is used {count} times")
    for body in scene.bodies:
        _validate_body(body, scene.dimension)
    for pair in scene.pairs:
        _validate_pair(pair, names, MOST_RESTITUTION if scene.gaining else 1.0)
    scene.materials()  # an ambiguous one raises


def _validate_body(body: Body, dimension: int) -> None:
    planar = dimension == 2
    if not isinstance(body.shape, SHAPES_OF[dimension]):
        raise SceneError(f"{body.name}.shape: {kind_of(body.shape)} cannot be used in {dimension}-D")
    body.shape.validate(body.name)
    if isinstance(body.shape, Box):
        check_length(f"{body.name}.shape.half_extents", body.shape.half_extents, dimension)
    if isinstance(body.shape, HalfSpace):
        check_length(f"{body.name}.shape.normal", body.shape.normal, dimension)
        if body.motion == "free":
            raise SceneError(f"{body.name}.motion: a half-space is fixed or prescribed")
        if body.pose != _identity(dimension):
            raise SceneError(f"{body.name}.pose: normal and offset define the place of a half-space; leave pose empty")
    if body.motion not in ("free", "fixed", "prescribed"):
        raise SceneError(f"{body.name}.motion: {body.motion!r} must be free, fixed or prescribed")
    if body.motion == "free":
        check_positive(f"{body.name}.mass", body.mass)
        check_positive(f"{body.name}.inertia", body.inertia)
    if isinstance(body.inertia, tuple) == planar and body.motion == "free":
        raise SceneError(f"{body.name}.inertia: needs {'one number' if planar else 'three principal moments'}")
    if isinstance(body.inertia, tuple) and body.motion == "free":
        check_length(f"{body.name}.inertia", body.inertia, 3)
    for name, values, length in (
        ("pose", body.pose, 3 if planar else 7),
        ("twist", body.twist, 3 if planar else 6),
        ("force", body.force, dimension),
        ("torque", body.torque, 1 if planar else 3),
    ):
        check_finite(f"{body.name}.{name}", values)
        check_length(f"{body.name}.{name}", values, length)
    if not planar and abs(math.hypot(*body.pose[3:]) - 1.0) > 1e-9:
        raise SceneError(f"{body.name}.pose: the quaternion {body.pose[3:]!r} must have length 1")
    if body.motion == "fixed" and any(body.twist):
        raise SceneError(f"{body.name}.twist: a fixed body cannot move")
    _check_drive(body, dimension)


def _check_drive(body: Body, dimension: int) -> None:
    """Raise `SceneError` for an invalid surface velocity or course; pose and twist are already checked."""
    check_finite(f"{body.name}.surface_velocity", body.surface_velocity)
    check_length(f"{body.name}.surface_velocity", body.surface_velocity, dimension)
    if any(body.surface_velocity):
        if body.motion == "free":
            raise SceneError(f"{body.name}.surface_velocity: only a body that is not free can have a surface velocity")
        if isinstance(body.shape, HalfSpace):
            lifting = sum(v * n for v, n in zip(body.surface_velocity, body.shape.normal, strict=True))
            if abs(lifting) > 1e-9 * math.hypot(*body.surface_velocity):
                raise SceneError(f"{body.name}.surface_velocity: {body.surface_velocity!r} does not lie in the face")
    course = body.course
    if course is None:
        return
    if not isinstance(course, Harmonic):
        raise SceneError(f"{body.name}.course: {course!r} is not a course")
    if body.motion != "prescribed":
        raise SceneError(f"{body.name}.course: only a prescribed body has a course")
    check_finite(f"{body.name}.course.amplitude", course.amplitude)
    check_length(f"{body.name}.course.amplitude", course.amplitude, dimension)
    check_positive(f"{body.name}.course.frequency", course.frequency)
    check_finite(f"{body.name}.course.phase", course.phase)


def _validate_pair(pair: Pair, names: Mapping[str, int], most: float) -> None:
    label = one_line(f"pair {pair.a}-{pair.b}", 2 * NAME + 6)
    for side in (pair.a, pair.b):
        if side != "*" and side not in names:
            raise SceneError(f"{label}: there is no body called {side!r}")
    check_finite(f"{label}.restitution", pair.restitution)
    check_finite(f"{label}.friction", pair.friction)
    if not 0.0 <= pair.restitution <= most:
        raise SceneError(f"{label}.restitution: {pair.restitution!r} must lie in [0, {most:g}]")
    if pair.friction < 0.0:
        raise SceneError(f"{label}.friction: {pair.friction!r} must not be negative")
