r"""A ball is thrown at the floor with spin: it grips, slips or comes back.

      o  w                    u = v - w r, the slip of the point that touches,  k = I/(m r^2)
       \                       grips if |u| k/(1 + k) <= mu (1 + e) v_n:
        v   _                    v' = v - u k/(1 + k),          w' r = v'
    ========|/=====           slips otherwise:
                                 v' = v -+ mu (1 + e) v_n,      w' r = w r +- mu (1 + e) v_n/k

Coulomb's law of friction for an impact, with Newton's restitution along the normal; no gravity. Enough backspin sends
the ball back: v' < 0 where -k w r > v, as with a table tennis ball.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from adapters.scene import Pair, Scene
from adapters.trajectory import Trajectory
from validation import bounds
from validation.canonical import (
    CanonicalScene,
    Check,
    Measured,
    Parameter,
    Params,
    Primary,
    Restitution,
    Track,
    Variation,
)
from validation.scenes.parts import (
    PHASES,
    ball,
    between_impacts,
    delay,
    floor,
    heading,
    mass_of,
    phases,
    states,
    upward,
)
from validation.truths.rolling import forward, gyration, launched, on_a_late_arm, struck

#: Runs for this long after the contact [s]: softest engine compared keeps contact for about 0.05 s.
AFTERMATH = 0.35


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the ball reaches the floor after ``delay`` seconds."""
    p = params
    still = ball("ball", dimension, p["mass"], p["radius"], p["radius"] + p["fall"] * p["delay"])
    thrown = launched(still, dimension, math.radians(p["heading"]), p["v"], p["spin"] / p["radius"], -p["fall"])
    pairs = (Pair(restitution=p["e"], friction=p["mu"]),)
    duration = p["delay"] + AFTERMATH
    return Scene("oblique", 1, dimension, (floor(dimension), thrown), pairs, upward(dimension, 0.0), duration, p)


def _after(scene: Scene, arm: float) -> tuple[float, float]:
    """Speed [m/s] along the floor and spin [rad/s] after the impact, if friction acts ``arm`` [m] from the centre."""
    p = scene.params
    blow = (1.0 + p["e"]) * p["fall"]
    return struck(p["v"], p["spin"] / p["radius"], blow, p["mu"], gyration(scene.dimension), p["radius"], arm)


def exact(scene: Scene) -> dict[str, float]:
    """Coulomb's and Newton's laws of one impact."""
    radius = scene.params["radius"]
    speed, spin = _after(scene, radius)
    truth = {"rebound_ratio": scene.params["e"], "forward_speed": speed, "spin_speed": spin * radius}
    return truth | ({} if scene.dimension == 2 else {"sideways": 0.0})


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Velocities at the end; spin as the speed of the surface, positive where it rolls along the motion."""
    d = scene.dimension
    speed, spin = (float(each[-1]) for each in forward(scene, trajectory))
    measured: dict[str, Measured] = {
        "rebound_ratio": (float(trajectory.twist[-1, 1, d - 1]) / scene.params["fall"], ""),
        "forward_speed": (speed, ""),
        "spin_speed": (spin * scene.params["radius"], ""),
    }
    if d == 3:
        line = heading(scene)
        across = trajectory.twist[-1, 1, : d - 1] @ [-line[1], line[0]]
        measured["sideways"] = (abs(float(across)), "")
    return measured


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """One contact: exact at every step, except that the ball is found up to one step of its motion inside the floor."""
    p, r = scene.params, scene.params["radius"]
    depth, scale = p["fall"] * dt, abs(p["v"]) + abs(p["spin"]) + p["fall"]
    source = "Coulomb's law of friction for an impact, Newton's law of restitution; angular momentum"
    speed = on_a_late_arm(lambda arm: _after(scene, arm)[0], r, depth, scale)
    spin = on_a_late_arm(lambda arm: _after(scene, arm)[1] * r, r, depth, scale)
    found = [
        bounds.exact().check("rebound_ratio", "1", truth["rebound_ratio"], source),
        speed.check("forward_speed", "m/s", truth["forward_speed"], source),
        spin.check("spin_speed", "m/s", truth["spin_speed"], source),
    ]
    if "sideways" in truth:
        found.append(bounds.exact(scale).check("sideways", "m/s", truth["sideways"], source))
    return found


def track(scene: Scene) -> Track:
    """Straight in, straight out."""
    p, line = scene.params, heading(scene)
    way = between_impacts(0.0, p["v"], [(p["delay"], exact(scene)["forward_speed"])])
    height = between_impacts(p["radius"] + p["fall"] * p["delay"], -p["fall"], [(p["delay"], p["e"] * p["fall"])])
    return Track("ball", lambda t: (*(float(x) for x in way(t) * line), height(t)))


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Distance of speed and spin from the exact ones, over the slip at the start."""
    truth, p, off = exact(scene), scene.params, []
    for name in ("forward_speed", "spin_speed"):
        value, reason = found[name]
        if value is None:
            return None, reason
        off.append(value - truth[name])
    return math.hypot(*off) / abs(p["v"] - p["spin"]), ""


SCENE = CanonicalScene(
    name="oblique",
    version=1,
    title="Ball thrown at the floor with spin",
    symptoms=(
        "spin after a bounce is wrong",
        "a ball with topspin or backspin bounces at the wrong angle",
        "a ball thrown at an angle leaves the floor wrongly",
        "friction during an impact is missing or too strong",
        "a spinning ball should kick forward when it lands",
        "a basketball that hits the ground obliquely gets no spin",
        "a thrown ball loses too much horizontal speed at the bounce",
        "the reflection angle of a ball is not right with friction",
        "a table tennis ball with spin rebounds straight",
        "a ball that grazes a wall does not begin to spin",
        "a tennis shot skids off the court at the wrong angle",
    ),
    family="rebound",
    figure=__doc__ or "",
    law="grips if |v - w r| k/(1 + k) <= mu (1 + e) v_n, and rolls off; else slips by mu (1 + e) v_n",
    dimensions=(2, 3),
    parameters=(
        Parameter("v", 3.0, "m/s", "along the floor", 0.0, 1e2),
        Parameter(
            "spin",
            0.0,
            "m/s",
            "speed of the surface by spin, w r; positive: as in rolling, negative: backspin",
            -1e3,
            1e3,
        ),
        Parameter("fall", 2.0, "m/s", "of the approach, v_n", 0.0, 1e2, positive=True),
        Parameter("e", 0.8, "1", "coefficient of restitution of the pair", 0.0, 1.0),
        Parameter("mu", 0.5, "1", "friction of the pair; 0.5: the ball grips", 0.0, 10.0),
        Parameter("heading", 0.0, "degrees", "angle of the motion to the axes; 3-D only", 0.0, 90.0),
        delay(),
        Parameter("radius", 0.5, "m", "of the ball", 0.0, 1e3, positive=True),
        mass_of("the ball"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    track=track,
    quick=(
        Variation({}),
        Variation({"v": 1.0, "spin": -10.0, "mu": 1.0}, dimensions=(2,)),
        Variation({"mu": 0.1, "heading": 30.0}, dimensions=(3,)),
    ),
    standard=(
        Variation({}),
        Variation({"mu": 0.1}),
        Variation({"v": 1.0, "spin": -10.0, "mu": 1.0}),
        Variation({"mu": 0.1, "heading": 30.0}, dimensions=(3,)),
    ),
    full=(
        *(Variation({"mu": mu, "e": e}) for mu in (0.0, 0.1, 0.3, 0.5, 1.0) for e in (0.0, 0.5, 0.8, 1.0)),
        *(Variation({"v": 1.0, "spin": s, "mu": 1.0}) for s in (-30.0, -10.0, -3.0, 3.0, 10.0)),
        *(Variation({"mu": 0.1, "heading": h}, dimensions=(3,)) for h in (15.0, 30.0, 45.0)),
    ),
    planted=({}, {"mu": 0.1}),
    primary=Primary(
        "velocity error",
        "1",
        f"distance of speed and spin from the exact ones, over the slip, worst of gripping and slipping, {PHASES} "
        "contact times",
        "an impact with friction either grips or slips, with a limit between: both must be right, in speed and spin",
        lambda dt: [cell | phase for cell in ({}, {"mu": 0.1}) for phase in phases(dt)],
        error,
        "the whole scene: approach, contact, departure",
        order=1,
    ),
    words={
        "forward_speed": "leaves along the floor with {value}",
        "forward_speed<0": "leaves backwards along the floor with {value}",
        "spin_speed": "leaves with a spin of {value} at its surface",
        "sideways": "leaves sideways with {value}",
    },
    restitution=Restitution("rebound_ratio", "e", "fall"),
)
