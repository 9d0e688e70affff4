r"""A tilted box lands on an edge, in free space: a blow beside its centre.

          /\
         /  \           J = m (1 + e) v/(1 + l^2/i^2)    l: edge to the side of the centre,
        / .  \  | v     v' = J/m - v,  w' = l J/I        i: radius of gyration
        \    /  v
    =====\/===========  in space both corners of the edge hit at once, and must do so alike: no twist
          |<>| l

Only the blow acts. Half of it goes into spin, so the rebound speed is not e times the approach; corners that share it
unequally turn the box about the other axes as well.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from adapters.scene import Pair, Scene, SceneError
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Variation
from validation.scenes.parts import PHASES, block, delay, floor, mass_of, phases, states_and_impulses, tilted, upward
from validation.truths.corners import AFTERMATH, landing_corner, lands_again

HEIGHT = 1.0


def _corner(p: Params) -> tuple[float, float]:
    """The lower edge relative to the centre: along the floor (towards +x), and below it [m]."""
    return landing_corner(p["aspect"] * HEIGHT, HEIGHT, math.radians(p["tilt"]))


def _after(p: Params) -> tuple[float, float, float]:
    """Impulse over the mass [m/s], upward speed [m/s] and spin [rad/s], back towards level, after the blow."""
    lever, _ = _corner(p)
    square = HEIGHT**2 * (1.0 + p["aspect"] ** 2) / 12.0
    blow = (1.0 + p["e"]) * p["v"] / (1.0 + lever**2 / square)
    return blow, blow - p["v"], blow * lever / square


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the box is turned clockwise and lands on its right lower edge after ``delay`` seconds.

    Raises
    ------
    SceneError
        If another corner would land within the run.
    """
    p = params
    _, below = _corner(p)
    box = tilted(
        block("box", dimension, p["mass"], p["aspect"] * HEIGHT, HEIGHT),
        dimension,
        (0.0, below + p["v"] * p["delay"]),
        -math.radians(p["tilt"]),
    )
    down = (*(0.0,) * (dimension - 1), -p["v"], *(0.0,) * (1 if dimension == 2 else 3))
    pairs = (Pair(restitution=p["e"], friction=0.0),)
    _, rise, spin = _after(p)
    if lands_again(p["aspect"] * HEIGHT, HEIGHT, math.radians(p["tilt"]), rise, spin):
        raise SceneError(f"edge_drop.tilt: at {p['tilt']:g} degrees another edge lands within {AFTERMATH:g} s")
    gravity, duration = upward(dimension, 0.0), p["delay"] + AFTERMATH
    return Scene("edge_drop", 1, dimension, (floor(dimension), replace(box, twist=down)), pairs, gravity, duration, p)


def exact(scene: Scene) -> dict[str, float]:
    """Newton's law at the edge; linear and angular momentum."""
    p = scene.params
    blow, rise, spin = _after(p)
    truth = {"rise": rise, "spin": spin, "impulse": p["mass"] * blow, "sideways": 0.0}
    return truth | ({} if scene.dimension == 2 else {"twisted": 0.0})


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Velocities at the end."""
    d, last = scene.dimension, trajectory.twist[-1, 1]
    impulse = metrics.total_impulse(trajectory, 0, 1)
    measured: dict[str, Measured] = {
        "rise": (float(last[d - 1]), ""),
        "spin": (float(metrics.tilt_rate(trajectory)[-1]), ""),
        "impulse": (None, impulse[1]) if impulse[0] is None else (float(impulse[0][-1]), ""),
        "sideways": (float(np.linalg.norm(last[: d - 1])), ""),
    }
    if d == 3:
        measured["twisted"] = (float(np.linalg.norm(last[[3, 5]])), "")
    return measured


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """The box does not rotate before the blow, so its lever arm does not depend on when it is found."""
    p = scene.params
    source = "Newton's law of restitution at the edge; balance of momentum and angular momentum"
    turning = p["v"] / HEIGHT
    scales = {
        "rise": ("m/s", p["v"]),
        "spin": ("rad/s", 12.0 * turning),
        "impulse": ("N s", p["mass"] * p["v"]),
        "sideways": ("m/s", p["v"]),
        "twisted": ("rad/s", 12.0 * turning),
    }
    return bounds.exact_laws({name: scales[name] for name in truth}, truth, source)


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Larger of the errors of the speed of rise, over the approach, and of the spin, over itself."""
    truth, rise, spin = exact(scene), found["rise"], found["spin"]
    if rise[0] is None or spin[0] is None:
        return None, rise[1] or spin[1]
    off = [abs(rise[0] - truth["rise"]) / scene.params["v"], abs(spin[0] / truth["spin"] - 1.0)]
    return metrics.largest(off), ""


SCENE = CanonicalScene(
    name="edge_drop",
    family="hard",
    version=1,
    title="Tilted box that lands on an edge",
    symptoms=(
        "a box that lands on its edge sinks in or hops",
        "a cube dropped on its corner spins the wrong way",
        "a tilted box bounces strangely when one edge hits first",
        "a die thrown on a table lands and rotates wrongly",
        "a falling plank that hits with one end first turns too fast",
        "the corner of a box goes through the floor at landing",
        "a dice roll gains energy on its edges",
        "a box landing on an edge in 3-D twists about the vertical",
        "an oblique landing of a cuboid gives no rotation",
    ),
    figure=__doc__ or "",
    law="J = m (1 + e) v/(1 + l^2/i^2),  v' = J/m - v,  w' = l J/I, no twist",
    dimensions=(2, 3),
    parameters=(
        Parameter("e", 0.5, "1", "coefficient of restitution of the pair", 0.0, 1.0),
        Parameter("tilt", 20.0, "degrees", "of the box at the start", 1.0, 44.0),
        Parameter("aspect", 1.0, "1", "width over height of the box", 0.1, 10.0),
        Parameter("v", 1.0, "m/s", "approach speed", 0.0, 1e3, positive=True),
        delay(),
        mass_of("the box"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states_and_impulses,
    quick=(Variation({}, dimensions=(3,)), Variation({"e": 1.0, "tilt": 30.0})),
    full=tuple(Variation({"e": e, "tilt": t}) for e in (0.5, 0.8, 1.0) for t in (20.0, 30.0, 40.0)),
    planted=({},),
    primary=Primary(
        "blow error",
        "1",
        f"larger of the errors of rise and spin, relative, over {PHASES} contact times within a step",
        "the scene is how a blow is divided between speed and spin",
        phases,
        error,
        "the whole scene: approach, contact, departure",
    ),
    words={
        "rise": "rises with {value}",
        "rise<0": "falls with {value}",
        "spin": "spins with {value}",
        "sideways": "leaves sideways with {value}",
        "twisted": "twists with {value}",
    },
)
