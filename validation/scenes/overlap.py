"""Two balls start with an overlap in free space, moving side by side: an overlap is not a spring.

       ,---.---.    ^
      (  o  ( ) o  ) | v    against each other 0 -> 0: no energy is in an overlap,
       `---'---'    |       the common centre goes straight on,
           |<>| depth       and the overlap does not grow

Rigid bodies do not overlap, and rigid-body mechanics does not define how fast they separate; but they must not be
thrown. Correcting an overlap by a velocity leaves the bodies in motion: a share beta of the depth within a step is a
speed beta depth/dt, which depends on the step and on nothing physical. The common motion does not matter; it is the
scale of speeds.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from adapters.scene import Pair, Scene
from adapters.trajectory import Trajectory
from validation import bounds
from validation.canonical import CanonicalScene, Check, Frontier, Measured, Parameter, Params, Primary, Variation
from validation.geometry import overlap
from validation.scenes.parts import along, at, ball, mass_of, states, upward

RADIUS = 0.5


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the first ball at the origin, the second ``depth`` radii too near."""
    p = params
    near = (2.0 - p["depth"]) * RADIUS
    ahead = upward(dimension, p["v"])
    first = ball("first", dimension, p["mass"], RADIUS, 0.0)
    second = ball("second", dimension, p["mass"] * p["ratio"], RADIUS, 0.0)
    bodies = (at(first, dimension, along(dimension, 0.0), ahead), at(second, dimension, along(dimension, near), ahead))
    pairs = (Pair(restitution=0.0, friction=0.0),)
    return Scene("overlap", 1, dimension, bodies, pairs, (0.0,) * dimension, p["duration"], p)


def exact(scene: Scene) -> dict[str, float]:
    """Without forces energy and momentum stay 0."""
    return {"thrown": 0.0, "centre_moved": 0.0, "grown": 0.0}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Largest relative speed, motion of the common centre along the line, growth of the overlap, and its rest."""
    d = scene.dimension
    masses = np.array([body.mass for body in scene.bodies])
    relative = trajectory.twist[:, 1, :d] - trajectory.twist[:, 0, :d]
    centre = trajectory.pose[:, :, 0] @ masses / masses.sum()
    shapes, pose = [body.shape for body in scene.bodies], trajectory.pose
    depth = overlap(shapes[0], pose[:, 0], shapes[1], pose[:, 1])
    return {
        "thrown": (float(np.linalg.norm(relative, axis=1).max()), ""),
        "centre_moved": (float(np.abs(centre - centre[0]).max()), ""),
        "grown": (float(np.maximum(0.0, depth - depth[0]).max()), ""),
        "left": (float(depth[-1] / depth[0]), ""),
    }


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """Conservation laws hold at every step; the rest of the overlap is shown only, as no law defines its decay."""
    deep = scene.params["depth"] * RADIUS
    source = "conservation of energy and momentum: a contact that does not close does no work"
    thrown = bounds.Bound(
        bounds.ROUND_OFF * (deep / dt + scene.params["v"]),
        "exact law at every dt: round-off of the speed that removes the overlap in a step",
    )
    reach = RADIUS + scene.params["v"] * scene.duration
    placed = bounds.Bound(bounds.ROUND_OFF * reach, "exact law at every dt: round-off of positions")
    return [
        thrown.check("thrown", "m/s", truth["thrown"], source),
        placed.check("centre_moved", "m", truth["centre_moved"], source),
        placed.check("grown", "m", truth["grown"], "bodies that overlap are not pulled together"),
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
    """Speed caused by the overlap, over the speed that removes it in one step."""
    value, reason = found["thrown"]
    return (None, reason) if value is None else (value * dt / (scene.params["depth"] * RADIUS), "")


def fate(scene: Scene, found: Mapping[str, Measured]) -> str:
    """How it failed, as one word, or nothing."""
    thrown, moved, grown = (found[name][0] for name in ("thrown", "centre_moved", "grown"))
    if thrown is None or moved is None or grown is None:
        return "no answer"
    if thrown > scene.params["v"]:
        return "flew apart"
    if moved > 0.1 * RADIUS:
        return "drove off"
    return "sank in" if grown > 0.1 * scene.params["depth"] * RADIUS else ""


SCENE = CanonicalScene(
    name="overlap",
    family="hard",
    version=1,
    title="Two balls that start inside each other",
    symptoms=(
        "objects that start inside each other explode",
        "overlapping bodies fly apart",
        "spawning objects in the same place makes them shoot off",
        "two spheres created too close are thrown apart",
        "initial penetration gives a huge velocity",
        "bodies inserted into each other never separate",
        "a penetration at the start adds energy",
        "intersecting objects at reset blow up",
        "two bodies placed on top of one another by accident burst apart",
        "bodies that begin interpenetrated stay stuck together",
    ),
    figure=__doc__ or "",
    law="an overlap causes no speed and does not move the common centre; it is not a spring",
    dimensions=(2, 3),
    parameters=(
        Parameter("depth", 0.5, "radii", "of the overlap at the start", 0.0, 1.0, positive=True),
        Parameter("ratio", 1.0, "1", "mass of the second ball over that of the first", 1e-6, 1e6),
        Parameter("v", 1.0, "m/s", "of both, across the line between them", 0.0, 1e3, positive=True),
        mass_of("the first ball"),
        Parameter("duration", 1.0, "s", "of the run", 0.1, 1e3),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    quick=(Variation({}), Variation({"depth": 0.01, "ratio": 100.0})),
    full=tuple(Variation({"depth": a, "ratio": r}) for a in (1e-3, 0.01, 0.1, 0.5) for r in (1.0, 100.0)),
    planted=({}, {"depth": 1e-3}),
    primary=Primary(
        "thrown",
        "depth/dt",
        "largest relative speed, over the speed that removes the overlap in one step",
        "the share of an overlap that an engine turns into motion",
        lambda dt: [{}],
        error,
        "the two balls coming apart",
    ),
    frontiers=(
        Frontier(
            "overlap",
            "radii",
            "depth",
            1e-4,
            1.0,
            1.0,
            fate,
            "separated more slowly than both move on (1 m/s), with their centre within a tenth of a radius, and no "
            "deeper by a tenth of the overlap",
        ),
    ),
    words={
        "thrown": "throws them apart with {value}",
        "centre_moved": "moves their common centre by {value}",
        "grown": "lets the overlap grow by {value}",
        "left": "leaves {value} of the overlap",
    },
)
