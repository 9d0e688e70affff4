"""A box slides to a stop on a plate far from the origin, which must not matter.

                                              +---+  v
                                              |   | -->        stops after d = v^2/(2 mu g),
    0 ....................................  =============      as at the origin
    |<---------------- far ----------------->|

Floating-point numbers have a relative precision: at 1e6 m positions are known to 1e-10 m in doubles, to 6 cm in floats.
Small differences of large coordinates (contact points, depths, lever arms) show it here.
"""

from __future__ import annotations

from dataclasses import replace

from adapters.scene import Body, Box, Pair, Scene
from validation.canonical import CanonicalScene, Check, Parameter, Params, Primary, Variation
from validation.scenes.parts import along, mass_of, pose_at, standard_gravity, states, upward
from validation.truths import sliding

HEIGHT, THICKNESS = 0.5, 1.0


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: plate and box as far along each level axis, and as high up."""
    p = params
    away = (p["far"],) * dimension
    long = 1.5 * sliding.way(p) + p["aspect"] * HEIGHT
    low = along(dimension, 0.0, -0.5 * THICKNESS)
    plate = Body(
        "plate",
        Box((long, *(2.0,) * (dimension - 2), 0.5 * THICKNESS)),
        pose=pose_at(dimension, tuple(a + b for a, b in zip(away, low, strict=True))),
        motion="fixed",
    )
    box = sliding.launched(dimension, p, p["aspect"] * HEIGHT, HEIGHT)
    place = tuple(a + b for a, b in zip(away, box.pose[:dimension], strict=True))
    bodies = (plate, replace(box, pose=pose_at(dimension, place)))
    pairs = (Pair(restitution=0.0, friction=p["mu"]),)
    return Scene("far_origin", 1, dimension, bodies, pairs, upward(dimension, -p["g"]), sliding.lasts(p), p)


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """Those of a box at the origin, and the round-off of coordinates at that distance."""
    return sliding.checks(scene, dt, truth, scene.params["far"])


SCENE = CanonicalScene(
    name="far_origin",
    family="hard",
    version=1,
    title="Box that slides to a stop far away from the origin",
    symptoms=(
        "it behaves differently far away from the origin",
        "a large world loses precision",
        "objects jitter far from the centre of the world",
        "at coordinates of a million metres friction goes wrong",
        "floating point errors in a big open world",
        "physics shakes when the player is kilometres away",
        "single precision is too coarse at large positions",
        "bodies sink or slide at a great distance from zero",
        "results change when the whole scene is shifted",
    ),
    figure=__doc__ or "",
    law="d = v^2/(2 mu g), wherever it is",
    dimensions=(2, 3),
    parameters=(
        Parameter("far", 1048576.0, "m", "distance from the origin along every axis; 2^20 is exact", 0.0, 1e9),
        Parameter("v", 3.0, "m/s", "speed at the start", 0.0, 1e2, positive=True),
        Parameter("mu", 0.4, "1", "friction; below aspect, so that the box does not tip", 0.0, 1.0, positive=True),
        Parameter("aspect", 1.5, "1", "width over height of the box", 1.1, 20.0),
        standard_gravity(),
        mass_of("the box"),
    ),
    make=make,
    exact=sliding.exact,
    measure=sliding.measure,
    rule=checks,
    sampling=states,
    track=sliding.track,
    quick=(Variation({}),),
    full=tuple(Variation({"far": far}) for far in (0.0, 1024.0, 1048576.0, 1e8)),
    planted=({},),
    primary=Primary(
        "stopping error",
        "way",
        "distance of the place where it stops from the exact one, over the length of its slide",
        "one number for friction, overlap and lever arms, which are differences of large coordinates",
        lambda dt: [{}],
        sliding.error,
        "the sliding box",
        0.1,
        0.25,
    ),
    words=sliding.WORDS,
)
