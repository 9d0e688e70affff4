"""Turns of axes and rates of turns, for one spin or three (`exact.rotation`)."""

import numpy as np

from reference_solver.exact.kernels.compiled import inner_kernel


@inner_kernel
def dot(a, b):
    """Return a . b."""
    s = 0.0
    for p in range(len(a)):
        s += a[p] * b[p]
    return s


@inner_kernel
def cross(a, b):
    """Return a x b."""
    out = np.empty(3)
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]
    return out


@inner_kernel
def turn_axes(axes, turn, out):
    """Write body axes (d, d), as columns, after a turn (1 | 3,) into ``out`` (d, d).

    In space: Rodrigues' formula, v + s psi x v + c psi x (psi x v) with s = sin|psi|/|psi|, c = (1 - cos|psi|)/|psi|^2.
    """
    if len(turn) == 1:
        c, s = np.cos(turn[0]), np.sin(turn[0])
        for j in range(2):
            out[0, j], out[1, j] = c * axes[0, j] - s * axes[1, j], s * axes[0, j] + c * axes[1, j]
        return
    square = turn[0] ** 2 + turn[1] ** 2 + turn[2] ** 2
    angle = np.sqrt(square)
    s = np.sin(angle) / angle if angle > 1e-8 else 1.0 - square / 6.0
    c = 2.0 * (np.sin(0.5 * angle) / angle) ** 2 if angle > 1e-8 else 0.5 - square / 24.0
    for j in range(3):
        x, y, z = axes[0, j], axes[1, j], axes[2, j]
        u, v, w = turn[1] * z - turn[2] * y, turn[2] * x - turn[0] * z, turn[0] * y - turn[1] * x
        out[0, j] = x + s * u + c * (turn[1] * w - turn[2] * v)
        out[1, j] = y + s * v + c * (turn[2] * u - turn[0] * w)
        out[2, j] = z + s * w + c * (turn[0] * v - turn[1] * u)


@inner_kernel
def write_turn_rate(turn, spin, out):
    """Write the rate (1 | 3,) of a turn under a spin (1 | 3,) into ``out``.

    In space: psi' = w - psi x w / 2 + f psi x (psi x w), f = (1 - |psi|/2 cot(|psi|/2)) / |psi|^2 (E36; J. Bortz, *IEEE
    Trans. Aerosp. Electron. Syst.* 7, 1971).
    """
    for e in range(len(spin)):
        out[e] = spin[e]
    if len(spin) == 1:
        return
    square = turn[0] ** 2 + turn[1] ** 2 + turn[2] ** 2
    angle = np.sqrt(square)
    f = 1.0 / 12.0 + square / 720.0 if square < 1e-4 else 1.0 / square - 0.5 / (angle * np.tan(0.5 * angle))
    u = turn[1] * spin[2] - turn[2] * spin[1]
    v = turn[2] * spin[0] - turn[0] * spin[2]
    w = turn[0] * spin[1] - turn[1] * spin[0]
    out[0] += -0.5 * u + f * (turn[1] * w - turn[2] * v)
    out[1] += -0.5 * v + f * (turn[2] * u - turn[0] * w)
    out[2] += -0.5 * w + f * (turn[0] * v - turn[1] * u)
