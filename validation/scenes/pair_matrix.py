"""Two balls of different material bounce between a floor and a ceiling of different material: four pairs.

    ################ ceiling          each pair has an e and a mu of its own:
        a      b
        o ->   o ->                          floor        ceiling
        v      v                        a    e11 mu11     e12 mu12
    ================ floor              b    e21 mu21     e22 mu22 = cross x (what a product would give)

Every impact slips, so its friction is mu = (change along)/(change across), and its restitution the ratio of speeds;
without gravity, and with the balls in separate lanes. With ``cross`` 1 the table consists of products of one value per
body; otherwise of no rule, which an engine that combines two values cannot represent.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from adapters.engine import Array
from adapters.scene import Body, HalfSpace, Pair, Scene, SceneError
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Variation
from validation.scenes.parts import PHASES, along, at, ball, delay, floor, mass_of, phases, states, upward
from validation.truths.rolling import gyration, launched, struck

RADIUS, GAP, LANE = 0.5, 1.0, 5.0
#: Runs for this long after the last impact [s]: softest engine compared keeps contact for about 0.05 s.
AFTERMATH = 0.35
#: Names of the pairs, in order.
PAIRS = (("a", "floor"), ("a", "ceiling"), ("b", "floor"), ("b", "ceiling"))
#: Restitution and friction of the first three; the fourth follows from ``cross``.
RESTITUTION, FRICTION = (0.9, 0.6, 0.6), (0.2, 0.1, 0.1)


def materials(p: Params) -> list[tuple[float, float]]:
    """Restitution and friction of the four pairs."""

    def table(first: float, second: float, third: float) -> tuple[float, ...]:
        return first, second, third, p["cross"] * second * third / first

    return list(zip(table(*RESTITUTION), table(*FRICTION), strict=True))


def _times(p: Params) -> list[tuple[float, float]]:
    """Times [s] at which each ball hits the floor and the ceiling."""
    found = materials(p)
    return [(p["delay"], p["delay"] + GAP / (found[first][0] * p["fall"])) for first in (0, 2)]


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: both balls reach the floor after ``delay`` seconds, and the ceiling is a gap above it.

    Raises
    ------
    SceneError
        If an impact would grip instead of slip.
    """
    p, k = params, gyration(dimension)
    ceiling = Body("ceiling", HalfSpace(upward(dimension, -1.0), -(2.0 * RADIUS + GAP)), motion="fixed")
    bodies = [floor(dimension), ceiling]
    for name, lane in (("a", 0.0), ("b", LANE)):
        still = ball(name, dimension, p["mass"], RADIUS, 0.0)
        placed = at(still, dimension, along(dimension, lane, RADIUS + p["fall"] * p["delay"]))
        bodies.append(launched(placed, dimension, 0.0, p["v"], 0.0, -p["fall"]))
    found = materials(p)
    for low in (0, 2):
        v, w, up = p["v"], 0.0, p["fall"]
        for (e, mu), side in zip(found[low : low + 2], (1.0, -1.0), strict=True):
            slip = v - side * w * RADIUS
            if slip * k / (1.0 + k) <= mu * (1.0 + e) * up:
                raise SceneError(f"pair_matrix.v: {p['v']:g} is too slow, an impact would grip")
            v, w = struck(v, side * w, (1.0 + e) * up, mu, k, RADIUS, RADIUS)
            w, up = side * w, e * up
    pairs = [Pair(one, other, restitution=e, friction=mu) for (one, other), (e, mu) in zip(PAIRS, found, strict=True)]
    # The balls never touch; their pair gets values that keep a table of products possible.
    pairs.append(Pair("a", "b", restitution=0.5, friction=0.1))
    duration = max(last for _, last in _times(p)) + AFTERMATH
    return Scene("pair_matrix", 1, dimension, tuple(bodies), tuple(pairs), upward(dimension, 0.0), duration, p)


def exact(scene: Scene) -> dict[str, float]:
    """Each pair's own."""
    found = materials(scene.params)
    truth = {f"restitution[{n}]": e for n, (e, _) in enumerate(found, 1)}
    return truth | {f"friction[{n}]": mu for n, (_, mu) in enumerate(found, 1)}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Velocities before the floor, halfway between both impacts and some time after the second."""
    d, p = scene.dimension, scene.params
    restitution: dict[str, Measured] = {}
    friction: dict[str, Measured] = {}
    for k, (first, last) in enumerate(_times(p)):
        told = np.searchsorted(trajectory.t, (0.0, 0.5 * (first + last), last + 0.5 * AFTERMATH))
        velocity = trajectory.twist[np.minimum(told, len(trajectory.t) - 1), 2 + k][:, [0, d - 1]]
        for n, (before, after) in enumerate(((velocity[0], velocity[1]), (velocity[1], velocity[2])), 2 * k + 1):
            restitution[f"restitution[{n}]"], friction[f"friction[{n}]"] = _realised(before, after)
    return restitution | friction


def _realised(before: Array, after: Array) -> tuple[Measured, Measured]:
    """Restitution and friction of an impact, from velocities (along, up)."""
    across = abs(float(after[1] - before[1]))
    if not after[1] * before[1] <= 0.0 or across == 0.0:
        return (None, "it does not come back"), (None, "it does not come back")
    return (float(-after[1] / before[1]), ""), (float(before[0] - after[0]) / across, "")


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """One contact at a time and no external force: exact at every step, with slip for any lever arm."""
    p, found = scene.params, materials(scene.params)
    scales: dict[str, tuple[str, float]] = {}
    for n, (e, _) in enumerate(found, 1):
        # The ball reaches the ceiling with its speed after the floor.
        approach = p["fall"] * (found[n - 2][0] if n % 2 == 0 else 1.0)
        scales[f"restitution[{n}]"] = ("1", p["fall"] / approach)
        scales[f"friction[{n}]"] = ("1", p["v"] / ((1.0 + e) * approach))
    return bounds.exact_laws(scales, truth, "Newton's law of restitution and Coulomb's law of friction of each pair")


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Largest error of a pair's restitution or friction."""
    truth, off = exact(scene), []
    for name, value in truth.items():
        measured, reason = found[name]
        if measured is None:
            return None, reason
        off.append(abs(measured - value))
    return metrics.largest(off), ""


SCENE = CanonicalScene(
    name="pair_matrix",
    version=1,
    title="Two balls between two faces: four pairs of materials",
    symptoms=(
        "friction or restitution of two materials is combined wrongly",
        "how do the friction coefficients of two bodies combine",
        "which restitution holds when two bodies have different values",
        "is the friction of a pair the average, product, minimum or maximum",
        "the restitution of the floor counts although I set that of the ball",
        "setting friction on one body only has no effect",
        "a ball bounces only if both bodies have restitution",
        "elasticity of both shapes is multiplied",
        "rubber on ice and rubber on asphalt need different friction",
        "the combine mode of materials is ignored",
        "I cannot set friction for a pair of bodies",
        "a material property set on one geom is overridden by the other",
    ),
    family="materials",
    figure=__doc__ or "",
    law="each pair rebounds with its own e and slips with its own mu, independent of other pairs",
    dimensions=(2, 3),
    parameters=(
        Parameter(
            "cross", 1.0, "1", "values of the fourth pair over those of products of factors; 1: products", 0.1, 1.5
        ),
        Parameter("v", 6.0, "m/s", "along the floor; fast enough to slip", 0.0, 1e3, positive=True),
        Parameter("fall", 2.0, "m/s", "of the approach", 0.0, 1e2, positive=True),
        delay("the floor"),
        mass_of("each ball"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    standard=(Variation({}), Variation({"cross": 1.5})),
    full=tuple(Variation({"cross": c, "fall": f}) for c in (0.5, 1.0, 1.5) for f in (0.5, 2.0)),
    planted=({},),
    primary=Primary(
        "coefficient error",
        "1",
        f"largest error of a pair's e or mu of four pairs, over {PHASES} contact times within a step",
        "all other scenes rely on the materials of a pair",
        phases,
        error,
        "the whole scene: four impacts",
    ),
    words={
        "restitution": "a pair rebounds with e = {value}",
        "friction": "a pair slips with mu = {value}",
    },
)
