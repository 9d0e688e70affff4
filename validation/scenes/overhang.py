"""Blocks that are stacked as far out as they will stand.

               [_____]            the k-th block from above reaches L/(2 k) beyond the one below it:
            [_____]               then the centre of mass of all above lies over its edge,
        [_____]                   and n blocks reach  L/2 (1 + 1/2 + ... + 1/n)  beyond the first
    =====================         a share ``margin`` less stands, a share more falls

Each face carries a weight almost at its end. With a small margin, a block that yields a little, or a slop, is enough to
bring the stack down.
"""

from __future__ import annotations

from collections.abc import Mapping

from adapters.scene import Pair, Scene
from adapters.trajectory import Trajectory
from validation import bounds
from validation.canonical import GRAVITY, CanonicalScene, Check, Measured, Parameter, Params, Primary, Variation
from validation.scenes.parts import at, block, floor, upward
from validation.truths import columns

LENGTH, HEIGHT = 2.0, 0.5
#: Half the least rotation of a fallen block, which leans on the one below with its end on the floor [rad].
LEANS = 0.5 * HEIGHT / LENGTH


def _places(p: Params) -> list[float]:
    """Centres of the blocks along the floor [m], from below."""
    n = int(p["n"])
    places = [0.0]
    for k in range(n - 1, 0, -1):  # as many blocks stand on the edge of the one below
        places.append(places[-1] + (1.0 - p["margin"]) * 0.5 * LENGTH / k)
    return places


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: each block touches the one below."""
    p = params
    blocks = [
        at(block(f"block{k + 1}", dimension, p["mass"], LENGTH, HEIGHT), dimension, (x, (k + 0.5) * HEIGHT))
        for k, x in enumerate(_places(p))
    ]
    pairs = (Pair(restitution=0.0, friction=p["mu"]),)
    bodies = (floor(dimension), *blocks)
    return Scene("overhang", 1, dimension, bodies, pairs, upward(dimension, -p["g"]), p["duration"], p)


def exact(scene: Scene) -> dict[str, float]:
    """Equilibrium below the limit; beyond it only that the stack falls."""
    return {"stands": 1.0} | columns.exact(scene) if scene.params["margin"] > 0.0 else {"stands": 0.0}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """As for a column, and whether the block on top is still up: not half a block lower, nor inclined."""
    _, sunk, turned = (float(change) for change in trajectory.pose[-1, -1] - trajectory.pose[0, -1])
    stands = 1.0 if abs(sunk) < 0.5 * HEIGHT and abs(turned) < LEANS else 0.0
    return {"stands": (stands, "")} | columns.measure(scene, trajectory)


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """The bounds of a column."""
    told = bounds.Bound(0.5, "it stands or falls; half a block lower, or inclined, counts as fallen")
    found = [told.check("stands", "1", truth["stands"], "the centre of mass of each part lies over its support")]
    return found + (columns.checks(scene, dt, truth) if scene.params["margin"] > 0.0 else [])


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Larger of the drift and the deepest overlap, in heights of a block."""
    return columns.displacement(found, HEIGHT)


SCENE = CanonicalScene(
    name="overhang",
    version=1,
    title="Blocks stacked as far out as they stand",
    symptoms=(
        "blocks stacked as a staircase over an edge fall although they should stand",
        "a book that sticks out over the table's edge tips off",
        "a cantilever of bricks falls",
        "the harmonic stack does not stand",
        "how far can blocks overhang before they topple",
        "an object with its centre of mass inside the edge still falls off",
        "a box half over a ledge slowly slides or tips",
        "a stepped pile leans over the edge and does not collapse though it should",
    ),
    family="stacks and statics",
    figure=__doc__ or "",
    law="stands if each block reaches less than L/(2 k) beyond the next, k blocks on the edge",
    dimensions=(2,),
    parameters=(
        Parameter("n", 4.0, "1", "number of blocks", 2.0, 20.0, integer=True),
        Parameter("margin", 0.05, "1", "share of each overhang left as a margin; below 0 it falls", -0.5, 1.0),
        Parameter("mu", 0.5, "1", "friction of all pairs", 0.0, 10.0, positive=True),
        Parameter("g", GRAVITY, "m/s^2", "gravity", 0.0, 1e3, positive=True),
        Parameter("duration", 4.0, "s", "of the run; beyond the limit a fall takes time", 1.5, 100.0),
        Parameter("mass", 1.0, "kg", "of each block", 0.0, 1e6, positive=True),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=columns.sampling,
    quick=(Variation({}), Variation({"margin": 0.02})),
    full=tuple(Variation({"margin": m, "n": n}) for n in (2.0, 4.0, 8.0) for m in (0.2, 0.05, 0.005, 1e-6, -0.05)),
    planted=({},),
    primary=Primary(
        "displacement",
        "block heights",
        "larger of the drift and of the deepest overlap",
        "a stack that falls shows in both",
        lambda dt: [{}],
        error,
        "the resting stack",
        1.0,
        1.0,
    ),
    size="n",
    words={"stands": "stands at the end: {value} (1: yes, 0: no)"},
)
