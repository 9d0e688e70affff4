"""What is timed: scenes of the catalogue, at any size if they have one, and the bench's own (`bench.scenes`).

Piles are scenes of the catalogue: columns of n bodies, and the wall of r rows of boxes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from adapters.engine import Array, Engine
from adapters.needs import needs
from adapters.registry import find, load
from adapters.scene import Scene
from adapters.stepping import posed_for, step_count
from validation.bench.scenes import OWN
from validation.bench.timing import Purpose
from validation.cells import Slot, settings_of
from validation.files.distance import primary_of
from validation.posed import resolve

#: A pile is timed after this time in contact, for as long again [s]: 24 steps of 1/240 s.
SETTLING = 0.1
#: A body that has moved by half a side no longer stands in its place: the pile collapsed, or was pushed apart.
COLLAPSED = 0.5
PILE_DT = 1.0 / 240.0


@dataclass(frozen=True)
class Unit:
    """One thing to time.

    Parameters
    ----------
    warm_up, steps
        Steps before the timed call and within it.
    error
        Headline error, measured before; None for scenes of the bench, whose error is measured on the timed simulation
        itself.
    """

    purpose: Purpose
    slot: Slot
    cell: str
    bodies: int
    warm_up: int
    steps: int
    error: float | None = None
    sampled: bool = False

    @property
    def group(self) -> tuple[Any, ...]:
        """Key of units that are timed next to each other: same scene, size, step and purpose."""
        slot = self.slot
        iterations = slot.iterations if self.purpose == "iterations" else None
        return self.purpose, slot.scene, slot.dimension, slot.params, slot.dt, iterations, self.sampled

    @property
    def series(self) -> tuple[Any, ...]:
        """Key of units that differ in size only."""
        slot = self.slot
        return self.purpose, slot.scene, slot.dimension, slot.engine, slot.profile, slot.iterations


def work_unit(slot: Slot, cell: str, error: float | None, sampled: bool = False) -> Unit:
    """Unit of a work point, timed in the state that its scene declares (`validation.canonical.Primary`)."""
    primary, scene = primary_of(slot.scene), scene_of(slot)
    warm_up = step_count(primary.warm_up, slot.dt) if primary.warm_up else 0
    steps = step_count(primary.window or scene.duration, slot.dt)
    return Unit("work", slot, cell, _free(scene), warm_up, steps, error, sampled)


def overhead_units(engines: Sequence[tuple[str, str]], dimensions: Sequence[int]) -> Iterator[Unit]:
    """Empty scene and one free body for every ``(engine, profile)``, plain and sampled; one second of steps each."""
    for dimension in dimensions:
        for name in ("empty", "free"):
            for engine, profile in engines:
                slot = Slot(name, (), dimension, engine, profile, PILE_DT)
                steps = step_count(1.0, PILE_DT)
                for sampled in (False, True):
                    if runs(slot):
                        yield Unit("overhead", slot, "", _free(scene_of(slot)), 1, steps, None, sampled)


def size_units(
    engines: Sequence[tuple[str, str]],
    dimensions: Sequence[int],
    scenes: Sequence[tuple[str, str]],
    counts: Sequence[int],
    rows: Sequence[int],
) -> Iterator[Unit]:
    """Scenes of n bodies (name, and its parameter n) and pyramids of r rows, at the profile's own iteration count."""
    sizes = [(scene, parameter, n) for scene, parameter in scenes for n in counts]
    sizes += [("pyramid", "rows", r) for r in rows]
    for dimension in dimensions:
        for scene, parameter, size in sizes:
            for engine, profile in engines:
                slot = Slot(scene, ((parameter, float(size)),), dimension, engine, profile, PILE_DT)
                if runs(slot):
                    yield _pile_unit("bodies", slot)


def iteration_units(
    engines: Sequence[tuple[str, str]], dimensions: Sequence[int], counts: Sequence[int], rows: int
) -> Iterator[Unit]:
    """One pyramid at several iteration counts, for profiles with such a setting."""
    for dimension in dimensions:
        for count in counts:
            for engine, profile in engines:
                slot = Slot("pyramid", (("rows", float(rows)),), dimension, engine, profile, PILE_DT, count)
                if runs(slot):
                    yield _pile_unit("iterations", slot)


def _pile_unit(purpose: Purpose, slot: Slot) -> Unit:
    steps = step_count(SETTLING, slot.dt)
    return Unit(purpose, slot, "", _free(scene_of(slot)), steps, steps)


def runs(slot: Slot) -> bool:
    """Whether the engine is installed, has the dimension, and has an iteration count if the slot sets one."""
    engine = find(slot.engine).engine
    if engine is None or not engine.facts.dimensions & ({2, 3} if slot.dimension == 2 else {3}):
        return False
    if slot.iterations is None:
        return True
    return any(s.name == "iterations" for s in engine.settings(slot.base, needs(scene_of(slot)), slot.dt))


@lru_cache(maxsize=64)
def scene_of(slot: Slot) -> Scene:
    """Scene of a slot: one of the bench's own, else the catalogue's."""
    make = OWN.get(slot.scene) or resolve(slot.scene).scene
    return make(slot.dimension, dict(slot.params))


def _free(scene: Scene) -> int:
    return sum(body.motion == "free" for body in scene.bodies)


def prepared(slot: Slot) -> tuple[Engine, Scene, dict[str, Any], bool]:
    """Engine, scene in its dimension, values of its settings, and whether the scene was embedded in 3-D."""
    engine, scene = load(slot.engine), scene_of(slot)
    settings = settings_of(engine, slot, scene)
    posed = posed_for(engine, scene)
    return engine, posed, {setting.name: setting.value for setting in settings}, posed.dimension != scene.dimension


def own_error(scene: Scene, time: float, start: Array, pose: Array) -> float | None:
    """Error of a scene of the bench at ``time`` [s]; None without free bodies.

    Piles: largest displacement of a body since the start, in sides. Free body: distance from the exact fall [m].
    ``start`` has the poses before the first step as the engine reports them: changes of poses by an adapter are
    declared elsewhere, and add up over a tall pile.
    """
    free = [i for i, body in enumerate(scene.bodies) if body.motion == "free"]
    if not free:
        return None
    d = scene.dimension
    expected = start[free, :d]
    if scene.name == "free":
        expected = expected + 0.5 * time**2 * np.array(scene.gravity)
    moved = np.linalg.norm(pose[free, :d] - expected, axis=1)
    return float(moved.max()) if np.isfinite(moved).all() else math.inf
