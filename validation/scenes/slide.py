"""A box slides over a level floor until friction has stopped it.

       +---+  v
       |   | -->            stops after d = v^2/(2 mu g), t = v/(mu g),
    ==================      straight on, without turning or hopping
       |<------ d ------>|

In space it may head in any direction against the box's edges, which Coulomb's law does not know of: a cone that is a
pyramid brakes less along its diagonals or turns the path.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from adapters.scene import Pair, Scene
from adapters.trajectory import Trajectory
from reference_solver.certification.geometry import rotation
from validation import bounds, metrics
from validation.canonical import GRAVITY, CanonicalScene, Check, Measured, Parameter, Params, Primary, Track, Variation
from validation.scenes.parts import at, block, floor, heading, states, upward

HEIGHT = 0.5
#: Runs on for this long after it should have stopped, as a share of the time to stop.
AFTERMATH = 0.5


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the box rests on the floor and moves."""
    p, angle = params, math.radians(params["heading"])
    level = (p["v"],) if dimension == 2 else (p["v"] * math.cos(angle), p["v"] * math.sin(angle))
    box = at(
        block("box", dimension, p["mass"], p["aspect"] * HEIGHT, HEIGHT),
        dimension,
        upward(dimension, 0.5 * HEIGHT),
        (*level, 0.0),
    )
    pairs = (Pair(restitution=0.0, friction=p["mu"]),)
    duration = (1.0 + AFTERMATH) * _stop(p)
    return Scene("slide", 1, dimension, (floor(dimension), box), pairs, upward(dimension, -p["g"]), duration, p)


def exact(scene: Scene) -> dict[str, float]:
    """Constant braking by mu g, against the motion."""
    p = scene.params
    way = p["v"] ** 2 / (2.0 * p["mu"] * p["g"])
    truth = {"stopping_distance": way, "braking": p["mu"] * p["g"], "end_speed": 0.0, "hop": 0.0, "turned": 0.0}
    return truth | ({} if scene.dimension == 2 else {"astray": 0.0})


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Way along and across the heading, deepest and highest place of the lower face, turn against the start."""
    d, line = scene.dimension, heading(scene)
    pose = trajectory.pose[:, 1]
    way = pose[-1, : d - 1] - pose[0, : d - 1]
    along = float(way @ line)
    measured: dict[str, Measured] = {
        "stopping_distance": (along, ""),
        "braking": _braking(scene, trajectory),
        "end_speed": (float(np.linalg.norm(trajectory.twist[-1, 1, :d])), ""),
        "hop": (metrics.hop(trajectory), ""),
        "turned": (_turned(pose) * metrics.reach(scene.bodies[1].shape), ""),
    }
    if d == 3:
        measured["astray"] = (float(np.linalg.norm(way - along * line)), "")
    return measured


def _stop(params: Params) -> float:
    """Time to stop [s]."""
    return params["v"] / (params["mu"] * params["g"])


def _braking(scene: Scene, trajectory: Trajectory) -> Measured:
    """Mean deceleration along the heading over the middle half of the slide."""
    stop = _stop(scene.params)
    first, last = np.searchsorted(trajectory.t, (0.25 * stop, 0.75 * stop))
    if last <= first:
        return None, "the slide lasts less than two steps"
    speed = trajectory.twist[:, 1, : scene.dimension - 1] @ heading(scene)
    return float((speed[first] - speed[last]) / (trajectory.t[last] - trajectory.t[first])), ""


def _turned(pose: np.ndarray) -> float:
    """Largest angle against the start [rad]."""
    if pose.shape[1] == 3:
        return float(np.abs(pose[:, 2] - pose[0, 2]).max())
    turns = rotation(pose)
    off = np.linalg.norm(turns - turns[0], axis=(1, 2))  # Frobenius: 2 sqrt(2) |sin(angle/2)|
    return float(2.0 * np.arcsin(np.clip(off / (2.0 * math.sqrt(2.0)), 0.0, 1.0)).max())


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """Braking is constant: what a step order shows of a parabola, v dt/2, and the step within which it stops.

    A semi-implicit step moves by the new velocity, so that the way is short of v dt/2, or long by it, position first.
    In the step that stops the box friction needs less than its limit; another mu g dt^2. A start that touches exactly
    may find its contact one step late: the box does not brake in that step, v dt, and sinks by g dt^2.
    """
    p = scene.params
    g, v, mu = p["g"], p["v"], p["mu"]
    place = truth["stopping_distance"]
    way = bounds.Bound(
        1.5 * v * dt + (1.0 + mu) * g * dt * dt + bounds.ROUND_OFF * place,
        "a step order shows v dt/2 of a parabola, a contact found one step late is v dt without brakes; and g dt^2",
    )
    stopped = bounds.Bound(bounds.STILL * g * dt, "slower than v1/100 = g dt/100 does not move")
    # The window is the middle half of the slide, to a step: g dt/100 of speed within it.
    brakes = bounds.driven(g, dt, max(0.5 * _stop(p) - dt, dt))
    level = bounds.found_late(g, dt, place)
    turn = bounds.Bound(level.value, "a corner whose contact is found one step late sinks by g dt^2")
    source = "Coulomb's law, kinetic: friction mu N against the motion, whatever the heading"
    found = [
        way.check("stopping_distance", "m", truth["stopping_distance"], source),
        brakes.check("braking", "m/s^2", truth["braking"], source),
        stopped.check("end_speed", "m/s", truth["end_speed"], source),
        level.check("hop", "m", truth["hop"], source),
        turn.check("turned", "m", truth["turned"], source),
    ]
    if "astray" in truth:
        found.append(bounds.straight(g, dt, place).check("astray", "m", truth["astray"], source))
    return found


def track(scene: Scene) -> Track:
    """The exact parabola, until it stops."""
    p, start, line = scene.params, scene.bodies[1].pose[: scene.dimension], heading(scene)
    stop = _stop(p)

    def position(t: float) -> tuple[float, ...]:
        t = min(t, stop)
        way = (p["v"] * t - 0.5 * p["mu"] * p["g"] * t * t) * line
        return (*(float(x) for x in start[:-1] + way), start[-1])

    return Track("box", position)


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Distance of the place where it stops from where it should, over the way."""
    truth = exact(scene)["stopping_distance"]
    value, reason = found["stopping_distance"]
    if value is None:
        return None, reason
    astray = found.get("astray", (0.0, ""))[0] or 0.0
    return math.hypot(value - truth, astray) / truth, ""


SCENE = CanonicalScene(
    name="slide",
    version=1,
    title="Box that slides to a stop, in any heading",
    family="friction",
    figure=__doc__ or "",
    law="d = v^2/(2 mu g), straight on; friction does not know the heading",
    dimensions=(2, 3),
    parameters=(
        Parameter("v", 3.0, "m/s", "speed at the start", 0.0, 1e2, positive=True),
        Parameter("mu", 0.4, "1", "friction; below aspect, so that the box does not tip", 0.0, 1.0, positive=True),
        Parameter("heading", 0.0, "degrees", "of the slide against the box's edges; spatial only", 0.0, 90.0),
        Parameter("aspect", 1.5, "1", "width over height of the box", 1.1, 20.0),
        Parameter("g", GRAVITY, "m/s^2", "gravity", 0.0, 1e3, positive=True),
        Parameter("mass", 1.0, "kg", "of the box", 0.0, 1e6, positive=True),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    track=track,
    quick=(Variation({}), Variation({"heading": 22.5}, dimensions=(3,)), Variation({"heading": 45.0}, dimensions=(3,))),
    full=(
        *(Variation({"mu": mu, "aspect": a}) for mu in (0.1, 0.4, 0.8) for a in (1.5, 4.0)),
        *(Variation({"heading": h}, dimensions=(3,)) for h in (15.0, 22.5, 30.0, 45.0, 90.0)),
    ),
    planted=({},),
    primary=Primary(
        "stopping error",
        "way",
        "distance of the place where it stops from where it should, over the way that it slides",
        "one number for too far, too short and astray",
        lambda dt: [{}],
        error,
        "the sliding box",
        0.1,
        0.25,
    ),
    smooth=("stopping_distance",),
    words={
        "stopping_distance": "stops after {value}",
        "braking": "is braked by {value}",
        "end_speed": "still moves with {value} when it should have stopped",
        "hop": "leaves the floor, up or down, by {value}",
        "turned": "turns: its corners move by {value}",
        "astray": "strays sideways by {value}",
    },
)
