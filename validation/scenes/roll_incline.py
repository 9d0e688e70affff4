"""A ball is released on an incline: it rolls, or slides and turns where friction is too small.

        ( ) ->                 mu >= tan(theta) k/(1 + k):   a = g sin(theta)/(1 + k),  w' r = a
    ==============             less:                         a = g (sin(theta) - mu cos(theta)),
      gravity turned                                         w' r = mu g cos(theta)/k

k = I/(m r^2): a disc needs a third of tan(theta) to roll, a ball two sevenths. Gravity is rotated by theta, not the
floor, as a tilted start in contact is not exactly representable. ``ratio`` is tan(theta) k/((1 + k) mu): 1 is the
limit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from adapters.scene import Pair, Scene
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Track, Variation
from validation.scenes.parts import along, ball, floor, mass_of, standard_gravity, states
from validation.truths.rolling import forward, gyration, of_the_arm


def angle(params: Params, dimension: int) -> float:
    """Incline angle [rad]."""
    k = gyration(dimension)
    return math.atan(params["ratio"] * params["mu"] * (1.0 + k) / k)


def make(dimension: int, params: Params) -> Scene:
    """Build the scene; the ball starts at rest and moves along +x."""
    p, theta = params, angle(params, dimension)
    gravity = along(dimension, p["g"] * math.sin(theta), -p["g"] * math.cos(theta))
    bodies = (floor(dimension), ball("ball", dimension, p["mass"], p["radius"], p["radius"]))
    pairs = (Pair(restitution=0.0, friction=p["mu"]),)
    return Scene("roll_incline", 1, dimension, bodies, pairs, gravity, p["duration"], p)


def _rates(scene: Scene, arm: float) -> tuple[float, float]:
    """Acceleration of the centre and of the surface by spin [m/s^2], if friction acts ``arm`` [m] from the centre."""
    p = scene.params
    own, pull, weight = gyration(scene.dimension) * p["radius"] ** 2, scene.gravity[0], -scene.gravity[-1]
    friction = min(p["mu"] * weight, pull / (1.0 + arm**2 / own))
    return pull - friction, friction * arm / own * p["radius"]


def exact(scene: Scene) -> dict[str, float]:
    """The friction of rolling, up to Coulomb's limit."""
    acceleration, turning = _rates(scene, scene.params["radius"])
    return {"acceleration": acceleration, "turning": turning, "hop": 0.0}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Mean accelerations over the second half of the run, past any start-up transient."""
    speed, spin = forward(scene, trajectory)
    return {
        "acceleration": metrics.mean_rate(trajectory.t, speed),
        "turning": metrics.mean_rate(trajectory.t, spin * scene.params["radius"]),
        "hop": (metrics.hop(trajectory), ""),
    }


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """Constant forces; the start, which touches, may find its contact one step late and g dt^2 deep."""
    p, r = scene.params, scene.params["radius"]
    driven = bounds.driven(p["g"], dt, 0.5 * scene.duration - dt)

    def allowed(answer: Callable[[float], float]) -> bounds.Bound:
        because = f"{driven.because}; and the effect of a lever arm shorter by g dt^2, from a late contact"
        return bounds.Bound(driven.value + of_the_arm(answer, r, p["g"] * dt * dt), because)

    source = "Newton's and Euler's laws with Coulomb's friction"
    late = bounds.found_late(p["g"], dt, r)
    return [
        allowed(lambda arm: _rates(scene, arm)[0]).check("acceleration", "m/s^2", truth["acceleration"], source),
        allowed(lambda arm: _rates(scene, arm)[1]).check("turning", "m/s^2", truth["turning"], source),
        late.check("hop", "m", truth["hop"], source),
    ]


def track(scene: Scene) -> Track:
    """The exact parabola."""
    start, a = scene.bodies[1].pose[: scene.dimension], exact(scene)["acceleration"]
    return Track("ball", lambda t: (start[0] + 0.5 * a * t * t, *start[1:]))


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Larger error of the two accelerations, over the pull along the incline."""
    truth, off = exact(scene), []
    for name in ("acceleration", "turning"):
        value, reason = found[name]
        if value is None:
            return None, reason
        off.append(abs(value - truth[name]))
    return metrics.largest(off) / scene.gravity[0], ""


SCENE = CanonicalScene(
    name="roll_incline",
    version=1,
    title="Ball that rolls down an incline",
    symptoms=(
        "a wheel or ball rolls too slowly or too fast down a slope",
        "rolling resistance on a slope although none was set",
        "a cylinder rolls down a ramp with the wrong acceleration",
        "a sphere slides down a ramp instead of rolling",
        "a ball on a slope does not start to roll",
        "a marble run is slower than theory",
        "hoop and solid ball arrive at the same time",
        "a barrel on an incline rolls faster than gravity allows",
        "a ball on a steep slope should slip while it rolls",
        "a disc sticks on the slope and does not roll down",
    ),
    family="friction",
    figure=__doc__ or "",
    law="a = g sin(theta)/(1 + k) if mu >= tan(theta) k/(1 + k), else g (sin(theta) - mu cos(theta))",
    dimensions=(2, 3),
    parameters=(
        Parameter("ratio", 0.5, "1", "tan(theta) k/((1 + k) mu); 1 is the limit of rolling", 0.0, 100.0, positive=True),
        Parameter("mu", 0.3, "1", "friction of the pair", 0.0, 10.0, positive=True),
        Parameter("radius", 0.5, "m", "of the ball", 0.0, 1e3, positive=True),
        standard_gravity(),
        Parameter("duration", 1.0, "s", "of the run", 0.1, 100.0),
        mass_of("the ball"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    track=track,
    quick=(Variation({}), Variation({"ratio": 0.99}), Variation({"ratio": 1.5})),
    full=tuple(
        Variation({"ratio": r, "mu": mu}) for r in (0.1, 0.5, 0.9, 0.99, 1.01, 1.5, 5.0) for mu in (0.1, 0.3, 0.6)
    ),
    planted=({},),
    primary=Primary(
        "acceleration error",
        "1",
        "larger error of the accelerations of centre and surface, over g sin(theta), worst of rolling and sliding",
        "friction that turns the ball, and friction at its limit: an engine may have only one of them right",
        lambda dt: [{}, {"ratio": 0.99}, {"ratio": 1.5}],
        error,
        "the rolling ball",
        0.1,
        0.5,
        order=1,
    ),
    smooth=("acceleration", "turning"),
    words={
        "acceleration": "moves off with {value}",
        "acceleration<0": "moves uphill with {value}",
        "turning": "its surface turns faster by {value}",
    },
)
