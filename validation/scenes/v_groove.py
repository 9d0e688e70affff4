r"""A ball at rest in a groove between two smooth planes of unequal slopes.

        \               /
         \    ___      /           left:  N = m g sin(b)/sin(a + b)
          \ /     \   /            right: N = m g sin(a)/sin(a + b)
           |   o   | /
            \     / /              nothing moves; with a = b each carries
        a __ \_+_/_/ __ b          m g/(2 cos(a))

Both contacts act at once and neither is vertical: a solver must find two forces, each of which alone would throw the
ball out. It starts in exact contact with both.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from adapters.scene import Body, HalfSpace, Pair, Scene
from adapters.trajectory import Sampling, Trajectory
from validation import bounds, metrics
from validation.bounds import WINDOW
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Track, Variation
from validation.scenes.parts import along, at, ball, mass_of, standard_gravity, upward

RADIUS = 0.5


def _slopes(params: Params) -> tuple[float, float]:
    """Slopes of the left and the right plane to the horizontal [rad]."""
    return math.radians(params["left"]), math.radians(params["right"])


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the planes meet in a line through the origin."""
    a, b = _slopes(params)
    # The normals of the planes are (sin a, cos a) and (-sin b, cos b); the centre is a radius above both.
    x = RADIUS * (math.cos(b) - math.cos(a)) / math.sin(a + b)
    y = RADIUS * (math.sin(a) + math.sin(b)) / math.sin(a + b)
    planes = (
        Body("left", HalfSpace(along(dimension, math.sin(a), math.cos(a)), 0.0), motion="fixed"),
        Body("right", HalfSpace(along(dimension, -math.sin(b), math.cos(b)), 0.0), motion="fixed"),
    )
    body = at(ball("ball", dimension, params["mass"], RADIUS, 0.0), dimension, along(dimension, x, y))
    pairs = (Pair(restitution=0.0, friction=0.0),)
    gravity = upward(dimension, -params["g"])
    return Scene("v_groove", 1, dimension, (*planes, body), pairs, gravity, params["duration"], params)


def _loads(scene: Scene) -> tuple[float, float]:
    """Forces of the left and the right plane [N]."""
    a, b = _slopes(scene.params)
    weight = scene.params["mass"] * scene.params["g"]
    return weight * math.sin(b) / math.sin(a + b), weight * math.sin(a) / math.sin(a + b)


def exact(scene: Scene) -> dict[str, float]:
    """Equilibrium; loads are relative to their own exact values."""
    still = dict.fromkeys(("settle_time", "displacement", "kinetic_energy"), 0.0)
    return still | {"load[left]": 1.0, "load[right]": 1.0}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Motion of the ball from its poses; loads along the planes' normals over the last second."""
    d, g, dt = scene.dimension, scene.params["g"], trajectory.dt
    speed = metrics.body_speeds(scene, trajectory)
    late = trajectory.t > trajectory.t[-1] - WINDOW
    moved = trajectory.pose[:, 2, :d] - trajectory.pose[0, 2, :d]
    measured: dict[str, Measured] = {
        "settle_time": metrics.last_motion(trajectory.t, speed.max(axis=1), bounds.STILL * g * dt),
        "displacement": (float((moved**2).sum(axis=1).max()) ** 0.5, ""),
        "kinetic_energy": (float(metrics.kinetic_energy(scene, trajectory)[late].mean()), ""),
    }
    for k, (name, load) in enumerate(zip(("left", "right"), _loads(scene), strict=True)):
        measured[f"load[{name}]"] = _mean_load(scene, trajectory, k, load * dt)
    return measured


def _mean_load(scene: Scene, trajectory: Trajectory, plane: int, expected: float) -> Measured:
    contacts, shape = trajectory.contacts, scene.bodies[plane].shape
    assert isinstance(shape, HalfSpace)
    if contacts is None:
        return None, "contacts were not recorded"
    late = trajectory.t[contacts.step] > trajectory.t[-1] - WINDOW
    pushed = contacts.impulse_between(plane, 2)[late] @ shape.normal
    if len(pushed) == 0 or not (pushed == pushed).all():
        return None, metrics.UNAVAILABLE
    return float(pushed.mean()) / expected, ""


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """The ball may move by one step of free fall, down or along one plane where the other is found late."""
    p, (a, b) = scene.params, _slopes(scene.params)
    g, source = p["g"], "static equilibrium"
    late = bounds.found_late(g, dt, RADIUS)
    still = {
        "settle_time": ("s", bounds.settled(2, dt, scene.duration)),
        "displacement": ("m", late),
        "kinetic_energy": ("J", bounds.still_energy(p["mass"], g, dt)),
    }
    found = [bound.check(name, unit, truth[name], source) for name, (unit, bound) in still.items()]
    # A remaining velocity of v1/100 is 2 m v1/100 of momentum over the window, relative to each force.
    weight, small = p["mass"] * g, min(_loads(scene))
    share = bounds.carried(dt)
    share = bounds.Bound(share.value * weight / small / math.sin(a + b), share.because)
    loads = [name for name in truth if name.startswith("load[")]
    return found + [share.check(name, "1", truth[name], "triangle of forces") for name in loads]


def sampling(scene: Scene) -> Sampling:
    """Every step; contacts over the last second."""
    return Sampling(1, max(0.0, scene.duration - WINDOW))


def track(scene: Scene) -> Track:
    """The ball at rest."""
    return Track("ball", lambda t: scene.bodies[2].pose[: scene.dimension])


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Displacement of the ball, in radii."""
    value, reason = found["displacement"]
    return (None, reason) if value is None else (value / RADIUS, "")


SCENE = CanonicalScene(
    name="v_groove",
    version=1,
    title="Ball in a groove, at rest on two smooth planes",
    symptoms=(
        "the load is shared wrongly between two walls",
        "a ball in a groove pushes unequally on its two sides",
        "a cylinder lying in a V block sinks or jumps",
        "contact forces in a wedge-shaped gap are wrong",
        "a ball caught between two inclined planes does not rest",
        "normal forces of two supports do not balance the weight",
        "a sphere wedged in a corner of two slopes jitters",
        "a ball in a funnel or a trough never settles",
    ),
    family="stacks and statics",
    figure=__doc__ or "",
    law="N_left = m g sin(b)/sin(a + b),  N_right = m g sin(a)/sin(a + b)",
    dimensions=(2, 3),
    parameters=(
        Parameter("left", 45.0, "degrees", "slope of the left plane", 5.0, 85.0),
        Parameter("right", 45.0, "degrees", "slope of the right plane", 5.0, 85.0),
        standard_gravity(),
        mass_of("the ball"),
        Parameter("duration", 3.0, "s", "the last second is measured", 1.5, 1e4),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=sampling,
    track=track,
    standard=(Variation({}), Variation({"left": 60.0, "right": 20.0})),
    full=tuple(Variation({"left": a, "right": b}) for a in (10.0, 30.0, 45.0, 60.0, 80.0) for b in (10.0, 45.0, 80.0)),
    planted=({},),
    primary=Primary(
        "displacement",
        "radius",
        "largest displacement of the ball within the run, over its radius",
        "nothing may move, so any motion is error; loads are left out because a ball at rest has the right ones",
        lambda dt: [{}, {"left": 60.0, "right": 20.0}],
        error,
        "the ball at rest, half a second after the start",
        0.5,
        0.25,
        order=2,
    ),
    smooth=("displacement",),
    words={
        "displacement": "moves by {value} where it should lie still",
        "load": "presses on a plane with {value} of the force that holds it",
    },
)
