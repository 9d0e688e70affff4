r"""A block slides down a free wedge, which gives way on a smooth floor.

    |\                A = N (sin(alpha) - mu cos(alpha))/M           the wedge, to the left
    | \[]  a ->       N = m g cos(alpha)/(1 + (m/M) sin(alpha) (sin(alpha) - mu cos(alpha)))
    |  \              a = g sin(alpha) + A cos(alpha) - mu N/m       the block along the face, against the wedge
  <-|___\             both rest  if  mu >= tan(alpha)
  ================    no friction on the floor:  m u + M U = 0 at all times

[Any textbook of mechanics, with mu = 0.] Two bodies accelerate at once through a contact that accelerates too: a solver
that holds the wedge while it moves the block, or moves them in turns, gets the load on the face wrong, and so both
accelerations.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from adapters.engine import Array
from adapters.scene import Body, Pair, Polygon, Scene, SceneError
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Track, Variation
from validation.scenes.parts import block, floor, mass_of, standard_gravity, states, tilted, upward

#: Length of the face, width and height of the block, and what is left of the face before and behind it [m].
FACE, WIDTH, HEIGHT, LEFT = 2.0, 0.4, 0.3, 0.1
#: Duration of a run in which the block stays [s].
DURATION = 2.0


def slope(p: Params) -> float:
    """Angle alpha of the face [rad]."""
    return math.radians(p["slope"])


def motion(p: Params) -> tuple[float, float, float]:
    """Accelerations of the wedge (to the left) and of the block along the face [m/s^2], load on the face [N]."""
    c, s, mu, m = math.cos(slope(p)), math.sin(slope(p)), p["mu"], p["mass"]
    if mu * c >= s:
        return 0.0, 0.0, m * p["g"] * c
    load = m * p["g"] * c / (1.0 + s * (s - mu * c) / p["ratio"])
    away = load * (s - mu * c) / (p["ratio"] * m)
    return away, p["g"] * s + away * c - mu * load / m, load


def _way() -> float:
    """Sliding distance of the block at the measurement [m]."""
    return FACE - WIDTH - 2.0 * LEFT


def _held(p: Params, way: float) -> bool:
    """Whether floor and face hold wedge and block level after ``way`` [m]: each load falls within its base.

    The wedge is asked with d'Alembert's force at its centre of mass, a third up and along; all about its left corner.
    """
    c, s = math.cos(slope(p)), math.sin(slope(p))
    away, pull, load = motion(p)
    grip = p["mass"] * (p["g"] * s + away * c - pull)  # friction of the face
    ahead = 0.5 * HEIGHT * grip / load  # of the block's middle, where the load of the face acts
    below = LEFT + 0.5 * WIDTH + way + ahead  # along the face, from its top
    x, y = c * below, s * (FACE - below)
    across, down = grip * c - load * s, load * c + grip * s  # on the wedge
    heavy = p["ratio"] * p["mass"] * p["g"]
    held = (down * x + across * y + heavy * FACE * c / 3.0 - across * FACE * s / 3.0) / (down + heavy)
    return 2.0 * abs(ahead) < WIDTH and 0.0 < held < FACE * c


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the block rests near the top of the face, the wedge's left corner is at the origin.

    Raises
    ------
    SceneError
        If wedge or block would tip.
    """
    p, alpha = params, slope(params)
    c, s = math.cos(alpha), math.sin(alpha)
    _, pull, _ = motion(p)
    slides = pull > 0.0
    if not all(_held(p, way) for way in ((0.0, _way()) if slides else (0.0,))):
        raise SceneError(f"wedge.ratio: a wedge of {p['ratio']:g} times the block's mass tips, or the block does")
    base, tall = FACE * c, FACE * s
    corners = ((0.0, 0.0), (base, 0.0), (0.0, tall))
    wedge = Body(
        "wedge",
        Polygon(tuple((x - base / 3.0, y - tall / 3.0) for x, y in corners)),
        p["ratio"] * p["mass"],
        p["ratio"] * p["mass"] * FACE**2 / 18.0,  # right triangle: m (a^2 + b^2)/18
        (base / 3.0, tall / 3.0, 0.0),
    )
    below = LEFT + 0.5 * WIDTH
    place = (c * below + 0.5 * HEIGHT * s, s * (FACE - below) + 0.5 * HEIGHT * c)
    box = tilted(block("block", dimension, p["mass"], WIDTH, HEIGHT), dimension, place, -alpha)
    pairs = (Pair(restitution=0.0, friction=0.0), Pair("wedge", "block", 0.0, p["mu"]))
    duration = math.sqrt(2.0 * _way() / pull) if slides else DURATION
    return Scene("wedge", 1, dimension, (floor(dimension), wedge, box), pairs, upward(dimension, -p["g"]), duration, p)


def exact(scene: Scene) -> dict[str, float]:
    """Newton's laws of both bodies, or rest."""
    away, pull, _ = motion(scene.params)
    if pull == 0.0:
        return {"moved": 0.0}
    return {"given_way": away, "acceleration": pull, "momentum": 0.0, "off_the_face": 0.0, "turned": 0.0}


def _face(p: Params) -> tuple[Array, Array]:
    """Unit vectors along the face, downwards, and off it."""
    c, s = math.cos(slope(p)), math.sin(slope(p))
    return np.array([c, -s]), np.array([s, c])


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Mean accelerations over the second half, momentum along the floor, and how far the bodies part or sink."""
    p, pose, twist = scene.params, trajectory.pose, trajectory.twist
    along, off = _face(p)
    slip = (twist[:, 2, :2] - twist[:, 1, :2]) @ along
    gap = (pose[:, 2, :2] - pose[:, 1, :2]) @ off
    lifted = np.abs(pose[:, 1, 1] - pose[0, 1, 1]).max()
    swing = [metrics.turned(pose[:, k]) * metrics.reach(scene.bodies[k].shape) for k in (1, 2)]
    moved = [float(np.linalg.norm(pose[:, k, :2] - pose[0, k, :2], axis=1).max()) + swing[k - 1] for k in (1, 2)]
    momentum = sum(scene.bodies[k].mass * twist[-1, k, 0] for k in (1, 2))
    return {
        "moved": (metrics.largest(moved), ""),
        "given_way": metrics.mean_rate(trajectory.t, -twist[:, 1, 0]),
        "acceleration": metrics.mean_rate(trajectory.t, slip),
        "momentum": (float(momentum), ""),
        "off_the_face": (metrics.largest([np.abs(gap - gap[0]).max(), lifted]), ""),
        "turned": (metrics.largest(swing), ""),
    }


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """Constant forces are exact at every step; each of two contacts may be found one step late at the start."""
    p, g = scene.params, scene.params["g"]
    late = 2.0 * g * dt * dt + bounds.ROUND_OFF * FACE
    because = "floor and face, each found up to one step late: g dt^2 each"
    if "moved" in truth:
        moved = bounds.Bound(2.0 * late, because + "; and a corner sinks or slips as far")
        return [moved.check("moved", "m", truth["moved"], "Coulomb's law: mu >= tan(alpha)")]
    pace = bounds.driven(g, dt, 0.5 * scene.duration)
    source = "Newton's laws of wedge and block, Coulomb's law on the face"
    return [
        pace.check("given_way", "m/s^2", truth["given_way"], source),
        pace.check("acceleration", "m/s^2", truth["acceleration"], source),
        bounds.bookkeeping(p["mass"] * truth["acceleration"] * scene.duration).check(
            "momentum", "N s", truth["momentum"], "no force along the floor"
        ),
        bounds.Bound(late, because).check("off_the_face", "m", truth["off_the_face"], "both contacts press"),
        bounds.Bound(late, because).check("turned", "m", truth["turned"], "flat faces on each other"),
    ]


def track(scene: Scene) -> Track:
    """Place of the block."""
    away, pull, _ = motion(scene.params)
    start = np.array(scene.bodies[2].pose[:2])
    along, _ = _face(scene.params)
    rate = pull * along - np.array([away, 0.0])
    return Track("block", lambda t: tuple(float(x) for x in start + 0.5 * t * t * rate))


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Larger of the relative errors of both accelerations; way of what should stay, over the face."""
    truth = exact(scene)
    if "moved" in truth:
        value, reason = found["moved"]
        return (None, reason) if value is None else (value / FACE, "")
    return metrics.relative_error(found, truth, ("given_way", "acceleration"))


SCENE = CanonicalScene(
    name="wedge",
    family="friction",
    version=1,
    title="Block on a wedge that gives way",
    symptoms=(
        "a block on a movable ramp slides wrongly",
        "a ramp that can move does not slide away under the block",
        "the wedge under a sliding block moves too little",
        "a free inclined plane should recoil",
        "momentum is not conserved between a block and its ramp",
        "a box on a cart with a sloped top does not push the cart",
        "a slope on wheels stays in place when a block slides down it",
        "a block slides down a wedge and both should move apart",
    ),
    figure=__doc__ or "",
    law="A = N (sin(alpha) - mu cos(alpha))/M, N = m g cos(alpha)/(1 + (m/M) sin(alpha) (sin(alpha) - mu cos(alpha)))",
    dimensions=(2,),
    parameters=(
        Parameter("slope", 30.0, "degrees", "angle alpha of the face", 5.0, 60.0),
        Parameter("mu", 0.2, "1", "friction of the face", 0.0, 10.0),
        Parameter("ratio", 2.0, "1", "mass of the wedge over that of the block", 0.0, 1e6, positive=True),
        standard_gravity(),
        mass_of("the block"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    track=track,
    quick=(Variation({}), Variation({"mu": 0.7})),
    full=(
        *(Variation({"mu": mu, "ratio": ratio}) for mu in (0.0, 0.2) for ratio in (0.5, 2.0, 100.0)),
        *(Variation({"mu": mu}) for mu in (0.58, 0.7)),
    ),
    planted=({}, {"mu": 0.7}),
    primary=Primary(
        "coupling error",
        "1",
        "larger of the relative errors of both accelerations; displacement where nothing should move, over the face",
        "both depend on the load on the face, which is not the weight",
        lambda dt: [{}, {"mu": 0.7}],
        error,
        "the whole scene: the block slides, the wedge gives way",
    ),
    smooth=("given_way", "acceleration"),
    words={
        "moved": "moves by {value} where it should stay",
        "given_way": "the wedge gives way with {value}",
        "given_way<0": "the wedge comes back with {value}",
        "acceleration": "the block slides along the face with {value}",
        "acceleration<0": "the block slides up the face with {value}",
        "momentum": "gains {value} along a floor without friction",
        "off_the_face": "parts from the face or sinks by {value}",
        "turned": "turns: its corners move by {value}",
    },
)
