"""A box is held between a wall and a pressing pad by friction only.

    wall |+-----+| pad  |
         || box ||      | <-- N       sticks if W <= 2 mu N:  margin = 2 mu N/W >= 1
         |+-----+|      |             creep 0; the wall pushes back with N,
         |   W   |      |             wall and pad together carry W
    =====================

The pad is a block on a smooth floor, pressed by a constant force through its centre, and passes its share of the weight
to the floor. The shares of wall and pad are not determined; their sum is.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from adapters.scene import Body, HalfSpace, Pair, Scene
from adapters.trajectory import Sampling, Trajectory
from validation import bounds, metrics
from validation.bounds import WINDOW
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Steps, Track, Variation
from validation.scenes.parts import along, at, block, floor, mass_of, standard_gravity, upward

SIDE, PAD = 0.5, 2.0


def grip(params: Params) -> float:
    """Normal force with which the pad presses [N]."""
    return params["margin"] * params["mass"] * params["g"] / (2.0 * params["mu"])


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: all faces touch exactly, the box hangs at half the pad's height."""
    p = params
    wall = Body("wall", HalfSpace(along(dimension, 1.0), 0.0), motion="fixed")
    box = at(block("box", dimension, p["mass"], SIDE, SIDE), dimension, along(dimension, 0.5 * SIDE, 0.5 * PAD))
    pad = at(block("pad", dimension, p["pad"], PAD, PAD), dimension, along(dimension, SIDE + 0.5 * PAD, 0.5 * PAD))
    pad = Body(pad.name, pad.shape, pad.mass, pad.inertia, pad.pose, force=along(dimension, -grip(p)))
    pairs = (Pair(restitution=0.0, friction=p["mu"]), Pair("floor", "*", 0.0, 0.0))
    bodies = (floor(dimension), wall, box, pad)
    return Scene("pinch", 1, dimension, bodies, pairs, upward(dimension, -p["g"]), p["duration"], p)


def exact(scene: Scene) -> dict[str, float]:
    """Equilibrium, at every step; loads are relative to the grip and to the weight."""
    steady = {f"{load}[{by}]": 1.0 for load in ("grip", "carried") for by in ("least", "greatest")}
    return {"creep": 0.0, "turned": 0.0, "grip": 1.0, "carried": 1.0, **steady, "unbalanced": 0.0}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Creep and rotation of the box over the second half of the run; loads over the last second."""
    p, d, dt = scene.params, scene.dimension, trajectory.dt
    sunk = metrics.mean_rate(trajectory.t, -trajectory.pose[:, 2, d - 1])
    spin = float(np.linalg.norm(trajectory.twist[-1, 2, d:]))
    measured: dict[str, Measured] = {"creep": sunk, "turned": (spin * 0.5 * SIDE, "")}
    wall, pad = (metrics.late_impulses(trajectory, *pair, WINDOW) for pair in ((1, 2), (2, 3)))
    if wall is None or pad is None:
        return measured | {load: (None, metrics.UNAVAILABLE) for load in exact(scene) if load not in measured}
    weight = p["mass"] * p["g"]
    measured["grip"] = (float(wall[:, 0].mean() / (grip(p) * dt)), "")
    measured["carried"] = (float((wall[:, -1] - pad[:, -1]).mean() / (weight * dt)), "")
    # `pad` is the force of the box on the pad.
    for load, steps in (("grip", wall[:, 0] / grip(p)), ("carried", (wall[:, -1] - pad[:, -1]) / weight)):
        measured |= metrics.over_time(load, steps / dt, ("least", "greatest"))
    measured["unbalanced"] = (float(np.abs(wall[:, 0] - pad[:, 0]).max() / (grip(p) * dt)), "")
    return measured


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """A sticking box may slip by one step of fall; loads follow from the momentum of bodies at rest."""
    p = scene.params
    g = p["g"]
    source = "Coulomb's law, static; equilibrium of forces"
    still = bounds.STILL * g * dt
    turn = bounds.Bound(still, "a box whose edges are slower than v1/100 = g dt/100 does not turn")
    # Speeds of v1/100 before and after the last second are momentum, also of the pad towards the wall.
    share = bounds.carried(dt)
    heavy, light = (p["mass"] + p["pad"]) * g / grip(p), p["mass"] * g / grip(p)
    pressed = bounds.Bound(share.value * heavy, share.because)
    # The wall and the pad push the box equally, up to its momentum change in the step.
    balance = bounds.Bound(bounds.steady().value * light, bounds.steady().because)
    return [
        bounds.stuck(g, dt, scene.duration).check("creep", "m/s", truth["creep"], source),
        turn.check("turned", "m/s", truth["turned"], source),
        pressed.check("grip", "1", truth["grip"], source),
        share.check("carried", "1", truth["carried"], source),
        *bounds.load("grip", dt, truth, source, share=heavy),
        *bounds.load("carried", dt, truth, source),
        balance.check("unbalanced", "1", truth["unbalanced"], "equilibrium of forces along the grip"),
    ]


def sampling(scene: Scene) -> Sampling:
    """Every step; contacts over the last second."""
    return Sampling(1, max(0.0, scene.duration - WINDOW))


def track(scene: Scene) -> Track:
    """The box at rest."""
    return Track("box", lambda t: scene.bodies[2].pose[: scene.dimension])


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Acceleration that moves the box as far as the creep within the run, in g."""
    value, reason = found["creep"]
    return (None, reason) if value is None else (2.0 * abs(value) / (scene.params["g"] * scene.duration), "")


SCENE = CanonicalScene(
    name="pinch",
    version=1,
    title="Box held between a wall and a pad that presses on it",
    symptoms=(
        "my grip slips",
        "the gripper drops its object",
        "a grasped object creeps out of the fingers",
        "an object that a robot hand holds slowly slides down",
        "the gripper squeezes hard but the cube falls out",
        "two fingers cannot lift a box",
        "the grasp is unstable and the object slips",
        "a held block drifts downwards between the jaws",
        "picking up an object fails: it slips through the fingers",
        "increasing the grip force does not stop the slip",
        "an object flies or pops out of the gripper when it is squeezed",
        "a parallel jaw gripper loses the part it carries",
        "objects slowly fall from the claw or tongs",
        "a box clamped between two plates slides down under its weight",
    ),
    family="grip and force",
    figure=__doc__ or "",
    law="sticks if W <= 2 mu N: creep 0, the wall carries N, wall and pad carry W, at every step",
    dimensions=(2, 3),
    parameters=(
        Parameter("margin", 2.0, "1", "2 mu N/W: how much more the grip could hold", 1.0, 1e4),
        Parameter("mu", 0.5, "1", "friction of wall and pad", 0.0, 10.0, positive=True),
        standard_gravity(),
        mass_of("the box"),
        Parameter("pad", 4.0, "kg", "mass of the pad; it stands on the floor", 0.0, 1e6, positive=True),
        Parameter("duration", 3.0, "s", "the second half is measured", 2.0, 1e3),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=sampling,
    track=track,
    quick=(Variation({}), Variation({"margin": 1.05}, dimensions=(2,)), Variation({"margin": 100.0})),
    standard=(Variation({}), Variation({"margin": 1.05}), Variation({"margin": 100.0})),
    full=tuple(Variation({"margin": m}) for m in (1.01, 1.05, 1.2, 2.0, 5.0, 20.0, 100.0)),
    planted=({}, {"margin": 1.05}),
    primary=Primary(
        "creep",
        "g",
        "2 creep/(g T) of the box over the run T, margins 2, 1.05 and 100",
        "a grip that creeps loses its object, however slowly; the unit is that of sliding on an incline",
        lambda dt: [{}, {"margin": 1.05}, {"margin": 100.0}],
        error,
        "the held box, half a second after the start",
        0.5,
        0.25,
    ),
    steps=Steps((1.0 / 60.0, 1.0 / 240.0)),
    smooth=("creep",),
    words={
        "creep": "lets the box creep down at {value}",
        "creep<0": "lets the box creep up at {value}",
        "turned": "turns the box: its edges move with {value}",
        "grip": "grips with {value} of the pressing force",
        "carried": "carries {value} of the weight",
        "unbalanced": "grips from its two sides with forces that differ by {value} of the grip",
    },
)
