"""Gates of free rotation: order and error of the orientation, length and direction of the angular momentum."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np

from reference_solver.exact.loop import FREE
from reference_solver.model import Array, Body, Box, Model
from reference_solver.settings import TOLERANCE, Settings
from reference_solver.simulation import Simulation
from tests.verification import runge_kutta
from tests.verification.gate import Gate

#: Moments and spin of a body that turns over about its intermediate axis.
MOMENTS = (1.0, 2.0, 3.0)
SPIN = (0.05, 3.0, 0.02)


def gates() -> Iterator[Gate]:
    """Yield every row of free rotation."""
    yield from order("classical")
    yield from error("reference")
    for profile in ("classical", "reference"):
        yield from angular_momentum(profile)


def tumbling(settings: Settings, turn: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0)) -> Simulation:
    """Return a free body of unequal moments; its shape plays no part."""
    length = math.hypot(*turn)
    pose = (0.0, 0.0, 0.0, *(q / length for q in turn))
    body = Body(Box((0.5, 0.5, 0.5)), 1.0, MOMENTS, pose, (0.0, 0.0, 0.0, *SPIN))
    return Simulation(Model(3, [body], (0.0, 0.0, 0.0), np.float64(0.0), np.float64(0.0)), settings)


def rotation_matrix(q: Array) -> Array:
    """Rotation matrix (3, 3) of a unit quaternion (w, x, y, z), body axes to world axes."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def tumbled(end: float, steps: int = 40_000) -> Array:
    """Orientation (4,) of the tumbling body after ``end`` [s], by Runge and Kutta's fourth-order method.

    Euler's equations and q' = q w / 2 in body axes (E70), with no piece of the solver. At 40 000 steps of 10 s its
    own error is 1e-11 rad, a hundred-thousandth of the smallest error measured here.
    """
    h = end / steps
    state = np.array([1.0, 0.0, 0.0, 0.0, *SPIN])

    def rate(s: Array) -> Array:
        q0, q1, q2, q3, w0, w1, w2 = s.tolist()
        i0, i1, i2 = MOMENTS
        return np.array(
            [
                0.5 * (-q1 * w0 - q2 * w1 - q3 * w2),
                0.5 * (q0 * w0 + q2 * w2 - q3 * w1),
                0.5 * (q0 * w1 + q3 * w0 - q1 * w2),
                0.5 * (q0 * w2 + q1 * w1 - q2 * w0),
                (i1 - i2) * w1 * w2 / i0,
                (i2 - i0) * w2 * w0 / i1,
                (i0 - i1) * w0 * w1 / i2,
            ]
        )

    for _ in range(steps):
        state = runge_kutta.advance(rate, state, h)
    return state[:4] / np.linalg.norm(state[:4])


def angle_between(p: Array, q: Array) -> float:
    """Angle of the rotation between two orientations [rad], exact near zero."""
    sign = 1.0 if float(p @ q) > 0.0 else -1.0
    return 4.0 * math.asin(min(0.5 * float(np.linalg.norm(p - sign * q)), 1.0))


def order(profile: str, end: float = 10.0) -> Iterator[Gate]:
    """Observed order of the orientation over halvings of the step."""
    truth, errors = tumbled(end), []
    for steps in (600, 1200, 2400, 4800, 9600):
        simulation = tumbling(getattr(Settings, profile)(end / steps))
        simulation.advance(steps)
        errors.append(angle_between(simulation.pose[0, 3:], truth))
    least = min(math.log2(a / b) for a, b in itertools.pairwise(errors))
    case = f"dt 1/60..1/960, {errors[-1]:.1e} rad at the last"
    yield Gate.at_least("free rotation: observed order", case, least, 1.9, f"{profile}, spatial")


def error(profile: str, end: float = 2.0) -> Iterator[Gate]:
    """Error of the orientation of a flight whose path is integrated to round-off, at two steps.

    The truth errs by 1e-13 rad in this time; a flight about the intermediate axis lets round-off grow 30-fold.
    """
    truth = tumbled(end, 16_000)
    for rate in (60, 240):
        simulation = tumbling(getattr(Settings, profile)(1.0 / rate))
        simulation.advance(round(end * rate))
        missed = angle_between(simulation.pose[0, 3:], truth)
        yield Gate.at_most("free rotation: error [rad]", f"2 s, dt 1/{rate}", missed, 1e-11, f"{profile}, spatial")


def angular_momentum(profile: str, steps: int = 10_000) -> Iterator[Gate]:
    """Length and direction of the angular momentum of a tumbling flight."""
    simulation = tumbling(getattr(Settings, profile)(1 / 240), (0.6, 0.2, -0.5, 0.4))
    record = simulation.record(steps, stride=10)
    momentum = []
    for pose, twist in zip(record.pose[:, 0], record.twist[:, 0], strict=True):
        turn = rotation_matrix(pose[3:])
        momentum.append(turn @ (np.array(MOMENTS) * (turn.T @ twist[3:])))
    length = np.linalg.norm(momentum, axis=1)
    direction = np.array(momentum) / length[:, None]
    drift = np.abs(length / length[0] - 1.0).max()
    turned = np.linalg.norm(direction - direction[0], axis=1).max()
    name = f"{profile}, spatial"
    # The loop errs by a share of the tolerance in each radian, of which there are some hundred; the textbook turns L.
    allowed = 1e-13 if profile == "classical" else FREE * TOLERANCE * float(np.linalg.norm(SPIN)) * record.t[-1]
    yield Gate.at_most("free rotation: |L|, relative", f"{steps} steps", drift, allowed, name)
    yield Gate.at_most("free rotation: direction of L [rad]", f"{steps} steps", turned, allowed, name)
