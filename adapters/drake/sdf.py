"""SDF models of free and fixed links with one primitive shape each, as scenes.

    text -> markup.py (checks values, refuses external files, removes drawing) -> Drake's parser -> Scene

Drake's parser is libsdformat's, in strict mode: it resolves frames and poses, and refuses impossible inertias instead
of replacing them. The result must fit into a scene: bodies with one shape about their centre of mass, free or fixed,
which all may touch each other. SDF does not define the friction of a pair from its bodies' values: the harmonic mean,
as in Drake. Drake's own contact properties and the step become settings of the profile that runs the model as Drake
would; other engines run it with rigid bodies without restitution.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from adapters.drake.markup import Stated, child, cleaned, cut, is_true, told
from adapters.drake.profiles import OWN, rule
from adapters.drake.translation import pair_of
from adapters.engine import Setting
from adapters.model import ALIGNED, ALONG, DURATION, ROUNDING, Model, pairs_of, unique, unit
from adapters.model.markup import Element, parsed, text_of
from adapters.plain import one_line
from adapters.scene import Body, Box, Capsule, Cylinder, HalfSpace, Scene, SceneError, Shape, Sphere

#: Line in an error of Drake's parser: its text has the same lines as the model.
_WHERE = re.compile(r"^(?:<[\w-]+>(?:\.sdf)?:(?P<line>\d+): )?(?:error: )?(?:Error: )?")


class _Refused(Exception):
    """Elements that a scene cannot represent.

    Parameters
    ----------
    found
        Each with its parent, and a short reason.
    """

    def __init__(self, *found: tuple[Element, Element, str]) -> None:
        super().__init__(f"{found[0][1]}: {found[0][2]}")
        self.found = found


@dataclass(frozen=True)
class _Part:
    """One collision shape, with its elements."""

    model: Element
    link: Element
    collision: Element
    body: Any
    geometry: Any
    free: bool


def read(text: str, drop: bool) -> Model:
    """The model or world in ``text``; see `adapters.model.Reader`.

    Raises
    ------
    SceneError
        Naming the element that a scene cannot represent, or with the parser's message.
    """
    root = parsed(text, "sdf", "a model of SDF begins with <sdf>")
    stated = cleaned(root, drop)
    if stated.dropped:
        _drop_empty(root)
    while True:
        try:
            return _Reading(root, drop, stated).model()
        except _Refused as refused:
            if not drop:
                raise SceneError(f"model: {refused}") from None
            for holder, element, why in refused.found:
                stated.dropped.append(f"{element}: {why}")
                if element.tag == "joint":
                    cut(holder, element)
                else:
                    holder.children = [e for e in holder.children if e is not element]
            _drop_empty(root)


def _drop_empty(root: Element) -> None:
    """Drop a model without links."""
    for holder in [e for e in root.walk() if e.tag in ("sdf", "world")]:
        holder.children = [e for e in holder.children if e.tag != "model" or child(e, "link")]


class _Reading:
    """One attempt at a model, which either succeeds or raises with all obstacles."""

    def __init__(self, root: Element, drop: bool, stated: Stated) -> None:
        import pydrake.geometry
        import pydrake.multibody.parsing
        import pydrake.multibody.plant
        import pydrake.systems.framework

        # Its stubs have no NumPy array types.
        self.drake: Any = pydrake.geometry
        builder: Any = pydrake.systems.framework.DiagramBuilder()
        plant: Any
        plant, graph = pydrake.multibody.plant.AddMultibodyPlantSceneGraph(builder, stated.step)
        parser: Any = pydrake.multibody.parsing.Parser(plant)
        parser.SetStrictParsing()
        try:
            parser.AddModelsFromString(text_of(told(root)), "sdf")
            plant.Finalize()
        except (RuntimeError, ValueError, SystemExit) as error:  # it raises where its C++ would abort the process
            raise SceneError(f"model: Drake does not read it: {_complaint(error)}") from None
        self.root, self.drop, self.stated, self.plant = root, drop, stated, plant
        self.diagram = builder.Build()
        whole = self.diagram.CreateDefaultContext()
        self.context = plant.GetMyContextFromRoot(whole)
        self.inspector = graph.get_query_output_port().Eval(graph.GetMyContextFromRoot(whole)).inspector()
        self.models = {e.attributes["name"]: e for e in root.walk() if e.tag == "model"}
        self.notes = list(stated.notes)

    def model(self) -> Model:
        """The model as a scene.

        Raises
        ------
        _Refused
            Naming elements that a scene cannot represent.
        """
        self._joints()
        parts = list(self._parts())
        self._links(parts)
        if not any(part.free for part in parts):
            raise SceneError("model: has no free body, so nothing can move")
        names = unique(self._name(part, parts) for part in parts)
        dropped = list(self.stated.dropped) + list(self._apart(parts))
        bodies = tuple(self._bodies(parts, names))
        self._defaults(parts, names)
        scene = Scene(self._title(), 1, 3, bodies, self._pairs(parts, bodies), self.stated.gravity, DURATION)
        self.notes.append(
            "restitution 0 in all engines: Drake's contacts have none, and a model that states it is refused"
        )
        return Model(scene, tuple(self.notes), tuple(dropped), tuple(self._settings(parts)), self.stated.step)

    def _title(self) -> str:
        named = next(e for e in self.root.children if e.tag in ("world", "model"))
        return one_line(named.attributes.get("name", ""), 60) or "model"

    # ---- elements ----

    def _joints(self) -> None:
        """A fixed joint holds its link to the world; two rigidly joined moving links are no body of a scene."""
        plant = self.plant
        held = [
            (joint.name(), plant.GetModelInstanceName(joint.model_instance()))
            for joint in map(plant.get_joint, plant.GetJointIndices())
            if joint.type_name() == "weld" and not plant.IsAnchored(joint.child_body())
        ]
        found = []
        for holder in [e for e in self.root.walk() if e.tag in ("world", "model")]:
            for e in [e for e in holder.children if e.tag == "joint"]:
                name = e.attributes.get("name")
                if (name, holder.attributes["name"]) in held or (holder.tag == "world" and name in dict(held)):
                    found.append((holder, e, "connects two moving links; a scene's body is one link"))
        if found:
            raise _Refused(*found)
        if held:
            raise SceneError(f"model: {one_line(held[0][0], 60)}: connects two moving links")

    def _parts(self) -> Iterator[_Part]:
        """Collision shapes, in the order of the text."""
        plant, inspector = self.plant, self.inspector
        found = {}
        for geometry in inspector.GetAllGeometryIds(self.drake.Role.kProximity):
            body = plant.GetBodyFromFrameId(inspector.GetFrameId(geometry))
            model = plant.GetModelInstanceName(body.model_instance())
            name = inspector.GetName(geometry).removeprefix(f"{model}::")
            found[model, body.name(), name] = (body, geometry)
        for model in self.models.values():
            for link in (e for e in model.children if e.tag == "link"):
                for shape in (e for e in link.children if e.tag == "collision"):
                    path = (model.attributes["name"], link.attributes["name"], shape.attributes["name"])
                    if path not in found:
                        raise SceneError(f"model: {shape}: is not a shape of Drake")
                    body, geometry = found[path]
                    yield _Part(model, link, shape, body, geometry, not plant.IsAnchored(body))

    def _links(self, parts: list[_Part]) -> None:
        """Each free link has one shape."""
        count = Counter(id(part.link) for part in parts)
        found = []
        for name, model in self.models.items():
            instance = self.plant.GetModelInstanceByName(name)
            for link in (e for e in model.children if e.tag == "link"):
                own = count[id(link)]
                if own == 1 or self.plant.IsAnchored(self.plant.GetBodyByName(link.attributes["name"], instance)):
                    continue
                why = "has several shapes that collide; a scene's body has one" if own else "has no shape that collides"
                found.append((model, link, why))
        if found:
            raise _Refused(*found)

    def _name(self, part: _Part, parts: list[_Part]) -> str:
        """The shortest unique one of model, model::link and model::link::collision."""
        words = [e.attributes["name"] for e in (part.model, part.link, part.collision)]
        for count, element in ((1, part.model), (2, part.link)):
            if sum(element is other.model or element is other.link for other in parts) == 1:
                return "::".join(words[:count])
        return "::".join(words)

    def _apart(self, parts: list[_Part]) -> Iterator[str]:
        """Links of one model touch each other only if the model says so."""
        for model in self.models.values():
            own = [part for part in parts if part.model is model]
            shy = {part.link.attributes["name"]: part.free for part in own if not _touches(part.link)}
            if _touches(model) or len(shy) < 2 or not any(shy.values()):
                continue
            line = (
                f"{model}: its links do not collide with each other, as self_collide is not true; in a scene all "
                "bodies can collide"
            )
            if not self.drop:
                raise SceneError(f"model: {line}")
            yield f"{line}; that they do not collide"

    # ---- bodies ----

    def _shape(self, geometry: Any) -> Shape:
        drake, shape = self.drake, self.inspector.GetShape(geometry)
        if isinstance(shape, drake.HalfSpace):
            return HalfSpace((0.0, 0.0, 1.0))
        if isinstance(shape, drake.Sphere):
            return Sphere(float(shape.radius()))
        if isinstance(shape, drake.Box):
            return Box(tuple(0.5 * float(size) for size in shape.size()))
        kind = Cylinder if isinstance(shape, drake.Cylinder) else Capsule
        return kind(0.5 * float(shape.length()), float(shape.radius()))

    def _bodies(self, parts: list[_Part], names: list[str]) -> list[Body]:
        found: list[Body] = []
        refused: list[tuple[Element, Element, str]] = []
        for part, name in zip(parts, names, strict=True):
            try:
                found.append(self._body(part, name))
            except _Refused as one:
                refused += one.found
        if refused:
            raise _Refused(*refused)
        return found

    def _body(self, part: _Part, name: str) -> Body:
        shape = self._shape(part.geometry)
        held = self.plant.EvalBodyPoseInWorld(self.context, part.body)
        own = self.inspector.GetPoseInFrame(part.geometry)
        along = ALONG if isinstance(shape, Cylinder | Capsule) else np.eye(3)
        inside = own.rotation().matrix() @ along
        turn = held.rotation().matrix() @ inside
        place = np.array(held.multiply(own.translation()))
        place = np.where(np.abs(place) < ROUNDING * np.abs(place).max(), 0.0, place)
        if isinstance(shape, HalfSpace):
            if part.free:
                raise _Refused((part.model, part.link, "its shape is a plane, which cannot move"))
            normal = unit(turn[:, 2])
            return Body(name, HalfSpace(normal, float(np.dot(normal, place)) + 0.0), motion="fixed")
        if not part.free:
            return Body(name, shape, pose=(*_numbers(place), *self._quaternion(turn)), motion="fixed")
        inertia = part.body.CalcSpatialInertiaInBodyFrame(self.context)
        centre = np.array(inertia.get_com())
        if np.abs(centre - own.translation()).max() > ALIGNED * shape.smallest_size:
            why = "its centre of mass is not its shape's; a scene's body has both in one place"
            raise _Refused((part.model, part.link, why))
        about = inertia.Shift(centre).CalcRotationalInertia().CopyToFullMatrix3()
        moments = inside.T @ about @ inside
        rest = np.abs(moments - np.diag(np.diag(moments))).max()
        if rest > ALIGNED * np.diag(moments).max():
            if not isinstance(shape, Sphere):
                why = "its principal axes are not its shape's; a scene's body has both in one direction"
                raise _Refused((part.model, part.link, why))
            axes = np.linalg.eigh(about)[1]  # the only axes of a ball are those of its inertia
            axes[:, 2] *= np.linalg.det(axes)
            moments, turn = axes.T @ about @ axes, held.rotation().matrix() @ axes
        first, second, third = _numbers(np.diag(moments))
        pose = (*_numbers(place), *self._quaternion(turn))
        return Body(name, shape, float(inertia.get_mass()), (first, second, third), pose)

    def _quaternion(self, turn: Any) -> tuple[float, ...]:
        import pydrake.math

        return unit(pydrake.math.RotationMatrix(turn).ToQuaternion().wxyz())

    def _defaults(self, parts: list[_Part], names: list[str]) -> None:
        """Note the default values."""
        free = [(part, name) for part, name in zip(parts, names, strict=True) if part.free]
        for what, tags in (("mass 1 kg", ["mass"]), ("moments of inertia 1 kg m^2", ["ixx", "iyy", "izz"])):
            stated = [{e.tag for e in part.link.walk()} for part, _ in free]
            of = [name for (_, name), said in zip(free, stated, strict=True) if not said.issuperset(tags)]
            if of:
                self.notes.append(
                    f"{what} of {one_line(', '.join(of), 120)}: the default of SDF, the model states none"
                )
        if any(
            child(part.collision, "surface", "friction") is None and not _drakes(part, "drake:mu_dynamic")
            for part in parts
        ):
            self.notes.append("friction 1 of shapes that state none: the default of SDF")

    # ---- contacts ----

    def _property(self, part: _Part, group: str, name: str) -> Any:
        held = self.inspector.GetProximityProperties(part.geometry)
        return held.GetProperty(group, name) if held.HasProperty(group, name) else None

    def _friction(self, part: _Part) -> float:
        return float(self._property(part, "material", "coulomb_friction").dynamic_friction())

    def _pairs(self, parts: list[_Part], bodies: tuple[Body, ...]) -> Any:
        own = [self._friction(part) for part in parts]
        found = {}
        for i, a in enumerate(parts):
            for j in range(i + 1, len(parts)):
                if a.free or parts[j].free:
                    found[i, j] = own[i] if own[i] == own[j] else pair_of(own[i], own[j])
        if len(set(own)) > 1:
            self.notes.append(
                "friction of a pair is the harmonic mean of its bodies' values, as in Drake; SDF does not define it"
            )
        return pairs_of(found, bodies)

    def _settings(self, parts: list[_Part]) -> Iterator[Setting]:
        """Drake's defaults with the contact properties of the shapes."""
        for setting in rule("lagged", "as shipped"):
            if setting.name == "boxes":
                yield Setting(
                    "boxes",
                    "point",
                    "as shipped: shapes without a stated surface have one contact point",
                    setting.source,
                )
            else:
                yield setting
        rows = tuple(self._own(part) for part in parts)
        yield Setting(OWN, rows, "of the model's shapes, in the order of the bodies", "the model's collisions")

    def _own(self, part: _Part) -> tuple[Any, ...]:
        """Friction, kind of surface, resolution, modulus, stiffness, dissipation and relaxation of a shape."""
        kinds = [kind for kind in ("rigid", "compliant") if _drakes(part, f"drake:{kind}_hydroelastic")]
        if len(kinds) > 1:
            raise SceneError(f"model: {part.collision}: its surface is both rigid and compliant")
        kind = kinds[0] if kinds else "none"
        if kind == "compliant" and isinstance(self._shape(part.geometry), HalfSpace):
            raise SceneError(f"model: {part.collision}: a compliant plane has a thickness, which is not read")
        numbers = [self._property(part, "hydroelastic", name) for name in ("resolution_hint", "hydroelastic_modulus")]
        names = ("point_contact_stiffness", "hunt_crossley_dissipation", "relaxation_time")
        numbers += [self._property(part, "material", name) for name in names]
        return (self._friction(part), kind, *(float(number) for number in numbers))


def _touches(element: Element) -> bool:
    """Whether a model or a link states that its links touch those of its model."""
    return is_true(child(element, "self_collide"))


def _drakes(part: _Part, *tags: str) -> Element | None:
    return child(part.collision, "drake:proximity_properties", *tags)


def _numbers(values: Any) -> tuple[float, ...]:
    return tuple(float(value) + 0.0 for value in values)


def _complaint(error: BaseException) -> str:
    """The parser's message, with the line in the model instead of its own name for the text."""
    said = one_line(" ".join(str(error).split()), 300)
    where = _WHERE.match(said)
    line = f"line {where['line']}: " if where and where["line"] else ""
    return line + said[where.end() if where else 0 :]
