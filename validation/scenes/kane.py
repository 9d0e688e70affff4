r"""A leaning rod lands on its sliding lower end: an impact law that adds energy.

            //          velocity of the end:  u+ = u- + W p,  normal and tangent coupled by its arm
           //           Newton:   u_n+ = -e u_n-
       v  //            Coulomb:  the end sticks, u_t+ = 0, if |p_t| <= mu p_n then; else |p_t| = mu p_n against u_t+
       | //  --> u_t    energy:   T+ - T- = p . (u+ + u-)/2,  which the law does not keep from being positive
    ====/===========

[T. R. Kane, D. A. Levinson, Dynamics: Theory and Applications, McGraw-Hill 1985: a pendulum that gains energy so.]
Newton's coefficient determines the normal speed only; the work of friction does not enter. An engine with this e and mu
has to show the gain; one that does not has another impact law, which must be declared.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from adapters.engine import Array
from adapters.scene import Pair, Scene, SceneError
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Variation
from validation.scenes.parts import PHASES, block, delay, floor, mass_of, phases, states, tilted, upward
from validation.truths.corners import AFTERMATH, landing_corner, lands_again

LENGTH = 1.0


def _corner(p: Params) -> tuple[float, float]:
    """The landing end relative to the centre: along the floor (towards +x), and below it [m]."""
    return landing_corner(p["aspect"] * LENGTH, LENGTH, math.radians(90.0 - p["lean"]))


def _gyration(p: Params) -> float:
    """Square of the rod's radius of gyration [m^2]."""
    return LENGTH**2 * (1.0 + p["aspect"] ** 2) / 12.0


def _mobility(p: Params) -> Array:
    """Velocity of the end (normal, tangent) over an impulse there, times the mass, (2, 2)."""
    x, y = _corner(p)
    square = _gyration(p)
    return np.array([[1.0 + x * x / square, x * y / square], [x * y / square, 1.0 + y * y / square]])


def answers(mobility: Array, approach: Array, e: float, mu: float) -> list[Array]:
    """All impulses over the mass (normal, tangent) [m/s] that satisfy Newton's and Coulomb's laws at one contact.

    ``approach``: velocity of the contact before, (normal < 0, tangent) [m/s].
    """
    normal, tangent = approach
    found = []
    sticking = np.linalg.solve(mobility, [-(1.0 + e) * normal, -tangent])
    if sticking[0] > 0.0 and abs(sticking[1]) <= mu * sticking[0]:
        found.append(sticking)
    for way in (1.0, -1.0):
        ease = mobility[0, 0] - way * mu * mobility[0, 1]
        if ease <= 0.0:
            continue
        press = -(1.0 + e) * normal / ease
        slipping = np.array([press, -way * mu * press])
        if way * (tangent + mobility[1] @ slipping) > 0.0:
            found.append(slipping)
    return found


def _blow(p: Params) -> Array:
    """Impulse over the mass (normal, tangent) [m/s].

    Raises
    ------
    SceneError
        Where the law has no solution, or several.
    """
    found = answers(_mobility(p), np.array([-p["v"], p["along"] * p["v"]]), p["e"], p["mu"])
    if len(found) != 1:
        raise SceneError(f"kane.mu: at {p['mu']:g} the law has {len(found)} solutions, the scene needs one")
    return found[0]


def _after(p: Params) -> tuple[float, float, float]:
    """Speeds along the floor and upwards [m/s], and spin [rad/s] counter-clockwise, after the blow."""
    x, y = _corner(p)
    normal, tangent = _blow(p)
    return p["along"] * p["v"] + tangent, normal - p["v"], (x * normal + y * tangent) / _gyration(p)


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the rod moves down and along without turning; its lower end lands after ``delay`` seconds.

    Raises
    ------
    SceneError
        If the law has no unique solution, or the other end would land within the run.
    """
    p = params
    _, below = _corner(p)
    width, tilt = p["aspect"] * LENGTH, math.radians(90.0 - p["lean"])
    rod = tilted(
        block("rod", dimension, p["mass"], width, LENGTH), dimension, (0.0, below + p["v"] * p["delay"]), -tilt
    )
    _, rise, spin = _after(p)
    if lands_again(width, LENGTH, tilt, rise, spin):
        raise SceneError(f"kane.lean: at {p['lean']:g} degrees the other end lands within {AFTERMATH:g} s")
    rod = replace(rod, twist=(p["along"] * p["v"], *(0.0,) * (dimension - 2), -p["v"], *(0.0,) * (2 * dimension - 3)))
    pairs = (Pair(restitution=p["e"], friction=p["mu"]),)
    gravity, duration = upward(dimension, 0.0), p["delay"] + AFTERMATH
    return Scene("kane", 1, dimension, (floor(dimension), rod), pairs, gravity, duration, p)


def exact(scene: Scene) -> dict[str, float]:
    """Newton's and Coulomb's laws at one contact, and the resulting energy."""
    p = scene.params
    ahead, rise, spin = _after(p)
    return {"rise": rise, "ahead": ahead, "spin": spin, "gain": _gain(p, ahead, rise, spin)}


def _gain(p: Params, ahead: float, rise: float, spin: float) -> float:
    """Energy after minus energy before, over that of the approach."""
    before = p["v"] ** 2 * (1.0 + p["along"] ** 2)
    return (ahead**2 + rise**2 + _gyration(p) * spin**2 - before) / p["v"] ** 2


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Velocities at the end, and their energy."""
    d, last = scene.dimension, trajectory.twist[-1, 1]
    ahead, rise = float(last[0]), float(last[d - 1])
    spin = float(metrics.tilt_rate(trajectory)[-1])
    return {
        "rise": (rise, ""),
        "ahead": (ahead, ""),
        "spin": (spin, ""),
        "gain": (_gain(scene.params, ahead, rise, spin), ""),
    }


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """The rod does not rotate before the blow, so its lever arm does not depend on when it is found."""
    v = scene.params["v"]
    source = "Newton's law of restitution and Coulomb's of friction at one contact"
    turning = 12.0 * v / LENGTH
    size = 1.0 + scene.params["along"] ** 2
    scales = {
        "rise": ("m/s", size * v),
        "ahead": ("m/s", size * v),
        "spin": ("rad/s", size * turning),
        "gain": ("1", 4.0 * size),
    }
    return bounds.exact_laws(scales, truth, source)


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Largest error of a speed of an end, over the approach."""
    truth, arm = exact(scene), {"rise": 1.0, "ahead": 1.0, "spin": 0.5 * LENGTH}
    off = []
    for name, length in arm.items():
        value, reason = found[name]
        if value is None:
            return None, reason
        off.append(length * abs(value - truth[name]))
    return metrics.largest(off) / scene.params["v"], ""


SCENE = CanonicalScene(
    name="kane",
    family="hard",
    version=1,
    title="Sliding rod that gains energy by landing",
    symptoms=(
        "a sliding rod gains energy by landing",
        "a rod that hits the floor with friction and restitution speeds up",
        "a stick that lands while it slides has more energy afterwards",
        "friction during a collision creates energy",
        "a double pendulum that strikes the floor gains energy",
        "a bouncing bar with friction never stops and goes faster",
        "impact with friction violates conservation of energy",
        "Newton's restitution law with friction adds energy",
    ),
    figure=__doc__ or "",
    law="u_n+ = -e u_n-, and the end sticks or slips by Coulomb's law; T+ - T- = p (u+ + u-)/2, whatever its sign",
    dimensions=(2,),
    parameters=(
        Parameter("e", 0.9988, "1", "coefficient of restitution; near 1, so that little else is lost", 0.0, 1.0),
        Parameter("mu", 0.883, "1", "friction: stops the end from a slide in either direction", 0.0, 10.0),
        Parameter(
            "lean", 56.4, "degrees", "angle of the rod to the floor; near the strongest coupling in a blow", 30.0, 80.0
        ),
        Parameter(
            "along",
            0.727,
            "1",
            "speed of the end along the floor over the approach; > 0: towards its centre",
            -5.0,
            5.0,
        ),
        Parameter("aspect", 0.05, "1", "thickness over length of the rod", 0.0, 0.5, positive=True),
        Parameter("v", 1.0, "m/s", "approach speed", 0.0, 1e3, positive=True),
        delay(),
        mass_of("the rod"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    quick=(Variation({}), Variation({"mu": 0.1, "e": 0.5})),
    full=tuple(Variation({"along": s, "mu": mu}) for s in (-0.727, 0.727, 1.5) for mu in (0.05, 0.1, 0.883)),
    planted=({}, {"mu": 0.1, "e": 0.5}),
    primary=Primary(
        "blow error",
        "1",
        f"largest error of the speeds of rise, along the floor and of an end by spin, over the approach, over {PHASES} "
        "contact times within a step",
        "the scene is how normal and friction impulse share a blow",
        phases,
        error,
        "the whole scene: approach, contact, departure",
    ),
    words={
        "rise": "rises with {value}",
        "rise<0": "falls with {value}",
        "ahead": "moves along the floor with {value}",
        "ahead<0": "moves back along the floor with {value}",
        "spin": "spins with {value}",
        "gain": "gains {value} of the energy of its approach",
        "gain<0": "loses {value} of the energy of its approach",
    },
)
