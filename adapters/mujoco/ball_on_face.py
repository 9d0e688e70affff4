"""MuJoCo's contact law for one ball on a level face, in the plane of its motion: it slides, rolls and bounces.

      z ^    ( )             the problem of `adapters.mujoco.box_on_face` with one contact, below the centre
        |     |
        +-----+------> x     state  x, z, theta (counter-clockwise), vx, vz, omega

The cone is convex, without complementarity: a contact that slips on its edge pushes along ``n - mu t``, so stopping the
slip also lifts the ball.

Source: MuJoCo documentation, "Computation: constraint model", friction cones and primal problem.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from adapters.engine import Array
from adapters.law import Law, Measure, Prediction, settings_of
from adapters.law.moved_starts import BLURRED, GAP_ROUND_OFF, PERTURBATIONS, SPREAD_FACTOR
from adapters.mujoco.box_on_face import BoxOnFace, Triple
from adapters.mujoco.contact_law import ContactLaw
from adapters.mujoco.motions import along_a_heading
from adapters.mujoco.pairs import pair_solreffriction
from adapters.mujoco.predictions import EITHER, EPS, law_of, solver_error
from adapters.mujoco.profiles import PROFILES
from adapters.scene import Disc, HalfSpace, Scene, Sphere
from adapters.stepping import step_count

#: Metrics that are distances, and those that are accelerations over half a run; others are speeds, times and ratios.
WAYS, ACCELERATIONS = ("rolling_place", "hop"), ("acceleration", "turning")
#: Of these and of speeds, those from the spin, at the surface.
SPINS = ("turning", "spin_speed")


@dataclass(frozen=True)
class BallOnFace(BoxOnFace):
    """Constants of the problem, as of a box; ``half_height`` is the radius and ``half_length`` 0."""

    share: float = 1.0

    def _contacts(self, pose: Triple) -> list[tuple[float, float, float]]:
        """Lever arm (along, up) and overlap of the lowest point; a contact lies halfway into the overlap."""
        gap = pose[1] - self.half_height
        return [(0.0, 0.5 * gap - pose[1], gap - self.law.margin)] if gap < self.law.margin else []


@lru_cache(maxsize=64)
def _path(ball: BallOnFace, steps: int, height: float, twist: Triple) -> Array:
    return np.array(ball.path(steps, (0.0, height, 0.0), twist))


def _ball_on_face(profile: str, scene: Scene, dt: float) -> BallOnFace | None:
    """The problem of a scene with one ball and one rough face; None for other scenes."""
    if len(scene.bodies) != 2:
        return None
    face, body = scene.bodies
    friction, shape = scene.material(face.name, body.name).friction, body.shape
    if not (isinstance(shape, Disc | Sphere) and isinstance(face.shape, HalfSpace) and friction):
        return None  # smooth: the scalar law's
    settings, contact = settings_of(PROFILES[profile], scene, dt), law_of(profile, scene, dt)
    own = pair_solreffriction(settings, dt)
    moment = body.inertia[0] if isinstance(body.inertia, tuple) else body.inertia
    return BallOnFace(
        contact,
        settings["cone"],
        friction,
        ContactLaw.of(dt, own, tuple(settings["solimp"]), 1.0).damping if any(own) else contact.damping,
        settings["impratio"],
        0.0,
        shape.radius,
        moment / body.mass,
        (scene.gravity[0], scene.gravity[-1]),
    )


def rolling_law(profile: str, metric: str) -> Law:
    """Prediction for a ball on a level face that moves and turns in one upright plane, measured like the engine's run.

    An elliptic cone does not depend on the heading; a pyramid does, and there is no prediction off its axes.
    """

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        ball, d = _ball_on_face(profile, scene, dt), scene.dimension
        if ball is None:
            return None
        body = scene.bodies[1]
        level = np.array(body.twist[: d - 1])
        speed = float(np.linalg.norm(level))
        heading = level / speed if speed else np.eye(d - 1)[0]
        if np.abs(heading).max() < 1.0 and ball.cone != "elliptic":
            return None
        # Rolling along the heading turns clockwise in the plane that contains it.
        spin = body.twist[2] if d == 2 else -float(np.array([-heading[1], heading[0]]) @ body.twist[3:5])
        steps, off = step_count(scene.duration, dt), solver_error(profile, scene, dt)
        # The same shortfall of the cost turns the ball by as much more as its moment is smaller.
        turn = off / math.sqrt(ball.inertia)
        starts = [(0.0, 0.0, 0.0), (0.0, off, 0.0), (0.0, -off, 0.0), (0.0, 0.0, turn), (0.0, 0.0, -turn)]
        if body.pose[d - 1] > ball.half_height:  # a start that touches exactly has no round-off
            starts += [(k * GAP_ROUND_OFF, 0.0, 0.0) for k in PERTURBATIONS]
        paths = (
            _path(ball, steps, body.pose[d - 1] + up, (speed + more, body.twist[d - 1], spin + faster))
            for up, more, faster in starts
        )
        value, *others = (measure(scene, along_a_heading(scene, dt, heading, path))[metric][0] for path in paths)
        if value is None or None in others:
            return None
        spread = max(abs(other - value) for other in others if other is not None)
        # One step of the solver has an error `off` in speed, which over the run is an error in position. Repeated in
        # each step it is at most a constant acceleration; in speeds and times either sign is as likely.
        unit = scene.duration if metric in WAYS else 1.0 / dt if metric in ACCELERATIONS else 1.0
        share = turn * ball.half_height if metric in SPINS else off
        floor = (share + EPS / (1.0 - ball.law.impedance.deep)) * unit
        factor = max(SPREAD_FACTOR, math.sqrt(steps))
        # Between two paths (one hop more or less) the engine may take either.
        if spread > BLURRED * abs(value):
            return (value, 2.0 * spread + floor) if spread <= EITHER * abs(value) else None
        return value, factor * spread + floor

    return law
