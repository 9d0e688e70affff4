"""One timing: build a simulation, bring it into the state of interest, and time one call.

    build -> [ a twin runs first, untimed | warm-up steps ] -> clock( advance(n) ) -> read the state -> close

Runs in the timing process (`validation.bench.lane`), which has one thread.
"""

from __future__ import annotations

import gc
import hashlib
import math
import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from adapters.engine import Array, Simulation
from adapters.isolation.foreign import said_by
from adapters.registry import find
from adapters.scene.lift import lower_pose, lower_twist
from adapters.stepping import advances
from validation.bench.units import COLLAPSED, Unit, own_error, prepared, scene_of


@dataclass(frozen=True)
class Lap:
    """Result of one timing: CPU and wall time of the call, CPU time with preparation [s], and the end state."""

    engine_version: str
    seconds: float
    wall_seconds: float
    whole_seconds: float
    state_hash: str
    error: float | None
    void: str = ""


def lap(unit: Unit) -> Lap:
    """Time ``unit`` once; an engine that fails gives a void lap, not an exception."""
    started = time.process_time()
    version = find(unit.slot.engine).version
    try:
        seconds, wall, state, error = _clocked(unit)
    except BaseException as failure:  # any error of an engine ends this lap only
        return Lap(version, 0.0, 0.0, time.process_time() - started, "", None, void=said_by(failure))
    return Lap(version, seconds, wall, time.process_time() - started, state, error, _void(unit, error))


def _void(unit: Unit, error: float | None) -> str:
    if error is not None and not math.isfinite(error):
        return "the state is not finite"
    if unit.purpose in ("bodies", "iterations") and error is not None and error > COLLAPSED:
        return f"the pile did not stand: a box moved by {error:.2g} sides"
    return ""


class Lowered:
    """View of an embedded planar simulation that converts each state to the plane, as a user would for every step."""

    def __init__(self, inner: Simulation) -> None:
        self.inner = inner

    def pose(self) -> Array:
        """Planar poses (n, 3)."""
        return lower_pose(self.inner.pose())

    def twist(self) -> Array:
        """Planar twists (n, 3)."""
        return lower_twist(self.inner.twist())


def _clocked(unit: Unit) -> tuple[float, float, str, float | None]:
    engine, scene, settings, lifted = prepared(unit.slot)
    dt = unit.slot.dt
    if not unit.warm_up:  # the timed call is the whole scene: only a twin can warm caches and predictors
        twin = engine.build(scene, dt, settings)
        twin.advance(unit.steps)
        twin.close()
    simulation = engine.build(scene, dt, settings)
    try:
        view = Lowered(simulation) if lifted else simulation
        start = np.array(view.pose())
        if unit.warm_up:
            simulation.advance(unit.warm_up)
        seconds, wall = _clock(simulation, view, unit.steps, unit.sampled)
        pose, twist = view.pose(), view.twist()
        state = hashlib.sha256((pose + 0.0).tobytes() + (twist + 0.0).tobytes()).hexdigest()[:16]
        error = unit.error
        if unit.purpose != "work":
            error = own_error(scene_of(unit.slot), (unit.warm_up + unit.steps) * dt, start, pose)
        elif not np.isfinite(pose).all():
            error = math.inf
        return seconds, wall, state, error
    finally:
        simulation.close()


def _clock(simulation: Simulation, view: Any, steps: int, sampled: bool) -> tuple[float, float]:
    """CPU and wall time [s] of ``steps`` steps: in one call, or if ``sampled`` one by one, with each state read."""
    gc.disable()  # a collection would add the time for garbage of earlier calls
    try:
        wall, cpu = time.perf_counter(), time.process_time()
        if sampled:
            for _ in advances(simulation, steps):
                view.pose()
                view.twist()
        else:
            simulation.advance(steps)
        return time.process_time() - cpu - CLOCK_COST, time.perf_counter() - wall
    finally:
        gc.enable()


def _clock_cost() -> float:
    """CPU time that reading the clock adds to a timing [s]: median of a thousand readings."""
    laps = []
    for _ in range(1000):
        start = time.process_time()
        laps.append(time.process_time() - start)
    return float(np.median(laps))


CLOCK_COST = _clock_cost()
