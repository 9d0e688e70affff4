"""Random worlds, each of them a seed: free bodies among fixed and moving ones, thrown, laid on a floor or stacked."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from reference_solver.geometry import gap
from reference_solver.model import Array, Body, Model
from reference_solver.shapes import Box, Capsule, Disc, HalfSpace, Polygon, Shape, Sphere, area_centroid_moment
from tests.verification.space import GRAVITY

#: Steps a second that scenes are run with, and about how long they last [s]: three to ten events of each body.
RATES, TIMES = (60, 100, 240), (0.5, 0.75)
#: Steps from one comparison to the next; variants fit a whole number of theirs into as many.
STRIDE = 5
#: Bodies that are placed at random are at least this far apart [m]; what is laid down touches.
ROOM = 1e-3
#: Places that are tried for a body before it is left out.
TRIES = 40
#: How a free body starts, and how often.
STARTS = {"thrown": 0.5, "laid": 0.3, "stacked": 0.2}

Rng = np.random.Generator


@dataclass(frozen=True)
class Scene:
    """A world and how it is run.

    Parameters
    ----------
    model
        What is simulated.
    rate
        Steps a second of the run that is certified.
    steps
        Number of them, a multiple of `STRIDE`.
    """

    model: Model
    rate: int
    steps: int


def scene(seed: int, dimension: int) -> Scene:
    """Return the world of a seed.

    A floor that may lean or move, perhaps a wall, perhaps a fixed or moving obstacle, and one to three free bodies
    with masses over three decades (now and then eight). Restitution and friction differ from pair to pair; both are
    zero everywhere in many scenes.
    """
    rng = np.random.default_rng([seed, dimension])
    up = _leaning(rng, dimension)
    bodies = _surroundings(rng, up)
    decades = 4.0 if rng.uniform() < 0.1 else 1.5
    for _ in range(int(rng.integers(1, 4 if dimension == 2 else 3))):
        start = str(rng.choice(list(STARTS), p=list(STARTS.values())))
        body = _free(rng, bodies, up, start, 10.0 ** rng.uniform(-decades, decades))
        if body is not None:
            bodies.append(body)
    n = len(bodies)
    restitution = 0.0 if rng.uniform() < 0.5 else rng.uniform(0.0, 0.9, (n, n)) * (rng.uniform(size=(n, n)) < 0.7)
    friction = 0.0 if rng.uniform() < 0.2 else rng.uniform(0.0, 1.2, (n, n))
    gravity = np.zeros(dimension)
    gravity[-1] = 0.0 if rng.uniform() < 0.05 else -GRAVITY
    model = Model(dimension, bodies, tuple(gravity), _symmetric(restitution), _symmetric(friction))
    rate = int(rng.choice(RATES))
    return Scene(model, rate, STRIDE * round(float(rng.choice(TIMES)) * rate / STRIDE))


def chain(seed: int, dimension: int) -> Scene:
    """Return the world of a seed in which impacts tend to accumulate: bodies in a row that run into one another.

    Two to five free bodies with masses over three decades, between walls or between nothing, along any direction; e
    from 0 to .9, friction in some, gravity along the row in some. One in four rows lies on a smooth floor under
    gravity.
    """
    rng = np.random.default_rng([seed, dimension, 1])
    along = rng.normal(size=dimension)
    lies = rng.uniform() < 0.25
    if lies:
        along[-1] = 0.0
    along /= np.linalg.norm(along)
    count, radius = int(rng.integers(2, 6)), float(rng.uniform(0.05, 0.3))
    turned, far = _turn_to(along), rng.uniform(-2.0, 2.0, dimension)
    walls = (rng.uniform() < 0.75, rng.uniform() < 0.4)
    bodies, at = [], 0.0
    for _ in range(count):
        shape, moment = (_round, _brick, _pill)[int(rng.choice(3, p=(0.7, 0.2, 0.1)))](radius, dimension)
        half = radius if not isinstance(shape, Capsule) else shape.half_length + radius
        at += 10.0 ** rng.uniform(-3.0, -0.7) + half
        twist = np.zeros(dimension + _spins(dimension))
        twist[:dimension] = rng.uniform(-1.5, 0.5) * along
        mass = 10.0 ** rng.uniform(-1.5, 1.5)
        place = far + at * along
        bodies.append(Body(shape, mass, _scaled(mass, moment), (*place, *turned), tuple(twist)))
        at += half
    upright = _upright(dimension)
    ends = ((walls[0], along, far), (walls[1], -along, far + (at + 10.0 ** rng.uniform(-3.0, -0.7)) * along))
    bodies += [
        Body(HalfSpace(tuple(n)), pose=(*place, *upright), motion="fixed") for is_there, n, place in ends if is_there
    ]
    gravity = np.zeros(dimension)
    if lies:
        up = np.eye(dimension)[-1]
        bodies.append(Body(HalfSpace(tuple(up)), pose=(*(far - radius * up), *upright), motion="fixed"))
        gravity = -GRAVITY * up
    elif rng.uniform() < 0.4:
        gravity = -GRAVITY * along
    n = len(bodies)
    restitution = rng.uniform(0.0, 0.9, (n, n)) if rng.uniform() < 0.5 else rng.uniform(0.0, 0.9) + np.zeros((n, n))
    friction = np.full((n, n), rng.uniform(0.0, 0.6) if rng.uniform() < 0.25 else 0.0)
    if lies:
        restitution[-1] = restitution[:, -1] = friction[-1] = friction[:, -1] = 0.0
    model = Model(dimension, bodies, tuple(gravity), _symmetric(restitution), _symmetric(friction))
    return Scene(model, int(rng.choice(RATES)), 6 * STRIDE)


#: What can be drawn, by name.
DRAWN = {"any": scene, "chains": chain}


def _turn_to(along: Array) -> tuple[float, ...]:
    """Orientation in which the first axis of a body has the direction ``along``."""
    if len(along) == 2:
        return (math.atan2(along[1], along[0]),)
    half = np.array([1.0 + along[0], 0.0, -along[2], along[1]])  # half-way between no turn and the whole one
    return tuple(half / np.linalg.norm(half))


def _round(radius: float, d: int) -> tuple[Shape, Array | float]:
    return (Disc(radius), 0.5 * radius**2) if d == 2 else (Sphere(radius), np.full(3, 0.4 * radius**2))


def _brick(radius: float, d: int) -> tuple[Shape, Array | float]:
    half = np.full(d, radius)
    moment = (half @ half - half**2) / 3.0
    return Box(tuple(float(x) for x in half)), float(half @ half) / 3.0 if d == 2 else moment


def _pill(radius: float, d: int) -> tuple[Shape, Array | float]:
    about, across = 0.5 * radius**2, 0.25 * radius**2 + (2.0 * radius) ** 2 / 3.0
    return Capsule(radius, radius), across if d == 2 else np.array([about, across, across])


def _symmetric(values: Any) -> Any:
    upper = np.triu(values, 1) if np.ndim(values) else values
    return upper + upper.T if np.ndim(values) else upper


def _leaning(rng: Rng, d: int) -> Array:
    """Normal (d,) of the floor: upright half of the time."""
    up = np.zeros(d)
    up[-1] = 1.0
    if rng.uniform() < 0.5:
        up[:-1] = rng.uniform(-0.4, 0.4, d - 1)
    return np.asarray(up / np.linalg.norm(up))


def _surroundings(rng: Rng, up: Array) -> list[Body]:
    """Floor, wall and obstacle."""
    d = len(up)
    bodies = [_half_space(rng, up, 0.0, 0.25)]
    if rng.uniform() < 0.4:
        side = np.zeros(d)
        side[0] = rng.choice([-1.0, 1.0])
        bodies.append(_half_space(rng, side, -1.2, 0.25))
    if rng.uniform() < 0.4:
        shape, _ = _shape(rng, d)
        place = np.concatenate([rng.uniform(-0.5, 0.5, d - 1), [rng.uniform(0.3, 0.8)]])
        moves = rng.uniform() < 0.4
        twist = tuple(rng.uniform(-0.7, 0.7, _spins(d) + d)) if moves else None
        pose = (*place, *_orientation(rng, d))
        bodies.append(Body(shape, pose=pose, motion="prescribed" if moves else "fixed", twist=twist))
    return bodies


def _half_space(rng: Rng, normal: Array, offset: float, often: float) -> Body:
    """Return a fixed half-space, or with the share ``often`` one that moves: along its face, and slowly towards us."""
    d = len(normal)
    pose = (*np.zeros(d), *_upright(d))
    if rng.uniform() >= often:
        return Body(HalfSpace(tuple(normal), offset), pose=pose, motion="fixed")
    slides = rng.uniform(-1.0, 1.0, d)
    slides -= (slides @ normal) * normal
    twist = (*(slides + rng.choice([0.0, rng.uniform(-0.3, 0.3)]) * normal), *np.zeros(_spins(d)))
    return Body(HalfSpace(tuple(normal), offset), pose=pose, motion="prescribed", twist=twist)


def _free(rng: Rng, others: list[Body], up: Array, start: str, mass: float) -> Body | None:
    """Return a free body that overlaps none of ``others``; None where none was found."""
    d = len(up)
    for _ in range(TRIES):
        shape, moment = _shape(rng, d)
        pose = np.array([*rng.uniform(-0.8, 0.8, d - 1), rng.uniform(0.4, 2.2), *_orientation(rng, d)])
        if start != "thrown":
            pose[d:] = _flat(rng, up)
            below = others[0]
            if start == "stacked" and others[-1].motion == "free":
                below = others[-1]
                pose[:d] = np.array(below.pose[:d]) + 1.2 * up + 0.1 * rng.uniform(-1.0, 1.0) * _along(up)
            pose[:d] -= _way_down(shape, pose, below, up) * up
        touching = 1 if start != "thrown" else 0
        gaps = [gap(body.shape, body.pose, shape, pose) for body in others]
        if sum(value < ROOM for value in gaps) > touching or min(gaps) < -1e-12:
            continue
        spread = rng.uniform(0.6, 1.0)
        twist = _start_twist(rng, up, start)
        return Body(shape, mass, _scaled(mass * spread, moment), tuple(pose), twist)
    return None


def _start_twist(rng: Rng, up: Array, start: str) -> tuple[float, ...]:
    """Twist of a free body: thrown with spin, or sliding and spinning as what lies on the floor can, or at rest."""
    d = len(up)
    if rng.uniform() < 0.25:
        return (0.0,) * (d + _spins(d))
    twist = np.concatenate([rng.uniform(-2.0, 2.0, d), rng.uniform(-4.0, 4.0, _spins(d))])
    if start == "thrown":
        twist[d - 1] = rng.uniform(-3.0, 1.0)
        return tuple(twist)
    twist[:d] -= (twist[:d] @ up) * up
    if rng.uniform() < 0.5:  # without tipping
        twist[d:] = 0.0 if d == 2 else (twist[d:] @ up) * up
    return tuple(twist)


def _way_down(shape: Shape, pose: Array, below: Body, up: Array) -> float:
    """How far a body may go down along -up until it touches ``below`` [m]: gaps, from above, until there is none."""
    d, moved = len(up), pose.copy()
    way = 0.0
    for _ in range(60):
        left = gap(below.shape, below.pose, shape, moved)
        if not 1e-13 < left < 10.0:
            break
        way += left
        moved[:d] = pose[:d] - way * up
    return way


def _shape(rng: Rng, d: int) -> tuple[Shape, Array | float]:
    """Return a shape and its moment of inertia, of a mass of one [m^2]."""
    makers: tuple[Callable[[Rng], tuple[Shape, Array | float]], ...] = (
        (_disc, _rectangle, _polygon, _rod) if d == 2 else (_ball, _block, _pin)
    )
    return makers[int(rng.integers(len(makers)))](rng)


def _disc(rng: Rng) -> tuple[Shape, float]:
    radius = float(rng.uniform(0.2, 0.4))
    return Disc(radius), 0.5 * radius**2


def _rectangle(rng: Rng) -> tuple[Shape, float]:
    half = rng.uniform(0.12, 0.45, 2)
    return Box((float(half[0]), float(half[1]))), float(half @ half) / 3.0


def _polygon(rng: Rng) -> tuple[Shape, float]:
    """Corners on a circle: regular, or at random with at least a third of its area."""
    while True:
        count, radius = int(rng.integers(3, 8)), rng.uniform(0.2, 0.45)
        angles = rng.uniform(0.0, 1.0) + np.arange(count) * 2.0 * math.pi / count
        if rng.uniform() < 0.5:
            angles = np.sort(rng.uniform(0.0, 2.0 * math.pi, count))
        points = [(float(radius * math.cos(a)), float(radius * math.sin(a))) for a in angles]
        try:
            area, _, _ = area_centroid_moment(tuple(points))
            shape = Polygon.about_centroid(tuple(points))
        except ValueError:  # corners too close together
            continue
        if area > radius**2:
            area, _, moment = area_centroid_moment(shape.vertices)
            return shape, moment / area


def _rod(rng: Rng) -> tuple[Shape, float]:
    half, radius = float(rng.uniform(0.1, 0.4)), float(rng.uniform(0.1, 0.25))
    return Capsule(half, radius), (half + radius) ** 2 / 3.0


def _ball(rng: Rng) -> tuple[Shape, Array]:
    """One in four of unequal moments: it tumbles as it rolls."""
    radius = float(rng.uniform(0.2, 0.4))
    moments = rng.uniform(0.3, 0.45, 3) if rng.uniform() < 0.25 else np.full(3, 0.4)
    return Sphere(radius), moments * radius**2


def _block(rng: Rng) -> tuple[Shape, Array]:
    half = rng.uniform(0.12, 0.4, 3)
    return Box(tuple(float(x) for x in half)), (half @ half - half**2) / 3.0


def _pin(rng: Rng) -> tuple[Shape, Array]:
    half, radius = float(rng.uniform(0.1, 0.3)), float(rng.uniform(0.1, 0.2))
    about, across = 0.5 * radius**2, 0.25 * radius**2 + (half + radius) ** 2 / 3.0
    return Capsule(half, radius), np.array([about, across, across])


def _scaled(mass: float, moment: Array | float) -> Any:
    return mass * moment if isinstance(moment, float) else tuple(float(x) for x in mass * moment)


def _spins(d: int) -> int:
    return 1 if d == 2 else 3


def _upright(d: int) -> tuple[float, ...]:
    return (0.0,) if d == 2 else (1.0, 0.0, 0.0, 0.0)


def _orientation(rng: Rng, d: int) -> tuple[float, ...]:
    """Any; along the axes now and then."""
    if d == 2:
        return (float(rng.choice([rng.uniform(-3.0, 3.0), rng.uniform(-3.0, 3.0), 0.0, 0.5 * math.pi])),)
    if rng.uniform() < 0.25:
        return _upright(3)
    turn = rng.normal(size=4)
    return tuple(turn / np.linalg.norm(turn))


def _flat(rng: Rng, up: Array) -> tuple[float, ...]:
    """Orientation of a body that lies on the floor: its last axis, or in the plane any quarter turn of it, is upwards.

    In space it is turned about the normal at random.
    """
    if len(up) == 2:
        return (math.atan2(-up[0], up[1]) + 0.5 * math.pi * int(rng.integers(2)),)
    axis = np.cross([0.0, 0.0, 1.0], up)
    lean = np.array([1.0 + up[2], *axis])  # half-way between no turn and the whole one
    lean /= np.linalg.norm(lean)
    angle = 0.5 * rng.uniform(-math.pi, math.pi)
    heading = np.array([math.cos(angle), 0.0, 0.0, math.sin(angle)])
    w, v = lean[0], lean[1:]
    turn = np.array([w * heading[0] - v @ heading[1:], *(w * heading[1:] + heading[0] * v + np.cross(v, heading[1:]))])
    return tuple(turn / np.linalg.norm(turn))


def _along(up: Array) -> Array:
    """Return a direction (d,) in the floor."""
    along = np.zeros(len(up))
    along[0] = 1.0
    along -= (along @ up) * up
    return np.asarray(along / np.linalg.norm(along))
