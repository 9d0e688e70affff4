"""A ball strikes a free bar beside its centre of mass.

             o  m
             | v                 1/k = 1/m + 1/M + d^2/I
        +----v-----------+       J = (1 + e) k (v - V)
        |      +  M, I   |       bar:  V' = V - J/M,  spin d J/I
        +----------------+       ball: v' = v - J/m   (down is positive)
             |-d-|

The face is smooth, so no force acts along it, and the bar may move towards the ball. With d = 0 it is the law of two
balls; far out the bar yields as if it were lighter.

A bar with an initial spin w recedes or approaches at d: the closing speed is u = v - V - d w instead of v - V, and the
spin is w + d J/I. The bar is level when it is struck.

A bar that turns with w hits the ball again: along its normal the ball, H above the bar's centre, accelerates towards it
with H w^2 and is hit again after some 2 e u/(H w^2). A scene with a second blow within its time has another solution,
and is refused, as is one in which a spinning bar would have hit the ball before; with e = 0 they do not separate.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from adapters.engine import Array
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
    tilted,
)

RADIUS, WIDTH, HEIGHT = 0.25, 2.0, 0.5
#: Runs for this long after the ideal contact [s]: softest engine compared keeps contact for about 0.05 s; the bar must
#: not turn into the ball meanwhile.
AFTERMATH = 0.2


def _moment(params: Params) -> float:
    """Moment of inertia about the axis that the blow turns the bar about [kg m^2]."""
    return params["ratio"] * params["mass"] * (WIDTH**2 + HEIGHT**2) / 12.0


@dataclass(frozen=True)
class Blow:
    """Result of a blow: velocities up and sideways [m/s], spin of the bar [rad/s], impulse [N s]."""

    ball_speed: float
    bar_speed: float
    spin: float
    impulse: float
    sideways: float
    #: Energy of the closing speed at the struck point, k u^2/2 [J].
    available: float


def _blow(p: Params, late: float = 0.0) -> Blow:
    """The blow ``late`` seconds after the bar is level and the two touch: bar turned by w t, ball gone on by (v - V) t.

    Relative to the bar's centre the ball is at (-d, H - (v - V) t), the bar's normal is (-sin(w t), cos(w t)).
    """
    m, big, moment, closing = p["mass"], p["ratio"] * p["mass"], _moment(p), p["v"] + p["rise"]
    c, s = math.cos(p["whirl"] * late), math.sin(p["whirl"] * late)
    lever = -p["offset"] * c + (0.5 * HEIGHT + RADIUS - closing * late) * s
    reduced = 1.0 / (1.0 / m + 1.0 / big + lever**2 / moment)
    struck = closing * c + p["whirl"] * lever
    impulse = (1.0 + p["e"]) * reduced * struck
    return Blow(
        impulse * c / m - p["v"],
        p["rise"] - impulse * c / big,
        p["whirl"] - lever * impulse / moment,
        impulse,
        abs(s) * impulse / min(m, big),
        0.5 * reduced * struck**2,
    )


def _struck(p: Params) -> float:
    """Closing speed [m/s] at the struck point."""
    return p["v"] + p["rise"] - p["whirl"] * p["offset"]


def _meets(p: Params, until: float, closing: float, spin: float) -> float | None:
    """First of 256 times up to ``until`` [s] at which ball and bar overlap again; None if they do not.

    Both move freely from there: along the bar's normal they are ``d sin(w t) + (H - c t) cos(w t) - H`` apart, where c
    is the speed with which their centres close in.
    """
    height = 0.5 * HEIGHT + RADIUS
    t = until * np.arange(1, 257) / 256.0
    gap = p["offset"] * np.sin(spin * t) + (height - closing * t) * np.cos(spin * t) - height
    inside = t[gap < -bounds.ROUND_OFF]
    return float(inside[0]) if inside.size else None


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the ball reaches the upper face, left of the centre, after ``delay`` seconds.

    Raises
    ------
    SceneError
        If the bar hits the ball again within the scene's time, or before.
    """
    p, struck = params, _struck(params)
    if struck <= 0.0:
        raise SceneError(f"off_centre.whirl: with {p['whirl']:g} rad/s the bar recedes faster than the ball approaches")
    before = _meets(p, -p["delay"], p["v"] + p["rise"], p["whirl"])
    if before is not None:
        raise SceneError(
            f"off_centre.whirl: with {p['whirl']:g} rad/s the bar meets the ball {-before:.3g} s too early"
        )
    blow = _blow(p)
    again = _meets(p, AFTERMATH, blow.bar_speed - blow.ball_speed, blow.spin)
    if again is not None:
        late = f"{again:.3g} s after the blow"
        raise SceneError(f"off_centre.e: with {p['e']:g} the turning bar meets the ball again {late}")
    bar = tilted(
        block("bar", dimension, p["ratio"] * p["mass"], WIDTH, HEIGHT),
        dimension,
        (0.0, -0.5 * HEIGHT - p["rise"] * p["delay"]),
        -p["whirl"] * p["delay"],
    )
    # Counter-clockwise is about +z in the plane, about -y in space.
    spin = (p["whirl"],) if dimension == 2 else (0.0, -p["whirl"], 0.0)
    bar = replace(bar, twist=(*along(dimension, 0.0, p["rise"]), *spin))
    striker = at(
        ball("ball", dimension, p["mass"], RADIUS, 0.0),
        dimension,
        along(dimension, -p["offset"], RADIUS + p["v"] * p["delay"]),
        along(dimension, 0.0, -p["v"]),
    )
    pairs = (Pair(restitution=p["e"], friction=0.0),)
    return Scene("off_centre", 1, dimension, (bar, striker), pairs, (0.0,) * dimension, p["delay"] + AFTERMATH, p)


def exact(scene: Scene) -> dict[str, float]:
    """Newton's law at the struck point, with the bar's effective mass there."""
    p = scene.params
    blow = _blow(p)
    truth = {
        "ball_speed": blow.ball_speed,
        "bar_speed": blow.bar_speed,
        "spin": blow.spin,
        "impulse": blow.impulse,
        "energy_lost": 1.0 - p["e"] ** 2,
        "momentum_defect": 0.0,
    }
    return truth | {"angular_defect": 0.0, "sideways": 0.0} if p["whirl"] else truth


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Velocities at the end; energy over that of the closing speed at the struck point.

    Without initial spin the bar is level at the blow, and nothing may move sideways; with spin only the common centre
    may not, and angular momentum shows whether both were pushed at the same place.
    """
    p, d = scene.params, scene.dimension
    m, big = p["mass"], p["ratio"] * p["mass"]
    bar, striker = (float(v) for v in trajectory.twist[-1, :, d - 1])
    spin = _turning(trajectory.twist[-1, 0], d)
    impulse = metrics.total_impulse(trajectory, 0, 1)
    change = m * (striker + p["v"]) + big * (bar - p["rise"])
    start = np.array([body.twist for body in scene.bodies])
    lost = _energy(scene, start) - _energy(scene, trajectory.twist[-1])
    aside = trajectory.twist[-1, :, : d - 1]
    sideways = float(np.abs(aside).max())
    pushed = float(np.abs(big * aside[0] + m * aside[1]).max()) / m if p["whirl"] else sideways
    measured: dict[str, Measured] = {
        "ball_speed": (striker, ""),
        "bar_speed": (bar, ""),
        "spin": (spin, ""),
        "impulse": (None, impulse[1]) if impulse[0] is None else (float(impulse[0][-1]), ""),
        "energy_lost": (lost / _blow(p).available, ""),
        "momentum_defect": (math.hypot(change / (m * (p["v"] + p["rise"])), pushed / p["v"]), ""),
    }
    if not p["whirl"]:
        return measured
    place = np.array([body.pose for body in scene.bodies])
    gained = _angular(scene, trajectory.pose[-1], trajectory.twist[-1]) - _angular(scene, place, start)
    return measured | {"angular_defect": (abs(gained) / _swing(p), ""), "sideways": (sideways, "")}


def _turning(twist: Array, dimension: int) -> float:
    """Spin of one body counter-clockwise [rad/s]: about +z in the plane, about -y in space."""
    return float(twist[2] if dimension == 2 else -twist[4])


def _energy(scene: Scene, twist: Array) -> float:
    """Kinetic energy [J] of both, ``twist`` of (2, 3) or (2, 6), without the ball's spin."""
    p, d = scene.params, scene.dimension
    moving = float(p["ratio"] * p["mass"] * (twist[0, :d] ** 2).sum() + p["mass"] * (twist[1, :d] ** 2).sum())
    return 0.5 * (moving + _moment(p) * _turning(twist[0], d) ** 2)


def _angular(scene: Scene, pose: Array, twist: Array) -> float:
    """Angular momentum of both in the plane of motion [kg m^2/s], counter-clockwise about the foot of the ball's path.

    ``pose`` and ``twist`` are those of bar and ball, rows of a record.
    """
    p, d = scene.params, scene.dimension
    x, v = pose[:, [0, d - 1]], twist[:, [0, d - 1]]
    x = x + np.array([p["offset"], 0.0])
    orbit = np.array([p["ratio"] * p["mass"], p["mass"]]) @ (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0])
    return float(orbit) + _moment(p) * _turning(twist[0], d)


def _swing(p: Params) -> float:
    """Total angular momentum [kg m^2/s]: of the bar, and of the ball at its distance."""
    return _moment(p) * abs(p["whirl"]) + p["mass"] * (p["v"] + p["rise"]) * p["offset"]


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """The face is smooth, and level until the blow unless the bar spins: exact at every phase of the step."""
    p, blow = scene.params, _blow(scene.params)
    closing = p["v"] + p["rise"] + abs(p["whirl"]) * p["offset"]
    source = "Newton's law of restitution at the point that is struck; conservation of momentum and angular momentum"
    # A difference of energies: round-off of all of them, over the energy of the blow.
    there = 0.5 * p["mass"] * (p["v"] ** 2 + p["ratio"] * p["rise"] ** 2) + 0.5 * _moment(p) * p["whirl"] ** 2
    scales = {
        "ball_speed": ("m/s", closing),
        "bar_speed": ("m/s", closing),
        "spin": ("rad/s", closing * max(1.0 / WIDTH, p["offset"] * p["mass"] / _moment(p))),
        "impulse": ("N s", p["mass"] * closing),
        "energy_lost": ("1", there / blow.available),
    }
    defect = bounds.bookkeeping().check("momentum_defect", "1", truth["momentum_defect"], "conservation of momentum")
    if not p["whirl"]:
        return [*bounds.exact_laws(scales, truth, source), defect]
    because = "the blow is found up to a step late or early, when the bar has turned by w dt: the law there"
    off = dict.fromkeys((*scales, "sideways"), 0.0)
    for turned in (_blow(p, -dt), _blow(p, dt)):
        taken = (1.0 - p["e"] ** 2) * turned.available / blow.available
        told = {name: getattr(turned, name) for name in off if name != "energy_lost"} | {"energy_lost": taken}
        off = {name: max(off[name], abs(told[name] - truth[name])) for name in off}
    scales["sideways"] = ("m/s", closing)
    found = [
        bounds.Bound(off[name] + bounds.ROUND_OFF * scale, because).check(name, unit, truth[name], source)
        for name, (unit, scale) in scales.items()
    ]
    # Two lever arms a step's motion apart across the normal; the terms are momenta times positions.
    apart = blow.impulse * closing * dt * abs(math.sin(p["whirl"] * dt))
    sizes = p["mass"] * closing * (WIDTH + closing * scene.duration)
    swung = bounds.Bound(
        (apart + bounds.ROUND_OFF * sizes) / _swing(p),
        "the blow acts somewhere within their motion of a step, across a normal that turns by w dt",
    )
    turning = swung.check("angular_defect", "1", truth["angular_defect"], "conservation of angular momentum")
    return [*found, defect, turning]


def track(scene: Scene) -> Track:
    """The ball: straight down, then with its speed after the blow."""
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
    return metrics.largest(off) / (p["v"] + p["rise"]), ""


SCENE = CanonicalScene(
    name="off_centre",
    version=1,
    title="Ball strikes a free bar beside its centre",
    symptoms=(
        "a hit beside the centre gives the wrong spin",
        "an off-centre collision gives too little rotation",
        "a ball that strikes the end of a rod does not turn it enough",
        "angular momentum is not conserved when a body is hit eccentrically",
        "a bat that is hit off its centre of mass spins wrongly",
        "an impact at the tip of a stick: wrong angular velocity",
        "the centre of percussion is in the wrong place",
        "a bar struck at one side moves but does not rotate",
        "a glancing blow on a free beam loses energy",
    ),
    family="rebound",
    figure=__doc__ or "",
    law="J = (1 + e) (v - V - d w)/(1/m + 1/M + d^2/I),  spin' = w + d J/I",
    dimensions=(2, 3),
    parameters=(
        Parameter("offset", 0.6, "m", "distance of the blow from the centre of mass, at most 0.7 m", 0.0, 0.7),
        Parameter("ratio", 2.0, "1", "mass of the bar over that of the ball", 1e-3, 1e6),
        Parameter("e", 0.8, "1", "coefficient of restitution of the pair", 0.0, 1.0),
        Parameter("v", 3.0, "m/s", "of the ball, downwards", 0.0, 1e2, positive=True),
        Parameter("rise", 1.0, "m/s", "of the bar, upwards: both move", 0.0, 1e2),
        Parameter("whirl", 0.0, "rad/s", "spin of the bar before; above 0 the struck point recedes", -10.0, 10.0),
        delay(),
        mass_of("the ball", 0.5),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states_and_impulses,
    track=track,
    quick=(Variation({}), Variation({"whirl": -2.0})),
    standard=(Variation({}), Variation({"offset": 0.3, "e": 1.0}), Variation({"whirl": -2.0})),
    full=(
        *(
            Variation({"offset": d, "e": e, "ratio": r})
            for d in (0.0, 0.3, 0.6)
            for e in (0.5, 0.8, 1.0)
            for r in (0.5, 2.0, 100.0)
        ),
        Variation({"whirl": -2.0}),
    ),
    planted=({}, {"whirl": -2.0}),
    primary=Primary(
        "velocity error",
        "1",
        f"largest error of the ball's, the bar's and its end's speed over the closing speed, {PHASES} contact times",
        "a blow beside the centre tests the effective mass of a turning body at the struck point",
        phases,
        error,
        "the whole scene: approach, blow, departure",
        order=0,
    ),
    words={
        "ball_speed": "sends the ball off with {value}",
        "bar_speed": "leaves the bar with {value}",
        "spin": "turns the bar with {value}",
        "energy_lost": "loses {value} of the energy of the blow",
        "energy_lost<0": "gains {value} of the energy of the blow",
        "angular_defect": "changes the angular momentum by {value} (relative)",
        "sideways": "moves ball or bar sideways with {value}",
    },
)
