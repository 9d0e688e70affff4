"""A box that spins freely: Euler's equations, what they keep, and the errors of a step of first order.

Principal axes lie along the box's sides. In body axes ``I w' = (I w) x w``; the components follow Jacobi's elliptic
functions, the middle one as sn [L. D. Landau, E. M. Lifshitz, Mechanics, section 37].
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from adapters.engine import Array
from adapters.trajectory import Trajectory
from reference_solver.geometry import rotation
from validation import bounds, metrics
from validation.canonical import Check, Measured

#: Factor on first-order errors for higher orders.
BEYOND = 1.5
#: Steps of the integration of a step's errors; four times as many change a bound by 1e-6 of it.
STEPS = 2000
SOURCE = "Euler's equations: angular momentum and energy are kept; period of Jacobi's elliptic functions"
WORDS = {
    "flip_time": "turns over after {value}",
    "momentum_drift": "changes its angular momentum by {value} (relative)",
    "energy_drift": "changes its energy by {value} (relative)",
}


def moments(mass: float, sides: tuple[float, ...]) -> Array:
    """Principal moments [kg m^2] about the axes along the sides [m]."""
    square = np.array(sides) ** 2
    return np.asarray(mass * (square.sum() - square) / 12.0)


def turns_over(own: Array, start: tuple[float, ...]) -> float:
    """Time until the spin about the middle axis, y, is 0 [s].

    ``t = I2 y R_F(a z^2, c x^2, a c)/|I1 - I3|`` with the spin (x, y, z) at the start,
    ``a = x^2 + I2 (I2 - I3) y^2/(I1 (I1 - I3))`` and ``c = z^2 + I2 (I1 - I2) y^2/(I3 (I1 - I3))``, if the spin about y
    decreases at first: ``(I3 - I1) x z < 0`` [both integrals of Euler's equations; NIST DLMF 19.29.19].

    Parameters
    ----------
    own, start
        (3,) moments of any mass, spin in body axes [rad/s].
    """
    (i1, i2, i3), (x, y, z) = own, start
    a = x * x + i2 * (i2 - i3) * y * y / (i1 * (i1 - i3))
    c = z * z + i2 * (i1 - i2) * y * y / (i3 * (i1 - i3))
    return float(i2 * y / abs(i1 - i3) * _carlson(a * z * z, c * x * x, a * c))


def _carlson(x: float, y: float, z: float) -> float:
    """R_F of three numbers, at most one of them 0, by duplication [NIST DLMF 19.26.18, 19.36.1].

    Differences fall to a quarter each time; what they leave out of the mean is of second order.
    """
    while max(x, y, z) - min(x, y, z) > 1e-8 * (x + y + z):
        shift = math.sqrt(x * y) + math.sqrt(x * z) + math.sqrt(y * z)
        x, y, z = 0.25 * (x + shift), 0.25 * (y + shift), 0.25 * (z + shift)
    return math.sqrt(3.0 / (x + y + z))


def measure(own: Array, trajectory: Trajectory, body: int = 0) -> dict[str, Measured]:
    """Angular momentum as a vector in space, energy, and when the spin about the body's y axis is 0.

    Parameters
    ----------
    own
        (3,) principal moments of the body [kg m^2].
    body
        Its place in the record.
    """
    turned = rotation(trajectory.pose[:, body])
    spin = np.einsum("sij,si->sj", turned, trajectory.twist[:, body, 3:])
    momentum = np.einsum("sij,sj->si", turned, spin * own)
    energy = spin**2 @ own
    start = float(np.linalg.norm(momentum[0]))
    flip, _ = metrics.crossing(trajectory.t, -spin[:, 1], -np.gradient(spin[:, 1], trajectory.t), 0.0)
    return {
        "flip_time": flip,
        "momentum_drift": (float(np.linalg.norm(momentum - momentum[0], axis=1).max()) / start, ""),
        "energy_drift": (float(np.abs(energy / energy[0] - 1.0).max()), ""),
    }


def _euler(own: Array, spin: Array, other: Array) -> Array:
    """I^-1 ((I w) x v) for principal moments I, spin w and another vector v: with v = w the rate of the spin."""
    (i1, i2, i3), (x, y, z), (u, v, w) = own, spin, other
    return np.array(((i2 * y * w - i3 * z * v) / i1, (i3 * z * u - i1 * x * w) / i2, (i1 * x * v - i2 * y * u) / i3))


@lru_cache(maxsize=64)
def _step_errors(
    moments: tuple[float, ...], start: tuple[float, ...], duration: float
) -> tuple[float, float, float, float]:
    """Errors of a first-order step, over dt: of angular momentum, energy, attitude [rad], and time [s].

    A step of dt neglects dt^2/2 times the second derivative: w'' of the spin, w' of the attitude. Their magnitudes are
    summed along the motion, which is integrated by a fourth-order Runge-Kutta method. An attitude error changes the
    spin in body axes and moves the zero by that over the rate there.
    """
    own, h, spin = np.array(moments), duration / STEPS, np.array(start)
    momentum, energy = float(np.linalg.norm(own * spin)), float(own @ spin**2)
    lost, given, turned, crossing = 0.0, 0.0, 0.0, 0.0
    for _ in range(STEPS):
        rate = _euler(own, spin, spin)
        second = _euler(own, rate, spin) + _euler(own, spin, rate)
        lost += h * 0.5 * float(np.linalg.norm(own * second)) / momentum
        given += h * abs(float(own * spin @ second)) / energy
        turned += h * 0.5 * float(np.linalg.norm(rate))
        half = spin + 0.5 * h * rate
        k2 = _euler(own, half, half)
        half = spin + 0.5 * h * k2
        k3 = _euler(own, half, half)
        whole = spin + h * k3
        after = spin + h / 6.0 * (rate + 2.0 * k2 + 2.0 * k3 + _euler(own, whole, whole))
        if spin[1] > 0.0 >= after[1] and crossing == 0.0:
            crossing = turned * float(np.linalg.norm(spin)) / abs(float(rate[1]))
        spin = after
    return lost, given, turned, crossing


def checks(own: Array, start: tuple[float, ...], duration: float, dt: float, truth: Mapping[str, float]) -> list[Check]:
    """A first-order scheme: the sum of its errors in spin and attitude over ``duration`` [s].

    A growing disturbance of exp(lambda t) is too small by lambda^2 dt/2 a second, which is lambda dt t/2 of time; the
    order of the scheme gives half a step, and sampled attitudes and spins may be half a step apart.

    Parameters
    ----------
    own
        (3,) moments about the axes, of any mass.
    start
        (3,) spin in body axes at the start, about y above all, the axis of the middle moment [rad/s].
    truth
        Without ``flip_time`` it does not turn over within ``duration``.
    """
    i1, i2, i3 = own
    growth = start[1] * math.sqrt((i2 - i1) * (i3 - i2) / (i1 * i3))
    lost, given, turned, crossing = _step_errors(tuple(map(float, own)), start, duration)
    momentum = bounds.Bound(
        BEYOND * (lost + turned) * dt + bounds.ROUND_OFF,
        "error of a first-order scheme in spin and attitude, w'' and w'",
    )
    energy = bounds.Bound(
        BEYOND * given * dt + bounds.ROUND_OFF, "error of a first-order scheme in the spin, w'' dt^2/2"
    )
    drifts = [
        momentum.check("momentum_drift", "1", truth["momentum_drift"], SOURCE),
        energy.check("energy_drift", "1", truth["energy_drift"], SOURCE),
    ]
    if "flip_time" not in truth:
        return drifts
    time = bounds.Bound(
        dt + 0.5 * growth * dt * truth["flip_time"] + crossing * dt,
        "steps of first order let a disturbance grow lambda^2 dt/2 too slowly, and turn it by w' dt/2; and one step",
    )
    return [time.check("flip_time", "s", truth["flip_time"], SOURCE), *drifts]
