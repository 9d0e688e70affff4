"""Deviation laws of Bullet: its contact law as a scalar recurrence, measured like the engine itself.

`adapters.bullet.contact_law` computes one ball over a fixed face from the scene and the step only. The result becomes a
trajectory and is measured by the scene's own metrics, so a prediction and a measurement differ by physics only.

The validity of a prediction is computed as well: the same recurrence runs with a gap changed by round-off. Speculative
contacts turn an error d of the gap into an error d/dt of speed, and the next flight turns that into an error 2 v d/(g
dt) of the gap; after some impacts none of the sixteen digits is left, and the law makes no prediction.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from adapters.bullet.contact_law import ContactLaw, Fall, fall
from adapters.bullet.profiles import PROFILES, law_of
from adapters.bullet.rolling import rolling_law
from adapters.bullet.shipped import CHECKED_ON, SPLIT_DEPTH
from adapters.engine import Contacts
from adapters.law import Deviation, Law, Measure, Prediction, deviations, exactly
from adapters.law.moved_starts import BLURRED, GAP_ROUND_OFF, PERTURBATIONS, SPREAD_FACTOR, SUM_ROUND_OFF, scale_of
from adapters.law.single_precision import Held
from adapters.law.unswept import passing_law, shoved_law
from adapters.needs import needs
from adapters.scene import Disc, HalfSpace, Scene, Sphere
from adapters.stepping import step_count
from adapters.trajectory import ContactRecord, Measured, Trajectory


def _is_one_ball_over_a_floor(scene: Scene) -> bool:
    """A half-space facing up and one free ball that moves only up and down."""
    if len(scene.bodies) != 2:
        return False
    d = scene.dimension
    face, body = scene.bodies
    upright = isinstance(face.shape, HalfSpace) and face.shape.normal[: d - 1] == (0.0,) * (d - 1)
    straight = not (any(body.twist[: d - 1]) or any(body.twist[d:]) or any(scene.gravity[: d - 1]))
    loaded = any(body.force) or any(body.torque)
    return upright and straight and not loaded and isinstance(body.shape, Disc | Sphere)


def _as_trajectory(scene: Scene, dt: float, path: Fall) -> Trajectory:
    """The trajectory that the step loop would record of this fall."""
    d, steps = scene.dimension, len(path.gap)
    face, body = scene.bodies
    assert isinstance(face.shape, HalfSpace) and isinstance(body.shape, Disc | Sphere)
    pose = np.empty((steps, 2, 3 if d == 2 else 7))
    pose[:] = [b.pose for b in scene.bodies]
    twist = np.zeros((steps, 2, 3 if d == 2 else 6))
    pose[:, 1, d - 1] = path.gap + body.shape.radius + face.shape.offset
    twist[:, 1, d - 1] = path.velocity
    up = np.ones((steps, 1)) * np.array(face.shape.normal)
    first, second = np.zeros(steps, np.int64), np.ones(steps, np.int64)
    impulse = body.mass * path.impulse[:, None] * up
    rows = Contacts(first, second, np.zeros_like(up), up, impulse, path.gap)
    contacts = ContactRecord(np.arange(steps), np.arange(steps + 1), rows)
    times = np.array([k * dt for k in range(steps)])
    return Trajectory(times, pose, twist, contacts, dt, "completed")


def _measured(scene: Scene, dt: float, measure: Measure, law: ContactLaw, offset: float) -> dict[str, Measured]:
    """All metrics of the scene for a start ``offset`` [m] higher."""
    up, (face, body) = scene.dimension - 1, scene.bodies
    assert isinstance(face.shape, HalfSpace) and isinstance(body.shape, Disc | Sphere)
    gap = body.pose[up] - face.shape.offset - body.shape.radius + offset
    e = scene.material(face.name, body.name).restitution
    steps = step_count(scene.duration, dt)
    path = fall(law, body.shape.radius, gap, body.twist[up], e, -scene.gravity[up], dt, steps)
    return measure(scene, _as_trajectory(scene, dt, path))


@lru_cache(maxsize=4096)
def _predictions(profile: str, held: Held, dt: float, measure: Measure) -> dict[str, Prediction]:
    """Value and band of every metric that can be predicted."""
    scene = held.scene
    law = law_of(profile, needs(scene), dt)
    runs = [_measured(scene, dt, measure, law, k * GAP_ROUND_OFF) for k in (0.0, *PERTURBATIONS)]
    predictions = {}
    for metric, (value, reason) in runs[0].items():
        others = [run[metric][0] for run in runs]
        if reason.startswith("there is no apex") and value == 0.0:
            # The ball rests at 0 .. -slop, with a velocity of round-off that the metric may take for an arc.
            predictions[metric] = (-0.5 * law.slop, 0.5 * law.slop + GAP_ROUND_OFF / dt)
            continue
        if value is None or reason.startswith("there are only") or any(other is None for other in others):
            continue
        spread = max(abs(other - value) for other in others if other is not None)
        scale = scale_of(scene, metric)
        # Round-off of a gap becomes a speed once: over dt, relative to 1 m/s, independent of later steps.
        band = SPREAD_FACTOR * spread + SUM_ROUND_OFF * scale + GAP_ROUND_OFF / dt
        if spread <= BLURRED * scale:
            predictions[metric] = (value, band)
    return predictions


def _ball_law(profile: str, metric: str) -> Law:
    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        if not _is_one_ball_over_a_floor(scene):
            return None
        return _predictions(profile, Held(scene), dt, measure).get(metric)

    return law


_BALL_METRICS = {
    "impact": ("rebound_ratio", "rebound_speed", "velocity_change", "impulse", "momentum_defect"),
    "bounce": (
        *(f"apex[{n}]" for n in range(1, 6)),
        "apex_interval_ratio",
        "apex_growth",
        "rest_time",
        "force_in_flight",
    ),
}
_BECAUSE = {
    "default": "speculative contact subtracts gap/dt from a rebound, Baumgarte correction adds 8 % of an overlap "
    "over dt, restitution includes gravity's g dt and is dropped below 0.2 m/s, and drag 0.04 (1 + v) v "
    "brakes the flight",
    "tuned": "an impact is found up to v dt late and rebounds from there; one found within the slop loses slop/dt "
    "of its rebound; with the settings for rest 8 % of an overlap per step become speed",
    "one": "Baumgarte correction adds 1 % of the overlap at an impact, over dt, to the rebound",
}
_SOURCE = {
    "default": "btMultiBodyConstraintSolver.cpp:770-815, btMultiBody.cpp:843, btMultiBody.h:486 (bullet3 6c888f4)",
    "tuned": "btSequentialImpulseConstraintSolver.cpp:902-970 (bullet3 6c888f4)",
    "one": "btSequentialImpulseConstraintSolver.cpp:902-970 (bullet3 6c888f4)",
}


DEVIATIONS: tuple[Deviation, ...] = tuple(
    Deviation(
        "bullet",
        (profile,),
        scene,
        exactly(metric),
        _ball_law(profile, metric),
        _BECAUSE[profile],
        _SOURCE[profile],
        CHECKED_ON,
    )
    for profile in ("default", "tuned", "one")
    for scene, metrics in _BALL_METRICS.items()
    for metric in metrics
)

DEVIATIONS += deviations(
    "bullet",
    ("tuned", "one"),
    {"thin_wall": ("rebound_ratio", "beyond")},
    lambda metric, profile: passing_law(metric),
    "there is no swept collision detection: no step ends with the ball in the plate, so the contact is never found",
    "contactProcessingThreshold 0: btPersistentManifold.cpp (bullet3 6c888f4); ccdSweptSphereRadius is not set",
    CHECKED_ON,
)


def _split_push(scene: Scene, dt: float, overlap: float) -> float:
    """Correction in `one`, in the next step: from 4 cm on by places only, else slower than the ball."""
    chosen: dict[str, float] = {s.name: s.value for s in PROFILES["one"](needs(scene), dt)}
    if overlap <= SPLIT_DEPTH:
        return 0.0
    return chosen["contactERP"] * max(0.0, overlap - chosen["contactSlop"]) / dt


DEVIATIONS += tuple(
    Deviation(
        "bullet",
        (profile,),
        "thin_wall",
        metric,
        shoved_law(metric, push),
        "there is no swept collision detection: the step that finds the ball in the plate finds it beyond the "
        "middle, and pushes it out on the far side",
        "contactProcessingThreshold 0, contactERP 0 or 0.01: btPersistentManifold.cpp (bullet3 6c888f4)",
        CHECKED_ON,
    )
    for profile, push in (("tuned", None), ("one", _split_push))
    for metric in ("rebound_ratio", "beyond")
)

DEVIATIONS += deviations(
    "bullet",
    ("default",),
    {
        "slide_to_roll": ("final_speed", "rolling_time", "rolling_place"),
        "roll_incline": ("acceleration", "turning"),
        "rolling_spin": ("spin", "speed"),
        "masse": ("final_vx", "final_vy", "end_x", "end_y", "turned"),
    },
    rolling_law,
    "drag of the multibody path, 0.04 (1 + v) v and the same for the spin, brakes what slides, rolls and spins; "
    "linearDamping=0 and angularDamping=0 end it",
    "btMultiBody.cpp:843 (bullet3 6c888f4)",
    CHECKED_ON,
)
