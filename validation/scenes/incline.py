"""A box on an incline sticks or slides.

       +---+
       |   | ->       sticks if tan(theta) <= mu,
    ==============    else a = g (sin(theta) - mu cos(theta))

Gravity is turned by theta, not the floor: a tilted, touching start is not representable exactly and costs some engines
a transient. ``ratio`` is tan(theta)/mu: 1 is the edge of the friction cone.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from adapters.scene import Pair, Scene
from adapters.trajectory import Sampling, Trajectory
from validation import metrics, tolerances
from validation.canonical import GRAVITY, CanonicalScene, Measured, Parameter, Track
from validation.scenes.parts import cube, floor

SIDE = 1.0


def angle(params: Mapping[str, float]) -> float:
    """Incline angle [rad]."""
    return math.atan(params["ratio"] * params["mu"])


def make(dimension: int, params: Mapping[str, float]) -> Scene:
    """Build the scene; the box would slide along +x."""
    theta, g = angle(params), params["g"]
    gravity = (g * math.sin(theta), *((0.0,) * (dimension - 2)), -g * math.cos(theta))
    return Scene(
        "incline",
        1,
        dimension,
        (floor(dimension), cube("box", dimension, params["mass"], SIDE, 0.5 * SIDE)),
        (Pair(restitution=0.0, friction=params["mu"]),),
        gravity,
        params["duration"],
        params,
    )


def exact(scene: Scene) -> dict[str, float]:
    """Creep below the threshold, acceleration above it."""
    theta, mu, g = angle(scene.params), scene.params["mu"], scene.params["g"]
    if scene.params["ratio"] <= 1.0:
        return {"creep": 0.0}
    return {"acceleration": g * (math.sin(theta) - mu * math.cos(theta))}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Mean speed and mean acceleration over the second half of the run, past any start-up transient."""
    x, v = trajectory.pose[:, 1, 0], trajectory.twist[:, 1, 0]
    measured = {"creep": metrics.mean_rate(trajectory.t, x)}
    measured["acceleration"] = metrics.mean_rate(trajectory.t, v)
    return measured


def sampling(scene: Scene) -> Sampling:
    """Every step; impulses are not judged here."""
    return Sampling(1, None)


def track(scene: Scene) -> Track:
    """At rest, or the exact parabola."""
    start = scene.bodies[1].pose[: scene.dimension]
    a = exact(scene).get("acceleration", 0.0)
    return Track("box", lambda t: (start[0] + 0.5 * a * t * t, *start[1:]))


INCLINE = CanonicalScene(
    "incline",
    1,
    "Box on an incline, from sticking to sliding",
    __doc__ or "",
    "sticks if tan(theta) <= mu, else a = g (sin(theta) - mu cos(theta))",
    (2, 3),
    (
        Parameter("ratio", 0.9, "1", "tan(theta)/mu; 1 is the edge of the cone", 0.0, 100.0, positive=True),
        Parameter("mu", 0.5, "1", "friction of the pair", 0.0, 10.0, positive=True),
        Parameter("g", GRAVITY, "m/s^2", "gravity", 0.0, 1e3, positive=True),
        Parameter("mass", 1.0, "kg", "of the box", 0.0, 1e6, positive=True),
        Parameter("duration", 2.0, "s", "the second half is measured", 0.1, 1e3),
    ),
    make,
    exact,
    measure,
    sampling,
    track,
    tolerances.incline_checks,
)
