"""Bodies that the hard cases share: planar floor, discs and boxes."""

from __future__ import annotations

from typing import Any

from reference_solver.model import Body, Box, Disc, HalfSpace

#: Standard test value [m/s^2].
GRAVITY = 9.81
DOWN = (0.0, -GRAVITY)
#: Customary step of the project's fine lane [s].
DT = 1.0 / 240.0

FLOOR = Body(HalfSpace((0.0, 1.0)), motion="fixed")


def disc(x: float, y: float, radius: float = 0.5, mass: float = 1.0, **fields: Any) -> Body:
    """Return a uniform disc [m, kg]."""
    return Body(Disc(radius), mass, 0.5 * mass * radius**2, (x, y, 0.0), **fields)


def box(x: float, y: float, half: tuple[float, float] = (0.5, 0.5), mass: float = 1.0, **fields: Any) -> Body:
    """Return a uniform box [m, kg]."""
    angle = fields.pop("angle", 0.0)
    return Body(Box(half), mass, mass * (half[0] ** 2 + half[1] ** 2) / 3.0, (x, y, angle), **fields)
