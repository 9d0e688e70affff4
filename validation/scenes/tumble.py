"""A box that spins about its middle axis in free space turns over again and again.

           I1 < I2 < I3            spin about axis 2 is unstable: (0, s, delta s) grows as exp(lambda t),
        +------------+               lambda = s sqrt((I2 - I1)(I3 - I2)/(I1 I3))
       /            /|  | s        it turns over after  t = K(m)/n,  1 - m = q/(1 + q),
      +------------+ +  v          q = delta^2 I3 (I3 - I1)/(I2 (I2 - I1)),
      +------------+/              n^2 = s^2 (I3 - I2)(I2 (I2 - I1) + delta^2 I3 (I3 - I1))/(I1 I2 I3)

There is no contact: angular momentum and energy are conserved, and the spin follows Jacobi's elliptic functions, w2 as
sn from a quarter period on [L. D. Landau, E. M. Lifshitz, Mechanics, section 37]. K: complete elliptic integral.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from adapters.engine import Array
from adapters.scene import Body, Box, Scene
from adapters.trajectory import Trajectory
from reference_solver.geometry import rotation
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Frontier, Measured, Parameter, Params, Primary, Steps, Variation
from validation.scenes.parts import mass_of, pose_at, states

#: Sides of the box [m]: three different moments.
SIDES = (1.0, 0.6, 0.2)
#: Time of the run after the turn, as a share of the time before.
AFTERMATH = 0.5
#: Factor on first-order errors for higher orders.
BEYOND = 1.5
#: Steps of the integration of a step's errors; four times as many change a bound by 1e-6 of it.
STEPS = 2000


def moments(mass: float) -> Array:
    """Principal moments [kg m^2] about the axes along the sides."""
    square = np.array(SIDES) ** 2
    return np.asarray(mass * (square.sum() - square) / 12.0)


def _flip(p: Params) -> float:
    """Time until the spin about the middle axis is 0 [s]."""
    i1, i2, i3 = moments(1.0)
    low, high = i2 * (i2 - i1), i3 * (i3 - i1) * p["delta"] ** 2
    rate = p["spin"] * math.sqrt((i3 - i2) * (low + high) / (i1 * i2 * i3))
    # K(m) = pi/2 over the arithmetic-geometric mean of 1 and sqrt(1 - m).
    a, b = 1.0, math.sqrt(high / (low + high))
    while abs(a - b) > 1e-15 * a:
        a, b = 0.5 * (a + b), math.sqrt(a * b)
    return 0.5 * math.pi / a / rate


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: one free body and nothing else."""
    p = params
    own = moments(p["mass"])
    body = Body(
        "box",
        Box((0.5 * SIDES[0], 0.5 * SIDES[1], 0.5 * SIDES[2])),
        p["mass"],
        (float(own[0]), float(own[1]), float(own[2])),
        pose_at(3, (0.0, 0.0, 0.0)),
        (0.0, 0.0, 0.0, 0.0, p["spin"], p["delta"] * p["spin"]),
    )
    duration = (1.0 + AFTERMATH) * _flip(p)
    return Scene("tumble", 1, dimension, (body,), (), (0.0, 0.0, 0.0), duration, p)


def exact(scene: Scene) -> dict[str, float]:
    """Euler's equations: two integrals, and the time between zeros of sn."""
    return {"flip_time": _flip(scene.params), "momentum_drift": 0.0, "energy_drift": 0.0}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Angular momentum as a vector in space, energy, and when the spin about the body's middle axis is 0."""
    turned, own = rotation(trajectory.pose[:, 0]), np.array(scene.bodies[0].inertia)
    spin = np.einsum("sij,si->sj", turned, trajectory.twist[:, 0, 3:])
    momentum = np.einsum("sij,sj->si", turned, spin * own)
    energy = spin**2 @ own
    start = float(np.linalg.norm(momentum[0]))
    flip, _ = metrics.crossing(trajectory.t, -spin[:, 1], -np.gradient(spin[:, 1], trajectory.t), 0.0)
    return {
        "flip_time": flip,
        "momentum_drift": (float(np.linalg.norm(momentum - momentum[0], axis=1).max()) / start, ""),
        "energy_drift": (float(np.abs(energy / energy[0] - 1.0).max()), ""),
    }


#: Largest relative change of energy or angular momentum of a body that still spins on.
HALF = 0.5


def fate(scene: Scene, found: Mapping[str, Measured]) -> str:
    """``exploded``, ``changed its spin``; empty for a body that spun on, however inexactly."""
    momentum, energy = found["momentum_drift"][0], found["energy_drift"][0]
    if momentum is None or energy is None:
        return "NaN"
    if metrics.largest([momentum, energy]) > 1.0:
        return "exploded"
    return "changed its spin" if metrics.largest([momentum, energy]) > HALF else ""


def _euler(own: Array, spin: Array, other: Array) -> Array:
    """I^-1 ((I w) x v) for principal moments I, spin w and another vector v: with v = w the rate of the spin."""
    (i1, i2, i3), (x, y, z), (u, v, w) = own, spin, other
    return np.array(((i2 * y * w - i3 * z * v) / i1, (i3 * z * u - i1 * x * w) / i2, (i1 * x * v - i2 * y * u) / i3))


@lru_cache(maxsize=64)
def _step_errors(start: tuple[float, ...], duration: float) -> tuple[float, float, float, float]:
    """Errors of a first-order step, over dt: of angular momentum, energy, attitude [rad], and time [s].

    A step of dt neglects dt^2/2 times the second derivative: w'' of the spin, w' of the attitude. Their magnitudes are
    summed along the motion, which is integrated by a fourth-order Runge-Kutta method. An attitude error changes the
    spin in body axes and moves the zero by that over the rate there.
    """
    own, h, spin = moments(1.0), duration / STEPS, np.array(start)
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
        if spin[1] > 0.0 >= after[1]:
            crossing = turned * float(np.linalg.norm(spin)) / abs(float(rate[1]))
        spin = after
    return lost, given, turned, crossing


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """A first-order scheme: the sum of its errors in spin and attitude.

    A growing disturbance of exp(lambda t) is too small by lambda^2 dt/2 a second, which is lambda dt t/2 of time; the
    order of the scheme gives half a step, and sampled attitudes and spins may be half a step apart.
    """
    p = scene.params
    i1, i2, i3 = moments(1.0)
    growth = p["spin"] * math.sqrt((i2 - i1) * (i3 - i2) / (i1 * i3))
    lost, given, turned, crossing = _step_errors((0.0, p["spin"], p["delta"] * p["spin"]), scene.duration)
    time = bounds.Bound(
        dt + 0.5 * growth * dt * truth["flip_time"] + crossing * dt,
        "steps of first order let a disturbance grow lambda^2 dt/2 too slowly, and turn it by w' dt/2; and one step",
    )
    momentum = bounds.Bound(
        BEYOND * (lost + turned) * dt + bounds.ROUND_OFF,
        "error of a first-order scheme in spin and attitude, w'' and w'",
    )
    energy = bounds.Bound(
        BEYOND * given * dt + bounds.ROUND_OFF, "error of a first-order scheme in the spin, w'' dt^2/2"
    )
    source = "Euler's equations: angular momentum and energy are kept; period of Jacobi's elliptic functions"
    return [
        time.check("flip_time", "s", truth["flip_time"], source),
        momentum.check("momentum_drift", "1", truth["momentum_drift"], source),
        energy.check("energy_drift", "1", truth["energy_drift"], source),
    ]


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Larger of the drifts of angular momentum and energy."""
    values = [found[name] for name in ("momentum_drift", "energy_drift")]
    missing = [reason for value, reason in values if value is None]
    return (None, missing[0]) if missing else (metrics.largest(value for value, _ in values if value is not None), "")


SCENE = CanonicalScene(
    name="tumble",
    version=1,
    title="Box that turns over its middle axis in free space",
    symptoms=(
        "a body that spins freely gains or loses energy",
        "the gyroscopic term is missing",
        "a spinning object in space slows down although nothing touches it",
        "the intermediate axis flip does not happen",
        "a rotating box in zero gravity speeds up and explodes",
        "angular momentum of a free body is not constant",
        "the Dzhanibekov effect or tennis racket theorem is missing",
        "the rotation axis of a thrown phone or book does not wobble",
        "a satellite spins wrongly",
        "a free gyroscope does not precess",
        "a torque-free body with unequal moments of inertia turns wrongly",
    ),
    family="turning",
    figure=__doc__ or "",
    law="L and E are conserved; spin about the middle axis turns over after K(m)/n",
    dimensions=(3,),
    parameters=(
        Parameter("spin", 3.0, "rad/s", "about the middle axis", 0.0, 1e3, positive=True),
        Parameter("delta", 0.1, "1", "spin about the largest axis, over that: the disturbance", 1e-6, 1.0),
        mass_of("the box"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    frontiers=(
        Frontier(
            "spin",
            "rad/s",
            "spin",
            1.0,
            1e3,
            1e3,
            fate,
            "spun on: at no time was more than half of its energy or angular momentum gained or lost",
        ),
    ),
    standard=(Variation({}), Variation({"delta": 0.01, "spin": 6.0})),
    full=tuple(Variation({"spin": s, "delta": d}) for s in (1.0, 3.0, 10.0) for d in (0.01, 0.1, 1.0)),
    planted=({},),
    primary=Primary(
        "drift",
        "1",
        "larger of the relative drifts of angular momentum and energy until it has turned over",
        "the motion conserves both: an integrator that loses either turns over at another time",
        lambda dt: [{}],
        error,
        "a free body that tumbles",
    ),
    steps=Steps((1.0 / 60.0, 1.0 / 240.0, 1.0 / 960.0)),
    smooth=("flip_time",),
    words={
        "flip_time": "turns over after {value}",
        "momentum_drift": "changes its angular momentum by {value} (relative)",
        "energy_drift": "changes its energy by {value} (relative)",
    },
)
