"""Bodies that fall over and come to rest: three dominoes, and a block that rocks until it rests (E22)."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from functools import cache, partial

import numpy as np

from reference_solver.model import Array, Body, Model
from reference_solver.settings import TOLERANCE, Settings
from reference_solver.shapes import Box, HalfSpace
from reference_solver.simulation import Simulation
from tests.verification import runge_kutta
from tests.verification.gate import Gate
from tests.verification.space import GRAVITY
from tests.verification.turning_scenes import PLANE, rocking_block

#: Largest error [m, rad]: ten steps for each of seventy impacts may each err by the tolerance of the motion in them.
ALLOWED = 1e3 * TOLERANCE

#: Half width and half height of a domino, distance of two, its mass, and the lean of the first at the start [m, kg,
#: rad]: past its balance at .197 rad, it falls.
WIDTH, HEIGHT, APART, MASS, LEAN = 0.1, 0.5, 0.6, 1.0, 0.25
#: Friction of the floor; faces of dominoes are smooth. None slips or lifts its foot: all needed is below 1.5.
GRIP = 5.0
#: Length of the run [s], in which the first strikes the second and that the third.
FALL = 1.2
#: Step of the independent integration [s]: Runge and Kutta's fourth-order method leaves 1e-12.
TRUE_STEP = 2.5e-4


def gates() -> Iterator[Gate]:
    """Yield all rows."""
    yield from dominoes()
    yield from rocking()


def rocking(times: Sequence[float] = (3.0, 8.0)) -> Iterator[Gate]:
    """Yield how a block rocks, and where it is when that has died out after some 70 impacts."""
    for time in times:
        off = rocking_block(PLANE, time).error()
        yield Gate.at_most("rocking: error [m, rad]", f"{time:g} s", off, ALLOWED, "planar")


def dominoes() -> Iterator[Gate]:
    """Yield where three dominoes are when the third has been struck."""
    off = float(np.abs(fallen() - toppled()).max())
    yield Gate.at_most("three dominoes: error [rad]", f"{FALL:g} s", off, ALLOWED, "planar")


def row_of_dominoes() -> Model:
    """Return a floor and three dominoes, the first of which leans over its right foot."""
    inertia = MASS * (WIDTH**2 + HEIGHT**2) / 3.0
    bodies = [Body(HalfSpace((0.0, 1.0)), motion="fixed")]
    for i, lean in enumerate((LEAN, 0.0, 0.0)):
        x, y = _centre(lean)
        bodies.append(Body(Box((WIDTH, HEIGHT)), MASS, inertia, (APART * i + x, y, -lean)))
    friction = np.zeros((4, 4))
    friction[0, :] = friction[:, 0] = GRIP
    return Model(2, bodies, (0.0, -GRAVITY), 0.0, friction)


def fallen() -> Array:
    """Leans (3,) of the dominoes at the end [rad], by the solver."""
    simulation = Simulation(row_of_dominoes(), Settings.reference(FALL))
    simulation.advance(1)
    return -simulation.pose[1:, 2]


def _centre(lean: float) -> tuple[float, float]:
    """Where the centre of a domino is from its right foot, about which it has turned clockwise by ``lean``."""
    c, s = math.cos(lean), math.sin(lean)
    return -WIDTH * c + HEIGHT * s, WIDTH * s + HEIGHT * c


def _gap(first: float, second: float) -> float:
    """Distance of the first's upper corner from the second's left face, by their leans [m]."""
    return APART * math.cos(second) - 2.0 * WIDTH - 2.0 * HEIGHT * math.sin(first - second)


def _row(lean: Array, i: int) -> Array:
    """Derivatives (3,) of gap i by the leans [m]."""
    s, row = lean[i] - lean[i + 1], np.zeros(3)
    row[i] = -2.0 * HEIGHT * math.cos(s)
    row[i + 1] = 2.0 * HEIGHT * math.cos(s) - APART * math.sin(lean[i + 1])
    return row


def _bend(lean: Array, rate: Array, i: int) -> float:
    """Second derivative of gap i at constant rates [m/s^2]."""
    along = 2.0 * HEIGHT * math.sin(lean[i] - lean[i + 1]) * (rate[i] - rate[i + 1]) ** 2
    return float(along - APART * math.cos(lean[i + 1]) * rate[i + 1] ** 2)


def _pushed(rows: list[Array], right: list[float], inertia: float) -> tuple[Array, bool]:
    """Forces (m,) with which rows . (effect) = right, and whether none of them pulls."""
    if not rows:
        return np.zeros(0), True
    matrix = np.array(rows)
    found = np.linalg.solve(matrix @ matrix.T / inertia, np.array(right))
    return found, bool((found >= 0.0).all())


def _acceleration(touching: tuple[int, ...], inertia: float, lean: Array, rate: Array) -> Array:
    """Accelerations (3,) of the leans [rad/s^2]. A domino that stands has its other foot to stand on.

    Raises
    ------
    ArithmeticError
        If a contact that is held pulls.
    """
    torque = MASS * GRAVITY * (HEIGHT * np.sin(lean) - WIDTH * np.cos(lean))
    torque = np.where((lean <= 0.0) & (rate == 0.0), 0.0, torque)
    rows = [_row(lean, i) for i in touching]
    right = [-float(row @ torque) / inertia - _bend(lean, rate, i) for row, i in zip(rows, touching, strict=True)]
    force, pushes = _pushed(rows, right, inertia)
    if not pushes:
        raise ArithmeticError("a contact of the dominoes pulls")
    gained: Array = torque + sum((f * row for f, row in zip(force, rows, strict=True)), np.zeros(3))
    return gained / inertia


def _apart(touching: tuple[int, ...], state: tuple[Array, Array]) -> float:
    """Least gap of those that are not held [m]."""
    lean, _ = state
    return min((_gap(lean[i], lean[i + 1]) for i in range(2) if i not in touching), default=math.inf)


def _struck(lean: Array, rate: Array, closed: tuple[int, ...], inertia: float) -> tuple[Array, tuple[int, ...]]:
    """Rates after an impact with e = 0 of all contacts that are closed, and which of them stay: no impulse pulls."""
    rows = {i: _row(lean, i) for i in closed}
    for size in range(len(closed) + 1):
        for kept in itertools.combinations(closed, size):
            impulse, pushes = _pushed([rows[i] for i in kept], [-float(rows[i] @ rate) for i in kept], inertia)
            gained = sum((p * rows[i] for p, i in zip(impulse, kept, strict=True)), np.zeros(3)) / inertia
            after = rate + gained
            if pushes and all(rows[i] @ after >= -1e-12 for i in closed):
                return after, kept
    raise ArithmeticError("no impulses keep the dominoes apart")


@cache
def toppled() -> Array:
    """Leans (3,) of the dominoes at the end [rad], by an integration of their three leans about their right feet.

    Raises
    ------
    ArithmeticError
        If a contact is found to pull: the case is made so that none does between impacts.
    """
    inertia = MASS * 4.0 / 3.0 * (WIDTH**2 + HEIGHT**2)
    lean, rate, left = np.array([LEAN, 0.0, 0.0]), np.zeros(3), FALL
    touching: tuple[int, ...] = ()
    while left > 0.0:
        step = partial(runge_kutta.move, partial(_acceleration, touching, inertia))
        state, left = runge_kutta.integrated(step, (lean, rate), left, TRUE_STEP, partial(_apart, touching))
        lean, rate = state
        if left > 0.0:
            closed = tuple(i for i in range(2) if i in touching or _gap(lean[i], lean[i + 1]) <= 1e-12)
            rate, touching = _struck(lean, rate, closed, inertia)
    return lean
