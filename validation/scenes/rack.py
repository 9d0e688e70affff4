r"""A ball breaks a rack: momentum, energy and mirror symmetry are conserved by every impact law.

                  o
               o  o         sum of m v:       that of the cue, at all times
     cue o --> o  o  o      sum of m v^2/2:   that of the cue, e = 1
               o  o         left and right:   (vx, vy) of a ball is (vx, -vy) of its image
                  o

Impacts within a step, or of touching balls, have no unique law (Newton's law for all contacts at once, or one pair
after the other), so no speed is judged. But all laws are symmetric: an engine that solves contact after contact,
without convergence, shows its order here. Balls are smooth and do not rotate.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from adapters.engine import Array
from adapters.scene import Pair, Scene
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Variation
from validation.scenes.parts import PHASES, along, at, ball, delay, mass_of, phases, states

RADIUS = 0.5
#: Runs for this long after the first contact [s]: softest engine compared keeps contact for about 0.05 s.
AFTERMATH = 0.35


def _rack(rows: int) -> list[tuple[int, int]]:
    """Row, and place across it in radii (0 is the middle), of each ball of the rack."""
    return [(row, 2 * k - row) for row in range(rows) for k in range(row + 1)]


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the cue meets the first ball of the rack, which lies at the origin, after ``delay`` seconds."""
    p = params
    pitch = (2.0 + p["apart"]) * RADIUS
    cue = at(
        ball("cue", dimension, p["mass"], RADIUS, 0.0),
        dimension,
        along(dimension, -2.0 * RADIUS - p["v"] * p["delay"]),
        along(dimension, p["v"]),
    )
    rack = [
        at(
            ball(f"ball{k}", dimension, p["mass"], RADIUS, 0.0),
            dimension,
            along(dimension, 0.5 * math.sqrt(3.0) * pitch * row, 0.5 * pitch * across),
        )
        for k, (row, across) in enumerate(_rack(int(p["rows"])), 1)
    ]
    pairs = (Pair(restitution=1.0, friction=0.0),)
    duration = p["delay"] + AFTERMATH
    return Scene("rack", 1, dimension, (cue, *rack), pairs, (0.0,) * dimension, duration, p)


def exact(scene: Scene) -> dict[str, float]:
    """Conservation laws of every impact law at e = 1."""
    return {"momentum_defect": 0.0, "energy_defect": 0.0, "asymmetry": 0.0, "penetration": 0.0}


def _images(scene: Scene) -> list[int]:
    """Index of each ball's image; the cue's and those of the middle are their own."""
    places = _rack(int(scene.params["rows"]))
    return [0, *(1 + places.index((row, -across)) for row, across in places)]


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Momentum and energy at the end; the largest difference of a ball's velocity from its image's; deepest overlap."""
    v, d = scene.params["v"], scene.dimension
    last = trajectory.twist[-1, :, :d]
    start = np.array(along(d, v))
    mirror: Array = last[_images(scene)] * np.array([*(1.0,) * (d - 1), -1.0])
    pairs = [(i, j) for i, j, _ in scene.contact_pairs()]
    return {
        "momentum_defect": (float(np.linalg.norm(last.sum(axis=0) - start)) / v, ""),
        "energy_defect": (abs(float((last**2).sum()) / v**2 - 1.0), ""),
        "asymmetry": (float(np.linalg.norm(last - mirror, axis=1).max()) / v, ""),
        "penetration": (metrics.deepest_overlap(scene, trajectory, pairs), ""),
    }


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """Conservation holds at every step; an impact may be found one step late, at most sqrt(2) v dt deep by energy."""
    v, n = scene.params["v"], len(scene.bodies)
    place = RADIUS * 2.0 * scene.params["rows"]
    # Two balls with all the energy, m v^2/2, approach by at most sqrt(2) v.
    late = bounds.Bound(
        math.sqrt(2.0) * v * dt + bounds.ROUND_OFF * place,
        "an impact is found up to one step late; by energy no two balls approach faster than sqrt(2) v",
    )
    return [
        bounds.bookkeeping(n).check("momentum_defect", "1", truth["momentum_defect"], "conservation of momentum"),
        bounds.exact(n).check("energy_defect", "1", truth["energy_defect"], "e = 1: conservation of energy"),
        bounds.exact(n).check("asymmetry", "1", truth["asymmetry"], "the laws of mechanics are symmetric"),
        late.check("penetration", "m", truth["penetration"], "rigid bodies"),
    ]


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Larger of the relative errors of energy and symmetry."""
    off = []
    for metric in ("energy_defect", "asymmetry"):
        value, reason = found[metric]
        if value is None:
            return None, reason
        off.append(value)
    return metrics.largest(off), ""


SCENE = CanonicalScene(
    name="rack",
    family="many impacts",
    version=1,
    title="Break of a rack",
    symptoms=(
        "the break of a billiard rack is not symmetric",
        "balls of a pool rack scatter unevenly",
        "a symmetric scene loses its symmetry",
        "a pool break loses energy or momentum",
        "a triangle of touching balls hit by the cue ball spreads wrongly",
        "mirror images do not stay mirror images",
        "fifteen balls at once: the collision is not elastic",
        "snooker reds do not spread the same on both sides",
    ),
    figure=__doc__ or "",
    law="momentum, energy and mirror symmetry are conserved at e = 1",
    dimensions=(2,),
    parameters=(
        Parameter("rows", 4, "1", "of the rack: 10 balls", 1, 20, integer=True),
        Parameter("apart", 1e-3, "radii", "gap between neighbours, as racks have: half a millimetre here", 0.0, 1.0),
        Parameter("v", 2.0, "m/s", "of the cue", 0.0, 1e2, positive=True),
        delay("the first contact"),
        mass_of("each ball"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    quick=(Variation({}),),
    full=tuple(Variation({"rows": float(rows), "apart": apart}) for rows in (2, 4, 6) for apart in (1e-3, 0.05)),
    planted=({},),
    primary=Primary(
        "defect",
        "1",
        f"larger of the relative errors of energy and mirror symmetry, over {PHASES} phases of the first contact",
        "every impact law conserves them",
        phases,
        error,
        "the whole scene: approach, break, departure",
    ),
    words={
        "momentum_defect": "changes the momentum by {value} (relative)",
        "energy_defect": "changes the energy by {value} (relative)",
        "asymmetry": "makes left and right differ by {value} of the cue's speed",
    },
)
