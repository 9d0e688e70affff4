"""A board rocks on a round log, rolling without slipping.

         ____________         theta: tilt of the board; where it touches moves by R theta along it
        |_____.______|  2 h   m (h^2 + R^2 theta^2 + i^2) theta'^2/2
             ( )                + m g ((R + h) cos(theta) + R theta sin(theta)) = E
             ( )  R           stable for R > h; small swings: omega^2 = g (R - h)/(h^2 + i^2)

Energy is conserved: the contact rolls, and friction does no work. The time from one side to the other is the integral
of d theta/theta', for any amplitude. The scene shows energy errors at a moving contact point.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from adapters.engine import Array
from adapters.scene import Body, Disc, Pair, Scene, SceneError, Sphere
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Steps, Variation
from validation.scenes.parts import block, mass_of, pose_at, standard_gravity, states, tilted, upward
from validation.truths.quadrature import gauss

#: Number of swings from side to side.
SWINGS = 3
#: Nodes of the quadrature: twice as many change nothing at 1e-12.
NODES = 96


def _square(p: Params) -> float:
    """Square of the board's radius of gyration, i^2 [m^2]."""
    return (p["length"] ** 2 + p["thickness"] ** 2) / 12.0


def _inertia(p: Params, theta: Array) -> Array:
    """Factor of theta'^2/2 in the energy, over the mass [m^2]."""
    return np.asarray((0.5 * p["thickness"]) ** 2 + (p["radius"] * theta) ** 2 + _square(p))


def _raised(p: Params, theta: Array) -> Array:
    """Height of the centre above that of the level board [m], without cancellation where it is small."""
    half = np.sin(0.5 * theta)
    return np.asarray(p["radius"] * theta * np.sin(theta) - 2.0 * (p["radius"] + 0.5 * p["thickness"]) * half**2)


def _swing(p: Params) -> float:
    """Time from one side to the other [s]: twice that from the side to level; theta = start sin(s)."""
    x, weight = gauss(NODES)
    s = 0.25 * math.pi * (x + 1.0)
    start = np.array(math.radians(p["tilt"]))
    theta = start * np.sin(s)
    speed = np.sqrt(2.0 * p["g"] * (_raised(p, start) - _raised(p, theta)) / _inertia(p, theta))
    return float(2.0 * 0.25 * math.pi * (weight @ (start * np.cos(s) / speed)))


def _grips(p: Params) -> bool:
    """Whether friction holds the contact throughout, under load."""
    start = np.array(math.radians(p["tilt"]))
    theta = np.linspace(-start, start, 201)
    inertia, r, h, g = _inertia(p, theta), p["radius"], 0.5 * p["thickness"], p["g"]
    spin = np.sqrt(np.maximum(0.0, 2.0 * g * (_raised(p, start) - _raised(p, theta)) / inertia))
    # Lagrange: inertia theta'' + R^2 theta theta'^2 = g ((R + h) sin(theta) - R sin(theta) - R theta cos(theta))
    turn = (g * (h * np.sin(theta) - r * theta * np.cos(theta)) - r * r * theta * spin**2) / inertia
    # Acceleration of the centre along the board (t) and off it (n): its velocity is theta' (-h t + R theta n).
    along = -h * turn - r * theta * spin**2
    off = r * theta * turn + (r - h) * spin**2
    friction, normal = along + g * np.sin(theta), off + g * np.cos(theta)
    return bool((normal > 0.0).all() and (np.abs(friction) <= p["mu"] * normal).all())


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the board touches the log, tilted and at rest.

    Raises
    ------
    SceneError
        If the board would fall off, slip, or not return.
    """
    p, theta = params, math.radians(params["tilt"])
    r, h = p["radius"], 0.5 * p["thickness"]
    if r <= h:
        raise SceneError(f"rocker.radius: {r:g} m does not hold a board of {2.0 * h:g} m; half as thick it would")
    path = np.linspace(0.0, theta, 101)[1:]
    if r * theta > 0.45 * p["length"] or (np.diff(_raised(p, path)) <= 0.0).any():
        raise SceneError(f"rocker.tilt: at {p['tilt']:g} degrees the board falls off")
    if not _grips(p):
        raise SceneError(f"rocker.mu: {p['mu']:g} lets the board slip on the log")
    log = Body(
        "log", Disc(r) if dimension == 2 else Sphere(r), pose=pose_at(dimension, (0.0,) * dimension), motion="fixed"
    )
    # The centre lies h off the contact and R theta along the board from it.
    place = (
        -(r + h) * math.sin(theta) + r * theta * math.cos(theta),
        (r + h) * math.cos(theta) + r * theta * math.sin(theta),
    )
    board = tilted(block("board", dimension, p["mass"], p["length"], p["thickness"]), dimension, place, theta)
    pairs = (Pair(restitution=0.0, friction=p["mu"]),)
    duration = (SWINGS + 0.25) * _swing(p)
    return Scene("rocker", 1, dimension, (log, board), pairs, upward(dimension, -p["g"]), duration, p)


def exact(scene: Scene) -> dict[str, float]:
    """Energy, and the time from side to side."""
    truth = {"swing_time": _swing(scene.params), "amplitude": 1.0, "slip": 0.0}
    return truth | ({} if scene.dimension == 2 else {"yaw": 0.0})


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Times at which the board is level, its last tilt to a side, and the slip of the contact along it."""
    p, d = scene.params, scene.dimension
    theta, spin = metrics.tilt(trajectory), metrics.tilt_rate(trajectory)
    first, _ = metrics.crossing(trajectory.t, -theta, -spin, 0.0)
    after = trajectory.t > (SWINGS - 0.75) * _swing(p)
    direction = 1.0 if SWINGS % 2 == 0 else -1.0
    last, _ = metrics.crossing(trajectory.t[after], direction * theta[after], direction * spin[after], 0.0)
    swing: Measured = (None, metrics.NOT_PASSED)
    if first[0] is not None and last[0] is not None:
        swing = ((last[0] - first[0]) / (SWINGS - 1), "")
    # Contact point on the board by the log's normal, against the rolled distance.
    centre = trajectory.pose[:, 1, [0, d - 1]]
    along = -(np.cos(theta) * centre[:, 0] + np.sin(theta) * centre[:, 1])
    rolled = along + p["radius"] * theta
    top = trajectory.t > (SWINGS - 0.5) * _swing(p)
    measured: dict[str, Measured] = {
        "swing_time": swing,
        "amplitude": (float(np.abs(theta[top]).max()) / math.radians(p["tilt"]), ""),
        "slip": (float(np.abs(rolled - rolled[0]).max()), ""),
    }
    if d == 3:
        measured["yaw"] = (float(np.linalg.norm(trajectory.twist[:, 1, [3, 5]], axis=1).max()), "")
    return measured


def _left_out(p: Params) -> tuple[float, float]:
    """Error of a first-order scheme over one swing, over dt: motion of the centre [m/s], and energy as height [m/s].

    A step moves the centre by its velocity: dt^2/2 times the acceleration a towards the log is missing. The next one
    removes the velocity a dt, (a dt)^2/2 of energy.
    """
    start = np.array(math.radians(p["tilt"]))
    x, weight = gauss(NODES)
    theta = start * np.sin(0.5 * math.pi * x)
    inertia, r, h = _inertia(p, theta), p["radius"], 0.5 * p["thickness"]
    speed = np.sqrt(2.0 * p["g"] * (_raised(p, start) - _raised(p, theta)) / inertia)
    turn = (p["g"] * (h * np.sin(theta) - r * theta * np.cos(theta)) - r * r * theta * speed**2) / inertia
    pace = 0.5 * math.pi * weight * start * np.cos(0.5 * math.pi * x) / speed
    square = (r * theta * turn + (r - h) * speed**2) ** 2 + (h * turn + r * theta * speed**2) ** 2
    return 0.5 * float(pace @ np.sqrt(2.0 * square)), 0.5 * float(pace @ square) / p["g"]


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """First-order schemes: their errors in the contact's motion and in energy.

    An amplitude has the error of that energy, and of 1.5 steps of acceleration at the start, for the order of the
    scheme and a contact found late. A swing has the time of its amplitude, and each of the two times at which the board
    is level may be a step off.
    """
    p, g = scene.params, scene.params["g"]
    start = math.radians(p["tilt"])
    way, energy = _left_out(p)
    slope = float((_raised(p, np.array(start * 1.001)) - _raised(p, np.array(start * 0.999))) / (0.002 * start))
    kick = 0.5 * (1.5 * dt) ** 2 * g * slope**2 / float(_inertia(p, np.array(start)))
    error = (SWINGS * energy * dt + kick) / slope / start + bounds.ROUND_OFF
    other = [_swing({**p, "tilt": p["tilt"] * (1.0 + side * min(error, 0.2))}) for side in (-1.0, 1.0)]
    swing = bounds.Bound(
        2.0 * dt / (SWINGS - 1) + max(abs(each - truth["swing_time"]) for each in other),
        "a step at both ends of the swings, and the time that follows from an amplitude error of a first-order scheme",
    )
    amplitude = bounds.Bound(
        error, "each step loses (a dt)^2/2 of energy, a: acceleration towards the log; and 1.5 steps at the start"
    )
    slip = bounds.Bound(
        SWINGS * way * dt + g * dt * dt,
        "a step neglects dt^2/2 of the acceleration towards the log; a contact found one step late",
    )
    source = "Lagrange's equation of a board that rolls on a log; energy"
    found = [
        swing.check("swing_time", "s", truth["swing_time"], source),
        amplitude.check("amplitude", "1", truth["amplitude"], source),
        slip.check("slip", "m", truth["slip"], source),
    ]
    if "yaw" in truth:
        still = bounds.Bound(
            bounds.STILL * g * dt / (0.5 * p["length"]), "an end slower than v1/100 = g dt/100 does not move"
        )
        found.append(still.check("yaw", "rad/s", truth["yaw"], "symmetry"))
    return found


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Relative error of the time of a swing."""
    return metrics.relative_error(found, exact(scene), ["swing_time"])


SCENE = CanonicalScene(
    name="rocker",
    version=1,
    title="Board that rocks on a log",
    symptoms=(
        "a board that rocks on a log slides off or stops",
        "a plank balanced on a cylinder gains or loses energy",
        "a seesaw on a round support rocks too fast or too slowly",
        "a rocking chair comes to rest too soon",
        "a balance board rolls off its roller",
        "a body that rolls on a curved support loses energy",
        "a plate on a barrel does not swing back",
        "the period of a board on a round log is wrong",
    ),
    family="turning",
    figure=__doc__ or "",
    law="(h^2 + R^2 theta^2 + i^2) theta'^2/2 + g ((R + h) cos(theta) + R theta sin(theta)) is kept",
    dimensions=(2, 3),
    parameters=(
        Parameter("tilt", 15.0, "degrees", "of the board at the start", 0.1, 60.0),
        Parameter("radius", 0.5, "m", "of the log", 0.0, 1e3, positive=True),
        Parameter("thickness", 0.1, "m", "of the board; less than twice the radius", 0.0, 1e3, positive=True),
        Parameter("length", 2.0, "m", "of the board", 0.0, 1e3, positive=True),
        Parameter("mu", 0.8, "1", "friction: must hold the contact", 0.0, 10.0, positive=True),
        standard_gravity(),
        mass_of("the board"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    quick=(Variation({}), Variation({"tilt": 5.0})),
    full=tuple(Variation({"tilt": t, "thickness": h}) for t in (2.0, 5.0, 15.0) for h in (0.05, 0.1, 0.4)),
    planted=({},),
    primary=Primary(
        "time error",
        "1",
        "relative error of the time from side to side",
        "a period contains inertia, gravity and the moving contact point",
        lambda dt: [{}],
        error,
        "the rocking board",
    ),
    steps=Steps((1.0 / 60.0, 1.0 / 240.0)),
    smooth=("swing_time",),
    words={
        "swing_time": "swings from side to side in {value}",
        "amplitude": "still swings to {value} of its first tilt",
        "slip": "slips on the log by {value}",
        "yaw": "turns out of its plane with {value}",
    },
)
