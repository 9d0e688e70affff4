"""Checks of numbers that models are built from: each names the field that is wrong."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

#: A quaternion or a normal this close to unit length is normalised in silence; further off it is a mistake.
UNIT_TOLERANCE = 1e-6
#: The largest principal moment may exceed the sum of the others by this share: a flat plate's moments, each rounded to
#: six digits.
FLAT = 1e-5


def require_finite(name: str, value: float) -> None:
    """Raise ValueError unless ``value`` is a finite number."""
    if isinstance(value, bool) or not isinstance(value, (int, float, np.floating, np.integer)):
        raise ValueError(f"{name}: {value!r} is not a number")
    if not math.isfinite(value):
        raise ValueError(f"{name}: {value!r} is not finite")


def require_positive(name: str, value: float) -> None:
    """Raise ValueError unless ``value`` is a positive, finite number."""
    require_finite(name, value)
    if value <= 0.0:
        raise ValueError(f"{name}: {value!r} must be positive")


def require_count(name: str, value: int, least: int) -> None:
    """Raise ValueError unless ``value`` is a whole number of at least ``least``."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
        raise ValueError(f"{name}: {value!r} must be a whole number of at least {least}")


def require_moments(name: str, moments: tuple[float, ...]) -> None:
    """Raise ValueError unless three principal moments fulfil the triangle inequality.

    ``I_1 + I_2 - I_3 = 2 sum m z^2 >= 0`` for every distribution of mass; a flat one has equality.
    """
    largest = max(moments)
    others = math.fsum(moments) - largest
    if largest > others * (1.0 + FLAT):
        raise ValueError(
            f"{name}: {moments!r} are no principal moments of a body, the largest exceeds the sum of the others"
        )


def vector(name: str, value: Any, sizes: tuple[int, ...]) -> tuple[float, ...]:
    """Return ``value`` as a tuple of floats whose count is one of ``sizes``."""
    try:
        numbers = tuple(float(x) for x in value)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name}: {value!r} is not a sequence of numbers") from error
    if len(numbers) not in sizes:
        raise ValueError(f"{name}: {len(numbers)} numbers where {' or '.join(map(str, sizes))} are needed")
    for number in numbers:
        require_finite(name, number)
    return numbers


def load(name: str, value: Any, size: int) -> float | tuple[float, ...]:
    """Return a vector of ``size`` numbers, a plain number for size 1, zeros where the value is missing."""
    if size == 1:
        number = 0.0 if value is None else value
        require_finite(name, number)
        return float(number)
    return (0.0,) * size if value is None else vector(name, value, (size,))


def unit(name: str, direction: tuple[float, ...]) -> tuple[float, ...]:
    """Return ``direction`` at unit length; ValueError where it is far from it."""
    length = math.hypot(*direction)
    if abs(length - 1.0) > UNIT_TOLERANCE:
        raise ValueError(f"{name}: {direction!r} has length {length:.6g}, not 1")
    return tuple(x / length for x in direction)
