r"""A box is set down on a running belt: friction drags it until it moves with the belt.

       +---+
       |   |  x = V t - V^2/(2 mu g)       slips for V/(mu g), pulled by mu g,
     ==========   V ->                     and leaves a mark of V^2/(2 mu g) on the belt;
    (o)      (o)                           from then on it rests against the belt

The floor is the belt: it is fixed, and its surface has a velocity. In the frame of the belt the box slides to a stop.
An engine that ignores the surface velocity leaves the box at rest.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from adapters.scene import Pair, Scene
from adapters.trajectory import Trajectory
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Track, Variation
from validation.scenes.parts import along, at, block, floor, heading, mass_of, standard_gravity, states, upward
from validation.truths import sliding

#: Height of the box [m].
HEIGHT = 0.5
#: Names of the metrics of a slide to a stop, in the frame of the belt.
NAMES = {"stopping_distance": "slipped", "braking": "pull", "end_speed": "slip_speed"}


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the box rests on the belt's level, which runs along the heading."""
    p = params
    box = block("box", dimension, p["mass"], p["aspect"] * HEIGHT, HEIGHT)
    box = at(box, dimension, along(dimension, 0.0, 0.5 * HEIGHT))
    pairs = (Pair(restitution=0.0, friction=p["mu"]),)
    gravity = upward(dimension, -p["g"])
    scene = Scene("conveyor", 1, dimension, (floor(dimension), box), pairs, gravity, sliding.lasts(p), p)
    run = (*(float(v) for v in p["v"] * heading(scene)), 0.0)
    return replace(scene, bodies=(replace(scene.bodies[0], name="belt", surface_velocity=run), box))


def exact(scene: Scene) -> dict[str, float]:
    """Coulomb's law, kinetic until the box has the belt's velocity."""
    return {NAMES.get(name, name): value for name, value in sliding.exact(scene).items()}


def _from_the_belt(scene: Scene, trajectory: Trajectory) -> Trajectory:
    """The same motion in the frame of the belt, with the direction reversed: the box slides away and stops."""
    d, run = scene.dimension, scene.params["v"] * heading(scene)
    pose, twist = trajectory.pose.copy(), trajectory.twist.copy()
    place = pose[:, 1, : d - 1]
    pose[:, 1, : d - 1] = np.outer(trajectory.t - trajectory.t[0], run) - (place - place[0])
    twist[:, 1, : d - 1] = run - twist[:, 1, : d - 1]
    return replace(trajectory, pose=pose, twist=twist)


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Distance and speed relative to the belt, pull over the middle half of the slip, hop and rotation of the box."""
    found = sliding.measure(scene, _from_the_belt(scene, trajectory))
    return {NAMES.get(name, name): value for name, value in found.items()}


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """The checks of a slide; positions have the round-off of the whole distance."""
    names = {new: old for old, new in NAMES.items()}
    slide = {names.get(name, name): value for name, value in truth.items()}
    found = sliding.checks(scene, dt, slide, scene.params["v"] * scene.duration)
    return [replace(check, metric=NAMES.get(check.metric, check.metric)) for check in found]


def track(scene: Scene) -> Track:
    """Place of the box: motion of the belt less the slip of the box."""
    p, line = scene.params, heading(scene)
    end = sliding.stop(p)

    def position(t: float) -> tuple[float, ...]:
        gained = 0.5 * p["mu"] * p["g"] * min(t, end) ** 2 + p["v"] * max(0.0, t - end)
        return (*(float(x) for x in gained * line), 0.5 * HEIGHT)

    return Track("box", position)


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Distance of the box's final place on the belt from the exact one, over the length of its slide mark."""
    return sliding.error(scene, dt, {old: found[new] for old, new in NAMES.items()} | dict(found))


SCENE = CanonicalScene(
    name="conveyor",
    family="friction",
    version=1,
    title="Box that is set down on a running belt",
    symptoms=(
        "a conveyor belt carries objects at the wrong speed",
        "a box set down on a running belt slips too long",
        "surface velocity of a treadmill has no effect",
        "objects on a moving belt are dragged sideways",
        "goods on a conveyor jump or tip over",
        "a package never catches up with the belt",
        "how do I make a conveyor belt that moves objects by friction",
        "the transport band moves things too slowly or too fast",
        "a belt with a surface speed does not take the crate along",
    ),
    figure=__doc__ or "",
    law="x = V t - V^2/(2 mu g) once it moves with the belt, after V/(mu g)",
    dimensions=(2, 3),
    parameters=(
        Parameter("v", 2.0, "m/s", "speed V of the belt", 0.0, 1e2, positive=True),
        Parameter("mu", 0.4, "1", "friction; below aspect, so that the box does not tip", 0.0, 1.0, positive=True),
        Parameter("heading", 0.0, "degrees", "angle of the belt to the box's edges; 3-D only", 0.0, 90.0),
        Parameter("aspect", 1.5, "1", "width over height of the box", 1.1, 20.0),
        standard_gravity(),
        mass_of("the box"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    track=track,
    quick=(Variation({}),),
    full=(
        *(Variation({"v": v, "mu": mu}) for v in (0.5, 2.0) for mu in (0.1, 0.4, 0.8)),
        *(Variation({"heading": h}, dimensions=(3,)) for h in (22.5, 45.0)),
    ),
    planted=({},),
    primary=Primary(
        "ride error",
        "mark",
        "distance of the box's final place on the belt from the exact one, over the length of its slide mark",
        "one number for a pull that is too weak, too strong or in a wrong direction, and for slip that does not end",
        lambda dt: [{}],
        error,
        "the box while it slips",
        0.1,
        0.25,
    ),
    words={
        "slipped": "slips {value} on the belt",
        "pull": "is pulled by {value}",
        "pull<0": "is held back by {value}",
        "slip_speed": "still slips with {value} when it should move with the belt",
        "turned": "turns: its corners move by {value}",
    },
)
