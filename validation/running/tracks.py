"""Recordings: data of a replay, for one cell per scene, dimension, engine and profile.

    trajectory (every step, 64 bit)  ->  recording (60 Hz, 16 bit, impulses summed per pair)  ->  bytes in the store

Nothing is judged from a recording: metrics come from the trajectory. Only the time at which the motion left its
tolerances is computed here, from the full trajectory, and stored with it.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from dataclasses import dataclass
from io import BytesIO

import numpy as np
from numpy.typing import NDArray

from adapters.engine import Array
from adapters.needs import needs
from adapters.scene import Scene
from adapters.stages import stage
from adapters.trajectory import ContactRecord, Trajectory
from validation.canonical import CanonicalScene
from validation.cells import Slot
from validation.posed import resolve
from validation.running.plan import QUICK_DT

#: Frames per second of a screen.
RATE = 60.0
#: Fewest frames of a recording: an impact scene lasts half a second only.
FRAMES = 120
_LEVELS = 2**15 - 1


@dataclass(frozen=True)
class Recording:
    """A trajectory for display.

    Parameters
    ----------
    t
        Frame times [s], (f,).
    pose
        (f, n, 3) planar or (f, n, 7) spatial, rounded to 1/32767 of half its range.
    frame, pair, point, impulse
        Contacts, one per touching pair and frame: index of the frame (c,), body indices (c, 2), mean point (c, d)
        and impulse on the second body since the frame before (c, d) [N s]. Empty where the engine reports none.
    departure
        First time at which the tracked body left the tube of `tube` [s]; None if it never did.
    finish
        As in `adapters.trajectory.Trajectory`.
    """

    t: Array
    pose: Array
    frame: NDArray[np.int64]
    pair: NDArray[np.int64]
    point: Array
    impulse: Array
    departure: float | None
    finish: str

    @stage("recording the motion")
    def to_bytes(self) -> bytes:
        """Compressed numpy archive with 16-bit poses, points and impulses."""
        arrays: dict[str, NDArray[np.generic]] = {"t": self.t, "frame": self.frame, "pair": self.pair}
        for name in ("pose", "point", "impulse"):
            arrays |= _quantised(name, getattr(self, name))
        meta = json.dumps({"departure": self.departure, "finish": self.finish})
        stream = BytesIO()
        np.savez_compressed(stream, meta=np.array(meta), **arrays)  # type: ignore[arg-type]
        return stream.getvalue()


def recording_from_bytes(data: bytes) -> Recording:
    """Inverse of `Recording.to_bytes`."""
    with np.load(BytesIO(data), allow_pickle=False) as a:
        meta = json.loads(str(a["meta"]))
        real = {k: a[k] * a[f"{k}_scale"] + a[f"{k}_middle"] for k in ("pose", "point", "impulse")}
        return Recording(a["t"], real["pose"], a["frame"], a["pair"], real["point"], real["impulse"], **meta)


def _quantised(name: str, values: Array) -> dict[str, NDArray[np.generic]]:
    """16-bit integers with a middle and a scale per component (last axis)."""
    flat = values.reshape(-1, values.shape[-1])
    low, high = (flat.min(0), flat.max(0)) if len(flat) else (np.zeros(flat.shape[1]),) * 2
    middle, scale = 0.5 * (low + high), np.maximum(0.5 * (high - low), 1e-12) / _LEVELS
    return {
        name: np.round((values - middle) / scale).astype(np.int16),
        f"{name}_middle": middle,
        f"{name}_scale": scale,
    }


def representatives(slots: Iterable[Slot]) -> set[Slot]:
    """Slots whose motion is recorded: per scene and dimension the same parameters and step for every profile.

    The scene's representative cell at dt = 1/240 and the profile's own iterations is preferred; otherwise the closest
    slot of the plan.
    """
    chosen: dict[tuple[str, int], dict[tuple[str, str], Slot]] = {}
    candidates = [slot for slot in slots if slot.ulp == 0]
    for slot in sorted(candidates, key=_distance):
        series = chosen.setdefault((slot.scene, slot.dimension), {})
        first = next(iter(series.values()), slot)
        brought = resolve(slot.scene).brought(slot.engine, slot.base)
        own_step = brought is not None and slot.dt == brought.dt  # a model's own step is its own
        if slot.params == first.params and (slot.dt == first.dt or own_step):
            series.setdefault((slot.engine, slot.profile), slot)
    return {slot for series in chosen.values() for slot in series.values()}


def _distance(slot: Slot) -> tuple[bool, float, bool, int]:
    """How far a slot is from the preferred one; ties keep the order of the plan."""
    own = slot.iterations is None
    canonical = resolve(slot.scene)
    other = slot.params != canonical.minimal(canonical.representative)
    return other, abs(math.log(slot.dt / QUICK_DT)), not own, -(slot.iterations or 0)


@stage("recording the motion")
def record(canonical: CanonicalScene, scene: Scene, trajectory: Trajectory) -> Recording:
    """Reduce a trajectory to its recording."""
    t = trajectory.t
    every = min(1.0 / RATE, t[-1] / FRAMES) if t[-1] > 0.0 else 1.0
    wanted = np.arange(0.0, t[-1] + 0.5 * every, every)
    chosen = np.unique(np.searchsorted(t, wanted - 1e-9).clip(max=len(t) - 1))
    frame, pair, point, impulse = _loads(trajectory.contacts, chosen, scene.dimension)
    gone = departure(canonical, scene, trajectory)
    return Recording(t[chosen], trajectory.pose[chosen], frame, pair, point, impulse, gone, trajectory.finish)


def _loads(
    contacts: ContactRecord | None, chosen: NDArray[np.int64], dimension: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], Array, Array]:
    """Contacts summed per pair over the steps between two frames; the point is the mean weighted by impulse."""
    if contacts is None:
        return np.zeros(0, np.int64), np.zeros((0, 2), np.int64), np.zeros((0, dimension)), np.zeros((0, dimension))
    rows = contacts.rows
    frames = np.searchsorted(chosen, np.repeat(contacts.step, np.diff(contacts.offset)))
    size = np.sqrt((rows.impulse * rows.impulse).sum(axis=1))
    acting = np.flatnonzero(np.isfinite(size) & (size > 0.0) & (frames < len(chosen)))
    keys, place = np.unique(np.column_stack([frames, rows.a, rows.b])[acting], axis=0, return_inverse=True)
    weight, point, impulse = np.zeros(len(keys)), np.zeros((len(keys), dimension)), np.zeros((len(keys), dimension))
    np.add.at(weight, place, size[acting])
    np.add.at(point, place, size[acting, None] * rows.point[acting])
    np.add.at(impulse, place, rows.impulse[acting])
    return keys[:, 0], keys[:, 1:], point / weight[:, None], impulse


@dataclass(frozen=True)
class Tube:
    """Tolerance of a body's distance from its exact motion: distance [m], and time per impact [s]."""

    distance: float
    per_impact: float


def tube(canonical: CanonicalScene, scene: Scene, dt: float, speed: float) -> Tube:
    """Derive the tube around an exact motion with top speed ``speed`` [m/s].

    Distance: an impact found up to one step late displaces the path by (1 + e) v dt; added are the tolerances of the
    checks over the run, and g dt^2 of one step of free fall. Time: an impact found a step late changes its speed by up
    to (1 - e^2)/e g dt, and so all later flights by 2 (1 + e)/e dt.
    """
    e, duration = needs(scene).restitution, scene.duration
    reach = {"m": 1.0, "m/s": duration, "m/s^2": 0.5 * duration**2}
    allowed = [check.bound * reach[check.unit] for check in canonical.checks(scene, dt)
               if check.unit in reach and check.bound is not None and math.isfinite(check.bound)]  # fmt: skip
    step = needs(scene).gravity * dt * dt
    later = 2.0 * (1.0 + e) / e if e > 0.0 else 0.0
    return Tube((1.0 + e) * speed * dt + max([step, *allowed]), (1.0 + later) * dt)


def departure(canonical: CanonicalScene, scene: Scene, trajectory: Trajectory) -> float | None:
    """First time at which the tracked body is outside the tube [s]; None if never, or without an exact motion."""
    track = canonical.track(scene)
    if track is None:
        return None
    d, t = scene.dimension, trajectory.t
    exact = np.array([track.position(float(s)) for s in t])
    seen = trajectory.pose[:, scene.index(track.body), :d]
    rate = np.diff(exact, axis=0) / np.diff(t)[:, None] if len(t) > 1 else np.zeros((1, d))
    allowed = tube(canonical, scene, trajectory.dt, float(np.linalg.norm(rate, axis=1).max()))
    # An impact of the exact motion turns a component of its velocity from falling to rising.
    turned = np.concatenate([[0], np.cumsum((rate[1:, -1] > 0.0) & (rate[:-1, -1] < 0.0)), [0]])[: len(t)]
    turned[-1] = turned[-2] if len(t) > 1 else 0
    for k in np.flatnonzero(np.linalg.norm(seen - exact, axis=1) > allowed.distance):
        slack = trajectory.dt + allowed.per_impact * turned[k]
        near = np.abs(t - t[k]) <= slack
        # Distance to the path between samples, not to the samples: those are v dt apart.
        if _distance_to_path(seen[k], exact[near]) > allowed.distance:
            return float(t[k])
    return None


def _distance_to_path(point: Array, path: Array) -> float:
    if len(path) == 1:
        return float(np.linalg.norm(point - path[0]))
    start, along = path[:-1], np.diff(path, axis=0)
    length = np.maximum((along**2).sum(axis=1), 1e-300)
    share = np.clip(((point - start) * along).sum(axis=1) / length, 0.0, 1.0)
    return float(np.linalg.norm(start + share[:, None] * along - point, axis=1).min())
