"""Designed deviations of Newton's VBD from the textbook, predicted from scene and step only."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from adapters.engine import Array
from adapters.law import Deviation, deviations, settings_of
from adapters.law.moved_starts import law_of_motions
from adapters.law.single_motions import standstills
from adapters.law.single_precision import PLACES, ROUNDINGS, UNIT
from adapters.law.unswept import passing_law
from adapters.newton.vbd.profiles import PROFILES
from adapters.scene import Disc, HalfSpace, Scene, Sphere
from adapters.stepping import step_count
from adapters.trajectory import Trajectory

_RELEASES, _SOURCE = ("1.8.",), "vbd/rigid_vbd_kernels.py, update_body_velocity"
#: Metrics by scene of one ball on a floor, and of two balls.
BOUNCES: Mapping[str, str] = {"bounce": "apex[1] apex[2] apex[3] apex[4] apex[5] apex_interval_ratio rest_time"}
#: As shipped only: a stiff contact has two answers where the damper alone ends the step apart; its iterations decide.
ROWS: Mapping[str, str] = {
    **BOUNCES,
    "impact": "rebound_ratio rebound_speed velocity_change",
    "head_on": "rebound_ratio first_speed second_speed momentum_defect",
}
#: Starts that differ by round-off, and by how many units of the roundings of a blow at most.
STARTS, MOST = 9, 3


def motions(scene: Scene, dt: float, profile: str) -> list[Trajectory]:
    """Motions of two bodies on a line, one a ball, from all starts; none for other scenes.

    A step is implicit: ``m (v' - v) = dt (-k (x + dt v') - c min(v', 0))`` of the gap x where it would close, with the
    reduced mass m, unless the damper alone ends the step apart. Places are rounded to single precision, and velocities
    are their differences over a step.
    """
    if len(scene.bodies) != 2 or any(any(body.force) or any(body.torque) for body in scene.bodies):
        return []
    d, (first, ball), chosen = scene.dimension, scene.bodies, settings_of(PROFILES[profile], scene, dt)
    if not isinstance(ball.shape, Disc | Sphere) or first.motion == "prescribed":
        return []
    if isinstance(first.shape, HalfSpace):
        normal: Array = np.array(first.shape.normal)
        start = float(normal @ np.array(ball.pose[:d])) - first.shape.offset - ball.shape.radius
        share = np.array([0.0, 1.0])
    elif isinstance(first.shape, Disc | Sphere) and first.motion == "free":
        between = np.array(ball.pose[:d]) - np.array(first.pose[:d])
        normal = between / np.linalg.norm(between)
        start = float(np.linalg.norm(between)) - first.shape.radius - ball.shape.radius
        share = np.array([ball.mass, first.mass]) / (first.mass + ball.mass)
    else:
        return []
    linear = np.array([body.twist[:d] for body in scene.bodies])
    if any(any(body.twist[d:]) for body in scene.bodies) or abs(linear - np.outer(linear @ normal, normal)).max() > 0.0:
        return []
    steps, mass = step_count(scene.duration, dt), share[1] * ball.mass
    k, c, pull = chosen["stiffness"], chosen["damping"], float(np.array(scene.gravity) @ normal)
    if first.motion == "free" and pull:
        return []
    moves = ROUNDINGS * UNIT * np.random.default_rng(0).integers(-MOST, MOST + 1, (2, STARTS))
    moves[:, 0] = 0.0
    size = max(abs(x) for x in ball.pose[:d]) + ball.shape.radius
    x, v = start + size * moves[0], float((linear[1] - linear[0]) @ normal) * (1.0 + moves[1])
    offset, gaps, speeds = float(normal @ np.array(ball.pose[:d])) - start, [x], [v]
    for _ in range(steps):
        ahead = v + pull * dt
        held = [(mass * ahead - dt * k * x) / (mass + dt * dt * k + dt * damper) for damper in (c, 0.0)]
        after = np.where(held[0] < 0.0, *held)
        after = np.where((x + dt * ahead < 0.0) & (x + dt * after < 0.0), after, ahead)
        place = (x + dt * after + offset).astype(np.float32).astype(float) - offset
        x, v = place, (place - x) / dt
        gaps.append(x)
        speeds.append(v)
    t = np.arange(steps + 1, dtype=np.float64) * dt
    common = (share[::-1] @ linear) if first.motion == "free" else np.zeros(d)
    found = []
    for gap, speed in zip(np.array(gaps).T, np.array(speeds).T, strict=True):
        pose = np.tile(np.array([body.pose for body in scene.bodies]), (steps + 1, 1, 1))
        twist = np.tile(np.array([body.twist for body in scene.bodies]), (steps + 1, 1, 1))
        for body, sign in ((0, -1.0), (1, 1.0)):
            part = sign * (share[body] if first.motion == "free" else float(body))
            pose[:, body, :d] += np.outer(t, common) + np.outer(part * (gap - start), normal)
            twist[:, body, :d] = common + np.outer(part * speed, normal)
        found.append(Trajectory(t, pose, twist, None, dt, "completed"))
    return found


DEVIATIONS: tuple[Deviation, ...] = ()
for _profile, _rows in (("default", ROWS), ("tuned", BOUNCES)):
    DEVIATIONS += deviations(
        "newton_vbd",
        (_profile,),
        {scene: metrics.split() for scene, metrics in _rows.items()},
        law_of_motions(motions),
        "contacts are springs with dampers in an implicit step, whatever the mass and e; velocities are differences of "
        "places in single precision",
        "vbd/rigid_vbd_kernels.py, evaluate_rigid_contact_from_collision; motion in adapters/newton/vbd/laws.py",
        _RELEASES,
    )
DEVIATIONS += deviations(
    "newton_vbd",
    PROFILES,
    {"thin_wall": ("rebound_ratio", "beyond")},
    lambda metric, profile: passing_law(metric, PLACES),
    "there is no swept collision detection: a body farther than two gaps from a thin body at the start of a step, and "
    "beyond it at the end, passes through",
    "ModelBuilder.rigid_gap; motion in adapters/law/unswept.py",
    _RELEASES,
)
DEVIATIONS += standstills("newton_vbd", PROFILES, {"far_origin": ("stopping_distance", "braking")}, _SOURCE, _RELEASES)
