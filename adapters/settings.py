"""What a setting may be, told once per engine and checked before a world is made.

An engine states its settings as a table, name by name: ``{"iterations": whole(1, 10**6), "skin": number(0.0)}``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from adapters.engine import EngineError

#: Largest whole number that a setting of a C engine can hold.
LARGEST_INT = 2**31 - 1
#: ``check(value)`` says in words what the value must be, or nothing if it is that.
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

    def check(value: Any) -> str:
        told = isinstance(value, int | float) and not isinstance(value, bool) and finite(value)
        return "" if told and least <= value <= most else f"a number from {least:g} to {most:g}"

    return check


def flag(value: Any) -> str:
    """True or false."""
    return "" if isinstance(value, bool) else "true or false"


def word(*words: str) -> Check:
    """One of these words."""

    def check(value: Any) -> str:
        return "" if isinstance(value, str) and value in words else f"one of {', '.join(words)}"

    return check


def checked(engine: str, kinds: Mapping[str, Check], settings: Mapping[str, Any]) -> dict[str, Any]:
    """Settings whose names and values ``engine`` can take: all of ``kinds``, and no others.

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
            raise EngineError(f"{name}: this setting is missing")
        wanted = check(settings[name])
        if wanted:
            raise EngineError(f"{name}: {settings[name]!r} must be {wanted}")
    return dict(settings)


def checked_step(dt: float) -> float:
    """A step that can be made [s].

    Raises
    ------
    EngineError
        For one that is not positive and finite.
    """
    if not (math.isfinite(dt) and dt > 0.0):
        raise EngineError(f"dt: {dt!r} must be a positive, finite number of seconds")
    return dt
