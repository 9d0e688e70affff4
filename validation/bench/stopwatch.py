"""One timing: build, bring into the state that matters, and clock one call.

    build -> [ a twin runs first, unclocked | warm-up steps ] -> clock( advance(n) ) -> read the state -> close

Runs in the lane's own process (`validation.bench.lane`), which has one thread.
"""

from __future__ import annotations

import gc
import hashlib
import math
import time
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from adapters.engine import Array, Simulation
from adapters.foreign import said_by
from adapters.lift import lower_pose, lower_twist
from adapters.registry import find
from adapters.stepping import advances
from validation.bench.units import COLLAPSED, Unit, own_error, prepared, scene_of


@dataclass(frozen=True)
class Lap:
    """Answer of the stopwatch: CPU and wall time of the call, CPU time with everything around it, the end state."""

    engine_version: str
    seconds: float
    wall_seconds: float
    whole_seconds: float
    state_hash: str
    error: float | None
    kernel: str = ""
    void: str = ""


def lap(unit: Unit) -> Lap:
    """Time ``unit`` once; an engine that fails gives a void lap, not an exception."""
    started = time.process_time()
    version = find(unit.slot.engine).version
    try:
        seconds, wall, state, error, kernel = _clocked(unit)
    except BaseException as failure:  # whatever an engine raises costs this unit only
        return Lap(version, 0.0, 0.0, time.process_time() - started, "", None, void=said_by(failure))
    return Lap(version, seconds, wall, time.process_time() - started, state, error, kernel, _void(unit, error))


def _void(unit: Unit, error: float | None) -> str:
    if error is not None and not math.isfinite(error):
        return "the state is not finite"
    if unit.purpose in ("bodies", "iterations") and error is not None and error > COLLAPSED:
        return f"the pile did not stand: a box moved by {error:.2g} sides"
    return ""


class Lowered:
    """Reads a lifted simulation as a planar one, state by state: what a user who looks after each step pays."""

    def __init__(self, inner: Simulation) -> None:
        self.inner = inner

    def pose(self) -> Array:
        """Planar poses (n, 3)."""
        return lower_pose(self.inner.pose())

    def twist(self) -> Array:
        """Planar twists (n, 3)."""
        return lower_twist(self.inner.twist())


def _clocked(unit: Unit) -> tuple[float, float, str, float | None, str]:
    engine, scene, settings, lifted = prepared(unit.slot)
    dt = unit.slot.dt
    if not unit.warm_up:  # the timed call is the whole scene, so that only a twin can warm caches and predictors
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
        return seconds, wall, state, error, str(simulation.certificate().get("kernel", ""))
    finally:
        simulation.close()


def _clock(simulation: Simulation, view: Any, steps: int, sampled: bool) -> tuple[float, float]:
    """CPU and wall time of ``steps`` steps in one call, or one by one with every state read [s]."""
    gc.disable()  # a collection would charge this call with garbage that others made
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
    """CPU time that reading the clock itself adds to a timing [s]: median of a thousand empty ones."""
    laps = []
    for _ in range(1000):
        start = time.process_time()
        laps.append(time.process_time() - start)
    return float(np.median(laps))


CLOCK_COST = _clock_cost()


def serve(connection: Connection) -> None:
    """Call what is sent and send back what it returns until the other end closes; what engines print is thrown away."""
    import os

    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.dup2(null, 2)
    while True:
        try:
            connection.send(connection.recv()())
        except EOFError:
            return
