"""A law: a leaning box that lands on one corner, with friction, pressed halfway between that corner and the floor.

The corner is found at the first step at which it overlaps, by ``depth``, and the blow acts ``depth/2`` above it.
Newton's law of restitution and Coulomb's law of friction hold at that point, whose arm is shorter by half the depth.
Nothing is said with a skin, and where the corner comes to the floor just at a step.
"""

from __future__ import annotations

import math

import numpy as np

from adapters.engine import Array
from adapters.law import Law, Measure, Prediction
from adapters.scene import Box, HalfSpace, Scene
from adapters.single_motions import Chosen, lowest
from adapters.single_precision import ROUNDINGS, UNIT
from adapters.stepping import step_count
from adapters.trajectory import Trajectory


def halfway_law(metric: str, chosen: Chosen, threshold: float) -> Law:
    """What a blow halfway into the overlap makes of ``metric``.

    Parameters
    ----------
    metric, chosen
        What is predicted, and the unit and skin of a profile.
    threshold
        Approach up to which nothing rebounds [length/s].
    """

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        units, skin = chosen(scene, dt)
        if skin > 0.0 or not _lands(scene):
            return None
        floor, box = scene.bodies
        material = scene.material(floor.name, box.name)
        vx, vy, _ = box.twist
        e = material.restitution if -vy * units > threshold else 0.0
        lever, below = lowest(box)
        steps = (box.pose[1] - below) / (-vy * dt)
        if abs(steps - round(steps)) < ROUNDINGS * UNIT * max(1.0, steps) * step_count(scene.duration, dt):
            return None
        depth = (math.ceil(steps) - steps) * -vy * dt
        share = ROUNDINGS * UNIT
        found: list[float] = []
        for arm, press in ((1.0, 1.0), (1.0 + share, 1.0), (1.0, 1.0 + share)):
            assert isinstance(box.inertia, float | int)
            across, down = arm * lever, below - 0.5 * depth * arm
            blow = _blow(box.mass, float(box.inertia), (across, down), (vx, vy), e, material.friction)
            if blow is None:
                return None
            value = measure(scene, _struck(scene, dt, math.ceil(steps), press * blow, (across, down)))[metric][0]
            if value is None:
                return None
            found.append(value)
        value, *others = found
        # Each of the two is both bodies' and both axes' roundings; a number itself is rounded once more.
        return value, 2.0 * sum(abs(other - value) for other in others) + share * (1.0 + abs(value))

    return law


def _lands(scene: Scene) -> bool:
    if len(scene.bodies) != 2 or scene.dimension != 2 or any(scene.gravity):
        return False
    floor, box = scene.bodies
    if not isinstance(box.shape, Box) or box.motion != "free" or any((*box.force, *box.torque)):
        return False
    on_the_floor = floor.shape == HalfSpace((0.0, 1.0), 0.0) and floor.motion == "fixed"
    tilted = abs(math.remainder(box.pose[2], 0.5 * math.pi)) > 1e-3
    return on_the_floor and tilted and box.twist[2] == 0.0 and box.twist[1] < 0.0


def _blow(
    mass: float, inertia: float, arm: tuple[float, float], speed: tuple[float, float], e: float, mu: float
) -> Array | None:
    """Impulse along the floor and upwards [N s]: the point sticks or, beyond the cone, slips; None if neither fits."""
    across, below = arm
    # Velocity of the point (along, up) over an impulse there.
    mobility = np.array(
        [
            [1.0 / mass + below * below / inertia, across * below / inertia],
            [across * below / inertia, 1.0 / mass + across * across / inertia],
        ]
    )
    wanted = np.array([-speed[0], -(1.0 + e) * speed[1]])
    sticks: Array = np.linalg.solve(mobility, wanted)
    if sticks[1] > 0.0 and abs(sticks[0]) <= mu * sticks[1]:
        return sticks
    for way in (1.0, -1.0):
        press = wanted[1] / (mobility[1, 1] - way * mu * mobility[1, 0])
        slips: Array = np.array([-way * mu * press, press])
        if press > 0.0 and way * (speed[0] + mobility[0] @ slips) > 0.0:
            return slips
    return None


def _struck(scene: Scene, dt: float, hit: int, blow: Array, arm: tuple[float, float]) -> Trajectory:
    """The motion at every step: down and along, the blow in the step after ``hit``, and away."""
    box = scene.bodies[1]
    assert isinstance(box.inertia, float | int)
    t = np.arange(step_count(scene.duration, dt) + 1, dtype=np.float64) * dt
    after: Array = (np.arange(len(t)) > hit).astype(float)
    change = np.array([*(blow / box.mass), (arm[0] * blow[1] + arm[1] * blow[0]) / box.inertia])
    pose = np.broadcast_to(np.array([body.pose for body in scene.bodies]), (len(t), 2, 3)).copy()
    twist = np.broadcast_to(np.array([body.twist for body in scene.bodies]), (len(t), 2, 3)).copy()
    twist[:, 1] += after[:, None] * change
    pose[:, 1] += np.array(box.twist) * t[:, None] + (after * (t - hit * dt))[:, None] * change
    return Trajectory(t, pose, twist, None, dt, "completed")
