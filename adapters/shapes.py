"""Shapes of bodies, and the checks of numbers that whatever describes a scene is made with."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any


class SceneError(ValueError):
    """A scene is not a physical one; the message names the field in one line."""


def check_finite(name: str, values: Any) -> None:
    """Raise `SceneError` unless a number, or every one of a tuple, is finite."""
    for value in values if isinstance(values, tuple) else (values,):
        if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
            raise SceneError(f"{name}: {value!r} is not a finite number")


def check_positive(name: str, values: Any) -> None:
    """Raise `SceneError` unless a number, or every one of a tuple, is finite and above 0."""
    check_finite(name, values)
    for value in values if isinstance(values, tuple) else (values,):
        if value <= 0.0:
            raise SceneError(f"{name}: {value!r} must be greater than 0")


def check_length(name: str, values: tuple[float, ...], length: int) -> None:
    """Raise `SceneError` unless there are so many components."""
    if len(values) != length:
        raise SceneError(f"{name}: has {len(values)} components, needs {length}")


@dataclass(frozen=True)
class Disc:
    """Planar disc of ``radius`` [m]."""

    radius: float

    def validate(self, owner: str) -> None:
        """Raise `SceneError` unless the radius is positive and finite."""
        check_positive(f"{owner}.shape.radius", self.radius)

    @property
    def smallest_size(self) -> float:
        """Smallest full extent [m]."""
        return 2.0 * self.radius


@dataclass(frozen=True)
class Sphere:
    """Ball of ``radius`` [m]."""

    radius: float

    def validate(self, owner: str) -> None:
        """Raise `SceneError` unless the radius is positive and finite."""
        check_positive(f"{owner}.shape.radius", self.radius)

    @property
    def smallest_size(self) -> float:
        """Smallest full extent [m]."""
        return 2.0 * self.radius


@dataclass(frozen=True)
class Box:
    """Box given by its HALF extents [m], two (planar) or three (spatial), along its body axes."""

    half_extents: tuple[float, ...]

    def validate(self, owner: str) -> None:
        """Raise `SceneError` unless all half extents are positive and finite."""
        check_positive(f"{owner}.shape.half_extents", self.half_extents)

    @property
    def smallest_size(self) -> float:
        """Smallest full extent [m]."""
        return 2.0 * min(self.half_extents)


@dataclass(frozen=True)
class HalfSpace:
    """Everything with ``normal . x <= offset`` [m] is solid, in world axes; ``normal`` is a unit vector.

    Its body's pose stays empty: normal and offset say where it lies, at the start if its body is prescribed.
    """

    normal: tuple[float, ...]
    offset: float = 0.0

    def validate(self, owner: str) -> None:
        """Raise `SceneError` unless the normal has length 1 (to 1e-9) and the offset is finite."""
        check_finite(f"{owner}.shape.normal", self.normal)
        check_finite(f"{owner}.shape.offset", self.offset)
        if abs(math.hypot(*self.normal) - 1.0) > 1e-9:
            raise SceneError(f"{owner}.shape.normal: {self.normal!r} must have length 1")

    @property
    def smallest_size(self) -> float:
        """A half-space has no finite extent."""
        return math.inf


Shape = Disc | Sphere | Box | HalfSpace
SHAPES: dict[str, type] = {"disc": Disc, "sphere": Sphere, "box": Box, "half_space": HalfSpace}
SHAPE_NAMES = {cls: name for name, cls in SHAPES.items()}
