"""Errors of a run for comparisons at equal error: one or more numbers per scene, each better if smaller.

    primary   the headline error of a scene of the catalogue, the largest over its variations
    column    top body, largest over all samples: distance aside [m], and above or below its place [m]
    drift     the first of these
    wall      the second of these, of the body that was added last
    heap      at the end: largest overlap of two bodies [m], and kinetic energy [J]

The same code computes them from poses and twists of every engine. The truth is rest, so that any such number is error.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from adapters.isolation.foreign import said_by
from adapters.scene import Scene
from adapters.scene.near import start_overlap
from adapters.stepping import advances, run, step_count
from adapters.trajectory import Trajectory
from validation import metrics
from validation.bench.stopwatch import Lowered
from validation.bench.units import prepared, scene_of
from validation.bounds import ROUND_OFF
from validation.cells import Slot
from validation.files.distance import primary_of
from validation.posed import resolve

#: Time between two samples of a run [s]. A column of ten sways with a period of about a second.
SAMPLE = 0.125


@dataclass(frozen=True)
class Found:
    """Errors of one run by name (with unit), their round-off, and the size of the run.

    Parameters
    ----------
    contacts
        Contact points that the engine reports at the end; None if they were not counted.
    seconds
        CPU time of all runs behind these errors [s].
    reason
        Why there are no errors; empty if there are.
    """

    errors: Mapping[str, float]
    round_off: Mapping[str, float]
    contacts: int | None
    steps: int
    seconds: float
    reason: str = ""

    def is_within(self, other: Found) -> bool:
        """Whether no error exceeds ``other``'s by more than 1 % and round-off; NaN exceeds everything."""
        return not self.reason and all(
            self.errors[name] <= 1.01 * theirs + other.round_off[name] for name, theirs in other.errors.items()
        )


def errors_of(kind: str, slot: Slot, seconds: float, count: bool = True) -> Found:
    """Run a slot and measure its errors, and its contacts if ``count``; for an engine that fails only a reason."""
    started = time.process_time()
    try:
        found = _primary(slot) if kind == "primary" else _sampled(kind, slot, seconds, count)
    except BaseException as failure:  # any error of an engine ends this run only
        found = Found({}, {}, None, 0, 0.0, said_by(failure))
    if not all(map(math.isfinite, found.errors.values())):
        found = Found({}, {}, found.contacts, found.steps, 0.0, "an error is not finite")
    return replace(found, seconds=time.process_time() - started)


def _primary(slot: Slot) -> Found:
    """Headline error as in the bench of the catalogue: the largest over variations that an engine cannot choose."""
    canonical, primary = resolve(slot.scene), primary_of(slot.scene)
    worst, steps, contacts = [], 0, 0
    for params in primary.variations(slot.dt):
        engine, _, settings, _ = prepared(slot.with_params(params))
        scene = canonical.scene(slot.dimension, params)
        trajectory = run(engine, scene, slot.dt, settings, canonical.sampling(scene))
        error, reason = primary.error(scene, slot.dt, canonical.measure(scene, trajectory))
        if trajectory.reason or error is None:
            raise ValueError(trajectory.reason or reason)
        worst.append(error)
        steps = steps or step_count(scene.duration, slot.dt)
        contacts = contacts or (int(np.diff(trajectory.contacts.offset)[-1]) if trajectory.contacts else 0)
    name = f"{primary.name} [{primary.unit}]"
    return Found({name: metrics.largest(worst)}, {name: ROUND_OFF}, contacts, steps, 0.0)


def _sampled(kind: str, slot: Slot, seconds: float, count: bool) -> Found:
    engine, posed, settings, lifted = prepared(slot)
    scene, steps = scene_of(slot), step_count(seconds, slot.dt)
    simulation = engine.build(posed, slot.dt, settings)
    try:
        view = Lowered(simulation) if lifted else simulation
        poses = [np.array(view.pose())]
        for _ in advances(simulation, steps, step_count(SAMPLE, slot.dt)):
            poses.append(np.array(view.pose()))
        twist, contacts = np.array(view.twist()), len(simulation.contacts().a) if count else None
    finally:
        simulation.close()
    if not (np.isfinite(poses).all() and np.isfinite(twist).all()):
        return Found({}, {}, contacts, steps, 0.0, "the state is not finite")
    height = max(abs(body.pose[scene.dimension - 1]) for body in scene.bodies)
    weight = sum(body.mass for body in scene.bodies if body.motion == "free") * math.hypot(*scene.gravity)
    errors = KINDS[kind](scene, np.array(poses), twist)
    rounding = {name: ROUND_OFF * height * (weight if name.endswith("[J]") else 1.0) for name in errors}
    return Found(errors, rounding, contacts, steps, 0.0)


def column(scene: Scene, poses: np.ndarray, twist: np.ndarray) -> dict[str, float]:
    """Largest distances of the last body of ``poses`` (s, n, 3 | 7) from its place: aside, and above or below [m]."""
    moved = poses[:, -1, : scene.dimension] - poses[0, -1, : scene.dimension]
    aside = np.linalg.norm(moved[:, :-1], axis=1)
    return {"drift [m]": metrics.largest(aside), "sag [m]": metrics.largest(np.abs(moved[:, -1]))}


def drift(scene: Scene, poses: np.ndarray, twist: np.ndarray) -> dict[str, float]:
    """Largest distance aside of a column's top [m]."""
    return {"drift [m]": column(scene, poses, twist)["drift [m]"]}


def wall(scene: Scene, poses: np.ndarray, twist: np.ndarray) -> dict[str, float]:
    """Largest distance of a wall's top above or below its place [m]."""
    return {"sag [m]": column(scene, poses, twist)["sag [m]"]}


def heap(scene: Scene, poses: np.ndarray, twist: np.ndarray) -> dict[str, float]:
    """Largest overlap [m] at the last of ``poses`` (s, n, 3 | 7), and kinetic energy [J] of ``twist`` (n, 3 | 6)."""
    end = Trajectory(np.zeros(1), poses[-1:], twist[None], None, 1.0, "completed")
    bodies = (
        replace(body, pose=tuple(pose.tolist())) if body.motion == "free" else body
        for body, pose in zip(scene.bodies, poses[-1], strict=True)
    )
    depths = start_overlap(replace(scene, bodies=tuple(bodies))).values()
    return {
        "overlap [m]": metrics.largest([0.0, *depths]),
        "kinetic energy [J]": float(metrics.kinetic_energy(scene, end)[0]),
    }


KINDS: Mapping[str, Callable[[Scene, np.ndarray, np.ndarray], dict[str, float]]] = {
    "column": column,
    "drift": drift,
    "wall": wall,
    "heap": heap,
}
