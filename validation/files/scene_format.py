"""Format of a scene file: its fields, and their conversion to a scene.

Types are checked here by pydantic, physics by `adapters.scene.Scene`. Some values are filled in or corrected, each with
a note of the scene: missing mass and moments of inertia of a free body, missing restitution and friction of pairs, and
the length of a half-space's normal.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, Strict, field_validator

from adapters.plain import listed, one_line
from adapters.scene import Box, Pair, Scene, SceneError, Shape, body_from_dict, check_body, scene_from_dict
from adapters.scene.materials import Materials
from adapters.scene.shapes import MOST_VERTICES, check_length
from validation.files import forces
from validation.files.centring import centre
from validation.files.expressions import FUNCTIONS, FormulaError, value_of
from validation.files.magnitudes import check_magnitudes, impossible_inertia
from validation.files.mass_properties import HOW, moments, volume
from validation.files.quantities import QUANTITIES, parts_of
from validation.files.stated import Stated, StatedCheck
from validation.metrics import OVER_TIME


class SceneErrors(SceneError):
    """Several fields are wrong: one line with all of them, or the first few."""

    def __init__(self, wrong: list[str]) -> None:
        super().__init__(listed(wrong))


#: A number of a file: neither ``true`` nor digits in quotes, which would be mistakes.
Number = Annotated[float, Strict()]
Whole = Annotated[int, Strict()]
#: Text that is shown: one line without control characters.
Text = Annotated[str, AfterValidator(lambda text: one_line(" ".join(text.split())))]


class _Strict(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class DiscModel(_Strict):
    """Planar disc."""

    type: Literal["disc"]
    radius: Number


class SphereModel(_Strict):
    """Ball."""

    type: Literal["sphere"]
    radius: Number


class BoxModel(_Strict):
    """Box by half extents."""

    type: Literal["box"]
    half_extents: tuple[Number, ...]


class CapsuleModel(_Strict):
    """All points within ``radius`` of a segment of 2 ``half_length`` on the body's x axis [m]."""

    type: Literal["capsule"]
    half_length: Number
    radius: Number


class CylinderModel(_Strict):
    """Cylinder about the body's x axis, 2 ``half_length`` long [m]; spatial."""

    type: Literal["cylinder"]
    half_length: Number
    radius: Number


class PolygonModel(_Strict):
    """Convex polygon by its corners [m], counter-clockwise; planar. The body's centre is their centroid."""

    type: Literal["polygon"]
    vertices: tuple[tuple[Number, Number], ...] = Field(min_length=3, max_length=MOST_VERTICES)


class HullModel(_Strict):
    """Convex hull of its corners [m]; spatial. The body's centre is its centre of mass."""

    type: Literal["hull"]
    vertices: tuple[tuple[Number, Number, Number], ...] = Field(min_length=4, max_length=MOST_VERTICES)


class HalfSpaceModel(_Strict):
    """Solid where n . x <= offset [m], with n the direction of ``normal``, or tilted by ``angle``.

    ``angle`` [rad] turns a floor that faces up: counter-clockwise in the plane, so that a positive angle rises along x;
    in space it rises along x as well.
    """

    type: Literal["half_space"]
    normal: tuple[Number, ...] | None = None
    angle: Number | None = None
    offset: Number = 0.0


class CourseModel(_Strict):
    """Oscillation of a prescribed body, added to its twist: ``amplitude`` [m] along the world axes, ``frequency`` [Hz].

    It begins where the body's pose is: displaced by amplitude (sin(2 pi frequency t + phase) - sin(phase)).
    """

    amplitude: tuple[Number, ...]
    frequency: Number
    phase: Number = 0.0


class BodyModel(_Strict):
    """A body; see `adapters.scene.Body`. ``mass`` [kg] or ``density`` [kg/m^2 in the plane, kg/m^3 in space].

    ``surface_velocity`` [m/s, world axes] makes a conveyor of a body that is not free.
    """

    name: str
    shape: Annotated[
        DiscModel | SphereModel | BoxModel | HalfSpaceModel | CapsuleModel | PolygonModel | CylinderModel | HullModel,
        Field(discriminator="type"),
    ]
    mass: Number | None = None
    density: Number | None = None
    inertia: Number | tuple[Number, Number, Number] | None = None
    pose: tuple[Number, ...] = ()
    twist: tuple[Number, ...] = ()
    motion: Literal["free", "fixed", "prescribed"] = "free"
    force: tuple[Number, ...] = ()
    torque: tuple[Number, ...] = ()
    surface_velocity: tuple[Number, ...] = ()
    course: CourseModel | None = None


class PairModel(_Strict):
    """Material of a pair; see `adapters.scene.Pair`."""

    a: str = Pair.a
    b: str = Pair.b
    restitution: Number = Pair.restitution
    friction: Number = Pair.friction


class CheckModel(_Strict):
    """A check of the scene's author: PASS if |measured - value| <= tolerance.

    Value and tolerance are numbers or formulas (`validation.files.expressions`) in ``pi``, ``g`` (size of the gravity),
    ``t`` (time of the check [s]) and the file's constants; a tolerance in the step ``dt`` [s] as well.

    Parameters
    ----------
    quantity
        ``BODY.QUANTITY`` such as ``ball.y`` [m], ``box.angle`` [rad, turned since the start], ``ball.vx`` [m/s],
        ``box.omega`` [rad/s], ``box.fy`` [N, force of all contacts on the body]; ``floor/box.fy`` is the force of the
        contacts with ``floor`` alone. ``floor/box.contact_fy`` [N] is the force of each single contact,
        ``floor/box.contacts`` their number, and ``floor/box.overlap_without_force`` [m] the overlap of the two
        throughout a step without a force between them. These have values for each step.
    at
        Time [s]; the end if missing. Positions, angles and velocities are interpolated between samples. A force is that
        of the step that contains the instant, its impulse over its length.
    over
        Statistic of a force or the like over the last second, or the last half of a shorter run: ``mean``, ``least``,
        ``greatest`` or ``spread`` (standard deviation from step to step). Without it the value must hold all the time:
        mean, least and greatest within the tolerance, and the spread within the tolerance of 0.
    because
        Source of the value; shown with the verdict.
    """

    quantity: str
    value: Number | str
    tolerance: Annotated[Number, Field(gt=0.0)] | str
    at: Number | None = Field(default=None, ge=0.0)
    over: Literal["mean", "least", "greatest", "spread"] | None = None
    because: Text = "stated in the scene file"


class SceneModel(_Strict):
    """A scene file.

    ``format`` is the version of this description; ``constants`` are names for formulas of checks. ``growth``, for
    planar scenes, is the factor by which the motion amplifies a distance from the plane until the end, a number of at
    least 1 or a formula: 3-D engines must stay in the plane, and round-off grows by it. Without it a factor of a
    thousand is allowed.
    """

    format: Literal[1] = 1
    name: str = Field(min_length=1)
    version: Whole = 1
    dimension: Literal[2, 3]
    gravity: tuple[Number, ...]
    duration: Number
    impact_law: Literal["N-SIM", "N-SEQ"] = "N-SIM"
    growth: Number | str = 1.0
    bodies: tuple[BodyModel, ...]
    pairs: tuple[PairModel, ...] = ()
    constants: dict[str, Number | str] = {}
    checks: tuple[CheckModel, ...] = ()

    @field_validator("format", "dimension", mode="before")
    @classmethod
    def _whole(cls, value: Any) -> Any:
        """Refuse ``true`` and 2.0, which a choice of values would accept as 1 and 2."""
        if isinstance(value, bool | float):
            raise ValueError("must be a whole number")
        return value


def stated(model: SceneModel) -> Stated:
    """Make the scene that a file describes.

    Raises
    ------
    SceneErrors
        With every unphysical field, and every check of an unknown quantity.
    """
    notes: list[str] = []
    wrong: list[str] = []
    data = model.model_dump(exclude={"checks", "constants", "format", "growth"})
    data["bodies"] = list(data["bodies"])
    for k, body in enumerate(data["bodies"]):
        try:
            _face(body, model.dimension, notes)
            if body["shape"]["type"] in ("polygon", "hull"):
                centre(body, notes)
            _mass(body, model.dimension, notes)
            check_body(body_from_dict(body), model.dimension)
        except (SceneError, ArithmeticError) as error:
            # A body without a name is named by its position in the list.
            wrong.append(("" if body["name"] else f"bodies.{k}") + _why(error, f"{body['name']}.shape"))
            data["bodies"][k] = _stand_in(body["name"], model.dimension)
    try:
        scene = scene_from_dict(data)
        check_magnitudes(scene)
    except (SceneError, ArithmeticError) as error:
        raise SceneErrors([*wrong, _why(error, "gravity")]) from None
    numbered = [(f"checks.{k}", check) for k, check in enumerate(model.checks)]
    right = [(label, check) for label, check in numbered if _is_right(label, check, scene, wrong)]
    quantities = [(check.quantity, check.at, over) for check in model.checks for over in _overs(check, scene)]
    for quantity, at, over in dict.fromkeys(quantities):
        if quantities.count((quantity, at, over)) > 1:
            wrong.append(f"checks: {quantity!r} is stated {quantities.count((quantity, at, over))} times")
    notes += [*impossible_inertia(scene), *_materials(model, scene)]
    names = dict(told(model, scene, wrong))
    made = [each for label, check in right for each in _stated(label, check, scene, names, wrong)]
    growth = _growth(model, scene, names, wrong)
    if wrong:
        raise SceneErrors(list(dict.fromkeys(wrong)))
    return Stated(scene, tuple(notes), tuple(made), growth)


def _overs(check: CheckModel, scene: Scene) -> tuple[str | None, ...]:
    """Statistics of a check's quantity: a force that is constant has the same value in each of these."""
    _, _, what = parts_of(check.quantity, scene.places.keys())
    if check.over is not None:
        return (check.over,)
    # A force between two bodies at an instant is one number; single contacts may differ.
    is_many = forces.is_over_time(what) and (check.at is None or what.startswith("contact_"))
    return tuple(OVER_TIME) if is_many else (None,)


def _materials(model: SceneModel, scene: Scene) -> Iterator[str]:
    """Notes on pairs: values that an entry leaves out, and pairs without an entry."""
    for pair in model.pairs:
        left = [name for name in ("restitution", "friction") if name not in pair.model_fields_set]
        which = "all pairs" if (pair.a, pair.b) == (Pair.a, Pair.b) else f"{pair.a}-{pair.b}"
        for name in left:
            yield f"pairs: {name} {getattr(Pair, name):g} of {which}, none was given"
    if any((pair.a, pair.b) == (Pair.a, Pair.b) for pair in scene.pairs):
        return
    untold = Pair(restitution=-1.0, friction=-1.0)  # such numbers do not occur
    free = {body.name: body.motion == "free" for body in scene.bodies}
    if (-1.0, -1.0) in Materials((*scene.pairs, untold)).materials(free):
        which = "pairs without an entry" if scene.pairs else "all pairs"
        yield f"pairs: restitution {Pair.restitution:g} and friction {Pair.friction:g} of {which}, none was given"


def _growth(model: SceneModel, scene: Scene, names: dict[str, float], wrong: list[str]) -> float:
    """Stated growth of a distance from the plane; errors are added to ``wrong``."""
    try:
        growth = value_of(model.growth, {**names, "t": scene.duration})
    except FormulaError as error:
        wrong.append(f"growth: {error}")
        return 1.0
    if not growth >= 1.0:
        wrong.append(f"growth: {growth:g} is less than 1; 1 means no growth")
    if scene.dimension == 3 and growth != 1.0:
        wrong.append("growth: a 3-D scene has no plane that it could leave")
    return growth


def _why(error: Exception, field: str) -> str:
    """Text of an error; for an overflow, which has no location, with its field."""
    if isinstance(error, SceneError):
        return one_line(error)
    return one_line(f"{field}: its numbers are too large or too small to compute with")


def _stand_in(name: str, dimension: int) -> dict[str, Any]:
    """A body in the place of a wrong one, so that the rest of the scene can be checked."""
    kind, inertia = ("disc", 1.0) if dimension == 2 else ("sphere", (1.0, 1.0, 1.0))
    return {"name": name, "shape": {"type": kind, "radius": 1.0}, "mass": 1.0, "inertia": inertia}


def told(model: SceneModel, scene: Scene, wrong: list[str]) -> Iterator[tuple[str, float]]:
    """Names and values for formulas: pi, g, the file's constants in order.

    Errors of constants are added to ``wrong``.
    """
    names = {"pi": math.pi, "g": math.hypot(*scene.gravity)}
    yield from names.items()
    for name, formula in model.constants.items():
        label = f"constants.{one_line(name, 40)}"
        if not name.isidentifier() or name in (*names, *FUNCTIONS, "t", "dt"):
            wrong.append(f"{label}: cannot be the name of a constant, or is already defined")
            continue
        try:
            names[name] = value_of(formula, names)
        except FormulaError as error:
            wrong.append(f"{label}: {error}")
            continue
        yield name, names[name]


def _stated(
    label: str, check: CheckModel, scene: Scene, names: dict[str, float], wrong: list[str]
) -> Iterator[StatedCheck]:
    """The check with its value, for each of its statistics; its tolerance is tried at steps of 1 s and 1 ns."""
    when = scene.duration if check.at is None else check.at
    here = {**names, "t": when}
    field = "value"
    try:
        value = value_of(check.value, here)
        field = "tolerance"
        for dt in (1.0, 1e-9):
            if not value_of(check.tolerance, {**here, "dt": dt}) > 0.0:
                raise FormulaError(f"{check.tolerance!r} is not greater than 0 at a step of {dt:g} s")
    except FormulaError as error:
        wrong.append(f"{label}.{field}: {error}")
        return
    used = here if isinstance(check.tolerance, str) else {}
    for over in _overs(check, scene):
        # A constant has no spread.
        own = 0.0 if over == "spread" and check.over is None else value
        yield StatedCheck(check.quantity, own, check.tolerance, check.at, check.because, used, over)


def _face(body: dict[str, Any], dimension: int, notes: list[str]) -> None:
    """Give a half-space its unit normal."""
    shape = body["shape"]
    if shape["type"] != "half_space":
        return
    label, normal, angle = f"{body['name']}.shape", shape["normal"], shape.pop("angle")
    if (normal is None) == (angle is None):
        raise SceneError(f"{label}: a half-space needs either a normal or an angle")
    if angle is not None:
        flat = (0.0,) * (dimension - 2)
        shape["normal"] = (-math.sin(angle) + 0.0, *flat, math.cos(angle))
        return
    length = math.hypot(*normal)
    if not (math.isfinite(length) and length > 0.0):
        raise SceneError(f"{label}.normal: {normal!r} has no direction")
    if abs(length - 1.0) > 1e-15:  # a length of 1 to round-off is not changed
        shape["normal"] = tuple(component / length for component in normal)
    if abs(length - 1.0) > 1e-9:
        notes.append(f"{label}.normal: its length {length:.6g} was set to 1; the offset is still a distance [m]")


def _mass(body: dict[str, Any], dimension: int, notes: list[str]) -> None:
    """Give a body its mass and inertia, with notes on what was not given."""
    name, density = body["name"], body.pop("density")
    if density is not None and body["mass"] is not None:
        raise SceneError(f"{name}.density: give either mass or density")
    if density is not None and not density > 0.0:
        raise SceneError(f"{name}.density: {density!r} must be greater than 0")
    if body["motion"] != "free" or body["shape"]["type"] == "half_space":
        body["mass"] = 1.0 if body["mass"] is None else body["mass"]
        body["inertia"] = 1.0 if body["inertia"] is None else body["inertia"]
        return
    shape = _shape(body["shape"], name, dimension)
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
        body["inertia"] = 1.0 if dimension == 2 else (1.0, 1.0, 1.0)  # the mass is refused next, with its name


def _content(dimension: int) -> str:
    return "area" if dimension == 2 else "volume"


def _shape(raw: dict[str, Any], owner: str, dimension: int) -> Shape:
    """Return a checked shape, as its mass needs valid sizes."""
    from adapters.scene import SHAPES

    shape: Shape = SHAPES[raw["type"]](**{key: value for key, value in raw.items() if key != "type"})
    shape.validate(owner)
    if isinstance(shape, Box):
        check_length(f"{owner}.shape.half_extents", shape.half_extents, dimension)
    return shape


def _is_right(label: str, check: CheckModel, scene: Scene, wrong: list[str]) -> bool:
    """Whether a check's quantity exists; otherwise the reason is added to ``wrong``."""
    before = len(wrong)
    names = [b.name for b in scene.bodies]
    partner, body, what = parts_of(check.quantity, names)
    for name in (name for name in (body, partner) if name is not None):
        if name not in names:
            wrong.append(f"{label}.quantity: {check.quantity!r} names no body of the scene: {', '.join(names)}")
    known = (*QUANTITIES[scene.dimension], *forces.OTHERS[scene.dimension])
    if what not in known:
        wrong.append(f"{label}.quantity: {what!r} is not one of {', '.join(known)}")
    is_over_time = forces.is_over_time(what)
    if partner is not None and not is_over_time:
        wrong.append(
            f"{label}.quantity: {check.quantity!r}: between two bodies there are only forces, impulses and the like"
        )
    if partner is None and what == "overlap_without_force":
        wrong.append(f"{label}.quantity: {check.quantity!r}: an overlap needs two bodies: BODY/BODY.{what}")
    if check.over is not None and not is_over_time:
        wrong.append(f"{label}.over: only for forces, impulses and the like")
    elif check.over is not None and check.at is not None and not what.startswith("contact_"):
        wrong.append(f"{label}.over: at an instant there is one number, not a mean, least or greatest")
    if check.at is not None and check.at > scene.duration:
        wrong.append(f"{label}.at: {check.at!r} s is after the end, {scene.duration!r} s")
    return len(wrong) == before
