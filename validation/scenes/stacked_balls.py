"""A small ball follows a large one onto a floor, a gap apart, and rebounds faster than it came.

          o  m
          |  v             1. the large ball hits the floor: it leaves with e v
          gap              2. it meets the small one at (1 + e) v:
        ( M )                 v_m = v (M e + M e (1 + e) - m)/(M + m)   upwards
          |  v                v_M = v (M e - m e (1 + e) - m)/(M + m)
    ==============         3. a large ball that is thrown down hits the floor again, and may
                              catch up with the small one: followed until they have parted

Each impact is between two bodies, with the next one well apart in time, so the law of pairs holds and no law of
simultaneous contacts is needed: v_m is almost 3 v for a light ball and e = 1. There is no gravity.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from adapters.scene import Pair, Scene, SceneError
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Track, Variation
from validation.scenes.parts import PHASES, ball, between_impacts, delay, floor, mass_of, phases, states, upward

LARGE, SMALL = 0.5, 0.2
#: Runs for this long after the last impact [s], of which the softest engine compared keeps contact for some.
AFTERMATH, SOFT = 0.35, 0.05
#: Largest step [s] that finds the last impact before the end, even if late.
COARSEST = 1.0 / 240.0
#: Largest number of impacts.
MOST = 20


def _gap(params: Params) -> float:
    """Gap between the balls [m]: they hit ``apart`` seconds after the large one has left the floor."""
    return (1.0 + params["e"]) * params["v"] * params["apart"]


def make(dimension: int, params: Params) -> Scene:
    """Build the scene; it ends when everything has parted for good."""
    p = params
    height = LARGE + p["v"] * p["delay"]
    large = ball("large", dimension, p["ratio"] * p["mass"], LARGE, height, -p["v"])
    small = ball("small", dimension, p["mass"], SMALL, height + LARGE + _gap(p) + SMALL, -p["v"])
    pairs = (Pair(restitution=p["e"], friction=0.0),)
    duration = impacts(p)[-1][0] + _aftermath(p)
    return Scene(
        "stacked_balls", 1, dimension, (floor(dimension), large, small), pairs, upward(dimension, 0.0), duration, p
    )


def impacts(params: Params) -> list[tuple[float, float, float]]:
    """Time [s] of every impact, and the speeds of the large and the small ball after it, upwards [m/s].

    Between impacts both move straight. Impacts with the floor and between the balls alternate; they end when the small
    ball is the faster, upwards.

    Raises
    ------
    SceneError
        If there are more than `MOST` of them: small restitutions give infinitely many.
    """
    p, e, share = params, params["e"], params["ratio"] / (1.0 + params["ratio"])
    time, height, gap = p["delay"], 0.0, _gap(p)  # of the large ball over the floor, and between the balls
    large, small = e * p["v"], -p["v"]
    found = [(time, large, small)]
    while large > small or large < 0.0:
        if len(found) > MOST:
            raise SceneError(f"stacked_balls.e: {e:g} with ratio {p['ratio']:g} makes more than {MOST} impacts")
        meet = large > small
        wait = gap / (large - small) if meet else height / -large
        time, height, gap = time + wait, height + wait * large, gap + wait * (small - large)
        if meet:
            closing = large - small
            large, small = large - (1.0 + e) * (1.0 - share) * closing, small + (1.0 + e) * share * closing
        else:
            large *= -e
        found.append((time, large, small))
    return found


def lateness(params: Params, dt: float) -> float:
    """Largest delay of the last impact in a fixed-step method [s].

    Each impact is found up to a step late, and the bodies separate from their places then, or from places after a
    correction of up to the whole overlap. The next one is later by the time to close that distance, which is long
    between slow balls. Places and times are sums over the errors of each impact, each at the end of its range with the
    largest delay.
    """
    p, known = params, impacts(params)
    light = p["ratio"] / (1.0 + p["ratio"])
    # For the large and the small ball, and the time: columns are delays of each impact and its correction [m], [s].
    ways, late = np.zeros((2, 2 * len(known))), np.zeros(2 * len(known))
    before = (-p["v"], -p["v"])
    for k, (_, *after) in enumerate(known):
        with_floor = after[1] == before[1]
        closing = -before[0] if with_floor else before[0] - before[1]
        late = (ways[0] if with_floor else ways[1] - ways[0]) / closing
        late[2 * k] += dt
        for i in range(2):
            ways[i] += (before[i] - after[i]) * late
        ways[:, 2 * k + 1] += closing * dt * np.array([1.0, 0.0] if with_floor else [light - 1.0, light])
        before = (after[0], after[1])
    return float(np.maximum(late, 0.0).sum())


def _aftermath(params: Params) -> float:
    """Time after the last impact [s]."""
    return max(AFTERMATH, SOFT + lateness(params, COARSEST))


def exact(scene: Scene) -> dict[str, float]:
    """Newton's law, pair after pair in order of time."""
    p = scene.params
    _, large, small = impacts(p)[-1]
    before = 0.5 * (1.0 + p["ratio"]) * p["mass"] * p["v"] ** 2
    after = 0.5 * p["mass"] * (small**2 + p["ratio"] * large**2)
    return {"small_speed": small, "large_speed": large, "energy_lost": 1.0 - after / before}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Velocities at the end, and the lost share of the energy."""
    p, up = scene.params, scene.dimension - 1
    large, small = (float(v) for v in trajectory.twist[-1, 1:, up])
    before = 0.5 * (1.0 + p["ratio"]) * p["mass"] * p["v"] ** 2
    after = 0.5 * p["mass"] * (small**2 + p["ratio"] * large**2)
    return {"small_speed": (small, ""), "large_speed": (large, ""), "energy_lost": (1.0 - after / before, "")}


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """Impacts that lie steps apart are exact pair by pair; a fixed-step method cannot separate closer ones.

    The end is not judged where a coarse step may find the last impact after it: a large ball almost at rest reaches the
    floor at a time that depends on the steps before.
    """
    p, times = scene.params, [time for time, _, _ in impacts(scene.params)]
    source = "Newton's law of restitution and conservation of momentum, pair after pair"
    scales = {
        "small_speed": ("m/s", 3.0 * p["v"]),
        "large_speed": ("m/s", p["v"]),
        "energy_lost": ("1", 1.0 + 9.0 / p["ratio"]),
    }
    found = bounds.exact_laws(scales, truth, source)
    apart = min(later - earlier for earlier, later in pairwise(times))
    told = apart >= bounds.APART * dt and lateness(p, dt) <= _aftermath(p) - SOFT
    return found if told else [check.unjudged() for check in found]


def track(scene: Scene) -> Track:
    """The small ball: straight from impact to impact."""
    known = [(time, small) for time, _, small in impacts(scene.params)]
    height = between_impacts(scene.bodies[2].pose[scene.dimension - 1], -scene.params["v"], known)
    return Track("small", lambda t: upward(scene.dimension, height(t)))


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Larger error of the two speeds, over the speed of the fall."""
    truth, off = exact(scene), []
    for name in ("small_speed", "large_speed"):
        value, reason = found[name]
        if value is None:
            return None, reason
        off.append(abs(value - truth[name]) / scene.params["v"])
    return metrics.largest(off), ""


SCENE = CanonicalScene(
    name="stacked_balls",
    version=1,
    title="Small ball on a large one: thrown back up to three times as fast",
    symptoms=(
        "a ball dropped on a ball is thrown back too slowly",
        "a small ball on a large ball does not shoot up",
        "the double ball drop experiment does not work",
        "the upper ball should rise nine times as high",
        "two balls dropped together on top of each other stick together",
        "energy is not passed from the big ball to the little one",
        "a marble on a falling football is not launched",
        "the galilean cannon gives too little speed",
    ),
    family="rebound",
    figure=__doc__ or "",
    law="v_m = v (M e + M e (1 + e) - m)/(M + m)",
    dimensions=(2, 3),
    parameters=(
        Parameter("ratio", 10.0, "1", "mass of the large ball over that of the small one", 1e-2, 1e6),
        Parameter("e", 0.9, "1", "coefficient of restitution of all pairs", 0.1, 1.0),
        Parameter("v", 2.0, "m/s", "of both balls, downwards", 0.0, 1e2, positive=True),
        Parameter("apart", 0.05, "s", "time between the impacts; 12 steps of 1/240 s", 0.0, 1.0, positive=True),
        delay("the floor"),
        mass_of("the small ball", 0.5),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    track=track,
    quick=(Variation({}), Variation({"ratio": 1.0, "e": 0.5}, dimensions=(2,))),
    standard=(Variation({}), Variation({"ratio": 1000.0, "e": 1.0}), Variation({"ratio": 1.0, "e": 0.5})),
    full=tuple(Variation({"ratio": r, "e": e}) for r in (1.0, 3.0, 10.0, 1e3, 1e6) for e in (0.3, 0.5, 0.9, 1.0)),
    planted=({},),
    primary=Primary(
        "speed error",
        "1",
        f"larger error of the balls' speeds at the end over that of the fall, over {PHASES} phases of the first impact",
        "the second impact shows whether impacts are resolved one by one; the worst phase counts",
        phases,
        error,
        "the whole scene: fall, two or three impacts, departure",
        order=0,
    ),
    words={
        "small_speed": "throws the small ball up with {value}",
        "small_speed<0": "sends the small ball down with {value}",
        "large_speed": "leaves the large ball with {value}",
        "energy_lost": "takes {value} of the energy",
        "energy_lost<0": "adds {value} of the energy",
    },
)
