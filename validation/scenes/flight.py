r"""Bodies that nothing touches fall, fly and spin for ten seconds.

         v  \  |  /  v          v(t) = v0 - g t       of every body, whatever its speed and heading
             \ | /              x(t) = x0 + v0 t - g t^2/2
       v ----- o ----- v        seen from one that falls, the others go straight on
               |  +--+          a ball and a planar box keep their spin; a box .1 x .4 x .9 m that spins
               | g|  |          about its middle axis keeps L and E and turns over, as in `tumble`
               v  +--+

Nothing here has a contact, so nothing but gravity may change a velocity: no drag, no limit of speeds, no sleep.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from adapters.engine import Array
from adapters.scene import Body, Box, Scene
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Frontier, Measured, Parameter, Params, Primary, Variation
from validation.scenes.parts import ball, mass_of, pose_at, standard_gravity, states, upward
from validation.truths import spinning

#: Sides of the box [m]: three different moments.
SIDES = (0.1, 0.4, 0.9)
RADIUS = 0.5
#: Distance of each body at the start from the ball that falls [m]: those that are thrown move away from it and from
#: each other, and what falls beside it stays so far away.
APART = 10.0
#: Unit vectors of the throws, of exact length in decimals: along axes, where components of a velocity are limited one
#: by one, and askew, where they are limited together.
HEADINGS: dict[int, tuple[tuple[float, ...], ...]] = {
    2: ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.6, -0.8)),
    3: ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.48, 0.36, -0.8)),
}
#: Direction in which the box starts from the ball, off all headings.
BESIDE = {2: (-0.6, -0.8), 3: (-0.48, -0.6, -0.64)}
#: Spin about the box's longest and shortest side over that about the middle one: the disturbance.
DISTURBED = 0.025
#: The ball that falls, the first that is thrown, and the box, by index.
FALLS, THROWN, BOX = 0, 1, -1
SOURCE = "Newton's second law without a force but gravity"


def _spin(dimension: int, p: Params) -> tuple[float, ...]:
    """Spin of the box at the start [rad/s]; its axes are those of the world then."""
    turning = p["spin"]
    return (turning,) if dimension == 2 else (DISTURBED * turning, turning, DISTURBED * turning)


def _box(dimension: int, p: Params) -> Body:
    """The box at the origin; in the plane with its two longer sides."""
    sides = SIDES[3 - dimension :]
    inertia: float | tuple[float, float, float]
    if dimension == 2:
        inertia = p["mass"] * (sides[0] ** 2 + sides[1] ** 2) / 12.0
    else:
        x, y, z = map(float, spinning.moments(p["mass"], SIDES))
        inertia = (x, y, z)
    half = tuple(0.5 * side for side in sides)
    at = pose_at(dimension, (0.0,) * dimension)
    return Body("box", Box(half), p["mass"], inertia, at, (*(0.0,) * dimension, *_spin(dimension, p)))


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: a ball at the origin, balls thrown away from it, and the box."""
    p, falls = params, ball("dropped", dimension, params["mass"], RADIUS, 0.0)
    spins = (p["spin"],) if dimension == 2 else (0.0, p["spin"], 0.0)
    bodies = [replace(falls, twist=(*(0.0,) * dimension, *spins))]
    for k, way in enumerate(HEADINGS[dimension], start=1):
        place, speed = tuple(APART * c for c in way), tuple(p["speed"] * c for c in way)
        twist = (*speed, *(0.0,) * len(spins))
        bodies.append(replace(falls, name=f"thrown {k}", pose=pose_at(dimension, place), twist=twist))
    beside = pose_at(dimension, tuple(APART * c for c in BESIDE[dimension]))
    bodies.append(replace(_box(dimension, p), pose=beside))
    return Scene("flight", 1, dimension, tuple(bodies), (), upward(dimension, -p["g"]), p["time"], p)


def exact(scene: Scene) -> dict[str, float]:
    """Free fall, straight lines beside it, and Euler's equations."""
    p, time = scene.params, scene.params["time"]
    truth = {
        "fall": 0.5 * p["g"] * time**2,
        "fall_speed": p["g"] * time,
        "throw_speed": p["speed"],
        "throw_way": p["speed"] * time,
        "heading_spread": 0.0,
        "drift_across": 0.0,
        "ball_spin": p["spin"],
        "momentum_drift": 0.0,
    }
    if scene.dimension == 2:
        return truth
    flip = spinning.turns_over(spinning.moments(1.0, SIDES), _spin(3, p))
    return truth | {"energy_drift": 0.0} | ({"flip_time": flip} if flip < time else {})


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Each motion at the end, of throws seen from the ball that falls; the largest distance across it at any time.

    A last step may end later than ``time``: what grows with t, or with t^2, is that at ``time``.
    """
    d, p = scene.dimension, scene.params
    early = p["time"] / trajectory.t[-1]
    ways = np.array(HEADINGS[d])
    moved = trajectory.pose[:, :, :d] - trajectory.pose[0, :, :d]
    speed = trajectory.twist[-1, :, :d]
    beside = moved[:, THROWN:BOX] - moved[:, [FALLS]]
    along = np.einsum("skd,kd->sk", beside, ways)
    across = np.linalg.norm(beside - along[:, :, None] * ways, axis=2)
    sideways = np.linalg.norm(moved[:, FALLS, : d - 1], axis=1)
    apart = np.linalg.norm(moved[:, BOX] - moved[:, FALLS], axis=1)
    relative = np.einsum("kd,kd->k", speed[THROWN:BOX] - speed[FALLS], ways)
    found = {
        "fall": -moved[-1, FALLS, d - 1] * early**2,
        "fall_speed": -speed[FALLS, d - 1] * early,
        "throw_speed": _farthest(relative, p["speed"]),
        "throw_way": _farthest(along[-1] * early, p["speed"] * p["time"]),
        "heading_spread": relative.max() - relative.min(),
        "drift_across": metrics.largest([across.max(), sideways.max(), apart.max()]),
        "ball_spin": trajectory.twist[-1, FALLS, d if d == 2 else d + 1],
    }
    kept: dict[str, Measured] = {name: (float(value), "") for name, value in found.items()}
    if d == 2:
        spin = trajectory.twist[:, BOX, 2]
        return kept | {"momentum_drift": (float(np.abs(spin / spin[0] - 1.0).max()), "")}
    return kept | spinning.measure(np.array(scene.bodies[BOX].inertia), trajectory, BOX)


def _farthest(values: Array, truth: float) -> float:
    """The value that is farthest from the truth."""
    return float(values[int(np.argmax(np.abs(values - truth)))])


def fate(scene: Scene, found: Mapping[str, Measured]) -> str:
    """``slowed``: a throw that has lost, or gained, half of its speed."""
    speed = found["throw_speed"][0]
    if speed is None:
        return "NaN"
    return "" if abs(speed - scene.params["speed"]) <= 0.5 * scene.params["speed"] else "slowed"


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """Velocities and what depends on them alone are exact at every step; a fall lags or leads by half a step.

    Every step adds g dt and v dt to numbers of at most the largest speed and way, each with a rounding.
    """
    p, time = scene.params, scene.params["time"]
    updates = max(1.0, time / dt / 1000.0)
    fastest = p["speed"] + p["g"] * time
    longest = APART + p["speed"] * time + 0.5 * p["g"] * time**2
    steps = "exact at every dt: a constant acceleration; round-off of one update of {} each step"

    def rounded(scale: float, what: str) -> bounds.Bound:
        return bounds.Bound(updates * bounds.ROUND_OFF * scale, steps.format(what))

    fall = bounds.Bound(
        0.5 * p["g"] * time * dt + updates * bounds.ROUND_OFF * longest,
        "moving by the old, the new or the mean velocity of a step: half a step of the way, g t dt/2",
    )
    beside = rounded(2.0 * longest, "two places, as seen from a body that falls,")
    found = [
        fall.check("fall", "m", truth["fall"], SOURCE),
        rounded(fastest, "a velocity").check("fall_speed", "m/s", truth["fall_speed"], SOURCE),
        rounded(2.0 * fastest, "two velocities").check("throw_speed", "m/s", truth["throw_speed"], SOURCE),
        beside.check("throw_way", "m", truth["throw_way"], SOURCE),
        rounded(4.0 * fastest, "the velocities of two throws, each seen from a body that falls,").check(
            "heading_spread", "m/s", truth["heading_spread"], "space has no direction but that of gravity"
        ),
        beside.check("drift_across", "m", truth["drift_across"], SOURCE),
        rounded(p["spin"], "a spin").check("ball_spin", "rad/s", truth["ball_spin"], "no torque"),
    ]
    if scene.dimension == 2:
        return [*found, rounded(1.0, "a spin").check("momentum_drift", "1", truth["momentum_drift"], "no torque")]
    turning = spinning.checks(spinning.moments(1.0, SIDES), _spin(3, p), time, dt, truth)
    # A turn over that may be so late that it is not seen is not judged.
    return found + [c for c in turning if c.metric != "flip_time" or (c.truth or 0.0) + (c.bound or 0.0) <= time]


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Largest error of way and speed of a fall, and of the way of throws, relative to what is right."""
    return metrics.relative_error(found, exact(scene), ("fall", "fall_speed", "throw_way"))


SCENE = CanonicalScene(
    name="flight",
    version=1,
    title="Bodies that fall, fly and spin without a contact",
    symptoms=(
        "a falling body stops accelerating",
        "a body in free fall reaches a terminal velocity",
        "velocity in free flight decreases though there is no drag",
        "speed is capped or limited to a maximum",
        "a body does not fall or move faster than some speed",
        "a thrown object slows down in the air",
        "gravity is too weak: it falls too slowly",
        "objects fall like a feather or float in the air",
        "a projectile flies a shorter parabola than it should",
        "bodies drift sideways while they fall",
        "a free body gains speed along x or y, sideways",
        "momentum, angular momentum or spin is not conserved in free fall",
        "is there air resistance or damping by default",
        "there is hidden damping although nothing touches the body",
        "a body thrown up comes down more slowly",
        "how far something flies depends on its heading",
        "linear damping slows down everything",
        "heavy and light objects do not fall equally fast",
        "the acceleration of gravity is not 9.81",
        "a body without forces on it loses speed",
    ),
    family="turning",
    figure=__doc__ or "",
    law="v = v0 - g t for every body, speed and heading; spin, L and E are kept",
    dimensions=(2, 3),
    parameters=(
        Parameter("speed", 150.0, "m/s", "of the throws; above limits of 100 and 120 m/s", 0.0, 1e4, positive=True),
        Parameter("spin", 4.0, "rad/s", "of the ball, and of the box about its middle axis", 0.0, 1e2, positive=True),
        Parameter("time", 10.0, "s", "of the flight: 98 m/s and 490 m of fall", 0.0, 1e2, positive=True),
        standard_gravity(),
        mass_of("each body"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    frontiers=(
        Frontier("speed", "m/s", "speed", 10.0, 1e3, 1e4, fate, "no throw has lost half of its speed after 10 s"),
    ),
    standard=(Variation({}), Variation({"speed": 10.0, "time": 2.0})),
    full=tuple(Variation({"speed": v, "spin": s}) for v in (1.0, 50.0, 150.0, 1000.0) for s in (4.0, 20.0)),
    planted=({},),
    primary=Primary(
        "flight error",
        "1",
        "largest relative error of way and speed of a fall, and of the way of throws, at the end",
        "nothing else can be wrong with balls that nothing touches",
        lambda dt: [{}],
        error,
        "six free bodies",
    ),
    smooth=("fall",),
    words=spinning.WORDS
    | {
        "fall": "falls by {value}",
        "fall_speed": "falls with {value} at the end",
        "throw_speed": "a throw keeps {value} of its speed",
        "throw_way": "a throw goes {value}",
        "heading_spread": "speeds of throws differ by {value} with the heading",
        "drift_across": "drifts {value} across its way",
        "ball_spin": "a ball spins with {value} at the end",
    },
)
