"""A ball that lands on a floor and keeps slipping, in free space, with the blow as in DART.

    j = m (1 + e) v                         reduced by the compliance of a contact
    pyramid   each axis of the floor by itself: mu j against its own share of the slip
    cone      mu j against the slip

There is no prediction where friction stops the slip, along an axis of a pyramid or entirely. The contact point lies in
the floor by up to a step of the ball's fall: the spin from friction is known within that.
"""

from __future__ import annotations

import numpy as np

from adapters.dart.profiles import PYRAMIDS, solved
from adapters.dart.rubbing import ended
from adapters.dart.shipped import THRESHOLD, restitution
from adapters.engine import Array
from adapters.law import Law, Measure, Prediction
from adapters.scene import HalfSpace, Scene, Sphere
from adapters.scene.lift import lift


def slipping_law(metric: str, profile: str) -> Law:
    """``metric`` after the blow, with the profile's own friction."""

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        spatial = scene if scene.dimension == 3 else lift(scene)
        found = []
        for late in (0.0, dt):
            after = _after(spatial, late, profile in PYRAMIDS)
            value = None if after is None else measure(scene, ended(scene, after, dt))[metric][0]
            if value is None:
                return None
            found.append(value)
        low, high = found
        band = solved(profile, True) * (1.0 + abs(low)) + 0.5 * abs(high - low)
        return 0.5 * (low + high), band

    return law


def _after(scene: Scene, late: float, pyramid: bool) -> Array | None:
    """Twist after the blow (6,), found ``late`` [s]; None outside the assumptions above."""
    floor, ball = scene.bodies[0], scene.bodies[1]
    alone = len(scene.bodies) == 2 and not any((*scene.gravity, *ball.force, *ball.torque))
    if not alone or floor.shape != HalfSpace((0.0, 0.0, 1.0), 0.0) or not isinstance(ball.shape, Sphere):
        return None
    material, speed = scene.material(floor.name, ball.name), -ball.twist[2]
    if material.restitution * speed <= THRESHOLD:
        return None
    velocity, spin = np.array(ball.twist[:3]), np.array(ball.twist[3:])
    arm = np.array([0.0, 0.0, late * speed - ball.shape.radius])
    moment = float(np.broadcast_to(ball.inertia, 3)[0])
    slip = (velocity + np.cross(spin, arm))[:2]
    blow = ball.mass * (1.0 + restitution(material.restitution, speed)) * speed
    most, stopping = material.friction * blow, np.abs(slip) / (1.0 / ball.mass + arm[2] ** 2 / moment)
    if pyramid:
        if any(0.0 < each <= most for each in stopping):
            return None
        rubbed = -most * np.sign(slip)
    else:
        if np.linalg.norm(stopping) <= most:
            return None
        rubbed = -most * slip / np.linalg.norm(slip)
    impulse = np.array([*rubbed, blow])
    return np.concatenate([velocity + impulse / ball.mass, spin + np.cross(arm, impulse) / moment])
