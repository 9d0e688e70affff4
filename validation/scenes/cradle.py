"""Newton's cradle: a ball strikes a row of equal ones.

        o -->   o o o o        a gap apart, e = 1: only the last one leaves
        v                      (0, 0, ..., 0, v)

        o -->   oooo           touching: simultaneous contacts; momentum
        v                      and energy do not determine the result

With gaps every impact is between two balls, and they swap their velocities. Touching, laws of impact differ: solved
together (Newton's law for each contact, as this project's solver does) the striker comes back with (n - 2)/n v and the
others leave with 2 v/n; one after the other, the last one leaves with v. Neither is preferred: conserved quantities are
judged, and the speeds are shown.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from adapters.engine import Array
from adapters.scene import Pair, Scene
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Track, Variation
from validation.scenes.parts import PHASES, along, at, ball, delay, mass_of, phases, states

RADIUS = 0.5
#: Runs for this long after the last impact [s]: softest engine compared keeps contact for about 0.05 s.
AFTERMATH = 0.35


def make(dimension: int, params: Params) -> Scene:
    """Build the row along the first axis; positions of touching balls are exact in binary."""
    p = params
    n = int(p["n"])
    spacing = 2.0 * RADIUS + p["v"] * p["apart"]
    places = [-2.0 * RADIUS - p["v"] * p["delay"], *(k * spacing for k in range(n - 1))]
    bodies = tuple(
        at(
            ball(f"ball{k + 1}", dimension, p["mass"], RADIUS, 0.0),
            dimension,
            along(dimension, x),
            along(dimension, p["v"] if k == 0 else 0.0),
        )
        for k, x in enumerate(places)
    )
    pairs = (Pair(restitution=1.0, friction=0.0),)
    duration = p["delay"] + (n - 2) * p["apart"] + AFTERMATH
    return Scene("cradle", 1, dimension, bodies, pairs, (0.0,) * dimension, duration, p)


def exact(scene: Scene) -> dict[str, float]:
    """Equal balls swap their velocities, pair after pair; touching ones conserve momentum and energy."""
    conserved = {"momentum_defect": 0.0, "energy_defect": 0.0}
    if scene.params["apart"] == 0.0:
        return conserved
    n = len(scene.bodies)
    return conserved | {f"speed[{k}]": 0.0 if k < n else scene.params["v"] for k in range(1, n + 1)}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Velocities at the end; momentum and energy relative to the striker's."""
    v, d = scene.params["v"], scene.dimension
    speeds, whole = trajectory.twist[-1, :, 0], _energy(scene, trajectory.twist[-1])
    measured: dict[str, Measured] = {
        "momentum_defect": (float(np.linalg.norm(trajectory.twist[-1, :, :d].sum(axis=0) - _start(scene)) / v), ""),
        "energy_defect": (abs(whole - 0.5 * v * v) / (0.5 * v * v), ""),
    }
    return measured | {f"speed[{k}]": (float(speed), "") for k, speed in enumerate(speeds, 1)}


def _start(scene: Scene) -> Array:
    return np.array(along(scene.dimension, scene.params["v"]))


def _energy(scene: Scene, twist: Array) -> float:
    """Kinetic energy of the centres per mass of a ball [m^2/s^2]: smooth balls that do not spin have no other."""
    return float(0.5 * (twist[:, : scene.dimension] ** 2).sum())


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """Each impact is exact; round-off of n of them adds up. Touching balls have no unique result."""
    v, n, apart = scene.params["v"], len(scene.bodies), scene.params["apart"]
    found = [
        bounds.bookkeeping(n).check("momentum_defect", "1", truth["momentum_defect"], "conservation of momentum"),
        bounds.exact(n).check("energy_defect", "1", truth["energy_defect"], "e = 1: conservation of energy"),
    ]
    names = [f"speed[{k}]" for k in range(1, n + 1)]
    if apart == 0.0:
        why = "shown: several contacts act at once, and laws of impact differ in how they share the blow"
        return found + [Check(name, "m/s", None, None, why, "") for name in names]
    source = "Newton's law of restitution and conservation of momentum, pair after pair"
    speeds = [bounds.exact(n * v).check(name, "m/s", truth[name], source) for name in names]
    return found + (speeds if apart >= bounds.APART * dt else [check.unjudged() for check in speeds])


def track(scene: Scene) -> Track | None:
    """The last ball: at rest until it is struck. None for a touching row, whose result depends on the impact law."""
    p, n = scene.params, len(scene.bodies)
    if p["apart"] == 0.0:
        return None
    start, struck = scene.bodies[-1].pose[0], p["delay"] + (n - 2) * p["apart"]
    return Track(f"ball{n}", lambda t: along(scene.dimension, start + p["v"] * max(0.0, t - struck)))


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Largest error of a ball's speed, over the striker's."""
    off = []
    for name, truth in exact(scene).items():
        value, reason = found[name]
        if value is None:
            return None, reason
        if name.startswith("speed["):
            off.append(abs(value - truth) / scene.params["v"])
    return (metrics.largest(off), "") if off else (None, "a touching row has no unique solution")


SCENE = CanonicalScene(
    name="cradle",
    version=1,
    title="Newton's cradle, with gaps and touching",
    symptoms=(
        "Newton's cradle moves all of its balls",
        "in a row of touching balls more than the last one flies off",
        "momentum is not passed through a line of touching spheres",
        "the whole chain of balls moves together after the hit",
        "a pendulum row of steel balls smears out",
        "the striker of a cradle rebounds or keeps moving",
        "simultaneous collisions in a row share the momentum wrongly",
        "a shock does not travel through touching bodies",
    ),
    family="rebound",
    figure=__doc__ or "",
    law="with gaps (0, ..., 0, v); touching: momentum and energy",
    dimensions=(2, 3),
    parameters=(
        Parameter("n", 4, "1", "number of balls with the striker", 2, 100, integer=True),
        Parameter("apart", 0.05, "s", "time between impacts, 12 steps of 1/240 s; 0: the row touches", 0.0, 1.0),
        Parameter("v", 2.0, "m/s", "of the striker", 0.0, 1e2, positive=True),
        delay("the first contact"),
        mass_of("each ball"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    track=track,
    quick=(Variation({}), Variation({"n": 3.0, "apart": 0.0})),
    full=tuple(Variation({"n": float(n), "apart": apart}) for n in (2, 3, 5, 10) for apart in (0.0, 0.05)),
    planted=({},),
    primary=Primary(
        "speed error",
        "1",
        f"largest error of a ball's speed over the striker's, of 4 balls, over {PHASES} phases of the first contact",
        "a row of impacts passes on the error of each; with gaps, since a touching row has no unique solution",
        phases,
        error,
        "the whole scene: approach, impacts, departure",
    ),
    words={
        "speed": "leaves a ball with {value}",
        "energy_defect": "changes the energy by {value} (relative)",
        "momentum_defect": "changes the momentum by {value} (relative)",
    },
)
