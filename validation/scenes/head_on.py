"""Two balls meet head-on in free space, both moving.

       m          r m
       o -->   <-- O        v1' = v1 - (1 + e) r/(1 + r) (v1 - v2)
       v1       v2          v2' = v2 + (1 + e)/(1 + r)   (v1 - v2)
                            J   = (1 + e) r m/(1 + r)    (v1 - v2)

Momentum is conserved and the relative speed is reversed by e. With a large r the second ball is a free wall: the motion
of the first converges to that on an immovable floor as 1/r.
"""

from __future__ import annotations

from collections.abc import Mapping

from adapters.scene import Pair, Scene
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Track, Variation
from validation.scenes.parts import (
    PHASES,
    along,
    at,
    ball,
    between_impacts,
    delay,
    mass_of,
    phases,
    states_and_impulses,
)

RADIUS = 0.5
#: Runs for this long after the ideal contact [s]: softest engine compared keeps contact for about 0.05 s.
AFTERMATH = 0.45


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the surfaces meet at the origin after ``delay`` seconds."""
    mass, wait = params["mass"], params["delay"]
    bodies = [
        at(
            ball(name, dimension, own, RADIUS, 0.0),
            dimension,
            along(dimension, side * RADIUS - speed * wait),
            along(dimension, speed),
        )
        for name, own, side, speed in (
            ("first", mass, -1.0, params["v1"]),
            ("second", params["ratio"] * mass, 1.0, params["v2"]),
        )
    ]
    pairs = (Pair(restitution=params["e"], friction=0.0),)
    return Scene("head_on", 1, dimension, tuple(bodies), pairs, (0.0,) * dimension, wait + AFTERMATH, params)


def exact(scene: Scene) -> dict[str, float]:
    """Conservation of momentum and Newton's law of restitution."""
    p = scene.params
    closing, r, e = p["v1"] - p["v2"], p["ratio"], p["e"]
    return {
        "rebound_ratio": e,
        "first_speed": p["v1"] - (1.0 + e) * r / (1.0 + r) * closing,
        "second_speed": p["v2"] + (1.0 + e) / (1.0 + r) * closing,
        "impulse": (1.0 + e) * r / (1.0 + r) * p["mass"] * closing,
        "momentum_defect": 0.0,
    }


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Velocities at the end, impulses summed over the whole contact."""
    p = scene.params
    first, second = (float(v) for v in trajectory.twist[-1, :, 0])
    closing = p["v1"] - p["v2"]
    impulse = metrics.total_impulse(trajectory, 0, 1)
    change = p["mass"] * (first - p["v1"]) + p["ratio"] * p["mass"] * (second - p["v2"])
    return {
        "rebound_ratio": ((second - first) / closing, ""),
        "first_speed": (first, ""),
        "second_speed": (second, ""),
        "impulse": (None, impulse[1]) if impulse[0] is None else (float(impulse[0][0]), ""),
        "momentum_defect": (abs(change) / _momenta(p), ""),
    }


def _momenta(p: Params) -> float:
    """Size of the momenta that are added [N s]."""
    return p["mass"] * abs(p["v1"]) + p["ratio"] * p["mass"] * abs(p["v2"]) + p["mass"] * (p["v1"] - p["v2"])


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """One contact and no external force: exact at every step."""
    p = scene.params
    speeds = abs(p["v1"]) + abs(p["v2"])
    source = "conservation of momentum, Newton's law of restitution"
    scales = {
        "rebound_ratio": ("1", speeds / (p["v1"] - p["v2"])),
        "first_speed": ("m/s", speeds),
        "second_speed": ("m/s", speeds),
        "impulse": ("N s", p["mass"] * speeds),
    }
    found = bounds.exact_laws(scales, truth, source)
    defect = bounds.bookkeeping().check("momentum_defect", "1", truth["momentum_defect"], "conservation of momentum")
    return [*found, defect]


def track(scene: Scene) -> Track:
    """The first ball: straight in, straight out."""
    p = scene.params
    x = between_impacts(-RADIUS - p["v1"] * p["delay"], p["v1"], [(p["delay"], exact(scene)["first_speed"])])
    return Track("first", lambda t: along(scene.dimension, x(t)))


def rebound_error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Distance of the ratio of relative speeds from e."""
    value, reason = found["rebound_ratio"]
    return (None, reason) if value is None else (abs(value - scene.params["e"]), "")


SCENE = CanonicalScene(
    name="head_on",
    version=1,
    title="Two balls meet head-on, of any ratio of masses",
    symptoms=(
        "momentum is lost in a collision of two balls",
        "bodies rebound although restitution is zero",
        "two balls that collide leave with the wrong speeds",
        "two equal masses do not exchange their velocities",
        "restitution 0 is still bouncy",
        "kinetic energy is not conserved when two bodies collide",
        "bodies are faster after a collision than before it",
        "a heavy ball hits a light one and the light one is too fast or too slow",
        "an elastic collision of two spheres loses energy",
        "bodies of different mass collide wrongly",
        "two moving bodies stick together after they crash",
        "a completely plastic collision separates again",
        "two billiard balls meet straight on: the first does not stop",
    ),
    family="rebound",
    figure=__doc__ or "",
    law="v1' = v1 - (1 + e) r/(1 + r) (v1 - v2),  v2' = v2 + (1 + e)/(1 + r) (v1 - v2)",
    dimensions=(2, 3),
    parameters=(
        Parameter("ratio", 3.0, "1", "mass of the second ball over that of the first", 1e-6, 1e6),
        Parameter("e", 0.8, "1", "coefficient of restitution of the pair", 0.0, 1.0),
        Parameter("v1", 4.0, "m/s", "of the first ball, to the right", 0.0, 1e3, positive=True),
        Parameter("v2", -2.0, "m/s", "of the second ball; to the left, so that both move", -1e3, 0.0),
        delay(),
        mass_of("the first ball", 0.5),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states_and_impulses,
    track=track,
    quick=(Variation({}), Variation({"ratio": 1e6, "e": 0.5}, dimensions=(2,))),
    standard=(Variation({}), Variation({"ratio": 1.0, "e": 1.0}), Variation({"ratio": 1e6, "e": 0.5})),
    full=tuple(Variation({"ratio": 10.0**k, "e": e}) for k in range(-6, 7) for e in (0.0, 0.5, 0.8, 1.0)),
    planted=({},),
    primary=Primary(
        "rebound error",
        "1",
        f"largest |(v2' - v1')/(v1 - v2) - e| over {PHASES} contact times within a step",
        "the impact law between two free bodies, which a contact with a floor does not test; the worst phase counts",
        phases,
        rebound_error,
        "the whole scene: approach, contact, departure",
        order=0,
    ),
    words={
        "first_speed": "leaves the first ball with {value}",
        "second_speed": "leaves the second ball with {value}",
    },
)
