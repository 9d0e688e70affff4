"""Format of a scene file: its fields, and how what a user states becomes a scene.

Types are checked here by pydantic, physics by `adapters.scene.Scene`. Three things are filled in or put right, and each
is said in a note that goes with the scene: the mass and the moments of inertia of a free body that gives none, and
the length of a half-space's normal.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from adapters.scene import Pair, Scene, SceneError, Shape, scene_from_dict
from adapters.shapes import MOST_VERTICES
from validation.centring import centre
from validation.mass_properties import HOW, moments, volume
from validation.quantities import QUANTITIES, parts_of
from validation.stated import Stated, StatedCheck


class _Strict(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class DiscModel(_Strict):
    """Planar disc."""

    type: Literal["disc"]
    radius: float


class SphereModel(_Strict):
    """Ball."""

    type: Literal["sphere"]
    radius: float


class BoxModel(_Strict):
    """Box by half extents."""

    type: Literal["box"]
    half_extents: tuple[float, ...]


class CapsuleModel(_Strict):
    """All points within ``radius`` of a segment of 2 ``half_length`` on the body's x axis [m]."""

    type: Literal["capsule"]
    half_length: float
    radius: float


class CylinderModel(_Strict):
    """Cylinder about the body's x axis, 2 ``half_length`` long [m]; spatial."""

    type: Literal["cylinder"]
    half_length: float
    radius: float


class PolygonModel(_Strict):
    """Convex polygon by its corners [m], counter-clockwise; planar. The body's centre is their centroid."""

    type: Literal["polygon"]
    vertices: tuple[tuple[float, float], ...] = Field(min_length=3, max_length=MOST_VERTICES)


class HullModel(_Strict):
    """Convex hull of its corners [m]; spatial. The body's centre is its centre of mass."""

    type: Literal["hull"]
    vertices: tuple[tuple[float, float, float], ...] = Field(min_length=4, max_length=MOST_VERTICES)


class HalfSpaceModel(_Strict):
    """Solid where n . x <= offset [m], with n the direction of ``normal``, or tilted by ``angle``.

    ``angle`` [rad] turns a floor that faces up: counter-clockwise in the plane, so that a positive angle rises along x;
    in space it rises along x as well.
    """

    type: Literal["half_space"]
    normal: tuple[float, ...] | None = None
    angle: float | None = None
    offset: float = 0.0


class CourseModel(_Strict):
    """Oscillation of a prescribed body, added to its twist: ``amplitude`` [m] along the world axes, ``frequency`` [Hz].

    It begins where the body's pose is: displaced by amplitude (sin(2 pi frequency t + phase) - sin(phase)).
    """

    amplitude: tuple[float, ...]
    frequency: float
    phase: float = 0.0


class BodyModel(_Strict):
    """A body; see `adapters.scene.Body`. ``mass`` [kg] or ``density`` [kg/m^2 in the plane, kg/m^3 in space].

    ``surface_velocity`` [m/s, world axes] makes a conveyor of a body that is not free.
    """

    name: str
    shape: Annotated[
        DiscModel | SphereModel | BoxModel | HalfSpaceModel | CapsuleModel | PolygonModel | CylinderModel | HullModel,
        Field(discriminator="type"),
    ]
    mass: float | None = None
    density: float | None = None
    inertia: float | tuple[float, float, float] | None = None
    pose: tuple[float, ...] = ()
    twist: tuple[float, ...] = ()
    motion: Literal["free", "fixed", "prescribed"] = "free"
    force: tuple[float, ...] = ()
    torque: tuple[float, ...] = ()
    surface_velocity: tuple[float, ...] = ()
    course: CourseModel | None = None


class PairModel(_Strict):
    """Material of a pair; see `adapters.scene.Pair`."""

    a: str = Pair.a
    b: str = Pair.b
    restitution: float = Pair.restitution
    friction: float = Pair.friction


class CheckModel(_Strict):
    """A number that the scene's author knows: PASS if |measured - value| <= tolerance.

    Parameters
    ----------
    quantity
        ``BODY.QUANTITY`` such as ``ball.y`` [m], ``box.angle`` [rad, turned since the start], ``ball.vx`` [m/s],
        ``box.omega`` [rad/s], ``box.fy`` [N, mean force of all contacts on the body over the last second, or the last
        half of a shorter run]; ``floor/box.fy`` is the force of the contacts with ``floor`` alone.
    at
        When [s]; the end if it is missing. Between two samples the quantity is interpolated. Forces have no ``at``.
    because
        Where the number comes from; shown with the verdict.
    """

    quantity: str
    value: float
    tolerance: float = Field(gt=0.0)
    at: float | None = Field(default=None, ge=0.0)
    because: str = "stated in the scene file"


class SceneModel(_Strict):
    """A scene file."""

    name: str = Field(min_length=1)
    version: int = 1
    dimension: Literal[2, 3]
    gravity: tuple[float, ...]
    duration: float
    impact_law: Literal["N-SIM", "N-SEQ"] = "N-SIM"
    bodies: tuple[BodyModel, ...]
    pairs: tuple[PairModel, ...] = ()
    checks: tuple[CheckModel, ...] = ()


def stated(model: SceneModel) -> Stated:
    """Make the scene that a file describes.

    Raises
    ------
    SceneError
        Naming the field that is no physics, or the check that names nothing.
    """
    notes: list[str] = []
    data = model.model_dump(exclude={"checks"})
    for body in data["bodies"]:
        _face(body, model.dimension, notes)
        if body["shape"]["type"] in ("polygon", "hull"):
            centre(body, notes)
        _mass(body, model.dimension, notes)
    scene = scene_from_dict(data)
    for number, check in enumerate(model.checks):
        _refuse_wrong_check(f"checks.{number}", check, scene)
    quantities = [(check.quantity, check.at) for check in model.checks]
    for quantity, at in quantities:
        if quantities.count((quantity, at)) > 1:
            raise SceneError(f"checks: {quantity!r} is stated {quantities.count((quantity, at))} times")
    checks = tuple(StatedCheck(**check.model_dump()) for check in model.checks)
    return Stated(scene, tuple(notes), checks)


def _face(body: dict[str, Any], dimension: int, notes: list[str]) -> None:
    """Give a half-space its unit normal."""
    shape = body["shape"]
    if shape["type"] != "half_space":
        return
    label, normal, angle = f"{body['name']}.shape", shape["normal"], shape.pop("angle")
    if (normal is None) == (angle is None):
        raise SceneError(f"{label}: a half-space is given by its normal or by its angle, one of them")
    if angle is not None:
        flat = (0.0,) * (dimension - 2)
        shape["normal"] = (-math.sin(angle) + 0.0, *flat, math.cos(angle))
        return
    length = math.hypot(*normal)
    if not (math.isfinite(length) and length > 0.0):
        raise SceneError(f"{label}.normal: {normal!r} has no direction")
    if abs(length - 1.0) > 1e-15:  # what is 1 to round-off keeps its bits
        shape["normal"] = tuple(component / length for component in normal)
    if abs(length - 1.0) > 1e-9:
        notes.append(f"{label}.normal: its length {length:.6g} was made 1; the offset stays a distance [m]")


def _mass(body: dict[str, Any], dimension: int, notes: list[str]) -> None:
    """Give a body its mass and inertia, and say what was not given."""
    name, density = body["name"], body.pop("density")
    if density is not None and body["mass"] is not None:
        raise SceneError(f"{name}.density: give the mass or the density, not both")
    if density is not None and not density > 0.0:
        raise SceneError(f"{name}.density: {density!r} must be greater than 0")
    if body["motion"] != "free" or body["shape"]["type"] == "half_space":
        body["mass"] = 1.0 if body["mass"] is None else body["mass"]
        body["inertia"] = 1.0 if body["inertia"] is None else body["inertia"]
        return
    shape = _shape(body["shape"], name)
    unit = "kg m^2"
    if density is not None:
        body["mass"] = density * volume(shape, dimension)
        notes.append(f"{name}.mass: {body['mass']:.6g} kg, its density times its {_content(dimension)}")
    elif body["mass"] is None:
        body["mass"] = 1.0
        notes.append(f"{name}.mass: 1 kg, none was given")
    if body["inertia"] is None and body["mass"] > 0.0:
        body["inertia"] = moments(shape, body["mass"], dimension)
        told = body["inertia"] if isinstance(body["inertia"], tuple) else (body["inertia"],)
        numbers = ", ".join(f"{moment:.6g}" for moment in told)
        notes.append(f"{name}.inertia: {numbers} {unit}, of a uniform {HOW[type(shape)]}; none was given")
    elif body["inertia"] is None:
        body["inertia"] = 1.0 if dimension == 2 else (1.0, 1.0, 1.0)  # the mass is refused next, by its own name


def _content(dimension: int) -> str:
    return "area" if dimension == 2 else "volume"


def _shape(raw: dict[str, Any], owner: str) -> Shape:
    """Return a checked shape: its mass needs sizes that are sizes."""
    from adapters.scene import SHAPES

    shape: Shape = SHAPES[raw["type"]](**{key: value for key, value in raw.items() if key != "type"})
    shape.validate(owner)
    return shape


def _refuse_wrong_check(label: str, check: CheckModel, scene: Scene) -> None:
    names = [b.name for b in scene.bodies]
    partner, body, what = parts_of(check.quantity, names)
    for name in (name for name in (body, partner) if name is not None):
        if name not in names:
            raise SceneError(f"{label}.quantity: {check.quantity!r} names no body of the scene: {', '.join(names)}")
    known = QUANTITIES[scene.dimension]
    if what not in known:
        raise SceneError(f"{label}.quantity: {what!r} is not one of {', '.join(known)}")
    is_force = what.startswith("f")
    if partner is not None and not is_force:
        raise SceneError(f"{label}.quantity: {check.quantity!r}: only a force is between two bodies")
    if is_force and check.at is not None:
        raise SceneError(f"{label}.at: a force is a mean over the end of the run, it has no instant")
    if check.at is not None and check.at > scene.duration:
        raise SceneError(f"{label}.at: {check.at!r} s is after the end, {scene.duration!r} s")
