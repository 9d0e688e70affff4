"""Planar contacts that turn, against ordinary differential equations of one coordinate with events (E75).

Each scene has one degree of freedom at a time, so that its truth needs no contact problem: with the pose x(q) of every
body, ``M(q) q'' = -M'(q) q'^2 / 2 - V'(q)``, or the force balance along a given path where friction slides.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from reference_solver.certification import Gate
from reference_solver.certification.orders import RATES, fitted
from reference_solver.certification.space import GRAVITY
from reference_solver.model import Array, Body, Model
from reference_solver.settings import Scheme, Settings
from reference_solver.shapes import Box, Disc, HalfSpace
from reference_solver.simulation import Simulation

#: Step of the classical Runge-Kutta method [s]: its error is 1e-14 of the motion in all cases.
TRUE_STEP = 1.25e-4
#: Largest error at 60 and at 240 steps a second [m, rad].
ALLOWED = {60: 1e-8, 240: 1e-10}
#: Least observed order, of the fifth-order scheme and of the impulse-level scheme on cases without events.
ORDER, IMPULSE_ORDER = 4.5, 1.9
#: What the control of phase lengths holds errors below, of motions of a metre or a radian (`phase.ERROR`): there they
#: fall no more with the step.
HELD_BELOW = 1e-11
#: Length of the long run of the board [s], and what its energy and amplitude may be off, as shares of their own.
LONG, KEPT = 60.0, 1e-8

#: Spin of a block that rocks no more [rad/s].
AT_REST = 1e-9

State = tuple[float, float]
Rate = Callable[[float, float], float]


def integrated(rate: Rate, state: State, time: float, until: Rate | None = None) -> tuple[State, float]:
    """Return (q, q') after ``time``, or where ``until(q, q')`` falls below zero before, and what is left of the time.

    The event is found by halving the length of the step in which it falls.
    """
    left = time
    while left > 0.0:
        length = min(TRUE_STEP, left)
        after = _step(rate, state, length)
        if until is not None and until(*after) < 0.0:
            low, high = 0.0, length
            while low < 0.5 * (low + high) < high:
                middle = 0.5 * (low + high)
                low, high = (low, middle) if until(*_step(rate, state, middle)) < 0.0 else (middle, high)
            return _step(rate, state, high), left - high
        state, left = after, left - length
    return state, 0.0


def _step(rate: Rate, state: State, h: float) -> State:
    q, v = state
    k1, l1 = v, rate(q, v)
    k2, l2 = v + 0.5 * h * l1, rate(q + 0.5 * h * k1, v + 0.5 * h * l1)
    k3, l3 = v + 0.5 * h * l2, rate(q + 0.5 * h * k2, v + 0.5 * h * l2)
    k4, l4 = v + h * l3, rate(q + h * k3, v + h * l3)
    return q + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4), v + h / 6.0 * (l1 + 2.0 * (l2 + l3) + l4)


@dataclass(frozen=True)
class Case:
    """A scene and where its last body is in the end.

    Parameters
    ----------
    bodies, friction, time
        All at rest or moving as their constraints allow; e = 0; time in seconds.
    truth
        (x, y) or (x, y, angle) of the last body [m, rad].
    """

    bodies: tuple[Body, ...]
    friction: float
    time: float
    truth: tuple[float, ...]

    def model(self) -> Model:
        """Return the scene."""
        return Model(2, list(self.bodies), (0.0, -GRAVITY), 0.0, self.friction)

    def error(self, rate: int, scheme: Scheme = "located") -> float:
        """Largest difference from the truth at ``rate`` steps a second [m, rad]."""
        simulation = Simulation(self.model(), replace(Settings.reference(1.0 / rate), scheme=scheme))
        simulation.advance(round(self.time * rate))
        return float(np.abs(simulation.pose[-1, : len(self.truth)] - self.truth).max())


def _floor() -> Body:
    return Body(HalfSpace((0.0, 1.0)), motion="fixed")


def _box(half: tuple[float, float], mass: float, pose: tuple[float, float, float], twist: Array | None = None) -> Body:
    inertia = mass * (half[0] ** 2 + half[1] ** 2) / 3.0
    return Body(Box(half), mass, inertia, pose, tuple(twist) if twist is not None else (0.0, 0.0, 0.0))


def _turned(angle: float, x: float, y: float) -> tuple[float, float]:
    return math.cos(angle) * x - math.sin(angle) * y, math.sin(angle) * x + math.cos(angle) * y


def pivot() -> Case:
    """A box that falls over about a corner that sticks, from .35 rad."""
    half, lean, time = (0.2, 1.0), -0.35, 0.5
    level = half[0] ** 2 + half[1] ** 2  # r^2; about the corner (4/3) m r^2
    pull = 0.75 * GRAVITY / level
    (angle, _), _ = integrated(lambda q, v: -pull * _turned(q, -half[0], half[1])[0], (lean, 0.0), time)
    start = _turned(lean, -half[0], half[1])
    return Case((_floor(), _box(half, 1.0, (*start, lean))), 5.0, time, (*_turned(angle, -half[0], half[1]), angle))


#: A fixed disc of one metre and one of .3 m on it: distance of their centres [m].
APART = 1.3


def _on_hill(angle: float) -> tuple[float, float]:
    return APART * math.sin(angle), APART * math.cos(angle)


def _hill(start: float) -> tuple[Body, ...]:
    return Body(Disc(1.0), motion="fixed"), Body(Disc(0.3), 1.0, 0.045, (*_on_hill(start), 0.0))


def _load(angle: float, spin: float) -> float:
    return GRAVITY * math.cos(angle) - APART * spin**2


def _flown(state: State, left: float) -> tuple[float, float]:
    angle, spin = state
    x, y = _on_hill(angle)
    vx, vy = APART * spin * math.cos(angle), -APART * spin * math.sin(angle)
    return x + vx * left, y + vy * left - 0.5 * GRAVITY * left**2


def rolling_hill() -> Case:
    """A disc rolls off a disc."""
    (angle, _), _ = integrated(lambda q, v: GRAVITY * math.sin(q) / (1.5 * APART), (0.1, 0.0), 0.5)
    return Case(_hill(0.1), 5.0, 0.5, _on_hill(angle))


def leaving_hill() -> Case:
    """A smooth disc slides off a disc and leaves it."""
    state, left = integrated(lambda q, v: GRAVITY * math.sin(q) / APART, (0.3, 0.0), 0.8, _load)
    return Case(_hill(0.3), 0.0, 0.8, _flown(state, left))


def slipping_hill() -> Case:
    """A disc rolls on a disc, slips, leaves it: three kinds of motion."""
    mu, time = 0.3, 0.9

    def grip(q: float, v: float) -> float:
        return mu * _load(q, v) - GRAVITY * math.sin(q) / 3.0

    state, left = integrated(lambda q, v: GRAVITY * math.sin(q) / (1.5 * APART), (0.3, 0.0), time, grip)
    state, left = integrated(lambda q, v: (GRAVITY * math.sin(q) - mu * _load(q, v)) / APART, state, left, _load)
    return Case(_hill(0.3), mu, time, _flown(state, left))


def board_on_log(time: float = 2.0) -> Case:
    """A board rocks on a fixed log without slip: its centre is r q along its tangent from where it touches."""
    r, half = 0.5, (1.0, 0.05)
    inertia = (half[0] ** 2 + half[1] ** 2) / 3.0

    def rate(q: float, v: float) -> float:
        mass = r * r * q * q + half[1] ** 2 + inertia
        pull = r * q * math.cos(q) - half[1] * math.sin(q)
        return (-(r * r) * q * v * v - GRAVITY * pull) / mass

    (angle, _), _ = integrated(rate, (0.0, 1.0), time)
    place = _turned(angle, r * angle, r + half[1])
    board = _box(half, 1.0, (0.0, r + half[1], 0.0), np.array([-half[1], 0.0, 1.0]))
    return Case((Body(Disc(r), motion="fixed"), board), 5.0, time, (*place, angle))


def ladder() -> Case:
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
    bodies = (Body(HalfSpace((1.0, 0.0)), motion="fixed"), _floor(), _box(half, 1.0, (*place(lean), lean)))
    return Case(bodies, 0.0, time, (*place(angle), angle))


def rocking_block(time: float = 1.6) -> Case:
    """A block rocks from corner to corner; each impact leaves 1 - (3/2) sin^2(alpha) of its spin (E56).

    What is left of impacts at less than `AT_REST` is less than that in all: it rests then.
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

    start = place(lean, -1.0)
    truth = place(angle, -1.0 if side > 0.0 else 1.0)
    return Case((_floor(), _box(half, 1.0, (*start, lean))), 5.0, time, (*truth, angle))


def two_boxes() -> Case:
    """Two stacked boxes tip as one about a corner: four rows of sticking faces, one of them redundant."""
    half, masses, lean, time = (0.2, 0.5), (1.0, 2.0), -0.35, 0.6
    levers = ((-half[0], half[1]), (-half[0], 3.0 * half[1]))
    inertia = sum(
        m * ((half[0] ** 2 + half[1] ** 2) / 3.0 + x * x + y * y) for m, (x, y) in zip(masses, levers, strict=True)
    )

    def rate(q: float, v: float) -> float:
        return -GRAVITY / inertia * sum(m * _turned(q, *lever)[0] for m, lever in zip(masses, levers, strict=True))

    (angle, _), _ = integrated(rate, (lean, 0.0), time)
    boxes = [_box(half, m, (*_turned(lean, *lever), lean)) for m, lever in zip(masses, levers, strict=True)]
    return Case((_floor(), *boxes), 3.0, time, (*_turned(angle, *levers[1]), angle))


CASES: dict[str, Callable[[], Case]] = {
    "box pivoting on a corner": pivot,
    "disc rolling off a disc": rolling_hill,
    "smooth disc leaving a disc": leaving_hill,
    "disc rolling, slipping, leaving": slipping_hill,
    "board rocking on a log": board_on_log,
    "beam sliding down a wall": ladder,
    "rocking block, two impacts": rocking_block,
    "two boxes tipping as one": two_boxes,
}


#: Cases without events.
SMOOTH = (
    "box pivoting on a corner",
    "disc rolling off a disc",
    "board rocking on a log",
    "beam sliding down a wall",
    "two boxes tipping as one",
)


@cache
def case(name: str) -> Case:
    """Return one case with its truth."""
    return CASES[name]()


def errors(name: str) -> Iterator[Gate]:
    """Yield the error of one case at 1/60 and 1/240 s."""
    for rate, allowed in ALLOWED.items():
        yield Gate.at_most("turning contact [m, rad]", f"{name}, 1/{rate}", case(name).error(rate), allowed, "planar")


def order(name: str) -> Iterator[Gate]:
    """Yield the observed order of one case; errors below `HELD_BELOW` pass it."""
    found = fitted(tuple(case(name).error(rate) for rate in RATES), floor=HELD_BELOW)
    measured = math.inf if found is None else found
    yield Gate.at_least("turning contact: observed order", name, measured, ORDER, "planar")


def impulse_order(name: str) -> Iterator[Gate]:
    """Yield the observed order of the impulse-level scheme in one case."""
    found = fitted(tuple(case(name).error(rate, "midpoint") for rate in RATES))
    measured = math.inf if found is None else found
    yield Gate.at_least("impulse-level scheme: observed order", name, measured, IMPULSE_ORDER, "planar")


def long_board() -> Iterator[Gate]:
    """Yield what a minute of rocking changes of the energy of the board, and of its amplitude."""
    board = board_on_log(time=0.0)
    simulation = Simulation(board.model(), Settings.reference(1.0 / 240.0))
    record = simulation.record(round(240.0 * LONG), 1)
    body, pose, twist = board.bodies[1], record.pose[:, 1], record.twist[:, 1]
    mass, inertia = float(body.mass), float(np.ravel(np.asarray(body.inertia))[0])
    kinetic = 0.5 * mass * (twist[:, :2] ** 2).sum(axis=1) + 0.5 * inertia * twist[:, 2] ** 2
    energy = kinetic + mass * GRAVITY * (pose[:, 1] - pose[0, 1])
    off = float(np.abs(energy - energy[0]).max() / kinetic[0])
    yield Gate.at_most("board on a log: energy lost or gained in 60 s", "share, 1/240", off, KEPT, "planar")
    # Turning points lie between samples: a polynomial of sixth degree through seven of them is off by 1e-12.
    swings = _peaks(pose[:, 2])
    lost = abs(swings[-1] / swings[0] - 1.0)
    yield Gate.at_most("board on a log: amplitude after 60 s", "share, 1/240", lost, KEPT, "planar")


def _peaks(angle: Array) -> Array:
    """Heights of all maxima, each from the polynomial through seven samples around it."""
    middle = np.flatnonzero((angle[2:-3] > angle[1:-4]) & (angle[2:-3] >= angle[3:-2])) + 2
    middle = middle[angle[middle] > 0.0]
    found = []
    for k in middle:
        t = np.arange(-3.0, 4.0)
        if k < 3 or k + 4 > len(angle):
            continue
        polynomial = np.polynomial.Polynomial.fit(t, angle[k - 3 : k + 4], 6)
        turning = polynomial.deriv().roots()
        inside = turning[(np.abs(turning.imag) < 1e-12) & (np.abs(turning.real) <= 1.0)].real
        found.append(max(float(polynomial(x)) for x in inside))
    return np.array(found)


def gates() -> Iterator[Gate]:
    """Yield all rows."""
    for name in SMOOTH:
        yield from impulse_order(name)
    yield from long_board()
    for name in CASES:
        yield from errors(name)
        yield from order(name)
