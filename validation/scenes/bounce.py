r"""A ball is dropped and bounces until it rests.

      o  h0          h_n = e^(2n) h0
      |      o  h1   interval between apexes shrinks by e
      |     / \  o  h2
      v    /   \/ \/\       at rest after sqrt(2 h0/g) (1 + e)/(1 - e)
    =====================

A central fall: friction cannot act and is 0. The height is the clearance below the ball, so the truth does not
know the radius.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from adapters.scene import Pair, Scene
from adapters.trajectory import Sampling, Trajectory
from validation import metrics, tolerances
from validation.canonical import GRAVITY, CanonicalScene, Measured, Parameter, Track
from validation.scenes.parts import ball, floor, upward
from validation.tolerances import APEXES

RADIUS = 0.5


def rest_time(e: float, height: float, g: float = GRAVITY) -> float:
    """Sum of the geometric series of bounce times, sqrt(2 h0/g) (1 + e)/(1 - e) [s]; infinite for e = 1."""
    return math.inf if e >= 1.0 else math.sqrt(2.0 * height / g) * (1.0 + e) / (1.0 - e)


def make(dimension: int, params: Mapping[str, float]) -> Scene:
    """Build the scene; it runs past rest by a tenth, or for APEXES + 1 arcs if e = 1."""
    e, height, g = params["e"], params["height"], params["g"]
    fall = math.sqrt(2.0 * height / g)
    longest = fall * (2.0 * APEXES + 2.0)
    end = longest if e >= 1.0 else max(1.1 * rest_time(e, height, g) + 0.25, fall + 0.25)
    return Scene(
        "bounce",
        1,
        dimension,
        (floor(dimension), ball("ball", dimension, params["mass"], RADIUS, RADIUS + height)),
        (Pair(restitution=e, friction=params["mu"]),),
        upward(dimension, -g),
        end,
        params,
    )


def exact(scene: Scene) -> dict[str, float]:
    """Apex heights, ratio of apex intervals, rest time."""
    e, height, g = scene.params["e"], scene.params["height"], scene.params["g"]
    truth = {f"apex[{n}]": e ** (2 * n) * height for n in range(1, APEXES + 1)}
    truth |= {"apex_interval_ratio": e, "apex_growth": 0.0}
    if e < 1.0:
        truth["rest_time"] = rest_time(e, height, g)
    return truth


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Apexes from the three highest samples of each arc; rest as the last time anything moved."""
    up, g, height = scene.dimension - 1, scene.params["g"], scene.params["height"]
    clearance = trajectory.pose[:, 1, up] - RADIUS
    velocity = trajectory.twist[:, 1, up]
    # Twice g dt: a rebound that small ends within the step that made it.
    least = 2.0 * g * trajectory.dt
    times, heights = metrics.apexes(trajectory.t, clearance, velocity, least)
    measured: dict[str, Measured] = {}
    for n in range(1, APEXES + 1):
        none = (0.0, f"there is no apex {n}: the ball does not rise again")
        measured[f"apex[{n}]"] = (float(heights[n - 1]), "") if n <= len(heights) else none
    growth = [b - a for a, b in zip([height, *heights[:APEXES]], heights[:APEXES], strict=False)]
    measured["apex_growth"] = (max([0.0, *(float(x) for x in growth)]) / height, "")
    measured["apex_interval_ratio"] = metrics.interval_ratio(times)
    measured["rest_time"] = metrics.last_motion(trajectory.t, velocity, least)
    return measured


def sampling(scene: Scene) -> Sampling:
    """Every step; impulses are not judged here."""
    return Sampling(1, None)


def track(scene: Scene) -> Track:
    """Parabolas between the exact bounce times."""
    e, height, g = scene.params["e"], scene.params["height"], scene.params["g"]

    def position(t: float) -> tuple[float, ...]:
        return upward(scene.dimension, RADIUS + clearance(e, height, g, t))

    return Track("ball", position)


def clearance(e: float, height: float, g: float, t: float) -> float:
    """Exact clearance below the ball at time t [m]."""
    fall = math.sqrt(2.0 * height / g)
    if t < fall:
        return height - 0.5 * g * t * t
    speed, since = e * g * fall, t - fall
    while speed > 1e-9 * g * fall:
        flight = 2.0 * speed / g
        if since < flight:
            return speed * since - 0.5 * g * since * since
        since, speed = since - flight, e * speed
    return 0.0


BOUNCE = CanonicalScene(
    "bounce",
    1,
    "Dropped ball, from the first bounce to rest",
    __doc__ or "",
    "h_n = e^(2n) h0,  t_rest = sqrt(2 h0/g) (1 + e)/(1 - e)",
    (2, 3),
    (
        Parameter("e", 0.8, "1", "coefficient of restitution of the pair", 0.0, 1.0),
        Parameter(
            "height",
            1.0,
            "m",
            "clearance at release; sets the phase of every impact",
            0.0,
            1e4,
            positive=True,
        ),
        Parameter("mu", 0.0, "1", "friction of the pair; a central hit has no use for it", 0.0, 10.0),
        Parameter("g", GRAVITY, "m/s^2", "gravity", 0.0, 1e3, positive=True),
        Parameter("mass", 1.0, "kg", "of the ball", 0.0, 1e6, positive=True),
    ),
    make,
    exact,
    measure,
    sampling,
    track,
    tolerances.bounce_checks,
)
