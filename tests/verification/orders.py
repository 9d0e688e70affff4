"""Observed orders: how the error of a scheme falls with its step, largest over the phases of the step grid (E74).

Where an event falls inside a step is chance. Each error is therefore the largest of `PHASES` runs whose starts differ
by fractions of what a body moves in one step, and the order is the slope of its logarithm over that of the step.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np

from reference_solver.model import Array, Body
from reference_solver.settings import Settings
from tests.verification import runge_kutta
from tests.verification.rotation import angle_between, tumbled, tumbling
from tests.verification.space import GRAVITY, ROUNDNESS, SPACES, Space, made_by

#: Steps per second, halving the step from one to the next.
RATES = (60, 120, 240, 480, 960)
PHASES = 16
#: Profiles whose errors fall with the step: those of the event loop fall with its tolerance (`turning`).
PROFILES = ("classical", "fixed_step")
#: Errors that do not fall below this, or never rise above it, are round-off [m, rad]: positions are of order one and
#: a thousand steps round each coordinate once.
ROUND_OFF = 1e-12
#: Time for which the body tumbles [s]. About the middle axis disturbances grow tenfold in 1.6 s: by then round-off is
#: 2e-13 rad, after 10 s it would be 1e-10.
TUMBLED = 6.0


@dataclass(frozen=True)
class Order:
    """Errors of one scheme in one case.

    Parameters
    ----------
    case
        What moves, and what its error is measured in.
    made_by
        Profile and dimension.
    rates
        Steps per second [1/s].
    errors
        Largest error over the phases at each rate [m, rad].
    order
        Fitted slope; None where all errors are round-off.
    """

    case: str
    made_by: str
    rates: tuple[int, ...]
    errors: tuple[float, ...]
    order: float | None


def fitted(errors: tuple[float, ...]) -> float | None:
    """Least-squares slope of log error over log step, over the errors above round-off; None of fewer than two."""
    both = zip(RATES, errors, strict=True)
    kept = [(-math.log(rate), math.log(error)) for rate, error in both if error > ROUND_OFF]
    if len(kept) < 2:
        return None
    x, y = (np.array(values) for values in zip(*kept, strict=True))
    return float(((x - x.mean()) * (y - y.mean())).sum() / ((x - x.mean()) ** 2).sum())


def orders() -> Iterator[Order]:
    """Yield every case in both dimensions, with every profile."""
    for space in SPACES:
        for case, error in CASES.items():
            for profile in PROFILES:
                yield observed(case, error, space, profile)
    for profile in PROFILES:
        yield observed("free rotation [rad]", rotation, SPACES[1], profile)


def observed(case: str, error: Callable[[Space, Settings, float], float], space: Space, profile: str) -> Order:
    """Return the order of one case."""
    errors = []
    for rate in RATES:
        settings = getattr(Settings, profile)(1.0 / rate)
        errors.append(max(error(space, settings, phase / PHASES) for phase in range(PHASES)))
    return Order(case, made_by(space, profile), RATES, tuple(errors), fitted(tuple(errors)))


def place_at(space: Space, settings: Settings, bodies: list[Body], time: float, e: float, mu: float) -> Array:
    """Position of the last body after ``time`` [m], in this plane."""
    simulation = space.simulation(bodies, settings, GRAVITY, e, mu)
    simulation.advance(round(time / settings.dt))
    place: Array = simulation.pose[-1, [0, space.up]]
    return place


def flight(space: Space, settings: Settings, phase: float) -> float:
    """Error after one second of free flight."""
    speed = 3.0 + phase * GRAVITY * settings.dt
    ball = space.ball(0.0, 5.0, space.twist(1.0, speed))
    truth = np.array([1.0, 5.0 + speed - 0.5 * GRAVITY])
    return float(np.abs(place_at(space, settings, [ball], 1.0, 0.0, 0.0) - truth).max())


def bounced(height: float, restitution: float, time: float) -> float:
    """Height of a ball over the floor some time after it was dropped (O1, O16) [m]."""
    speed, left = math.sqrt(2.0 * GRAVITY * height), time - math.sqrt(2.0 * height / GRAVITY)
    if left < 0.0:
        return height - 0.5 * GRAVITY * time * time
    while True:
        speed *= restitution
        if left <= 2.0 * speed / GRAVITY:
            return speed * left - 0.5 * GRAVITY * left * left
        left -= 2.0 * speed / GRAVITY


def bounce(space: Space, settings: Settings, phase: float) -> float:
    """Error of a ball that has bounced twice (e = .8, from 1 m, after 1.7 s)."""
    height = 1.0 + phase * math.sqrt(2.0 * GRAVITY) * settings.dt
    bodies = [space.floor(), space.ball(0.0, 0.5 + height)]
    reached = place_at(space, settings, bodies, 1.7, 0.8, 0.0)[1] - 0.5
    return abs(float(reached) - bounced(height, 0.8, 1.7))


def slide_to_stop(space: Space, settings: Settings, phase: float) -> float:
    """Error of the distance in which a box slides to rest (E71)."""
    speed = 3.0 + phase * 0.5 * GRAVITY * settings.dt
    bodies = [space.floor(), space.box(0.0, 0.25, space.twist(speed), half=(1.0, 0.25))]
    reached = place_at(space, settings, bodies, 0.75, 0.0, 0.5)[0]
    return abs(float(reached) - speed**2 / (2.0 * 0.5 * GRAVITY))


def slide_to_roll(space: Space, settings: Settings, phase: float) -> float:
    """Error of a ball that slides until it rolls, half a second after it was set down (E71)."""
    speed, friction, k = 3.0 + phase * 0.2 * GRAVITY * settings.dt, 0.3, ROUNDNESS[space.dimension]
    bodies = [space.floor(), space.ball(0.0, 0.5, space.twist(speed))]
    reached = place_at(space, settings, bodies, 0.5, 0.0, friction)[0]
    rolls, slides = speed / (1.0 + k), speed * k / ((1.0 + k) * friction * GRAVITY)
    return abs(float(reached) - (rolls * 0.5 + 0.5 * (speed - rolls) * slides))


def rolling(space: Space, settings: Settings, phase: float) -> float:
    """Error of a ball that rolls down a slope of 20 degrees from rest, after one second."""
    lean, start = math.radians(20.0), phase * 0.1
    k, speed = ROUNDNESS[space.dimension], start
    ball = space.ball(0.0, 0.5, space.twist(speed, 0.0, -speed / 0.5))
    simulation = space.simulation([space.floor(), ball], settings, GRAVITY, 0.0, 0.5, lean)
    simulation.advance(round(1.0 / settings.dt))
    truth = speed + 0.5 * GRAVITY * math.sin(lean) / (1.0 + k)
    return abs(float(simulation.pose[1, 0]) - truth)


#: A ball of half a metre on top of a fixed one of two metres: angle at the start [rad], time until it is compared [s].
HILL, LEAN, ROLLED = 2.0, 0.2, 0.75


@cache
def hill_angle(dimension: int, lean: float, steps: int = 3000) -> float:
    """Angle after `ROLLED` of a ball that rolls off a round hill, `x'' = g sin x / ((1 + k)(R + r))` (E74) [rad].

    By the classical fourth-order Runge-Kutta method: in steps of .25 ms its error is 1e-15.
    """
    rate = GRAVITY / ((1.0 + ROUNDNESS[dimension]) * (HILL + 0.5))
    state = (lean, 0.0)
    for _ in range(steps):
        state = runge_kutta.move(lambda angle, _: rate * math.sin(angle), state, ROLLED / steps)
    return state[0]


def rolling_off(space: Space, settings: Settings, phase: float) -> float:
    """Error of a ball that rolls, without slip, off the top of a round hill: a contact whose normal turns."""
    lean = LEAN * (1.0 + 0.1 * phase)
    hill = space.ball(0.0, 0.0, radius=HILL)
    fixed = Body(hill.shape, pose=hill.pose, motion="fixed")
    ball = space.ball((HILL + 0.5) * math.sin(lean), (HILL + 0.5) * math.cos(lean))
    reached = place_at(space, settings, [fixed, ball], ROLLED, 0.0, 2.0)
    return abs(math.atan2(reached[0], reached[1]) - hill_angle(space.dimension, lean)) * (HILL + 0.5)


@cache
def _tumbled(end: float) -> Array:
    return tumbled(end)


def rotation(space: Space, settings: Settings, phase: float) -> float:
    """Error of the orientation of a tumbling body after `TUMBLED`, which has no events and so no phases [rad]."""
    if phase > 0.0:
        return 0.0
    simulation = tumbling(settings)
    simulation.advance(round(TUMBLED / settings.dt))
    return angle_between(simulation.pose[0, 3:], _tumbled(TUMBLED))


CASES: dict[str, Callable[[Space, Settings, float], float]] = {
    "free flight [m]": flight,
    "bounce, e = .8 [m]": bounce,
    "slide to stop [m]": slide_to_stop,
    "slide to roll [m]": slide_to_roll,
    "rolling down a slope [m]": rolling,
    "rolling off a round hill [m]": rolling_off,
}
