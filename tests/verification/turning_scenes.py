"""Contacts that turn, with truths by ordinary differential equations of one coordinate with events (E75).

Each scene has one degree of freedom at a time, so that its truth needs no contact problem: with the pose x(q) of every
body, ``M(q) q'' = -M'(q) q'^2 / 2 - V'(q)``, or the force balance along a given path where friction slides. A scene is
told once for the plane and for space, where its third dimension adds redundant points (an edge holds by two corners, a
face by four), lines across each other and tangents that are free to turn.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial

import numpy as np

from reference_solver.model import Array, Body, Model
from reference_solver.settings import TOLERANCE, Settings
from reference_solver.shapes import Box, Capsule, Disc
from reference_solver.simulation import Simulation
from tests.verification import runge_kutta
from tests.verification.rotation import rotation_matrix
from tests.verification.space import GRAVITY, ROUNDNESS, Space

#: Step of the classical Runge-Kutta method [s]: its error is 1e-14 of the motion in all cases.
TRUE_STEP = 1.25e-4
#: Spin of a block that rocks no more [rad/s].
AT_REST = 1e-9

State = tuple[float, float]
Rate = Callable[[float, float], float]


@dataclass(frozen=True)
class Headed(Space):
    """Space whose horizontal axis is turned about the vertical by an angle that belongs to no axis."""

    #: [rad]
    heading: float = 0.7

    def vector(self, along: float, up: float, across: float = 0.0) -> tuple[float, ...]:
        """Return a vector in world axes."""
        c, s = math.cos(self.heading), math.sin(self.heading)
        return c * along - s * across, s * along + c * across, up

    def pose(self, along: float, up: float, angle: float = 0.0) -> tuple[float, ...]:
        """Return a pose, turned by ``angle`` [rad] from the horizontal axis towards the upward one."""
        c, s = math.cos(0.5 * angle), -math.sin(0.5 * angle)  # about y
        a, b = math.cos(0.5 * self.heading), math.sin(0.5 * self.heading)  # then about z
        return (*self.vector(along, up), a * c, -b * s, a * s, b * c)

    def twist(self, along: float = 0.0, up: float = 0.0, spin: float = 0.0) -> tuple[float, ...]:
        """Return a twist [m/s, rad/s]."""
        return (*self.vector(along, up), *self.vector(0.0, 0.0, -spin))


#: Where scenes are set: the plane, and space.
PLANE, SPATIAL = Space(2), Headed(3)


@dataclass(frozen=True)
class Case:
    """A scene and where its last body is in the end.

    Parameters
    ----------
    space
        Where it is set.
    bodies, friction, time
        All at rest or moving as their constraints allow; e = 0; time in seconds.
    truth
        Pose of the last body; a quaternion up to sign, nan where an orientation is not compared [m, rad].
    """

    space: Space
    bodies: tuple[Body, ...]
    friction: float
    time: float
    truth: tuple[float, ...]

    def model(self) -> Model:
        """Return the scene."""
        pull = (*(0.0,) * self.space.up, -GRAVITY)
        return Model(self.space.dimension, list(self.bodies), pull, 0.0, self.friction)

    def error(self, tolerance: float = TOLERANCE) -> float:
        """Largest difference from the truth to a tolerance, looked at sixty times a second [m; rad or quaternion]."""
        simulation = Simulation(self.model(), Settings.reference(1.0 / 60.0, tolerance))
        simulation.advance(round(self.time * 60.0))
        pose = simulation.pose[-1].copy()
        if self.space.dimension == 3 and pose[3:] @ self.truth[3:] < 0.0:
            pose[3:] *= -1.0
        return float(np.nanmax(np.abs(pose - self.truth)))


def integrated(rate: Rate, state: State, time: float, until: Rate | None = None) -> tuple[State, float]:
    """Return (q, q') after ``time``, or where ``until(q, q')`` falls below zero before, and the time left."""
    ends = runge_kutta.never if until is None else lambda there: until(*there)
    return runge_kutta.integrated(partial(runge_kutta.move, rate), state, time, TRUE_STEP, ends)


def _box(
    space: Space,
    half: tuple[float, float],
    across: float,
    mass: float,
    pose: tuple[float, ...],
    twist: tuple[float, ...] = (),
) -> Body:
    """Return a box, in space of the half width ``across`` the plane of the motion."""
    if space.dimension == 2:
        return Body(Box(half), mass, mass * (half[0] ** 2 + half[1] ** 2) / 3.0, pose, twist or space.twist())
    halves = (half[0], across, half[1])
    a, b, c = (h * h * mass / 3.0 for h in halves)
    return Body(Box(halves), mass, (b + c, a + c, a + b), pose, twist or space.twist())


def _turned(angle: float, x: float, y: float) -> tuple[float, float]:
    return math.cos(angle) * x - math.sin(angle) * y, math.sin(angle) * x + math.cos(angle) * y


def pivot(space: Space) -> Case:
    """A box that falls over about a corner that sticks, from .35 rad.

    In space about an edge: two corners, six rows, one of them redundant.
    """
    half, lean, time = (0.2, 1.0), -0.35, 0.5
    level = half[0] ** 2 + half[1] ** 2  # r^2; about the corner (4/3) m r^2
    pull = 0.75 * GRAVITY / level
    (angle, _), _ = integrated(lambda q, v: -pull * _turned(q, -half[0], half[1])[0], (lean, 0.0), time)
    start, end = _turned(lean, -half[0], half[1]), _turned(angle, -half[0], half[1])
    box = _box(space, half, 0.3, 1.0, space.pose(*start, lean))
    return Case(space, (space.floor(), box), 5.0, time, space.pose(*end, angle))


#: A fixed ball of one metre and one of .3 m on it: distance of their centres [m].
APART = 1.3


def _on_hill(angle: float) -> tuple[float, float]:
    return APART * math.sin(angle), APART * math.cos(angle)


def _hill(space: Space, start: float) -> tuple[Body, ...]:
    hill = Body(space.ball(0.0, 0.0, radius=1.0).shape, motion="fixed", pose=space.pose(0.0, 0.0))
    return hill, space.ball(*_on_hill(start), radius=0.3)


def _place(space: Space, x: float, y: float) -> tuple[float, ...]:
    """A place whose orientation is not compared."""
    return (*space.vector(x, y), *(math.nan,) * {2: 1, 3: 4}[space.dimension])


def _load(angle: float, spin: float) -> float:
    return GRAVITY * math.cos(angle) - APART * spin**2


def _flown(space: Space, state: State, left: float) -> tuple[float, ...]:
    angle, spin = state
    x, y = _on_hill(angle)
    vx, vy = APART * spin * math.cos(angle), -APART * spin * math.sin(angle)
    return _place(space, x + vx * left, y + vy * left - 0.5 * GRAVITY * left**2)


def _rolls(space: Space) -> Rate:
    k = ROUNDNESS[space.dimension]
    return lambda q, v: GRAVITY * math.sin(q) / ((1.0 + k) * APART)


def rolling_hill(space: Space) -> Case:
    """A ball rolls off a ball."""
    (angle, _), _ = integrated(_rolls(space), (0.1, 0.0), 0.5)
    return Case(space, _hill(space, 0.1), 5.0, 0.5, _place(space, *_on_hill(angle)))


def leaving_hill(space: Space) -> Case:
    """A smooth ball slides off a ball and leaves it."""
    state, left = integrated(lambda q, v: GRAVITY * math.sin(q) / APART, (0.3, 0.0), 0.8, _load)
    return Case(space, _hill(space, 0.3), 0.0, 0.8, _flown(space, state, left))


def slipping_hill(space: Space) -> Case:
    """A ball rolls on a ball, slips, leaves it: three kinds of motion."""
    mu, time, k = 0.3, 0.9, ROUNDNESS[space.dimension]

    def grip(q: float, v: float) -> float:
        return mu * _load(q, v) - GRAVITY * math.sin(q) * k / (1.0 + k)

    state, left = integrated(_rolls(space), (0.3, 0.0), time, grip)
    state, left = integrated(lambda q, v: (GRAVITY * math.sin(q) - mu * _load(q, v)) / APART, state, left, _load)
    return Case(space, _hill(space, 0.3), mu, time, _flown(space, state, left))


def board_on_log(space: Space, time: float) -> Case:
    """A board rocks on a fixed log without slip: its centre is r q along its tangent from where it touches.

    The log is a disc, in space a capsule.
    """
    r, half = 0.5, (1.0, 0.05)
    inertia = (half[0] ** 2 + half[1] ** 2) / 3.0

    def rate(q: float, v: float) -> float:
        mass = r * r * q * q + half[1] ** 2 + inertia
        pull = r * q * math.cos(q) - half[1] * math.sin(q)
        return (-(r * r) * q * v * v - GRAVITY * pull) / mass

    (angle, _), _ = integrated(rate, (0.0, 1.0), time)
    x, y = _turned(angle, r * angle, r + half[1])
    board = _box(space, half, 0.4, 1.0, space.pose(0.0, r + half[1]), space.twist(-half[1], 0.0, 1.0))
    return Case(space, (_log(space, r), board), 5.0, time, space.pose(x, y, angle))


def _log(space: Space, r: float) -> Body:
    if not isinstance(space, Headed):
        return Body(Disc(r), motion="fixed")
    across = 0.5 * (space.heading + 0.5 * math.pi)
    pose = (0.0, 0.0, 0.0, math.cos(across), 0.0, 0.0, math.sin(across))
    return Body(Capsule(2.0, r), motion="fixed", pose=pose)


def ladder(space: Space) -> Case:
    """A smooth beam slides down between a wall and the floor."""
    half, lean, time = (1.0, 0.02), math.pi - 1.2, 0.5

    def place(q: float) -> tuple[float, float]:
        corners = [_turned(q, x, y) for x in (half[0], -half[0]) for y in (half[1], -half[1])]
        return -min(x for x, _ in corners), -min(y for _, y in corners)

    def slope(q: float) -> tuple[float, float]:
        corners = [_turned(q, x, y) for x in (half[0], -half[0]) for y in (half[1], -half[1])]
        left, low = min(corners), min(corners, key=lambda c: c[1])
        return left[1], -low[0]

    def rate(q: float, v: float) -> float:
        (x, y), (dx, dy) = place(q), slope(q)
        mass = dx * dx + dy * dy + (half[0] ** 2 + half[1] ** 2) / 3.0
        return (-(dx * -x + dy * -y) * v * v - GRAVITY * dy) / mass

    (angle, _), _ = integrated(rate, (lean, 0.0), time)
    bodies = (space.wall(1.0, 0.0), space.floor(), _box(space, half, 0.0, 1.0, space.pose(*place(lean), lean)))
    return Case(space, bodies, 0.0, time, space.pose(*place(angle), angle))


def rocking_block(space: Space, time: float = 1.6) -> Case:
    """A block rocks from corner to corner, in space from edge to edge.

    Each impact leaves 1 - (3/2) sin^2(alpha) of its spin (E56). What is left of impacts at less than `AT_REST` is less
    than that in all: it rests then.
    """
    half, lean, left = (0.25, 1.0), 0.1, time
    slender, size = math.atan2(*half), math.hypot(*half)
    kept, side, state = 1.0 - 1.5 * math.sin(slender) ** 2, 1.0, (lean, 0.0)
    while left > 0.0:
        state, left = integrated(
            lambda q, v: -0.75 * GRAVITY / size * math.sin(slender - q), state, left, lambda q, v: q
        )
        if left > 0.0:
            side, state = -side, (0.0, -kept * state[1])
            left = left if abs(state[1]) > AT_REST else 0.0
    angle = side * state[0]

    def place(q: float, corner: float) -> tuple[float, float]:
        x, y = _turned(q, -corner * half[0], half[1])
        return corner * half[0] + x, y

    box = _box(space, half, 0.4, 1.0, space.pose(*place(lean, -1.0), lean))
    truth = space.pose(*place(angle, -1.0 if side > 0.0 else 1.0), angle)
    return Case(space, (space.floor(), box), 5.0, time, truth)


def two_boxes(space: Space, time: float) -> Case:
    """Two stacked boxes tip as one about a corner, in space about an edge: rows of sticking faces, some redundant."""
    half, masses, lean = (0.2, 0.5), (1.0, 2.0), -0.35
    levers = ((-half[0], half[1]), (-half[0], 3.0 * half[1]))
    inertia = sum(
        m * ((half[0] ** 2 + half[1] ** 2) / 3.0 + x * x + y * y) for m, (x, y) in zip(masses, levers, strict=True)
    )

    def rate(q: float, v: float) -> float:
        return -GRAVITY / inertia * sum(m * _turned(q, *lever)[0] for m, lever in zip(masses, levers, strict=True))

    (angle, _), _ = integrated(rate, (lean, 0.0), time)
    starts = [space.pose(*_turned(lean, *lever), lean) for lever in levers]
    boxes = [_box(space, half, 0.3, m, start) for m, start in zip(masses, starts, strict=True)]
    return Case(space, (space.floor(), *boxes), 3.0, time, space.pose(*_turned(angle, *levers[1]), angle))


def top(space: Space) -> Case:
    """A box spins and falls about a corner that sticks: Euler's equations about a fixed point.

    In body axes, with the corner at -h from the centre and the moments J about the corner,
    ``J w' = m h x g_body - w x J w`` and ``q' = q w / 2``.
    """
    half, mass, time = np.array([0.2, 0.3, 1.0]), 1.0, 0.2
    moments = mass * (np.sum(half**2) - half**2) / 3.0
    about = np.diag(moments) + mass * ((half @ half) * np.eye(3) - np.outer(half, half))
    inverse = np.linalg.inv(about)
    turn = np.array([0.2, -0.3, 0.1])  # the corner at -half is the lowest
    size = float(np.linalg.norm(turn))
    q = np.array([math.cos(0.5 * size), *(math.sin(0.5 * size) / size * turn)])
    spin = np.array([0.4, -0.3, 2.0])  # body axes

    def rate(state: Array) -> Array:
        r, w = state[:4], state[4:]
        down = rotation_matrix(r / np.linalg.norm(r)).T @ np.array([0.0, 0.0, -GRAVITY])
        change = inverse @ (mass * np.cross(half, down) - np.cross(w, about @ w))
        real, imaginary = -0.5 * r[1:] @ w, 0.5 * (r[0] * w + np.cross(r[1:], w))
        return np.concatenate([[real], imaginary, change])

    state = np.concatenate([q, spin])
    start = rotation_matrix(q)
    for _ in range(round(time / TRUE_STEP)):
        state = runge_kutta.advance(rate, state, TRUE_STEP)
    end = state[:4] / np.linalg.norm(state[:4])
    w = start @ spin
    pose, twist = (*(start @ half), *q), (*np.cross(w, start @ half), *w)
    box = Body(Box(tuple(half)), mass, tuple(moments), pose, twist)
    return Case(space, (space.floor(), box), 5.0, time, (*(rotation_matrix(end) @ half), *end))


#: Cases by dimension and name.
CASES: dict[int, dict[str, Callable[[Space], Case]]] = {
    2: {
        "box pivoting on a corner": pivot,
        "disc rolling off a disc": rolling_hill,
        "smooth disc leaving a disc": leaving_hill,
        "disc rolling, slipping, leaving": slipping_hill,
        "board rocking on a log": partial(board_on_log, time=2.0),
        "beam sliding down a wall": ladder,
        "rocking block, two impacts": rocking_block,
        "two boxes tipping as one": partial(two_boxes, time=0.6),
    },
    3: {
        "box pivoting on an edge": pivot,
        "sphere rolling off a sphere": rolling_hill,
        "smooth sphere leaving a sphere": leaving_hill,
        "sphere rolling, slipping, leaving": slipping_hill,
        "board rocking on a capsule": partial(board_on_log, time=1.0),
        "rocking block, two impacts": rocking_block,
        "two boxes tipping as one": partial(two_boxes, time=0.5),
        "box spinning on a corner": top,
    },
}


@cache
def case(space: Space, name: str) -> Case:
    """Return one case with its truth."""
    return CASES[space.dimension][name](space)
