"""Settings of a user, from the command line, checked by name and kind.

They become part of the profile's name: ``--set cone=elliptic --set impratio=10`` makes
``default+cone=elliptic+impratio=10`` of ``default``.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

from adapters.engine import Engine, EngineError, Setting
from adapters.plain import NAME, one_line
from adapters.settings import Check, like, text_of

#: Number of similar names in the message about an unknown one.
NEAR = 4
#: Words that are values.
NAMED = {"true": True, "false": False, "none": None}
NOTHING: Mapping[str, str] = MappingProxyType({})
#: Placeholder for a value that an engine cannot take.
MISFIT = object()


def read(text: str) -> Any:
    """Value of a setting from text: a number, ``true``, ``none``, a word, or several with commas between.

    Numbers may have spaces between them instead, as fixes print them for model files.
    """
    if "," in text:
        values = tuple(map(read, text.split(",")))
        return tuple(float(v) if isinstance(v, int) and not isinstance(v, bool) else v for v in values)
    if len(parts := text.split()) > 1 and not any(isinstance(read(part), str) for part in parts):
        return read(",".join(parts))
    said = text.strip()
    if said.lower() in NAMED:
        return NAMED[said.lower()]
    for kind in (int, float):
        try:
            return kind(said)
        except ValueError:
            continue
    return said


def suffix_of(settings: Iterable[tuple[str, Any]]) -> str:
    """Suffix of a profile's name for these settings: ``+cone=elliptic+impratio=10``."""
    return "".join(f"+{name}={text_of(value)}" for name, value in settings)


def pair(text: str) -> tuple[str, Any]:
    """Name and value of ``NAME=VALUE``.

    Raises
    ------
    EngineError
        If it is not of that form.
    """
    name, equals, value = text.partition("=")
    if not (name.strip() and equals and value.strip()):
        raise EngineError(f"set: {one_line(text, NAME)!r} is not of the form NAME=VALUE")
    return name.strip(), read(value)


def given(texts: Iterable[str]) -> tuple[tuple[str, Any], ...]:
    """Names and values of several ``NAME=VALUE``, by name.

    Raises
    ------
    EngineError
        If one is not of that form, or given twice.
    """
    found: dict[str, Any] = {}
    for name, value in map(pair, texts):
        if name in found:
            raise EngineError(f"set: {name} is given twice; a profile has one value of it")
        found[name] = value
    return tuple(sorted(found.items()))


def kinds_of(engine: Engine, profile: Iterable[Setting]) -> dict[str, Check]:
    """Checks of each setting, of a profile of ``engine`` and of the engine."""
    return {setting.name: like(setting.value) for setting in profile} | dict(engine.settable())


def own(engine: Engine, asked: Sequence[tuple[str, Any]], profile: Sequence[Setting]) -> tuple[tuple[str, Any], ...]:
    """Settings of a user, sorted by name, in the kinds of ``engine``.

    Parameters
    ----------
    asked
        Names with values from `read`.
    profile
        Settings of the profile, which they replace or extend.

    Raises
    ------
    EngineError
        Naming the first unknown setting, or the first invalid value.
    """
    stock, kinds = {setting.name: setting.value for setting in profile}, kinds_of(engine, profile)
    found: dict[str, Any] = {}
    for name, value in asked:
        if name not in kinds:
            close, where = near(name, kinds, engine.former), f"; crosscheck describe {engine.name} lists all"
            raise EngineError(f"set: {engine.name} has no setting {one_line(name, NAME)!r}{close}{where}")
        if isinstance(value, int) and not isinstance(value, bool) and isinstance(stock.get(name), float):
            value = float(value)  # 10 and 10.0 are the same setting
        # A single word of a list has no comma, a word may look like a number or none, and may be in lower case.
        said = text_of(value)
        tried = (value, (value,), said, said.lower(), said.upper(), said.capitalize())
        fits = next((each for each in tried if not kinds[name](each)), MISFIT)
        if fits is MISFIT:
            raise EngineError(f"set: {name}={one_line(said, NAME)}: must be {kinds[name](value)}")
        found[name] = fits
    try:
        engine.check_settings(stock | found)
    except EngineError as error:
        raise EngineError(f"set: {error}") from None
    return tuple(sorted(found.items()))


def near(name: str, known: Iterable[str], former: Mapping[str, str] = NOTHING) -> str:
    """What takes the place of a ``former`` setting, or similar names; empty if there are none."""
    if name in former:
        return f"; {former[name]}"
    low = {each.lower(): each for each in known}
    parts = [each for each in low if name.lower() in each]
    close = list(dict.fromkeys([*parts, *difflib.get_close_matches(name.lower(), low, n=NEAR)]))[:NEAR]
    return f"; near it: {', '.join(low[each] for each in close)}" if close else ""
