"""A fast ball hits a thin plate without gravity: it rebounds at every speed.

              |#|
       o -->  |#|  d         v+ = -e v-,  on the side that it came from
              |#|
       |<- v dt ->|          a method of fixed steps sees it only where its steps end

Newton's law does not depend on speed or thickness. A method that detects overlaps at the ends of its steps finds a
contact up to v dt late; a ball beyond the plate by then is missed, or pushed out there.
"""

from __future__ import annotations

from collections.abc import Mapping

from adapters.scene import Body, Box, Pair, Scene
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import (
    CanonicalScene,
    Check,
    Frontier,
    Measured,
    Parameter,
    Params,
    Primary,
    Restitution,
    Track,
    Variation,
)
from validation.scenes.parts import PHASES, along, at, ball, between_impacts, delay, mass_of, phases, pose_at, states

#: Of the plate [m].
WIDTH = 2.0
#: Runs for this long after the ideal contact [s]: softest engine compared keeps contact for about 0.05 s.
AFTERMATH = 0.35


#: Time until contact [s], slightly more than 12 steps of 1/240 s: found as late and as deep as possible.
LATEST = 0.0500001


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the plate's near face is at 0, and the ball meets its middle after ``delay`` seconds."""
    p = params
    half = (0.5 * p["thickness"], *(0.5 * WIDTH,) * (dimension - 1))
    place = pose_at(dimension, along(dimension, 0.5 * p["thickness"]))
    plate = Body("plate", Box(half), pose=place, motion="fixed")
    thrown = at(
        ball("ball", dimension, p["mass"], p["radius"], 0.0),
        dimension,
        along(dimension, -p["radius"] - p["v"] * p["delay"]),
        along(dimension, p["v"]),
    )
    pairs = (Pair(restitution=p["e"], friction=0.0),)
    return Scene("thin_wall", 1, dimension, (plate, thrown), pairs, (0.0,) * dimension, p["delay"] + AFTERMATH, p)


def exact(scene: Scene) -> dict[str, float]:
    """Newton's law of restitution against a fixed body."""
    return {"rebound_ratio": scene.params["e"], "beyond": 0.0}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Speed away from the plate at the end, and the largest penetration of the ball."""
    p = scene.params
    x = trajectory.pose[:, 1, 0]
    return {
        "rebound_ratio": (float(-trajectory.twist[-1, 1, 0]) / p["v"], ""),
        "beyond": (metrics.largest([0.0, x.max() + p["radius"]]), ""),
    }


def fate(scene: Scene, found: Mapping[str, Measured]) -> str:
    """``tunnelled``, ``stuck``; empty for a ball that came back, however slowly."""
    back, beyond = found["rebound_ratio"][0], found["beyond"][0]
    if back is None or beyond is None:
        return "NaN"
    if beyond > scene.params["thickness"] + scene.params["radius"]:
        return "tunnelled"
    return "" if back > 0.0 or scene.params["e"] == 0.0 else "stuck"


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """The law is exact at every step; a late contact is v dt deep, whatever is behind the face."""
    p = scene.params
    reach = p["v"] * (p["delay"] + AFTERMATH)
    deep = bounds.Bound(p["v"] * dt + bounds.ROUND_OFF * reach, "the contact is found up to one step late, v dt deep")
    source = "Newton's law of restitution; bodies do not pass through each other"
    return [
        bounds.exact().check("rebound_ratio", "1", truth["rebound_ratio"], source),
        deep.check("beyond", "m", truth["beyond"], source),
    ]


def track(scene: Scene) -> Track:
    """Straight in, straight out."""
    p = scene.params
    x = between_impacts(-p["radius"] - p["v"] * p["delay"], p["v"], [(p["delay"], -p["e"] * p["v"])])
    return Track("ball", lambda t: along(scene.dimension, x(t)))


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Distance of the rebound ratio from e: 1 + e for a ball that passes."""
    value, reason = found["rebound_ratio"]
    return (None, reason) if value is None else (abs(value - scene.params["e"]), "")


SCENE = CanonicalScene(
    name="thin_wall",
    version=1,
    title="Fast ball against a thin plate",
    symptoms=(
        "fast things pass through walls",
        "a projectile tunnels through a thin plate",
        "objects fall through the floor",
        "an arrow goes through the target without a collision",
        "collisions are missed at high speed",
        "continuous collision detection does not work",
        "a fast ball ends up on the other side of the wall",
        "bodies drop through the ground after a long fall",
        "small fast bodies are not stopped by a thin box",
        "a landing body is deep in the ground before it is stopped",
        "the player falls through the map at low frame rate",
        "a quick body jumps over an obstacle between two steps",
        "bodies fall through a fixed body whose mass is 0",
        "objects clip through a thin barrier",
        "two fast bodies pass through one another",
    ),
    family="hard",
    figure=__doc__ or "",
    law="v+ = -e v- at any speed and thickness",
    dimensions=(2, 3),
    parameters=(
        Parameter("v", 20.0, "m/s", "approach speed; 20: 8 cm in a step of 1/240 s", 0.0, 1e4, positive=True),
        Parameter("thickness", 0.02, "m", "of the plate", 0.0, 1.0, positive=True),
        Parameter("e", 0.5, "1", "coefficient of restitution of the pair", 0.0, 1.0),
        Parameter("radius", 0.1, "m", "of the ball", 0.0, 1.0, positive=True),
        delay(),
        mass_of("the ball"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    track=track,
    frontiers=(
        Frontier(
            "impact speed",
            "m/s",
            "v",
            1.0,
            1e3,
            1e4,
            fate,
            "came back: the ball moves away from the plate, on the side that it came from",
        ),
    ),
    quick=(Variation({}), Variation({"v": 200.0}, dimensions=(2,))),
    standard=(Variation({}), Variation({"v": 200.0})),
    full=tuple(Variation({"v": v, "thickness": d}) for v in (5.0, 20.0, 50.0, 200.0, 1000.0) for d in (0.02, 0.2)),
    planted=({}, {"delay": LATEST}),
    primary=Primary(
        "rebound error",
        "1",
        f"largest |v+/v- - e| over {PHASES} contact times within a step; 1 + e for a ball that passes",
        "a ball passes if it does so at the worst phase",
        phases,
        error,
        "the whole scene: approach, contact, departure",
    ),
    words={
        "rebound_ratio": "comes back at {value} of its speed (below 0: it has passed)",
        "beyond": "gets {value} beyond the face",
    },
    restitution=Restitution("rebound_ratio", "e", "v"),
)
