"""Gates of Coulomb friction: no creep below the limit, slides as the law says, and their end."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np

from reference_solver.settings import Settings
from tests.verification.gate import Gate
from tests.verification.space import GRAVITY, ROUNDNESS, SPACES, Space, made_by

STEPS = (1 / 60, 1 / 240, 1 / 960)


def gates() -> Iterator[Gate]:
    """Yield every row of friction."""
    for space in SPACES:
        yield from creep(space)
        yield from sliding(space)
        yield from slide_to_roll(space)
        yield from stopping(space)
        yield from time_to_roll(space)


def creep(space: Space, friction: float = 0.5, steps: int = 10_000) -> Iterator[Gate]:
    """A box at .999 of the friction limit stands: under gravity that leans, and on a floor that does."""
    lean = math.atan(0.999 * friction)
    half = (0.5, 0.25)
    for case in ("gravity leans", "floor leans"):
        turned = lean if case == "floor leans" else 0.0
        place = (-half[1] * math.sin(turned), half[1] * math.cos(turned))
        box = space.box(*place, half=half, angle=turned)
        bodies, tilt = [space.floor(turned), box], 0.0 if turned else lean
        simulation = space.simulation(bodies, Settings.reference(1 / 240), GRAVITY, 0.0, friction, tilt)
        record = simulation.record(steps)
        speed = float(np.linalg.norm(record.twist[:, 1, : space.dimension], axis=1).max())
        drift = float(np.linalg.norm((record.pose[-1] - record.pose[0])[1, : space.dimension]))
        name = made_by(space, "reference")
        yield Gate.at_most("creep at .999 of the limit [m/s]", case, speed, 1e-14, name)
        yield Gate.at_most("drift at .999 of the limit [m]", f"{case}, {steps} steps", drift, 1e-12, name)


def sliding(space: Space, steps: int = 240) -> Iterator[Gate]:
    """Acceleration down a slope, g (sin - mu cos), of a box that lies flat."""
    worst = 0.0
    for friction, degrees, dt in itertools.product((0.0, 0.1, 0.5), (30.0, 45.0, 60.0), STEPS):
        lean = math.radians(degrees)
        box = space.box(0.0, 0.25, half=(1.0, 0.25))  # flat enough not to tip at any of these slopes
        simulation = space.simulation([space.floor(), box], Settings.reference(dt), GRAVITY, 0.0, friction, lean)
        simulation.advance(steps)
        truth = GRAVITY * (math.sin(lean) - friction * math.cos(lean))
        worst = max(worst, abs(simulation.twist[1, 0] / (steps * dt) / truth - 1.0))
    yield Gate.at_most(
        "sliding acceleration, relative", "30..60 degrees, any dt", worst, 1e-12, made_by(space, "reference")
    )


def slide_to_roll(space: Space, speed: float = 3.0, friction: float = 0.2) -> Iterator[Gate]:
    """A ball set down sliding rolls with v / (1 + k): angular momentum about the contact is kept, at any step."""
    k, worst = ROUNDNESS[space.dimension], 0.0
    for dt in (1 / 30, *STEPS):
        ball = space.ball(0.0, 0.5, space.twist(speed))
        simulation = space.simulation([space.floor(), ball], Settings.reference(dt), GRAVITY, 0.0, friction)
        simulation.advance(math.ceil(1.0 / dt))
        twist = simulation.twist[1]
        rolls, spins = speed / (1.0 + k), -speed / (1.0 + k) / 0.5
        worst = max(worst, abs(twist[0] / rolls - 1.0), abs(float(space.spin(twist)) / spins - 1.0))
    yield Gate.at_most("slide to roll: speed, relative", "dt 1/30..1/960", worst, 1e-12, made_by(space, "reference"))


def stopping(space: Space, speed: float = 3.0, friction: float = 0.5) -> Iterator[Gate]:
    """Distance in which a box slides to rest, v^2 / (2 mu g), where the end of the slide falls inside a step."""
    worst = 0.0
    for dt, phase in itertools.product(STEPS, (0.0, 0.31, 0.77)):
        v = speed + phase * friction * GRAVITY * dt
        box = space.box(0.0, 0.25, space.twist(v), half=(1.0, 0.25))
        simulation = space.simulation([space.floor(), box], Settings.reference(dt), GRAVITY, 0.0, friction)
        simulation.advance(math.ceil(v / (friction * GRAVITY) / dt) + 2)
        worst = max(worst, abs(simulation.pose[1, 0] / (v * v / (2.0 * friction * GRAVITY)) - 1.0))
    yield Gate.at_most("stopping distance, relative", "any dt and phase", worst, 1e-10, made_by(space, "reference"))


def time_to_roll(space: Space, speed: float = 3.0, friction: float = 0.2) -> Iterator[Gate]:
    """Time until a sliding ball rolls, v k / ((1 + k) mu g), from how far it has come some time later.

    With the mean speed (v + w) / 2 until then and w = v / (1 + k) afterwards, x = w t + (v - w) t_roll / 2.
    """
    k, worst = ROUNDNESS[space.dimension], 0.0
    rolls, truth = speed / (1.0 + k), speed * k / ((1.0 + k) * friction * GRAVITY)
    for dt in STEPS:
        ball = space.ball(0.0, 0.5, space.twist(speed))
        simulation = space.simulation([space.floor(), ball], Settings.reference(dt), GRAVITY, 0.0, friction)
        steps = math.ceil(truth / dt) + 2
        simulation.advance(steps)
        measured = 2.0 * (simulation.pose[1, 0] - rolls * steps * dt) / (speed - rolls)
        worst = max(worst, abs(measured / truth - 1.0))
    yield Gate.at_most("time to roll, relative", "any dt", worst, 1e-10, made_by(space, "reference"))
