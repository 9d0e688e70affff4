r"""Two cards lean against each other, held by friction of the floor only: they stand, or they slide out.

            _/\_            moments about a foot:    H = W cot(lean) / (2 + w/(L' sin(lean)))  where the heads meet
        H  /    \  H        stands    if  mu >= H/W,    of thin cards tan(from upright)/2
          /      \          slides    else:  both feet go out alike, the heads go down together,
    mu W /________\ mu W              one angle, by Newton's and Euler's laws with mu N at each foot
    ======================  W: weight of a card, w: thickness, L' = L - w: length of its axis, L: with its round ends

The edges of the cards are round, because the normal between two corners is undefined. Three forces act on each card, so
the loads are determined; the heads push horizontally, and grip each other, which keeps the tent symmetric.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from adapters.scene import Body, Capsule, Pair, Scene, SceneError
from adapters.trajectory import Trajectory
from validation import metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary
from validation.scenes.parts import floor, mass_of, standard_gravity, tilted, upward
from validation.truths import leaning

#: The cards by name, their bodies, and the direction in which each turns when its foot slides out.
CARDS = (("left", 1, -1.0), ("right", 2, 1.0))


def _sizes(p: Params) -> tuple[float, float]:
    """Half the length of a card's axis, and the radius of its ends [m]."""
    radius = 0.5 * p["aspect"] * p["length"]
    return 0.5 * p["length"] - radius, radius


def needed(p: Params) -> float:
    """Friction of the floor that just holds the tent; the load of the heads over a card's weight."""
    a, r = _sizes(p)
    lean = math.radians(p["lean"])
    return a * math.cos(lean) / (2.0 * a * math.sin(lean) + r)


def friction(p: Params) -> float:
    """Friction of the floor, and of the heads on each other."""
    return p["ratio"] * needed(p)


def _moment(p: Params) -> float:
    """Moment of inertia of a card over its mass [m^2]: a box 2 a by 2 r between two halves of a disc."""
    a, r = _sizes(p)
    box, disc = 4.0 * a * r, math.pi * r * r
    return (box * (a * a + r * r) / 3.0 + disc * (0.5 * r * r + a * a) + 8.0 / 3.0 * a * r**3) / (box + disc)


def _forces(p: Params, lean: float, square: float) -> tuple[float, float, float]:
    """Acceleration of the lean [rad/s^2] of sliding cards, and loads of a foot and of the heads over the weight.

    The centre of a card is at (-a cos(lean) - r, a sin(lean) + r) from where the heads' middle stands over the floor.
    """
    a, r = _sizes(p)
    c, s, mu, g = math.cos(lean), math.sin(lean), friction(p), p["g"]
    lever = 2.0 * a * s + r  # of the force along the floor about the heads, which go down with its work
    bent = (mu * (g - a * s * square) * lever - g * a * c) / (a * a + _moment(p) - mu * a * c * lever)
    press = 1.0 + a * (c * bent - s * square) / g
    return bent, press, mu * press - a * (s * bent + c * square) / g


@lru_cache(maxsize=64)
def _slides(key: tuple[tuple[str, float], ...], off: float = 0.0) -> leaning.Turn | None:
    """The fall of a tent from a lean that is ``off`` [rad]; None if it stays."""
    p = dict(key)
    start = math.radians(p["lean"]) + off
    return leaning.turn(lambda lean, square: (_forces(p, lean, square)[0], 0.0), start, start - leaning.TOLD)


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the heads meet over the origin.

    Raises
    ------
    SceneError
        For a tent whose feet or heads separate in the fall.
    """
    p, lean = params, math.radians(params["lean"])
    duration = leaning.DURATION
    if p["ratio"] < 1.0:
        found = _slides(leaning.key(p))
        loads = [] if found is None else _forces(p, lean - leaning.TOLD, found.spin**2)[1:]
        if found is None or min(loads) <= 0.0:
            raise SceneError(f"card_tent.ratio: at {p['ratio']:g} the cards do not slide down on each other")
        duration = found.time + leaning.AFTERMATH
    a, r = _sizes(p)
    x, y = a * math.cos(lean) + r, a * math.sin(lean) + r
    card = Body("left", Capsule(a, r), p["mass"], p["mass"] * _moment(p))
    left = tilted(card, dimension, (-x, y), lean)
    right = tilted(Body("right", card.shape, card.mass, card.inertia), dimension, (x, y), math.pi - lean)
    pairs = (Pair(restitution=0.0, friction=friction(p)),)
    bodies = (floor(dimension), left, right)
    return Scene("card_tent", 1, dimension, bodies, pairs, upward(dimension, -p["g"]), duration, p)


def exact(scene: Scene) -> dict[str, float]:
    """Moments about a foot, or a fall with friction at the feet."""
    p = scene.params
    if p["ratio"] >= 1.0:
        return {"moved": 0.0, "head_load": needed(p), "floor_load": 1.0}
    found = _slides(leaning.key(p))
    assert found is not None  # `make` has refused it
    truth = {f"passing_time[{name}]": found.time for name, _, _ in CARDS}
    return truth | {f"passing_spin[{name}]": found.spin for name, _, _ in CARDS} | {"let_go": 0.0}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Largest displacement of a point of either card, loads at the end, times of a rotation, gaps of feet and heads."""
    p, t = scene.params, trajectory.t
    a, r = _sizes(p)
    found: dict[str, Measured] = {}
    moved, until, gaps, heads = list[float](), np.zeros(len(t), dtype=bool), [], []
    for name, k, way in CARDS:
        turned, rate = metrics.tilt(trajectory, k), metrics.tilt_rate(trajectory, k)
        time, spin = metrics.crossing(t, way * (turned - turned[0]), way * rate, leaning.TOLD)
        found |= {f"passing_time[{name}]": time, f"passing_spin[{name}]": spin}
        until |= t <= (t[-1] if time[0] is None else time[0])
        gaps.append(metrics.point(trajectory, k, (-a, 0.0))[:, 1] - r)
        heads.append(metrics.point(trajectory, k, (a, 0.0)))
        moved.append(leaning.way(scene, trajectory, k))
    gaps.append(np.linalg.norm(heads[1] - heads[0], axis=1) - 2.0 * r)
    weight = p["mass"] * p["g"] * trajectory.dt
    feet = [leaning.load(trajectory, 0, k, 1, 2.0 * weight) for _, k, _ in CARDS]
    pressed = [value for value, _ in feet if value is not None]
    return found | {
        "moved": (metrics.largest(moved), ""),
        "head_load": leaning.load(trajectory, 1, 2, 0, weight),
        "floor_load": (sum(pressed), "") if len(pressed) == len(feet) else (None, metrics.UNAVAILABLE),
        "let_go": (metrics.largest(np.abs(gap[until]).max() for gap in gaps), ""),
    }


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """As for all leaning bodies that stand or fall."""
    p = scene.params
    return leaning.checks(
        p,
        dt,
        truth,
        {"head_load": math.sin(math.radians(p["lean"])), "floor_load": 1.0},
        "forces and moments in balance: H = W cot(lean)/(2 + w/(L' sin(lean)))",
        lambda off: _slides(leaning.key(p), off),
        lambda lean, square: _forces(p, lean, square)[0],
    )


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Displacement of a tent that should stand, in lengths; relative error of the time of one that slides."""
    return leaning.outcome(scene, exact(scene), found)


SCENE = CanonicalScene(
    name="card_tent",
    family="stacks and statics",
    version=1,
    title="Two cards lean against each other: they stand or slide out",
    symptoms=(
        "two cards that lean against each other slide out",
        "a card house falls apart",
        "a tent of two plates does not stand",
        "an A-frame of two boards collapses",
        "two leaning planks spread at the foot",
        "playing cards leaning on each other never rest",
        "two sticks propped against each other slip",
        "thin plates that support each other sink into one another",
    ),
    figure=__doc__ or "",
    law="stands if mu >= a cos(lean)/(2 a sin(lean) + r), which is the load of the heads over a card's weight",
    dimensions=(2,),
    parameters=(
        Parameter("ratio", 1.05, "1", "friction over the least that holds", 0.01, 100.0),
        Parameter("lean", 60.0, "degrees", "angle of the cards to the floor", 20.0, 85.0),
        Parameter("length", 2.0, "m", "of a card", 0.0, 1e3, positive=True),
        Parameter("aspect", 0.05, "1", "thickness over length", 0.0, 0.3, positive=True),
        standard_gravity(),
        mass_of("a card"),
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
        "displacement of the tent that should stand, in lengths; relative error of the time of the one that slides",
        "whether it stands, and how fast it moves if it does not",
        lambda dt: [dict(params) for params in leaning.STANDS_AND_SLIDES],
        error,
        "the whole scene: the tent stands",
    ),
    words={
        "moved": "moves by {value} where it should stand",
        "head_load": "pushes head on head with {value}",
        "floor_load": "presses on the floor with {value}",
        "passing_time": "has slid down after {value}",
        "passing_spin": "turns with {value} there",
        "let_go": "a foot or the heads part, or overlap, by {value}",
    },
)
