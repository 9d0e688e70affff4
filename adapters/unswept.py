"""A law that engines share: what is not swept passes where no step ends in it.

    | o ->   |#|   o   |        steps that end here and there: no overlap, no contact
    k        plate     k + 1

A method that looks for contact only where its steps end cannot see a body that is on one side of a thin one at the end
of a step and on the other side at the end of the next. Whether that happens follows from the scene and the step alone.
"""

from __future__ import annotations

import numpy as np

from adapters.law import Law, Measure, Prediction
from adapters.scene import Box, Disc, Scene, Sphere
from adapters.stepping import step_count
from adapters.trajectory import Trajectory

#: Round-off of a place after a thousand steps, relative to the way.
ROUND_OFF = 1e-12


def passing_law(metric: str, round_off: float = ROUND_OFF) -> Law:
    """A ball that flies straight at a fixed box in free space, and is never in it where a step ends: it flies on."""

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        if len(scene.bodies) != 2 or any(scene.gravity):
            return None
        plate, ball = scene.bodies
        if plate.motion != "fixed" or not isinstance(plate.shape, Box) or not isinstance(ball.shape, Disc | Sphere):
            return None
        if any(ball.twist[1:]):
            return None
        times = np.array([k * dt for k in range(step_count(scene.duration, dt) + 1)])
        x, reach = ball.pose[0] + ball.twist[0] * times, plate.shape.half_extents[0] + ball.shape.radius
        if (np.abs(x - plate.pose[0]) <= reach).any() or not (x[0] - plate.pose[0]) * (x[-1] - plate.pose[0]) < 0.0:
            return None
        pose = np.array([[body.pose for body in scene.bodies]] * len(times))
        pose[:, 1, 0] = x
        twist = np.array([[body.twist for body in scene.bodies]] * len(times))
        value = measure(scene, Trajectory(times, pose, twist, None, dt, "completed"))[metric][0]
        return None if value is None else (value, round_off * (1.0 + abs(ball.twist[0]) * scene.duration))

    return law
