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

from collections.abc import Mapping

import numpy as np

from adapters.scene import Body, Box, Scene
from adapters.trajectory import Trajectory
from validation import metrics
from validation.canonical import CanonicalScene, Check, Frontier, Measured, Parameter, Params, Primary, Steps, Variation
from validation.scenes.parts import mass_of, pose_at, states
from validation.truths import spinning

#: Sides of the box [m]: three different moments.
SIDES = (1.0, 0.6, 0.2)
#: Time of the run after the turn, as a share of the time before.
AFTERMATH = 0.5


def _start(p: Params) -> tuple[float, float, float]:
    """Spin in body axes at the start [rad/s]."""
    return 0.0, p["spin"], p["delta"] * p["spin"]


def _flip(p: Params) -> float:
    """Time until the spin about the middle axis is 0 [s]."""
    return spinning.turns_over(spinning.moments(1.0, SIDES), _start(p))


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: one free body and nothing else."""
    p = params
    own = spinning.moments(p["mass"], SIDES)
    body = Body(
        "box",
        Box((0.5 * SIDES[0], 0.5 * SIDES[1], 0.5 * SIDES[2])),
        p["mass"],
        (float(own[0]), float(own[1]), float(own[2])),
        pose_at(3, (0.0, 0.0, 0.0)),
        (0.0, 0.0, 0.0, *_start(p)),
    )
    duration = (1.0 + AFTERMATH) * _flip(p)
    return Scene("tumble", 1, dimension, (body,), (), (0.0, 0.0, 0.0), duration, p)


def exact(scene: Scene) -> dict[str, float]:
    """Euler's equations: two integrals, and the time between zeros of sn."""
    return {"flip_time": _flip(scene.params), "momentum_drift": 0.0, "energy_drift": 0.0}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Angular momentum, energy, and when the spin about the middle axis is 0."""
    return spinning.measure(np.array(scene.bodies[0].inertia), trajectory)


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


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """A first-order scheme: the sum of its errors in spin and attitude."""
    return spinning.checks(spinning.moments(1.0, SIDES), _start(scene.params), scene.duration, dt, truth)


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
    words=spinning.WORDS,
)
