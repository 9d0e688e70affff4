"""Answers of a solver's process, field by field; a wrong one is named in one line."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, TypeVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, Strict, ValidationError

from adapters.engine import Array, Contacts, EngineError, Precision, Role, Row
from adapters.plain import wrong_fields
from adapters.scene import Scene
from adapters.scene.drives import Ability
from adapters.scene.meeting import common_material

Number = Annotated[float, Strict()]
Whole = Annotated[int, Strict()]
Text = Annotated[str, Strict(), Field(min_length=1)]
#: A vector of which a component, or all, may not be known.
Vector = list[Number | None] | None


class _Answer(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class SchemeAnswer(_Answer):
    """See `adapters.engine.Scheme`."""

    order: Text
    position_offset: Number


class QuirkAnswer(_Answer):
    """See `adapters.engine.Quirk`."""

    what: Text
    what_we_do: Text
    source: Text


class FactsAnswer(_Answer):
    """See `adapters.engine.EngineFacts`."""

    title: Text
    dimensions: Annotated[list[Literal[2, 3]], Field(min_length=1)]
    scheme: SchemeAnswer
    customary_dt: Annotated[Number, Field(gt=0.0)]
    precision: Precision = "double"
    abilities: list[Ability] = []
    roles: dict[str, Role] = {}
    quirks: list[QuirkAnswer] = []
    colour: Annotated[str, Field(pattern=r"^#[0-9a-fA-F]{6}$")] | None = None


class SettingAnswer(_Answer):
    """See `adapters.engine.Setting`."""

    value: Any
    because: Text
    source: str = ""


class DeclaredAnswer(_Answer):
    """See `adapters.engine.Declared`."""

    value: Number
    band: Annotated[Number, Field(ge=0.0)]
    because: Text


class ExpectedAnswer(_Answer):
    """See `adapters.engine.Expected`."""

    check: Text
    because: Text
    source: Text


class Hello(_Answer):
    """Who answers: facts, profiles, and what is known to differ from a scene."""

    protocol: Literal[1]
    name: Text
    version: Text
    facts: FactsAnswer
    profiles: Annotated[dict[str, dict[str, SettingAnswer]], Field(min_length=1)]
    declares: dict[str, dict[str, DeclaredAnswer]] = {}
    expected: list[ExpectedAnswer] = []


class Refuses(_Answer):
    """Why a scene cannot be run, or null."""

    refuses: Text | None


class ContactAnswer(_Answer):
    """A contact of two bodies by index; null is not known."""

    bodies: tuple[Whole, Whole]
    point: Vector
    normal: Vector
    impulse: Vector
    gap: Number | None


class State(_Answer):
    """State of a world; null is not finite, or not known."""

    pose: list[list[Number | None]]
    twist: list[list[Number | None]]
    contacts: list[ContactAnswer]


class Built(State):
    """First state of a world, what changed in the start, and values read from the solver."""

    readback: dict[str, Any]
    changed: list[Text] = []


Kind = TypeVar("Kind", bound=_Answer)


def read(question: str, kind: type[Kind], answer: Mapping[str, Any]) -> Kind:
    """Answer to a question, if its fields are right.

    Raises
    ------
    EngineError
        Naming the fields that are not.
    """
    try:
        return kind.model_validate(answer)
    except ValidationError as error:
        raise EngineError(f"{question}: {wrong_fields(error, 'answer')}") from None


def told(scene: Scene) -> dict[str, Any]:
    """A scene for a process: its physics, with bodies by index and the materials of pairs looked up."""
    data = scene.as_dict()
    one = common_material(scene)
    found = {(i, j): (pair.restitution, pair.friction) for i, j, pair in (() if one else scene.contact_pairs())}
    common = one or next(iter(dict(Counter(found.values()).most_common(1))), (0.0, 0.0))
    return {
        **{name: data[name] for name in ("dimension", "gravity", "bodies", "impact_law")},
        "material": dict(zip(("restitution", "friction"), common, strict=True)),
        "pairs": [
            {"bodies": pair, "restitution": e, "friction": mu} for pair, (e, mu) in found.items() if (e, mu) != common
        ],
    }


def rows(field: str, given: Sequence[Sequence[float | None]], count: int, size: int) -> Array:
    """Numbers of ``count`` bodies, (count, size); NaN for null.

    Raises
    ------
    EngineError
        If there are other numbers of rows or of numbers.
    """
    if len(given) != count:
        raise EngineError(f"{field}: {len(given)} rows, one for each of the {count} bodies is needed")
    return np.array([_row(f"{field}.{k}", row, size) for k, row in enumerate(given)], float)


def _row(field: str, given: Sequence[float | None], size: int) -> Sequence[float | None]:
    if len(given) != size:
        raise EngineError(f"{field}: {len(given)} numbers, {size} are needed")
    return given


def contacts(question: str, given: Sequence[ContactAnswer], scene: Scene) -> Contacts:
    """Contacts as the bench has them; raises `EngineError` for bodies or vectors that the scene does not have."""
    found: list[Row] = []
    most, size = len(scene.bodies) - 1, scene.dimension
    for k, each in enumerate(given):
        field, (i, j) = f"{question}: contacts.{k}", each.bodies
        if i == j or not (min(i, j) >= 0 and max(i, j) <= most):
            raise EngineError(f"{field}.bodies: {i} and {j} must be two different ones of 0 to {most}")
        point, normal, impulse = (
            _row(f"{field}.{name}", [None] * size if vector is None else vector, size)
            for name, vector in (("point", each.point), ("normal", each.normal), ("impulse", each.impulse))
        )
        found.append((i, j, point, normal, impulse, math.nan if each.gap is None else each.gap))
    return Contacts.from_rows(found, size)
