"""URDF models of free links with one primitive shape each, as scenes.

    text -> nothing from outside, nothing that only draws -> MuJoCo's own compiler -> model.py

URDF does not define whether a robot is fixed: as in Bullet and Gazebo its root is free, unless it is called ``world``
or has no mass. It has neither friction, nor softness, nor a floor: MuJoCo's defaults are used, with notes. Joints that
are neither fixed nor floating, and meshes, are not supported.
"""

from __future__ import annotations

from adapters.model import Model
from adapters.model.markup import Element, named, parsed
from adapters.mujoco import model
from adapters.mujoco.markup import rid_of
from adapters.plain import one_line
from adapters.scene import SceneError

#: Elements that stay.
KEPT = frozenset(
    ("robot", "link", "joint", "inertial", "mass", "inertia", "origin", "collision", "geometry", "box", "sphere",
     "cylinder", "capsule", "parent", "child", "axis")
)  # fmt: skip
#: Elements that only draw, or belong to motors, which free and fixed joints do not have.
SILENT = frozenset(["visual", "material", "transmission", "ros2_control", "verbose", "sensor"])
#: Unsupported elements, and those of other programs, with reasons.
NO_PLACE = {
    "mesh": "a scene has no meshes",
    "sdf": "other files are not read",
    "contact": "Bullet's own contact elements are not read",
    "gazebo": "Gazebo's own elements are not read",
    "mujoco": "MuJoCo's own elements are not read",
    "limit": "a scene has no joints except fixed ones",
    "dynamics": "a scene has no joints except fixed ones",
    "mimic": "a scene has no joints except fixed ones",
    "safety_controller": "a scene has no motors",
    "calibration": "a scene has no motors",
}
#: Name of a link that fixes its children.
WORLD = "world"


def read(text: str, drop: bool) -> Model:
    """The robot in ``text``; see `adapters.model.Reader`.

    Raises
    ------
    SceneError
        Naming the element that has no place in a scene, or with the compiler's complaint.
    """
    root = parsed(text, "robot", "a model of URDF begins with <robot>")
    dropped = rid_of(root, drop, KEPT, SILENT, NO_PLACE)
    named(root, ("link", "collision"))
    for joint in [child for child in root.children if child.tag == "joint"]:
        if joint.attributes.get("type") not in ("fixed", "floating"):
            kind = one_line(joint.attributes.get("type", "nameless"), 20)
            line = f"{joint}: a {kind} joint holds a link; bodies of a scene are free or fixed"
            if not drop:
                raise SceneError(f"model: {line}")
            dropped.append(f"{line}; it and all links attached to it")
            _cut(root, joint)
    links = [child for child in root.children if child.tag == "link"]
    joints = [child for child in root.children if child.tag == "joint"]
    notes = ["friction 1 in all pairs: URDF states none, this is MuJoCo's default"]
    notes += _let_go(root, links, joints)
    free = {_link_of(joint, "child") for joint in joints if joint.attributes["type"] == "floating"}
    bare = [link.attributes["name"] for link in links if all(child.tag != "inertial" for child in link.children)]
    if light := free.intersection(bare):
        notes.append(f"density 1000 kg/m^3 of {one_line(', '.join(sorted(light)), 120)}: no inertial, MuJoCo's default")
    own = Element("mujoco", {}, 0, [Element("compiler", {"fusestatic": "false"}, 0)])
    root.children.insert(0, own)

    def without(gone: Element) -> bool:
        """Leave out a link with its joint, or a shape."""
        name = gone.attributes["name"]
        hung = [e for e in root.children if gone.tag == "link" and e.tag == "joint" and _link_of(e, "child") == name]
        for joint in hung:
            _cut(root, joint)
        return bool(hung) or root.without(gone)

    return model.read_tree(root, drop, dropped, ("link", "collision"), without, notes)


def _cut(root: Element, joint: Element) -> None:
    """Leave out a joint with its link and all descendants."""
    if not root.without(joint):
        return
    name = _link_of(joint, "child")
    for link in [e for e in root.children if e.tag == "link" and e.attributes["name"] == name]:
        root.without(link)
    for other in [e for e in root.children if e.tag == "joint" and _link_of(e, "parent") == name]:
        _cut(root, other)


def _let_go(root: Element, links: list[Element], joints: list[Element]) -> list[str]:
    """Attach the root to the world by a floating joint, unless it is the world or has no mass; adds a note."""
    held = {_link_of(joint, "child") for joint in joints}
    roots = [link for link in links if link.attributes["name"] not in held]
    if len(roots) != 1:
        which = f"{roots[1]}: is a second root" if roots else "no link is the root"
        raise SceneError(f"model: {which}; a robot has one root, to which all other links are attached")
    name = roots[0].attributes["name"]
    if name == WORLD:
        return []
    if not any(child.tag == "inertial" for child in roots[0].children):
        roots[0].attributes["name"] = WORLD
        for end in (e for joint in joints for e in joint.children if e.attributes.get("link") == name):
            end.attributes["link"] = WORLD
        return [f"{one_line(name, 60)} is fixed: it has no mass"]
    free = Element("joint", {"name": f"{WORLD}@free", "type": "floating"}, roots[0].line)
    free.children = [Element("parent", {"link": WORLD}, 0), Element("child", {"link": name}, 0)]
    root.children += [Element("link", {"name": WORLD}, 0), free]
    return [
        f"{one_line(name, 60)} is free: URDF does not say whether a robot's root is fixed; a root link 'world' fixes it"
    ]


def _link_of(joint: Element, end: str) -> str:
    """Name of the link at one end of a joint; empty if missing."""
    return next((child.attributes.get("link", "") for child in joint.children if child.tag == end), "")
