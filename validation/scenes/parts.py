"""Bodies and directions shared by the canonical scenes, in two and three dimensions."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from adapters.engine import Array
from adapters.scene import Body, Box, Disc, HalfSpace, Scene, Sphere
from adapters.trajectory import Sampling
from validation.canonical import GRAVITY, Parameter

#: Time until a first contact [s]: 12.6 steps of 1/240 s, so that it lies inside a step and not at its end, where
#: engines differ in whether a touching contact counts.
DELAY = 0.0525
#: Phases of a contact within a step; primary errors of impacts are suprema over them.
PHASES = 16


def upward(dimension: int, length: float) -> tuple[float, ...]:
    """Vector of ``length`` along the vertical."""
    return (0.0,) * (dimension - 1) + (length,)


def floor(dimension: int) -> Body:
    """Immovable half-space below height 0."""
    return Body("floor", HalfSpace(upward(dimension, 1.0), 0.0), motion="fixed")


def pose_at(dimension: int, position: tuple[float, ...]) -> tuple[float, ...]:
    """Pose at ``position``, not turned."""
    return (*position, 0.0) if dimension == 2 else (*position, 1.0, 0.0, 0.0, 0.0)


def ball(name: str, dimension: int, mass: float, radius: float, height: float, speed: float = 0.0) -> Body:
    """Disc (I = m r^2/2) or solid sphere (I = 2 m r^2/5), centre at ``height``, moving up with ``speed``."""
    spin = (0.0,) if dimension == 2 else (0.0, 0.0, 0.0)
    inertia: float | tuple[float, float, float]
    inertia = 0.5 * mass * radius**2 if dimension == 2 else (0.4 * mass * radius**2,) * 3
    return Body(
        name,
        Disc(radius) if dimension == 2 else Sphere(radius),
        mass,
        inertia,
        pose_at(dimension, upward(dimension, height)),
        (*upward(dimension, speed), *spin),
    )


def cube(name: str, dimension: int, mass: float, side: float, height: float) -> Body:
    """Square or cube, centre at ``height``, at rest; I = m s^2/6 about every principal axis."""
    moment = mass * side**2 / 6.0
    inertia: float | tuple[float, float, float] = moment if dimension == 2 else (moment,) * 3
    shape = Box((0.5 * side,) * dimension)
    return Body(name, shape, mass, inertia, pose_at(dimension, upward(dimension, height)))


def along(dimension: int, x: float, height: float = 0.0) -> tuple[float, ...]:
    """Vector with ``x`` along the first axis and ``height`` along the vertical."""
    return (x, *(0.0,) * (dimension - 2), height)


def heading(scene: Scene) -> Array:
    """Unit vector of a motion along the floor, (d - 1,): parameter ``heading`` [degrees], of spatial scenes."""
    angle = math.radians(scene.params.get("heading", 0.0))
    return np.array([1.0] if scene.dimension == 2 else [math.cos(angle), math.sin(angle)])


def at(body: Body, dimension: int, position: tuple[float, ...], velocity: tuple[float, ...] = ()) -> Body:
    """The same body at ``position``, not turned, moving with ``velocity`` without spin."""
    spin = (0.0,) if dimension == 2 else (0.0, 0.0, 0.0)
    return replace(body, pose=pose_at(dimension, position), twist=(*(velocity or (0.0,) * dimension), *spin))


def tilted(body: Body, dimension: int, place: tuple[float, float], tilt: float) -> Body:
    """The body at ``place`` (along, up) [m], turned by ``tilt`` [rad] counter-clockwise in the plane of both."""
    if dimension == 2:
        return replace(body, pose=(*place, tilt))
    half = 0.5 * tilt
    return replace(body, pose=(place[0], 0.0, place[1], math.cos(half), 0.0, -math.sin(half), 0.0))


def block(name: str, dimension: int, mass: float, width: float, height: float) -> Body:
    """Uniform box at the origin, as deep as it is wide; I = m (a^2 + b^2)/12 about each principal axis."""
    upright = mass * (width**2 + height**2) / 12.0
    inertia: float | tuple[float, float, float] = upright
    if dimension == 3:
        inertia = (upright, upright, mass * width**2 / 6.0)
    half = (*(0.5 * width,) * (dimension - 1), 0.5 * height)
    return Body(name, Box(half), mass, inertia, pose_at(dimension, (0.0,) * dimension))


# ---- when a contact falls within a step ----


def phases(dt: float) -> list[dict[str, float]]:
    """Contact times distributed over one step, in the middle of each of its `PHASES` parts."""
    return [{"delay": DELAY + (k + 0.5) / PHASES * dt} for k in range(PHASES)]


def delay(until: str = "contact") -> Parameter:
    """The parameter that `phases` varies: time ``until`` a contact."""
    because = f"time until {until}: sets its phase within a step"
    return Parameter("delay", DELAY, "s", because, 0.0, 10.0, positive=True)


# ---- parameters that many scenes have ----


def standard_gravity() -> Parameter:
    """Parameter ``g``."""
    return Parameter("g", GRAVITY, "m/s^2", "gravity", 0.0, 1e3, positive=True)


def mass_of(what: str, default: float = 1.0) -> Parameter:
    """Parameter ``mass`` [kg], of ``what`` it says."""
    return Parameter("mass", default, "kg", f"of {what}", 0.0, 1e6, positive=True)


# ---- what is recorded ----


def states(scene: object) -> Sampling:
    """Every step, without contacts."""
    return Sampling(1, None)


def states_and_impulses(scene: object) -> Sampling:
    """Every step, with contacts from the start: impulses are summed over a contact."""
    return Sampling(1, 0.0)


# ---- motion between impacts ----


def between_impacts(start: float, speed: float, impacts: Iterable[tuple[float, float]]) -> Callable[[float], float]:
    """Coordinate [m] over time [s] of straight motion between ``impacts``: times [s] and speeds after them."""
    known = tuple(impacts)

    def place(t: float) -> float:
        x, since, now = start, 0.0, speed
        for time, after in known:
            if t < time:
                break
            x, since, now = x + now * (time - since), time, after
        return x + now * (t - since)

    return place
