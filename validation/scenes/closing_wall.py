"""A ball moves to and fro between a wall and an approaching plate: each blow of the plate adds twice its speed.

    |                |<- V         v_n = v_0 + 2 n V  after n blows of the plate
    |      o -->     |             (v_n - V) L_n is kept: faster as it gets narrow
    |<----- L ------>|

Against a moving body, Newton's law holds for relative speeds. An engine that ignores the plate's motion leaves the
ball's speed unchanged; one that finds a blow late finds all later ones later.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from adapters.engine import Array
from adapters.scene import Body, Box, HalfSpace, Pair, Scene
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Track, Variation
from validation.scenes.parts import along, at, ball, between_impacts, mass_of, pose_at, states

#: Of the plate [m]; the ball is a tenth of its width.
THICKNESS, WIDTH = 1.0, 2.0
#: Judged blows of the plate.
BLOWS = 3


def blows(p: Params) -> list[tuple[float, float, float]]:
    """Time of each blow of the plate, of the blow on the wall after it [s], and the speed between them [m/s]."""
    time, place, speed, found = 0.0, 0.5 * p["length"], p["v"], []
    for _ in range(BLOWS):
        left = p["length"] - p["closing"] * time - place
        time += left / (speed + p["closing"])
        place, speed = p["length"] - p["closing"] * time, speed + 2.0 * p["closing"]
        found.append((time, time + place / speed, speed))
        time, place = found[-1][1], 0.0
    return found


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the ball starts in the middle, towards the plate; no gravity."""
    p, spin = params, (0.0,) if dimension == 2 else (0.0, 0.0, 0.0)
    wall = Body("wall", HalfSpace(along(dimension, 1.0), 0.0), motion="fixed")
    half, r = (0.5 * THICKNESS, *(0.5 * WIDTH,) * (dimension - 1)), p["radius"]
    plate = Body(
        "plate",
        Box(half),
        pose=pose_at(dimension, along(dimension, p["length"] + 2.0 * r + half[0])),
        twist=(*along(dimension, -p["closing"]), *spin),
        motion="prescribed",
    )
    thrown = at(
        ball("ball", dimension, p["mass"], r, 0.0),
        dimension,
        along(dimension, r + 0.5 * p["length"]),
        along(dimension, p["v"]),
    )
    last, back, _ = blows(p)[-1]
    bodies, pairs = (wall, plate, thrown), (Pair(restitution=1.0, friction=0.0),)
    return Scene("closing_wall", 1, dimension, bodies, pairs, (0.0,) * dimension, 0.5 * (last + back), p)


def exact(scene: Scene) -> dict[str, float]:
    """Newton's law with e = 1 against the moving plate and the fixed wall."""
    truth: dict[str, float] = {}
    for n, (time, _, speed) in enumerate(blows(scene.params), 1):
        truth |= {f"speed[{n}]": speed, f"time[{n}]": time}
    return truth


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Speed back from the plate halfway to the wall, and when the straight ways to and from the plate meet."""
    x, velocity, measured = trajectory.pose[:, 2, 0], trajectory.twist[:, 2, 0], dict[str, Measured]()
    metrics.numbers(x, velocity)
    turns = np.flatnonzero((velocity[:-1] > 0.0) & (velocity[1:] <= 0.0)) + 1
    for n, (time, back, _) in enumerate(blows(scene.params), 1):
        k = min(int(np.searchsorted(trajectory.t, 0.5 * (time + back) - 1e-9)), len(velocity) - 1)
        measured[f"speed[{n}]"] = (float(-velocity[k]), "")
        none = (None, f"the plate does not throw it back {n} times")
        measured[f"time[{n}]"] = none if len(turns) < n else (_turned_back(trajectory.t, x, velocity, turns[n - 1]), "")
    return measured


def _turned_back(t: Array, x: Array, velocity: Array, k: int) -> float:
    """When the way before sample ``k - 1`` meets that after sample ``k`` [s], within these two."""
    parting = velocity[k] - velocity[k - 1]
    if parting == 0.0:
        return float(t[k])
    met = ((x[k - 1] - velocity[k - 1] * t[k - 1]) - (x[k] - velocity[k] * t[k])) / parting
    return float(np.clip(met, t[k - 1], t[k]))


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """Speeds are exact at every step; delays of blows add up in the times.

    A blow that is found d late is found u d deep, u the speed of approach, and the ball parts with u: it needs that
    time again to reach the place of an exact rebound. Later blows are at most 2 d late, d up to a step.
    """
    fastest = truth[f"speed[{BLOWS}]"]
    source = "Newton's law of restitution against a moving wall; (v - V) L is kept"
    found = []
    for n in range(1, BLOWS + 1):
        late = bounds.Bound(
            (4.0 * (n - 1) + 1.0) * dt + bounds.ROUND_OFF * truth[f"time[{n}]"],
            "each earlier blow is found up to one step late, which delays the next ones by twice that; this one is "
            "found up to one step late",
        )
        speed = bounds.exact(fastest)
        found.append(speed.check(f"speed[{n}]", "m/s", truth[f"speed[{n}]"], source))
        found.append(late.check(f"time[{n}]", "s", truth[f"time[{n}]"], source))
    return found


def track(scene: Scene) -> Track:
    """To and fro."""
    p, impacts = scene.params, []
    for time, back, speed in blows(p):
        impacts += [(time, -speed), (back, speed)]
    x = between_impacts(p["radius"] + 0.5 * p["length"], p["v"], impacts)
    return Track("ball", lambda t: along(scene.dimension, x(t)))


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Error of the speed after the last blow, over the speed added by the plate."""
    value, reason = found[f"speed[{BLOWS}]"]
    if value is None:
        return None, reason
    return abs(value - exact(scene)[f"speed[{BLOWS}]"]) / (2.0 * BLOWS * scene.params["closing"]), ""


SCENE = CanonicalScene(
    name="closing_wall",
    family="many impacts",
    version=1,
    title="Ball between a wall and a plate that closes in",
    symptoms=(
        "a moving wall or kinematic body hits objects wrongly",
        "a ball between a wall and an approaching plate gains the wrong speed",
        "a kinematic paddle does not pass its velocity on",
        "a piston compresses a ball and it escapes",
        "a moving bat hits a ball as if the bat stood still",
        "a racket moved by code gives the ball no speed",
        "a ball caught in a press is squeezed through the wall",
        "a wall that is moved each frame does not push balls away",
        "a kinematic body that strikes a ball has no effect",
        "a flipper or paddle hits too weakly",
    ),
    figure=__doc__ or "",
    law="v_n = v_0 + 2 n V after n blows of the plate; (v_n - V) L_n is kept",
    dimensions=(2, 3),
    parameters=(
        Parameter("closing", 0.25, "m/s", "speed V of the plate", 0.0, 1e2, positive=True),
        Parameter("v", 1.0, "m/s", "of the ball at the start", 0.0, 1e2, positive=True),
        Parameter("length", 1.0, "m", "gap for the ball at the start", 0.0, 1e3, positive=True),
        Parameter("radius", 0.1, "m", "of the ball", 0.0, 1e3, positive=True),
        mass_of("the ball"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    track=track,
    quick=(Variation({}, dimensions=(2,)), Variation({"closing": 0.1}, dimensions=(2,))),
    full=tuple(Variation({"closing": c}) for c in (0.05, 0.1, 0.25)),
    planted=({},),
    primary=Primary(
        "speed error",
        "1",
        "error of the speed after three blows of the plate, over the speed that they add",
        "a moving wall acts by the speed that it adds",
        lambda dt: [{}],
        error,
        "the whole scene: to and fro, three times",
    ),
    words={
        "speed": "is thrown back with {value}",
        "speed<0": "goes on with {value}",
        "time": "is thrown back after {value}",
    },
)
