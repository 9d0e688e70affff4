"""A short column rests for a long time, which shows slow creep.

        +---+
        |   |  n        drift per hour       0
        +---+           sinking per hour     0
        |   |  1        turn per hour        0
    ==============

A check over a few seconds allows a drift of a tenth of a millimetre, a decimetre per hour; a longer run resolves slower
creep.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from adapters.scene import Pair, Scene
from adapters.trajectory import Sampling, Trajectory
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Variation
from validation.scenes.parts import cube, floor, mass_of, standard_gravity, upward

SIDE, HOUR = 1.0, 3600.0
#: Time until which motion belongs to the start [s].
SETTLED = 1.0
#: Steps between two samples.
STRIDE = 60


def make(dimension: int, params: Params) -> Scene:
    """Build the column."""
    p, n = params, int(params["n"])
    boxes = tuple(cube(f"box{i}", dimension, p["mass"], SIDE, (i - 0.5) * SIDE) for i in range(1, n + 1))
    pairs = (Pair(restitution=0.0, friction=p["mu"]),)
    bodies, gravity = (floor(dimension), *boxes), upward(dimension, -p["g"])
    return Scene("long_rest", 1, dimension, bodies, pairs, gravity, p["duration"], p)


def exact(scene: Scene) -> dict[str, float]:
    """Equilibrium lasts."""
    return {"drift_per_hour": 0.0, "sinking_per_hour": 0.0, "turn_per_hour": 0.0}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Largest displacement of a body along and across the floor, and of a corner by rotation, from 1 s to the end."""
    d, free = scene.dimension, metrics.free_bodies(scene)
    first = int(np.searchsorted(trajectory.t, SETTLED - 1e-9))
    pose = trajectory.pose[first:]
    hours = (trajectory.t[-1] - trajectory.t[first]) / HOUR
    moved = pose[-1, free, :d] - pose[0, free, :d]
    turned = metrics.largest(metrics.turned(pose[[0, -1], i]) * metrics.reach(scene.bodies[i].shape) for i in free)
    return {
        "drift_per_hour": (float(np.linalg.norm(moved[:, :-1], axis=1).max()) / hours, ""),
        "sinking_per_hour": (float(np.abs(moved[:, -1]).max()) / hours, ""),
        "turn_per_hour": (turned / hours, ""),
    }


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """The slip of a column, once in the run; a longer run gives less per hour."""
    n, g = len(scene.bodies) - 1, scene.params["g"]
    hours = (scene.duration - SETTLED) / HOUR
    slip = bounds.slips(n, g, dt)
    rate = bounds.Bound(
        (slip.value + bounds.ROUND_OFF * n * SIDE) / hours, f"{slip.because}, once within the run, given per hour"
    )
    source = "static equilibrium"
    return [rate.check(metric, "m/h", truth[metric], source) for metric in truth]


def sampling(scene: Scene) -> Sampling:
    """A few samples a second, as nothing should happen."""
    return Sampling(STRIDE, None)


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Largest of the three rates, in sides of a box per hour."""
    values = [found[metric] for metric in exact(scene)]
    missing = [reason for value, reason in values if value is None]
    if missing:
        return None, missing[0]
    return metrics.largest(value for value, _ in values if value is not None) / SIDE, ""


SCENE = CanonicalScene(
    name="long_rest",
    family="stacks and statics",
    version=1,
    title="Short column that rests for a long time",
    symptoms=(
        "a resting object drifts away over time",
        "a body at rest moves by itself",
        "a box on a flat floor slowly creeps, though nothing pushes it",
        "after an hour objects have wandered",
        "an object left alone turns slowly",
        "a still scene is not still: positions change",
        "bodies fall asleep too early, or never sleep",
        "a resting body keeps sliding with a tiny velocity",
        "a cube on level ground jitters in place",
        "a resting body jitters or shakes where the time step is too large",
        "things on a table move around without reason",
        "a body that lies still sinks deeper and deeper",
        "a sleeping body does not wake up",
    ),
    figure=__doc__ or "",
    law="nothing drifts, sinks or turns, however long it stands",
    dimensions=(2, 3),
    parameters=(
        Parameter("n", 3, "1", "number of boxes", 1, 100, integer=True),
        Parameter("mu", 0.5, "1", "friction of every pair", 0.0, 10.0),
        Parameter("duration", 10.0, "s", "of the run; 420 s are 1e5 steps of 1/240 s", 2.0, 1e5),
        standard_gravity(),
        mass_of("each box"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=sampling,
    full=(
        Variation({}),
        Variation({"duration": 120.0}, dimensions=(3,)),
        Variation({"duration": 420.0}, dimensions=(2,)),
    ),
    planted=({},),
    primary=Primary(
        "creep",
        "side/h",
        "largest of drift, sinking and turning per hour, in sides of a box",
        "only a long run shows a creep that never stops",
        lambda dt: [{}],
        error,
        "the resting column, a second after the start",
        1.0,
        1.0,
    ),
    words={
        "drift_per_hour": "drifts by {value}",
        "sinking_per_hour": "sinks or rises by {value}",
        "turn_per_hour": "turns: a corner moves by {value}",
    },
)
