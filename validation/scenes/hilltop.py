"""A disc slides or rolls off the top of another and leaves it.

           ( )  -->  v       smooth:  cos(phi) = 2/3 + v^2/(3 g (R + r)) where it leaves
         _.---._             rough:   rolls while mu N holds it, slips, then leaves: integrated,
       .'   R   '.                    v' = g sin(phi) - f,  (k r) w' = f,  N = g cos(phi) - v^2/(R + r)
      |     + phi |          no longer touched, it flies: its speed along is that of leaving

The normal force falls to zero: with sticking, pulling or early separation the disc leaves at another angle and speed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache

import numpy as np

from adapters.scene import Body, Disc, Pair, Scene, SceneError
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import GRAVITY, CanonicalScene, Check, Measured, Parameter, Params, Primary, Variation
from validation.scenes.parts import at, ball, pose_at, states, upward
from validation.truths.quadrature import gauss
from validation.truths.rolling import gyration

K = gyration(2)
#: Time after leaving, as a share of the time before.
AFTERMATH = 0.25
#: Steps of the integration: eight times as many change an angle by 1e-10.
STEPS = 4000


@lru_cache(maxsize=256)
def _leaving(v: float, mu: float, g: float, radius: float, hill: float) -> tuple[float, float, float]:
    """Time [s], angle [rad] and speed [m/s] at which the disc leaves.

    Rolling needs f = g sin(phi) k/(1 + k); where that exceeds mu N the disc slips and f = mu N. Integrated by a
    fourth-order Runge-Kutta method in the angle, up to N = 0.
    """
    reach = radius + hill
    lowest = math.acos(min(1.0, 2.0 / 3.0 + v * v / (3.0 * g * reach)))  # where it leaves without friction
    if mu == 0.0:
        return _time(v, g, reach, lowest), lowest, math.sqrt(g * reach * math.cos(lowest))
    h, t, phi, square = 0.5 * math.pi / STEPS, 0.0, 0.0, v * v

    def slope(phi: float, square: float) -> float:
        """d(v^2)/d phi, with the friction of rolling, at most mu N."""
        normal = max(0.0, g * math.cos(phi) - square / reach)
        friction = min(g * math.sin(phi) * K / (1.0 + K), mu * normal)
        return 2.0 * reach * (g * math.sin(phi) - friction)

    while True:
        one = slope(phi, square)
        two = slope(phi + 0.5 * h, square + 0.5 * h * one)
        three = slope(phi + 0.5 * h, square + 0.5 * h * two)
        after = square + h / 6.0 * (one + 2.0 * two + 2.0 * three + slope(phi + h, square + h * three))
        left = after / reach - g * math.cos(phi + h)
        share = 1.0
        if left >= 0.0:
            held = square / reach - g * math.cos(phi)
            share = held / (held - left)
        before, square = square, square + share * (after - square)
        t += 2.0 * share * h * reach / (math.sqrt(before) + math.sqrt(square))
        phi += share * h
        if left >= 0.0:
            return t, phi, math.sqrt(square)


def _time(v: float, g: float, reach: float, angle: float) -> float:
    """Time [s] without friction from the top to ``angle``: the integral of reach/speed."""
    x, weight = gauss(96)
    phi = 0.5 * angle * (x + 1.0)
    return float(0.5 * angle * (weight @ (reach / np.sqrt(v * v + 4.0 * g * reach * np.sin(0.5 * phi) ** 2))))


def _of(p: Params) -> tuple[float, float, float]:
    return _leaving(p["v"], p["mu"], p["g"], p["radius"], p["hill"])


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the disc touches the top of the hill and moves, rolling if there is friction.

    Raises
    ------
    SceneError
        If it is fast enough to leave the top at once.
    """
    p = params
    reach = p["radius"] + p["hill"]
    if p["v"] ** 2 >= 0.5 * p["g"] * reach:
        raise SceneError(f"hilltop.v: with {p['v']:g} m/s the disc leaves the top almost at once")
    hill = Body("hill", Disc(p["hill"]), pose=pose_at(dimension, (0.0, 0.0)), motion="fixed")
    disc = at(ball("disc", dimension, p["mass"], p["radius"], 0.0), dimension, (0.0, reach), (p["v"], 0.0))
    if p["mu"] > 0.0:
        disc = replace(disc, twist=(p["v"], 0.0, -p["v"] / p["radius"]))
    pairs = (Pair(restitution=0.0, friction=p["mu"]),)
    duration = (1.0 + AFTERMATH) * _of(p)[0]
    return Scene("hilltop", 1, dimension, (hill, disc), pairs, upward(dimension, -p["g"]), duration, p)


def exact(scene: Scene) -> dict[str, float]:
    """The point where the normal force is zero."""
    time, angle, speed = _of(scene.params)
    return {"level_speed": speed * math.cos(angle), "leaving_angle": math.degrees(angle), "leaving_time": time}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """From the flight at the end: it keeps its horizontal speed of leaving, and falls since then.

    Where the normal force vanishes, v^2 = g (R + r) cos(phi): the horizontal speed v cos(phi) gives that angle. The
    place of leaving cannot be read from the path: flight and hill separate by the third power of time.
    """
    p = scene.params
    reach = p["radius"] + p["hill"]
    level, up = (float(v) for v in trajectory.twist[-1, 1, :2])
    over = math.hypot(*(float(x) for x in trajectory.pose[-1, 1, :2])) > reach
    cosine = (metrics.largest([0.0, level]) ** 2 / (p["g"] * reach)) ** (1.0 / 3.0)
    if not over or cosine > 1.0:
        why = "it does not leave"
        return {"level_speed": (level, ""), "leaving_angle": (None, why), "leaving_time": (None, why)}
    angle = math.acos(cosine)
    fallen = (-up - math.sqrt(p["g"] * reach * cosine) * math.sin(angle)) / p["g"]
    return {
        "level_speed": (level, ""),
        "leaving_angle": (math.degrees(angle), ""),
        "leaving_time": (float(trajectory.t[-1]) - fallen, ""),
    }


def growth(scene: Scene) -> float:
    """Largest amplification of a distance across the hill.

    The normal force of the hill, at most m g, is tilted by y/(R + r): y'' = g y/(R + r) at most, less in rolling. It is
    small with some initial speed, and grows as 1/v where the disc starts almost at rest.
    """
    p = scene.params
    return bounds.saddle(scene.duration * math.sqrt(p["g"] / (p["hill"] + p["radius"])))


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """First-order schemes: each step loses (a dt)^2/2 of energy, a: centripetal acceleration v^2/(R + r).

    The start is faster or slower by the height of that energy; half a step by the order of the scheme, one for a
    contact found late. A disc that is found g dt^2 deep moves around a hill smaller by that. The normal is that of a
    place up to one step away, which turns the horizontal part of the force: dt times the integral of the force over the
    angle.
    """
    p = scene.params
    g, reach, time = p["g"], p["radius"] + p["hill"], truth["leaving_time"]
    phi = np.linspace(0.0, math.radians(truth["leaving_angle"]), 257)
    square = p["v"] ** 2 + 2.0 * g * reach * (1.0 - np.cos(phi))
    # The integral of a^2 dt/2 over the path, without friction, which is the fastest.
    lost = 0.5 * dt * float(np.trapezoid(square**1.5 / reach, phi)) / g
    force = g * np.cos(phi) - square / reach + (g * np.sin(phi) * K / (1.0 + K) if p["mu"] > 0.0 else 0.0)
    turned = dt * float(np.trapezoid(np.maximum(0.0, force), phi))
    # The angle of a horizontal speed, v^2 = g (R + r) cos(phi)^3, and the time of a fall by the resulting change.
    cosine, sine = math.cos(phi[-1]), math.sin(phi[-1])
    askew = math.degrees(2.0 * truth["level_speed"] * turned / (3.0 * g * reach * cosine**2 * sine))
    found: dict[str, list[float]] = {"level_speed": [], "leaving_angle": [], "leaving_time": []}
    for side in (-1.0, 1.0):
        start = math.sqrt(max(0.01 * p["v"] ** 2, p["v"] ** 2 + 2.0 * g * side * lost))
        later, leaves, with_speed = _leaving(start, p["mu"], g, p["radius"], p["hill"] + side * g * dt * dt)
        found["level_speed"].append(abs(with_speed * math.cos(leaves) - truth["level_speed"]))
        found["leaving_angle"].append(abs(math.degrees(leaves) - truth["leaving_angle"]))
        found["leaving_time"].append(abs(later - time))
    because = (
        "the hill pushes along the normal of a place up to one step away; each step loses (a dt)^2/2 of energy, a: "
        "acceleration towards the hill; and a contact found late"
    )
    source = "energy, Coulomb's law, and a normal force that fades to nothing"
    speed = bounds.Bound(turned + max(found["level_speed"]), because)
    angle = bounds.Bound(askew + max(found["leaving_angle"]), because)
    late = bounds.Bound(1.5 * dt + 2.0 * turned / g + max(found["leaving_time"]), because)
    return [
        speed.check("level_speed", "m/s", truth["level_speed"], source),
        angle.check("leaving_angle", "deg", truth["leaving_angle"], source),
        late.check("leaving_time", "s", time, source),
    ]


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Relative error of the horizontal speed."""
    return metrics.relative_error(found, exact(scene), ["level_speed"])


SCENE = CanonicalScene(
    name="hilltop",
    version=1,
    title="Disc that leaves a round hill",
    symptoms=(
        "a ball does not leave a round hill where it should",
        "an object sticks to a convex surface instead of taking off",
        "a disc slides over a dome and lifts off too late or too early",
        "contact is kept too long on top of a round hill",
        "a body is glued to a curved surface",
        "a sled on a hilltop should fly off",
        "a coin sliding down a globe leaves it at the wrong angle",
        "a ski jump: the body does not lose contact with the bump",
    ),
    family="turning",
    figure=__doc__ or "",
    law="leaves where N = 0: cos(phi) = 2/3 + v^2/(3 g (R + r)) without friction",
    dimensions=(2,),
    parameters=(
        Parameter("v", 1.0, "m/s", "level speed on the top", 0.0, 1e2, positive=True),
        Parameter("mu", 0.5, "1", "friction of the pair; with any the disc rolls from the start", 0.0, 10.0),
        Parameter("hill", 1.0, "m", "radius of the hill", 0.0, 1e3, positive=True),
        Parameter("radius", 0.25, "m", "of the disc", 0.0, 1e3, positive=True),
        Parameter("g", GRAVITY, "m/s^2", "gravity", 0.0, 1e3, positive=True),
        Parameter("mass", 1.0, "kg", "of the disc", 0.0, 1e6, positive=True),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    growth=growth,
    quick=(Variation({}), Variation({"mu": 0.1})),
    full=tuple(Variation({"v": v, "mu": mu}) for v in (0.5, 1.0, 2.0) for mu in (0.0, 0.1, 0.5, 2.0)),
    planted=({},),
    primary=Primary(
        "speed error",
        "1",
        "relative error of the horizontal speed of the flight, worst of rough and slippery",
        "the horizontal speed depends on where the disc leaves the hill, and stays constant in flight",
        lambda dt: [{}, {"mu": 0.1}],
        error,
        "the whole scene: on the hill, then in flight",
    ),
    smooth=("level_speed",),
    words={
        "level_speed": "flies off with {value}",
        "leaving_angle": "leaves the hill at {value}",
        "leaving_time": "leaves the hill after {value}",
    },
)
