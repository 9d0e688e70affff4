r"""A box slides down a slope and shoves another one along the floor, all of it smooth: two accelerations, one force.

    \  /\   ____          slope: s'' = m g sin(a)/(m + M cos(a)^2)
     \/  \ |    |         floor: x'' = s'' cos(a),   the corner slides down the face meanwhile
      \  / |  M |         force: N = M x'',          level, from corner to face
       \/  |    |
    ====\=============    nothing turns while slope and floor can hold both

Each contact depends on the three others: solving them one after the other, without convergence, gives accelerations
that do not agree.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from adapters.scene import Body, HalfSpace, Pair, Scene, SceneError
from adapters.trajectory import Sampling, Trajectory
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Variation
from validation.scenes.parts import at, block, floor, mass_of, standard_gravity, tilted, upward

#: Width and height of the box on the slope, and of the one on the floor [m].
UPPER, LOWER = (1.5, 1.5), (4.0, 2.5)
#: Height of the lowest corner over the floor at the start [m], and duration of the run [s].
CLEARANCE, DURATION = 0.9, 0.5


def _laws(p: Params) -> tuple[float, float, float]:
    """Accelerations down the slope and along the floor [m/s^2], and the force between the boxes [N]."""
    angle, light, heavy = math.radians(p["angle"]), p["mass"], p["mass"] * p["ratio"]
    down = light * p["g"] * math.sin(angle) / (light + heavy * math.cos(angle) ** 2)
    ahead = down * math.cos(angle)
    return down, ahead, heavy * ahead


def _corner(p: Params) -> tuple[float, float]:
    """The upper right corner of the box on the slope at the start [m]; the slope meets the floor at 0."""
    angle = math.radians(p["angle"])
    return UPPER[1] * math.sin(angle) - CLEARANCE / math.tan(angle), CLEARANCE + UPPER[1] * math.cos(angle)


def _held(p: Params, sunk: float) -> bool:
    """Whether slope and floor can hold both boxes level, the corner ``sunk`` [m] below where it started."""
    angle, (width, height) = math.radians(p["angle"]), UPPER
    _, _, force = _laws(p)
    c, s = math.cos(angle), math.sin(angle)
    # Points of action of the slope on the upper box, and of the floor on the lower one, relative to their middles.
    slope = -force * (height * c - width * s) / 2.0 / (p["mass"] * p["g"] * c + force * s)
    ground = (_corner(p)[1] - sunk - 0.5 * LOWER[1]) * force / (p["mass"] * p["ratio"] * p["g"])
    return abs(slope) < 0.45 * width and abs(ground) < 0.45 * LOWER[0]


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the boxes touch, at rest.

    Raises
    ------
    SceneError
        If the boxes would tip, or the upper one would reach the floor or leave the other's face.
    """
    p, angle = params, math.radians(params["angle"])
    down, _, _ = _laws(p)
    sunk = 0.5 * down * DURATION**2 * math.sin(angle)
    x, y = _corner(p)
    if sunk > 0.9 * CLEARANCE or x <= 0.0 or y >= LOWER[1]:
        raise SceneError(f"shove.angle: at {p['angle']:g} degrees the boxes do not meet, or not for all of the run")
    if not (_held(p, 0.0) and _held(p, sunk)):
        raise SceneError(f"shove.ratio: at {p['ratio']:g} a box tips")
    slope = Body("slope", HalfSpace((math.sin(angle), math.cos(angle)), 0.0), motion="fixed")
    width, height = UPPER
    place = (
        x - 0.5 * width * math.cos(angle) - 0.5 * height * math.sin(angle),
        y + 0.5 * width * math.sin(angle) - 0.5 * height * math.cos(angle),
    )
    upper = tilted(block("upper", dimension, p["mass"], width, height), dimension, place, -angle)
    lower = block("lower", dimension, p["mass"] * p["ratio"], *LOWER)
    lower = at(lower, dimension, (x + 0.5 * LOWER[0], 0.5 * LOWER[1]))
    pairs = (Pair(restitution=0.0, friction=0.0),)
    bodies = (floor(dimension), slope, upper, lower)
    return Scene("shove", 1, dimension, bodies, pairs, upward(dimension, -p["g"]), DURATION, p)


def exact(scene: Scene) -> dict[str, float]:
    """Newton's law for both boxes, with one force between them."""
    down, ahead, force = _laws(scene.params)
    truth = {"down": down, "ahead": ahead, "force": force / (scene.params["mass"] * scene.params["g"])}
    return truth | {"parted": 0.0, "turned": 0.0}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Mean accelerations and force over the second half, largest gap or overlap between the boxes, largest rotation."""
    p, angle, t = scene.params, math.radians(scene.params["angle"]), trajectory.t
    along = np.array([math.cos(angle), -math.sin(angle)])
    corner = metrics.point(trajectory, 2, (0.5 * UPPER[0], 0.5 * UPPER[1]))[:, 0]
    face = trajectory.pose[:, 3, 0] - 0.5 * LOWER[0]
    swung = metrics.largest(
        metrics.turned(trajectory.pose[:, k]) * metrics.reach(scene.bodies[k].shape) for k in (2, 3)
    )
    late = metrics.late_impulses(trajectory, 2, 3, 0.5 * DURATION)
    weight = p["mass"] * p["g"] * trajectory.dt
    return {
        "down": metrics.mean_rate(t, trajectory.twist[:, 2, :2] @ along),
        "ahead": metrics.mean_rate(t, trajectory.twist[:, 3, 0]),
        "force": (None, metrics.UNAVAILABLE) if late is None else (float(late[:, 0].mean()) / weight, ""),
        "parted": (float(np.abs(corner - face).max()), ""),
        "turned": (swung, ""),
    }


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """Constant forces are exact in every scheme, once all contacts are found; one may be found a step late.

    The force follows from impulses, which are as exact as the speed that they cause: ``driven`` for the moved mass.
    """
    p, g = scene.params, scene.params["g"]
    pace = bounds.driven(g, dt, 0.5 * scene.duration)
    load = bounds.Bound(
        p["ratio"] * pace.value / g,
        f"{pace.because}, of the moved mass",
    )
    apart = bounds.Bound(
        2.0 * g * dt * dt + bounds.ROUND_OFF * LOWER[0], "one contact found one step late, g dt^2, on either side"
    )
    turn = bounds.Bound(
        2.0 * g * dt * dt + bounds.ROUND_OFF * LOWER[0], "a corner whose contact is found one step late sinks by g dt^2"
    )
    source = "Newton's law for two bodies with one force between them"
    return [
        pace.check("down", "m/s^2", truth["down"], source),
        pace.check("ahead", "m/s^2", truth["ahead"], source),
        load.check("force", "weights", truth["force"], source),
        apart.check("parted", "m", truth["parted"], "the corner stays on the face"),
        turn.check("turned", "m", truth["turned"], "slope and floor hold the boxes level"),
    ]


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Larger of the relative errors of both accelerations."""
    return metrics.relative_error(found, exact(scene), ("down", "ahead"))


SCENE = CanonicalScene(
    name="shove",
    family="grip and force",
    version=1,
    title="Box that slides down a slope and shoves another",
    symptoms=(
        "a block that slides down a slope pushes another one too weakly",
        "a box on a ramp shoves a box on the floor: wrong force",
        "two bodies in contact accelerate with different speeds",
        "a wedge pushed by a sliding block moves wrongly",
        "a body that pushes another loses contact",
        "the force between a pushing and a pushed block is wrong",
        "a bulldozer-like block gives the next one too much speed",
        "two touching blocks on a slope and a plane separate",
    ),
    figure=__doc__ or "",
    law="s'' = m g sin(a)/(m + M cos(a)^2),  x'' = s'' cos(a),  N = M x''",
    dimensions=(2,),
    parameters=(
        Parameter("angle", 45.0, "degrees", "of the slope", 20.0, 70.0),
        Parameter("ratio", 2.0, "1", "mass of the box on the floor over that of the one on the slope", 0.01, 1e3),
        standard_gravity(),
        mass_of("the box on the slope"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=lambda scene: Sampling(1, 0.5 * DURATION),
    quick=(Variation({}), Variation({"ratio": 20.0})),
    full=tuple(Variation({"ratio": r}) for r in (0.5, 2.0, 20.0)),
    planted=({},),
    primary=Primary(
        "acceleration error",
        "1",
        "larger of the relative errors of both accelerations",
        "the two accelerations agree if all four contacts are solved together",
        lambda dt: [{}, {"ratio": 20.0}],
        error,
        "the boxes on their way",
    ),
    smooth=("down", "ahead"),
    words={
        "down": "goes down the slope with {value}",
        "down<0": "goes up the slope with {value}",
        "ahead": "shoves the other box with {value}",
        "ahead<0": "has the other box come back with {value}",
        "force": "presses on it with {value}",
        "parted": "parts from it, or overlaps, by {value}",
        "turned": "turns: corners move by {value}",
    },
)
