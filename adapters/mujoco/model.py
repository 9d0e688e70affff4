"""MJCF models of free bodies and fixed geoms of primitive shapes, as scenes.

    text -> markup.py (nothing from outside, nothing that only draws) -> MuJoCo's own compiler -> Scene + settings

MuJoCo's compiler resolves frames, defaults, replication, densities and inertias. The compiled model must fit a scene:
bodies with one shape about their centre of mass, free or fixed, which can all collide. Contact softness, solver options
and step become settings of the profile that runs the model as MuJoCo would; other engines run rigid bodies with the
model's sliding friction, without rebound, since MJCF states none.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from adapters.engine import Setting
from adapters.model import ALIGNED, ALONG, DURATION, ROUNDING, Model, pairs_of, unique, unit
from adapters.model.markup import Element, parsed, text_of
from adapters.mujoco.combination import Contact, contact_of
from adapters.mujoco.markup import cleaned
from adapters.mujoco.options import option_settings
from adapters.mujoco.refusal import Refused
from adapters.plain import one_line
from adapters.scene import Body, Box, Capsule, Cylinder, HalfSpace, Hull, Scene, SceneError, Shape, Sphere
from adapters.scene.shapes import MOST_VERTICES


def read(text: str, drop: bool) -> Model:
    """The model in ``text``; see `adapters.model.Reader`.

    Raises
    ------
    SceneError
        Naming the unsupported element, or with the compiler's error.
    """
    root = parsed(text, "mujoco", "a model of MJCF begins with <mujoco>")
    dropped = cleaned(root, drop)
    return read_tree(root, drop, dropped, ("body", "geom", "joint", "pair"), root.without, [])


def read_tree(
    root: Element,
    drop: bool,
    dropped: list[str],
    tags: Collection[str],
    without: Callable[[Element], bool],
    notes: list[str],
) -> Model:
    """The model below ``root``, in a language that MuJoCo compiles.

    Parameters
    ----------
    dropped, notes
        Elements left out so far, and notes for readers of results.
    tags
        Elements that the compiled model has by name.
    without
        Removes one of them, with dependent ones; returns whether it was there.

    Raises
    ------
    SceneError
        As `read`.
    """
    lines = {e.attributes["name"]: e for e in root.walk() if e.tag in tags and "name" in e.attributes}
    while True:
        if drop:
            _without_what_hangs(root, dropped)
        try:
            return _Reading(root, drop, dropped, lines, notes).model()
        except Refused as refused:
            element = lines.get(refused.name)
            line = f"{element or _shown(root, refused)}: {refused.why}"
            if not drop or refused.fatal or element is None or not without(element):
                raise SceneError(f"model: {line}") from None
            dropped.append(line)
            for keyframe in [e for e in root.children if e.tag == "keyframe"]:
                root.without(keyframe)
                dropped.append(f"{keyframe}: its states are those of all bodies")


def _without_what_hangs(root: Element, dropped: list[str]) -> None:
    """Leave out elements that depend on removed ones: shapes without their mesh, bodies without any mass."""
    meshes = {e.attributes.get("name") for e in root.walk() if e.tag == "mesh"}
    for shape in [e for e in root.walk() if _is_shapeless(e, meshes)]:
        root.without(shape)
        dropped.append(f"{shape}: its shape was left out")
    for body in [e for e in root.walk() if e.tag == "body" and _is_hollow(e)]:
        root.without(body)
        dropped.append(f"{body}: no part of it with a mass remains")


def _is_shapeless(element: Element, meshes: Collection[str | None]) -> bool:
    if element.tag == "collision":
        return not any(child.children for child in element.children if child.tag == "geometry")
    mesh = element.attributes.get("mesh")
    return element.tag == "geom" and ("hfield" in element.attributes or (mesh is not None and mesh not in meshes))


def _is_hollow(body: Element) -> bool:
    """Whether a body can move but has no mass, itself or by a geom or child body."""
    moves = any(child.tag in ("freejoint", "joint") for child in body.children)
    heavy = any(child.tag in ("inertial", "body", "replicate", "frame") for child in body.children)
    given = [
        {child.attributes.get(name, "1") for name in ("mass", "density")}
        for child in body.children
        if child.tag == "geom"
    ]
    return moves and not heavy and all({"0", "0.0", "0."} & told for told in given)


def _shown(root: Element, refused: Refused) -> str:
    """Name of a refused element that is not in the text: an option, or one made by the compiler."""
    where = next((str(child) for child in root.children if child.tag == refused.kind.partition("/")[0]), refused.kind)
    return f"{where}: {one_line(refused.name, 60)}"


def filled_in(root: Element) -> Iterator[str]:
    """MuJoCo's defaults for values that no geom or geom default states: friction, and density of bodies."""
    defaults = [e for top in root.children if top.tag == "default" for e in top.walk() if e.tag == "geom"]
    said = {name for each in defaults for name in each.attributes}
    owners = [(e, [g for g in e.children if g.tag == "geom"]) for e in root.walk() if e.tag in ("worldbody", "body")]
    rough = [g for _, geoms in owners for g in geoms if "friction" not in g.attributes]
    if rough and "friction" not in said:
        yield f"friction 1 of {_count(rough)} none, MuJoCo's default; a pair has the larger of two"
    heavy = [
        g for owner, geoms in owners for g in geoms
        if owner.tag == "body" and not any(e.tag == "inertial" for e in owner.children)
        and not {"mass", "density"} & set(g.attributes)
    ]  # fmt: skip
    if heavy and not {"mass", "density"} & said:
        yield f"density 1000 kg/m^3 of {_count(heavy)} neither mass nor density, MuJoCo's default"


def _count(geoms: Sequence[Element]) -> str:
    return "1 geom that states" if len(geoms) == 1 else f"{len(geoms)} geoms that state"


class _Reading:
    """One attempt to read a model, which succeeds or names the obstacle."""

    def __init__(
        self, root: Element, drop: bool, dropped: list[str], lines: Mapping[str, Element], notes: list[str]
    ) -> None:
        import mujoco

        self.mujoco, self.drop, self.dropped, self.lines = mujoco, drop, dropped, lines
        self.root = root
        try:
            self.compiled = mujoco.MjModel.from_xml_string(text_of(root))
        except ValueError as error:
            raise SceneError(f"model: MuJoCo does not compile it: {one_line(' '.join(str(error).split()))}") from None
        self.notes = list(notes)
        self.data = mujoco.MjData(self.compiled)
        if self.compiled.nkey:
            mujoco.mj_resetDataKeyframe(self.compiled, self.data, 0)
            name = self.compiled.key(0).name
            self.notes.append(f"starts from its first keyframe{f' {one_line(name, 40)!r}' if name else ''}")
        mujoco.mj_forward(self.compiled, self.data)

    def model(self) -> Model:
        """The model as a scene.

        Raises
        ------
        Refused
            Naming an unsupported element.
        """
        m = self.compiled
        settings = option_settings(self.mujoco, m)
        self._joints()
        shaped = list(self._shaped())
        bodies = tuple(self._body(g, names) for g, names in zip(shaped, self._names(shaped), strict=True))
        if not any(body.motion == "free" for body in bodies):
            raise SceneError("model: has no free body, so nothing can move")
        contacts = self._contacts(shaped, bodies)
        gravity = tuple(float(g) + 0.0 for g in m.opt.gravity)
        if m.opt.disableflags & int(self.mujoco.mjtDisableBit.mjDSBL_GRAVITY):
            gravity = (0.0, 0.0, 0.0)
        beside = [name for g, name in zip(shaped, self._names(shaped), strict=True) if self._turns_beside_centre(g)]
        if beside:
            which = one_line(", ".join(beside), 120)
            self.notes.append(
                f"{which}: MuJoCo moves a body's origin, which is not its centre of mass, and profile model moves "
                "the centre; for a rotating body a step differs by |w|^2 dt^2/2 times the distance between them"
            )
        pairs = pairs_of({ij: contact.friction for ij, contact in contacts.items()}, bodies)
        self.notes += filled_in(self.root)
        self.notes.append(
            "restitution 0 in all engines but MuJoCo: the model states none, its contacts rebound by solref"
        )
        name = self.root.attributes.get("model") or self.root.attributes.get("name") or "model"
        scene = Scene(one_line(name, 60), 1, 3, bodies, pairs, gravity, DURATION)
        settings += self._softness(contacts)
        return Model(scene, tuple(self.notes), tuple(self.dropped), tuple(settings), float(m.opt.timestep))

    # ---- bodies ----

    def _name(self, kind: str, index: int) -> str:
        return str(getattr(self.compiled, kind)(index).name)

    def _joints(self) -> None:
        """All joints are free ones, without springs, dampers or armature."""
        m, free = self.compiled, int(self.mujoco.mjtJoint.mjJNT_FREE)
        for j in range(m.njnt):
            body = self._name("body", int(m.jnt_bodyid[j]))
            if int(m.jnt_type[j]) != free:
                kind = self.mujoco.mjtJoint(int(m.jnt_type[j])).name.removeprefix("mjJNT_").lower()
                raise Refused("body", body, f"a {kind} joint holds it; bodies of a scene are free or fixed")
            dofs = slice(int(m.jnt_dofadr[j]), int(m.jnt_dofadr[j]) + 6)
            for what in ("dof_damping", "dof_armature", "dof_frictionloss"):
                if np.any(getattr(m, what)[dofs]):
                    raise Refused(
                        "body", body, f"its joint has {what.removeprefix('dof_')}; a scene's bodies have none"
                    )
            if np.any(m.jnt_stiffness[j]):
                raise Refused("body", body, "its joint has stiffness; a scene's bodies have none")

    def _shaped(self) -> Iterator[int]:
        """Colliding geoms, in the order of the model; each free body has one."""
        m = self.compiled
        paired = {int(g) for k in range(m.npair) for g in (m.pair_geom1[k], m.pair_geom2[k])}
        owners: Counter[int] = Counter()
        for g in range(m.ngeom):
            if not (m.geom_contype[g] or m.geom_conaffinity[g] or g in paired):
                continue  # it is drawn only
            weld = int(m.body_weldid[m.geom_bodyid[g]])
            owners[weld] += weld != 0
            if owners[weld] > 1:
                raise Refused(
                    "body", self._name("body", weld), "has several geoms that collide; a scene's body has one"
                )
            yield g
        for body in range(1, m.nbody):
            if m.body_weldid[body] == body and not owners[body]:
                raise Refused("body", self._name("body", body), "has no geom that collides")
            if m.body_mocapid[body] >= 0:
                raise Refused(
                    "body", self._name("body", body), "mocap: nothing moves the bodies of a scene from outside"
                )
            if m.body_weldid[body] not in (0, body) and m.body_mass[body] > 0.0:
                holder = self._name("body", int(m.body_weldid[body]))
                raise Refused("body", holder, "a body with a mass is fixed to it; a scene's body has one mass")
            if m.body_gravcomp[body]:
                raise Refused("body", self._name("body", body), "gravcomp: in a scene gravity acts on all bodies alike")

    def _names(self, shaped: list[int]) -> list[str]:
        """Names of bodies: of the body if it is free, of the geom if it is fixed; repeated ones are numbered."""
        m = self.compiled
        found = []
        for g in shaped:
            weld = int(m.body_weldid[m.geom_bodyid[g]])
            found.append(self._name("body", weld) if weld else self._name("geom", g))
        return unique(found)

    def _body(self, g: int, name: str) -> Body:
        m, d = self.compiled, self.data
        shape = self._shape(g)
        turn = np.array(d.geom_xmat[g]).reshape(3, 3)
        if isinstance(shape, Capsule | Cylinder):
            turn = turn @ ALONG
        place = tuple(float(x) + 0.0 for x in d.geom_xpos[g])
        weld = int(m.body_weldid[m.geom_bodyid[g]])
        if isinstance(shape, HalfSpace):
            if weld:
                raise Refused("geom", self._name("geom", g), "a plane cannot move")
            normal = unit(turn[:, 2])
            return Body(name, HalfSpace(normal, float(np.dot(normal, d.geom_xpos[g])) + 0.0), motion="fixed")
        rod = isinstance(shape, Capsule | Cylinder)
        if not weld:
            turn = _in_plane(turn) if rod else turn
            return Body(name, shape, pose=(*place, *_quaternion(self.mujoco, turn)), motion="fixed")
        size = shape.smallest_size
        centre = np.array(d.xipos[weld])
        if np.abs(centre - d.geom_xpos[g]).max() > ALIGNED * size:
            raise Refused(
                "body",
                self._name("body", weld),
                "its centre of mass is not its geom's; a scene's body has both in one place",
            )
        principal = np.array(d.ximat[weld]).reshape(3, 3)
        moments = np.array(m.body_inertia[weld])
        if isinstance(shape, Sphere):
            turn = principal  # a ball has no axes but those of its inertia
        else:
            own = turn.T @ principal @ np.diag(moments) @ principal.T @ turn
            if np.abs(own - np.diag(np.diag(own))).max() > ALIGNED * moments.max():
                raise Refused(
                    "body",
                    self._name("body", weld),
                    "its principal axes are not its geom's; a scene's body has both in one direction",
                )
            moments = np.diag(own)
            if rod and abs(moments[1] - moments[2]) <= ALIGNED * moments.max():
                turn = _in_plane(turn)
        velocity = np.zeros(6)
        self.mujoco.mj_objectVelocity(m, d, int(self.mujoco.mjtObj.mjOBJ_BODY), weld, velocity, 0)
        return Body(
            name,
            shape,
            float(m.body_mass[weld]),
            (float(moments[0]), float(moments[1]), float(moments[2])),
            (*(float(x) + 0.0 for x in centre), *_quaternion(self.mujoco, turn)),
            tuple(float(x) + 0.0 for x in (*velocity[3:], *velocity[:3])),
        )

    def _turns_beside_centre(self, g: int) -> bool:
        """Whether a geom's body is free, and its centre of mass is not the origin of its joint."""
        weld = int(self.compiled.body_weldid[self.compiled.geom_bodyid[g]])
        apart = np.abs(self.data.xipos[weld] - self.data.xpos[weld]).max()
        return bool(weld) and float(apart) > ALIGNED * self._shape(g).smallest_size

    def _shape(self, g: int) -> Shape:
        kinds, size = self.mujoco.mjtGeom, self.compiled.geom_size[g]
        kind = kinds(int(self.compiled.geom_type[g]))
        if kind == kinds.mjGEOM_PLANE:
            return HalfSpace((0.0, 0.0, 1.0))
        if kind == kinds.mjGEOM_SPHERE:
            return Sphere(float(size[0]))
        if kind == kinds.mjGEOM_BOX:
            return Box(tuple(float(s) for s in size))
        if kind in (kinds.mjGEOM_CAPSULE, kinds.mjGEOM_CYLINDER):
            return (Capsule if kind == kinds.mjGEOM_CAPSULE else Cylinder)(float(size[1]), float(size[0]))
        if kind == kinds.mjGEOM_MESH:
            return self._hull(g)
        named = kind.name.removeprefix("mjGEOM_").lower()
        weld = int(self.compiled.body_weldid[self.compiled.geom_bodyid[g]])
        why = f"{'an' if named[0] in 'aeiou' else 'a'} {named}; a scene has spheres, boxes, rods, hulls and planes"
        if weld and self.drop:  # a body needs a shape
            raise Refused("body", self._name("body", weld), f"its geom is {why}")
        raise Refused("geom", self._name("geom", g), why)

    def _hull(self, g: int) -> Shape:
        """Corners of a mesh of vertices only: those of its hull, in the compiler's single precision."""
        m, mesh = self.compiled, int(self.compiled.geom_dataid[g])
        first, count = int(m.mesh_vertadr[mesh]), int(m.mesh_vertnum[mesh])
        graph = m.mesh_graph[int(m.mesh_graphadr[mesh]) :]
        corners = int(graph[0])
        if not 4 <= corners <= MOST_VERTICES:
            raise Refused(
                "geom", self._name("geom", g), f"its hull has {corners} corners, a scene's 4 to {MOST_VERTICES}"
            )
        of = sorted(int(k) for k in graph[2 + corners : 2 + 2 * corners])
        vertices = np.array(m.mesh_vert[first : first + count], float)[of]
        return Hull(tuple((float(x), float(y), float(z)) for x, y, z in vertices))

    # ---- contacts ----

    def _contacts(self, shaped: list[int], bodies: tuple[Body, ...]) -> dict[tuple[int, int], Contact]:
        """Contact parameters of all pairs with a free body."""
        m = self.compiled
        stated = {frozenset((int(m.pair_geom1[k]), int(m.pair_geom2[k]))): k for k in range(m.npair)}
        found = {}
        for i, a in enumerate(shaped):
            for j in range(i + 1, len(shaped)):
                if "free" not in (bodies[i].motion, bodies[j].motion):
                    continue
                b = shaped[j]
                meets = (m.geom_contype[a] & m.geom_conaffinity[b]) or (m.geom_contype[b] & m.geom_conaffinity[a])
                pair = stated.get(frozenset((a, b)))
                if pair is None and not meets:
                    why = (
                        f"contype and conaffinity exclude contact with {bodies[i].name}; in a scene all bodies can "
                        "collide"
                    )
                    raise Refused("geom", self._name("geom", b), why, fatal=True)
                contact = contact_of(m, a, b, pair)
                if contact.refusal and not self.drop:
                    raise Refused("geom", self._name("geom", b), f"with {bodies[i].name}: {contact.refusal}")
                if contact.refusal:
                    self.dropped.append(f"{bodies[i].name}-{bodies[j].name}: {contact.refusal}")
                found[i, j] = contact
        return found

    def _softness(self, contacts: Mapping[tuple[int, int], Contact]) -> list[Setting]:
        """Settings of the pairs: the most common, and the others one by one."""
        if not contacts:  # one body only: any softness will do
            contacts = {(0, 0): contact_of(self.compiled, 0, 0, None)}
        usual = Counter(contact.softness for contact in contacts.values()).most_common(1)[0][0]
        smooth = {contact.condim for contact in contacts.values() if contact.friction == 0.0}
        source = "the model's geoms and pairs"
        settings = [
            Setting(name, value, "of the model", source)
            for name, value in zip(("solref", "solimp", "solreffriction", "margin"), usual, strict=True)
        ]
        settings.append(Setting("smooth_condim", max(smooth, default=3), "of the model's frictionless pairs", source))
        if len(smooth) > 1:
            raise SceneError(
                "model: some pairs without friction have condim 1, others 3; only one of them is supported"
            )
        apart = tuple((i, j, *c.softness) for (i, j), c in contacts.items() if c.softness != usual)
        if apart:
            settings.append(Setting("apart", apart, "pairs of bodies that are softer or harder than the rest", source))
        return settings


def _in_plane(turn: Any) -> Any:
    """Rotation of a body round about its first axis, so that y stays y where that axis has no y component.

    MuJoCo's ``fromto`` flips a rod that points down.
    """
    axis = np.where(np.abs(turn[:, 0]) < ROUNDING, 0.0, turn[:, 0])
    if axis[1] != 0.0:
        return turn
    return np.column_stack([axis, (0.0, 1.0, 0.0), np.cross(axis, (0.0, 1.0, 0.0))])


def _quaternion(mujoco: Any, turn: Any) -> tuple[float, ...]:
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, turn.ravel())
    return unit(quaternion)
