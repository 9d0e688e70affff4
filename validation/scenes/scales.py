r"""The same scene in millimetres and kilometres, in grams and tons: the results must not depend on the scale.

       o  h = 2 L               the ball rises to  e^2  of its fall
       |        _____
       v       |_____| v ->     the box stops after  v^2/(2 mu g)
    ==========================  every length times L, gravity too: times stay what they are, and so does the step

All numbers are in units of L, and all results must be equal. Differences come from fixed lengths of an engine: slops,
margins and speed thresholds that suit bodies of about one metre. 1 cm is nothing for a ship and the size of a pebble.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from adapters.scene import Pair, Scene
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import GRAVITY, CanonicalScene, Check, Measured, Parameter, Params, Primary, Variation
from validation.scenes.parts import along, at, ball, floor, states, upward
from validation.truths import sliding

#: In units of L: radius and drop of the ball, size of the box, and their distance.
RADIUS, DROP, SIDE, APART = 0.5, 2.0, 1.0, 5.0
#: Restitution of the ball; friction, speed of the box in L/s, and gravity in L/s^2.
E, MU, SPEED = 0.5, 0.3, 2.0


def _sliding(p: Params) -> dict[str, float]:
    """Parameters for `validation.truths.sliding`, in metres."""
    return {"v": SPEED * p["length"], "mu": MU, "g": GRAVITY * p["length"], "mass": p["mass"]}


def _impact(p: Params) -> float:
    """Speed at which the ball lands [m/s]."""
    return p["length"] * math.sqrt(2.0 * GRAVITY * DROP)


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the ball is let go ``APART`` behind the box, which slides away from it."""
    p, length = params, params["length"]
    dropped = ball("ball", dimension, p["mass"], RADIUS * length, 0.0)
    dropped = at(dropped, dimension, along(dimension, -APART * length, (RADIUS + DROP) * length))
    box = sliding.launched(dimension, _sliding(p), SIDE * length, SIDE * length)
    pairs = (Pair(restitution=0.0, friction=MU), Pair("floor", "ball", E, MU))
    # Long enough for the box to stop and for the ball to rise and land again.
    duration = max(sliding.lasts(_sliding(p)), (1.0 + 2.0 * E) * math.sqrt(2.0 * DROP / GRAVITY))
    gravity = upward(dimension, -GRAVITY * length)
    return Scene("scales", 1, dimension, (floor(dimension), dropped, box), pairs, gravity, duration, p)


def exact(scene: Scene) -> dict[str, float]:
    """Coulomb's and Newton's laws, over L."""
    length, way = scene.params["length"], sliding.exact(_slide(scene))
    kept = ("stopping_distance", "braking", "end_speed", "hop", "turned", "astray")
    return {name: way[name] / length for name in kept if name in way} | {"apex": E**2 * DROP}


def _slide(scene: Scene) -> Scene:
    """The same scene, with the parameters of the slide."""
    return replace(scene, params=_sliding(scene.params))


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Distance and braking of the box, and the first apex of the ball, over L."""
    length, d = scene.params["length"], scene.dimension
    found = sliding.measure(_slide(scene), trajectory)
    measured = {name: (None if value is None else value / length, why) for name, (value, why) in found.items()}
    height, speed = trajectory.pose[:, 1, d - 1] - RADIUS * length, trajectory.twist[:, 1, d - 1]
    _, tops = metrics.apexes(trajectory.t, height, speed, 2.0 * GRAVITY * length * trajectory.dt)
    return measured | {"apex": (float(tops[0]) / length, "") if len(tops) else (0.0, "the ball does not rise again")}


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """The checks of a slide and a rebound in metres, over L: the same at every length."""
    p, length = scene.params, scene.params["length"]
    metres = {name: value * length for name, value in truth.items()}
    found = [
        Check(
            c.metric,
            "L" if c.unit == "m" else c.unit.replace("m/", "L/"),
            truth[c.metric],
            c.bound / length,
            c.because,
            c.source,
        )
        for c in sliding.checks(_slide(scene), dt, metres, (APART + RADIUS + DROP) * length)
        if c.bound is not None
    ]
    speed, gravity = _impact(p), GRAVITY * length
    apex = bounds.Bound(
        (bounds.rebound_late(E, speed, dt) + gravity * dt * dt / 8.0) / length,
        "impact located within a step: (1 - e^2 + e (1+e)/2) v dt; + g dt^2/8",
    )
    return [*found, apex.check("apex", "L", truth["apex"], "Newton's law of restitution; energy in between")]


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Larger of the relative errors of the box's distance and the ball's apex."""
    return metrics.relative_error(found, exact(scene), ("stopping_distance", "apex"))


SCENE = CanonicalScene(
    name="scales",
    family="hard",
    version=1,
    title="The same scene in millimetres and in kilometres",
    symptoms=(
        "small or tiny objects behave differently from large ones",
        "units of millimetres give other results",
        "tiny screws and gears jitter or fall through",
        "bodies of a centimetre never come to rest",
        "the simulation is wrong when I work in centimetres or pixels",
        "very light objects behave strangely",
        "a scaled model does not behave like the full size one",
        "a coin-sized body floats above the floor or sinks in",
        "huge objects fall or slide in a strange way",
        "which scale or units should I use",
        "small parts explode where large ones are fine",
        "very small bodies are unstable and shake",
        "a gap is visible between small objects and the floor",
    ),
    figure=__doc__ or "",
    law="stops after v^2/(2 mu g), rises to e^2 of its fall: in units of L the same for every L and mass",
    dimensions=(2, 3),
    parameters=(
        Parameter("length", 1e-3, "m", "the unit L of all lengths: 1e-3 is a pebble, 1e3 a mountain", 1e-6, 1e6),
        Parameter("mass", 1.0, "kg", "mass of either body: a gram is 1e-3, a ton 1e3", 1e-9, 1e9),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    quick=(Variation({}), Variation({"length": 1e3}, dimensions=(2,))),
    full=tuple(Variation({"length": length, "mass": mass}) for length in (1e-3, 1.0, 1e3) for mass in (1e-3, 1.0, 1e3)),
    planted=({}, {"length": 1e3}),
    primary=Primary(
        "unit error",
        "1",
        "larger of the relative errors of the box's slide and the ball's rise, in millimetres and kilometres",
        "results must not depend on the unit; where they do, a fixed length of the engine is the cause",
        lambda dt: [{}, {"length": 1e3}],
        error,
        "the whole scene: the ball bounces and the box slides",
    ),
    words={
        "stopping_distance": "stops after {value}",
        "braking": "brakes with {value}",
        "end_speed": "still moves with {value}",
        "turned": "turns: its corners move by {value}",
        "apex": "rises to {value}",
    },
)
