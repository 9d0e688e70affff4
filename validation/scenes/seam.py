"""A box slides over flush plates, whose seams must not matter.

       +---+  v
       |   | -->              stops after d = v^2/(2 mu g), as on one face:
    +--+---+-+------+------+  no hop, no turn, no bump at any seam
    +--------+------+------+

Contacts of two flush faces with one box are those of one face. Contact detection for each plate alone finds the inner
sides of plates, and these wrong contacts stop or lift the sliding box.
"""

from __future__ import annotations

import math

from adapters.scene import Body, Box, Pair, Scene
from validation.canonical import CanonicalScene, Check, Parameter, Params, Primary, Variation
from validation.scenes.parts import along, mass_of, pose_at, standard_gravity, states, upward
from validation.truths import sliding

HEIGHT, THICKNESS = 0.5, 0.5


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: plates as long as ``plate``, the box in the middle of the first."""
    p = params
    width, half = p["aspect"] * HEIGHT, 0.5 * p["plate"]
    # Room for a stop that is too late: half as much again, and the box itself.
    count = math.ceil((half + 1.5 * sliding.way(p) + width) / p["plate"])
    plates = tuple(_plate(f"plate{k + 1}", dimension, p["plate"], k * p["plate"]) for k in range(count))
    box = sliding.launched(dimension, p, width, HEIGHT)
    pairs = (Pair(restitution=0.0, friction=p["mu"]),)
    bodies, gravity = (*plates, box), upward(dimension, -p["g"])
    return Scene("seam", 1, dimension, bodies, pairs, gravity, sliding.lasts(p), p)


def _plate(name: str, dimension: int, length: float, x: float) -> Body:
    """A fixed plate with its upper face at level 0, wide enough."""
    half = (0.5 * length, *(2.0,) * (dimension - 2), 0.5 * THICKNESS)
    return Body(name, Box(half), pose=pose_at(dimension, along(dimension, x, -0.5 * THICKNESS)), motion="fixed")


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """Those of a box on one face: seams have no extra tolerance."""
    return sliding.checks(scene, dt, truth, abs(scene.bodies[-2].pose[0]))


SCENE = CanonicalScene(
    name="seam",
    family="hard",
    version=1,
    title="Box that slides over the seams of flush plates",
    symptoms=(
        "an object trips or stumbles at the seam between two tiles",
        "ghost collisions at internal edges of a flat floor",
        "a box catches on the edge between two ground segments",
        "a sliding body is stopped by an invisible bump on flat ground",
        "the character gets stuck between adjacent tiles",
        "internal edges of a height field or terrain kick the body",
        "a box sliding over flush plates turns or slows down",
        "a hidden edge of a triangle mesh trips a sliding crate",
    ),
    figure=__doc__ or "",
    law="d = v^2/(2 mu g), straight on and level, as on one face",
    dimensions=(2, 3),
    parameters=(
        Parameter("v", 3.0, "m/s", "speed at the start", 0.0, 1e2, positive=True),
        Parameter("mu", 0.4, "1", "friction; below aspect, so that the box does not tip", 0.0, 1.0, positive=True),
        Parameter("plate", 1.0, "m", "length of a plate; the shorter, the more seams", 0.01, 1e2, positive=True),
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
    full=tuple(Variation({"plate": a, "v": v}) for a in (0.3, 1.0) for v in (1.0, 3.0, 10.0)),
    planted=({},),
    primary=Primary(
        "stopping error",
        "way",
        "distance of the place where it stops from the exact one, over the length of its slide",
        "a wrong contact at a flush edge stops a sliding body or throws it",
        lambda dt: [{}],
        sliding.error,
        "the sliding box",
        0.1,
        0.25,
    ),
    words=sliding.WORDS,
)
