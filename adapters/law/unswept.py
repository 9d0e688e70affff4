"""A law that engines share: what is not swept passes where no step ends in it.

    | o ->   |#|   o   |        steps that end here and there: no overlap, no contact
    k        plate     k + 1

A method that looks for contact only where its steps end cannot see a body that is on one side of a thin one at the end
of a step and on the other side at the end of the next. Whether that happens follows from the scene and the step alone.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from adapters.engine import Array
from adapters.law import Law, Measure, Prediction
from adapters.scene import Body, Box, Disc, Scene, Sphere
from adapters.stepping import step_count
from adapters.trajectory import Trajectory

#: Round-off of a place after a thousand steps, relative to the way.
ROUND_OFF = 1e-12
#: ``push(scene, dt, overlap)``: speed besides the velocity with which an engine pushes out [m/s].
Push = Callable[[Scene, float, float], float]


def at_plate(scene: Scene) -> tuple[Body, Body, float] | None:
    """Plate, ball and the distance of their centres at which they touch [m], of a ball straight at a fixed box.

    None for any other scene, and where something else than the plate could act on the ball.
    """
    if len(scene.bodies) != 2 or any(scene.gravity):
        return None
    plate, ball = scene.bodies
    if plate.motion != "fixed" or not isinstance(plate.shape, Box) or not isinstance(ball.shape, Disc | Sphere):
        return None
    if any(ball.twist[1:]):
        return None
    return plate, ball, plate.shape.half_extents[0] + ball.shape.radius


def flown(scene: Scene, x: Array, dt: float) -> Trajectory:
    """Trajectory of a ball (the second body) that keeps its velocity, at ``x`` (steps + 1,) along its way [m]."""
    pose = np.array([[body.pose for body in scene.bodies]] * len(x))
    pose[:, 1, 0] = x
    twist = np.array([[body.twist for body in scene.bodies]] * len(x))
    return Trajectory(np.arange(len(x), dtype=np.float64) * dt, pose, twist, None, dt, "completed")


def passing_law(metric: str, round_off: float = ROUND_OFF) -> Law:
    """A ball that flies straight at a fixed box in free space, and is never in it where a step ends: it flies on."""

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        posed = at_plate(scene)
        if posed is None:
            return None
        plate, ball, reach = posed
        x = ball.pose[0] + ball.twist[0] * (dt * np.arange(step_count(scene.duration, dt) + 1, dtype=np.float64))
        if (np.abs(x - plate.pose[0]) <= reach).any() or not (x[0] - plate.pose[0]) * (x[-1] - plate.pose[0]) < 0.0:
            return None
        value = measure(scene, flown(scene, x, dt))[metric][0]
        return None if value is None else (value, round_off * (1.0 + abs(ball.twist[0]) * scene.duration))

    return law


def wall_law(passing: Law, blow: Law) -> Law:
    """A ball that no step finds in a thin wall passes it; otherwise it rebounds as in any other blow."""

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        passed = passing(scene, dt, measure)
        return blow(scene, dt, measure) if passed is None else passed

    return law


def shoved_law(metric: str, push: Push | None = None) -> Law:
    """A ball that is first found in a plate beyond its middle is pushed out on the far side, and keeps its velocity.

    The nearest way out points forward there, and the ball already moves that way, so that no impulse acts.

    Parameters
    ----------
    push
        Of an engine that pushes out besides the velocity: speed [m/s] of the step after one that ended ``overlap``
        deep [m]; none by default.
    """

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        posed = at_plate(scene)
        if posed is None:
            return None
        plate, ball, reach = posed
        v = ball.twist[0]
        way = 1.0 if v > 0.0 else -1.0
        x, out, found = [ball.pose[0]], 0.0, False
        for _ in range(step_count(scene.duration, dt)):
            x.append(x[-1] + (v + way * out) * dt)
            beyond = way * (x[-1] - plate.pose[0])
            overlap = reach - abs(beyond)
            if overlap > 0.0 and beyond <= ROUND_OFF * reach:  # at the very middle round-off decides on the side
                return None
            found = found or overlap > 0.0
            out = push(scene, dt, overlap) if push and overlap > 0.0 else 0.0
        value = measure(scene, flown(scene, np.array(x), dt))[metric][0] if found else None
        return None if value is None else (value, ROUND_OFF * (1.0 + abs(v) * scene.duration))

    return law
