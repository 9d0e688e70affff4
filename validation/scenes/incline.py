"""A box on an incline sticks or slides.

       +---+
       |   | ->       sticks if tan(theta) <= mu,
    ==============    else a = g (sin(theta) - mu cos(theta))

Gravity is rotated by theta, not the floor: a tilted start in contact is not exactly representable and causes a
transient in some engines. ``ratio`` is tan(theta)/mu: 1 is the edge of the friction cone.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from adapters.scene import Pair, Scene
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import (
    CanonicalScene,
    Check,
    Measured,
    Member,
    Parameter,
    Params,
    Primary,
    Reduced,
    Searched,
    Steps,
    Study,
    Track,
    Variation,
)
from validation.scenes.parts import cube, floor, mass_of, standard_gravity, states

SIDE = 1.0
RATIOS = (0.5, 0.9, 0.99, 0.999, 1.001, 1.01, 1.1, 2.0)


def angle(params: Params) -> float:
    """Incline angle [rad]."""
    return math.atan(params["ratio"] * params["mu"])


def make(dimension: int, params: Params) -> Scene:
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


def track(scene: Scene) -> Track:
    """At rest, or the exact parabola."""
    start = scene.bodies[1].pose[: scene.dimension]
    a = exact(scene).get("acceleration", 0.0)
    return Track("box", lambda t: (start[0] + 0.5 * a * t * t, *start[1:]))


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """A box that sticks may slip once; one that slides is under constant forces."""
    g = scene.params["g"]
    if "creep" in truth:
        bound = bounds.stuck(g, dt, scene.duration)
        return [bound.check("creep", "m/s", truth["creep"], "Coulomb's law, static")]
    bound = bounds.driven(g, dt, 0.5 * scene.duration)
    return [bound.check("acceleration", "m/s^2", truth["acceleration"], "Coulomb's law, kinetic")]


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Equivalent acceleration in g: creep v over the run T moves the box as far as 2 v/T."""
    g, duration = scene.params["g"], scene.duration
    truth = exact(scene)
    metric = next(iter(truth))
    value, reason = found[metric]
    if value is None:
        return None, reason
    off = abs(value - truth[metric])
    return (2.0 * off / (g * duration) if metric == "creep" else off / g), ""


# ---- the threshold, from several ratios -----------------


def _slides(member: Member) -> bool:
    """Whether the box accelerates like a sliding one rather than creeping like a sticking one.

    It slides if its acceleration is more than half of what Coulomb's law gives at the same distance beyond the
    threshold: a slow creep, however wrong, does not accelerate.
    """
    distance = abs(member.params["ratio"] - 1.0)
    beyond = SCENE.scene(member.dimension, {**member.params, "ratio": 1.0 + distance})
    acceleration = member.metrics["acceleration"][0]
    return acceleration is not None and acceleration > 0.5 * exact(beyond)["acceleration"]


def threshold(members: Sequence[Member]) -> Reduced | None:
    """Middle of the bracket [largest ratio that sticks, smallest that slides], and half its width as bound."""
    # At the limit itself Coulomb's law allows sticking and sliding, so that cell is not used.
    telling = [member for member in members if member.params["ratio"] != 1.0]
    measured = [member for member in telling if member.metrics.get("acceleration", (None, ""))[0] is not None]
    ratios = [(member.params["ratio"], _slides(member)) for member in measured]
    below = [ratio for ratio, _ in ratios if ratio < 1.0]
    above = [ratio for ratio, _ in ratios if ratio > 1.0]
    if not below or not above:
        return None
    sliding = [ratio for ratio, slides in ratios if slides]
    low = max((ratio for ratio, slides in ratios if not slides and ratio < min(sliding, default=2e9)), default=None)
    bound = 0.5 * (min(above) - max(below))
    because = f"half the distance between the ratios tried next to 1, {max(below):g} and {min(above):g}"
    check = Check("threshold", "1", 1.0, bound, because, "Coulomb's law: sticks iff tan(theta) <= mu")
    if not sliding or low is None:
        return (
            (max(above) if not sliding else min(below)),
            "it never slides" if not sliding else "it never sticks",
            check,
        )
    return 0.5 * (low + min(sliding)), f"sticks at {low:g}, slides at {min(sliding):g}", check


SCENE = CanonicalScene(
    name="incline",
    version=1,
    title="Box on an incline, from sticking to sliding",
    symptoms=(
        "a box slides down a slope although friction should hold it",
        "static friction does not hold",
        "objects creep downhill on a ramp",
        "a block on an inclined plane never stops completely",
        "a parked car or crate slips slowly down a hill",
        "an object on a tilted floor drifts although mu is large",
        "at which angle does a block start to slide",
        "it slides on a ramp slower or faster than theory says",
        "a cube on a slope never sticks, it moves a millimetre a second",
        "friction on an incline is too small",
        "the box stays on the ramp although it should slide",
        "a body slides down a gentle slope with very high friction",
    ),
    family="friction",
    figure=__doc__ or "",
    law="sticks if tan(theta) <= mu, else a = g (sin(theta) - mu cos(theta))",
    dimensions=(2, 3),
    parameters=(
        Parameter("ratio", 0.9, "1", "tan(theta)/mu; 1 is the edge of the cone", 0.0, 100.0, positive=True),
        Parameter("mu", 0.5, "1", "friction of the pair", 0.0, 10.0, positive=True),
        standard_gravity(),
        mass_of("the box"),
        Parameter("duration", 2.0, "s", "the second half is measured", 0.1, 1e3),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    track=track,
    quick=tuple(Variation({"ratio": ratio}) for ratio in RATIOS),
    representative={"ratio": 1.1},  # a sliding box is more interesting to watch
    planted=({"ratio": 0.9}, {"ratio": 1.1}),
    primary=Primary(
        "acceleration error",
        "g",
        "largest of |a - a_exact| / g where it slides and 2 creep / (g T) where it sticks, "
        "tan(theta)/mu = 1.1, 0.9, 0.5, 2",
        "creep v over the run T moves the box as far as an acceleration 2 v / T: one unit on both sides of the "
        "threshold",
        lambda dt: [{"ratio": ratio} for ratio in (1.1, 0.9, 0.5, 2.0)],
        error,
        "the sliding box, half a second after the start",
        0.5,
        0.25,
        order=1,
    ),
    steps=Steps((1.0 / 60.0, 1.0 / 240.0), full_iterations=(1, 4, 30)),
    smooth=("acceleration", "creep"),
    studies=(Study("threshold", threshold),),
    searched=Searched(
        "slide",
        tuple({"ratio": ratio} for ratio in (0.5, 0.999, 1.001, 1.1, 2.0)),
        tuple({"ratio": ratio} for ratio in (0.9, 0.99, 1.01, 1.5)),
    ),
    words={"threshold": "lets go at {value} of the friction limit"},
)
