"""A box is pressed onto the floor and pushed along it: friction grows with the load.

            | N = load W
            v
          +---+
    F --> |   |           sticks if F <= mu (W + N):  the floor pushes back with F, carries W + N
          +---+           slides if not:  a = (F - mu (W + N))/m
    ================

A push that moves an unloaded box leaves a pressed one at rest. All forces act at the centre, so the push shifts load
from the rear edge to the front one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from adapters.scene import Pair, Scene, SceneError
from adapters.trajectory import Sampling, Trajectory
from validation import bounds, metrics
from validation.bounds import WINDOW
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Track, Variation
from validation.scenes.parts import along, cube, floor, mass_of, standard_gravity, upward

SIDE = 1.0


def _limit(p: Params) -> float:
    """Largest push that sticks, over the weight."""
    return p["mu"] * (1.0 + p["load"])


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: forces act from the start.

    Raises
    ------
    SceneError
        If the push tips the box over.
    """
    p = params
    if min(p["shear"], _limit(p)) >= 0.9 * (1.0 + p["load"]):
        raise SceneError(f"pressed_box.shear: {p['shear']:g} weights tip the box over instead of sliding it")
    weight = p["mass"] * p["g"]
    box = replace(
        cube("box", dimension, p["mass"], SIDE, 0.5 * SIDE),
        force=along(dimension, p["shear"] * weight, -p["load"] * weight),
    )
    pairs = (Pair(restitution=0.0, friction=p["mu"]),)
    bodies, gravity = (floor(dimension), box), upward(dimension, -p["g"])
    return Scene("pressed_box", 1, dimension, bodies, pairs, gravity, p["duration"], p)


def exact(scene: Scene) -> dict[str, float]:
    """Coulomb's law; forces of the floor are relative to the load and the push."""
    p = scene.params
    forces = {"carried": 1.0, "sheared": 1.0}
    if p["shear"] <= _limit(p):
        return {"creep": 0.0} | forces
    return {"acceleration": p["g"] * (p["shear"] - _limit(p))} | forces


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Mean speed and acceleration over the second half of the run, forces of the floor over the last second."""
    p, weight = scene.params, scene.params["mass"] * scene.params["g"] * trajectory.dt
    load, push = (1.0 + p["load"]) * weight, min(p["shear"], _limit(p)) * weight
    measured: dict[str, Measured] = {
        "creep": metrics.mean_rate(trajectory.t, trajectory.pose[:, 1, 0]),
        "acceleration": metrics.mean_rate(trajectory.t, trajectory.twist[:, 1, 0]),
    }
    late = metrics.late_impulses(trajectory, 0, 1, WINDOW)
    if late is None:
        return measured | dict.fromkeys(("carried", "sheared"), (None, metrics.UNAVAILABLE))
    mean = np.asarray(late.mean(axis=0))
    return measured | {"carried": (float(mean[-1] / load), ""), "sheared": (float(-mean[0] / push), "")}


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """As on an incline, with the acceleration of all pressing forces: g (1 + load).

    Forces follow from the momentum, with errors of v1/100 before and after the last second.
    """
    p = scene.params
    pressed, source = p["g"] * (1.0 + p["load"]), "Coulomb's law; equilibrium of forces"
    found = []
    if "creep" in truth:
        found.append(bounds.stuck(pressed, dt, scene.duration).check("creep", "m/s", truth["creep"], source))
    else:
        pace = bounds.driven(pressed, dt, 0.5 * scene.duration)
        found.append(pace.check("acceleration", "m/s^2", truth["acceleration"], source))
    share = bounds.carried(dt)
    sheared = bounds.Bound(share.value * (1.0 + p["load"]) / min(p["shear"], _limit(p)), share.because)
    found.append(share.check("carried", "1", truth["carried"], source))
    found.append(sheared.check("sheared", "1", truth["sheared"], source))
    return found


def sampling(scene: Scene) -> Sampling:
    """Every step; contacts over the last second."""
    return Sampling(1, max(0.0, scene.duration - WINDOW))


def track(scene: Scene) -> Track:
    """At rest, or the exact parabola."""
    start, a = scene.bodies[1].pose[: scene.dimension], exact(scene).get("acceleration", 0.0)
    return Track("box", lambda t: (start[0] + 0.5 * a * t * t, *start[1:]))


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Larger of the errors of normal force and friction, over the load and the push."""
    carried, sheared = found["carried"], found["sheared"]
    if carried[0] is None or sheared[0] is None:
        return None, carried[1] or sheared[1]
    return metrics.largest([abs(carried[0] - 1.0), abs(sheared[0] - 1.0)]), ""


SCENE = CanonicalScene(
    name="pressed_box",
    family="grip and force",
    version=1,
    title="Box pressed onto the floor and pushed along it",
    symptoms=(
        "a pushed box starts to move too early or too late",
        "how hard must I push until static friction breaks",
        "a box pressed onto the table slides under a small push",
        "a clamp does not hold against a sideways force",
        "the friction force is larger than mu times the normal force",
        "a pushed object moves although the push is below the limit of friction",
        "more pressure does not give more friction",
        "a robot pushes an object and it creeps ahead",
        "a box held down by a force is pushed along the floor wrongly",
        "static friction is different from sliding friction",
        "the ratio of friction to normal force of a pushed block changes",
    ),
    figure=__doc__ or "",
    law="sticks if F <= mu (W + N), and the floor bears both; else a = (F - mu (W + N))/m",
    dimensions=(2, 3),
    parameters=(
        Parameter("load", 1.0, "weights", "force that presses on the box", 0.0, 1e4),
        Parameter("shear", 0.8, "weights", "force that pushes it along; 0.8 moves it unless it is pressed", 0.0, 1e4),
        Parameter("mu", 0.5, "1", "friction of the pair", 0.0, 10.0, positive=True),
        standard_gravity(),
        mass_of("the box"),
        Parameter("duration", 2.0, "s", "the second half is measured", 1.0, 1e3),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=sampling,
    track=track,
    quick=(Variation({}), Variation({"load": 0.0}), Variation({"load": 9.0, "shear": 4.9}, dimensions=(2,))),
    standard=(Variation({}), Variation({"load": 0.0}), Variation({"load": 9.0, "shear": 4.9})),
    full=tuple(Variation({"load": n, "shear": s * 0.5 * (1.0 + n)}) for n in (0.0, 1.0, 9.0) for s in (0.5, 0.98, 1.2)),
    planted=({}, {"load": 0.0}),
    primary=Primary(
        "force error",
        "1",
        "larger of the errors of normal force and friction, over the load and the push",
        "forces are the values of a contact that users read most often",
        lambda dt: [{}, {"load": 0.0}],
        error,
        "the held box, half a second after the start",
        0.5,
        0.25,
    ),
    smooth=("creep", "acceleration"),
    words={
        "carried": "carries {value} of the load",
        "sheared": "holds back {value} of the push",
    },
)
