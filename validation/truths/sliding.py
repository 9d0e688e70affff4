"""Boxes that slide on a level face until friction stops them.

       +---+  v
       |   | -->            stops after d = v^2/(2 mu g), t = v/(mu g),
    ==================      straight on, without turning or hopping
       |<------ d ------>|

The box is the last body of its scene; the scene has the parameters v [m/s], mu, g [m/s^2] and, in space, heading
[degrees].
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from adapters.scene import Body, Scene
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import Check, Measured, Params, Track
from validation.scenes.parts import along, at, block, heading

#: Time of the run after the stop, as a share of the time to stop.
AFTERMATH = 0.5


def stop(params: Params) -> float:
    """Time to stop [s]."""
    return params["v"] / (params["mu"] * params["g"])


def way(params: Params) -> float:
    """Distance to stop [m]."""
    return params["v"] ** 2 / (2.0 * params["mu"] * params["g"])


def lasts(params: Params) -> float:
    """Duration of the scene [s]."""
    return (1.0 + AFTERMATH) * stop(params)


def launched(dimension: int, params: Params, width: float, height: float, x: float = 0.0) -> Body:
    """The box, of ``width`` and ``height`` [m], on the level 0 at ``x`` [m], moving with v along the heading."""
    angle = math.radians(params.get("heading", 0.0))
    level = (params["v"],) if dimension == 2 else (params["v"] * math.cos(angle), params["v"] * math.sin(angle))
    box = block("box", dimension, params["mass"], width, height)
    return at(box, dimension, along(dimension, x, 0.5 * height), (*level, 0.0))


def exact(scene: Scene) -> dict[str, float]:
    """Constant braking by mu g, against the motion."""
    p = scene.params
    truth = {"stopping_distance": way(p), "braking": p["mu"] * p["g"], "end_speed": 0.0, "hop": 0.0, "turned": 0.0}
    return truth | ({} if scene.dimension == 2 else {"astray": 0.0})


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Distance along and across the heading, range of the lower face's height, rotation since the start."""
    d, line, box = scene.dimension, heading(scene), len(scene.bodies) - 1
    pose = trajectory.pose[:, box]
    moved = pose[-1, : d - 1] - pose[0, : d - 1]
    ahead = float(moved @ line)
    measured: dict[str, Measured] = {
        "stopping_distance": (ahead, ""),
        "braking": _braking(scene, trajectory),
        "end_speed": (float(np.linalg.norm(trajectory.twist[-1, box, :d])), ""),
        "hop": (metrics.hop(trajectory, box), ""),
        "turned": (metrics.turned(pose) * metrics.reach(scene.bodies[box].shape), ""),
    }
    if d == 3:
        measured["astray"] = (float(np.linalg.norm(moved - ahead * line)), "")
    return measured


def _braking(scene: Scene, trajectory: Trajectory) -> Measured:
    """Mean deceleration along the heading over the middle half of the slide."""
    long = stop(scene.params)
    first, last = np.searchsorted(trajectory.t, (0.25 * long, 0.75 * long))
    if last <= first:
        return None, "the slide lasts less than two steps"
    speed = trajectory.twist[:, -1, : scene.dimension - 1] @ heading(scene)
    return float((speed[first] - speed[last]) / (trajectory.t[last] - trajectory.t[first])), ""


def checks(scene: Scene, dt: float, truth: Mapping[str, float], place: float = 0.0) -> list[Check]:
    """Braking is constant: the error of the scheme in a parabola, v dt/2, and the step in which it stops.

    A semi-implicit step moves by the new velocity, so the distance is v dt/2 too short, or too long with position
    first. In the step that stops the box friction needs less than its limit; another mu g dt^2. A start that touches
    exactly may find its contact one step late: the box does not brake in that step, v dt, and sinks by g dt^2.

    ``place`` [m] is the largest coordinate, whose round-off limits positions; at least the distance.
    """
    p = scene.params
    g, v, mu = p["g"], p["v"], p["mu"]
    place = max(place, truth["stopping_distance"])
    distance = bounds.Bound(
        1.5 * v * dt + (1.0 + mu) * g * dt * dt + bounds.ROUND_OFF * place,
        "velocity and position half a step apart give v dt/2, a contact found one step late v dt without friction; "
        "and g dt^2",
    )
    stopped = bounds.Bound(bounds.STILL * g * dt, "a speed below v1/100 = g dt/100 counts as rest")
    # The window is the middle half of the slide, to a step: g dt/100 of speed within it.
    brakes = bounds.driven(g, dt, max(0.5 * stop(p) - dt, dt))
    level = bounds.found_late(g, dt, place)
    turn = bounds.Bound(level.value, "a corner whose contact is found one step late sinks by g dt^2")
    source = "Coulomb's law, kinetic: friction mu N against the motion, whatever the heading"
    found = [
        distance.check("stopping_distance", "m", truth["stopping_distance"], source),
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
    p, box, line = scene.params, scene.bodies[-1], heading(scene)
    start, end = box.pose[: scene.dimension], stop(p)

    def position(t: float) -> tuple[float, ...]:
        t = min(t, end)
        moved = (p["v"] * t - 0.5 * p["mu"] * p["g"] * t * t) * line
        return (*(float(x) for x in start[:-1] + moved), start[-1])

    return Track(box.name, position)


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Distance of the place where it stops from the exact one, over the distance."""
    truth = way(scene.params)
    value, reason = found["stopping_distance"]
    if value is None:
        return None, reason
    astray = found.get("astray", (0.0, ""))[0] or 0.0
    return math.hypot(value - truth, astray) / truth, ""


#: Meaning of the metrics, in words.
WORDS = {
    "stopping_distance": "stops after {value}",
    "braking": "is braked by {value}",
    "end_speed": "still moves with {value} when it should have stopped",
    "turned": "turns: its corners move by {value}",
}
