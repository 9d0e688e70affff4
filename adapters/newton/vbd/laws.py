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
ROWS: Mapping[str, str] = {
    "bounce": "apex[1] apex[2] apex[3] apex[4] apex[5] apex_interval_ratio rest_time",
    "impact": "rebound_ratio rebound_speed velocity_change",
    "head_on": "rebound_ratio first_speed second_speed momentum_defect",
}
#: Overlap up to which there is no contact [m]. [_SMALL_LENGTH_EPS]
LEAST = 1e-9
#: Starts that differ by round-off, and by how many units of the roundings of a blow at most.
STARTS, MOST = 9, 3


def motions(scene: Scene, dt: float, profile: str) -> list[Trajectory]:
    """Motions of two bodies on a line, one a ball, from all starts; none for other scenes.

    A sweep moves both bodies at once, each by a Newton step of ``m (x' - x - v dt - g dt^2)/dt^2 = +-(push - c min(gap'
    - gap, 0)/dt)`` with ``push = k (kept - rho gap')/(k + rho)`` where that pushes, and keeps it: an augmented
    Lagrangian of weight ``rho = 1/(1/m + 1/m)/dt^2``, whose limit is the spring. Places are rounded to single
    precision, and velocities are their differences over a step. [vbd/rigid_vbd_kernels.py, _alm_relaxed_ascent]
    """
    if len(scene.bodies) != 2 or any(any(body.force) or any(body.torque) for body in scene.bodies):
        return []
    d, (first, ball), chosen = scene.dimension, scene.bodies, settings_of(PROFILES[profile], scene, dt)
    if not isinstance(ball.shape, Disc | Sphere) or first.motion == "prescribed":
        return []
    if isinstance(first.shape, HalfSpace):
        normal: Array = np.array(first.shape.normal)
        reach = first.shape.offset + ball.shape.radius
        places = np.array([0.0, normal @ ball.pose[:d]])
    elif isinstance(first.shape, Disc | Sphere) and first.motion == "free":
        between = np.array(ball.pose[:d]) - np.array(first.pose[:d])
        normal, reach = between / np.linalg.norm(between), first.shape.radius + ball.shape.radius
        places = np.array([normal @ body.pose[:d] for body in scene.bodies])
    else:
        return []
    linear = np.array([body.twist[:d] for body in scene.bodies])
    if any(any(body.twist[d:]) for body in scene.bodies) or abs(linear - np.outer(linear @ normal, normal)).max() > 0.0:
        return []
    free = np.array([[float(body.motion == "free")] for body in scene.bodies])
    given = dt * dt * free * np.array([[-1.0 / first.mass], [1.0 / ball.mass]])
    moves = ROUNDINGS * UNIT * np.random.default_rng(0).integers(-MOST, MOST + 1, (2, STARTS))
    moves[:, 0] = 0.0
    size = max(abs(x) for x in ball.pose[:d]) + ball.shape.radius
    place = places[:, None] + size * np.array([0.0 * moves[0], moves[0]])
    speed = (linear @ normal)[:, None] * (1.0 + moves[1])
    pull = dt * dt * free * float(np.array(scene.gravity) @ normal)
    k, c, told = chosen["stiffness"], chosen["damping"] / dt, [(place, speed)]
    rho = 1.0 / abs(given).sum()
    for _ in range(step_count(scene.duration, dt)):
        ahead, before = place + dt * speed + pull, place[1] - place[0]
        now, kept = ahead, np.zeros(STARTS)
        for _ in range(chosen["iterations"] if (ahead[1] - ahead[0] < reach).any() else 0):
            gap, closed = now[1] - now[0] - reach, np.minimum(now[1] - now[0] - before, 0.0)
            push = k * (kept - rho * gap) / (k + rho)
            hit = (push > 0.0) & ((gap < -LEAST) | (kept > 0.0))
            held, last = abs(given) * hit * (k * rho / (k + rho) + c * (closed < 0.0)), now
            now = now + (ahead - now + given * hit * (push - c * closed)) / (1.0 + held)
            if (now == last).all():
                break
            kept = np.maximum(k * (kept - rho * (now[1] - now[0] - reach)) / (k + rho), 0.0)
        now = now.astype(np.float32).astype(float)
        place, speed = now, (now - place) / dt
        told.append((place, speed))
    t = np.arange(len(told), dtype=np.float64) * dt
    still: Array = np.array([body.pose for body in scene.bodies])
    found = []
    for start in range(STARTS):
        pose, twist = np.tile(still, (len(t), 1, 1)), np.zeros((len(t), 2, still.shape[1] - (d == 3)))
        pose[..., :d] += (np.array([x[:, start] for x, _ in told]) - places)[..., None] * normal
        twist[..., :d] = np.array([v[:, start] for _, v in told])[..., None] * normal
        found.append(Trajectory(t, pose, twist, None, dt, "completed"))
    return found


DEVIATIONS: tuple[Deviation, ...] = deviations(
    "newton_vbd",
    PROFILES,
    {scene: metrics.split() for scene, metrics in ROWS.items()},
    law_of_motions(motions),
    "contacts are springs with dampers in an implicit step, whatever the mass and e, and its sweeps end before stiff "
    "ones agree; velocities are differences of places in single precision",
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
