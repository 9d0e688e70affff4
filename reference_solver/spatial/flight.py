"""Motion within one sub-step: where bodies are at any time of it, and how far they get (E24, E30).

x(t) = x + v t + a t^2 / 2 is exact. A body with equal moments turns by w t + b t^2 / 2 and by how its axis drifts. One
with unequal moments turns by the splitting E18, composed to order 8 in pieces short enough that its error is round-off.
"""

from __future__ import annotations

from reference_solver.compilation import inner_kernel, kernel
from reference_solver.spatial.broadphase import bound_bodies
from reference_solver.spatial.impact import carries
from reference_solver.spatial.kinematics import relative_twist, velocity_at
from reference_solver.spatial.motion import composed_turn, momentum_of, quaternion, set_orientation, spin_of
from reference_solver.spatial.separation import radius_of
from reference_solver.spatial.state import BOX, CAPSULE, FIXED, FREE, HALF_SPACE, Bodies, Manifolds, SubStep
from reference_solver.spatial.turning import spin_from_rate
from reference_solver.spatial.vector import (
    Vector,
    add_scaled,
    cross,
    length,
    quaternion_product,
    rotation_quaternion,
    row,
    scale,
    sub,
)
from reference_solver.stepping.broadphase import Boxes
from reference_solver.stepping.clock import HELD
from reference_solver.stepping.noise import DRIFT
from reference_solver.stepping.options import Options

#: A body that gets no farther than this fraction of its smallest half width in a sub-step is at rest.
AT_REST = 1e-14


@inner_kernel
def curvature(bodies: Bodies, i: int, start: int) -> Vector:
    """Second derivative of body i's path at its start, moving (0) or turning (3): rate, twice that if closing."""
    if bodies.curved[i]:
        return path_derivative(bodies, i, start, 2, 0.0)
    return scale(2.0 if bodies.closing[i] else 1.0, row(bodies.rate, i, start))


@inner_kernel
def axis_drift(w: Vector, b: Vector) -> Vector:
    """Third coefficient of the rotation vector of a spin w + b t: the second term of Magnus' series, -w x b / 12 (E30).

    What the next one leaves out is of fifth order.
    """
    return scale(-1.0 / 12.0, cross(w, b))


@kernel
def place_at(bodies: Bodies, i: int, t: float, trial: Bodies, k: int) -> None:
    """Write pose, axes and twist of body i at time t into record k of ``trial``, which has body i's shape.

    ``bodies.rate`` holds acceleration and, for a body with unequal moments, torque; for others angular acceleration.
    """
    if bodies.motion[i] == FIXED:
        return
    if bodies.curved[i]:
        place_on_path(bodies, i, t, trial, k)
        return
    v, a = row(bodies.twist, i, 0), curvature(bodies, i, 0)
    for d in range(3):
        trial.pose[k, d] = bodies.pose[i, d] + t * (v[d] + 0.5 * t * a[d])
        trial.twist[k, d] = v[d] + t * a[d]
    if not bodies.turning[i]:
        return
    b = curvature(bodies, i, 3)
    if bodies.gyroscopic[i]:
        start = row(bodies.angular_momentum, i, 0)
        set_orientation(trial, k, composed_turn(bodies, i, start, b, t))
        w = spin_of(trial, k, add_scaled(start, t, b))
    else:
        w = row(bodies.twist, i, 3)
        turn = rotation_quaternion(scale(t, add_scaled(add_scaled(w, 0.5 * t, b), t * t, axis_drift(w, b))))
        set_orientation(trial, k, quaternion_product(turn, quaternion(bodies, i)))
        w = add_scaled(w, t, b)
    for d in range(3):
        trial.twist[k, 3 + d] = w[d]


@inner_kernel
def path_derivative(bodies: Bodies, i: int, start: int, order: int, t: float) -> Vector:
    """Derivative of the displacement (start 0) or the rotation vector (3) of a curved path at time t (Horner)."""
    x, y, z = 0.0, 0.0, 0.0
    for j in range(5, order - 1, -1):
        factor = 1.0
        for m in range(order):
            factor *= j - m
        x = x * t + factor * bodies.path[i, start, j]
        y = y * t + factor * bodies.path[i, start + 1, j]
        z = z * t + factor * bodies.path[i, start + 2, j]
    return x, y, z


@inner_kernel
def path_bound(bodies: Bodies, i: int, start: int, order: int, duration: float) -> float:
    """Bound of the length of that derivative over the time: the sum of those of its terms."""
    bound, power = 0.0, 1.0
    for j in range(order, 6):
        factor = 1.0
        for m in range(order):
            factor *= j - m
        term = (bodies.path[i, start, j], bodies.path[i, start + 1, j], bodies.path[i, start + 2, j])
        bound += factor * power * length(term)
        power *= duration
    return bound


@inner_kernel
def place_on_path(bodies: Bodies, i: int, t: float, trial: Bodies, k: int) -> None:
    """`place_at` on a curved path."""
    way, v = path_derivative(bodies, i, 0, 0, t), path_derivative(bodies, i, 0, 1, t)
    psi = path_derivative(bodies, i, 3, 0, t)
    w = spin_from_rate(psi, path_derivative(bodies, i, 3, 1, t))
    for d in range(3):
        trial.pose[k, d] = bodies.pose[i, d] + way[d]
        trial.twist[k, d], trial.twist[k, 3 + d] = v[d], w[d]
    if bodies.turning[i]:
        set_orientation(trial, k, quaternion_product(rotation_quaternion(psi), quaternion(bodies, i)))


@inner_kernel
def copy_body(bodies: Bodies, i: int, trial: Bodies, k: int) -> None:
    """Give record k of ``trial`` the shape, inertia and present state of body i."""
    trial.kind[k] = bodies.kind[i]
    trial.motion[k] = bodies.motion[i]
    trial.extent[k] = bodies.extent[i]
    for d in range(4):
        trial.geometry[k, d] = bodies.geometry[i, d]
    for d in range(3):
        trial.moments[k, d] = bodies.moments[i, d]
        trial.inverse_moments[k, d] = bodies.inverse_moments[i, d]
        for c in range(3):
            trial.axes[k, d, c] = bodies.axes[i, d, c]
    for d in range(7):
        trial.pose[k, d] = bodies.pose[i, d]
    for d in range(6):
        trial.twist[k, d] = bodies.twist[i, d]


@inner_kernel
def reach_of(bodies: Bodies, i: int) -> float:
    """Distance of the farthest corner of the core from its centre; 0 of a sphere, which may turn as it likes [m]."""
    if bodies.kind[i] == BOX:
        return length(row(bodies.geometry, i, 0))
    return bodies.geometry[i, 0] if bodies.kind[i] == CAPSULE else 0.0


@inner_kernel
def begin_flight(bodies: Bodies, manifolds: Manifolds, sub_step: SubStep, options: Options, time: float) -> None:
    """Rates of a sub-step from its first and last velocities; ``twist`` is then the first (E24).

    What only its loads accelerate has exactly their rates, so that bodies which fall alike move straight to each other.
    """
    mark_closing(bodies, manifolds, sub_step, options, time)
    for i in range(len(bodies)):
        loaded = bodies.motion[i] == FREE
        for k in range(6):
            bodies.last[i, k] = bodies.twist[i, k]
        for k in range(3):
            loaded = loaded and bodies.last[i, k] == bodies.first[i, k] + time * bodies.acceleration[i, k]
            bodies.momentum_before[i, k] = bodies.angular_momentum[i, k]
        for k in range(6):
            bodies.rate[i, k] = (bodies.last[i, k] - bodies.first[i, k]) / time
            bodies.twist[i, k] = bodies.first[i, k]
        if loaded:
            for k in range(3):
                bodies.rate[i, k] = bodies.acceleration[i, k]
        if bodies.gyroscopic[i]:
            begin_turn(bodies, i)


@inner_kernel
def begin_turn(bodies: Bodies, i: int) -> None:
    """Angular momentum after the impacts of a body with unequal moments, and the torque that acts from there on."""
    hit = momentum_of(bodies, i, sub(row(bodies.first, i, 3), row(bodies.before, i, 3)))
    torque = momentum_of(bodies, i, row(bodies.rate, i, 3))
    for k in range(3):
        bodies.angular_momentum[i, k] += hit[k]
        bodies.rate[i, 3 + k] = torque[k]


@inner_kernel
def undo(bodies: Bodies) -> None:
    """Back to where the sub-step began."""
    for i in range(len(bodies)):
        for k in range(6):
            bodies.twist[i, k] = bodies.before[i, k]
        for k in range(3):
            bodies.angular_momentum[i, k] = bodies.momentum_before[i, k]


@inner_kernel
def mark_closing(bodies: Bodies, manifolds: Manifolds, sub_step: SubStep, options: Options, time: float) -> None:
    """Bodies of loaded contacts whose normals turn or whose gaps close follow the velocity at the end (E24).

    At impulse level none does: what closes is part of the mean velocity (E28).
    """
    for i in range(len(bodies)):
        bodies.closing[i] = 0
    for m in range(len(manifolds) if sub_step.clock[HELD] == 0.0 else 0):
        v, w = relative_twist(bodies.first, manifolds, m, options.rotation)
        for p in range(manifolds.points[m]):
            if not carries(manifolds, m, p, time / options.dt):
                continue
            drift = max(abs(velocity_at(v, w, manifolds, m, p)[2]), manifolds.gap[m, p] / time)
            if drift > DRIFT * manifolds.speed[m, p]:
                bodies.closing[manifolds.body_a[m]] = bodies.closing[manifolds.body_b[m]] = 1


@inner_kernel
def move_along(bodies: Bodies, t: float, whole: bool) -> None:
    """Go to time t of the sub-step (E24); ``whole``: its end, where velocities are what the solve found, to the bit."""
    for i in range(len(bodies)):
        if bodies.motion[i] == FIXED:
            continue
        place_at(bodies, i, t, bodies, i)
        for k in range(6):
            bodies.twist[i, k] = bodies.last[i, k] if whole else bodies.first[i, k] + t * bodies.rate[i, k]
        if bodies.gyroscopic[i]:
            momentum = add_scaled(row(bodies.angular_momentum, i, 0), t, row(bodies.rate, i, 3))
            w = spin_of(bodies, i, momentum)
            for k in range(3):
                bodies.angular_momentum[i, k] = momentum[k]
                bodies.twist[i, 3 + k] = w[k]


@inner_kernel
def bound_flight(bodies: Bodies, boxes: Boxes, options: Options, t: float) -> bool:
    """Bounds of all bodies over the sub-step up to t; False if nothing moves."""
    bound_bodies(bodies, boxes, options)
    moves = False
    for i in range(len(bodies)):
        share = 2.0 if bodies.closing[i] else 1.0
        turns = bodies.turning[i] and (
            bodies.twist[i, 3] != 0.0
            or bodies.twist[i, 4] != 0.0
            or bodies.twist[i, 5] != 0.0
            or bodies.rate[i, 3] != 0.0
            or bodies.rate[i, 4] != 0.0
            or bodies.rate[i, 5] != 0.0
        )
        moves = moves or turns
        for k in range(3):
            v = bodies.twist[i, k]
            way = t * max(abs(v), abs(v + t * share * bodies.rate[i, k]))
            if bodies.curved[i]:
                way = path_bound(bodies, i, 0, 1, t) * t
            moves = moves or way > AT_REST * bodies.extent[i]
            if turns and bodies.kind[i] != HALF_SPACE:
                far = reach_of(bodies, i) + radius_of(bodies, i)
                boxes.low[i, k] = min(boxes.low[i, k], bodies.pose[i, k] - far)
                boxes.high[i, k] = max(boxes.high[i, k], bodies.pose[i, k] + far)
            boxes.low[i, k] -= way
            boxes.high[i, k] += way
    return moves
