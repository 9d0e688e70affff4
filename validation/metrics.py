"""Metrics: pure functions of a trajectory, the same for every engine."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from adapters.engine import Array
from adapters.receipts import QUANTITIES
from adapters.scene import Scene
from adapters.scene.near import near_pairs
from adapters.scene.shapes import reach as reach
from adapters.trajectory import Trajectory
from reference_solver.geometry import rotation
from validation.canonical import Measured
from validation.geometry import deepest, overlap

UNAVAILABLE = "the engine does not tell the impulses of these contacts"
#: Reason for single contacts of bodies with edges, in a 2-D scene on a 3-D engine.
SEVERAL = "a corner of the plane is an edge in space, with contacts at both its ends"
#: Reasons of a missing value that are no failure of the motion.
UNTOLD = (UNAVAILABLE, SEVERAL)
#: Reason of a missing value of a stored run that was made before its scene had this check.
NEWER = "the check is newer than this run"
#: Reason of a missing force where no step was recorded with contacts.
NOT_RECORDED = "contacts were not recorded"
#: Statistics of a quantity that is known step by step; spread is the standard deviation.
OVER_TIME: Mapping[str, Callable[[Array], float]] = {
    "mean": lambda steps: float(np.mean(steps)),
    "least": lambda steps: float(np.min(steps)),
    "greatest": lambda steps: float(np.max(steps)),
    "spread": lambda steps: float(np.std(steps)),
}
#: Words for a missing rebound.
SILENT = "does not rebound"
#: Largest distance of a 2-D scene from its plane on a 3-D engine [m]; measured at the samples.
OUT_OF_PLANE = "out_of_plane"
#: Begin of the metrics of property checks that do not hold: what an engine realises of a property.
REALISED = "realised_"
#: Meaning of a metric's value in words, for readers of reports. ``name=0`` is for the value 0, ``name<0`` takes the
#: size of a negative value: creeping down at -0.003 m/s is creeping up. A scene has words for its other metrics
#: (`CanonicalScene.words`).
WORDS = {
    "rebound_ratio": "rebounds at {value}",
    "rebound_ratio=0": SILENT,
    "rebound_ratio<0": "moves on with {value} of its speed",
    "creep": "creeps at {value} where it should stick",
    "creep<0": "creeps uphill at {value} where it should stick",
    "acceleration": "slides with {value}",
    "acceleration<0": "slides uphill with {value}",
    "settle_time": "settles after {value}",
    "drift": "drifts sideways by {value}",
    "penetration": "overlaps by {value}",
    "interface_impulse": "carries {value} of the weight above an interface",
    "kinetic_energy": "keeps {value} of motion",
    "impulse_scatter": "shakes: loads scatter by {value}",
    "rest_time": "rests after {value}",
    "hop": "leaves the floor, up or down, by {value}",
    "astray": "strays sideways by {value}",
    OUT_OF_PLANE: "leaves its plane by {value}",
} | {REALISED + quantity: f"realises a {quantity.replace('_', ' ')} of {{value}}" for quantity in QUANTITIES}
#: Reason of a missing time: the value was never reached.
NOT_PASSED = "it never arrives there"
#: Start of the reason where a time is only the end of the run: the motion never came to rest.
NEVER = "never settled"


def realised(quantity: str) -> str:
    """Metric of a property check (`adapters.receipts.QUANTITIES`)."""
    return REALISED + quantity


def total_impulse(trajectory: Trajectory, a: int, b: int) -> tuple[Array | None, str]:
    """Impulse on body b (the higher index) from body a over all recorded contacts, (d,) [N s]."""
    if trajectory.contacts is None:
        return None, "contacts were not recorded"
    total = trajectory.contacts.impulse_between(a, b).sum(axis=0)
    return (None, UNAVAILABLE) if np.isnan(total).any() else (total, "")


def late_impulses(trajectory: Trajectory, a: int, b: int, window: float) -> Array | None:
    """Impulses on body b from body a, step by step over the last ``window`` s, (s, d) [N s]; None if not reported."""
    contacts = trajectory.contacts
    if contacts is None:
        return None
    late = trajectory.t[contacts.step] > trajectory.t[-1] - window
    found = contacts.impulse_between(a, b)[late]
    return None if len(found) == 0 or np.isnan(found).any() else found


def forces(
    trajectory: Trajectory, body: int, others: Iterable[int], after: float = -math.inf, until: float = math.inf
) -> Array:
    """Force on ``body`` of all its contacts with ``others``, step by step, (s, d) [N].

    The force of a step is its impulse over the step: engines report no more. NaN where the engine does not report it.

    Parameters
    ----------
    others
        Bodies by index; the body itself is left out.
    after, until
        Steps that end within (after, until] [s]; steps without recorded contacts are left out.
    """
    contacts = trajectory.contacts
    if contacts is None:
        return np.zeros((0, trajectory.dimension))
    chosen = steps_between(trajectory, after, until)
    total = np.zeros((int(chosen.sum()), trajectory.dimension))
    for other in others:
        if other != body:
            sign = 1.0 if body > other else -1.0  # impulses are stored as those on the body with the higher index
            total += sign * contacts.impulse_between(other, body)[chosen]
    return np.asarray(total / trajectory.dt)


def steps_between(trajectory: Trajectory, after: float, until: float) -> NDArray[np.bool_]:
    """Which of the steps with recorded contacts end within (after, until] [s], to half a step; (s,)."""
    assert trajectory.contacts is not None
    end, half = trajectory.t[trajectory.contacts.step], 0.5 * trajectory.dt
    return np.asarray((end > after + half) & (end < until + half))


def over_time(name: str, steps: Array, by: Sequence[str] = ("mean", "least", "greatest")) -> dict[str, Measured]:
    """``name[mean]`` and the other statistics of step values (s,); without a value where a step has none."""
    why = NOT_RECORDED if len(steps) == 0 else UNAVAILABLE if np.isnan(steps).any() else ""
    return {f"{name}[{each}]": (None, why) if why else (OVER_TIME[each](steps), "") for each in by}


def largest(values: Iterable[float]) -> float:
    """Largest of measured values; NaN if one of them is.

    Python's max skips a NaN that is not the first, and a check could pass without a measurement.
    """
    return float(np.max(np.fromiter(values, float)))


def numbers(*series: Array) -> None:
    """Refuse samples that are not finite: a search for a first or last event would skip them.

    Raises
    ------
    ArithmeticError
        If a sample is not finite.
    """
    if not all(np.isfinite(values).all() for values in series):
        raise ArithmeticError("a sample is not a finite number")


def apexes(t: Array, height: Array, velocity: Array, least: float = 0.0) -> tuple[Array, Array]:
    """Times and heights of the tops of all arcs that start faster than ``least`` [m/s].

    An arc ends where the velocity turns from upwards to not upwards; its top is that of the parabola through the
    highest sample and its neighbours (exact for constant gravity, whatever the phase of the samples).
    """
    numbers(height, velocity)
    turns = np.flatnonzero((velocity[:-1] > 0.0) & (velocity[1:] <= 0.0))
    times, tops = [], []
    for turn in turns:
        falling = np.flatnonzero(velocity[: turn + 1] <= 0.0)
        if velocity[falling[-1] + 1 if len(falling) else 0 : turn + 1].max() <= least:
            continue  # chatter of a resting body, not an arc
        first, last = max(1, int(turn) - 1), min(len(height) - 1, int(turn) + 3)
        if last <= first:
            continue
        k = first + int(np.argmax(height[first:last]))
        before, here, after = height[k - 1 : k + 2]
        curvature = before - 2.0 * here + after
        shift = 0.5 * (before - after) / curvature if curvature < 0.0 else 0.0
        shift = float(np.clip(shift, -1.0, 1.0))
        times.append(t[k] + shift * (t[k] - t[k - 1]))
        tops.append(here - 0.25 * (before - after) * shift)
    return np.array(times), np.array(tops)


def interval_ratio(times: Array) -> Measured:
    """Second interval between apexes over the first (apexes 1, 2, 3)."""
    if len(times) < 3:
        return 0.0, f"there are only {len(times)} apexes, three are needed"
    return float((times[2] - times[1]) / (times[1] - times[0])), ""


def last_motion(t: Array, speed: Array, threshold: float) -> Measured:
    """Time after which the speed stays at or below ``threshold`` to the end [s]; the end if it never does."""
    if np.isnan(speed).any():
        return None, "a speed is not a number"
    moving = np.flatnonzero(np.abs(speed) > threshold)
    if len(moving) == 0:
        return 0.0, ""
    if moving[-1] == len(t) - 1:
        return float(t[-1]), f"{NEVER}: still moving at the end of the run"
    return float(t[moving[-1] + 1]), ""


def mean_rate(t: Array, value: Array) -> Measured:
    """Mean rate of change of ``value`` over the second half of the run."""
    middle = len(t) // 2
    return float((value[-1] - value[middle]) / (t[-1] - t[middle])), ""


def free_bodies(scene: Scene) -> list[int]:
    """Indices of the bodies that the engine moves."""
    return [i for i, body in enumerate(scene.bodies) if body.motion == "free"]


def body_speeds(scene: Scene, trajectory: Trajectory) -> Array:
    """Upper bound of the speed of any point of each free body, |v| + |omega| R, (s, bodies) [m/s]."""
    d = scene.dimension
    free = free_bodies(scene)
    linear = np.linalg.norm(trajectory.twist[:, free, :d], axis=2)
    angular = np.linalg.norm(trajectory.twist[:, free, d:], axis=2)
    speeds: Array = linear + angular * np.array([reach(scene.bodies[i].shape) for i in free])
    return speeds


def kinetic_energy(scene: Scene, trajectory: Trajectory) -> Array:
    """Total kinetic energy with the inertia of the scene, (s,) [J]."""
    d = scene.dimension
    total = np.zeros(len(trajectory.t))
    for i in free_bodies(scene):
        body, twist = scene.bodies[i], trajectory.twist[:, i]
        total += 0.5 * body.mass * (twist[:, :d] ** 2).sum(axis=1)
        if d == 2:
            assert isinstance(body.inertia, float | int)
            total += 0.5 * body.inertia * twist[:, 2] ** 2
        else:
            spin = np.einsum("sij,si->sj", rotation(trajectory.pose[:, i]), twist[:, 3:])
            total += 0.5 * (spin**2 @ np.array(body.inertia))
    return total


def lateral_drift(trajectory: Trajectory) -> float:
    """Largest horizontal displacement of any body between start and end [m]."""
    d = trajectory.dimension
    moved = trajectory.pose[-1, :, : d - 1] - trajectory.pose[0, :, : d - 1]
    return float(np.linalg.norm(moved, axis=1).max())


def hop(trajectory: Trajectory, body: int = 1) -> float:
    """Largest change of a body's height, up or down [m]."""
    height = trajectory.pose[:, body, trajectory.dimension - 1]
    return float(np.abs(height - height[0]).max())


def astray(trajectory: Trajectory, line: Array, body: int = 1) -> float:
    """Largest level distance of a body from the ``line`` (d - 1,) through its start [m]; 0 in the plane."""
    way = trajectory.pose[:, body, : trajectory.dimension - 1] - trajectory.pose[0, body, : trajectory.dimension - 1]
    return float(np.linalg.norm(way - np.outer(way @ line, line), axis=1).max())


def turned(pose: Array) -> float:
    """Largest angle of one body's poses, (s, 3) or (s, 7), against the first [rad]."""
    if pose.shape[1] == 3:
        return float(np.abs(pose[:, 2] - pose[0, 2]).max())
    turns = rotation(pose)
    off = np.linalg.norm(turns - turns[0], axis=(1, 2))  # Frobenius: 2 sqrt(2) |sin(angle/2)|
    return float(2.0 * np.arcsin(np.clip(off / (2.0 * np.sqrt(2.0)), 0.0, 1.0)).max())


def tilt(trajectory: Trajectory, body: int = 1) -> Array:
    """Angle of a body in the upright plane along the first axis, counter-clockwise, whole turns counted, (s,) [rad]."""
    pose = trajectory.pose[:, body]
    if trajectory.dimension == 2:
        return np.asarray(pose[:, 2])
    turned = rotation(pose)
    return np.unwrap(np.arctan2(turned[:, 2, 0], turned[:, 0, 0]))


def tilt_rate(trajectory: Trajectory, body: int = 1) -> Array:
    """Spin about the axis of `tilt`, (s,) [rad/s]."""
    return np.asarray(trajectory.twist[:, body, 2] if trajectory.dimension == 2 else -trajectory.twist[:, body, 4])


def point(trajectory: Trajectory, body: int, place: tuple[float, ...]) -> Array:
    """World position of the body's point at ``place`` in body axes, (s, d) [m]."""
    d, pose = trajectory.dimension, trajectory.pose[:, body]
    if d == 3:
        return np.asarray(pose[:, :3] + rotation(pose) @ np.array(place))
    c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
    x, y = place
    return np.asarray(pose[:, :2] + np.column_stack([c * x - s * y, s * x + c * y]))


def crossing(t: Array, value: Array, rate: Array, level: float) -> tuple[Measured, Measured]:
    """Time at which ``value`` first rises through ``level``, and its rate then, on the cubic between two samples."""
    numbers(value, rate)
    over = np.flatnonzero((value[:-1] < level) & (value[1:] >= level))
    if len(over) == 0:
        return (None, NOT_PASSED), (None, NOT_PASSED)
    k = int(over[0])
    h = t[k + 1] - t[k]
    # Cubic of both values and rates, over s from 0 to 1; one root at least lies in between.
    a, b, da, db = value[k], value[k + 1], h * rate[k], h * rate[k + 1]
    cubic = [2.0 * (a - b) + da + db, 3.0 * (b - a) - 2.0 * da - db, da, a - level]
    roots = np.roots(cubic)
    real = roots[np.abs(roots.imag) < 1e-9].real
    inside = real[(real > -1e-9) & (real < 1.0 + 1e-9)]
    s = float(np.clip(inside.min(), 0.0, 1.0)) if len(inside) else float((level - a) / (b - a))
    return (float(t[k] + s * h), ""), (float(np.polyval(np.polyder(np.array(cubic)), s) / h), "")


def relative_error(found: Mapping[str, Measured], truth: Mapping[str, float], names: Iterable[str]) -> Measured:
    """Largest error of these metrics relative to their truths; None and why of the first that has no value."""
    off = []
    for name in names:
        value, reason = found[name]
        if value is None:
            return None, reason
        off.append(abs(value / truth[name] - 1.0))
    return largest(off), ""


def deepest_overlap(scene: Scene, trajectory: Trajectory, pairs: Sequence[tuple[int, int]] | None = None) -> float:
    """Deepest overlap of ``pairs`` of bodies (by default of neighbours in the scene's list) at any sample, >= 0 [m]."""
    bodies, pose = scene.bodies, trajectory.pose
    pairs = list(pairwise(range(len(bodies)))) if pairs is None else pairs
    depths = [deepest(bodies[i].shape, pose[:, i], bodies[j].shape, pose[:, j]) for i, j in pairs]
    return largest([0.0, *depths])


def interface_load(
    trajectory: Trajectory, pairs: Sequence[tuple[int, int]], weight_impulse: float, window: float
) -> tuple[Measured, float | None]:
    """Mean and standard deviation over the last ``window`` seconds of the vertical impulse of ``pairs`` per step.

    Summed over the pairs (a, b), of a on b; both are relative to ``weight_impulse`` [N s], the weight above times dt.
    """
    contacts = trajectory.contacts
    if contacts is None:
        return (None, "contacts were not recorded"), None
    late = trajectory.t[contacts.step] > trajectory.t[-1] - window
    vertical = sum(contacts.impulse_between(a, b)[late, -1] for a, b in pairs) / weight_impulse
    if len(vertical) == 0 or np.isnan(vertical).any():
        return (None, UNAVAILABLE), None
    return (float(vertical.mean()), ""), float(vertical.std())


def overlaps(scene: Scene, trajectory: Trajectory) -> dict[tuple[int, int], Array]:
    """Depth of the overlap of every pair that overlaps, by body indices; each (s,) [m]."""
    found = {}
    for i, j in near_pairs(scene, trajectory.pose):
        a, b = scene.bodies[i].shape, scene.bodies[j].shape
        depth = overlap(a, trajectory.pose[:, i], b, trajectory.pose[:, j])
        if depth.any():
            found[i, j] = depth
    return found
