"""A leaning box that lands on its sliding lower edge, in free space, with the blow as in DART.

    arm      from the centre to half-way into the overlap in the step of the blow: the detector's point
    give     compliance of each of the edge's two corners, which share the load: 1e-5 of its own response
    cone     Coulomb's: the edge sticks with up to mu times the load, else it slips with that
    Dantzig  mu times the load without friction, independent of the actual load

The last follows from its pivoting: limits of friction are set once, after all loads are solved without friction.
"""

from __future__ import annotations

import math

import numpy as np

from adapters.dart.profiles import SWEEPERS, solved
from adapters.dart.shipped import FASTEST, MIXING, THRESHOLD
from adapters.engine import Array
from adapters.law import Law, Measure, Prediction
from adapters.scene import Body, Box, HalfSpace, Scene
from adapters.scene.lift import lift, lower_twist
from adapters.trajectory import Trajectory

#: Least distance of a touch from a step's end in steps; below it round-off decides which step finds it.
CLEAR = 1e-9


def rubbing_law(metric: str, profile: str) -> Law:
    """``metric`` after the blow.

    The distribution of a load among two corners depends on 1e-5 of it each, and sweeps end before resolving it: corners
    yield between 0 and twice as much, which is the band.
    """

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        spatial = scene if scene.dimension == 3 else lift(scene)
        found = []
        for mixing in (MIXING, 0.0) if profile in SWEEPERS else (MIXING,):
            after = _after(spatial, dt, mixing, profile == "default")
            value = None if after is None else measure(scene, ended(scene, after, dt))[metric][0]
            if value is None:
                return None
            found.append(value)
        band = solved(profile, True) * (1.0 + abs(found[0]))
        return found[0], band + abs(found[-1] - found[0])

    return law


def _after(scene: Scene, dt: float, mixing: float, once: bool) -> Array | None:
    """Twist after the blow (6,); None outside the assumptions above."""
    if any(scene.gravity) or len(scene.bodies) != 2 or scene.bodies[0].shape != HalfSpace((0.0, 0.0, 1.0), 0.0):
        return None
    floor, box = scene.bodies
    material, speed = scene.material(floor.name, box.name), -box.twist[2]
    if not isinstance(box.shape, Box) or not isinstance(box.inertia, tuple) or speed <= 0.0:
        return None
    w, x, y, z = box.pose[3:]
    if x or z or any((box.twist[1], *box.twist[3:], *box.force, *box.torque)):
        return None
    if not THRESHOLD < material.restitution * speed <= FASTEST:
        return None
    arm, overlap = _corner(box, 2.0 * math.atan2(y, w)), _found(box, speed, dt)
    if arm is None or overlap is None:
        return None
    arm[1] += 0.5 * overlap
    # Response of the edge along the normal and along x, times the mass; for one corner also from its place across.
    turn, across = box.mass / box.inertia[1], box.shape.half_extents[1]
    lean = np.array([arm[0], -arm[1]])
    response = np.eye(2) + turn * np.outer(lean, lean)
    roll, yaw = _across(box, 2.0 * math.atan2(y, w))
    own = np.diag(response) + box.mass * across**2 * np.array([roll, yaw])
    given = response + 0.5 * mixing * np.diag(own)
    wanted = (1.0 + material.restitution) * speed
    blow = _blow(given, wanted, -box.twist[0], material.friction, once)
    if blow is None:
        return None
    after = np.array(box.twist)
    # An upward impulse at x gives a moment -x about y, one along x at z a moment z.
    after[[2, 0]] += blow
    after[4] = turn * float(blow @ np.array([-arm[0], arm[1]]))
    return after


def _blow(response: Array, wanted: float, stop: float, friction: float, once: bool) -> Array | None:
    """Impulse over the mass (up, along), (2,) [m/s]: by Coulomb's law, or with limits set ``once``."""
    sticking = np.linalg.solve(response, (wanted, stop))
    if once:
        limit = friction * wanted / response[0, 0]
        if sticking[0] > 0.0 and abs(sticking[1]) <= limit:
            return np.asarray(sticking)
        rubbed = math.copysign(limit, sticking[1])
        pressed = (wanted - response[0, 1] * rubbed) / response[0, 0]
        return np.array([pressed, rubbed]) if pressed >= 0.0 else None
    if sticking[0] > 0.0 and abs(sticking[1]) <= friction * sticking[0]:
        return np.asarray(sticking)
    side = math.copysign(friction, sticking[1])
    ease = response[0, 0] + response[0, 1] * side
    return np.array([wanted / ease, side * wanted / ease]) if ease > 0.0 else None


def _corner(box: Body, angle: float) -> Array | None:
    """Arm of the lowest edge (x, z) [m] of a box turned by ``angle`` about y; None if it lies flat."""
    assert isinstance(box.shape, Box)
    a, _, b = box.shape.half_extents
    c, s = math.cos(angle), math.sin(angle)
    corners = np.array([(c * i * a + s * j * b, -s * i * a + c * j * b) for i in (-1, 1) for j in (-1, 1)])
    low = np.sort(corners[:, 1])
    return np.array(corners[corners[:, 1].argmin()]) if low[1] - low[0] > CLEAR else None


def _across(box: Body, angle: float) -> tuple[float, float]:
    """Addition to a corner's response up and along by its place at half the width, over the width's square."""
    assert isinstance(box.inertia, tuple)
    c, s = math.cos(angle), math.sin(angle)
    return c * c / box.inertia[0] + s * s / box.inertia[2], s * s / box.inertia[0] + c * c / box.inertia[2]


def _found(box: Body, speed: float, dt: float) -> float | None:
    """Overlap in the first step with one [m]; None if round-off decides which step that is."""
    arm = _corner(box, 2.0 * math.atan2(box.pose[5], box.pose[3]))
    if arm is None:
        return None
    steps = (box.pose[2] + float(arm[1])) / (speed * dt)
    late = math.ceil(steps) - steps
    return None if min(late, 1.0 - late) < CLEAR or steps < 0.0 else late * speed * dt


def ended(scene: Scene, after: Array, dt: float) -> Trajectory:
    """Start and end of a run after which the second body moves with ``after`` (6,), without places."""
    pose = np.array([[body.pose for body in scene.bodies]] * 2)
    twist = np.array([[body.twist for body in scene.bodies]] * 2)
    twist[1, 1] = after if scene.dimension == 3 else lower_twist(np.array([after]))[0]
    return Trajectory(np.array([0.0, scene.duration]), pose, twist, None, dt, "completed")
