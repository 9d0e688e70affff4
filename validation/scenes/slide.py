"""A box slides over a level floor until friction has stopped it.

       +---+  v
       |   | -->            stops after d = v^2/(2 mu g), t = v/(mu g),
    ==================      straight on, without turning or hopping
       |<------ d ------>|

In space it may head in any direction against the box's edges, which Coulomb's law does not know of: a cone that is a
pyramid brakes less along its diagonals or turns the path.
"""

from __future__ import annotations

from adapters.scene import Pair, Scene
from validation.canonical import CanonicalScene, Parameter, Params, Primary, Variation
from validation.scenes.parts import floor, mass_of, standard_gravity, states, upward
from validation.truths import sliding

HEIGHT = 0.5


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the box rests on the floor and moves."""
    p = params
    box = sliding.launched(dimension, p, p["aspect"] * HEIGHT, HEIGHT)
    pairs = (Pair(restitution=0.0, friction=p["mu"]),)
    bodies, gravity = (floor(dimension), box), upward(dimension, -p["g"])
    return Scene("slide", 1, dimension, bodies, pairs, gravity, sliding.lasts(p), p)


SCENE = CanonicalScene(
    name="slide",
    version=1,
    title="Box that slides to a stop, in any heading",
    family="friction",
    figure=__doc__ or "",
    law="d = v^2/(2 mu g), straight on; friction does not know the heading",
    dimensions=(2, 3),
    parameters=(
        Parameter("v", 3.0, "m/s", "speed at the start", 0.0, 1e2, positive=True),
        Parameter("mu", 0.4, "1", "friction; below aspect, so that the box does not tip", 0.0, 1.0, positive=True),
        Parameter("heading", 0.0, "degrees", "of the slide against the box's edges; spatial only", 0.0, 90.0),
        Parameter("aspect", 1.5, "1", "width over height of the box", 1.1, 20.0),
        standard_gravity(),
        mass_of("the box"),
    ),
    make=make,
    exact=sliding.exact,
    measure=sliding.measure,
    rule=sliding.checks,
    sampling=states,
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
        "distance of the place where it stops from where it should, over the way that it slides",
        "one number for too far, too short and astray",
        lambda dt: [{}],
        sliding.error,
        "the sliding box",
        0.1,
        0.25,
    ),
    smooth=("stopping_distance",),
    words=sliding.WORDS,
)
