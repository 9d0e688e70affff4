"""A ball strikes a free bar beside its centre of mass.

             o  m
             | v                 1/k = 1/m + 1/M + d^2/I
        +----v-----------+       J = (1 + e) k (v - V)
        |      +  M, I   |       bar:  V' = V - J/M,  spin d J/I
        +----------------+       ball: v' = v - J/m   (down is positive)
             |-d-|

The face is smooth, so that nothing acts along it, and the bar may move towards the ball. With d = 0 the law of two
balls is left; far out the bar gives way, as if it were lighter.

A bar that turns with w comes back at the ball: seen along its normal the ball, H above the bar's centre, closes with
H w^2 and is met again after 2 e (v - V)/(H w^2). A scene in which that is within its time has another answer, and is
refused; with e = 0 they do not part at all.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from adapters.scene import Pair, Scene, SceneError
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Track, Variation
from validation.scenes.parts import (
    PHASES,
    along,
    at,
    ball,
    between_impacts,
    block,
    delay,
    mass_of,
    phases,
    states_and_impulses,
)

RADIUS, WIDTH, HEIGHT = 0.25, 2.0, 0.5
#: Runs for this long after the ideal contact [s]: softest engine compared keeps contact for about 0.05 s; the bar must
#: not turn into the ball meanwhile.
AFTERMATH = 0.2


def _moment(params: Params) -> float:
    """Moment of inertia about the axis that the blow turns the bar about [kg m^2]."""
    return params["ratio"] * params["mass"] * (WIDTH**2 + HEIGHT**2) / 12.0


def _met_again(params: Params) -> float:
    """Time after the blow at which the turning bar meets the ball again [s]; infinite if it does not turn.

    Both move freely: along the bar's normal they are ``d sin(w t) + (H + u t) cos(w t)`` apart, with
    ``u + d w = e (v - V)``; this is its root to second order in t.
    """
    p = params
    spin = p["offset"] / _moment(p) * (1.0 + p["e"]) * (p["v"] + p["rise"]) * _reduced(p)
    if spin == 0.0:
        return math.inf
    return 2.0 * p["e"] * (p["v"] + p["rise"]) / ((0.5 * HEIGHT + RADIUS) * spin * spin)


def _reduced(p: Params) -> float:
    """Mass that the blow feels [kg]."""
    return 1.0 / (1.0 / p["mass"] + 1.0 / (p["ratio"] * p["mass"]) + p["offset"] ** 2 / _moment(p))


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the ball reaches the upper face, left of the centre, after ``delay`` seconds.

    Raises
    ------
    SceneError
        If the bar turns back at the ball within the scene's time.
    """
    p = params
    if _met_again(p) < 1.5 * AFTERMATH:  # half as much again for the terms beyond the second order
        again = f"{_met_again(p):.3g} s after the blow"
        raise SceneError(f"off_centre.e: with {p['e']:g} the turning bar meets the ball again {again}")
    bar = at(
        block("bar", dimension, p["ratio"] * p["mass"], WIDTH, HEIGHT),
        dimension,
        along(dimension, 0.0, -0.5 * HEIGHT - p["rise"] * p["delay"]),
        along(dimension, 0.0, p["rise"]),
    )
    striker = at(
        ball("ball", dimension, p["mass"], RADIUS, 0.0),
        dimension,
        along(dimension, -p["offset"], RADIUS + p["v"] * p["delay"]),
        along(dimension, 0.0, -p["v"]),
    )
    pairs = (Pair(restitution=p["e"], friction=0.0),)
    return Scene("off_centre", 1, dimension, (bar, striker), pairs, (0.0,) * dimension, p["delay"] + AFTERMATH, p)


def exact(scene: Scene) -> dict[str, float]:
    """Newton's law at the point that is struck, with the bar's own mass there."""
    p = scene.params
    m, big, moment, d, e = p["mass"], p["ratio"] * p["mass"], _moment(p), p["offset"], p["e"]
    impulse = (1.0 + e) * _reduced(p) * (p["v"] + p["rise"])
    return {
        "ball_speed": impulse / m - p["v"],
        "bar_speed": p["rise"] - impulse / big,
        "spin": impulse * d / moment,
        "impulse": impulse,
        "energy_lost": 1.0 - e * e,
        "momentum_defect": 0.0,
    }


def _energy(params: Params, ball_speed: float, bar_speed: float, spin: float) -> float:
    m, big = params["mass"], params["ratio"] * params["mass"]
    return 0.5 * (m * ball_speed**2 + big * bar_speed**2 + _moment(params) * spin**2)


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Velocities at the end; energy in units of what the closing speed has at the point that is struck."""
    p, d = scene.params, scene.dimension
    bar, striker = (float(v) for v in trajectory.twist[-1, :, d - 1])
    # A blow down on the left turns the bar counter-clockwise: about +z in the plane, about -y in space.
    spin = float(trajectory.twist[-1, 0, 2] if d == 2 else -trajectory.twist[-1, 0, 4])
    impulse = metrics.total_impulse(trajectory, 0, 1)
    change = p["mass"] * (striker + p["v"]) + p["ratio"] * p["mass"] * (bar - p["rise"])
    lost = _energy(p, p["v"], p["rise"], 0.0) - _energy(p, striker, bar, spin)
    sideways = float(np.abs(trajectory.twist[-1, :, : d - 1]).max())
    return {
        "ball_speed": (striker, ""),
        "bar_speed": (bar, ""),
        "spin": (spin, ""),
        "impulse": (None, impulse[1]) if impulse[0] is None else (float(impulse[0][-1]), ""),
        "energy_lost": (lost / _available(p), ""),
        "momentum_defect": (math.hypot(change / (p["mass"] * (p["v"] + p["rise"])), sideways / p["v"]), ""),
    }


def _available(p: Params) -> float:
    """Energy of the closing speed at the point that is struck, k (v - V)^2/2 [J]."""
    return 0.5 * _reduced(p) * (p["v"] + p["rise"]) ** 2


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """The face is level and smooth until the blow: exact at every step, whenever within it the blow is found."""
    p = scene.params
    closing = p["v"] + p["rise"]
    source = "Newton's law of restitution at the point that is struck; conservation of momentum and angular momentum"
    scales = {
        "ball_speed": ("m/s", closing),
        "bar_speed": ("m/s", closing),
        "spin": ("rad/s", closing * max(1.0, p["offset"] * p["mass"] / _moment(p))),
        "impulse": ("N s", p["mass"] * closing),
        # A difference of energies: round-off of all of them, in units of what there is to lose.
        "energy_lost": ("1", _energy(p, p["v"], p["rise"], 0.0) / _available(p)),
    }
    found = bounds.exact_laws(scales, truth, source)
    defect = bounds.bookkeeping().check("momentum_defect", "1", truth["momentum_defect"], "conservation of momentum")
    return [*found, defect]


def track(scene: Scene) -> Track:
    """The ball: straight down, then with what the blow leaves it."""
    p = scene.params
    height = between_impacts(RADIUS + p["v"] * p["delay"], -p["v"], [(p["delay"], exact(scene)["ball_speed"])])
    return Track("ball", lambda t: along(scene.dimension, -p["offset"], height(t)))


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Larger error of the two speeds and of the spin half a bar away, relative to the closing speed."""
    p, truth = scene.params, exact(scene)
    off = []
    for name, arm in (("ball_speed", 1.0), ("bar_speed", 1.0), ("spin", 0.5 * WIDTH)):
        value, reason = found[name]
        if value is None:
            return None, reason
        off.append(arm * abs(value - truth[name]))
    return max(off) / (p["v"] + p["rise"]), ""


SCENE = CanonicalScene(
    name="off_centre",
    version=1,
    title="Ball strikes a free bar beside its centre",
    family="rebound",
    figure=__doc__ or "",
    law="J = (1 + e) (v - V)/(1/m + 1/M + d^2/I),  spin' = d J/I",
    dimensions=(2, 3),
    parameters=(
        Parameter("offset", 0.6, "m", "distance of the blow from the centre of mass, at most 0.7 m", 0.0, 0.7),
        Parameter("ratio", 2.0, "1", "mass of the bar over that of the ball", 1e-3, 1e6),
        Parameter("e", 0.8, "1", "coefficient of restitution of the pair", 0.0, 1.0),
        Parameter("v", 3.0, "m/s", "of the ball, downwards", 0.0, 1e2, positive=True),
        Parameter("rise", 1.0, "m/s", "of the bar, upwards: both move", 0.0, 1e2),
        delay(),
        mass_of("the ball", 0.5),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states_and_impulses,
    track=track,
    quick=(Variation({}), Variation({"offset": 0.3, "e": 1.0})),
    full=tuple(
        Variation({"offset": d, "e": e, "ratio": r})
        for d in (0.0, 0.3, 0.6)
        for e in (0.5, 0.8, 1.0)
        for r in (0.5, 2.0, 100.0)
    ),
    planted=({},),
    primary=Primary(
        "velocity error",
        "1",
        f"largest error of the ball's, the bar's and its end's speed over the closing speed, {PHASES} contact times",
        "a blow beside the centre tests what a central one cannot: the mass that a turning body has where it is struck",
        phases,
        error,
        "the whole scene: approach, blow, departure",
    ),
    words={
        "ball_speed": "sends the ball off with {value}",
        "bar_speed": "leaves the bar with {value}",
        "spin": "turns the bar with {value}",
        "energy_lost": "takes {value} of the energy that the blow has",
    },
)
