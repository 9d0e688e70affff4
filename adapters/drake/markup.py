"""Elements of an SDF model: values are checked, elements without effect on motion are removed.

    <sdf> -- <world> -- gravity, physics (step), frame, joint, <model>
          -- <model> -- static, self_collide, pose, frame, joint, <link>
                         <link> -- pose, inertial, <collision> -- pose, geometry, surface, drake:proximity_properties

Drake's parser, which is libsdformat's, reads ``2,5`` as 2, ignores a second ``<mass>``, gives a sphere without a radius
1 m, and aborts at a radius that is not a number; it ignores gravity and step of a world (measured with 1.51.1). So
everything is checked here first. Elements that a scene cannot represent are refused with element and line, or dropped
on demand.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from adapters.model.markup import MOST_MADE, Element
from adapters.plain import NAME, is_visible, one_line
from adapters.scene import SceneError

#: Gravity [m/s^2] and step [s] of a model without them. [SDFormat 1.12, <gravity>, <max_step_size>]
GRAVITY, STEP = (0.0, 0.0, -9.8), 0.001
#: Format of a number.
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
_VERSION = re.compile(r"\d{1,3}\.\d{1,3}")
#: Tolerance of the triangle inequality of moments of inertia, as a share of the largest: round-off of a flat body.
_FLAT = 1e-9
_TRUE, _FALSE = ("1", "true"), ("0", "false")


@dataclass(frozen=True)
class Place:
    """How often an element may occur in another, and its content.

    Parameters
    ----------
    many
        Whether it may occur there more than once.
    numbers
        Allowed counts of numbers; empty: none.
    positive
        Whether they must be positive.
    flag
        Whether it is boolean.
    """

    many: bool = False
    numbers: tuple[int, ...] = ()
    positive: bool = False
    flag: bool = False


_ONE, _MANY, _FLAG = Place(), Place(many=True), Place(flag=True)
_SCALAR, _SIZE = Place(numbers=(1,)), Place(numbers=(1,), positive=True)
_POSE, _VECTOR = Place(numbers=(6, 7)), Place(numbers=(3,))
#: Moments of inertia and their defaults [kg m^2]. [SDFormat 1.12, <inertia>]
MOMENTS = {"ixx": 1.0, "iyy": 1.0, "izz": 1.0, "ixy": 0.0, "ixz": 0.0, "iyz": 0.0}
#: Elements that are read, by their parent element.
READ: Mapping[str, Mapping[str, Place]] = {
    "sdf": {"world": _MANY, "model": _MANY},
    "world": {"gravity": _VECTOR, "physics": _MANY, "model": _MANY, "frame": _MANY, "joint": _MANY},
    "physics": {"max_step_size": _SIZE, "gravity": _VECTOR},
    "model": {"static": _FLAG, "self_collide": _FLAG, "pose": _POSE, "frame": _MANY, "joint": _MANY, "link": _MANY},
    "frame": {"pose": _POSE},
    "joint": {"parent": _ONE, "child": _ONE, "pose": _POSE},
    "link": {"pose": _POSE, "inertial": _ONE, "collision": _MANY, "self_collide": _FLAG, "velocity_decay": _ONE},
    "velocity_decay": {},
    "inertial": {"pose": _POSE, "mass": _SIZE, "inertia": _ONE},
    "inertia": dict.fromkeys(MOMENTS, _SCALAR),
    "collision": {"pose": _POSE, "geometry": _ONE, "surface": _ONE, "drake:proximity_properties": _ONE},
    "geometry": dict.fromkeys(("plane", "sphere", "box", "cylinder", "capsule"), _ONE),
    "plane": {"normal": _VECTOR, "size": Place(numbers=(2,))},
    "sphere": {"radius": _SIZE},
    "box": {"size": Place(numbers=(3,), positive=True)},
    "cylinder": {"radius": _SIZE, "length": _SIZE},
    "capsule": {"radius": _SIZE, "length": _SIZE},
    "surface": {"friction": _ONE, "bounce": _ONE},
    "friction": {"ode": _ONE},
    "ode": {"mu": _SCALAR, "mu2": _SCALAR},
    "bounce": {},
    "drake:proximity_properties": {
        "drake:rigid_hydroelastic": _ONE,
        "drake:compliant_hydroelastic": _ONE,
        **dict.fromkeys(
            ("drake:mesh_resolution_hint", "drake:hydroelastic_modulus", "drake:point_contact_stiffness"), _SIZE
        ),
        **dict.fromkeys(
            ("drake:hunt_crossley_dissipation", "drake:relaxation_time", "drake:mu_static", "drake:mu_dynamic"),
            _SCALAR,
        ),
    },
}
#: Elements read only here: Drake's parser ignores them with a warning.
UNTOLD = frozenset(("physics", "gravity", "self_collide", "velocity_decay", "bounce"))
#: Required elements: a shape without sizes would have arbitrary ones.
NEEDED = {
    "collision": ("geometry",),
    "plane": ("normal",),
    "sphere": ("radius",),
    "box": ("size",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
    "joint": ("parent", "child"),
}
#: Elements of drawing, sensors and air, or of search and sleep in other engines.
SILENT = frozenset(
    ("visual", "sensor", "light", "gui", "scene", "magnetic_field", "atmosphere", "wind", "audio", "audio_source",
     "audio_sink", "spherical_coordinates", "road", "projector", "particle_emitter", "battery", "laser_retro",
     "max_contacts", "allow_auto_disable", "must_be_base_link", "threshold")
)  # fmt: skip
#: Elements of <physics> for the solvers of other engines.
SOLVERS = frozenset(("ode", "bullet", "simbody", "dart", "max_contacts", "real_time_factor", "real_time_update_rate"))
#: Elements without effect at this value, and why other values are refused.
IDLE: Mapping[tuple[str, str], tuple[tuple[str, ...], str]] = {
    ("link", "gravity"): (_TRUE, "in a scene gravity acts on all bodies alike"),
    ("link", "kinematic"): (_FALSE, "bodies of a scene are free or fixed"),
    ("link", "enable_wind"): (_FALSE, "a scene has neither wind nor water"),
    ("model", "enable_wind"): (_FALSE, "a scene has neither wind nor water"),
    ("velocity_decay", "linear"): (("0",), "a scene's bodies have no damping"),
    ("velocity_decay", "angular"): (("0",), "a scene's bodies have no damping"),
    ("bounce", "restitution_coefficient"): (("0",), "Drake's contacts have no coefficient of restitution"),
    ("ode", "slip1"): (("0",), "a scene has Coulomb friction only"),
    ("ode", "slip2"): (("0",), "a scene has Coulomb friction only"),
    ("ode", "fdir1"): (("0 0 0",), "a scene's friction has no direction"),
}
#: Elements that a scene cannot represent, or that another program reads, and why.
NO_PLACE = {
    "include": "other files are not read",
    "plugin": "plugins are not loaded",
    "mesh": "a scene has no meshes",
    "heightmap": "a scene has no height fields",
    "image": "a scene has no height fields",
    "empty": "a scene has no bodies without a shape",
    "actor": "a scene has no scripted bodies",
    "state": "a saved state is not read",
    "population": "models are not replicated",
    "gripper": "a scene has no joints except fixed ones",
    "fluid_added_mass": "a scene has neither wind nor water",
    "torsional": "a scene has no torsional friction",
    "contact": "contact elements of Gazebo's engines are not read",
    "soft_contact": "bodies of a scene are rigid",
    "bullet": "Bullet's own elements are not read",
    "density": "masses are not computed from densities",
}
#: Why another element is refused.
NOWHERE = "a scene has no such element"
#: Supported attributes.
ATTRIBUTES = frozenset(
    ("name", "version", "relative_to", "degrees", "rotation_format", "canonical_link", "placement_frame", "attached_to",
     "type", "default")
)  # fmt: skip
#: Friction values that must be equal, and their meaning.
FRICTION = {
    "ode": ("mu", "mu2", "in two directions"),
    "drake:proximity_properties": ("drake:mu_static", "drake:mu_dynamic", "at rest and in motion"),
}
#: Friction of a shape without a stated value. [SDFormat 1.12, <mu>]
FRICTIONAL = 1.0


@dataclass
class Stated:
    """Statements of a model beside its bodies.

    Parameters
    ----------
    gravity
        [m/s^2]
    step
        [s]
    dropped, notes
        Dropped elements, and notes for a reader of results.
    """

    gravity: tuple[float, ...] = GRAVITY
    step: float = STEP
    dropped: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def child(element: Element, *tags: str) -> Element | None:
    """The first child with the first tag, its first child with the next one, and so on."""
    found: Element | None = element
    for tag in tags:
        found = next((e for e in found.children if e.tag == tag), None) if found else None
    return found


def is_true(element: Element | None) -> bool:
    """Value of a boolean element; a missing one is false."""
    return element is not None and element.text.strip().lower() in _TRUE


def told(element: Element) -> Element:
    """The model for Drake's parser: without the elements that are read here."""
    children = [told(e) for e in element.children if e.tag not in UNTOLD]
    return Element(element.tag, element.attributes, element.line, children, element.text)


def cleaned(root: Element, drop: bool) -> Stated:
    """Remove elements without effect on motion; returns the statements beside the bodies.

    Raises
    ------
    SceneError
        Naming the first element that a scene cannot represent, unless ``drop``; or that has an impossible value.
    """
    made = sum(element.tag in ("link", "collision") for element in root.walk())
    if made > MOST_MADE:
        raise SceneError(f"model: {made} links and their shapes are more than the {MOST_MADE} that are read")
    if not _VERSION.fullmatch(root.attributes.get("version", "")):
        raise SceneError(f"model: {root}: states no version of SDF, as in <sdf version='1.9'>")
    stated = Stated()
    _clean(root, drop, stated)
    for holder in [element for element in root.walk() if element.tag in ("world", "model")]:
        for joint in [e for e in holder.children if _holds(e)]:
            cut(holder, joint)
    _state(root, stated)
    return stated


def cut(holder: Element, joint: Element) -> None:
    """Drop a joint of a model or a world, its child link, and all links attached to that one."""
    left = [joint]
    while left:
        gone = left.pop()
        if not any(e is gone for e in holder.children):
            continue
        holder.children = [e for e in holder.children if e is not gone]
        name = _said(gone, "child")
        model, _, link = name.rpartition("::")
        owner = next((e for e in holder.children if e.tag == "model" and e.attributes.get("name") == model), holder)
        owner.children = [e for e in owner.children if e.tag != "link" or e.attributes.get("name") != link]
        left += [e for e in holder.children if e.tag == "joint" and _said(e, "parent") == name]


def _holds(element: Element) -> bool:
    """Whether it is a joint with some degrees of freedom, but not six."""
    return element.tag == "joint" and element.attributes.get("type") != "fixed"


def _said(element: Element, tag: str) -> str:
    found = child(element, tag)
    return found.text.strip() if found else ""


def _refuse(line: str, drop: bool, stated: Stated, rest: str = "") -> None:
    if not drop:
        raise SceneError(f"model: {line}")
    stated.dropped.append(line + rest)


def _clean(element: Element, drop: bool, stated: Stated) -> None:
    places = READ.get(element.tag, {})
    kept: list[Element] = []
    for e in element.children:
        if e.tag in SILENT or (element.tag == "physics" and e.tag in SOLVERS):
            continue
        if (element.tag, e.tag) in IDLE:
            says, why = IDLE[element.tag, e.tag]
            if _plain(e) not in says:
                _refuse(f"{e}: {why}", drop, stated)
            continue
        if e.tag not in places:
            nested = element.tag == e.tag == "model"
            why = "models inside models are not read" if nested else NO_PLACE.get(e.tag, NOWHERE)
            _refuse(f"{e}: {why}", drop, stated)
            continue
        if _holds(e):
            kind = one_line(e.attributes.get("type", "nameless"), 20)
            line = f"{e}: a {kind} joint holds a link; bodies of a scene are free or fixed"
            _refuse(line, drop, stated, "; it and all links attached to it")
            kept.append(e)
            continue
        unread = _unread_shape(e)
        if unread is not None:
            why = NO_PLACE.get(unread.tag, "a scene has spheres, boxes, cylinders, capsules and planes")
            _refuse(f"{unread}: {why}", drop, stated, "; the shape")
            continue
        if not places[e.tag].many and any(other.tag == e.tag for other in kept):
            raise SceneError(f"model: {e}: is given twice in {element}")
        _check(e, places[e.tag])
        _clean(e, drop, stated)
        kept.append(e)
    element.children = kept
    if element.tag in FRICTION:
        _make_alike(element, drop, stated)
    if element.tag == "geometry" and len(kept) != 1:
        raise SceneError(f"model: {kept[1]}: is a second shape" if kept else f"model: {element}: has no shape")
    normal = child(element, "normal") if element.tag == "plane" else None
    if normal and not any(float(word) for word in normal.text.split()):
        raise SceneError(f"model: {normal}: is not a direction")
    if element.tag == "inertia":
        _check_inertia(element)
    for needed in NEEDED.get(element.tag, ()):
        if child(element, needed) is None:
            raise SceneError(f"model: {element}: has no <{needed}>")


def _plain(element: Element) -> str:
    """Content of an element, with numbers in their shortest form."""
    words = element.text.lower().split()
    return " ".join(f"{float(word) + 0.0:g}" if _NUMBER.fullmatch(word) else word for word in words)


def _unread_shape(element: Element) -> Element | None:
    """The shape of a collision that a scene cannot represent."""
    geometry = child(element, "geometry") if element.tag == "collision" else None
    return next((e for e in geometry.children if e.tag not in READ["geometry"]), None) if geometry else None


def _check(element: Element, place: Place) -> None:
    """Raise `SceneError` unless an element has a printable name, supported attributes, and its numbers."""
    name = element.attributes.get("name", "")
    if not is_visible(name) or len(name) > NAME - 4:
        raise SceneError(f"model: line {element.line}: {one_line(name, 40)!r} cannot be a name")
    for attribute in element.attributes:
        if attribute not in ATTRIBUTES and not attribute.startswith("xmlns"):
            raise SceneError(f"model: {element}: its attribute {one_line(attribute, 40)!r} is not read")
    words = element.text.split()
    if place.flag and _plain(element) not in _TRUE + _FALSE:
        raise SceneError(f"model: {element}: {one_line(element.text, 40)!r} is neither true nor false")
    if not place.numbers:
        return
    for word in words:
        if not _NUMBER.fullmatch(word) or not math.isfinite(float(word)):
            raise SceneError(f"model: {element}: {one_line(word, 40)!r} is not a finite number")
        if place.positive and not float(word) > 0.0:
            raise SceneError(f"model: {element}: {one_line(word, 40)!r} must be greater than 0")
    if len(words) not in place.numbers:
        counts = " or ".join(map(str, place.numbers))
        raise SceneError(f"model: {element}: has {len(words)} numbers, needs {counts}")


def _check_inertia(inertia: Element) -> None:
    """Raise `SceneError` unless a body can have these moments: none exceeds the sum of the other two."""
    xx, yy, zz, xy, xz, yz = (
        float(found.text) if (found := child(inertia, tag)) else default for tag, default in MOMENTS.items()
    )
    first, second, third = np.linalg.eigvalsh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    if not first > 0.0 or not third - second - first <= _FLAT * third:
        said = f"{first:.4g}, {second:.4g} and {third:.4g} kg m^2"
        raise SceneError(f"model: {inertia}: a body cannot have principal moments of {said}")


def _make_alike(element: Element, drop: bool, stated: Stated) -> None:
    """Friction is one number: a shape's two values are both stated and equal."""
    first, second, how = FRICTION[element.tag]
    found = [child(element, tag) for tag in (first, second)]
    if element.tag != "ode" and None in found:
        return  # Drake uses the one for both
    a, b = (float(e.text) if e else FRICTIONAL for e in found)
    # Drake's solvers use kinetic friction; the two directions are equivalent.
    kept, gone = (a, second) if element.tag == "ode" else (b, first)
    if a != b:
        line = f"{element}: friction {a:g} and {b:g} {how}; a scene has one number"
        _refuse(line, drop, stated, f"; <{gone}>")
    element.children = [e for e in element.children if e.tag not in (first, second)]
    element.children += [Element(tag, {}, element.line, [], repr(kept)) for tag in (first, second)]


def _state(root: Element, stated: Stated) -> None:
    """Gravity and step, which Drake's parser ignores."""
    world = child(root, "world")
    physics = [e for e in world.children if e.tag == "physics"] if world else []
    physics.sort(key=lambda e: e.attributes.get("default", "").lower() not in _TRUE)
    # Until SDF 1.5 gravity stood in <physics>.
    places = ([world] if world else []) + physics[:1]
    gravity = next((found for place in places if (found := child(place, "gravity"))), None)
    if gravity is not None:
        stated.gravity = tuple(float(word) + 0.0 for word in gravity.text.split())
    else:
        stated.notes.append(f"gravity {-GRAVITY[2]:g} m/s^2 downwards: the default of SDF, the model states none")
    step = child(physics[0], "max_step_size") if physics else None
    if step is not None:
        stated.step = float(step.text)
