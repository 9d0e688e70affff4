"""A column of boxes at rest.

        +---+  n
        +---+  ...        interface i carries the weight above it:
        +---+  2             p_i = (n - i + 1) m g dt   per step
        +---+  1          nothing moves, drifts or sinks
    ==============

It starts in exact contact, so any motion is the engine's. The forces on each box cancel at every step.
"""

from __future__ import annotations

import numpy as np

from adapters.scene import Pair, Scene
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.bounds import WINDOW
from validation.canonical import (
    CanonicalScene,
    Check,
    Frontier,
    Measured,
    Parameter,
    Params,
    Primary,
    Searched,
    Steps,
    Track,
    Variation,
)
from validation.scenes.parts import cube, floor, mass_of, standard_gravity, upward
from validation.truths import columns

SIDE = 1.0
HEIGHTS = (1, 2, 5, 10, 20)
SWEEPS = (1, 4, 10, 30, 100)


def make(dimension: int, params: Params) -> Scene:
    """Build the column."""
    n = int(params["n"])
    boxes = tuple(cube(f"box{i}", dimension, params["mass"], SIDE, (i - 0.5) * SIDE) for i in range(1, n + 1))
    return Scene(
        "stack",
        1,
        dimension,
        (floor(dimension), *boxes),
        (Pair(restitution=0.0, friction=params["mu"]),),
        upward(dimension, -params["g"]),
        params["duration"],
        params,
    )


def exact(scene: Scene) -> dict[str, float]:
    """The truth of a column, and the least and greatest load of all steps, relative to the weight above."""
    return columns.exact(scene) | {"load[least]": 1.0, "load[greatest]": 1.0, "unbalanced": 0.0}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """The metrics of a column, and over the last second the load of each interface and the force on each box."""
    n, weight = len(scene.bodies), scene.params["mass"] * scene.params["g"]
    begin = trajectory.t[-1] - WINDOW
    up = [metrics.forces(trajectory, i, [i - 1], begin)[:, -1] / weight for i in range(1, n)]
    loads = np.concatenate([load / (n - i) for i, load in enumerate(up, 1)])
    # The box above pushes down with the force on it; nothing stands on the last one.
    off = np.abs(np.array(up) - np.array([*up[1:], np.zeros_like(up[-1])]) - 1.0)
    unbalanced = metrics.over_time("", off.ravel(), ("greatest",))["[greatest]"]
    return {
        **columns.measure(scene, trajectory),
        **metrics.over_time("load", loads, ("least", "greatest")),
        "unbalanced": unbalanced,
    }


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """The checks of a column, and the same for every step: for the weight above, and for each box."""
    balance = bounds.steady().check("unbalanced", "1", truth["unbalanced"], "equilibrium of forces on each box")
    return [
        *columns.checks(scene, dt, truth),
        *bounds.load("load", dt, truth, "weight above the interface"),
        balance,
    ]


def track(scene: Scene) -> Track:
    """The top box at rest."""
    top = scene.bodies[-1]
    return Track(top.name, lambda t: top.pose[: scene.dimension])


def _heights(*swept: int) -> tuple[Variation, ...]:
    """Every height at the profiles' own iterations; heights in ``swept`` at other counts as well."""
    return tuple(Variation({"n": n}, (None, *SWEEPS) if n in swept else (None,)) for n in HEIGHTS)


SCENE = CanonicalScene(
    name="stack",
    version=1,
    title="Column of boxes in equilibrium",
    symptoms=(
        "my stack creeps, sinks or falls over",
        "stacked boxes jitter, drift or slide apart",
        "boxes sink into each other",
        "a tower never comes to rest",
        "a pile of crates shakes and collapses after a while",
        "a tall tower leans and topples although nothing touches it",
        "a box at rest sinks into the floor",
        "a ball or box that lies on the floor sinks into it",
        "a column of blocks is squeezed under its own weight",
        "blocks in a tower penetrate each other",
        "a stack explodes or blows up",
        "resting boxes vibrate and never go to sleep",
        "a stack of ten boxes wobbles",
        "a high stack does not stay up",
        "piled up cubes slowly slip sideways",
        "contacts at rest are too soft: bodies interpenetrate under their weight",
        "how deep does a box sink at rest",
        "a stacked column is stable only with more solver iterations",
    ),
    family="stacks and statics",
    figure=__doc__ or "",
    law="nothing moves; interface i carries the weight above it, at every step",
    dimensions=(2, 3),
    parameters=(
        Parameter("n", 5, "1", "number of boxes", 1, 1000, integer=True),
        Parameter("mu", 0.5, "1", "friction of every pair", 0.0, 10.0),
        standard_gravity(),
        mass_of("each box"),
        Parameter("duration", 5.0, "s", "long enough for a slow sway to show", 1.0, 1e4),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=columns.sampling,
    track=track,
    # The benchmark's column, and the same with too few iterations.
    quick=(Variation({"n": 10}), Variation({"n": 10}, (SWEEPS[0],), (2,))),
    standard=_heights(10),
    full=_heights(*HEIGHTS),
    representative={"n": 10.0},  # too few iterations for many solvers
    planted=({"n": 2.0},),
    primary=Primary(
        "displacement",
        "side",
        "larger of the sideways drift and the deepest overlap within 5 s, per side of a box, n = 10",
        "nothing may move, so any motion is error, sideways or into the neighbour; loads are left out because "
        "any column at rest carries its weight on average",
        lambda dt: [{"n": 10.0}],
        lambda scene, dt, found: columns.displacement(found, SIDE),
        "the standing column, half a second after the start",
        0.5,
        0.25,
    ),
    steps=Steps((1.0 / 60.0, 1.0 / 240.0), quick_iterations=(50,), full_iterations=(4, 10, 30, 100)),
    size="n",
    smooth=("penetration",),
    words={
        "load": "carries {value} of the weight above an interface in some step",
        "unbalanced": "pushes a box up and down with forces that differ from its weight by {value} of it in some step",
    },
    frontiers=(
        Frontier("stack height", "boxes", "n", 1.0, 40.0, 200.0, columns.fate, columns.STANDS, whole=True),
        Frontier("step", "s", "dt", 1.0 / 480.0, 1.0 / 10.0, 1.0 / 10.0, columns.fate, columns.STANDS),
        Frontier(
            "iterations", "", "iterations", 100.0, 1.0, 1.0, columns.fate, columns.STANDS, {"n": 10.0}, whole=True
        ),
    ),
    searched=Searched("stand", ({"n": 1.0}, {"n": 2.0}, {"n": 10.0}), ({}, {"n": 20.0}), (1, 10)),
)
