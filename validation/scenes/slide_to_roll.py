"""A ball thrown along the floor without spin slides until it rolls.

        -->  v                               v'  = v/(1 + k)        2/3 v of a disc, 5/7 v of a ball
       ( )          ( )   v'                 t   = v k/((1 + k) mu g)
    ========================================  x   = v^2 k (2 + k)/(2 mu g (1 + k)^2)
       |<--- x ---->|  from here it rolls    k   = I/(m r^2)

Friction determines when and where rolling begins, but not the speed then: angular momentum about the line of contact is
conserved. A rolling ball loses nothing, so its speed shows rolling resistance.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from adapters.scene import Pair, Scene
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Track, Variation
from validation.scenes.parts import ball, floor, heading, mass_of, standard_gravity, states, upward
from validation.truths.rolling import forward, gyration, launched, of_the_arm, on_a_late_arm

#: Duration over the time until it rolls: it rolls for two thirds of the run.
RUNS = 3.0


def _time(p: Params, k: float) -> float:
    """Time until the ball rolls [s]; on an arm a shorter than its radius its k is I/(m a^2)."""
    return p["v"] * k / ((1.0 + k) * p["mu"] * p["g"])


def _place(p: Params, k: float) -> float:
    """Distance until the ball rolls [m]."""
    return p["v"] ** 2 * k * (2.0 + k) / (2.0 * p["mu"] * p["g"] * (1.0 + k) ** 2)


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the ball touches the floor and moves without spin."""
    p = params
    still = ball("ball", dimension, p["mass"], p["radius"], p["radius"])
    thrown = launched(still, dimension, math.radians(p["heading"]), p["v"], 0.0)
    pairs = (Pair(restitution=0.0, friction=p["mu"]),)
    duration = RUNS * _time(p, gyration(dimension))
    return Scene(
        "slide_to_roll", 1, dimension, (floor(dimension), thrown), pairs, upward(dimension, -p["g"]), duration, p
    )


def exact(scene: Scene) -> dict[str, float]:
    """Constant friction until the point of contact rests."""
    p, k = scene.params, gyration(scene.dimension)
    truth = {
        "final_speed": p["v"] / (1.0 + k),
        "slip": 0.0,
        "rolling_time": _time(p, k),
        "rolling_place": _place(p, k),
        "hop": 0.0,
    }
    return truth | ({} if scene.dimension == 2 else {"astray": 0.0})


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Speed and slip at the end; time and place at which the linearly falling slip would be 0."""
    speed, spin = forward(scene, trajectory)
    slip = speed - scene.params["radius"] * spin
    time = _vanishes(trajectory.t, slip)
    line = heading(scene)
    way = (trajectory.pose[:, 1, : scene.dimension - 1] - trajectory.pose[0, 1, : scene.dimension - 1]) @ line
    place: Measured = (None, time[1]) if time[0] is None else (float(np.interp(time[0], trajectory.t, way)), "")
    measured: dict[str, Measured] = {
        "final_speed": (float(speed[-1]), ""),
        "slip": (float(slip[-1]), ""),
        "rolling_time": time,
        "rolling_place": place,
        "hop": (metrics.hop(trajectory), ""),
    }
    return measured | ({} if scene.dimension == 2 else {"astray": (metrics.astray(trajectory, line), "")})


def _vanishes(t: np.ndarray, slip: np.ndarray) -> Measured:
    """Where the line through the slip at about three and one quarter of its first value meets 0 [s]."""
    below = [np.flatnonzero(slip <= share * slip[0]) for share in (0.75, 0.25)]
    if not all(len(each) for each in below):
        return None, "the ball does not begin to roll"
    first, last = (int(each[0]) for each in below)
    if last == first:
        return None, "the ball slides for less than two steps"
    return float(t[first] + (t[last] - t[first]) * slip[first] / (slip[first] - slip[last])), ""


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """Velocities are exact at every step; the start, which touches, may find its contact one step late.

    The ball then does not brake for one step, v dt farther and dt later, and sinks by g dt^2, by which its lever arm is
    shorter. Places have an error of half a step times the lost speed, by the order of the scheme.
    """
    p, k, r = scene.params, gyration(scene.dimension), scene.params["radius"]
    g, v, end = p["g"], p["v"], truth["final_speed"]
    depth = g * dt * dt

    def changed(answer: Callable[[float], float]) -> float:
        """Change of ``answer(k)`` by a lever arm shorter by ``depth``."""
        return of_the_arm(lambda arm: answer(k * (r / arm) ** 2), r, depth)

    time = bounds.Bound(
        dt + changed(lambda k: _time(p, k)) + bounds.ROUND_OFF * scene.duration,
        "braking is constant in every scheme, except for a contact found one step late and the lever arm after it",
    )
    place = bounds.Bound(
        v * dt
        + 0.5 * (v - end) * dt
        + p["mu"] * depth
        + changed(lambda k: _place(p, k))
        + bounds.ROUND_OFF * truth["rolling_place"],
        "a contact found one step late gives v dt without friction, velocity and position half a step apart (v - "
        "v') dt/2; and mu g dt^2",
    )
    rolls = on_a_late_arm(lambda arm: v / (1.0 + k * (r / arm) ** 2), r, depth, v)
    slip = bounds.Bound(
        end * depth / r + bounds.ROUND_OFF * v,
        "it rolls on its lever arm; measured with the radius that is a slip of v g dt^2/r",
    )
    source = "Coulomb's law; angular momentum about the line of contact"
    found = [
        rolls.check("final_speed", "m/s", truth["final_speed"], source),
        slip.check("slip", "m/s", truth["slip"], source),
        time.check("rolling_time", "s", truth["rolling_time"], source),
        place.check("rolling_place", "m", truth["rolling_place"], source),
        bounds.found_late(g, dt, r).check("hop", "m", truth["hop"], source),
    ]
    if "astray" in truth:
        found.append(bounds.straight(g, dt, v * scene.duration).check("astray", "m", truth["astray"], source))
    return found


def track(scene: Scene) -> Track:
    """The parabola until it rolls, then straight on."""
    p, line, start = scene.params, heading(scene), scene.bodies[1].pose[: scene.dimension]
    begins, rolls = exact(scene)["rolling_time"], exact(scene)["final_speed"]

    def position(t: float) -> tuple[float, ...]:
        slid = min(t, begins)
        way = p["v"] * slid - 0.5 * p["mu"] * p["g"] * slid * slid + rolls * (t - slid)
        return (*(float(x) for x in start[:-1] + way * line), start[-1])

    return Track("ball", position)


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Relative error of the final speed."""
    truth = exact(scene)["final_speed"]
    value, reason = found["final_speed"]
    return (None, reason) if value is None else (abs(value - truth) / truth, "")


SCENE = CanonicalScene(
    name="slide_to_roll",
    version=1,
    title="Ball that slides until it rolls",
    symptoms=(
        "a ball slips instead of rolling",
        "a rolling ball curves",
        "a bowling ball never starts to roll",
        "a sliding ball does not pick up rotation from friction",
        "the transition from sliding to rolling comes too early or too late",
        "a ball keeps skidding and does not spin up",
        "a ball that is pushed without spin reaches the wrong rolling speed",
        "a wheel spins up on the ground wrongly",
        "a billiard ball drifts off its line while it rolls",
        "after it rolls without slipping a ball should not slow down",
        "the final speed of a ball that starts to roll is not 5/7",
    ),
    family="friction",
    figure=__doc__ or "",
    law="v' = v/(1 + k) after t = v k/((1 + k) mu g), then no loss",
    dimensions=(2, 3),
    parameters=(
        Parameter("v", 3.0, "m/s", "speed at the start, without spin", 0.0, 1e2, positive=True),
        Parameter("mu", 0.3, "1", "friction of the pair: when rolling begins, not how fast", 0.0, 10.0, positive=True),
        Parameter("heading", 0.0, "degrees", "angle of the motion to the axes; 3-D only", 0.0, 90.0),
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
    quick=(Variation({}), Variation({"mu": 0.1}), Variation({"heading": 30.0}, dimensions=(3,))),
    full=(
        *(Variation({"mu": mu, "radius": r}) for mu in (0.05, 0.1, 0.3, 0.8) for r in (0.1, 0.25, 1.0)),
        *(Variation({"heading": h}, dimensions=(3,)) for h in (15.0, 30.0, 45.0, 90.0)),
    ),
    planted=({},),
    primary=Primary(
        "speed error",
        "1",
        "|v'/v (1 + k) - 1| of the speed at the end, when the ball has rolled twice as long as it slid",
        "the one number that does not depend on friction: it shows wrong rolling, but not sliding that ends too "
        "early or late",
        lambda dt: [{}, {"mu": 0.1}],
        error,
        "the whole scene: the ball slides, then rolls",
        order=2,
    ),
    smooth=("rolling_place",),
    words={
        "final_speed": "rolls off with {value}",
        "slip": "goes on sliding with {value} where it should roll",
        "rolling_time": "rolls after {value}",
        "rolling_place": "rolls after {value}",
    },
)
