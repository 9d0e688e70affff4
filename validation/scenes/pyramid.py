"""A wall of boxes, each over the gap between two others, at rest.

            +---+          1
          +---++---+       2       each row carries the weight above it:
        +---++---++---+    ...         sum of its contacts = weight of all rows above
        ================           nothing moves, drifts or sinks

The shares of the contacts of a row are not determined (a rigid box on two others has more contacts than equations of
balance); their sum is. Boxes of a row are apart, so that nothing is squeezed between them.
"""

from __future__ import annotations

from adapters.scene import Body, Pair, Scene
from adapters.trajectory import Trajectory
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Steps, Track, Variation
from validation.scenes.parts import along, at, cube, floor, mass_of, standard_gravity, upward
from validation.truths import columns

SIDE = 1.0
#: Distance of the boxes of a row: a box stands on 0.45 of its width at either end.
GAP = 0.1


def layers(count: int) -> list[list[int]]:
    """Indices of the bodies of each row, from the floor up: ``count`` boxes in the lowest one."""
    found, first = [[0]], 1
    for boxes in range(count, 0, -1):
        found.append(list(range(first, first + boxes)))
        first += boxes
    return found


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: every box touches those below."""
    boxes = list[Body]()
    for row, indices in enumerate(layers(int(params["rows"]))[1:]):
        for k, index in enumerate(indices):
            x = (k - 0.5 * (len(indices) - 1)) * (SIDE + GAP)
            box = cube(f"box{index}", dimension, params["mass"], SIDE, 0.0)
            boxes.append(at(box, dimension, along(dimension, x, (row + 0.5) * SIDE)))
    pairs = (Pair(restitution=0.0, friction=params["mu"]),)
    bodies = (floor(dimension), *boxes)
    return Scene("pyramid", 1, dimension, bodies, pairs, upward(dimension, -params["g"]), params["duration"], params)


def exact(scene: Scene) -> dict[str, float]:
    """Equilibrium of every row, and of all above it."""
    return columns.exact(scene, layers(int(scene.params["rows"])))


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """As for a column, row by row."""
    return columns.measure(scene, trajectory, layers(int(scene.params["rows"])))


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """As for a column with an interface per row."""
    return columns.checks(scene, dt, truth)


def track(scene: Scene) -> Track:
    """The box at the top at rest."""
    top = scene.bodies[-1]
    return Track(top.name, lambda t: top.pose[: scene.dimension])


SCENE = CanonicalScene(
    name="pyramid",
    family="stacks and statics",
    version=1,
    title="Wall of boxes, each over a gap, in equilibrium",
    symptoms=(
        "a wall or pyramid of boxes collapses",
        "a brick wall creeps and falls down",
        "a pyramid of crates spreads at the bottom",
        "a castle of blocks breaks down on its own",
        "bricks laid with an overlap drift apart",
        "rows of cubes sink into the rows below",
        "a triangle of stacked boxes never sleeps",
        "a wall of a hundred bricks jitters",
        "a heap of boxes in rows is unstable",
    ),
    figure=__doc__ or "",
    law="nothing moves; the contacts below a row carry the weight above them, however they share it",
    dimensions=(2, 3),
    parameters=(
        Parameter("rows", 3, "1", "boxes in the lowest row; n (n + 1)/2 in all", 1, 30, integer=True),
        Parameter("mu", 0.5, "1", "friction of every pair", 0.0, 10.0),
        standard_gravity(),
        mass_of("each box"),
        Parameter("duration", 4.0, "s", "long enough for a slow sway to show", 1.0, 1e4),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=columns.sampling,
    track=track,
    quick=(Variation({}), Variation({"rows": 5}, dimensions=(2,))),
    full=tuple(Variation({"rows": n}) for n in (2, 4, 6, 10)),
    planted=({},),
    primary=Primary(
        "displacement",
        "side",
        "larger of the sideways drift and the deepest overlap within 4 s, per side of a box",
        "nothing may move, so any motion is error; loads are left out because any wall at rest carries its weight "
        "on average",
        lambda dt: [{}],
        lambda scene, dt, found: columns.displacement(found, SIDE),
        "the standing wall, half a second after the start",
        0.5,
        0.25,
    ),
    steps=Steps((1.0 / 60.0, 1.0 / 240.0)),
)
