r"""A ladder leans on a smooth wall, held by friction of the floor only: it stands, or it slides down.

              /|         moments about the foot:   N_w = W/2 (cot(lean) - w/L),  w: thickness
             / |  <- N_w   stands    if  mu >= N_w/W
            /  |           slides    else:  the foot goes out, the head goes down,
     mu W->/___|           one angle, by Newton's and Euler's laws with mu N at the foot
    ==============         W: weight, L: length

``ratio`` is mu over the least that holds. The load on the wall is judged as well: it follows from the moments.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from adapters.scene import Body, HalfSpace, Pair, Scene, SceneError
from adapters.trajectory import Trajectory
from validation import metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary
from validation.scenes.parts import along, block, floor, mass_of, standard_gravity, tilted, upward
from validation.truths import leaning


def needed(p: Params) -> float:
    """Friction of the floor that just holds the ladder; the load on the wall over the weight."""
    return 0.5 * (1.0 / math.tan(math.radians(p["lean"])) - p["aspect"])


def friction(p: Params) -> float:
    """Friction of the floor."""
    return p["ratio"] * needed(p)


def _forces(p: Params, lean: float, square: float) -> tuple[float, float, float]:
    """Acceleration of the lean [rad/s^2], and loads of floor and wall over the weight.

    The foot is at (-L cos(lean), 0), the head at distance L along the ladder at the wall, the centre at half of it and
    w/2 off.
    """
    length, half, thick = p["length"], 0.5 * p["length"], 0.5 * p["aspect"] * p["length"]
    c, s = math.cos(lean), math.sin(lean)
    mu = friction(p)
    # Centre (-half c - thick s, half s + thick c): first and second derivative by the lean.
    by = np.array([half * s - thick * c, half * c - thick * s])
    twice = np.array([half * c + thick * s, -half * s - thick * c])
    foot = np.array([-half * c + thick * s, -half * s - thick * c])
    head = np.array([half * c + thick * s, half * s - thick * c])
    own = length * length * (1.0 + p["aspect"] ** 2) / 12.0
    # Unknown: lean'', and forces of floor and wall over the mass: (mu, 1), against a foot that slides out, and (-1, 0).
    system = np.array(
        [
            [by[0], -mu, 1.0],
            [by[1], -1.0, 0.0],
            [own, -(foot[0] - foot[1] * mu), -head[1]],
        ]
    )
    found = np.linalg.solve(system, [-twice[0] * square, -p["g"] - twice[1] * square, 0.0])
    return float(found[0]), float(found[1]) / p["g"], float(found[2]) / p["g"]


@lru_cache(maxsize=64)
def _slides(key: tuple[tuple[str, float], ...], off: float = 0.0) -> leaning.Turn | None:
    """The fall of a ladder from a lean that is ``off`` [rad]; None if it stays."""
    p = dict(key)
    start = math.radians(p["lean"]) + off
    return leaning.turn(lambda lean, square: (_forces(p, lean, square)[0], 0.0), start, start - leaning.TOLD)


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the wall is at 0, the ladder to the left of it touches floor and wall.

    Raises
    ------
    SceneError
        For a ladder that needs no wall, and one that leaves the wall in the fall.
    """
    p, lean = params, math.radians(params["lean"])
    if needed(p) <= 0.0:
        raise SceneError(f"ladder.lean: a ladder as thick as {p['aspect']:g} stands by itself at {p['lean']:g} degrees")
    duration = leaning.DURATION
    if p["ratio"] < 1.0:
        found = _slides(leaning.key(p))
        loads = [] if found is None else _forces(p, lean - leaning.TOLD, found.spin**2)[1:]
        if found is None or min(loads) <= 0.0:
            raise SceneError(f"ladder.ratio: at {p['ratio']:g} the ladder does not slide down along the wall")
        duration = found.time + leaning.AFTERMATH
    half, thick = 0.5 * p["length"], 0.5 * p["aspect"] * p["length"]
    place = -half * math.cos(lean) - thick * math.sin(lean), half * math.sin(lean) + thick * math.cos(lean)
    body = block("ladder", dimension, p["mass"], 2.0 * thick, p["length"])
    body = tilted(body, dimension, place, lean - 0.5 * math.pi)
    wall = Body("wall", HalfSpace(along(dimension, -1.0), 0.0), motion="fixed")
    pairs = (Pair("floor", "ladder", 0.0, friction(p)), Pair("wall", "ladder", 0.0, 0.0))
    bodies = (floor(dimension), wall, body)
    return Scene("ladder", 1, dimension, bodies, pairs, upward(dimension, -p["g"]), duration, p)


def exact(scene: Scene) -> dict[str, float]:
    """Moments about the foot, or a fall with friction at the foot."""
    p = scene.params
    if p["ratio"] >= 1.0:
        return {"moved": 0.0, "wall_load": needed(p), "floor_load": 1.0}
    found = _slides(leaning.key(p))
    assert found is not None  # `make` has refused it
    return {"passing_time": found.time, "passing_spin": found.spin, "let_go": 0.0}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Largest displacement of a point of the ladder, loads at the end, time of a rotation, and gaps of its two ends."""
    p, d, t = scene.params, scene.dimension, trajectory.t
    turned, rate = metrics.tilt(trajectory, 2), metrics.tilt_rate(trajectory, 2)
    time, spin = metrics.crossing(t, turned[0] - turned, -rate, leaning.TOLD)
    half, thick = 0.5 * p["length"], 0.5 * p["aspect"] * p["length"]
    foot = metrics.point(trajectory, 2, along(d, thick, -half))[:, d - 1]
    head = metrics.point(trajectory, 2, along(d, thick, half))[:, 0]
    until = t <= (t[-1] if time[0] is None else time[0])
    weight = p["mass"] * p["g"] * trajectory.dt
    return {
        "floor_load": leaning.load(trajectory, 0, 2, d - 1, weight),
        "wall_load": leaning.load(trajectory, 1, 2, 0, -weight),
        "moved": (leaning.way(scene, trajectory, 2), ""),
        "passing_time": time,
        "passing_spin": spin,
        "let_go": (metrics.largest(np.abs(end[until]).max() for end in (foot, head)), ""),
    }


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """As for all leaning bodies that stand or fall."""
    p = scene.params
    return leaning.checks(
        p,
        dt,
        truth,
        {"wall_load": math.sin(math.radians(p["lean"])), "floor_load": 1.0},
        "forces and moments in balance: N_w = W/2 (cot(lean) - w/L)",
        lambda off: _slides(leaning.key(p), off),
        lambda lean, square: _forces(p, lean, square)[0],
    )


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Displacement of a ladder that should stand, in lengths; relative error of the time of one that slides."""
    return leaning.outcome(scene, exact(scene), found)


SCENE = CanonicalScene(
    name="ladder",
    family="stacks and statics",
    version=1,
    title="Ladder on a smooth wall: it stands or slides down",
    symptoms=(
        "a ladder slides although it should stand",
        "a ladder against a wall slips down",
        "a leaning plank does not stay up",
        "a broom leaning in a corner falls over",
        "a rod propped against a smooth wall creeps",
        "a board leant on a wall slides out at its foot",
        "the smallest angle at which a ladder stands is wrong",
        "a stick that leans on a wall sinks into it",
    ),
    figure=__doc__ or "",
    law="stands if mu >= (cot(lean) - w/L)/2, which is the load on the wall over the weight; else slides down",
    dimensions=(2,),
    parameters=(
        Parameter("ratio", 1.05, "1", "friction of the floor over the least that holds", 0.01, 100.0),
        Parameter("lean", 60.0, "degrees", "angle of the ladder to the floor", 20.0, 85.0),
        Parameter("length", 4.0, "m", "of the ladder", 0.0, 1e3, positive=True),
        Parameter("aspect", 0.02, "1", "thickness over length", 0.0, 0.3, positive=True),
        standard_gravity(),
        mass_of("the ladder"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=leaning.sampling,
    quick=leaning.QUICK,
    full=leaning.FULL,
    planted=leaning.STANDS_AND_SLIDES,
    primary=Primary(
        "outcome error",
        "1",
        "displacement of the ladder that should stand, in lengths; relative error of the time of the one that slides",
        "whether it stands, and how fast it moves if it does not",
        lambda dt: [dict(params) for params in leaning.STANDS_AND_SLIDES],
        error,
        "the whole scene: the ladder stands",
    ),
    words={
        "moved": "moves by {value} where it should stand",
        "wall_load": "presses on the wall with {value}",
        "floor_load": "presses on the floor with {value}",
        "passing_time": "has slid down after {value}",
        "passing_spin": "turns with {value} there",
        "let_go": "an end leaves floor or wall, out or in, by {value}",
    },
)
