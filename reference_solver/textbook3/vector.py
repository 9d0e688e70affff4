"""Three-vectors and quaternions as plain tuples of floats.

Tuples live in registers once compiled, and need no allocation; the same source runs uncompiled.
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

ZERO = (0.0, 0.0, 0.0)


@inner_kernel
def add(a: Vector, b: Vector) -> Vector:
    """A + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@inner_kernel
def sub(a: Vector, b: Vector) -> Vector:
    """A - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@inner_kernel
def scale(s: float, a: Vector) -> Vector:
    """S a."""
    return (s * a[0], s * a[1], s * a[2])


@inner_kernel
def add_scaled(a: Vector, s: float, b: Vector) -> Vector:
    """A + s b."""
    return (a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2])


@inner_kernel
def dot(a: Vector, b: Vector) -> float:
    """A . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inner_kernel
def cross(a: Vector, b: Vector) -> Vector:
    """A x b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@inner_kernel
def times(array: Array, i: int, a: Vector) -> Vector:
    """Product of matrix i of an (n, 3, 3) array with the vector a."""
    return (
        array[i, 0, 0] * a[0] + array[i, 0, 1] * a[1] + array[i, 0, 2] * a[2],
        array[i, 1, 0] * a[0] + array[i, 1, 1] * a[1] + array[i, 1, 2] * a[2],
        array[i, 2, 0] * a[0] + array[i, 2, 1] * a[1] + array[i, 2, 2] * a[2],
    )


@inner_kernel
def times_transposed(array: Array, i: int, a: Vector) -> Vector:
    """Product of the transpose of matrix i of an (n, 3, 3) array with the vector a."""
    return (
        array[i, 0, 0] * a[0] + array[i, 1, 0] * a[1] + array[i, 2, 0] * a[2],
        array[i, 0, 1] * a[0] + array[i, 1, 1] * a[1] + array[i, 2, 1] * a[2],
        array[i, 0, 2] * a[0] + array[i, 1, 2] * a[1] + array[i, 2, 2] * a[2],
    )


@inner_kernel
def length(a: Vector) -> float:
    """|a|."""
    return math.sqrt(dot(a, a))


@inner_kernel
def row(array: Array, i: int, start: int) -> Vector:
    """Three numbers of row i of a matrix, from column `start`."""
    return (array[i, start], array[i, start + 1], array[i, start + 2])


@inner_kernel
def axis(axes: Array, i: int, k: int) -> Vector:
    """Body axis k of body i in the world, from `axes` (n, 3, 3) whose columns are the body axes."""
    return (axes[i, 0, k], axes[i, 1, k], axes[i, 2, k])


@inner_kernel
def tangents(n: Vector) -> tuple[Vector, Vector]:
    """Two unit vectors that make a right-handed frame (t1, t2, n) with the unit vector n.

    The world axis least aligned with n is taken out of n, so that the divisor is at least sqrt(2/3).
    """
    if abs(n[0]) <= abs(n[1]) and abs(n[0]) <= abs(n[2]):
        s = 1.0 / math.sqrt(n[1] * n[1] + n[2] * n[2])
        t1 = (0.0, n[2] * s, -n[1] * s)
    elif abs(n[1]) <= abs(n[2]):
        s = 1.0 / math.sqrt(n[0] * n[0] + n[2] * n[2])
        t1 = (-n[2] * s, 0.0, n[0] * s)
    else:
        s = 1.0 / math.sqrt(n[0] * n[0] + n[1] * n[1])
        t1 = (n[1] * s, -n[0] * s, 0.0)
    return t1, cross(n, t1)


@inner_kernel
def axes_of_quaternion(q: Quaternion, axes: Array, i: int) -> None:
    """Write the rotation matrix (body to world) of the unit quaternion q = (w, x, y, z) into axes[i]."""
    w, x, y, z = q
    axes[i, 0, 0] = 1.0 - 2.0 * (y * y + z * z)
    axes[i, 0, 1] = 2.0 * (x * y - w * z)
    axes[i, 0, 2] = 2.0 * (x * z + w * y)
    axes[i, 1, 0] = 2.0 * (x * y + w * z)
    axes[i, 1, 1] = 1.0 - 2.0 * (x * x + z * z)
    axes[i, 1, 2] = 2.0 * (y * z - w * x)
    axes[i, 2, 0] = 2.0 * (x * z - w * y)
    axes[i, 2, 1] = 2.0 * (y * z + w * x)
    axes[i, 2, 2] = 1.0 - 2.0 * (x * x + y * y)


@inner_kernel
def quaternion_product(p: Quaternion, q: Quaternion) -> Quaternion:
    """Hamilton product p q of quaternions (w, x, y, z)."""
    return (
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    )


@inner_kernel
def normalised(q: Quaternion) -> Quaternion:
    """Quaternion q scaled to unit length."""
    s = 1.0 / math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return (s * q[0], s * q[1], s * q[2], s * q[3])


@inner_kernel
def rotation_quaternion(v: Vector) -> Quaternion:
    """Unit quaternion of the turn by |v| radians about v (exponential map)."""
    angle = length(v)
    if angle < 1e-4:  # sin(a/2)/a by its series: the next term is below 3e-20 here, and 0/0 is avoided
        s = 0.5 - angle * angle / 48.0
    else:
        s = math.sin(0.5 * angle) / angle
    return (math.cos(0.5 * angle), s * v[0], s * v[1], s * v[2])
