"""A row of balls is pressed against a wall: each contact carries the press, which a solver must pass on.

         |
    wall | o o o o o <-- F     nothing moves; every contact carries F,
         | 1 2  ...  n         that of the wall as well

A contact depends on its neighbours only, so the press moves by one contact an iteration, and the error falls by
cos^2(pi/2n) an iteration over all contacts: ten balls take forty iterations for each factor of e. With fewer the row is
compressed. There is no friction and no weight, and one contact from ball to ball.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from adapters.scene import Body, HalfSpace, Pair, Scene
from adapters.trajectory import Sampling, Trajectory
from validation import bounds, metrics
from validation.bounds import WINDOW
from validation.canonical import CanonicalScene, Check, Frontier, Measured, Parameter, Params, Primary, Track, Variation
from validation.scenes.parts import along, at, ball, mass_of

RADIUS = 0.5
#: Iteration counts that are too small, beside each profile's own.
FEW, MANY = (1, 4), (1, 2, 4, 10, 20, 50, 100)


def make(dimension: int, params: Params) -> Scene:
    """Build the row, exactly touching; the press acts from the start."""
    p, n = params, int(params["n"])
    wall = Body("wall", HalfSpace(along(dimension, 1.0), 0.0), motion="fixed")
    row = [
        at(ball(f"ball{k}", dimension, p["mass"], RADIUS, 0.0), dimension, along(dimension, (2 * k - 1) * RADIUS))
        for k in range(1, n + 1)
    ]
    row[-1] = replace(row[-1], force=along(dimension, -p["press"]))
    pairs = (Pair(restitution=0.0, friction=0.0),)
    return Scene("starved", 1, dimension, (wall, *row), pairs, (0.0,) * dimension, p["duration"], p)


def exact(scene: Scene) -> dict[str, float]:
    """Equilibrium."""
    return {"displacement": 0.0, "penetration": 0.0, "kinetic_energy": 0.0, "load_error": 0.0}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Largest displacement of a ball and deepest overlap; energy and worst mean load of the last second."""
    d = scene.dimension
    place = trajectory.pose[:, 1:, :d]
    late = trajectory.t > trajectory.t[-1] - WINDOW
    measured: dict[str, Measured] = {
        "displacement": (float(np.linalg.norm(place - place[0], axis=2).max()), ""),
        "penetration": (metrics.deepest_overlap(scene, trajectory), ""),
        "kinetic_energy": (float(metrics.kinetic_energy(scene, trajectory)[late].mean()), ""),
        "load_error": (None, metrics.UNAVAILABLE),
    }
    off, press = [], scene.params["press"] * trajectory.dt
    for k in range(1, len(scene.bodies)):
        impulses = metrics.late_impulses(trajectory, k - 1, k, WINDOW)
        if impulses is None:
            return measured
        off.append(abs(float(impulses[:, 0].mean()) / press - 1.0))
    return measured | {"load_error": (metrics.largest(off), "")}


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """As for a standing column, with the acceleration of the press on its ball."""
    p, n = scene.params, len(scene.bodies) - 1
    pressed, length, source = p["press"] / p["mass"], 2.0 * RADIUS * n, "static equilibrium"
    # The momentum error is that of all balls, the load that of one.
    share = bounds.carried(dt)
    allowed = {
        "displacement": ("m", bounds.slips(n, pressed, dt)),
        "penetration": ("m", bounds.found_late(pressed, dt, length)),
        "kinetic_energy": ("J", bounds.still_energy(n * p["mass"], pressed, dt)),
        "load_error": ("1", bounds.Bound(n * share.value, share.because)),
    }
    return [bound.check(name, unit, truth[name], source) for name, (unit, bound) in allowed.items()]


def growth(scene: Scene) -> float:
    """Largest amplification of a distance from the line: a pressed row buckles.

    Two balls at distances y and y' from the line push each other across it by F (y - y')/d, d being their diameter: m
    y_k'' = F/d (2 y_k - y_{k-1} - y_{k+1}). The magnitudes of these factors sum to at most 4, and those of powers of
    the differences to powers of 4, so a start at rest grows at most as cosh(2 t sqrt(F/(m d))).
    """
    p = scene.params
    return bounds.saddle(2.0 * scene.duration * math.sqrt(p["press"] / (p["mass"] * 2.0 * RADIUS)))


def sampling(scene: Scene) -> Sampling:
    """Every step; contacts over the last second."""
    return Sampling(1, max(0.0, scene.duration - WINDOW))


def track(scene: Scene) -> Track:
    """The pressed ball at rest."""
    last = scene.bodies[-1]
    return Track(last.name, lambda t: last.pose[: scene.dimension])


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Largest displacement of a ball, in diameters."""
    value, reason = found["displacement"]
    return (None, reason) if value is None else (value / (2.0 * RADIUS), "")


def fate(scene: Scene, found: Mapping[str, Measured]) -> str:
    """``gave way`` if a ball is in another, or off its place, by a tenth of its diameter."""
    worst = [found.get(name, (None, ""))[0] for name in ("displacement", "penetration")]
    known = [value for value in worst if value is not None]
    if len(known) < len(worst):
        return "NaN"
    return "gave way" if metrics.largest(known) > 0.1 * 2.0 * RADIUS else ""


_HELD = "held: no ball a tenth of its diameter off its place, or inside another"

SCENE = CanonicalScene(
    name="starved",
    version=1,
    title="Row of balls pressed against a wall, with too few iterations",
    symptoms=(
        "a row or heap is squeezed with too few solver iterations",
        "how many solver iterations do I need",
        "a long chain of touching bodies is compressed",
        "raising the number of iterations makes the contact stiffer",
        "pressed bodies overlap with few iterations",
        "a queue of balls pushed against a wall interpenetrates",
        "the solver has not converged: contacts give way",
        "ten position and velocity iterations are too few for many bodies",
        "a line of crates pushed by a bulldozer is crushed together",
    ),
    family="hard",
    figure=__doc__ or "",
    law="nothing moves; every contact carries the press",
    dimensions=(2,),
    parameters=(
        Parameter("n", 10, "1", "number of balls: forty iterations for each factor of e", 1, 1000, integer=True),
        Parameter("press", 10.0, "N", "force on the last ball, about the weight of one", 0.0, 1e6, positive=True),
        Parameter("duration", 2.0, "s", "one second to yield, and one to carry", 1.0, 1e3),
        mass_of("each ball"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=sampling,
    growth=growth,
    track=track,
    quick=(Variation({}, (None, FEW[0])),),
    standard=(Variation({}, (None, *FEW)),),
    full=(Variation({}, (None, *MANY)), Variation({"n": 3.0}), Variation({"n": 30.0})),
    planted=({},),
    primary=Primary(
        "displacement",
        "diameter",
        "largest displacement of a ball within 2 s, in diameters, n = 10",
        "nothing may move: the residual of the iterations lets the press move the row",
        lambda dt: [{}],
        error,
        "the pressed row, half a second after the start",
        0.5,
        0.25,
    ),
    frontiers=(
        Frontier("iterations", "", "iterations", 100.0, 1.0, 1.0, fate, _HELD, whole=True),
        Frontier("balls in a row", "balls", "n", 2.0, 40.0, 100.0, fate, _HELD, whole=True),
    ),
    words={
        "displacement": "lets a ball move by {value}",
        "load_error": "leaves a contact's load off by {value} of the press",
    },
)
