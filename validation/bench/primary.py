"""The one declared error of each scene, and the state in which that scene is timed.

A work-precision plot shows one number per run of an engine, so it is declared here once, before anything is
measured, with the reason. It is a supremum over variations that an engine cannot choose: the phase of an impact
within a step, the side of a threshold.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from adapters.scene import Scene, SceneError
from validation.canonical import Measured
from validation.plan import HEIGHTS
from validation.posed import resolve
from validation.scenes.stack import SIDE
from validation.tolerances import APEXES, RESOLVED

Metrics = Mapping[str, Measured]
#: Phases of an impact within a step; the error is the supremum over them.
PHASES = 16


@dataclass(frozen=True)
class Primary:
    """The declared error of a scene.

    Parameters
    ----------
    scene
        Name in the catalogue.
    name, unit
        For axes.
    law
        What exactly is measured, in one line.
    because
        Why this and nothing else.
    variations
        ``variations(dt)``: parameters of the cells whose worst error counts; the first one is timed.
    error
        ``error(scene, dt, metrics)`` of one cell, or None and why.
    state
        The state that is timed, in words.
    warm_up, window
        Simulated seconds before the timed call and within it; a window of None is the whole scene.
    """

    scene: str
    name: str
    unit: str
    law: str
    because: str
    variations: Callable[[float], list[dict[str, float]]]
    error: Callable[[Scene, float, Metrics], Measured]
    state: str
    warm_up: float = 0.0
    window: float | None = None


def _impact_phases(dt: float) -> list[dict[str, float]]:
    """Contact times spread evenly over one step, in the middle of each sixteenth."""
    first = resolve("impact").complete({})["delay"]
    return [{"delay": first + (k + 0.5) / PHASES * dt} for k in range(PHASES)]


def _impact_error(scene: Scene, dt: float, metrics: Metrics) -> Measured:
    value, reason = metrics["rebound_ratio"]
    return (None, reason) if value is None else (abs(value - scene.params["e"]), "")


def _bounce_error(scene: Scene, dt: float, metrics: Metrics) -> Measured:
    e, height, g = scene.params["e"], scene.params["height"], scene.params["g"]
    speed, errors = math.sqrt(2.0 * g * height), []
    for n in range(1, APEXES + 1):
        value = metrics[f"apex[{n}]"][0]
        if e**n * speed <= RESOLVED * g * dt or value is None:
            break
        errors.append(abs(value - e ** (2 * n) * height) / height)
    return (max(errors), "") if errors else (None, "no apex is resolved at this step")


def _stack_error(scene: Scene, dt: float, metrics: Metrics) -> Measured:
    drift, penetration = metrics["drift"], metrics["penetration"]
    if drift[0] is None or penetration[0] is None:
        return None, drift[1] or penetration[1]
    return max(drift[0], penetration[0]) / SIDE, ""


def _incline_error(scene: Scene, dt: float, metrics: Metrics) -> Measured:
    g, duration = scene.params["g"], scene.duration
    truth = resolve("incline").exact(scene)
    metric = next(iter(truth))
    value, reason = metrics[metric]
    if value is None:
        return None, reason
    error = abs(value - truth[metric])
    return (2.0 * error / (g * duration) if metric == "creep" else error / g), ""


PRIMARY: dict[str, Primary] = {
    primary.scene: primary
    for primary in (
        Primary(
            "impact",
            "rebound error",
            "1",
            f"largest |v+/v- - e| over {PHASES} contact times within a step",
            "the impact law itself: no gravity, no apex, nothing else enters; an engine that acts before or after "
            "the contact may depend on the phase, so the worst phase counts",
            _impact_phases,
            _impact_error,
            "the whole scene: approach, contact, departure",
        ),
        Primary(
            "bounce",
            "apex error",
            "h0",
            f"largest |h_n - e^2n h0| / h0 over {len(HEIGHTS)} drop heights and all resolved apexes "
            f"(e^n v0 > {RESOLVED:g} g dt, n <= {APEXES})",
            "heights are what one sees of a bounce, and the phase of the first impact decides them: a single "
            "height may be right by luck at any step",
            lambda dt: [{"height": height} for height in HEIGHTS],
            _bounce_error,
            "the whole scene: fall, bounces, rest",
        ),
        Primary(
            "stack",
            "displacement",
            "side",
            "larger of the sideways drift and the deepest overlap within 5 s, per side of a box, n = 10",
            "nothing may move, so whatever did is error, sideways or into the neighbour; loads are left out because "
            "any column at rest carries its weight on average",
            lambda dt: [{"n": 10.0}],
            _stack_error,
            "the standing column, half a second after the start",
            0.5,
            0.25,
        ),
        Primary(
            "incline",
            "acceleration error",
            "g",
            "largest of |a - a_exact| / g where it slides and 2 creep / (g T) where it sticks, "
            "tan(theta)/mu = 1.1, 0.9, 0.5, 2",
            "creep v over the run T leads as far astray as the acceleration 2 v / T: one unit for both sides of the "
            "threshold, so that neither hides the other",
            lambda dt: [{"ratio": ratio} for ratio in (1.1, 0.9, 0.5, 2.0)],
            _incline_error,
            "the sliding box, half a second after the start",
            0.5,
            0.25,
        ),
    )
}


def primary_of(scene: str) -> Primary:
    """Return the declared error of a scene.

    Raises
    ------
    SceneError
        If none is declared: a bench needs one number, and a scene from a file has no truth to take it from.
    """
    if scene not in PRIMARY:
        raise SceneError(f"scene: no primary error is declared for {scene!r}, only for {', '.join(PRIMARY)}")
    return PRIMARY[scene]
