r"""A ball between two plates with e > 1, which throw it back faster than it came.

    |   <- e^2 v         |       no gravity; after n blows   v_n = e^n v,   energy e^(2 n) as much
    |    o               |       a blow in every  L/v_n:  infinitely many in a finite time,  L/v e/(e - 1)
    |         e v ->     |       1 <= e <= 2
    |  <- v       o      |
    |<-------- L ------->|

No pair of materials does this, and a solver may refuse it. An engine that accepts the value should apply it: users set
1.1 for a bumper, and find it clamped, or another gain.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import accumulate

import numpy as np

from adapters.scene import Body, HalfSpace, Pair, Scene
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Track, Variation
from validation.scenes.parts import along, at, ball, between_impacts, mass_of, states

#: Radius of the ball, and distance of its centre from plate to plate L [m].
RADIUS, APART = 0.5, 4.0


def _blows(p: Params) -> list[tuple[float, float]]:
    """Times of the blows [s] and the speeds after them, to the right [m/s]; the first flight is half the distance."""
    speeds = [p["v"] * p["e"] ** k for k in range(int(p["blows"]) + 1)]
    times = accumulate(way / speed for way, speed in zip((0.5 * APART, *[APART] * len(speeds)), speeds, strict=False))
    return [(time, -((-1.0) ** k) * speeds[k + 1]) for k, time in zip(range(int(p["blows"])), times, strict=False)]


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the ball starts in the middle, to the right; it ends halfway between two blows."""
    p = params
    half = 0.5 * APART + RADIUS
    plates = tuple(
        Body(name, HalfSpace(along(dimension, -side), -half), motion="fixed")
        for name, side in (("left", -1.0), ("right", 1.0))
    )
    body = at(
        ball("ball", dimension, p["mass"], RADIUS, 0.0), dimension, along(dimension, 0.0), along(dimension, p["v"])
    )
    last, speed = _blows(p)[-1]
    duration = last + 0.5 * APART / abs(speed)
    pairs = (Pair(restitution=p["e"], friction=0.0),)
    gravity = (0.0,) * dimension
    return Scene(
        "restitution_above_one", 1, dimension, (*plates, body), pairs, gravity, duration, p, gaining=p["e"] > 1.0
    )


def exact(scene: Scene) -> dict[str, float]:
    """Newton's law of restitution, with e above 1."""
    p = scene.params
    return {"growth": p["e"], "blows": p["blows"], "astray": 0.0}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Mean factor of the speed a blow, changes of its direction, and speed across."""
    p, twist = scene.params, trajectory.twist[:, 2]
    metrics.numbers(twist[:, 0])
    moving = twist[np.abs(twist[:, 0]) > 0.0, 0]
    turns = int(np.count_nonzero(np.diff(np.sign(moving))))
    speed = float(np.abs(twist[-1, 0]))
    growth: Measured = (None, "it is never thrown back")
    if turns:
        growth = ((speed / p["v"]) ** (1.0 / turns), "")
    return {
        "growth": growth,
        "blows": (float(turns), ""),
        "astray": (float(np.abs(twist[:, 1:]).max()) / p["v"], ""),
    }


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """A blow is exact at every step; late blows do not change their number, as the run ends halfway.

    Each may be late by a step for its contact and one for the blow itself; where that exceeds the last half flight, one
    blow more or less is allowed.
    """
    p, source = scene.params, "Newton's law of restitution, with e above 1"
    left = 0.5 * APART / (p["v"] * p["e"] ** p["blows"])
    lost = 0.0 if 2.0 * dt * p["blows"] < left else 1.0
    count = bounds.Bound(
        0.5 + lost, "a whole number: the run ends half a flight after the last blow, and late blows shorten that"
    )
    return [
        bounds.exact(p["e"]).check("growth", "1", truth["growth"], source),
        count.check("blows", "1", truth["blows"], "flights at e^n v between the plates"),
        bounds.exact(p["e"] ** p["blows"]).check("astray", "1", truth["astray"], "plates without friction"),
    ]


def track(scene: Scene) -> Track:
    """Straight from blow to blow."""
    place = between_impacts(0.0, scene.params["v"], _blows(scene.params))
    return Track("ball", lambda t: along(scene.dimension, place(t)))


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Distance of the mean factor from e."""
    value, reason = found["growth"]
    return (None, reason) if value is None else (abs(value - scene.params["e"]), "")


SCENE = CanonicalScene(
    name="restitution_above_one",
    family="rebound",
    version=1,
    title="Ball between plates that throw it back faster",
    symptoms=(
        "objects are thrown back faster than they came",
        "a restitution of 1.1 should add speed at every blow",
        "a restitution larger than 1 is clamped or refused",
        "a bumper or trampoline should add speed at every hit",
        "a pinball kicker gives no extra speed",
        "elasticity above one does not accelerate the ball",
        "a bouncy pad should return more than it gets",
        "a super bouncy wall with restitution 1.2",
    ),
    figure=__doc__ or "",
    law="v_n = e^n v after n blows, for engines that accept e > 1",
    dimensions=(2,),
    parameters=(
        Parameter("e", 1.1, "1", "restitution; values a little above 1 are used for bumpers", 1.0, 2.0),
        Parameter("v", 2.0, "m/s", "of the ball at the start", 0.0, 1e3, positive=True),
        Parameter("blows", 5, "1", "until it ends", 1, 100, integer=True),
        mass_of("the ball"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    track=track,
    standard=(Variation({}), Variation({"e": 1.5})),
    full=tuple(Variation({"e": e}) for e in (1.0, 1.001, 1.1, 1.5, 2.0)),
    planted=({},),
    primary=Primary(
        "growth error",
        "1",
        "|mean factor of the speed a blow - e|",
        "an engine that accepts a value should apply it",
        lambda dt: [{}, {"e": 1.5}],
        error,
        "the whole scene: five blows",
    ),
    words={
        "growth": "grows by {value} a blow",
        "blows": "is thrown back {value} times",
        "astray": "strays across by {value} of its speed",
    },
)
