"""Numbers that no body has: what a file may state at most, and moments of inertia beyond those of a body's size."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import fields, is_dataclass
from typing import Any

from adapters.plain import NAME, one_line
from adapters.scene import Body, Scene, SceneError
from adapters.scene.shapes import Box, Capsule, Cylinder, HalfSpace, Hull, reach

#: Largest size of a number in SI units, and smallest mass, moment or length: products of five of them, such as an
#: energy over a length, stay within what a double can hold, with digits.
LARGEST, SMALLEST = 1e30, 1e-30
#: Round-off of moments of inertia, which a file states with some digits.
DIGITS = 1e-3


def check_magnitudes(scene: Scene) -> None:
    """Raise `SceneError` in one line for the first number that is too large, or too small for what it is."""
    for name, value in [("duration", scene.duration), ("gravity", scene.gravity)]:
        _check(name, value, False)
    for body in scene.bodies:
        label = one_line(body.name, NAME)
        if body.motion == "free":
            _check(f"{label}.mass", body.mass, True)
            _check(f"{label}.inertia", body.inertia, True)
        for name in ("pose", "twist", "force", "torque"):
            _check(f"{label}.{name}", getattr(body, name), False)
        if is_dataclass(body.shape):
            for each in fields(body.shape):
                size = not isinstance(body.shape, HalfSpace) and each.name != "vertices"
                _check(f"{label}.shape.{each.name}", getattr(body.shape, each.name), size)


def _check(name: str, value: Any, positive: bool) -> None:
    for number in _numbers(value):
        if abs(number) > LARGEST:
            raise SceneError(f"{name}: {number:.6g} is larger than {LARGEST:g}, the most that is computed with")
        if positive and number < SMALLEST:
            raise SceneError(f"{name}: {number:.6g} is smaller than {SMALLEST:g}, the least that is computed with")


def _numbers(value: Any) -> Iterator[float]:
    if isinstance(value, Iterable) and not isinstance(value, str):
        for each in value:
            yield from _numbers(each)
    elif isinstance(value, int | float):
        yield value


def impossible_inertia(scene: Scene) -> list[str]:
    """Notes on bodies whose moments of inertia are larger than with all mass at the surface."""
    found = []
    for body in scene.bodies:
        if body.motion != "free" or isinstance(body.shape, HalfSpace):
            continue
        stated = body.inertia if isinstance(body.inertia, tuple) else (body.inertia,)
        most = [body.mass * square for square in _farthest(body)]
        beyond = [k for k, (one, limit) in enumerate(zip(stated, most, strict=True)) if one > limit * (1.0 + DIGITS)]
        if beyond:
            k = max(beyond, key=lambda k: stated[k] / most[k])
            found.append(
                f"{one_line(body.name, NAME)}.inertia: {stated[k]:.6g} kg m^2 is more than a body of this size and "
                f"mass can have, {most[k]:.3g} kg m^2"
            )
    return found


def _farthest(body: Body) -> tuple[float, ...]:
    """Largest square of a distance from each axis [m^2]; planar bodies have one axis."""
    shape, moments = body.shape, len(body.inertia) if isinstance(body.inertia, tuple) else 1
    if moments == 1:
        return (reach(shape) ** 2,)
    if isinstance(shape, Box):
        x, y, z = (half * half for half in shape.half_extents)
        return y + z, z + x, x + y
    if isinstance(shape, Hull):
        # Principal axes may be any: the distance from the centre bounds that from each of them.
        return (reach(shape) ** 2,) * 3
    if isinstance(shape, Capsule):
        return shape.radius**2, reach(shape) ** 2, reach(shape) ** 2
    if isinstance(shape, Cylinder):
        return shape.radius**2, *(math.hypot(shape.half_length, shape.radius) ** 2,) * 2
    return (reach(shape) ** 2,) * 3
