"""A column of boxes that starts in equilibrium and should stay there.

        +---+  n
        +---+  ...        interface i carries the weight above it:
        +---+  2             p_i = (n - i + 1) m g dt   per step
        +---+  1          nothing moves, drifts or sinks
    ==============

It starts exactly touching: whatever moves afterwards, the engine made.
"""

from __future__ import annotations

from collections.abc import Mapping

from adapters.scene import Pair, Scene
from adapters.trajectory import Sampling, Trajectory
from validation import bounds, metrics
from validation.bounds import WINDOW
from validation.canonical import (
    GRAVITY,
    CanonicalScene,
    Check,
    Measured,
    Parameter,
    Params,
    Primary,
    Searched,
    Steps,
    Track,
    Variation,
)
from validation.scenes.parts import cube, floor, upward

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
    """Equilibrium: nothing moves, each interface carries the weight above."""
    truth = {
        "settle_time": 0.0,
        "drift": 0.0,
        "penetration": 0.0,
        "kinetic_energy": 0.0,
        "impulse_scatter": 0.0,
    }
    return truth | {f"interface_impulse[{i}]": 1.0 for i in range(1, int(scene.params["n"]) + 1)}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Everything from poses and impulses, the same routine for every engine."""
    n, g = int(scene.params["n"]), scene.params["g"]
    speed = metrics.body_speeds(scene, trajectory)
    late = trajectory.t > trajectory.t[-1] - WINDOW
    energy = metrics.kinetic_energy(scene, trajectory)
    measured: dict[str, Measured] = {
        "settle_time": metrics.last_motion(trajectory.t, speed.max(axis=1), 0.01 * g * trajectory.dt),
        "drift": (metrics.lateral_drift(trajectory), ""),
        "penetration": (metrics.deepest_overlap(scene, trajectory), ""),
        "kinetic_energy": (float(energy[late].mean()), ""),
    }
    scatter: list[float] = []
    for i in range(1, n + 1):
        above = (n - i + 1) * scene.params["mass"] * g * trajectory.dt
        mean, deviation = metrics.interface_load(trajectory, i - 1, i, above, WINDOW)
        measured[f"interface_impulse[{i}]"] = mean
        if deviation is not None:
            scatter.append(deviation)
    none = (None, "impulses are not available")
    measured["impulse_scatter"] = (max(scatter), "") if scatter else none
    return measured


def sampling(scene: Scene) -> Sampling:
    """Every step; contacts over the last second."""
    return Sampling(1, max(0.0, scene.duration - WINDOW))


def track(scene: Scene) -> Track:
    """The top box stays where it is."""
    top = scene.bodies[-1]
    return Track(top.name, lambda t: top.pose[: scene.dimension])


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """Positions add up along the column, overlaps do not: n g dt^2 of drift, g dt^2 of overlap however high it is."""
    n, g, mass = int(scene.params["n"]), scene.params["g"], scene.params["mass"]
    top = scene.bodies[-1].pose[scene.dimension - 1]  # heights are rounded relative to the column's
    allowed = {
        "settle_time": ("s", bounds.settled(n, dt, scene.duration)),
        "drift": ("m", bounds.slips(n, g, dt)),
        "penetration": ("m", bounds.found_late(g, dt, top)),
        "kinetic_energy": ("J", bounds.still_energy(n, mass, g, dt)),
        "impulse_scatter": ("1", bounds.steady()),
    }
    source = "static equilibrium"
    found = [bound.check(name, unit, truth[name], source) for name, (unit, bound) in allowed.items()]
    loads = [name for name in truth if name.startswith("interface_impulse")]
    return found + [bounds.carried(dt).check(name, "1", truth[name], "weight above the interface") for name in loads]


def displacement(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Larger of the drift and the deepest overlap, in sides of a box."""
    drift, penetration = found["drift"], found["penetration"]
    if drift[0] is None or penetration[0] is None:
        return None, drift[1] or penetration[1]
    return max(drift[0], penetration[0]) / SIDE, ""


def _heights(*swept: int) -> tuple[Variation, ...]:
    """Every height at the profiles' own iterations, those of ``swept`` at other counts as well."""
    return tuple(Variation({"n": n}, (None, *SWEEPS) if n in swept else (None,)) for n in HEIGHTS)


SCENE = CanonicalScene(
    name="stack",
    version=1,
    title="Column of boxes in equilibrium",
    figure=__doc__ or "",
    law="nothing moves; interface i carries the weight above it",
    dimensions=(2, 3),
    parameters=(
        Parameter("n", 5, "1", "number of boxes", 1, 1000, integer=True),
        Parameter("mu", 0.5, "1", "friction of every pair", 0.0, 10.0),
        Parameter("g", GRAVITY, "m/s^2", "gravity", 0.0, 1e3, positive=True),
        Parameter("mass", 1.0, "kg", "of each box", 0.0, 1e6, positive=True),
        Parameter("duration", 5.0, "s", "long enough for a slow sway to show", 1.0, 1e4),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=sampling,
    track=track,
    quick=_heights(10),
    full=_heights(*HEIGHTS),
    representative={"n": 10.0},  # starves a solver that stops too soon
    planted=({"n": 2.0},),
    primary=Primary(
        "displacement",
        "side",
        "larger of the sideways drift and the deepest overlap within 5 s, per side of a box, n = 10",
        "nothing may move, so whatever did is error, sideways or into the neighbour; loads are left out because "
        "any column at rest carries its weight on average",
        lambda dt: [{"n": 10.0}],
        displacement,
        "the standing column, half a second after the start",
        0.5,
        0.25,
    ),
    # Ten boxes: half a minute on two cores does not reach small steps.
    steps=Steps((1.0 / 60.0, 1.0 / 120.0, 1.0 / 240.0), quick_iterations=(50,), full_iterations=(4, 10, 30, 100)),
    size="n",
    smooth=("penetration",),
    searched=Searched("stand", ({"n": 1.0}, {"n": 2.0}, {"n": 10.0}), ({}, {"n": 20.0}), (1, 10)),
)
