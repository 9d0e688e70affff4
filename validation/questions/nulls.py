"""Trivial answers: three results without a physics engine, and the skill of an engine against the best of them.

    did nothing            every body stays where it starts
    free flight            no contact: bodies keep their spin and follow their loads
    perfectly inelastic    free flight until bodies touch; what touches moves on as one, and stops at what is fixed

They are measured by the scene's metrics and judged by its checks, like any engine. The skill of an engine is ``1 -
error/error of the best null``: 1 is exact, 0 no better than the trivial answer, below 0 worse. Where a trivial answer
is exact (a column that should stand) there is no skill.

They are rows like those of engines (`null_rows`), without standing.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from adapters.engine import Array
from adapters.scene import Scene
from adapters.stages import stage
from adapters.stepping import step_count
from adapters.trajectory import Measured, Trajectory
from validation.canonical import CanonicalScene, Check
from validation.geometry import least_gap, separation
from validation.judging.rows import Row
from validation.judging.verdicts import judge_physics
from validation.metrics import OUT_OF_PLANE
from validation.posed import resolve

#: Bodies nearer than this share of the scene's size touch, as starts are exact to round-off only.
TOUCH = 1e-9
#: Largest number of bodies: pairs are tested one by one.
MOST_BODIES = 30
#: For more cells (a sweep) trivial answers are computed only for a named row: a cell takes 7 ms in the mean (measured
#: over the quick suite).
MOST_CELLS = 1000
#: Name in the place of an engine.
NO_ENGINE = "none"


@dataclass(frozen=True)
class Null:
    """Error of a trivial answer in one check; ``error`` is None where its trajectory has no value, with the reason."""

    name: str
    value: float | None
    error: float | None
    reason: str = ""


def did_nothing(scene: Scene, dt: float) -> Trajectory:
    """Every body stays where it starts."""
    t, pose, twist = _blank(scene, dt)
    return Trajectory(t, pose, np.zeros_like(twist), None, dt, "completed")


def free_flight(scene: Scene, dt: float) -> Trajectory:
    """No contact."""
    t, pose, twist = _blank(scene, dt)
    _fly(scene, t, pose, twist, _loads(scene), 0)
    return Trajectory(t, pose, twist, None, dt, "completed")


def perfectly_inelastic(scene: Scene, dt: float) -> Trajectory:
    """Bodies that touch move on together."""
    t, pose, twist = _blank(scene, dt)
    d, n = scene.dimension, len(scene.bodies)
    free = np.array([body.motion == "free" for body in scene.bodies])
    mass = np.array([body.mass if body.motion == "free" else math.inf for body in scene.bodies])
    cluster, loads, at = np.arange(n), _loads(scene), 0
    close = TOUCH * (1.0 + float(np.abs(pose[0, :, :d]).max()))
    while True:
        _fly(scene, t, pose, twist, loads, at)
        pairs = [(i, j) for i, j in combinations(range(n), 2) if cluster[i] != cluster[j] and (free[i] or free[j])]
        first = {(i, j): _first_touch(scene, pose, i, j, at, close) for i, j in pairs}
        hit = min(first.values(), default=len(t))
        if hit >= len(t):
            return Trajectory(t, pose, twist, None, dt, "completed")
        for i, j in (pair for pair, k in first.items() if k == hit):
            cluster[cluster == cluster[j]] = cluster[i]
        for name in set(cluster):
            members = np.flatnonzero(cluster == name)
            if len(members) > 1:
                _join(members, mass, loads, twist[hit], d)
        at = hit


#: All trivial answers by name, the simplest first.
NULLS: Mapping[str, Callable[[Scene, float], Trajectory]] = {
    "did nothing": did_nothing,
    "free flight": free_flight,
    "perfectly inelastic": perfectly_inelastic,
}


def _blank(scene: Scene, dt: float) -> tuple[Array, Array, Array]:
    """Times, with the poses and twists of the start."""
    count = step_count(scene.duration, dt) + 1
    pose, twist = np.array([b.pose for b in scene.bodies]), np.array([b.twist for b in scene.bodies])
    return (
        np.asarray(np.arange(count) * dt, dtype=float),
        np.repeat(pose[None], count, axis=0),
        np.repeat(twist[None], count, axis=0),
    )


def _loads(scene: Scene) -> Array:
    """Acceleration of each body's centre without contacts, (n, d) [m/s^2]."""
    found = np.zeros((len(scene.bodies), scene.dimension))
    for k, body in enumerate(scene.bodies):
        if body.motion == "free":
            found[k] = np.array(scene.gravity) + np.array(body.force) / body.mass
    return found


def _fly(scene: Scene, t: Array, pose: Array, twist: Array, loads: Array, at: int) -> None:
    """Fill in flight from sample ``at`` on, from the state there."""
    d, after = scene.dimension, (t[at:] - t[at])[:, None, None]
    start, speed, spin = pose[at, :, :d], twist[at, :, :d], twist[at, :, d:]
    pose[at:, :, :d] = start + speed * after + 0.5 * loads * after**2
    twist[at:, :, :d] = speed + loads * after
    twist[at:, :, d:] = spin
    if d == 2:
        pose[at:, :, 2:] = pose[at, :, 2:] + spin * after
    else:
        pose[at:, :, 3:] = _spun(pose[at, :, 3:], spin, after)


def _spun(attitude: Array, spin: Array, after: Array) -> Array:
    """Attitudes (s, n, 4) of bodies that rotate about a fixed axis."""
    rate = np.linalg.norm(spin, axis=-1, keepdims=True)
    axis = np.divide(spin, rate, out=np.zeros_like(spin), where=rate > 0.0)
    half = 0.5 * rate * after
    w, v, u, r = np.cos(half), np.sin(half) * axis, attitude[..., :1], attitude[..., 1:]
    scalar = w * u - (v * r).sum(-1, keepdims=True)
    return np.concatenate([scalar, w * r + u * v + np.cross(v, np.broadcast_to(r, v.shape))], axis=-1)


def _first_touch(scene: Scene, pose: Array, i: int, j: int, at: int, close: float) -> int:
    """First sample from ``at`` on at which two bodies touch or overlap; beyond the last one if none do."""
    a, b = scene.bodies[i].shape, scene.bodies[j].shape
    near = np.flatnonzero(least_gap(a, pose[at:, i], b, pose[at:, j]) <= close)
    for k in near:  # the lower bound is exact for most pairs, so the first is usually the answer
        if float(separation(a, pose[at + k : at + k + 1, i], b, pose[at + k : at + k + 1, j])[0]) <= close:
            return int(at + k)
    return len(pose)


def _join(members: NDArray[np.int64], mass: Array, loads: Array, twist: Array, d: int) -> None:
    """Bodies that move on together: with their common momentum and load, or with a fixed one among them."""
    held = members[~np.isfinite(mass[members])]
    if len(held):
        speed, load = twist[held[0], :d].copy(), np.zeros(d)
    else:
        share = mass[members] / mass[members].sum()
        speed, load = share @ twist[members, :d], share @ loads[members]
    twist[members, :d], twist[members, d:], loads[members] = speed, 0.0, load


@lru_cache(maxsize=4096)
def _measured(
    scene: str, dimension: int, params: tuple[tuple[str, float], ...], dt: float
) -> dict[str, Mapping[str, Measured]]:
    canonical = resolve(scene)
    made = canonical.scene(dimension, dict(params))
    if len(made.bodies) > MOST_BODIES:
        return {}
    return {name: _metrics(canonical, made, null, dt) for name, null in NULLS.items()}


def _metrics(
    canonical: CanonicalScene, scene: Scene, null: Callable[[Scene, float], Trajectory], dt: float
) -> Mapping[str, Measured]:
    """Metrics of a trivial answer; none where the scene divides by a motion that it does not have."""
    try:
        with np.errstate(all="ignore"):
            return canonical.measure(scene, null(scene, dt))
    except (ArithmeticError, ValueError, IndexError):
        return {}


def nulls_of(
    scene: str, dimension: int, params: Mapping[str, float], dt: float, metric: str, truth: float
) -> list[Null]:
    """Trivial answers for one check of a cell."""
    canonical = resolve(scene)
    found = []
    for name, metrics in _measured(scene, dimension, canonical.minimal(params), dt).items():
        value, reason = metrics.get(metric, (None, "a trivial answer has no such metric"))
        error = abs(value - truth) if value is not None and math.isfinite(value) else None
        found.append(Null(name, value if error is not None else None, error, reason))
    return found


def skill_of(row: Mapping[str, Any]) -> tuple[float | None, str]:
    """Skill of a row (as plain data); see `skill`."""
    if row["truth"] is None or row["value"] is None:
        return None, "there is no error to compare"
    if row["metric"] == OUT_OF_PLANE:
        return None, "a trivial answer is computed in 2-D and cannot leave its plane"
    asked = row["scene"], row["dimension"], row["slot"]["params"], row["dt"], row["metric"], row["truth"]
    return skill(row["value"] - row["truth"], nulls_of(*asked))


@stage("trivial answers")
def with_skill(rows: Sequence[Row]) -> list[Row]:
    """The rows with skill, and the trivial answer that it refers to."""
    if len(_cells(rows)) > MOST_CELLS:
        return list(rows)
    found = []
    for row in rows:
        worth, against = skill_of(vars(row))
        found.append(row if worth is None else replace(row, skill=worth, null=against))
    return found


@stage("trivial answers")
def null_rows(rows: Sequence[Row]) -> list[Row]:
    """One row for each trivial answer and check in ``rows``, once for all engines and iterations."""
    if len(_cells(rows)) > MOST_CELLS:
        return []
    asked = {(*_cell(row), row.metric): row for row in reversed(rows) if row.truth is not None and len(row.cells) < 2}
    found = []
    for row in reversed(asked.values()):
        assert row.truth is not None
        answers = nulls_of(row.scene, row.dimension, row.slot["params"], row.dt, row.metric, row.truth)
        found += [_row_of(row, row.truth, null, answers) for null in answers]
    return found


def _row_of(row: Row, truth: float, null: Null, answers: list[Null]) -> Row:
    """The row of a trivial answer, from an engine's row of the same check."""
    physics = judge_physics(null.value, Check(row.metric, row.unit, truth, row.tolerance, row.because, row.source))
    error = None if null.value is None else null.value - truth
    worth, against = skill(error, answers)
    return replace(
        row, engine=NO_ENGINE, engine_version="", profile=null.name, iterations=None, value=null.value, error=error,
        outcome="ok", physics=physics.value if physics else None, standing=None, reason=null.reason, state_hash="",
        steps=0, wall_time_s=0.0, log="", initial_change=[], cells=[], floor=None, certificate="",
        slot={**row.slot, "engine": NO_ENGINE, "profile": null.name, "iterations": None}, skill=worth,
        null=against if worth is not None else "",
    )  # fmt: skip


def _cell(row: Row) -> tuple[Any, ...]:
    return row.scene, row.dimension, tuple(sorted(row.slot["params"].items())), row.dt


def _cells(rows: Iterable[Row]) -> set[tuple[Any, ...]]:
    return {_cell(row) for row in rows}


def skill(error: float | None, nulls: list[Null]) -> tuple[float | None, str]:
    """Skill of an error, and the trivial answer that it refers to; or None and the reason."""
    known = [(null.error, null.name) for null in nulls if null.error is not None]
    if error is None:
        return None, "there is no error to compare"
    if not known:
        return None, "no trivial answer has this value: they report no contacts, or the scene is too large for them"
    least, name = min(known)
    if least == 0.0:
        return None, f"{name} is exact here"
    return 1.0 - abs(error) / least, name
