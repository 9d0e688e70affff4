"""Spatial contacts that turn, against differential equations (E75): those of the plane lifted, and a spinning top.

Lifted scenes are turned about the vertical by an angle that belongs to no axis. Their third dimension adds redundant
points (an edge holds by two corners, a face by four), lines across each other and tangents that are free to turn.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from reference_solver.certification import Gate
from reference_solver.certification.orders import RATES, fitted
from reference_solver.certification.rotation import rotation_matrix
from reference_solver.certification.space import GRAVITY
from reference_solver.certification.turning import ALLOWED, HELD_BELOW, IMPULSE_ORDER, ORDER, TRUE_STEP, integrated
from reference_solver.model import Array, Body, Model
from reference_solver.settings import Scheme, Settings
from reference_solver.shapes import Box, Capsule, HalfSpace, Sphere
from reference_solver.simulation import Simulation

#: Turn of the lifted scenes about the vertical [rad].
HEADING = 0.7
#: I / (m r^2) of a uniform sphere.
ROUND = 0.4
#: A fixed sphere of one metre and one of .3 m on it: distance of their centres [m].
APART = 1.3


@dataclass(frozen=True)
class Case:
    """A scene and where its last body is in the end.

    Parameters
    ----------
    bodies, friction, time
        At rest or moving as their constraints allow; e = 0; time in seconds.
    truth
        Pose (7,) of the last body; its quaternion up to sign, or nan where a sphere's orientation is not compared.
    """

    bodies: tuple[Body, ...]
    friction: float
    time: float
    truth: Array

    def error(self, rate: int, scheme: Scheme = "located") -> float:
        """Largest difference from the truth at ``rate`` steps a second [m; quaternion]."""
        model = Model(3, list(self.bodies), (0.0, 0.0, -GRAVITY), 0.0, self.friction)
        simulation = Simulation(model, replace(Settings.reference(1.0 / rate), scheme=scheme))
        simulation.advance(round(self.time * rate))
        pose = simulation.pose[-1].copy()
        if not math.isnan(self.truth[3]) and pose[3:] @ self.truth[3:] < 0.0:
            pose[3:] *= -1.0
        return float(np.nanmax(np.abs(pose - self.truth)))


def _heading(vector: tuple[float, float, float]) -> tuple[float, float, float]:
    c, s = math.cos(HEADING), math.sin(HEADING)
    x, y, z = vector
    return c * x - s * y, s * x + c * y, z


def _lifted(x: float, z: float, angle: float) -> tuple[float, ...]:
    """Pose of a lifted planar body: counter-clockwise seen along +y, so that it turns about -y."""
    c, s = math.cos(0.5 * angle), -math.sin(0.5 * angle)  # about y
    a, b = math.cos(0.5 * HEADING), math.sin(0.5 * HEADING)  # then about z
    return (*_heading((x, 0.0, z)), a * c, -b * s, a * s, b * c)


def _twist(vx: float, vz: float, spin: float) -> tuple[float, ...]:
    return (*_heading((vx, 0.0, vz)), *_heading((0.0, -spin, 0.0)))


def _box(half: tuple[float, float, float], mass: float, pose: tuple[float, ...], twist: tuple[float, ...] = ()) -> Body:
    a, b, c = (h * h * mass / 3.0 for h in half)
    return Body(Box(half), mass, (b + c, a + c, a + b), pose, twist or (0.0,) * 6)


def _ball(place: tuple[float, float, float]) -> Body:
    return Body(Sphere(0.3), 1.0, (ROUND * 0.09,) * 3, (*place, 1.0, 0.0, 0.0, 0.0))


def _fixed(shape: HalfSpace | Sphere | Capsule, pose: tuple[float, ...] = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)) -> Body:
    return Body(shape, motion="fixed", pose=pose)


def _floor() -> Body:
    return _fixed(HalfSpace((0.0, 0.0, 1.0)))


def _turned(angle: float, x: float, y: float) -> tuple[float, float]:
    return math.cos(angle) * x - math.sin(angle) * y, math.sin(angle) * x + math.cos(angle) * y


def pivot() -> Case:
    """A box that falls over about an edge that sticks, from .35 rad: two corners, six rows, one of them redundant."""
    half, lean, time = (0.2, 0.3, 1.0), -0.35, 0.5
    level = half[0] ** 2 + half[2] ** 2  # r^2; about the edge (4/3) m r^2
    pull = 0.75 * GRAVITY / level
    (angle, _), _ = integrated(lambda q, v: -pull * _turned(q, -half[0], half[2])[0], (lean, 0.0), time)
    box = _box(half, 1.0, _lifted(*_turned(lean, -half[0], half[2]), lean))
    return Case((_floor(), box), 5.0, time, np.array(_lifted(*_turned(angle, -half[0], half[2]), angle)))


def _on_hill(angle: float) -> tuple[float, float, float]:
    return _heading((APART * math.sin(angle), 0.0, APART * math.cos(angle)))


def _hill(start: float) -> tuple[Body, ...]:
    return _fixed(Sphere(1.0)), _ball(_on_hill(start))


def _place(place: tuple[float, float, float]) -> Array:
    return np.array([*place, math.nan, math.nan, math.nan, math.nan])


def _load(angle: float, spin: float) -> float:
    return GRAVITY * math.cos(angle) - APART * spin**2


def _flown(state: tuple[float, float], left: float) -> Array:
    angle, spin = state
    x, z = APART * math.sin(angle), APART * math.cos(angle)
    vx, vz = APART * spin * math.cos(angle), -APART * spin * math.sin(angle)
    return _place(_heading((x + vx * left, 0.0, z + vz * left - 0.5 * GRAVITY * left**2)))


def rolling_hill() -> Case:
    """A sphere rolls off a sphere."""
    (angle, _), _ = integrated(lambda q, v: GRAVITY * math.sin(q) / ((1.0 + ROUND) * APART), (0.1, 0.0), 0.5)
    return Case(_hill(0.1), 5.0, 0.5, _place(_on_hill(angle)))


def leaving_hill() -> Case:
    """A smooth sphere slides off a sphere and leaves it."""
    state, left = integrated(lambda q, v: GRAVITY * math.sin(q) / APART, (0.3, 0.0), 0.8, _load)
    return Case(_hill(0.3), 0.0, 0.8, _flown(state, left))


def slipping_hill() -> Case:
    """A sphere rolls on a sphere, slips, leaves it: three kinds of motion."""
    mu, time = 0.3, 0.9

    def grip(q: float, v: float) -> float:
        return mu * _load(q, v) - GRAVITY * math.sin(q) * ROUND / (1.0 + ROUND)

    state, left = integrated(lambda q, v: GRAVITY * math.sin(q) / ((1.0 + ROUND) * APART), (0.3, 0.0), time, grip)
    state, left = integrated(lambda q, v: (GRAVITY * math.sin(q) - mu * _load(q, v)) / APART, state, left, _load)
    return Case(_hill(0.3), mu, time, _flown(state, left))


def board_on_log(time: float = 1.0) -> Case:
    """A board rocks on a fixed capsule without slip: its centre is r q along its tangent from where it touches."""
    r, half = 0.5, (1.0, 0.4, 0.05)
    inertia = (half[0] ** 2 + half[2] ** 2) / 3.0

    def rate(q: float, v: float) -> float:
        mass = r * r * q * q + half[2] ** 2 + inertia
        pull = r * q * math.cos(q) - half[2] * math.sin(q)
        return (-(r * r) * q * v * v - GRAVITY * pull) / mass

    (angle, _), _ = integrated(rate, (0.0, 1.0), time)
    x, z = _turned(angle, r * angle, r + half[2])
    across = 0.5 * (HEADING + 0.5 * math.pi)
    log = _fixed(Capsule(2.0, r), (0.0, 0.0, 0.0, math.cos(across), 0.0, 0.0, math.sin(across)))
    board = _box(half, 1.0, _lifted(0.0, r + half[2], 0.0), _twist(-half[2], 0.0, 1.0))
    return Case((log, board), 5.0, time, np.array(_lifted(x, z, angle)))


def rocking_block() -> Case:
    """A block rocks from edge to edge, twice; each impact leaves 1 - (3/2) sin^2(alpha) of its spin (E56)."""
    half, lean, left = (0.25, 0.4, 1.0), 0.1, 1.6
    slender, size = math.atan2(half[0], half[2]), math.hypot(half[0], half[2])
    kept, side, state = 1.0 - 1.5 * math.sin(slender) ** 2, 1.0, (lean, 0.0)
    while left > 0.0:
        state, left = integrated(
            lambda q, v: -0.75 * GRAVITY / size * math.sin(slender - q), state, left, lambda q, v: q
        )
        if left > 0.0:
            side, state = -side, (0.0, -kept * state[1])
    angle = side * state[0]

    def place(q: float, corner: float) -> tuple[float, float]:
        x, z = _turned(q, -corner * half[0], half[2])
        return corner * half[0] + x, z

    box = _box(half, 1.0, _lifted(*place(lean, -1.0), lean))
    return Case((_floor(), box), 5.0, 1.6, np.array(_lifted(*place(angle, -1.0 if side > 0.0 else 1.0), angle)))


def two_boxes() -> Case:
    """Two stacked boxes tip as one about an edge: sticking faces of four corners on an edge of two."""
    half, masses, lean, time = (0.2, 0.3, 0.5), (1.0, 2.0), -0.35, 0.5
    levers = ((-half[0], half[2]), (-half[0], 3.0 * half[2]))
    inertia = sum(
        m * ((half[0] ** 2 + half[2] ** 2) / 3.0 + x * x + z * z) for m, (x, z) in zip(masses, levers, strict=True)
    )

    def rate(q: float, v: float) -> float:
        return -GRAVITY / inertia * sum(m * _turned(q, *lever)[0] for m, lever in zip(masses, levers, strict=True))

    (angle, _), _ = integrated(rate, (lean, 0.0), time)
    boxes = [_box(half, m, _lifted(*_turned(lean, *lever), lean)) for m, lever in zip(masses, levers, strict=True)]
    return Case((_floor(), *boxes), 3.0, time, np.array(_lifted(*_turned(angle, *levers[1]), angle)))


def top() -> Case:
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
    steps = round(time / TRUE_STEP)
    for _ in range(steps):
        k1 = rate(state)
        k2 = rate(state + 0.5 * TRUE_STEP * k1)
        k3 = rate(state + 0.5 * TRUE_STEP * k2)
        k4 = rate(state + TRUE_STEP * k3)
        state = state + TRUE_STEP / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
    end = state[:4] / np.linalg.norm(state[:4])
    w = start @ spin
    box = _box(tuple(half), mass, (*(start @ half), *q), (*np.cross(w, start @ half), *w))
    return Case((_floor(), box), 5.0, time, np.array([*(rotation_matrix(end) @ half), *end]))


CASES: dict[str, Callable[[], Case]] = {
    "box pivoting on an edge": pivot,
    "sphere rolling off a sphere": rolling_hill,
    "smooth sphere leaving a sphere": leaving_hill,
    "sphere rolling, slipping, leaving": slipping_hill,
    "board rocking on a capsule": board_on_log,
    "rocking block, two impacts": rocking_block,
    "two boxes tipping as one": two_boxes,
    "box spinning on a corner": top,
}

#: Cases without events.
SMOOTH = (
    "box pivoting on an edge",
    "sphere rolling off a sphere",
    "board rocking on a capsule",
    "two boxes tipping as one",
    "box spinning on a corner",
)


@cache
def case(name: str) -> Case:
    """Return one case with its truth."""
    return CASES[name]()


def errors(name: str) -> Iterator[Gate]:
    """Yield the error of one case at 1/60 and 1/240 s."""
    for rate, allowed in ALLOWED.items():
        yield Gate.at_most("turning contact [m, rad]", f"{name}, 1/{rate}", case(name).error(rate), allowed, "spatial")


def order(name: str) -> Iterator[Gate]:
    """Yield the observed order of one case; errors below `HELD_BELOW` pass it."""
    found = fitted(tuple(case(name).error(rate) for rate in RATES), floor=HELD_BELOW)
    measured = math.inf if found is None else found
    yield Gate.at_least("turning contact: observed order", name, measured, ORDER, "spatial")


def impulse_order(name: str) -> Iterator[Gate]:
    """Yield the observed order of the impulse-level scheme in one case."""
    found = fitted(tuple(case(name).error(rate, "midpoint") for rate in RATES))
    measured = math.inf if found is None else found
    yield Gate.at_least("impulse-level scheme: observed order", name, measured, IMPULSE_ORDER, "spatial")


def gates() -> Iterator[Gate]:
    """Yield all rows."""
    for name in SMOOTH:
        yield from impulse_order(name)
    for name in CASES:
        yield from errors(name)
        yield from order(name)
