"""Metamorphic relations: how far a changed world is from what it must do, given what the unchanged one did (E72)."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from reference_solver.certificate.relations import Change, permuted
from reference_solver.model import Model
from reference_solver.records import Record
from reference_solver.settings import Settings
from reference_solver.simulation import Simulation


def run(model: Model, settings: Settings, steps: int) -> Record:
    """Return every state of a run."""
    return Simulation(model, settings).record(steps)


def defect(change: Change, model: Model, settings: Settings, steps: int) -> float:
    """Largest difference between the changed world's run and the changed run, in old units [m, rad, m/s, rad/s]."""
    d, old = model.dimension, run(model, settings, steps)
    new = run(change.model(model), change.settings(settings), steps)
    expected = change.pose(old.pose, old.t)
    if d == 3:  # q and -q are one orientation
        expected[..., 3:] *= np.where((expected[..., 3:] * new.pose[..., 3:]).sum(axis=-1) < 0.0, -1.0, 1.0)[..., None]
    pose = np.abs(new.pose - expected)
    twist = np.abs(new.twist - change.twist(old.twist))
    pose[..., :d] /= change.length
    twist[..., :d] *= change.time / change.length
    twist[..., d:] *= change.time
    return float(max(pose.max(), twist.max()))


def canonical_order(model: Model) -> list[int]:
    """Order of the bodies that does not depend on how they were numbered.

    Rows are solved in the order of (A, B, feature), so that the last bits of an answer depend on the numbers of the
    bodies; sorted by what they are, where they are and how they move, equal worlds get equal bits.
    """
    keys = [
        (body.motion, type(body.shape).__name__, repr(body.shape), body.pose, body.twist, body.mass, body.inertia)
        for body in model.bodies
    ]
    return sorted(range(len(keys)), key=keys.__getitem__)


def permutation_defect(model: Model, order: Sequence[int], settings: Settings, steps: int) -> float:
    """Largest difference between a run and the run of the renumbered world."""
    old, new = run(model, settings, steps), run(permuted(model, order), settings, steps)
    index = np.array(order)
    pose, twist = new.pose - old.pose[:, index], new.twist - old.twist[:, index]
    return float(max(np.abs(pose).max(), np.abs(twist).max()))


def doubled(model: Model, change: Change) -> Model:
    """Return a world with a changed second copy of every free body; the others serve both copies."""
    free = [i for i, body in enumerate(model.bodies) if body.motion == "free"]
    index = np.array([*range(len(model.bodies)), *free])
    pairs = np.ix_(index, index)
    bodies = [*model.bodies, *(change.body(model.bodies[i]) for i in free)]
    return Model(model.dimension, bodies, model.gravity, model.restitution[pairs], model.friction[pairs])


def copies_defect(model: Model, change: Change, settings: Settings, steps: int) -> float:
    """Largest difference of either copy from the world alone."""
    old, new = run(model, settings, steps), run(doubled(model, change), settings, steps)
    n = len(model.bodies)
    free = [i for i, body in enumerate(model.bodies) if body.motion == "free"]
    pose, twist = change.pose(old.pose, old.t)[:, free], change.twist(old.twist)[:, free]
    first = max(np.abs(new.pose[:, :n] - old.pose).max(), np.abs(new.twist[:, :n] - old.twist).max())
    second = max(np.abs(new.pose[:, n:] - pose).max(), np.abs(new.twist[:, n:] - twist).max())
    return float(max(first, second))


def reversed_defect(model: Model, settings: Settings, steps: int) -> float:
    """How far a world is from its start after ``steps`` steps, all velocities turned round, and as many again."""
    there = Simulation(model, settings)
    start = there.pose, there.twist
    there.advance(steps)
    bodies = [
        dataclasses.replace(body, pose=tuple(pose), twist=tuple(-twist))
        for body, pose, twist in zip(model.bodies, there.pose, there.twist, strict=True)
    ]
    back = Simulation(dataclasses.replace(model, bodies=bodies), settings)
    back.advance(steps)
    return float(max(np.abs(back.pose - start[0]).max(), np.abs(back.twist + start[1]).max()))
