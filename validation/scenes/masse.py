r"""A ball with a push and oblique spin (a masse shot): its path is a parabola until it rolls, then straight.

          u0 \                    slip u0 = v0 + w0 x (-r z): its direction u never changes
      v0 ---> \__                 path  x = v0 t - mu g t^2 u/2,   t <= t_f = |u0| k/((1 + k) mu g)
                  \__  v_f        then  v_f = v0 - u0 k/(1 + k),   k = 2/5

Friction acts against the slip, not against the motion: velocity and slip both change along the direction u. A friction
pyramid, or friction solved axis by axis, turns it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from adapters.engine import Array
from adapters.scene import Pair, Scene
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Track, Variation
from validation.scenes.parts import ball, floor, mass_of, standard_gravity, states, upward
from validation.truths.rolling import gyration, of_the_arm, on_a_late_arm

K = gyration(3)
#: Duration over the time until it rolls.
RUNS = 2.0


def _spin(p: Params) -> Array:
    """Spin at the start [rad/s]: of the surface at the floor, ``side`` [m/s] across the motion."""
    return np.array([p["side"] / p["radius"], -p["back"] / p["radius"], 0.0])


def _slip(p: Params, arm: float) -> Array:
    """Velocity of the contact point, ``arm`` [m] below the centre, at the start [m/s]."""
    wx, wy, _ = _spin(p)
    return np.array([p["v"] - wy * arm, wx * arm])


def _rolling(p: Params, arm: float) -> tuple[float, Array, Array]:
    """Time [s], place [m] and velocity [m/s] at which rolling begins, if friction acts ``arm`` [m] below."""
    k, slip, start = K * (p["radius"] / arm) ** 2, _slip(p, arm), np.array([p["v"], 0.0])
    time = float(np.linalg.norm(slip)) * k / ((1.0 + k) * p["mu"] * p["g"])
    lost = slip * k / (1.0 + k)
    return time, (start - 0.5 * lost) * time, start - lost


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the ball touches the floor."""
    p = params
    still = ball("ball", dimension, p["mass"], p["radius"], p["radius"])
    shot = replace(still, twist=(p["v"], 0.0, 0.0, *(float(w) for w in _spin(p))))
    pairs = (Pair(restitution=0.0, friction=p["mu"]),)
    duration = RUNS * _rolling(p, p["radius"])[0]
    return Scene("masse", 1, dimension, (floor(dimension), shot), pairs, upward(dimension, -p["g"]), duration, p)


def exact(scene: Scene) -> dict[str, float]:
    """Coulomb's law along a slip of constant direction."""
    p = scene.params
    time, place, velocity = _rolling(p, p["radius"])
    end = place + velocity * (scene.duration - time)
    return {
        "final_vx": float(velocity[0]),
        "final_vy": float(velocity[1]),
        "end_x": float(end[0]),
        "end_y": float(end[1]),
        "turned": 0.0,
        "hop": 0.0,
    }


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Velocity and place at the end; the angle by which the slip's direction changes before it is nearly gone.

    The last step may end before or after the scene's duration: the place is extrapolated to that.
    """
    p = scene.params
    velocity, spin = trajectory.twist[:, 1, :2], trajectory.twist[:, 1, 3:]
    way = trajectory.pose[-1, 1, :2] - trajectory.pose[0, 1, :2]
    way = way + velocity[-1] * (scene.duration - trajectory.t[-1])
    slip = velocity + p["radius"] * np.column_stack([-spin[:, 1], spin[:, 0]])
    size = np.linalg.norm(slip, axis=1)
    slow = np.flatnonzero(size < 0.25 * size[0])
    still = slip[: slow[0] if len(slow) else len(slip)]
    first = still[0] / size[0]
    across = still @ [-first[1], first[0]]
    return {
        "final_vx": (float(velocity[-1, 0]), ""),
        "final_vy": (float(velocity[-1, 1]), ""),
        "end_x": (float(way[0]), ""),
        "end_y": (float(way[1]), ""),
        "turned": (float(np.abs(np.arctan2(across, still @ first)).max()), ""),
        "hop": (metrics.hop(trajectory), ""),
    }


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """As for a slide that ends in rolling: exact velocities, places shifted by the scheme and a late contact.

    On a lever arm shorter by a depth h the slip has the error w h; measured with the radius while the slip is at least
    a quarter of the first, its direction has the error 4 w h/|u0|.
    """
    p, r = scene.params, scene.params["radius"]
    depth = p["g"] * dt * dt
    slip, fastest = float(np.linalg.norm(_slip(p, r))), abs(p["v"]) + abs(p["side"]) + abs(p["back"])
    lost = slip * K / (1.0 + K)
    source = "Coulomb's law along the slip; angular momentum about the point of contact"

    def end(arm: float) -> Array:
        time, place, velocity = _rolling(p, arm)
        return np.asarray(place + velocity * (scene.duration - time))

    def velocity(axis: int) -> bounds.Bound:
        return on_a_late_arm(lambda arm: float(_rolling(p, arm)[2][axis]), r, depth, fastest)

    def place(axis: int) -> bounds.Bound:
        because = "a contact found one step late is |u0| k/(1 + k) dt without friction, a step order shows half of it"
        change = of_the_arm(lambda arm: float(end(arm)[axis]), r, depth)
        return bounds.Bound(
            1.5 * lost * dt + p["mu"] * depth + change + bounds.ROUND_OFF * fastest * scene.duration, because
        )

    turned = bounds.Bound(
        4.0 * float(np.linalg.norm(_spin(p))) * depth / slip + bounds.ROUND_OFF * fastest / slip,
        "friction keeps the direction of the slip; measured with the radius it is off by 4 w g dt^2/|u0| at a "
        "quarter of it",
    )
    found = {
        "final_vx": ("m/s", velocity(0)),
        "final_vy": ("m/s", velocity(1)),
        "end_x": ("m", place(0)),
        "end_y": ("m", place(1)),
        "turned": ("rad", turned),
        "hop": ("m", bounds.found_late(p["g"], dt, r)),
    }
    return [bound.check(name, unit, truth[name], source) for name, (unit, bound) in found.items()]


def track(scene: Scene) -> Track:
    """The parabola, then straight on."""
    p, start = scene.params, np.array(scene.bodies[1].pose[:2])
    time, _, velocity = _rolling(p, p["radius"])
    first = np.array([p["v"], 0.0])

    def position(t: float) -> tuple[float, ...]:
        slid = min(t, time)
        way = first * slid + 0.5 * (velocity - first) / time * slid * slid + velocity * (t - slid)
        return (*(float(x) for x in start + way), p["radius"])

    return Track("ball", position)


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Distance of the end from the exact place, over the displacement by friction."""
    p, truth, off = scene.params, exact(scene), []
    for name in ("end_x", "end_y"):
        value, reason = found[name]
        if value is None:
            return None, reason
        off.append(value - truth[name])
    straight = np.array([p["v"], 0.0]) * scene.duration
    return math.hypot(*off) / float(np.linalg.norm(straight - [truth["end_x"], truth["end_y"]])), ""


SCENE = CanonicalScene(
    name="masse",
    version=1,
    title="Ball pushed and spun askew: a parabola until it rolls",
    symptoms=(
        "a billiard ball with sidespin does not swerve",
        "a masse shot goes straight instead of curving",
        "a cue ball struck askew follows the wrong parabola",
        "english on a pool ball has no effect on the cloth",
        "a bowling ball with hook spin does not curve",
        "a spinning ball that slides should follow a bent path",
        "a snooker ball with swerve runs in a straight line",
        "friction of a sliding and spinning ball points in the wrong direction",
    ),
    family="friction",
    figure=__doc__ or "",
    law="x = v0 t - mu g t^2 u/2 until t = |u0| k/((1 + k) mu g), then v_f = v0 - u0 k/(1 + k)",
    dimensions=(3,),
    parameters=(
        Parameter("v", 2.0, "m/s", "of the centre, along x", 0.0, 1e2, positive=True),
        Parameter("side", 3.0, "m/s", "speed of the surface at the floor by spin, across the motion", -1e2, 1e2),
        Parameter(
            "back", 1.0, "m/s", "speed of the surface at the floor by spin, along the motion: backspin", -1e2, 1e2
        ),
        Parameter("mu", 0.2, "1", "friction of the pair", 0.0, 10.0, positive=True),
        Parameter("radius", 0.25, "m", "of the ball", 0.0, 1e3, positive=True),
        standard_gravity(),
        mass_of("the ball"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    track=track,
    quick=(Variation({}), Variation({"back": 4.0, "side": 1.0})),
    full=tuple(
        Variation({"side": s, "back": b, "mu": mu}) for s in (1.0, 3.0) for b in (0.0, 1.0, 4.0) for mu in (0.05, 0.2)
    ),
    planted=({},),
    primary=Primary(
        "place error",
        "1",
        "distance of the end from the exact place, over the distance by which friction moves it",
        "friction in a wrong direction, even for a moment, changes where the ball goes",
        lambda dt: [{}],
        error,
        "the whole scene: the ball slides askew, then rolls",
    ),
    smooth=("end_x", "end_y"),
    words={
        "final_vx": "rolls along with {value}",
        "final_vy": "rolls across with {value}",
        "end_x": "ends {value} along",
        "end_y": "ends {value} across",
        "turned": "turns the direction of its slip by {value}",
    },
)
