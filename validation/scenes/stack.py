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
from validation import metrics, tolerances
from validation.canonical import GRAVITY, CanonicalScene, Measured, Parameter, Track
from validation.scenes.parts import cube, floor, upward
from validation.tolerances import WINDOW

SIDE = 1.0


def make(dimension: int, params: Mapping[str, float]) -> Scene:
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


STACK = CanonicalScene(
    "stack",
    1,
    "Column of boxes in equilibrium",
    __doc__ or "",
    "nothing moves; interface i carries the weight above it",
    (2, 3),
    (
        Parameter("n", 5, "1", "number of boxes", 1, 1000, integer=True),
        Parameter("mu", 0.5, "1", "friction of every pair", 0.0, 10.0),
        Parameter("g", GRAVITY, "m/s^2", "gravity", 0.0, 1e3, positive=True),
        Parameter("mass", 1.0, "kg", "of each box", 0.0, 1e6, positive=True),
        Parameter("duration", 5.0, "s", "long enough for a slow sway to show", 1.0, 1e4),
    ),
    make,
    exact,
    measure,
    sampling,
    track,
    tolerances.stack_checks,
)
