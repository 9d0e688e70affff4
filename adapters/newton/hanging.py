"""A box too far away for single precision: it does not move, but its speed grows as in a fall.

XPBD corrects overlaps and slips of places only. If the motion in a step is below half the spacing of single precision,
a place never changes; a touching box has no overlap, so no contact brakes or supports it.
"""

from __future__ import annotations

import numpy as np

from adapters.law import Law, Measure, Prediction
from adapters.law.single_precision import UNIT
from adapters.scene import Box, Scene
from adapters.stepping import step_count
from adapters.trajectory import Trajectory


def hanging_law(metric: str) -> Law:
    """A box on a fixed plate whose place never changes; no prediction otherwise.

    The band is the round-off of sums of as many speeds in single precision, half a unit of the last place each.
    """

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        if len(scene.bodies) != 2 or not all(isinstance(body.shape, Box) for body in scene.bodies):
            return None
        plate, box = scene.bodies
        axes = scene.dimension
        steps = step_count(scene.duration, dt)
        pull = np.array(scene.gravity[:axes]) + np.array(box.force[:axes]) / box.mass
        start, fastest = np.array(box.twist[:axes]), np.abs(box.twist[:axes]) + np.abs(pull) * steps * dt
        single = np.array(box.pose[:axes], np.float32)
        below = np.abs(np.nextafter(single, np.float32(0.0)) - single)  # the smaller of the two neighbouring spacings
        turns = any(box.twist[axes:]) or any(np.atleast_1d(box.torque))
        if plate.motion != "fixed" or turns or not (fastest * dt < 0.5 * below).all() or _overlaps(scene):
            return None
        pose = np.repeat(np.array([[body.pose for body in scene.bodies]], float), steps + 1, axis=0)
        twist = np.zeros((steps + 1, 2, len(box.twist)))
        times = np.arange(steps + 1, dtype=np.float64) * dt
        twist[:, 1, :axes] = start + times[:, None] * pull
        motion = Trajectory(times, pose, twist, None, dt, "completed")
        value = measure(scene, motion)[metric][0]
        return None if value is None else (value, steps * UNIT * float(np.linalg.norm(fastest)))

    return law


def _overlaps(scene: Scene) -> bool:
    """Whether the box is below the plate's face in single precision."""
    plate, box = scene.bodies
    assert isinstance(plate.shape, Box) and isinstance(box.shape, Box)
    up = scene.dimension - 1
    face = np.float32(plate.pose[up]) + np.float32(plate.shape.half_extents[-1])
    return bool(np.float32(box.pose[up]) - np.float32(box.shape.half_extents[-1]) < face)
