"""Kinds of settings, stated once per engine and checked before a world is built.

An engine states its settings as a table, name by name: ``{"iterations": whole(1, 10**6), "skin": number(0.0)}``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from typing import Any

from adapters.engine import EngineError

#: Largest whole number that a setting of a C engine can hold.
LARGEST_INT = 2**31 - 1
#: ``check(value)`` returns what the value must be, in words, or nothing if it is valid.
Check = Callable[[Any], str]


def finite(value: Any) -> bool:
    """Whether a number is finite as a double: a whole number of 400 digits is not."""
    try:
        return math.isfinite(value)
    except OverflowError:
        return False


def whole(least: int, most: int) -> Check:
    """A whole number of this range; true and false are none."""

    def check(value: Any) -> str:
        fits = isinstance(value, int) and not isinstance(value, bool) and least <= value <= most
        return "" if fits else f"a whole number from {least} to {most}"

    return check


def number(least: float, most: float) -> Check:
    """A finite number of this range."""
    ends = f"from {least:g} to {most:g}" if math.isfinite(most) else f"of at least {least:g}"

    def check(value: Any) -> str:
        told = isinstance(value, int | float) and not isinstance(value, bool) and finite(value)
        wanted = f"a number {ends}" if math.isfinite(least) else "a finite number"
        return "" if told and least <= value <= most else wanted

    return check


def flag(value: Any) -> str:
    """True or false."""
    return "" if isinstance(value, bool) else "true or false"


def word(*words: str) -> Check:
    """One of these words."""

    def check(value: Any) -> str:
        return "" if isinstance(value, str) and value in words else f"one of {', '.join(words)}"

    return check


def row(count: int, check: Check) -> Check:
    """A row of ``count`` values that ``check`` accepts."""

    def whole_row(value: Any) -> str:
        fits = isinstance(value, tuple | list) and len(value) == count and not any(map(check, value))
        return "" if fits else f"{count} values with commas between them, each {check(None)}"

    return whole_row


def rows(*checks: Check) -> Check:
    """Rows of values, each of which the check in its place accepts."""

    def whole_rows(value: Any) -> str:
        told = isinstance(value, tuple | list) and all(
            isinstance(each, tuple | list) and len(each) == len(checks) for each in value
        )
        fits = told and not any(check(said) for each in value for check, said in zip(checks, each, strict=True))
        return "" if fits else f"rows of {len(checks)} values: {'; '.join(check(object()) for check in checks)}"

    return whole_rows


def words(*known: str) -> Check:
    """A selection of these words."""

    def check(value: Any) -> str:
        fits = isinstance(value, tuple | list) and len(value) > 0 and all(each in known for each in value)
        return "" if fits else f"some of {', '.join(known)}, with commas between them"

    return check


def one_of(*known: int) -> Check:
    """One of these whole numbers."""

    def check(value: Any) -> str:
        fits = isinstance(value, int) and not isinstance(value, bool) and value in known
        return "" if fits else f"one of {', '.join(map(str, known))}"

    return check


def either(check: Check, *others: Any) -> Check:
    """Values that ``check`` accepts, or one of these."""

    def wider(value: Any) -> str:
        named = any(type(value) is type(other) and value == other for other in others)
        wanted = "" if named else check(value)
        return f"{wanted}, or {' or '.join(map(text_of, others))}" if wanted else ""

    return wider


def checked(
    engine: str, kinds: Mapping[str, Check], settings: Mapping[str, Any], optional: Collection[str] = ()
) -> dict[str, Any]:
    """Valid settings of ``engine``: all of ``kinds`` but ``optional`` ones, and no others.

    Raises
    ------
    EngineError
        Naming the first setting that is unknown, missing or of the wrong kind.
    """
    for name in settings:
        if name not in kinds:
            raise EngineError(f"{name}: {engine} has no such setting, it has {', '.join(kinds)}")
    for name, check in kinds.items():
        if name not in settings:
            if name in optional:
                continue
            raise EngineError(f"{name}: this setting is missing")
        wanted = check(settings[name])
        if wanted:
            raise EngineError(f"{name}: {settings[name]!r} must be {wanted}")
    return dict(settings)


def checked_step(dt: float) -> float:
    """A valid step [s].

    Raises
    ------
    EngineError
        If it is not positive and finite.
    """
    if not (math.isfinite(dt) and dt > 0.0):
        raise EngineError(f"dt: {dt!r} must be a positive, finite number of seconds")
    return dt


def like(value: Any) -> Check:
    """A check for the type of ``value``, for settings without a stated kind."""
    if isinstance(value, bool):
        return flag
    if isinstance(value, int):
        return whole(-LARGEST_INT - 1, LARGEST_INT)
    if isinstance(value, float):
        return number(-math.inf, math.inf)
    if isinstance(value, tuple | list):
        return row(len(value), like(value[0]) if value else flag)
    if isinstance(value, str):
        return lambda given: "" if isinstance(given, str) else "a word"
    return lambda given: ""  # the other type of None is unknown


def text_of(value: Any) -> str:
    """A value in the syntax of `read`; whole numbers without a fraction."""
    if isinstance(value, tuple | list):
        return ",".join(map(text_of, value))
    if isinstance(value, float):
        return repr(value).removesuffix(".0")
    return str(value).lower() if value is None or isinstance(value, bool) else str(value)
