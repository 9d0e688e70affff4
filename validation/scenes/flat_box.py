"""A box lands flat on a floor, on all its corners at once, in free space.

        +-------+
        |       |  v          v+ = -e v-,  no spin, nothing sideways
        +-------+
        |       |             (no gravity: nothing else acts)
    =================

The corners hit together and each must leave with e times its speed: their impulses are coupled, so one pass over them,
corner by corner, leaves the box spinning and slow. The coupling of a wide box is stronger than a cube's.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from adapters.scene import Pair, Scene
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import (
    CanonicalScene,
    Check,
    Measured,
    Parameter,
    Params,
    Primary,
    Restitution,
    Track,
    Variation,
)
from validation.scenes.parts import (
    PHASES,
    at,
    between_impacts,
    block,
    delay,
    floor,
    mass_of,
    phases,
    states_and_impulses,
    upward,
)

HEIGHT = 1.0
#: Runs for this long after the ideal contact [s]: softest engine compared keeps contact for about 0.05 s.
AFTERMATH = 0.45


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the lower face reaches the floor after ``delay`` seconds."""
    p = params
    box = at(
        block("box", dimension, p["mass"], p["aspect"] * HEIGHT, HEIGHT),
        dimension,
        upward(dimension, 0.5 * HEIGHT + p["v"] * p["delay"]),
        upward(dimension, -p["v"]),
    )
    pairs = (Pair(restitution=p["e"], friction=p["mu"]),)
    duration = p["delay"] + AFTERMATH
    return Scene("flat_box", 1, dimension, (floor(dimension), box), pairs, upward(dimension, 0.0), duration, p)


def exact(scene: Scene) -> dict[str, float]:
    """By symmetry the box does not rotate: Newton's law of restitution for the whole box."""
    e, v, mass = scene.params["e"], scene.params["v"], scene.params["mass"]
    return {"rebound_ratio": e, "edge_speed": 0.0, "sideways": 0.0, "impulse": mass * (1.0 + e) * v}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Velocities at the end; spin as the speed that it gives an upper corner, relative to the centre."""
    d, box = scene.dimension, scene.bodies[1]
    linear, angular = trajectory.twist[-1, 1, :d], trajectory.twist[-1, 1, d:]
    spin = math.hypot(*(float(w) for w in angular))
    impulse = metrics.total_impulse(trajectory, 0, 1)
    return {
        "rebound_ratio": (float(linear[-1]) / scene.params["v"], ""),
        "edge_speed": (spin * metrics.reach(box.shape), ""),
        "sideways": (math.hypot(*(float(v) for v in linear[:-1])), ""),
        "impulse": (None, impulse[1]) if impulse[0] is None else (float(impulse[0][-1]), ""),
    }


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """One body that touches at all its corners: the law is that of a ball, exact at every step."""
    v, mass, reach = scene.params["v"], scene.params["mass"], metrics.reach(scene.bodies[1].shape)
    source = "symmetry and Newton's law of restitution; no external force"
    # A corner's impulse has round-off, which turns the box by the ratio of its lever arm to its radius of gyration.
    arm = max(1.0, reach / HEIGHT) ** 2
    scales = {
        "rebound_ratio": ("1", 1.0),
        "edge_speed": ("m/s", v * arm),
        "sideways": ("m/s", v),
        "impulse": ("N s", mass * v),
    }
    return bounds.exact_laws(scales, truth, source)


def track(scene: Scene) -> Track:
    """Straight in, straight out."""
    p = scene.params
    height = between_impacts(0.5 * HEIGHT + p["v"] * p["delay"], -p["v"], [(p["delay"], p["e"] * p["v"])])
    return Track("box", lambda t: upward(scene.dimension, height(t)))


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Larger of the rebound's distance from e and of the speed that spin gives a corner, relative to the approach."""
    rebound, edge = found["rebound_ratio"], found["edge_speed"]
    if rebound[0] is None or edge[0] is None:
        return None, rebound[1] or edge[1]
    return metrics.largest([abs(rebound[0] - scene.params["e"]), edge[0] / scene.params["v"]]), ""


SCENE = CanonicalScene(
    name="flat_box",
    version=1,
    title="Box that lands flat, on all corners at once",
    symptoms=(
        "a box that lands flat starts to spin or tips over",
        "a cube dropped level on the floor bounces off at an angle",
        "a flat landing is not symmetric: one corner rebounds more",
        "a box that falls straight down rotates after the impact",
        "a box bounces less than a ball of the same restitution",
        "a dropped crate does not bounce evenly on all its corners",
        "a plank landing flat tumbles",
        "a cuboid hops sideways after it falls flat on the ground",
        "restitution works for a sphere but not for a box",
        "all four corners touch at once and the box still gains spin",
    ),
    family="rebound",
    figure=__doc__ or "",
    law="v+ = -e v-, no spin: the corners' impulses are solved together",
    dimensions=(2, 3),
    parameters=(
        Parameter("e", 0.5, "1", "coefficient of restitution of the pair", 0.0, 1.0),
        Parameter("aspect", 1.0, "1", "width over height; corners of a wide box couple more", 0.1, 20.0),
        Parameter("v", 3.0, "m/s", "approach speed", 0.0, 1e3, positive=True),
        Parameter("mu", 0.3, "1", "friction of the pair; nothing moves along the floor", 0.0, 10.0),
        delay(),
        mass_of("the box"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states_and_impulses,
    track=track,
    standard=(Variation({}), Variation({"e": 1.0}), Variation({"e": 0.8, "aspect": 4.0})),
    full=tuple(Variation({"e": e, "aspect": a}) for e in (0.0, 0.2, 0.5, 0.8, 1.0) for a in (0.25, 1.0, 4.0, 10.0)),
    planted=({},),
    primary=Primary(
        "rebound error",
        "1",
        f"larger of |v+/v- - e| and of a corner's speed by spin over v-, over {PHASES} contact times within a step",
        "restitution at several contacts of a body is exact only if they are solved together; solving one after the "
        "other leaves spin",
        phases,
        error,
        "the whole scene: approach, contact, departure",
    ),
    words={
        "edge_speed": "spins: its corners move with {value}",
        "sideways": "leaves sideways with {value}",
    },
    restitution=Restitution("rebound_ratio", "e", "v"),
)
