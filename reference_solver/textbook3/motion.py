"""Velocities from loads, poses from velocities, and free rotation of bodies with unequal moments (E5, E17, E18).

A body whose three moments are equal turns with constant angular velocity: one rotation is exact. Otherwise its
angular momentum is constant in the world and turns in the body. The energy H = sum L_i^2 / 2 I_i is split into its
three terms; the flow of each is a rotation about one body axis. Composed symmetrically they give a method of
second order that keeps L to round-off (Lie-Poisson splitting; R. I. McLachlan, Phys. Rev. Lett. 71, 1993).
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel, kernel
from reference_solver.textbook.motion import FIXED, FREE
from reference_solver.textbook.options import Options
from reference_solver.textbook3.state import Bodies
from reference_solver.textbook3.vector import (
    Quaternion,
    Vector,
    axes_of_quaternion,
    normalised,
    quaternion_product,
    rotation_quaternion,
    row,
    scale,
    times,
    times_transposed,
)


@inner_kernel
def quaternion(bodies: Bodies, i: int) -> Quaternion:
    """Quaternion of body i."""
    return (bodies.pose[i, 3], bodies.pose[i, 4], bodies.pose[i, 5], bodies.pose[i, 6])


@inner_kernel
def set_orientation(bodies: Bodies, i: int, q: Quaternion) -> None:
    """Store a quaternion, made a unit one, with the rotation matrix and world inertia that belong to it."""
    q = normalised(q)
    for d in range(4):
        bodies.pose[i, 3 + d] = q[d]
    axes_of_quaternion(q, bodies.axes, i)
    for r in range(3):
        for c in range(3):
            entry = 0.0
            for k in range(3):
                entry += bodies.axes[i, r, k] * bodies.inverse_moments[i, k] * bodies.axes[i, c, k]
            bodies.inverse_inertia[i, r, c] = entry


@kernel
def initialise(bodies: Bodies) -> None:
    """Fill everything that follows from poses and twists."""
    for i in range(len(bodies)):
        set_orientation(bodies, i, quaternion(bodies, i))
        if bodies.gyroscopic[i]:
            momentum = momentum_of(bodies, i, row(bodies.twist, i, 3))
            for d in range(3):
                bodies.angular_momentum[i, d] = momentum[d]


@inner_kernel
def momentum_of(bodies: Bodies, i: int, w: Vector) -> Vector:
    """Angular momentum I w of body i, world axes [kg m^2/s]."""
    local = times_transposed(bodies.axes, i, w)
    moments = bodies.moments
    return times(bodies.axes, i, (moments[i, 0] * local[0], moments[i, 1] * local[1], moments[i, 2] * local[2]))


@inner_kernel
def accelerate(bodies: Bodies, dt: float) -> None:
    """v* = v + h M^-1 f (E5), h being dt. The gyroscopic term acts while the body turns, in `turn_freely`."""
    for i in range(len(bodies)):
        if bodies.motion[i] != FREE:
            continue
        spin = times(bodies.inverse_inertia, i, row(bodies.torque, i, 0))
        for d in range(3):
            bodies.spin_before[i, d] = bodies.twist[i, 3 + d]
            bodies.twist[i, d] += dt * bodies.acceleration[i, d]
            bodies.twist[i, 3 + d] += dt * spin[d]


@inner_kernel
def move(bodies: Bodies, options: Options) -> None:
    """X += h v, and the turn that belongs to h omega (E17, E18)."""
    for i in range(len(bodies)):
        if bodies.motion[i] == FIXED:
            continue
        for d in range(3):
            bodies.pose[i, d] += options.dt * bodies.twist[i, d]
        if not bodies.turning[i]:
            continue
        if bodies.gyroscopic[i]:
            collect_momentum(bodies, i, row(bodies.spin_before, i, 0))
            turn_freely(bodies, i, options.dt)
        else:
            turn = rotation_quaternion(scale(options.dt, row(bodies.twist, i, 3)))
            set_orientation(bodies, i, quaternion_product(turn, quaternion(bodies, i)))


@inner_kernel
def collect_momentum(bodies: Bodies, i: int, before: Vector) -> None:
    """Add to the stored angular momentum what changed the spin in this step: nothing, exactly, in free flight."""
    w = row(bodies.twist, i, 3)
    gained = momentum_of(bodies, i, (w[0] - before[0], w[1] - before[1], w[2] - before[2]))
    for d in range(3):
        bodies.angular_momentum[i, d] += gained[d]


@inner_kernel
def turn_freely(bodies: Bodies, i: int, dt: float) -> None:
    """Turn body i with constant angular momentum for dt, and set the spin that belongs to it (E18)."""
    momentum = row(bodies.angular_momentum, i, 0)
    local, moments = times_transposed(bodies.axes, i, momentum), row(bodies.moments, i, 0)
    set_orientation(bodies, i, split_flow(quaternion(bodies, i), local, moments, dt))
    w = spin_of(bodies, i, momentum)
    for d in range(3):
        bodies.twist[i, 3 + d] = w[d]


@inner_kernel
def spin_of(bodies: Bodies, i: int, momentum: Vector) -> Vector:
    """Angular velocity of body i with this angular momentum, world axes [rad/s]."""
    local = times_transposed(bodies.axes, i, momentum)
    moments = row(bodies.moments, i, 0)
    return times(bodies.axes, i, (local[0] / moments[0], local[1] / moments[1], local[2] / moments[2]))


@inner_kernel
def split_flow(q: Quaternion, local: Vector, moments: Vector, dt: float) -> Quaternion:
    """Orientation after dt by the splitting E18, from orientation q and angular momentum in body axes."""
    local, q = turn_about(0, local, q, moments, 0.5 * dt)
    local, q = turn_about(1, local, q, moments, 0.5 * dt)
    local, q = turn_about(2, local, q, moments, dt)
    local, q = turn_about(1, local, q, moments, 0.5 * dt)
    local, q = turn_about(0, local, q, moments, 0.5 * dt)
    return q


@inner_kernel
def turn_about(k: int, local: Vector, q: Quaternion, moments: Vector, dt: float) -> tuple[Vector, Quaternion]:
    """Flow of L_k^2 / 2 I_k: the body turns about its axis k by L_k dt / I_k, and L turns back in the body."""
    angle = local[k] / moments[k] * dt
    c, s = math.cos(angle), math.sin(angle)
    half_c, half_s = math.cos(0.5 * angle), math.sin(0.5 * angle)
    if k == 0:
        turned = (local[0], c * local[1] + s * local[2], c * local[2] - s * local[1])
        return turned, quaternion_product(q, (half_c, half_s, 0.0, 0.0))
    if k == 1:
        turned = (c * local[0] - s * local[2], local[1], c * local[2] + s * local[0])
        return turned, quaternion_product(q, (half_c, 0.0, half_s, 0.0))
    turned = (c * local[0] + s * local[1], c * local[1] - s * local[0], local[2])
    return turned, quaternion_product(q, (half_c, 0.0, 0.0, half_s))


@inner_kernel
def displace(bodies: Bodies, dt: float) -> None:
    """Move bodies by their pseudo-velocities; velocities, and the angular momentum, stay what they are (E16)."""
    for i in range(len(bodies)):
        if bodies.motion[i] != FREE:
            continue
        for d in range(3):
            bodies.pose[i, d] += dt * bodies.pseudo[i, d]
        if bodies.pseudo[i, 3] != 0.0 or bodies.pseudo[i, 4] != 0.0 or bodies.pseudo[i, 5] != 0.0:
            turn = rotation_quaternion(scale(dt, row(bodies.pseudo, i, 3)))
            set_orientation(bodies, i, quaternion_product(turn, quaternion(bodies, i)))
