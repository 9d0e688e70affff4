"""A ball rolls and spins about the vertical: a contact point cannot brake that spin.

         | s                  spin about the normal: s for ever
        (|)  -->  v           speed:                 v for ever, straight on
    ====================

Friction at a point has no lever arm about the normal, and a rolling point does not slip: Coulomb's law changes neither.
A decay of spin is torsional friction, a decay of speed rolling resistance; the scene has neither.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from adapters.scene import Pair, Scene
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Steps, Track, Variation
from validation.scenes.parts import ball, floor, heading, mass_of, standard_gravity, states, upward
from validation.truths.rolling import forward, gyration, launched, on_a_late_arm, struck


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the ball touches the floor and rolls."""
    p = params
    still = ball("ball", dimension, p["mass"], p["radius"], p["radius"])
    rolling = launched(still, dimension, math.radians(p["heading"]), p["v"], p["v"] / p["radius"])
    spinning = replace(rolling, twist=(*rolling.twist[:5], p["spin"]))
    pairs = (Pair(restitution=0.0, friction=p["mu"]),)
    return Scene(
        "rolling_spin", 1, dimension, (floor(dimension), spinning), pairs, upward(dimension, -p["g"]), p["duration"], p
    )


def exact(scene: Scene) -> dict[str, float]:
    """Only weight and normal force act."""
    return {"spin": scene.params["spin"], "speed": scene.params["v"], "hop": 0.0, "astray": 0.0}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Spin about the vertical and speed along the heading at the end."""
    return {
        "spin": (float(trajectory.twist[-1, 1, 5]), ""),
        "speed": (float(forward(scene, trajectory)[0][-1]), ""),
        "hop": (metrics.hop(trajectory), ""),
        "astray": (metrics.astray(trajectory, heading(scene)), ""),
    }


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """Exact at every step, except that a contact found one step late is g dt^2 deep: rolling there needs less speed.

    The impulse that makes it roll on the shorter lever arm follows from the law of a gripping impact.
    """
    p, r = scene.params, scene.params["radius"]
    depth = p["g"] * dt * dt

    def speed(arm: float) -> float:
        return struck(p["v"], p["v"] / r, math.inf, p["mu"], gyration(scene.dimension), r, arm)[0]

    source = "Coulomb's law at a point: no torque about the normal, no work while it rolls"
    rolls = on_a_late_arm(speed, r, depth, p["v"])
    return [
        bounds.exact(p["spin"]).check("spin", "rad/s", truth["spin"], source),
        rolls.check("speed", "m/s", truth["speed"], source),
        bounds.found_late(p["g"], dt, r).check("hop", "m", truth["hop"], source),
        bounds.straight(p["g"], dt, p["v"] * scene.duration).check("astray", "m", truth["astray"], source),
    ]


def track(scene: Scene) -> Track:
    """Straight on."""
    v, line, start = scene.params["v"], heading(scene), scene.bodies[1].pose[:3]
    return Track("ball", lambda t: (*(float(x) for x in v * t * line), start[2]))


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Lost share of the spin."""
    value, reason = found["spin"]
    return (None, reason) if value is None else (abs(value / scene.params["spin"] - 1.0), "")


SCENE = CanonicalScene(
    name="rolling_spin",
    version=1,
    title="Ball that rolls and spins about the vertical",
    symptoms=(
        "a spinning ball slows down or stops spinning",
        "a rolling ball slows down although there is no rolling resistance",
        "a spinning top loses its spin without friction",
        "torsional friction acts where none is set",
        "a ball that rolls straight loses its vertical spin",
        "rolling friction or spinning friction does not work as set",
        "a marble on a flat floor never comes to rest",
        "a rolling sphere decelerates for no reason",
        "the rotation of a ball about the vertical axis dies out",
        "angular damping slows a rolling ball",
        "a twirling ball on the spot keeps turning too long",
    ),
    family="turning",
    figure=__doc__ or "",
    law="spin about the normal and rolling speed stay constant: friction at a point reduces neither",
    dimensions=(3,),
    parameters=(
        Parameter("spin", 10.0, "rad/s", "about the vertical", 0.0, 1e3, positive=True),
        Parameter("v", 1.0, "m/s", "of the centre; the ball rolls from the start", 0.0, 1e2),
        Parameter("mu", 0.5, "1", "friction of the pair", 0.0, 10.0, positive=True),
        Parameter("heading", 30.0, "degrees", "angle of the motion to the axes", 0.0, 90.0),
        Parameter("radius", 0.5, "m", "of the ball", 0.0, 1e3, positive=True),
        standard_gravity(),
        Parameter("duration", 2.0, "s", "of the run", 0.1, 100.0),
        mass_of("the ball"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    track=track,
    standard=(Variation({}), Variation({"v": 0.0, "spin": 50.0})),
    full=tuple(
        Variation({"v": v, "spin": s, "heading": h}) for v in (0.0, 1.0) for s in (1.0, 50.0) for h in (0.0, 30.0)
    ),
    planted=({},),
    primary=Primary(
        "lost spin",
        "1",
        "share of the spin about the vertical that is lost by the end",
        "a contact point has no torsional friction, so any loss is the engine's",
        lambda dt: [{}],
        error,
        "the rolling, spinning ball",
        0.1,
        0.5,
    ),
    steps=Steps((1.0 / 60.0, 1.0 / 240.0, 1.0 / 960.0)),
    words={
        "spin": "spins about the vertical with {value}",
        "speed": "rolls on with {value}",
    },
)
