"""A ball hits an immovable floor without gravity: the impact law alone.

          o   m = 0.5 kg, r = 0.5 m
          |  v                          v+ = -e v-
          v                             J  = m (1 + e) v
    ==============  floor               (no gravity: nothing else acts)

Gravity is left out because it would add g dt to the sampled speeds. Friction cannot act in a central impact and is 0,
so that no solver needs rotation or friction.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product

from adapters.scene import Pair, Scene
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import (
    CanonicalScene,
    Check,
    Measured,
    Parameter,
    Params,
    Primary,
    Restitution,
    Searched,
    Steps,
    Track,
    Variation,
)
from validation.scenes.parts import (
    PHASES,
    ball,
    between_impacts,
    delay,
    floor,
    mass_of,
    phases,
    states_and_impulses,
    upward,
)

#: Runs for this long after the ideal contact [s]: softest engine compared keeps contact for about 0.05 s.
AFTERMATH = 0.45


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the ball reaches the floor after ``delay`` seconds."""
    radius, v = params["radius"], params["v"]
    centre = radius + v * params["delay"]
    return Scene(
        "impact",
        1,
        dimension,
        (floor(dimension), ball("ball", dimension, params["mass"], radius, centre, -v)),
        (Pair(restitution=params["e"], friction=params["mu"]),),
        upward(dimension, 0.0),
        params["delay"] + AFTERMATH,
        params,
    )


def exact(scene: Scene) -> dict[str, float]:
    """Newton's law of restitution against a partner of infinite mass."""
    e, v, mass = scene.params["e"], scene.params["v"], scene.params["mass"]
    return {
        "rebound_ratio": e,
        "rebound_speed": e * v,
        "velocity_change": (1.0 + e) * v,
        "impulse": mass * (1.0 + e) * v,
        "momentum_defect": 0.0,
    }


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Velocity at the end, impulses summed over the whole contact."""
    up = scene.dimension - 1
    mass, v = scene.params["mass"], scene.params["v"]
    v_end = float(trajectory.twist[-1, 1, up])
    change = v_end + v
    impulse = metrics.total_impulse(trajectory, 0, 1)
    along: Measured = (None, impulse[1]) if impulse[0] is None else (float(impulse[0][up]), "")
    defect: Measured = (None, along[1]) if along[0] is None else (abs(mass * change - along[0]) / (mass * v), "")
    return {
        "rebound_ratio": (v_end / v, ""),
        "rebound_speed": (v_end, ""),
        "velocity_change": (change, ""),
        "impulse": along,
        "momentum_defect": defect,
    }


def track(scene: Scene) -> Track:
    """Straight in, straight out."""
    p = scene.params
    height = between_impacts(p["radius"] + p["v"] * p["delay"], -p["v"], [(p["delay"], p["e"] * p["v"])])
    return Track("ball", lambda t: upward(scene.dimension, height(t)))


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """One contact and no external force: exact at every step."""
    v, mass = scene.params["v"], scene.params["mass"]
    source = "Newton's law of restitution; one contact, no external force"
    scales = {
        "rebound_ratio": ("1", 1.0),
        "rebound_speed": ("m/s", v),
        "velocity_change": ("m/s", v),
        "impulse": ("N s", mass * v),
    }
    return [
        *bounds.exact_laws(scales, truth, source),
        bounds.bookkeeping().check("momentum_defect", "1", truth["momentum_defect"], "conservation of momentum"),
    ]


def rebound_error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Distance of the rebound ratio from e."""
    value, reason = found["rebound_ratio"]
    return (None, reason) if value is None else (abs(value - scene.params["e"]), "")


SCENE = CanonicalScene(
    name="impact",
    version=1,
    title="Ball against an immovable floor, no gravity",
    symptoms=(
        "restitution has no effect",
        "a slow ball sticks to the wall",
        "it rebounds too slowly",
        "a hit is inelastic although the coefficient of restitution is 1",
        "the speed after a collision with a fixed wall is too small",
        "energy is lost in a single elastic impact",
        "the impulse of a blow on the ground is wrong",
        "the bounciness of the material is ignored",
        "a puck stops dead at the border instead of rebounding",
        "how strong is the force when a falling body strikes the ground",
        "the contact is soft and spongy: it gives way and hardly rebounds",
        "rebound speed depends on the time step",
        "below some speed nothing rebounds any more",
        "how do I set a coefficient of restitution with stiffness and damping",
    ),
    family="rebound",
    figure=__doc__ or "",
    law="v+ = -e v-,  J = m (1 + e) v",
    dimensions=(2, 3),
    parameters=(
        Parameter("e", 0.8, "1", "coefficient of restitution of the pair", 0.0, 1.0),
        Parameter("v", 6.0, "m/s", "approach speed; 6 with e = 0.8 is the worked example", 0.0, 1e3, positive=True),
        delay(),
        Parameter("mu", 0.0, "1", "friction of the pair; it has no effect on a central impact", 0.0, 10.0),
        mass_of("the ball (worked example)", 0.5),
        Parameter("radius", 0.5, "m", "of the ball", 0.0, 1e3, positive=True),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states_and_impulses,
    track=track,
    # Slow and fast, and both limits of restitution, which show thresholds, tunnelling and impact laws; at 6 m/s the
    # values of e that the report's first figure draws.
    quick=(
        Variation({}),
        *(
            Variation({"e": e, "v": v}, dimensions=(2,))
            for e, v in ((0.0, 6.0), (0.5, 0.1), (0.5, 6.0), (1.0, 6.0), (1.0, 50.0))
        ),
    ),
    standard=tuple(
        Variation({"e": e, "v": v}) for e, v in product((0.0, 0.2, 0.5, 0.8, 0.95, 1.0), (0.1, 1.0, 6.0, 50.0))
    ),
    planted=({},),
    primary=Primary(
        "rebound error",
        "1",
        f"largest |v+/v- - e| over {PHASES} contact times within a step",
        "the impact law alone, without gravity; an engine that acts before or after the contact may depend on the "
        "phase, so the worst phase counts",
        phases,
        rebound_error,
        "the whole scene: approach, contact, departure",
        order=0,
    ),
    steps=Steps((1.0 / 60.0, 1.0 / 240.0), full_iterations=(1,)),
    searched=Searched(
        "impact",
        ({"e": 0.0, "v": 1.0}, {"e": 0.5, "v": 6.0}, {"e": 1.0, "v": 1.0}),
        ({"e": 0.2, "v": 50.0},),
    ),
    restitution=Restitution("rebound_ratio", "e", "v"),
)
