"""Reads experiments from files: fields shared with ``[[family.proof]]``, and ``tuning.toml`` of an engine.

    [candidates]            stock settings that tuning may change, each with the values that it tries
    cone = ["elliptic", "pyramidal"]

    [belongs]               settings that mean nothing without another one, and which; they are switched with it
    kappa_elastic = "solref"

    local = ["solref"]      settings that single pairs or bodies can have, before the first table

    [[instead]]             settings of the world, and what single pairs or bodies can have instead
    of = { contactERP = 0.0 }
    set = { contactStiffness = 0.0, contactDamping = 1e15 }

    [[cured]]               what fails as shipped and passes with a better profile (`adapters.experiment.Cured`)
    shipped = "default"
    better = "tuned"
    scene = "stack"
    cells = [{}, { n = 10 }]

    [effects]               each setting with a case in which it should act (`adapters.experiment.Effect`), or why none
    damping = { set = 0.9, scene = "flight", metric = "fall_speed" }
    jacobian = { untried = "two ways to the same numbers" }

None is written as ``"none"``, several values as a list. Proofs of families are read by
`validation.findings.proofs`.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from adapters.engine import EngineError
from adapters.experiment import Cured, Effect
from adapters.plain import one_line

#: A test of a field's value, and what it must be, in words.
Kind = tuple[Callable[[Any], bool], str]
Fields = Mapping[str, Kind]
#: Word for None, as on the command line.
NONE = "none"


@dataclass(frozen=True)
class Tuning:
    """Tuning of an engine: settings and values to try, settings that need others, fixes to measure."""

    candidates: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)
    belongs: Mapping[str, str] = field(default_factory=dict)
    local: tuple[str, ...] = ()
    instead: tuple[tuple[Mapping[str, Any], Mapping[str, Any]], ...] = ()
    cured: tuple[Cured, ...] = ()
    effects: Mapping[str, Effect] = field(default_factory=dict)


def is_word(value: Any) -> bool:
    """Whether a value is a nonempty text."""
    return isinstance(value, str) and bool(value.strip())


def is_number(value: Any) -> bool:
    """Whether a value is a number; true and false are not."""
    return type(value) in (int, float)


def is_numbers(value: Any) -> bool:
    """Whether a value is a table of numbers."""
    return isinstance(value, dict) and all(map(is_number, value.values()))


def is_list_of(fits: Callable[[Any], bool]) -> Callable[[Any], bool]:
    """A test for lists of values that ``fits`` accepts."""
    return lambda value: isinstance(value, list) and all(map(fits, value))


NAME: Kind = (is_word, "a name")
DIMENSION: Kind = (lambda value: type(value) is int and value in (2, 3), "2 or 3")
TABLE: Kind = (lambda value: isinstance(value, dict), "a table")
_PARTS: Fields = {
    "candidates": TABLE,
    "belongs": TABLE,
    "local": (is_list_of(is_word), "a list of names"),
    "instead": (lambda value: isinstance(value, list), "a list of tables"),
    "cured": (lambda value: isinstance(value, list), "a list of tables"),
    "effects": TABLE,
}
_ANYTHING: Kind = (lambda value: True, "a value")
_EFFECT: Fields = {
    "set": _ANYTHING,
    "scene": NAME,
    "metric": NAME,
    "params": (is_numbers, "a table of numbers"),
    "dimension": DIMENSION,
    "profile": NAME,
    "with": TABLE,
    "beyond": _ANYTHING,
    "in_steps": (lambda value: isinstance(value, bool), "true or false"),
    "unless": TABLE,
    "because": NAME,
    "source": NAME,
    "untried": NAME,
}
_INSTEAD: Fields = {"of": TABLE, "set": TABLE}
_CURED: Fields = {
    "shipped": NAME,
    "better": NAME,
    "scene": NAME,
    "cells": (lambda value: bool(value) and is_list_of(is_numbers)(value), "a list of tables of numbers"),
    "metrics": (is_list_of(is_word), "a list of names"),
    "dimension": DIMENSION,
}


def checked(label: str, table: Any, known: Fields, needed: Collection[str] = ()) -> dict[str, Any]:
    """Return the table if it has all needed fields, no unknown one, and valid values.

    Raises
    ------
    ValueError
        In one line that begins with ``label`` and names the field.
    """
    if not isinstance(table, dict):
        raise ValueError(f"{label} must be a table")
    for name in (*table, *needed):
        if name not in known:
            raise ValueError(f"{label}: {name} is not a field; fields are {', '.join(known)}")
        if name not in table:
            raise ValueError(f"{label}: {name} is missing")
        fits, what = known[name]
        if not fits(table[name]):
            raise ValueError(f"{label}: {name} must be {what}")
    return table


def setting_of(value: Any) -> Any:
    """Value of a setting from a file: lists become tuples, a word None."""
    if isinstance(value, list):
        return tuple(map(setting_of, value))
    return None if value == NONE else value


def settings_of(table: Mapping[str, Any]) -> dict[str, Any]:
    """Settings from a file."""
    return {name: setting_of(value) for name, value in table.items()}


def params_of(table: Mapping[str, Any]) -> dict[str, float]:
    """Parameters of a scene from a file."""
    return {name: float(value) for name, value in table.items()}


def read_tuning(path: Path) -> Tuning:
    """Read ``tuning.toml``.

    Raises
    ------
    EngineError
        If it cannot be read; one line that names file and field.
    """
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
        return _tuning(data)
    except (OSError, ValueError) as error:  # invalid UTF-8 and TOML are ValueErrors as well
        raise EngineError(f"{path}: {one_line(error)}") from None


def _tuning(data: Mapping[str, Any]) -> Tuning:
    checked("tuning", data, _PARTS)
    candidates, belongs = data.get("candidates", {}), data.get("belongs", {})
    checked("candidates", candidates, dict.fromkeys(candidates, (is_list_of(lambda value: True), "a list of values")))
    checked("belongs", belongs, dict.fromkeys(belongs, NAME))
    cures = [
        checked(f"cured {number}", cure, _CURED, ("shipped", "better", "scene", "cells"))
        for number, cure in enumerate(data.get("cured", []), 1)
    ]
    found = [
        Cured(**cure | {"cells": tuple(map(params_of, cure["cells"])), "metrics": tuple(cure.get("metrics", ()))})
        for cure in cures
    ]
    instead = [checked(f"instead {k}", each, _INSTEAD, _INSTEAD) for k, each in enumerate(data.get("instead", []), 1)]
    swaps = tuple((settings_of(each["of"]), settings_of(each["set"])) for each in instead)
    effects = {name: _effect(f"effects.{name}", table) for name, table in data.get("effects", {}).items()}
    return Tuning(settings_of(candidates), belongs, tuple(data.get("local", ())), swaps, tuple(found), effects)


def _effect(label: str, table: Any) -> Effect:
    """A setting's case, or the reason why there is none."""
    needed = ("untried",) if "untried" in checked(label, table, _EFFECT) else ("set", "scene", "metric")
    given: dict[str, Any] = dict(checked(label, table, _EFFECT, needed))
    given |= {name: setting_of(given[name]) for name in ("set", "beyond") if name in given}
    given |= {"params": params_of(given.get("params", {})), "unless": settings_of(given.get("unless", {}))}
    return Effect(needs=settings_of(given.pop("with", {})), **given)
