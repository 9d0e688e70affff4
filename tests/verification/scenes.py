"""Six small worlds, each with numbers to choose, on which the relations of `relations.py` are measured."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from reference_solver.certificate.relations import turned
from reference_solver.model import Body, Model, Sphere
from tests.verification.rotation import rotation_matrix
from tests.verification.space import GRAVITY, Space

#: Step of all relations [s].
DT = 1 / 240
#: Height from which things fall [m]: no round number of steps at round speeds. Where an impact coincides with a sample
#: round-off decides whether the velocity sampled is the one before or after it.
GAP = 0.0617
#: How far the box on its edge is rolled out of the level in space [rad].
ROLL = 0.2


@dataclass(frozen=True)
class Numbers:
    """What may be chosen: pair values, a speed [m/s], an angle [rad], in space a velocity across the plane [m/s]."""

    restitution: float = 0.6
    friction: float = 0.4
    speed: float = 2.0
    lean: float = 0.3
    across: float = 0.0


@dataclass(frozen=True)
class Scene:
    """A world that `build` makes, and its predictability horizon.

    Parameters
    ----------
    build
        Makes the model from a space and `Numbers`.
    horizon
        Steps of `DT` within which a disturbance of the start grows at most by `GROWTH`.
    """

    build: Callable[[Space, Numbers], Model]
    horizon: int


#: Factor by which a disturbance may grow within a scene's horizon: impacts at an angle, rocking and the return of what
#: bounces multiply it by less than ten, and a gap that one step closes has the speed gap / dt in that step, which is
#: the disturbance times the number of steps before.
GROWTH = 100.0


def model(space: Space, bodies: list[Body], numbers: Numbers, gravity: float = GRAVITY, tilt: float = 0.0) -> Model:
    """Return a model whose gravity leans by ``tilt`` [rad], and whose moving bodies move across the plane as well."""
    pull = space.vector(gravity * math.sin(tilt), -gravity * math.cos(tilt))
    if space.dimension == 3 and numbers.across != 0.0:
        bodies = [_across(body, numbers.across) if any(body.twist or ()) else body for body in bodies]
    e, mu = np.float64(numbers.restitution), np.float64(numbers.friction)
    return Model(space.dimension, bodies, pull, e, mu)


def _across(body: Body, speed: float) -> Body:
    """Add a velocity across the plane, to balls a spin as well.

    A box that turns while it slides on four corners would have no unique answer: what friction brakes its turn depends
    on how the corners share its weight, and that nothing decides.
    """
    twist = np.array(body.twist)
    twist[1] += speed
    if isinstance(body.shape, Sphere):
        twist[[3, 5]] += 0.7 * speed, -0.4 * speed
    return dataclasses.replace(body, twist=tuple(twist))


def impact(space: Space, numbers: Numbers) -> Model:
    """A spinning ball hits the floor at an angle, without gravity."""
    ball = space.ball(0.0, 0.5 + GAP, space.twist(1.5, -numbers.speed, 4.0))
    return model(space, [space.floor(), ball], numbers, gravity=0.0)


def bounce(space: Space, numbers: Numbers) -> Model:
    """A ball bounces twice or more."""
    ball = space.ball(0.0, 0.5 + 4.0 * GAP, space.twist(0.5, -numbers.speed))
    return model(space, [space.floor(), ball], numbers)


def stack(space: Space, numbers: Numbers) -> Model:
    """Three boxes stand on each other, none over the middle of the one below."""
    boxes = [space.box(0.0625 * x, 0.5 + i) for i, x in enumerate((0.0, 1.0, -1.0))]
    return model(space, [space.floor(), *boxes], dataclasses.replace(numbers, restitution=0.0))


def incline(space: Space, numbers: Numbers) -> Model:
    """A box slides across a slope and may come to rest."""
    box = space.box(0.0, 0.25, space.twist(numbers.speed), half=(0.5, 0.25))
    return model(space, [space.floor(), box], dataclasses.replace(numbers, restitution=0.0), tilt=numbers.lean)


def two_balls(space: Space, numbers: Numbers) -> Model:
    """Two unequal spinning balls meet off centre in free flight."""
    first = space.ball(0.0, 0.0, space.twist(numbers.speed, 0.25, 3.0))
    second = space.ball(1.25, 0.5, space.twist(-numbers.speed, 0.0, -1.0), radius=0.75, mass=3.0)
    return model(space, [first, second], numbers, gravity=0.0)


def box_on_edge(space: Space, numbers: Numbers) -> Model:
    """A leaning box falls on its edge; the horizon ends before it rocks on to another.

    In space it is rolled as well, so that one corner strikes: of a level edge the least disturbance lets one corner be
    the first, and two impacts one after the other end elsewhere than both at once.
    """
    half = (0.5, 0.25)
    box = space.box(0.0, 0.0, space.twist(0.25, -numbers.speed, 0.5), half, angle=numbers.lean)
    low = half[0] * math.sin(numbers.lean) + half[1] * math.cos(numbers.lean)
    pose = (0.0, low + 0.5 * GAP, numbers.lean)
    if space.dimension == 3:
        turn = turned(np.array(box.pose[3:]), np.array([math.cos(0.5 * ROLL), math.sin(0.5 * ROLL), 0.0, 0.0]))
        low = float(np.abs(rotation_matrix(turn)[2]) @ np.array([half[0], half[0], half[1]]))
        pose = (0.0, 0.0, low + 0.5 * GAP, *turn)
    return model(space, [space.floor(), dataclasses.replace(box, pose=pose)], numbers)


SCENES = {
    "impact": Scene(impact, 60),
    "bounce": Scene(bounce, 120),
    "stack": Scene(stack, 60),
    "incline": Scene(incline, 120),
    "two balls": Scene(two_balls, 90),
    "box on edge": Scene(box_on_edge, 15),
}
