"""Cleans MJCF and URDF models: removes elements without effect on motion before MuJoCo compiles them.

Unsupported elements are refused with element and line, or left out on request; references to outside the text, and
models with too many bodies, are always refused.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

from adapters.model.markup import MOST_MADE, Element, named
from adapters.plain import NAME, is_visible, one_line
from adapters.scene import SceneError

#: Elements that stay.
KEPT = frozenset(
    ("mujoco", "compiler", "option", "flag", "default", "worldbody", "body", "geom", "inertial", "freejoint", "joint",
     "frame", "replicate", "contact", "pair", "keyframe", "key", "asset", "statistic")
)  # fmt: skip
#: Elements that only draw, measure or reserve memory, without effect on motion.
SILENT = frozenset(["visual", "custom", "sensor", "size", "texture", "material", "site", "camera", "light", "user"])
#: Elements that refer to outside the text.
FOREIGN = {
    "include": "other files are not read",
    "attach": "other models are not read",
    "model": "other models are not read",
    "extension": "plugins are not loaded",
    "plugin": "plugins are not loaded",
}
#: Unsupported elements, with reasons.
NO_PLACE = {
    "tendon": "a scene has no tendons",
    "equality": "a scene has no constraints except contact",
    "actuator": "a scene has no motors",
    "exclude": "in a scene all bodies can collide",
    "deformable": "bodies of a scene are rigid",
    "flexcomp": "bodies of a scene are rigid",
    "composite": "bodies of a scene are rigid and free",
    "skin": "bodies of a scene are rigid",
    "mesh": "a scene has no meshes except convex hulls of vertices",
    "hfield": "a scene has no height fields",
}
#: Attributes with names of other elements, or of the element itself.
NAMES = frozenset(["name", "class", "childclass", "model", "mesh", "geom1", "geom2", "prefix"])
#: Attributes of a mesh that is the convex hull of its vertices, a solid of one density.
HULL = frozenset(["name", "class", "vertex", "scale"])


def cleaned(root: Element, drop: bool) -> list[str]:
    """Remove elements without effect on motion; returns the unsupported ones left out.

    Every body and geom gets a name, by its line where it has none, for messages.

    Raises
    ------
    SceneError
        Naming the first unsupported element, unless ``drop``; in any case one that refers to outside the text or makes
        too many bodies.
    """
    dropped: list[str] = []
    _clean(root, drop, dropped)
    made = _made(root)
    if made > MOST_MADE:
        raise SceneError(f"model: {made:.4g} bodies and geoms are more than the {MOST_MADE} that are read")
    for top in root.children:
        if top.tag == "worldbody":
            named(top, ("body", "geom"))
    return dropped


def rid_of(
    root: Element, drop: bool, kept: Collection[str], silent: Collection[str], no_place: Mapping[str, str]
) -> list[str]:
    """The same for a model in another language than MJCF; returns the unsupported elements left out.

    Raises
    ------
    SceneError
        Naming the first unsupported element, unless ``drop``; or one with an invalid name.
    """
    dropped: list[str] = []
    left = [root]
    while left:
        parent = left.pop()
        children = []
        for child in parent.children:
            if child.tag in silent:
                continue
            if child.tag not in kept:
                line = f"{child}: {no_place.get(child.tag, 'a scene has no such element')}"
                if not drop:
                    raise SceneError(f"model: {line}")
                dropped.append(line)
                continue
            name = child.attributes.get("name", "")
            if not is_visible(name) or len(name) > NAME - 4:
                raise SceneError(f"model: line {child.line}: {one_line(name, 40)!r} cannot be a name")
            children.append(child)
        parent.children = children
        left += children
    made = sum(element.tag in ("link", "collision") for element in root.walk())
    if made > MOST_MADE:
        raise SceneError(f"model: {made} links and their shapes are more than the {MOST_MADE} that are read")
    return dropped


def _clean(element: Element, drop: bool, dropped: list[str]) -> None:
    kept = []
    for child in element.children:
        if child.tag in FOREIGN:
            raise SceneError(f"model: {child}: {FOREIGN[child.tag]}")
        if child.tag in SILENT:
            continue
        why = NO_PLACE.get(child.tag) if element.tag != "default" else None
        if child.tag == "mesh":
            why = _no_hull(child) or ("" if element.tag == "default" or "vertex" in child.attributes else why)
        if "file" in child.attributes:
            why = "other files are not read"
        elif child.tag not in KEPT and child.tag not in NO_PLACE and element.tag != "default":
            why = "a scene has no such element"
        if why:
            if not drop:
                raise SceneError(f"model: {child}: {why}")
            dropped.append(f"{child}: {why}")
            continue
        name = child.attributes.get("name", "")
        if not is_visible(name) or len(name) > NAME - 4:
            raise SceneError(f"model: line {child.line}: {one_line(name, 40)!r} cannot be a name")
        for attribute in ("material", "rgba", "user", "group"):
            child.attributes.pop(attribute, None)
        for attribute, value in child.attributes.items():
            if attribute not in NAMES and "nan" in value.lower().split():  # to MuJoCo: not given
                raise SceneError(f"model: {child}: {attribute} is not a number: {one_line(value, 40)}")
        if element.tag == "default" and child.tag not in ("geom", "default", "pair", "joint", "mesh"):
            continue
        _clean(child, drop, dropped)
        kept.append(child)
    element.children = kept


def _no_hull(mesh: Element) -> str | None:
    """Attributes of a mesh, or of mesh defaults, that a hull of vertices does not have."""
    other = sorted(set(mesh.attributes) - HULL - {"file"})
    return f"{other[0]}: {NO_PLACE['mesh']}" if other else None


def _made(element: Element) -> float:
    """Number of bodies and geoms that the compiler would make of an element."""
    inside = sum(_made(child) for child in element.children)
    if element.tag == "replicate":
        try:
            count = float(element.attributes.get("count", "1"))
        except ValueError:
            raise SceneError(f"model: {element}: count is not a number") from None
        return inside * max(1.0, count)
    return inside + (element.tag in ("body", "geom"))
