"""MuJoCo's laws of a box on a half-space, asked of one on a plate."""

from __future__ import annotations

import math
from dataclasses import replace

from adapters.law import Law, Measure, Prediction
from adapters.scene import Body, Box, HalfSpace, Pair, Scene


def on_a_plate(law: Law, metric: str) -> Law:
    """The law of a box on a half-space, asked of one on a level plate: the engine makes the same contacts of both.

    Wherever the plate is: what is told of the box is told from there. But gaps are differences of places, known to the
    last place of a number of their size; taken out within a step that is a speed, which the run turns into a way, and
    a mean over a third of it into an acceleration at both its ends.
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
    """The scene with a half-space at level 0 in the place of its plate; None if it has something else there."""
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
