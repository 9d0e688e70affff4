"""Predictions of MuJoCo's documented contact law for balls, columns and inclines, without running it.

    ball on a floor      one scalar recurrence (`adapters.mujoco.contact_law`)
    column of boxes      the same law at every face, coupled: each step solves  (A + R) f = aref - a0,  f >= 0
    box that slides      the same law with friction and rotation, in the plane (`box_on_face`)
    blow without load    the scalar law with the engine's estimate of the inverse mass (`blows`)

A recurrence gives a trajectory, which is measured by the scene's own metrics, so that a prediction and a measurement
differ by physics only. Every prediction is made twice or more, with a start moved by the error of the engine's solver
or round-off; the difference times a factor is the band, and where it is large there is no prediction.

Sources: MuJoCo documentation, "Computation: constraint model" (a convex problem; friction cones without
complementarity; impedance relative to an estimate of the inverse inertia), "Modeling: solver parameters" (solref,
solimp, friction) and "slow slippage".
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from adapters.law import AskedLaw, Law, Measure, Prediction, settings_of
from adapters.law.moved_starts import BLURRED, GAP_ROUND_OFF, PERTURBATIONS, SPREAD_FACTOR, SUM_ROUND_OFF, scale_of
from adapters.mujoco.blows import blow_of, metrics_of, steps_of
from adapters.mujoco.box_on_face import BoxOnFace
from adapters.mujoco.contact_law import ContactLaw
from adapters.mujoco.motions import CORNERS, along_a_heading, as_trajectory, column, fall, is_vertical
from adapters.mujoco.pairs import contact_law
from adapters.mujoco.profiles import PROFILES
from adapters.scene import Box, Disc, HalfSpace, Scene, Sphere
from adapters.stepping import step_count
from adapters.trajectory import Measured

Array = NDArray[np.float64]

EPS = float(np.finfo(float).eps)
#: Largest difference of two paths of a box for a prediction, as a share of the scale.
EITHER = 1e-2
#: A box is at rest below this share of the speed of a step's fall (as in the scenes of columns).
STILL = 0.01
#: Newton's method ends when the active faces are right: fewer steps than this for the two of a pair.
ENOUGH = 10


def law_of(profile: str, scene: Scene, dt: float) -> ContactLaw:
    """Law of the lowest pair; the scenes here have one material."""
    material = scene.material(scene.bodies[0].name, scene.bodies[1].name)
    return contact_law(settings_of(PROFILES[profile], scene, dt), material.restitution, material.friction, dt)


def solver_error(profile: str, scene: Scene, dt: float) -> float:
    """Velocity error [m/s] of a step of a box: Newton's method stops when a step gains less than the tolerance.

    The cost is in units of the mean inertia, (3 m + 3 I)/6 < m here, times 6 unknowns; that far from its minimum, an
    acceleration has an error of ``sqrt(2 * 6 * tolerance)`` m/s^2 at most.
    """
    return math.sqrt(12.0 * float(settings_of(PROFILES[profile], scene, dt)["tolerance"])) * dt + GAP_ROUND_OFF


# ---- a ball on a floor -------------------------------------------------------------------------------------------


def ball_metrics(scene: Scene, measure: Measure, law: ContactLaw, moved: float) -> dict[str, Measured]:
    """All metrics of the scene for a start ``moved`` [m] higher."""
    body, up = scene.bodies[1], scene.dimension - 1
    assert isinstance(body.shape, Disc | Sphere)
    steps = step_count(scene.duration, law.dt)
    rows = fall(law, body.pose[up] + moved, body.twist[up], body.shape.radius, scene.gravity[up], steps)
    rows = rows * np.array([1.0, 1.0, body.mass])
    return measure(scene, as_trajectory(scene, law.dt, rows[:, :, None]))


def _force_round_off(law: ContactLaw) -> float:
    """Relative round-off of reported forces: ``f = (aref - a)/R`` is a small difference of large numbers.

    Two roundings of a number of size aref, over R, against aref m: 2 eps/(R m) for each of four edges, which have
    R m = 4 s (1 - d)/d. A pair without friction keeps mu = 1e-5, and with it s = 5e-11.
    """
    d = law.impedance.deep
    return 2.0 * CORNERS * EPS * d / (4.0 * law.softness * (1.0 - d))


def ball_law(profile: str, metric: str) -> Law:
    """A ball on a floor, from several starts that differ by the round-off of its gap."""

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        if not (is_vertical(scene) and len(scene.bodies) == 2 and isinstance(scene.bodies[1].shape, Disc | Sphere)):
            return None
        contact = law_of(profile, scene, dt)
        value, *others = (
            ball_metrics(scene, measure, contact, k * GAP_ROUND_OFF)[metric][0] for k in (0.0, *PERTURBATIONS)
        )
        if value is None or None in others:
            return None
        scale = scale_of(scene, metric)
        spread = max(abs(other - value) for other in others if other is not None)
        band = SPREAD_FACTOR * spread + SUM_ROUND_OFF * scale
        if metric in ("impulse", "momentum_defect"):
            band += _force_round_off(contact) * scale
        return (value, band) if spread <= BLURRED * scale else None

    return law


# ---- a column of boxes -------------------------------------------------------------------------------------------


def column_law(profile: str, metric: str) -> Law:
    """A column of boxes that fall together and land, with faces that touch by round-off or do not."""

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        boxes, up = scene.bodies[1:], scene.dimension - 1
        shapes = [body.shape for body in boxes if isinstance(body.shape, Box)]
        if not is_vertical(scene) or len(shapes) != len(boxes):
            return None
        contact = law_of(profile, scene, dt)
        heights = tuple(body.pose[up] for body in boxes)
        sizes = tuple(2.0 * shape.half_extents[up] for shape in shapes)
        masses = tuple(body.mass for body in boxes)
        steps, load = step_count(scene.duration, dt), scene.gravity[up]
        # Faces between boxes that fall together: all in contact by round-off, or none. The engine finds a mixture,
        # which may lie a little beyond either; twice their difference.
        paths = [column(contact, heights, sizes, masses, load, steps, edge) for edge in (0.0, GAP_ROUND_OFF)]
        value, other = (measure(scene, as_trajectory(scene, dt, path))[metric][0] for path in paths)
        if value is None or other is None:
            return None
        spread = abs(other - value)
        if spread > 0.5 * value:
            return None
        if metric == "settle_time":
            # A speed may fall below its threshold one step earlier or later; or at any time until the end, if the
            # residual of Newton's method keeps a box above it.
            if _trembles(profile, scene, dt) > STILL * abs(load) * dt:
                half = 0.5 * (scene.duration - value)
                return value + half, half + 2.0 * spread + dt
            return value, 2.0 * spread + dt
        # Half-way into a box the nearest exit is another face: boxes end side by side.
        if value > 0.5 * min(sizes):
            return None
        # Each corner's force is a difference over R, (1 - d)/d of an inertia.
        d = contact.impedance.deep
        round_off = CORNERS * EPS * d / (1.0 - d) * value
        return value, 2.0 * spread + solver_error(profile, scene, dt) * dt + GAP_ROUND_OFF + round_off

    return law


def _trembles(profile: str, scene: Scene, dt: float) -> float:
    """Residual speed [m/s] of a box in a column because Newton's method stops at its tolerance.

    The cost is in units of the mean inertia, for n boxes (3 m + 3 I)/6 on average, times 6 n unknowns: that far from
    its minimum, the lightest is accelerated by ``sqrt(2 tolerance 6 n inertia/m)``. A critically damped contact turns a
    constant push into a speed of at most 2/e of its time constant, which grows with the root of load over mass.
    """
    settings = settings_of(PROFILES[profile], scene, dt)
    if settings["solref"] == "reflect":
        return 0.0
    boxes = scene.bodies[1:]
    masses = [body.mass for body in boxes]
    moments = [np.mean(body.inertia) for body in boxes]
    mean = sum(0.5 * (m + i) for m, i in zip(masses, moments, strict=True)) / len(boxes)
    pushed = math.sqrt(2.0 * float(settings["tolerance"]) * 6.0 * len(boxes) * mean / min(masses))
    lasts = float(settings["solref"][0]) * math.sqrt(sum(masses) / min(masses))
    return 2.0 / math.e * lasts * pushed


def column_asked(profile: str, metric: str) -> AskedLaw:
    """The same at counts of Newton steps that are not used up; no prediction below."""
    own = column_law(profile, metric)

    def law(scene: Scene, dt: float, measure: Measure, iterations: int) -> Prediction | None:
        return own(scene, dt, measure) if iterations >= ENOUGH else None

    return law


# ---- a box on an incline -----------------------------------------------------------------------------------------


@lru_cache(maxsize=256)
def _slide(box: BoxOnFace, steps: int, velocity: float) -> Array:
    return np.array(box.slide(steps, velocity))


def box_on_face(profile: str, scene: Scene, dt: float) -> BoxOnFace | None:
    """The planar problem of one box on a level face with a load along x; None for other scenes."""
    if len(scene.bodies) != 2 or any(scene.gravity[1:-1]):
        return None
    face, body = scene.bodies
    if not (isinstance(face.shape, HalfSpace) and face.shape.normal[-1] == 1.0 and isinstance(body.shape, Box)):
        return None
    if any(body.twist[scene.dimension - 1 :]) or any(body.force[1:-1]) or any(body.torque):
        return None
    return BoxOnFace.of(settings_of(PROFILES[profile], scene, dt), scene, dt)


def incline_law(profile: str, metric: str) -> Law:
    """A box at rest on an incline: its planar motion, started with the solver's error."""

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        box = box_on_face(profile, scene, dt)
        if box is None or any(scene.bodies[1].twist):
            return None
        steps, error = step_count(scene.duration, dt), solver_error(profile, scene, dt)
        middle = (steps + 1) // 2
        column, window = {"creep": 0, "acceleration": 1}[metric], (steps - middle) * dt
        paths = [_slide(box, steps, k * error) for k in (0.0, 1.0, -1.0)]
        value, *others = (float(path[-1, column] - path[middle, column]) / window for path in paths)
        spread = max(abs(other - value) for other in others)
        scale = math.hypot(*box.load) * (scene.duration if metric == "creep" else 1.0)
        # A force is a difference over R, (1 - d)/d of an inertia: its round-off is d/(1 - d) of a number's own.
        d = box.law.impedance.deep
        round_off = EPS * d / (1.0 - d) * scale
        floor = round_off + (error if metric == "creep" else 2.0 * error / window)
        if spread > BLURRED * scale:
            # Between two paths (one hop more or less) the engine may take either.
            return (value, 2.0 * spread + floor) if spread <= EITHER * scale else None
        return value, SPREAD_FACTOR * spread + floor

    return law


@lru_cache(maxsize=64)
def _motion(box: BoxOnFace, steps: int, velocity: float) -> Array:
    return np.array(box.motion(steps, velocity))


def stopping_law(profile: str, metric: str) -> Law:
    """A box that slides to a stop: its planar motion along the heading, measured like the engine's run.

    An elliptic cone does not depend on the heading, but the box does: along it, its length is its side or, at most, its
    projection. Both are computed, and the band covers them. A pyramid brakes differently in each heading, and turns the
    box: no prediction.
    """

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        box, d = box_on_face(profile, scene, dt), scene.dimension
        if box is None:
            return None
        level = np.array(scene.bodies[1].twist[: d - 1])
        speed = float(np.linalg.norm(level))
        if speed == 0.0:
            return None
        heading = level / speed
        if np.abs(heading).max() < 1.0 and box.cone != "elliptic":
            return None
        steps, error = step_count(scene.duration, dt), solver_error(profile, scene, dt)
        longer = replace(box, half_length=box.half_length * float(np.abs(heading).sum()))
        starts = [(box, speed), (box, speed + error), (box, speed - error), (longer, speed)]
        found = [
            measure(scene, along_a_heading(scene, dt, heading, _motion(each, steps, start))) for each, start in starts
        ]
        value, *others = (each[metric][0] for each in found)
        if value is None or None in others:
            return None
        *moved, other = (abs(each - value) for each in others if each is not None)
        # One step of the solver has an error `error` in speed, which over the run is an error in position, and at both
        # ends of the mean over a third of the run.
        floor = error * (6.0 / scene.duration if metric == "braking" else scene.duration)
        # On the edge between two paths (one hop more or less) the engine takes either.
        factor = SPREAD_FACTOR if max(moved) <= BLURRED * abs(value) else 2.0
        return value, factor * max(moved) + 2.0 * other + floor

    return law


# ---- a blow without a load ---------------------------------------------------------------------------------------


def blow_law(profile: str, metric: str) -> Law:
    """A blow between two bodies: the separation speed determines the impulse, and that everything."""

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        touch = blow_of(scene)
        if touch is None:
            return None
        blow = touch.as_found(dt)
        contact, steps = law_of(profile, scene, dt), steps_of(scene, dt)
        runs = [metrics_of(scene, blow, blow.after(contact, steps, k * GAP_ROUND_OFF)) for k in (0.0, *PERTURBATIONS)]
        if metric not in runs[0]:
            return None
        value, *others = (run[metric] for run in runs)
        scale = 1.0 / blow.inverse_mass * blow.closing if metric == "impulse" else max(1.0, blow.closing)
        band = SPREAD_FACTOR * max(abs(other - value) for other in others) + SUM_ROUND_OFF * scale
        # The solver has its error in every step of a contact; for ratios of speeds and energies alike.
        band += solver_error(profile, scene, dt) * (scale if metric == "impulse" else 1.0)
        if metric == "impulse":
            band += _force_round_off(contact) * scale
        # The loss is relative to the energy of a blow found when the bodies touch.
        found = blow.energy / touch.energy if metric == "energy_lost" else 1.0
        return value * found, band * found

    return law
