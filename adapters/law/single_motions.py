"""Shared laws of single precision: places too far away, a box on its corner in 2-D, momentum, a long flight."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Literal

import numpy as np

from adapters.engine import Array, Contacts
from adapters.law import Deviation, Law, Measure, Prediction, deviations
from adapters.law.single_precision import ROUNDINGS, UNIT
from adapters.scene import Body, Box, Disc, HalfSpace, Scene, Sphere
from adapters.stepping import step_count
from adapters.trajectory import ContactRecord, Trajectory

#: ``(units_per_metre, skin [length])`` of a profile for a scene and a step.
Chosen = Callable[[Scene, float], tuple[float, float]]


def standstill_law(metric: str, chosen: Chosen) -> Law:
    """A sliding box does not move if its motion of a step is below half the spacing of single-precision numbers.

    No prediction where the motion of a step is kept, or where the box could become faster.
    """

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        if len(scene.bodies) != 2:
            return None
        plate, box = scene.bodies
        x, vx, others = box.pose[0], box.twist[0], box.twist[1:]
        level = not any(scene.gravity[:-1]) and plate.motion == "fixed" and not any((*box.force, *box.torque, *others))
        units, _ = chosen(scene, dt)
        place = np.float32(x * units)
        spacing = abs(float(np.nextafter(place, np.float32(math.copysign(math.inf, vx))) - place)) / units
        if not level or not abs(vx) * dt < 0.5 * spacing:
            return None
        start = np.array([body.pose for body in scene.bodies])
        times = np.array([0.0, step_count(scene.duration, dt) * dt])
        rest = np.zeros((2, 2, len(box.twist)))
        still = Trajectory(times, np.array([start, start]), rest, None, dt, "completed")
        value = measure(scene, still)[metric][0]
        # The motion is lost completely.
        return None if value is None else (value, 0.0)

    return law


def standstills(
    engine: str,
    profiles: Iterable[str],
    rows: Mapping[str, Iterable[str]],
    source: str,
    versions: tuple[str, ...],
    chosen: Callable[[str], Chosen] = lambda profile: lambda scene, dt: (1.0, 0.0),
) -> tuple[Deviation, ...]:
    """`standstill_law` of an engine whose numbers have 24 bits.

    Parameters
    ----------
    rows
        Metrics by scene.
    source
        Where it is seen that the engine computes in single precision.
    chosen
        Units and skin by profile; metres without a skin by default.
    """
    return deviations(
        engine,
        profiles,
        rows,
        lambda metric, profile: standstill_law(metric, chosen(profile)),
        "positions are in single precision: motion of a step below half their spacing (6 cm at 1e6 m) is lost",
        f"{source}; motion in adapters/law/single_motions.py",
        versions,
    )


def corner_law(metric: str, chosen: Chosen, threshold: float) -> Law:
    """A tilted box that lands on one corner without friction, rotation or load, in single precision.

    With the corner ``l`` beside the centre it is ``J = m (1 + e) v/(1 + m l^2/I)``. No prediction where the box
    rebounds and has a skin: a swept body stops within its skin, and turns a little before the blow.

    Parameters
    ----------
    metric, chosen
        The predicted metric, and the settings.
    threshold
        Approach speed up to which restitution is 0 [length/s].
    """

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        units, skin = chosen(scene, dt)
        if not _falls_on_a_corner(scene):
            return None
        floor, box = scene.bodies
        assert isinstance(box.inertia, float | int) and isinstance(floor.shape, HalfSpace)
        e, speed = scene.material(floor.name, box.name).restitution, -box.twist[1]
        if speed * units <= threshold:
            e = 0.0
        if e > 0.0 and skin > 0.0:
            return None
        lever, below = lowest(box)
        landing = (box.pose[1] - below) / speed
        blow = (1.0 + e) * speed / (1.0 / box.mass + lever**2 / box.inertia)
        if not 0.0 < landing < scene.duration - dt:
            return None
        value = measure(scene, _landed(scene, dt, landing, blow, lever))[metric][0]
        if value is None:
            return None
        share = ROUNDINGS * UNIT
        other = measure(scene, _landed(scene, dt, landing, blow * (1.0 + share), lever))[metric][0]
        # The lever arm of the blow is from sine and cosine of a single-precision angle, with its rounding.
        third = measure(scene, _landed(scene, dt, landing, blow, lever * (1.0 + share)))[metric][0]
        assert other is not None and third is not None
        return value, abs(other - value) + abs(third - value) + share * abs(value)

    return law


def _falls_on_a_corner(scene: Scene) -> bool:
    if len(scene.bodies) != 2 or scene.dimension != 2 or any(scene.gravity):
        return False
    floor, box = scene.bodies
    if not isinstance(box.shape, Box) or box.motion != "free" or any((*box.force, *box.torque)):
        return False
    on_the_floor = floor.shape == HalfSpace((0.0, 1.0), 0.0) and floor.motion == "fixed"
    vx, vy, spin = box.twist
    tilted = abs(math.remainder(box.pose[2], 0.5 * math.pi)) > 1e-3
    plain = scene.material(floor.name, box.name).friction == 0.0
    return on_the_floor and plain and tilted and vx == 0.0 and spin == 0.0 and vy < 0.0


def lowest(box: Body) -> tuple[float, float]:
    """The lowest corner against the centre: along +x, and below it [m]."""
    assert isinstance(box.shape, Box)
    a, b = box.shape.half_extents
    c, s = math.cos(box.pose[2]), math.sin(box.pose[2])
    corners = [(c * p - s * q, -(s * p + c * q)) for p in (-a, a) for q in (-b, b)]
    return max(corners, key=lambda corner: corner[1])


def _landed(scene: Scene, dt: float, landing: float, blow: float, lever: float) -> Trajectory:
    """The motion at every step: down, the blow, and away."""
    box = scene.bodies[1]
    assert isinstance(box.inertia, float | int)
    t = np.arange(step_count(scene.duration, dt) + 1, dtype=np.float64) * dt
    hit: Array = (t > landing).astype(float)
    pose = np.broadcast_to(np.array([body.pose for body in scene.bodies]), (len(t), 2, 3)).copy()
    twist = np.broadcast_to(np.array([body.twist for body in scene.bodies]), (len(t), 2, 3)).copy()
    twist[:, 1, 1] += hit * blow / box.mass
    twist[:, 1, 2] += hit * lever * blow / box.inertia
    pose[:, 1, 1] += box.twist[1] * t + hit * (t - landing) * blow / box.mass
    pose[:, 1, 2] += hit * (t - landing) * lever * blow / box.inertia
    rows = Contacts.from_rows([(0, 1, np.zeros(2), (0.0, 1.0), (0.0, blow), 0.0)], 2)
    record = ContactRecord(np.array([int(np.argmax(hit))]), np.array([0, 1], np.int64), rows)
    return Trajectory(t, pose, twist, record, dt, "completed")


def kept_law(metric: str) -> Law:
    """Conservation in blows between balls, however the impulse is shared: the error is the rounding of one blow a pair.

    For relative metrics that are exactly 0, in an engine that solves each blow to its precision; balls only, without
    gravity, load, friction or loss.
    """

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        balls = all(isinstance(body.shape, Disc | Sphere) and body.motion == "free" for body in scene.bodies)
        pairs = list(scene.contact_pairs())
        plain = all(pair.restitution == 1.0 and pair.friction == 0.0 for _, _, pair in pairs)
        loads = any(scene.gravity) or any(any(body.force) or any(body.torque) for body in scene.bodies)
        if not balls or not plain or loads:
            return None
        # By energy no ball is faster than the first; one touches at most six others, half a pair each.
        return 0.0, ROUNDINGS * UNIT * 3.0 * len(scene.bodies)

    return law


def booked_law(metric: str) -> Law:
    """Conservation between two free bodies, one of which spins: one loses what the other receives.

    For metrics that are exactly 0 and grow with the loss: each component of a velocity has the rounding of a
    single-precision number of the size of the fastest, by the scene's own measure.
    """

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        free = len(scene.bodies) == 2 and all(body.motion == "free" for body in scene.bodies)
        loads = any(scene.gravity) or any(any(body.force) or any(body.torque) for body in scene.bodies)
        spins = any(any(body.twist[scene.dimension :]) for body in scene.bodies)  # else `rounded_law` is more precise
        if not free or not spins or loads or any(friction > 0.0 for _, friction in scene.materials()):
            return None
        d, pose = scene.dimension, np.array([body.pose for body in scene.bodies])
        twist = np.array([body.twist for body in scene.bodies])
        fastest = float(np.linalg.norm(twist[:, :d], axis=1).max())
        times, band = np.array([0.0, step_count(scene.duration, dt) * dt]), 0.0
        for body, axis in np.ndindex(2, d):
            end = twist.copy()
            end[body, axis] += ROUNDINGS * UNIT * fastest
            found = Trajectory(times, np.array([pose, pose]), np.array([twist, end]), None, dt, "completed")
            value = measure(scene, found)[metric][0]
            if value is None:
                return None
            band += abs(value)
        return 0.0, band

    return law


#: Roundings of a spin in one update: to the body's axes and back (30 products and sums), a sum, and as many again for
#: the orientation that turns it.
SPUN = 64


def flown_law(metric: str, parts: int = 1) -> Law:
    """Bodies in free flight: each part of a step adds to a velocity and to a place, and each sum is rounded.

    A sum is off by at most half of its spacing, always to one side where the same is added again and again. A velocity
    is off by that of each part, a place by that of each part and by what a velocity is off, over the time. The motion
    is that of velocities first; nothing is said of a spatial body that spins about no principal axis.

    Parameters
    ----------
    parts
        Parts of a step, each with its own update.
    """

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        d, steps = scene.dimension, step_count(scene.duration, dt)
        loads = any(any(body.force) or any(body.torque) for body in scene.bodies)
        if scene.pairs or loads or (d == 3 and metric in ("flip_time", "momentum_drift", "energy_drift")):
            return None
        t = np.array([0.0, steps * dt])
        start, gravity = np.array([body.pose for body in scene.bodies]), np.array(scene.gravity)
        pose, twist = np.array([start, start]), np.array([[body.twist for body in scene.bodies]] * 2)
        fallen = 0.5 * gravity * t[1] * (t[1] + dt / parts)
        pose[1, :, :d] += twist[0, :, :d] * t[1] + fallen
        twist[1, :, :d] += gravity * t[1]
        fastest, farthest = (np.abs(told[:, :, :d]).max(axis=(0, 2)) for told in (twist, pose))
        spun = np.abs(twist[0, :, d:]).max(axis=1)
        rounded = steps * parts * UNIT

        def read(pose: Array, twist: Array) -> float:
            value = measure(scene, Trajectory(t, pose, twist, None, dt, "completed"))[metric][0]
            return math.nan if value is None else value

        value, band = read(pose, twist), 0.0
        for body, axis in np.ndindex(len(start), twist.shape[2]):
            moved, turned = pose.copy(), twist.copy()
            if axis < d:
                moved[1, body, axis] += rounded * (farthest[body] + fastest[body] * t[1])
                turned[1, body, axis] += rounded * fastest[body]
            else:
                turned[1, body, axis] += SPUN * rounded * spun[body]
            band += abs(read(moved, turned) - value)
        return (value, band) if math.isfinite(band) else None

    return law


#: Laws that need nothing of an engine but that it is in single precision, and what they say.
Rounded = Literal["kept", "booked", "flown"]
_BECAUSE: Mapping[Rounded, str] = {
    "kept": "the impulse of every impact is rounded to single precision, 2^-24 relative",
    "booked": "single precision, 2^-24 relative",
    "flown": "each update of a velocity, spin or place is rounded to single precision, 2^-24 relative, and ten seconds "
    "have thousands",
}


def rounded_motions(
    engine: str,
    profiles: Iterable[str],
    rows: Mapping[Rounded, Mapping[str, Iterable[str]]],
    source: str,
    versions: tuple[str, ...],
    parts: Mapping[str, int] = MappingProxyType({}),
) -> tuple[Deviation, ...]:
    """`kept_law`, `booked_law` and `flown_law` of an engine.

    Parameters
    ----------
    rows
        Metrics by scene, of each law.
    source
        Where it is seen that the engine computes in single precision.
    parts
        Parts of a step by profile, where it has several.
    """
    laws: Mapping[Rounded, Callable[[str, str], Law]] = {
        "kept": lambda metric, profile: kept_law(metric),
        "booked": lambda metric, profile: booked_law(metric),
        "flown": lambda metric, profile: flown_law(metric, parts.get(profile, 1)),
    }
    where = f"{source}; band in adapters/law/single_motions.py"
    return tuple(
        each
        for name, own in rows.items()
        for each in deviations(engine, profiles, own, laws[name], _BECAUSE[name], where, versions)
    )
