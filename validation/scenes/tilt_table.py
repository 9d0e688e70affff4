"""A block on a tilted table: it stays, slides or topples.

         ____
        /   /|           stays    if tan(theta) <= mu and tan(theta) <= width/height
       /   / |           slides   where friction gives first:  a = g (sin(theta) - mu cos(theta))
      /___/  |           topples  where the edge gives first:  phi'' = p^2 sin(phi), from phi = theta - alpha
    =========== theta

Gravity is rotated by theta, not the table. ``ratio`` is tan(theta) over the limit that is reached first: below 1
nothing may move, above it the block must slide or topple, as the limit says.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from adapters.scene import Pair, Scene, SceneError
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Variation
from validation.scenes.parts import along, at, block, floor, mass_of, standard_gravity, states, upward
from validation.truths.pivoting import WORDS, Pivot, fall_checks

#: Rotation of a toppling block at the measurement [rad], and the time of the run beyond it [s].
TOLD, AFTERMATH = math.radians(15.0), 0.05
#: Number of angles at which the grip of the edge is checked.
ASKED = 50
#: Duration of a run in which the block stays or slides [s].
DURATION = 2.0


def angle(p: Params) -> float:
    """Tilt of the table [rad]."""
    return math.atan(p["ratio"] * min(p["mu"], p["aspect"]))


def outcome(p: Params) -> str:
    """``stays``, ``slides`` or ``topples``."""
    if p["ratio"] <= 1.0:
        return "stays"
    return "slides" if p["mu"] < p["aspect"] else "topples"


def _fall(p: Params) -> tuple[Pivot, float, float]:
    """The block on its lower edge, and the angles of its diagonal to gravity at the start and at the measurement."""
    on = Pivot(p["aspect"] * p["height"], p["height"], p["g"])
    return on, angle(p) - on.alpha, angle(p) - on.alpha + TOLD


def _held(p: Params, on: Pivot, start: float, phi: float) -> bool:
    """Whether friction of the table holds the edge there."""
    across, up = on.grip(start, 0.0, phi)
    c, s = math.cos(angle(p)), math.sin(angle(p))
    return abs(across * c - up * s) <= p["mu"] * (across * s + up * c)


def make(dimension: int, params: Params) -> Scene:
    """Build the scene; the block would go along +x.

    Raises
    ------
    SceneError
        For limits so near each other that it does both, and for an edge that friction does not hold throughout.
    """
    p, theta = params, angle(params)
    duration = DURATION
    if p["ratio"] > 1.0 and p["ratio"] * min(p["mu"], p["aspect"]) >= max(p["mu"], p["aspect"]):
        raise SceneError(f"tilt_table.ratio: at {p['ratio']:g} the block slides and topples at once")
    if outcome(p) == "topples":
        on, start, end = _fall(p)
        if not all(_held(p, on, start, float(phi)) for phi in np.linspace(start, end, ASKED)):
            raise SceneError(f"tilt_table.mu: {p['mu']:g} does not hold the edge while the block topples")
        duration = on.time(start, 0.0, end) + AFTERMATH
    width = p["aspect"] * p["height"]
    box = at(block("block", dimension, p["mass"], width, p["height"]), dimension, upward(dimension, 0.5 * p["height"]))
    gravity = along(dimension, p["g"] * math.sin(theta), -p["g"] * math.cos(theta))
    pairs = (Pair(restitution=0.0, friction=p["mu"]),)
    return Scene("tilt_table", 1, dimension, (floor(dimension), box), pairs, gravity, duration, p)


def exact(scene: Scene) -> dict[str, float]:
    """At rest, a constant acceleration, or a pendulum about an edge."""
    p = scene.params
    if outcome(p) == "stays":
        return {"moved": 0.0}
    if outcome(p) == "slides":
        return {"acceleration": p["g"] * (math.sin(angle(p)) - p["mu"] * math.cos(angle(p))), "turned": 0.0}
    on, start, end = _fall(p)
    return {
        "passing_time": on.time(start, 0.0, end),
        "passing_spin": on.speed(start, 0.0, end),
        "edge_moved": 0.0,
    }


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Largest displacement of a point of the block, mean acceleration over the second half, time of an angle."""
    p, d = scene.params, scene.dimension
    width, pose = p["aspect"] * p["height"], trajectory.pose[:, 1]
    turn, spin = -metrics.tilt(trajectory), -metrics.tilt_rate(trajectory)
    time, speed = metrics.crossing(trajectory.t, turn, spin, TOLD)
    edge = metrics.point(trajectory, 1, along(d, 0.5 * width, -0.5 * p["height"]))
    before = trajectory.t <= (trajectory.t[-1] if time[0] is None else time[0])
    swung = metrics.turned(pose) * metrics.reach(scene.bodies[1].shape)
    return {
        "moved": (float(np.linalg.norm(pose[:, :d] - pose[0, :d], axis=1).max()) + swung, ""),
        "acceleration": metrics.mean_rate(trajectory.t, trajectory.twist[:, 1, 0]),
        "turned": (swung, ""),
        "passing_time": time,
        "passing_spin": speed,
        "edge_moved": (float(np.linalg.norm(edge - edge[0], axis=1)[before].max()), ""),
    }


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """Contacts of a resting block may be found one step late; a sliding block has constant forces.

    A toppling block starts from an angle with the error of a corner found one step late, g dt^2 deep.
    """
    p, g, source = scene.params, scene.params["g"], "Coulomb's law; the centre of mass over the base"
    if "moved" in truth:
        late = bounds.Bound(
            2.0 * g * dt * dt + bounds.ROUND_OFF * p["height"],
            "one contact found one step late, g dt^2, and a corner that sinks or slips as far",
        )
        return [late.check("moved", "m", truth["moved"], source)]
    if "acceleration" in truth:
        pace = bounds.driven(g, dt, 0.5 * scene.duration)
        turn = bounds.Bound(g * dt * dt, "a corner whose contact is found one step late sinks by g dt^2")
        return [
            pace.check("acceleration", "m/s^2", truth["acceleration"], source),
            turn.check("turned", "m", truth["turned"], source),
        ]
    on, start, end = _fall(p)
    return fall_checks(on, start, end, dt, truth, tilted=g * dt * dt / on.width)


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Displacement of a block that should stay, in heights; else the relative error of acceleration or time."""
    truth = exact(scene)
    metric = next(iter(truth))
    value, reason = found[metric]
    if value is None:
        return None, reason
    off = abs(value - truth[metric])
    return off / (scene.params["height"] if metric == "moved" else truth[metric]), ""


SCENE = CanonicalScene(
    name="tilt_table",
    family="stacks and statics",
    version=1,
    title="Block on a tilted table: stays, slides or topples",
    symptoms=(
        "a block topples instead of sliding",
        "a box on a tilting table slides though it should tip over",
        "a tall object falls over too early when the ground is tilted",
        "at which angle does a box tip over",
        "an object on a tray slides off at the wrong angle",
        "a high narrow box never tips on a slope",
        "a bottle on a tilted plate falls at the wrong inclination",
        "a crate on a lorry that tilts slides too soon",
        "a box tips over when I push it",
    ),
    figure=__doc__ or "",
    law="stays if tan(theta) <= min(mu, width/height); else slides or topples, whichever limit is reached first",
    dimensions=(2, 3),
    parameters=(
        Parameter("ratio", 0.98, "1", "tan(theta) over the limit that is reached first", 0.0, 10.0, positive=True),
        Parameter("mu", 0.5, "1", "friction of the pair", 0.0, 10.0, positive=True),
        Parameter("aspect", 0.3, "1", "width over height of the block; below mu it topples", 0.05, 10.0),
        Parameter("height", 1.0, "m", "of the block", 0.0, 1e3, positive=True),
        standard_gravity(),
        mass_of("the block"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    quick=(
        Variation({"ratio": 0.98}, dimensions=(3,)),
        Variation({"ratio": 0.98, "aspect": 1.0}, dimensions=(2,)),
        Variation({"ratio": 1.1}),
        Variation({"ratio": 1.1, "aspect": 1.0}),
    ),
    standard=(
        *(Variation({"ratio": ratio}) for ratio in (0.98, 1.1)),
        *(Variation({"ratio": ratio, "aspect": 1.0}) for ratio in (0.98, 1.1)),
    ),
    full=tuple(
        Variation({"ratio": ratio, "aspect": a}) for ratio in (0.5, 0.9, 0.98, 1.02, 1.1, 1.3) for a in (0.3, 1.0)
    ),
    representative={"ratio": 1.1},
    planted=({}, {"ratio": 1.1}, {"ratio": 1.1, "aspect": 1.0}),
    primary=Primary(
        "outcome error",
        "1",
        "displacement of the block that should stay, in heights; relative errors of the time of the one that "
        "topples and of the acceleration of the one that slides",
        "whether it slides or topples, and how fast, at both limits",
        lambda dt: [{}, {"ratio": 1.1}, {"ratio": 1.1, "aspect": 1.0}],
        error,
        "the whole scene: the block stays",
    ),
    smooth=("passing_time", "acceleration"),
    words=WORDS | {"moved": "moves by {value} where it should stay", "turned": "turns: its corners move by {value}"},
)
