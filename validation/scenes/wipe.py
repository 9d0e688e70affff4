r"""A hand lies on a table that moves under it, and a stop holds it: sliding for as long as one looks.

         +------+|
         | hand || stop        the table carries the weight, N = m g,
    ==================  V ->   drags with mu N, and the stop carries that:
          table                at every step, for nothing changes

A robot that wipes, sands or pushes feels these three forces. What slides steadily has no impact and no start that could
excuse a force which comes and goes: an engine whose contact pushes and lets go by turns is right in the mean alone.
The table is a floor whose surface runs, and the stop has no friction.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from adapters.engine import Array
from adapters.scene import Body, HalfSpace, Pair, Scene
from adapters.trajectory import Sampling, Trajectory
from validation import bounds, metrics
from validation.bounds import WINDOW
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Steps, Track, Variation
from validation.scenes.parts import along, at, block, floor, mass_of, standard_gravity, upward

#: Width and height of the hand [m].
WIDTH, HEIGHT = 0.2, 0.1
#: The three forces: each has a mean, a least and a greatest.
FORCES = ("normal", "friction", "stop")


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the hand touches the table and the stop ahead of it."""
    p = params
    run = along(dimension, p["v"])
    table = replace(floor(dimension), name="table", surface_velocity=run)
    stop = Body("stop", HalfSpace(along(dimension, -1.0), 0.0), motion="fixed")
    hand = block("hand", dimension, p["mass"], WIDTH, HEIGHT)
    hand = at(hand, dimension, along(dimension, -0.5 * WIDTH, 0.5 * HEIGHT))
    pairs = (Pair(restitution=0.0, friction=p["mu"]), Pair("stop", "hand", 0.0, 0.0))
    gravity = upward(dimension, -p["g"])
    return Scene("wipe", 1, dimension, (table, stop, hand), pairs, gravity, p["duration"], p)


def exact(scene: Scene) -> dict[str, float]:
    """Equilibrium under Coulomb's kinetic friction: each force is what it is relative to, at every step."""
    return {f"{force}[{by}]": 1.0 for force in FORCES for by in ("mean", "least", "greatest")} | {"moved": 0.0}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Forces of the last second, step by step: relative to the weight, to mu times it, and to that again."""
    p, d = scene.params, scene.dimension
    weight = p["mass"] * p["g"]
    begin = trajectory.t[-1] - WINDOW
    table, stop = (metrics.forces(trajectory, 2, [other], begin) for other in (0, 1))
    series: tuple[Array, ...] = (table[:, d - 1] / weight, table[:, 0] / (p["mu"] * weight))
    series = (*series, -stop[:, 0] / (p["mu"] * weight))
    measured: dict[str, Measured] = {}
    for force, steps in zip(FORCES, series, strict=True):
        measured |= metrics.over_time(force, steps)
    way = trajectory.pose[:, 2, :d] - trajectory.pose[0, 2, :d]
    return measured | {"moved": (float(np.linalg.norm(way, axis=1).max()), "")}


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """A hand that does not move is pushed by what its momentum says, to `bounds.steady` of the weight at any step.

    Friction is mu times the normal force of the same step, so that it is off by the same share. The stop carries it, to
    what the hand's own momentum along the table leaves: the same share of the weight, 1/mu as much of the friction.

    Each contact may be found one step late: the hand falls by g dt^2 and lands with twice its weight, so that it is
    dragged by 2 mu g dt^2 before the stop is found.
    """
    g, mu = scene.params["g"], scene.params["mu"]
    share = 1.0 + 1.0 / mu
    still = bounds.Bound(
        (1.0 + 2.0 * mu) * g * dt * dt + bounds.ROUND_OFF * WIDTH,
        "the table and then the stop found one step late: it falls by g dt^2, and lands with twice its weight: 2 mu g "
        "dt^2 along the table",
    )
    return [
        *bounds.load("normal", dt, truth, "the table carries the weight"),
        *bounds.load("friction", dt, truth, "Coulomb's law, kinetic: mu N"),
        *bounds.load("stop", dt, truth, "equilibrium: the stop carries the friction", share=share),
        still.check("moved", "m", truth["moved"], "equilibrium"),
    ]


def sampling(scene: Scene) -> Sampling:
    """Every step; contacts over the last second."""
    return Sampling(1, scene.duration - WINDOW)


def track(scene: Scene) -> Track:
    """The hand stays where it is."""
    return Track("hand", lambda t: scene.bodies[2].pose[: scene.dimension])


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Largest error of a force at any step, as a share of what it should be."""
    names = [f"{force}[{by}]" for force in FORCES for by in ("least", "greatest")]
    return metrics.relative_error(found, exact(scene), names)


SCENE = CanonicalScene(
    name="wipe",
    version=1,
    title="Hand on a moving table, held by a stop",
    symptoms=(
        "contact forces jump, flicker or are noisy",
        "a touch or force sensor reads a wrong force",
        "the contact force is not steady while a body slides",
        "the measured normal force spikes from step to step",
        "tactile sensor values are noisy although nothing changes",
        "the force of a hand wiping a table is not constant",
        "contact force readings oscillate between zero and twice the weight",
        "a pressure sensor under a body does not show its weight",
        "the friction force that is reported is not mu times the normal force",
        "a force plate gives the wrong reading",
        "impulses of contacts are noisy when a body is dragged over a surface",
    ),
    family="grip and force",
    figure=__doc__ or "",
    law="N = m g, friction mu m g, the stop carries mu m g, at every step",
    dimensions=(2, 3),
    parameters=(
        Parameter("v", 0.1, "m/s", "speed V of the table: a wiping hand's", 0.0, 1e2, positive=True),
        Parameter(
            "mu", 0.5, "1", "friction; below width over height, so that the hand does not tip", 0.0, 1.0, positive=True
        ),
        standard_gravity(),
        mass_of("the hand"),
        Parameter("duration", 2.0, "s", "the last second is measured", 1.5, 1e3),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=sampling,
    track=track,
    quick=(Variation({}), Variation({"v": 1.0}, dimensions=(2,))),
    standard=(Variation({}), Variation({"v": 1.0})),
    full=tuple(Variation({"v": v, "mu": mu}) for v in (0.01, 0.1, 1.0) for mu in (0.1, 0.5, 1.0)),
    planted=({},),
    primary=Primary(
        "force error",
        "1",
        "largest error of normal force, friction and the stop's force at any step of the last second, as a share",
        "a controller acts on these forces at every step; their means are right even where contacts alternate "
        "between load and none",
        lambda dt: [{}],
        error,
        "the sliding hand, half a second after the start",
        0.5,
        0.25,
    ),
    steps=Steps((1.0 / 60.0, 1.0 / 240.0)),
    words={
        "normal": "carries {value} of the hand's weight",
        "friction": "drags the hand with {value} of mu N",
        "stop": "holds the hand with {value} of mu N",
        "moved": "lets the held hand move by {value}",
    },
)
