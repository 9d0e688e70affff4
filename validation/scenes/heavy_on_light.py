"""A heavy box stands on a light one and should stay there.

        +---+  r m
        |   |             the lower interface carries (1 + r) m g,
        +---+  m          the upper one r m g
        |   |             nothing moves, drifts or sinks
    ==============

The light box is pressed between two large forces that nearly cancel. The residual of a solver, or softness in units of
the light box's mass, squeezes it out or lets the heavy one sink in. It starts in exact contact.
"""

from __future__ import annotations

from adapters.scene import Pair, Scene
from validation.canonical import CanonicalScene, Frontier, Parameter, Params, Primary, Steps, Track, Variation
from validation.scenes.parts import cube, floor, mass_of, standard_gravity, upward
from validation.truths import columns

SIDE = 1.0


def make(dimension: int, params: Params) -> Scene:
    """Build the pair."""
    light = cube("light", dimension, params["mass"], SIDE, 0.5 * SIDE)
    heavy = cube("heavy", dimension, params["ratio"] * params["mass"], SIDE, 1.5 * SIDE)
    return Scene(
        "heavy_on_light",
        1,
        dimension,
        (floor(dimension), light, heavy),
        (Pair(restitution=0.0, friction=params["mu"]),),
        upward(dimension, -params["g"]),
        params["duration"],
        params,
    )


def track(scene: Scene) -> Track:
    """The heavy box at rest."""
    top = scene.bodies[-1]
    return Track(top.name, lambda t: top.pose[: scene.dimension])


SCENE = CanonicalScene(
    name="heavy_on_light",
    version=1,
    title="Heavy box on a light one, in equilibrium",
    symptoms=(
        "a heavy object sinks into a light one",
        "a large mass ratio is unstable",
        "a heavy box crushes or squashes the light box below it",
        "a tank on top of a small crate jitters and sinks",
        "bodies with very different masses penetrate each other",
        "a light body under a heavy one is pressed into the floor",
        "the solver does not converge when a heavy load lies on a light body",
        "a weight of a hundred kilograms on a one kilogram block goes through it",
        "a heavy body on a light one shakes or is thrown off",
        "putting a load on a light platform makes it sink",
    ),
    family="stacks and statics",
    figure=__doc__ or "",
    law="nothing moves; each interface carries the weight above it, whatever the ratio of masses",
    dimensions=(2, 3),
    parameters=(
        Parameter("ratio", 100.0, "1", "mass of the upper box over that of the lower", 1e-3, 1e6),
        Parameter("mu", 0.5, "1", "friction of every pair", 0.0, 10.0),
        standard_gravity(),
        mass_of("the lower box"),
        Parameter("duration", 5.0, "s", "long enough for a slow sinking to show", 1.0, 1e4),
    ),
    make=make,
    exact=columns.exact,
    measure=columns.measure,
    rule=columns.checks,
    sampling=columns.sampling,
    track=track,
    frontiers=(Frontier("mass ratio", "", "ratio", 1.0, 1e6, 1e6, columns.fate, columns.STANDS),),
    quick=(Variation({}), Variation({"ratio": 1e4}, dimensions=(2,))),
    standard=(Variation({}), Variation({"ratio": 1e4})),
    full=tuple(Variation({"ratio": 10.0**k}, (None, 1, 10, 100)) for k in range(6)),
    planted=({},),
    primary=Primary(
        "displacement",
        "side",
        "larger of the sideways drift and the deepest overlap within 5 s, per side of a box, at the default ratio",
        "nothing may move, so any motion is error, sideways or into the neighbour",
        lambda dt: [{}],
        lambda scene, dt, found: columns.displacement(found, SIDE),
        "the standing pair, half a second after the start",
        0.5,
        0.25,
    ),
    steps=Steps((1.0 / 60.0, 1.0 / 240.0)),
    smooth=("penetration",),
)
