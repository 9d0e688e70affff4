"""Scenes: what every engine is asked to simulate.

Conventions, said once and valid everywhere in the project
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
from itertools import combinations, combinations_with_replacement, product
from typing import Any, Literal

from adapters.plain import NAME, is_visible, one_line

Motion = Literal["free", "fixed", "prescribed"]
ImpactLaw = Literal["N-SIM", "N-SEQ"]


class SceneError(ValueError):
    """A scene is not a physical one; the message names the field in one line."""


def _finite(name: str, values: Any) -> None:
    for value in values if isinstance(values, tuple) else (values,):
        if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
            raise SceneError(f"{name}: {value!r} is not a finite number")


def _positive(name: str, values: Any) -> None:
    _finite(name, values)
    for value in values if isinstance(values, tuple) else (values,):
        if value <= 0.0:
            raise SceneError(f"{name}: {value!r} must be greater than 0")


@dataclass(frozen=True)
class Disc:
    """Planar disc of ``radius`` [m]."""

    radius: float

    def validate(self, owner: str) -> None:
        """Raise `SceneError` unless the radius is positive and finite."""
        _positive(f"{owner}.shape.radius", self.radius)

    @property
    def smallest_size(self) -> float:
        """Smallest full extent [m]."""
        return 2.0 * self.radius


@dataclass(frozen=True)
class Sphere:
    """Ball of ``radius`` [m]."""

    radius: float

    def validate(self, owner: str) -> None:
        """Raise `SceneError` unless the radius is positive and finite."""
        _positive(f"{owner}.shape.radius", self.radius)

    @property
    def smallest_size(self) -> float:
        """Smallest full extent [m]."""
        return 2.0 * self.radius


@dataclass(frozen=True)
class Box:
    """Box given by its HALF extents [m], two (planar) or three (spatial), along its body axes."""

    half_extents: tuple[float, ...]

    def validate(self, owner: str) -> None:
        """Raise `SceneError` unless all half extents are positive and finite."""
        _positive(f"{owner}.shape.half_extents", self.half_extents)

    @property
    def smallest_size(self) -> float:
        """Smallest full extent [m]."""
        return 2.0 * min(self.half_extents)


@dataclass(frozen=True)
class HalfSpace:
    """Everything with ``normal . x <= offset`` [m] is solid, in world axes; ``normal`` is a unit vector.

    It never moves, and its body's pose stays empty: normal and offset say where it lies.
    """

    normal: tuple[float, ...]
    offset: float = 0.0

    def validate(self, owner: str) -> None:
        """Raise `SceneError` unless the normal has length 1 (to 1e-9) and the offset is finite."""
        _finite(f"{owner}.shape.normal", self.normal)
        _finite(f"{owner}.shape.offset", self.offset)
        if abs(math.hypot(*self.normal) - 1.0) > 1e-9:
            raise SceneError(f"{owner}.shape.normal: {self.normal!r} must have length 1")

    @property
    def smallest_size(self) -> float:
        """A half-space has no finite extent."""
        return math.inf


Shape = Disc | Sphere | Box | HalfSpace
SHAPES: dict[str, type] = {"disc": Disc, "sphere": Sphere, "box": Box, "half_space": HalfSpace}
_SHAPE_NAMES = {cls: name for name, cls in SHAPES.items()}


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
        As in the module's conventions. An empty pose or twist stands for the origin and for rest.
    motion
        ``free``; ``fixed``; or ``prescribed`` (moves with its constant twist whatever hits it).
    force, torque
        Constant external load in world axes [N], [N m]; torque is a 1-tuple in the plane.
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


@dataclass(frozen=True)
class Pair:
    """Material of a pair of bodies; ``"*"`` stands for every body that no other entry names."""

    a: str = "*"
    b: str = "*"
    restitution: float = 0.0
    friction: float = 0.0


#: Restitution and friction that one or several entries give.
_Said = frozenset[tuple[float, float]]


class _Materials:
    """The pairs of a scene, sorted by what they name: both bodies, one, or none."""

    def __init__(self, pairs: tuple[Pair, ...]) -> None:
        self.both: dict[frozenset[str], _Said] = {}
        self.one: dict[str, _Said] = {}
        self.none: _Said = frozenset()
        for pair in pairs:
            value = frozenset(((pair.restitution, pair.friction),))
            named = frozenset((pair.a, pair.b)) - {"*"}
            if "*" not in (pair.a, pair.b):
                self.both[named] = self.both.get(named, frozenset()) | value
            elif named:
                (name,) = named
                self.one[name] = self.one.get(name, frozenset()) | value
            else:
                self.none |= value

    def said(self, a: str, b: str) -> _Said:
        """What the most specific entries for two bodies say; empty: smooth and plastic."""
        return (
            self.both.get(frozenset((a, b))) or self.one.get(a, frozenset()) | self.one.get(b, frozenset()) or self.none
        )

    def materials(self, bodies: tuple[Body, ...]) -> set[tuple[float, float]]:
        """Values of all pairs of which one body is free; bodies that no entry tells apart are looked at together."""
        kind = {body.name: (self.one.get(body.name, frozenset()), body.motion == "free") for body in bodies}
        members: dict[tuple[_Said, bool], list[str]] = {}
        for name, its in kind.items():
            members.setdefault(its, []).append(name)
        named: Counter[frozenset[tuple[_Said, bool]]] = Counter()
        found: set[tuple[float, float]] = set()
        for key, said in self.both.items():
            kinds = frozenset(kind[name] for name in key if name in kind)
            if len(key) == 2 and any(is_free for _, is_free in kinds):
                named[kinds] += 1
                a, b = sorted(key)
                found.add(_single(a, b, said))
        for first, second in combinations_with_replacement(members, 2):
            n, m = len(members[first]), len(members[second])
            count = n * m if first != second else n * (n - 1) // 2
            if (first[1] or second[1]) and count > named[frozenset((first, second))]:
                said = first[0] | second[0] or self.none
                if len(said) > 1:
                    pairs = product(members[first], members[second])
                    a, b = next((a, b) for a, b in pairs if a != b and frozenset((a, b)) not in self.both)
                    _single(a, b, said)
                found.add(next(iter(said), (0.0, 0.0)))
        return found


def _single(a: str, b: str, said: _Said) -> tuple[float, float]:
    """The one value that entries say for a pair; smooth and plastic if none says anything."""
    if len(said) > 1:
        raise SceneError(f"pair {a}-{b}: {len(said)} entries say different things; name both bodies in one")
    return next(iter(said), (0.0, 0.0))


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
        What `validation` made it from; kept for identity and display.
    impact_law
        Law for several simultaneous contacts: ``N-SIM`` or ``N-SEQ``.

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

    def __post_init__(self) -> None:
        if self.dimension not in (2, 3):
            raise SceneError(f"dimension: {self.dimension!r} must be 2 or 3")
        object.__setattr__(self, "bodies", tuple(_complete(b, self.dimension) for b in self.bodies))
        _validate_scene(self)

    def index(self, name: str) -> int:
        """Position of the body called ``name``."""
        return [body.name for body in self.bodies].index(name)

    def material(self, a: str, b: str) -> Pair:
        """Material of the pair (a, b): the most specific entry wins, the default is smooth and plastic.

        Raises
        ------
        SceneError
            If two entries are equally specific and say different things.
        """
        return Pair(a, b, *_single(a, b, self._table.said(a, b)))

    def materials(self) -> set[tuple[float, float]]:
        """Restitution and friction of all pairs that can meet, without looking at every pair.

        Raises
        ------
        SceneError
            As `material`, for the first pair of which two entries say different things.
        """
        return self._table.materials(self.bodies)

    @cached_property
    def _table(self) -> _Materials:
        return _Materials(self.pairs)

    def contact_pairs(self) -> Iterator[tuple[int, int, Pair]]:
        """Yield ``(i, j, material)`` for every pair of bodies of which at least one is free."""
        for i, j in combinations(range(len(self.bodies)), 2):
            if "free" in (self.bodies[i].motion, self.bodies[j].motion):
                yield i, j, self.material(self.bodies[i].name, self.bodies[j].name)

    def as_dict(self) -> dict[str, Any]:
        """Plain data (JSON-ready) that `scene_from_dict` reads back."""
        data = asdict(self)
        for body, raw in zip(self.bodies, data["bodies"], strict=True):
            raw["shape"] = {"type": _SHAPE_NAMES[type(body.shape)], **raw["shape"]}
        data["params"] = dict(self.params)
        return data

    def hash(self) -> str:
        """Sixteen hex digits of the SHA-256 over all physics of the scene (parameters' labels aside)."""
        data = {key: _canonical(value) for key, value in self.as_dict().items() if key != "params"}
        return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()[:16]


def scene_from_dict(data: Mapping[str, Any]) -> Scene:
    """Inverse of `Scene.as_dict`; the file boundary (`validation.scene_files`) checks types before."""
    bodies = []
    for raw in data["bodies"]:
        shape = dict(raw["shape"])
        cls = SHAPES[shape.pop("type")]
        values = {**raw, "shape": cls(**{k: _as_tuple(v) for k, v in shape.items()})}
        bodies.append(Body(**{key: _as_tuple(value) for key, value in values.items()}))
    rest = {key: _as_tuple(value) for key, value in data.items() if key not in ("bodies", "pairs", "params")}
    pairs = tuple(Pair(**pair) for pair in data["pairs"])
    return Scene(bodies=tuple(bodies), pairs=pairs, params=dict(data.get("params", {})), **rest)


def _canonical(value: Any) -> Any:
    """Numbers as floats without a negative zero, so that equal scenes have equal hashes (1 is 1.0, -0.0 is 0.0)."""
    if isinstance(value, dict):
        return {key: _canonical(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_canonical(item) for item in value]
    return float(value) + 0.0 if isinstance(value, int | float) else value


def _as_tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def _identity(dimension: int) -> tuple[float, ...]:
    """Pose at the origin, not turned."""
    return (0.0, 0.0, 0.0) if dimension == 2 else (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


def _complete(body: Body, dimension: int) -> Body:
    """Fill an empty pose, twist, force or torque with rest at the origin and no load."""
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
    )


def _validate_scene(scene: Scene) -> None:
    _positive("duration", scene.duration)
    _finite("gravity", scene.gravity)
    _length("gravity", scene.gravity, scene.dimension)
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
        _validate_pair(pair, names)
    scene.materials()  # an ambiguous one raises


def _validate_body(body: Body, dimension: int) -> None:
    planar = dimension == 2
    allowed = (Disc, Box, HalfSpace) if planar else (Sphere, Box, HalfSpace)
    if not isinstance(body.shape, allowed):
        raise SceneError(f"{body.name}.shape: a {type(body.shape).__name__} has no place in {dimension}-D")
    body.shape.validate(body.name)
    if isinstance(body.shape, Box):
        _length(f"{body.name}.shape.half_extents", body.shape.half_extents, dimension)
    if isinstance(body.shape, HalfSpace):
        _length(f"{body.name}.shape.normal", body.shape.normal, dimension)
        if body.motion != "fixed":
            raise SceneError(f"{body.name}.motion: a half-space must be fixed")
        if body.pose != _identity(dimension):
            raise SceneError(f"{body.name}.pose: a half-space lies where its normal and offset say, leave it empty")
    if body.motion not in ("free", "fixed", "prescribed"):
        raise SceneError(f"{body.name}.motion: {body.motion!r} must be free, fixed or prescribed")
    if body.motion == "free":
        _positive(f"{body.name}.mass", body.mass)
        _positive(f"{body.name}.inertia", body.inertia)
    if isinstance(body.inertia, tuple) == planar and body.motion == "free":
        raise SceneError(f"{body.name}.inertia: needs {'one number' if planar else 'three principal moments'}")
    if isinstance(body.inertia, tuple) and body.motion == "free":
        _length(f"{body.name}.inertia", body.inertia, 3)
    for name, values, length in (
        ("pose", body.pose, 3 if planar else 7),
        ("twist", body.twist, 3 if planar else 6),
        ("force", body.force, dimension),
        ("torque", body.torque, 1 if planar else 3),
    ):
        _finite(f"{body.name}.{name}", values)
        _length(f"{body.name}.{name}", values, length)
    if not planar and abs(math.hypot(*body.pose[3:]) - 1.0) > 1e-9:
        raise SceneError(f"{body.name}.pose: the quaternion {body.pose[3:]!r} must have length 1")
    if body.motion == "fixed" and any(body.twist):
        raise SceneError(f"{body.name}.twist: a fixed body cannot move")


def _validate_pair(pair: Pair, names: Mapping[str, int]) -> None:
    label = f"pair {pair.a}-{pair.b}"
    for side in (pair.a, pair.b):
        if side != "*" and side not in names:
            raise SceneError(f"{label}: there is no body called {side!r}")
    _finite(f"{label}.restitution", pair.restitution)
    _finite(f"{label}.friction", pair.friction)
    if not 0.0 <= pair.restitution <= 1.0:
        raise SceneError(f"{label}.restitution: {pair.restitution!r} must lie in [0, 1]")
    if pair.friction < 0.0:
        raise SceneError(f"{label}.friction: {pair.friction!r} must not be negative")


def _length(name: str, values: tuple[float, ...], length: int) -> None:
    if len(values) != length:
        raise SceneError(f"{name}: has {len(values)} components, needs {length}")
