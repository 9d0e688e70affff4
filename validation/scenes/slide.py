"""A box slides over a level floor until friction has stopped it.

       +---+  v
       |   | -->            stops after d = v^2/(2 mu g), t = v/(mu g),
    ==================      straight on, without turning or hopping;
       |<------ d ------>|      pressed by m g and braked by mu m g at every step

In 3-D it may move in any direction relative to the box's edges, on which Coulomb's law does not depend: a friction
pyramid brakes less along its diagonals or turns the path.
"""

from __future__ import annotations

from adapters.scene import Pair, Scene
from adapters.trajectory import Sampling, Trajectory
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Steps, Variation
from validation.scenes.parts import floor, heading, mass_of, standard_gravity, upward
from validation.truths import sliding

HEIGHT = 0.5


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the box rests on the floor and moves."""
    p = params
    box = sliding.launched(dimension, p, p["aspect"] * HEIGHT, HEIGHT)
    pairs = (Pair(restitution=0.0, friction=p["mu"]),)
    bodies, gravity = (floor(dimension), box), upward(dimension, -p["g"])
    return Scene("slide", 1, dimension, bodies, pairs, gravity, sliding.lasts(p), p)


def exact(scene: Scene) -> dict[str, float]:
    """The truth of a slide, and its forces, relative to the weight and to mu times it."""
    forces = {f"{force}[{by}]": 1.0 for force in ("normal", "friction") for by in ("mean", "least", "greatest")}
    return sliding.exact(scene) | forces


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """The metrics of a slide, and the floor's force over its middle half, upwards and against the heading."""
    p, long = scene.params, sliding.stop(scene.params)
    floor_force = metrics.forces(trajectory, 1, [0], 0.25 * long, 0.75 * long) / (p["mass"] * p["g"])
    along_way = floor_force[:, : scene.dimension - 1] @ heading(scene)
    return {
        **sliding.measure(scene, trajectory),
        **metrics.over_time("normal", floor_force[:, -1]),
        **metrics.over_time("friction", -along_way / p["mu"]),
    }


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """The checks of a slide, and of its forces: no vertical motion, and friction is mu times the normal force."""
    window = 0.5 * sliding.stop(scene.params)
    return [
        *sliding.checks(scene, dt, truth),
        *bounds.load("normal", dt, truth, "the floor carries the weight", window),
        *bounds.load("friction", dt, truth, "Coulomb's law, kinetic: mu N", window),
    ]


def sampling(scene: Scene) -> Sampling:
    """Every step; contacts from a quarter of the slide on."""
    return Sampling(1, 0.25 * sliding.stop(scene.params))


SCENE = CanonicalScene(
    name="slide",
    version=1,
    title="Box that slides to a stop, in any heading",
    symptoms=(
        "the braking distance is wrong",
        "friction depends on the direction or heading",
        "an object slides too far",
        "a sliding box stops too soon or too late",
        "friction is a pyramid: diagonal motion is braked differently",
        "a skidding crate curves instead of going straight",
        "kinetic friction does not equal mu times the normal force",
        "a sliding object does not stop, as if it were on ice",
        "friction has no effect on a box that slides on the floor",
        "a body thrown along the ground turns while it slides",
        "a slider tips over or lifts off although friction is low",
        "friction is anisotropic though one coefficient is set",
        "the deceleration of a sliding body is not mu g",
        "a curling stone or puck comes to rest at the wrong place",
    ),
    family="friction",
    figure=__doc__ or "",
    law="d = v^2/(2 mu g), straight on; friction is mu m g at every step and heading",
    dimensions=(2, 3),
    parameters=(
        Parameter("v", 3.0, "m/s", "speed at the start", 0.0, 1e2, positive=True),
        Parameter("mu", 0.4, "1", "friction; below aspect, so that the box does not tip", 0.0, 1.0, positive=True),
        Parameter("heading", 0.0, "degrees", "angle of the slide to the box's edges; 3-D only", 0.0, 90.0),
        Parameter("aspect", 1.5, "1", "width over height of the box", 1.1, 20.0),
        standard_gravity(),
        mass_of("the box"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=sampling,
    track=sliding.track,
    quick=(Variation({}), Variation({"heading": 22.5}, dimensions=(3,)), Variation({"heading": 45.0}, dimensions=(3,))),
    full=(
        *(Variation({"mu": mu, "aspect": a}) for mu in (0.1, 0.4, 0.8) for a in (1.5, 4.0)),
        *(Variation({"heading": h}, dimensions=(3,)) for h in (15.0, 22.5, 30.0, 45.0, 90.0)),
    ),
    planted=({},),
    primary=Primary(
        "stopping error",
        "way",
        "distance of the place where it stops from the exact one, over the length of its slide",
        "one number for too far, too short and astray",
        lambda dt: [{}],
        sliding.error,
        "the sliding box",
        0.1,
        0.25,
        order=1,
    ),
    steps=Steps((1.0 / 60.0, 1.0 / 240.0, 1.0 / 960.0)),
    smooth=("stopping_distance",),
    words=sliding.WORDS | {"normal": "carries {value} of the weight", "friction": "is braked with {value} of mu N"},
)
