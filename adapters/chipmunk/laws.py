"""What Chipmunk does by design instead of the textbook, predicted from scene and step alone.

A bouncing ball follows a scalar recurrence (heights above the contact position, velocities upwards)::

    y  <-  y + (v + b) dt,  b <- 0                position first, with the old velocity and push-out
    if y <= 0:  u = e v                           restitution looks at the velocity before gravity
                b = (1 - C^dt) max(0, -y - s)/dt  push-out of what is deeper than the slop s, for one step
    v  <-  v - g dt
    if y <= 0:  v <- max(v, -u)                   one contact is solved exactly by any number of sweeps

so its apexes are known to round-off although they scatter by v dt about e^(2n) h0.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from adapters.chipmunk.profiles import PROFILES
from adapters.chipmunk.shipped import CHECKED_ON
from adapters.engine import Array, Contacts
from adapters.law import Deviation, Law, Measure, Prediction, exactly
from adapters.needs import needs
from adapters.scene import Disc, Scene
from adapters.stepping import step_count
from adapters.trajectory import ContactRecord, Trajectory
from adapters.unswept import Push, passing_law, shoved_law

#: Rounding of the recurrence against the engine: two thousand steps of a few roundings of numbers up to 10
#: (2000 x 4 x 10 x 1.1e-16 = 1e-11), times what a bounce can magnify a height error to, 1/e <= 2, per bounce.
ROUND_OFF = 1e-9


def flight(
    height: float, speed: float, e: float, g: float, steps: int, dt: float, slop: float, bias: float
) -> tuple[Array, Array]:
    """Heights above contact and velocities after 0 .. ``steps`` steps of the recurrence, each (steps + 1,).

    Parameters
    ----------
    height, speed
        At the start [m], [m/s], upwards.
    slop, bias
        The engine's ``collision_slop`` [m] and ``collision_bias`` [1/s to the power of dt].
    """
    y, v, push = height, speed, 0.0
    share = 1.0 - bias**dt
    heights, velocities = [y], [v]
    for _ in range(steps):
        y += (v + push) * dt
        touching, push, target = y <= 0.0, 0.0, -math.inf
        if touching:
            target = -e * v
            push = share * max(0.0, -y - slop) / dt
        v = max(v - g * dt, target)
        heights.append(y)
        velocities.append(v)
    return np.array(heights), np.array(velocities)


_flight = lru_cache(maxsize=64)(flight)


def predicted_bounce(scene: Scene, profile: str, dt: float) -> Trajectory | None:
    """Trajectory of the recurrence for a planar bounce; None in three dimensions."""
    if scene.dimension != 2:
        return None
    chosen = {s.name: s.value for s in PROFILES[profile](needs(scene), dt)}
    ball = scene.bodies[1]
    assert isinstance(ball.shape, Disc)
    height, speed = ball.pose[1] - ball.shape.radius, ball.twist[1]
    e, steps = scene.material(scene.bodies[0].name, ball.name).restitution, step_count(scene.duration, dt)
    slop, bias = chosen["collision_slop"], chosen["collision_bias"]
    heights, velocities = _flight(height, speed, e, -scene.gravity[1], steps, dt, slop, bias)
    pose, twist = np.zeros((steps + 1, 2, 3)), np.zeros((steps + 1, 2, 3))
    pose[:, 1, 1] = heights + ball.shape.radius
    twist[:, 1, 1] = velocities
    # What a step changes the velocity by beside gravity is the floor's impulse, exactly 0 where the ball flies.
    impulse = np.zeros((steps + 1, 2))
    impulse[1:, 1] = ball.mass * (velocities[1:] - (velocities[:-1] + scene.gravity[1] * dt))
    first, unknown = np.zeros(steps + 1, np.int64), np.full((steps + 1, 2), np.nan)
    rows = Contacts(first, first + 1, unknown, unknown, impulse, unknown[:, 0])
    contacts = ContactRecord(np.arange(steps + 1), np.arange(steps + 2), rows)
    return Trajectory(np.arange(steps + 1, dtype=np.float64) * dt, pose, twist, contacts, dt, "completed")


def bounce_law(profile: str, metric: str) -> Law:
    """Law that measures ``metric`` on the predicted trajectory exactly as on the engine's."""

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        predicted = predicted_bounce(scene, profile, dt)
        value = measure(scene, predicted)[metric][0] if predicted else None
        # A speed of exactly 2 g dt, the threshold of rest, may fall on either side of it: one sample later or earlier.
        band = dt + ROUND_OFF if metric == "rest_time" else ROUND_OFF
        return None if value is None else (value, band)

    return law


def touching_start_law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
    """Deepest overlap of a single box that starts exactly touching, with the shipped ten sweeps.

    Friction couples the two contact points, ten sweeps leave a residual, and the residual lifts the box off. It
    falls freely for one step and is caught g dt^2 deep, where it stays: that is within the slop. The band is what
    two landings at g dt (lift-off and catch) leave unsolved: 4.7e-4 of the speed and, half a side from the centre,
    4.5e-4 rad/s per m/s each, over the two steps until warm starting has taken over.
    Without friction the points are solved exactly and nothing moves; above mu = 0.5 the residual is larger than the
    facts behind the band, so that the law is silent.
    """
    if scene.dimension != 2 or len(scene.bodies) != 2:
        return None
    mu = scene.material(scene.bodies[0].name, scene.bodies[1].name).friction
    if not 0.0 < mu <= 0.5:
        return None
    fall = math.hypot(*scene.gravity) * dt * dt
    return fall, 2.0 * 2.0 * (4.7e-4 + 0.5 * 4.5e-4) * fall


def _pushed(profile: str) -> Push:
    """Push-out of overlaps beyond the slop, in the step after: as in `flight`."""

    def push(scene: Scene, dt: float, overlap: float) -> float:
        chosen = {s.name: s.value for s in PROFILES[profile](needs(scene), dt)}
        share: float = 1.0 - chosen["collision_bias"] ** dt
        return share * max(0.0, overlap - chosen["collision_slop"]) / dt

    return push


def _bounce_laws() -> tuple[Deviation, ...]:
    metrics = [f"apex[{n}]" for n in range(1, 6)] + [
        "apex_interval_ratio",
        "apex_growth",
        "rest_time",
        "force_in_flight",
    ]
    return tuple(
        _deviation(
            (profile,),
            "bounce",
            metric,
            bounce_law(profile, metric),
            "nothing is swept: the ball bounces from wherever within (0, v dt] below the surface it is found, "
            "with the velocity before gravity",
            "cpSpaceStep.c:394-431 (order), cpArbiter.c:379-383 (bounce); recurrence in this module",
        )
        for profile in PROFILES
        for metric in metrics
    )


def _deviation(profiles: tuple[str, ...], scene: str, metric: str, law: Law, because: str, source: str) -> Deviation:
    return Deviation("chipmunk", profiles, scene, exactly(metric), law, because, source, CHECKED_ON)


DEVIATIONS: tuple[Deviation, ...] = (
    *_bounce_laws(),
    _deviation(
        ("default",),
        "stack",
        "penetration",
        touching_start_law,
        "an exactly touching box lifts off by what ten sweeps leave unsolved and is caught one step of fall deeper",
        "cpSpaceStep.c:448 (fixed sweeps), cpArbiter.c:379 (slop); measured flat landing at ten sweeps",
    ),
)

DEVIATIONS += tuple(
    Deviation(
        "chipmunk",
        (profile,),
        "thin_wall",
        metric,
        passing_law(metric),
        "nothing is swept: no step ends with the ball in the plate, so that it is never found",
        "cpSpaceStep.c:400 (positions, then overlaps)",
        CHECKED_ON,
    )
    for profile in PROFILES
    for metric in ("rebound_ratio", "beyond")
)

DEVIATIONS += tuple(
    _deviation(
        (profile,),
        "thin_wall",
        metric,
        shoved_law(metric, _pushed(profile)),
        "nothing is swept: the step that finds the ball in the plate finds it beyond the middle, from where out is on",
        "cpSpaceStep.c:400 (positions, then overlaps), cpCollision.c (normal of the least overlap)",
    )
    for profile in PROFILES
    for metric in ("rebound_ratio", "beyond")
)
