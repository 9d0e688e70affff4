"""MuJoCo's laws of a box on a half-space, for a box on a plate."""

from __future__ import annotations

import math
from dataclasses import replace

from adapters.law import Law, Measure, Prediction
from adapters.scene import Body, Box, HalfSpace, Pair, Scene


def on_a_plate(law: Law, metric: str) -> Law:
    """The law of a box on a half-space, for a box on a level plate, which has the same contacts.

    The place of the plate does not matter to relative values, except that gaps are differences of coordinates with
    their rounding; corrected within a step that is a speed, which over the run is a distance, and in a mean over a
    third of it an acceleration error at both ends.
    """

    def same(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        flat = _flat(scene)
        predicted = None if flat is None else law(flat, dt, measure)
        if predicted is None:
            return None
        far = max(abs(x) for body in scene.bodies for x in body.pose[: scene.dimension])
        speed = math.ulp(far) / dt
        return predicted[0], predicted[1] + speed * (6.0 / scene.duration if metric == "braking" else scene.duration)

    return same


def _flat(scene: Scene) -> Scene | None:
    """The scene with a half-space at level 0 instead of its plate; None if it has no plate."""
    if len(scene.bodies) != 2:
        return None
    (plate, box), d = scene.bodies, scene.dimension
    if not isinstance(plate.shape, Box) or plate.motion != "fixed" or plate.pose[d:] != box.pose[d:]:
        return None
    ground = Body("ground", HalfSpace((*(0.0,) * (d - 1), 1.0), 0.0), motion="fixed")
    level = (x - y for x, y in zip(box.pose[: d - 1], plate.pose[: d - 1], strict=True))
    height = box.pose[d - 1] - plate.pose[d - 1] - plate.shape.half_extents[-1]
    pair = Pair(ground.name, box.name, 0.0, scene.material(plate.name, box.name).friction)
    return replace(scene, bodies=(ground, replace(box, pose=(*level, height, *box.pose[d:]))), pairs=(pair,))
