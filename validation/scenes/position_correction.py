"""A box that starts below the floor's surface, under gravity, rises to the floor and no higher.

       +---+                 +---+
       |   |                 |   |
    ===|   |===   ------>  ==+---+==      highest place: on the floor
       +---+ depth                        nothing thrown, nothing sideways

The box can rise only by a correction of positions, which must not cause motion. A correction by velocity (Baumgarte:
beta depth/dt) throws the box v^2/(2 g) high, higher with smaller steps.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from adapters.scene import Pair, Scene
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Variation
from validation.scenes.parts import cube, floor, mass_of, standard_gravity, states, upward

SIDE = 1.0


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the lower face is ``depth`` sides below the floor."""
    p = params
    box = cube("box", dimension, p["mass"], SIDE, (0.5 - p["depth"]) * SIDE)
    pairs = (Pair(restitution=0.0, friction=p["mu"]),)
    bodies, gravity = (floor(dimension), box), upward(dimension, -p["g"])
    return Scene("position_correction", 1, dimension, bodies, pairs, gravity, p["duration"], p)


def exact(scene: Scene) -> dict[str, float]:
    """At most on the floor; nothing acts sideways."""
    return {"launched": 0.0, "sunk": 0.0, "drift": 0.0}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Greatest height above a box on the floor, lowest place below the start, motion along the floor, final depth."""
    height, deep = trajectory.pose[:, 1, scene.dimension - 1], scene.params["depth"] * SIDE
    return {
        "launched": (metrics.largest([0.0, height.max() - 0.5 * SIDE]), ""),
        "sunk": (metrics.largest([0.0, height[0] - height.min()]), ""),
        "drift": (metrics.lateral_drift(trajectory), ""),
        "left": (float(np.clip(0.5 * SIDE - height[-1], 0.0, None)) / deep, ""),
    }


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """A contact may be found one step late, at either end; the final depth has no law and is only shown."""
    g, source = scene.params["g"], "conservation of energy: a contact that does not close does no work"
    late = bounds.found_late(g, dt, SIDE)
    return [
        late.check("launched", "m", truth["launched"], source),
        late.check("sunk", "m", truth["sunk"], "a contact carries the weight, however deep it is"),
        bounds.slips(1, g, dt).check("drift", "m", truth["drift"], "symmetry"),
        Check(
            "left",
            "1",
            None,
            None,
            "shown: rigid-body mechanics does not define how fast an overlap is corrected",
            "depth at the end over that at the start",
        ),
    ]


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Height to which the box is thrown, over the depth."""
    value, reason = found["launched"]
    return (None, reason) if value is None else (value / (scene.params["depth"] * SIDE), "")


SCENE = CanonicalScene(
    name="position_correction",
    family="hard",
    version=1,
    title="Box that starts sunk into the floor",
    symptoms=(
        "penetration pops out and throws the body into the air",
        "a sunk body jumps out of the floor",
        "a body placed slightly in the ground is launched",
        "pushing a body out of the floor gives it speed",
        "the correction of penetration is too violent",
        "an object sunk in the floor rises too slowly or stays there",
        "a character teleported into the ground is shot upwards",
        "overlap with the floor is not corrected",
        "error reduction (ERP, Baumgarte) adds energy",
        "a body stays buried some millimetres deep for ever",
        "a box below the ground pops up when the simulation starts",
    ),
    figure=__doc__ or "",
    law="rises to the floor and no higher: correcting a position causes no motion",
    dimensions=(2, 3),
    parameters=(
        Parameter("depth", 0.1, "sides", "below the floor at the start", 0.0, 0.49, positive=True),
        Parameter("mu", 0.5, "1", "friction of the pair", 0.0, 10.0),
        standard_gravity(),
        mass_of("the box"),
        Parameter("duration", 2.0, "s", "long enough to be thrown up and to fall down again", 0.1, 1e3),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    quick=(Variation({}, dimensions=(2,)), Variation({"depth": 0.01}, dimensions=(2,))),
    full=tuple(Variation({"depth": a}) for a in (1e-3, 0.01, 0.1, 0.3)),
    planted=({}, {"depth": 1e-3}),
    primary=Primary(
        "launch",
        "depth",
        "height above the floor to which the box is thrown, over the depth at which it started",
        "the share of a correction that is motion",
        lambda dt: [{}],
        error,
        "the box coming up and at rest",
    ),
    words={
        "launched": "throws the box {value} above the floor",
        "sunk": "lets the box sink {value} deeper",
        "left": "leaves {value} of the depth",
    },
)
