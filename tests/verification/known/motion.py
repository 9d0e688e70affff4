"""What a known motion is, how far a certified run is from it, and the integrator of those that have no closed form."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import NamedTuple

import numpy as np

from reference_solver.certificate.truth import certify
from reference_solver.geometry import reach, rotation
from reference_solver.model import Array, Model
from reference_solver.settings import Settings
from tests.verification import runge_kutta

#: Step of the classical Runge-Kutta method [s], and what truths may be off for it and for round-off [m].
STEP, TRUTH = 2.5e-4, 2e-11

Rate = Callable[[Array], Array]


@dataclass(frozen=True)
class Motion:
    """A world, and where its last body, or last few bodies, are after some time.

    Parameters
    ----------
    model
        What is simulated; the last bodies are those whose truth is known.
    time
        How long [s].
    truth
        Pose (3,) or (7,) of the last body at the end, or poses (k, 3 | 7) of the last k; nan where nothing is known of
        an orientation.
    """

    model: Model
    time: float
    truth: Array


class Miss(NamedTuple):
    """How far a run is from the truth [m], its X [m], and what refused it."""

    off: float
    bound: float
    refused: tuple[str, ...]


def miss(motion: Motion, steps: int) -> Miss:
    """Certify ``motion`` in ``steps`` steps and compare its end with the truth."""
    found = certify(motion.model, Settings.reference(motion.time / steps), steps, 5)
    return Miss(off(motion, found.pose[-1]), float(found.error[-1]), () if found.holds else found.reasons)


def off(motion: Motion, pose: Array) -> float:
    """Return how far poses (n, 3 | 7) are from the truth [m]; turns count at the body's reach."""
    d, truths = motion.model.dimension, np.atleast_2d(motion.truth)
    most = 0.0
    for body, here, there in zip(motion.model.bodies[-len(truths) :], pose[-len(truths) :], truths, strict=True):
        apart = float(np.linalg.norm(here[:d] - there[:d]))
        if not np.isnan(there[d]):
            turned = np.linalg.norm(rotation(here[None])[0] - rotation(there[None])[0], ord=2)
            apart = max(apart, float(turned) * reach(body.shape))
        most = max(most, apart)
    return most


def integrated(
    rate: Rate, state: Array, time: float, until: Callable[[Array], float] = runge_kutta.never
) -> tuple[Array, float]:
    """Return the state after ``time`` [s], or where ``until`` falls below zero before, and what is left of the time."""
    return runge_kutta.integrated(partial(runge_kutta.advance, rate), state, time, STEP, until)


def spun(q: Array, w: Array) -> Array:
    """Rate (4,) of a quaternion under the spin ``w`` (3,) in world axes [rad/s]."""
    scalar, vector = q[0], q[1:]
    return 0.5 * np.array([-(w @ vector), *(scalar * w + np.cross(w, vector))])


def complementary(w: Array, q: Array) -> Array:
    """Return the p >= 0 with w p + q >= 0 and p.(w p + q) = 0, by trying all sets that are pressed.

    Raises
    ------
    ValueError
        If none fits.
    """
    for pressed in product((False, True), repeat=len(q)):
        held = np.flatnonzero(pressed)
        p = np.zeros(len(q))
        if len(held):
            p[held] = np.linalg.solve(w[np.ix_(held, held)], -q[held])
        noise = 1e-12 * np.abs(q).max()
        if (p >= -1e-12 * np.abs(p).max()).all() and (w @ p + q >= -noise).all():
            return p.clip(min=0.0)
    raise ValueError("no set of contacts fits")
