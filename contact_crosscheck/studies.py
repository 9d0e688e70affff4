"""Many cases: over parameters, and error over time."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from adapters import registry
from adapters.engine import EngineError
from adapters.scene import SceneError
from contact_crosscheck.apart import apart
from contact_crosscheck.cases import (
    AnyEngine,
    dimension_for,
    engine_named,
    number_of,
    observe,
    profile_named,
    settings_from,
)
from contact_crosscheck.models import Scene, scene_named
from reports import speed
from reports.command.benching import time_units
from reports.exports import described
from reports.progress import run_plan
from reports.terminal import terminal
from validation.bench.lane import FULL, QUICK
from validation.bench.sweep import Sweep, accuracy_slots, timed_units
from validation.bench.work import certified_of
from validation.canonical import CanonicalScene
from validation.cells import Outcome, Slot, parse_dt
from validation.identity import commit
from validation.judging.rows import frame, rows_of
from validation.posed import primary_of, resolve
from validation.questions.nulls import with_skill
from validation.questions.sweeping import Study, study_slots
from validation.records.store import Store
from validation.running.plan import Request
from validation.workers import TIMEOUT

if TYPE_CHECKING:
    import altair as alt


def sweep(
    scene: str | os.PathLike[str] | Scene,
    *,
    engine: AnyEngine | Sequence[AnyEngine],
    profile: str | None = None,
    dimension: int | None = None,
    dt: float | str | None = None,
    iterations: int | None = None,
    settings: Mapping[str, Any] | None = None,
    jobs: int = 0,
    timeout: float = TIMEOUT,
    out: str | os.PathLike[str] | None = None,
    **params: float | Sequence[float],
) -> pd.DataFrame:
    """Run a scene with every combination of the values of its parameters, in worker processes.

    Parameters
    ----------
    scene, profile, dimension, dt, iterations, settings
        As in `run`.
    engine
        One engine or several.
    jobs
        Processes; 0: one per core. An engine of your own runs in this process instead.
    timeout
        Time limit per case [s].
    out
        Folder for the results: the same call then resumes after an interruption, and `load` and the command
        ``crosscheck`` read them. By default nothing is kept.
    **params
        Parameters of the scene: a number is the same in all cases; each value of a list, a range or an array runs with
        each value of the others.

    Returns
    -------
    pandas.DataFrame
        One row for each check of each case, with the columns of `load`: parameters are the columns ``param.<name>``.

    Raises
    ------
    SceneError, EngineError
        As `run`, and if no parameter has several values.

    Examples
    --------
    >>> import contact_crosscheck as cc
    >>> found = cc.sweep("bounce", engine=["mujoco", "bullet"], e=[0.3, 0.5, 0.7], height=2.0)
    >>> found["off"] = (found.error / found.tolerance).abs()
    >>> found.pivot_table(index="param.e", columns="engine", values="off", aggfunc="max")
    """
    crossed = {name: _values(name, value) for name, value in params.items() if _is_several(value)}
    if not crossed:
        raise SceneError("sweep: no parameter has several values; give one a list, or use run")
    fixed = {name: number_of(name, value) for name, value in params.items() if name not in crossed}
    own = [engine] if isinstance(engine, str) or not isinstance(engine, Sequence) else list(engine)
    if not own:
        raise EngineError("engine: the list is empty")
    with apart():
        name = scene_named(scene)
        canonical = resolve(name)
        slots: list[Slot] = []
        for each in map(engine_named, own):
            request = _request(name, canonical, each, profile, dimension, dt, iterations, settings, fixed)
            slots += study_slots(request, Study(crossed, [{}]))
    here = [slot for slot in slots if registry.is_introduced(slot.engine)]
    elsewhere = [slot for slot in slots if slot not in set(here)]
    if here and out is not None:
        raise EngineError(f"out: {here[0].engine} is an engine of this process alone; its results are not kept")
    observations = [observe(slot) for slot in here]
    run_id = ""
    if elsewhere:
        with apart(), _store(out) as store:
            done = run_plan(store, f"sweep: {name}", elsewhere, terminal(stderr=True), jobs, timeout)
            run_id = done.id if out is not None else ""
            observations += store.observations(done)
    with apart():
        rows = with_skill(rows_of(run_id, observations, slots))
    return described(frame(rows), run_id, commit(), rows)


def _request(
    name: str,
    canonical: CanonicalScene,
    engine: str,
    profile: str | None,
    dimension: int | None,
    dt: float | str | None,
    iterations: int | None,
    settings: Mapping[str, Any] | None,
    fixed: Mapping[str, float],
) -> Request:
    """Request of a sweep for one engine."""
    wanted = dimension_for(engine, canonical) if dimension is None else dimension
    if wanted not in canonical.dimensions:
        raise SceneError(f"{canonical.name}.dimension: {dimension!r} is not one of {canonical.dimensions}")
    return Request(
        [name],
        [engine],
        [profile_named(engine, profile, canonical)],
        [wanted],
        [] if dt is None else [parse_dt(str(dt))],
        [] if iterations is None else [iterations],
        fixed,
        sets=settings_from(settings),
    )


def _is_several(value: Any) -> bool:
    return isinstance(value, Sequence | np.ndarray | pd.Series) and not isinstance(value, str | bytes)


def _values(name: str, value: Any) -> list[float]:
    """Values of a parameter that varies."""
    found = [number_of(name, each) for each in value]
    if not found:
        raise SceneError(f"{name}: the list is empty")
    return found


@contextmanager
def _store(out: str | os.PathLike[str] | None) -> Iterator[Store]:
    """Store in the folder ``out``, or in a temporary one."""
    with TemporaryDirectory() as passing:
        store = Store(Path(passing if out is None else out))
        try:
            yield store
        finally:
            store.close()


@dataclass(frozen=True, eq=False, repr=False)
class Bench:
    """Errors and times of a scene on several engines, over steps and iteration counts.

    Parameters
    ----------
    tables
        All tables by name: ``work_points``, ``time_at_equal_error``, ``error_at_equal_time``, ``scaling``,
        ``scaling_fits``, ``overhead``, ``ratios``, ``timings``.
    quality
        Quality of the timings, in one line.

    Examples
    --------
    >>> import contact_crosscheck as cc
    >>> cc.bench("stack", engines=["mujoco", "bullet"]).tables["time_at_equal_error"]
    """

    tables: Mapping[str, pd.DataFrame]
    quality: str

    def frame(self) -> pd.DataFrame:
        """Return one row for each engine, profile, step and iteration count: ``error``, and ``cost`` [s/s].

        The cost is CPU time per simulated second, ``cost_low`` and ``cost_high`` the interval of its median.

        Examples
        --------
        >>> import contact_crosscheck as cc
        >>> cc.bench("stack", engines=["mujoco"]).frame()[["profile", "dt", "error", "cost"]]
        """
        return self.tables["work_points"]

    def plot(self) -> alt.FacetChart:
        """Draw error over time; lines join the best points of each profile, labelled with their steps.

        Raises
        ------
        EngineError
            If the libraries of the extra ``report`` are missing.
        SceneError
            If nothing was timed.

        Examples
        --------
        >>> import contact_crosscheck as cc
        >>> cc.bench("stack", engines=["mujoco", "bullet"]).plot().save("stack.pdf")
        """
        from contact_crosscheck.charts import work_chart

        return work_chart(self.frame())

    def __repr__(self) -> str:
        return f"<{len(self.frame())} work points; {self.quality}>"


def bench(
    scene: str | os.PathLike[str] | Scene,
    *,
    engines: str | Sequence[str] | None = None,
    profiles: Sequence[str] = (),
    dimension: int | None = None,
    dts: Sequence[float | str] = (),
    iterations: Sequence[int] = (),
    full: bool = False,
    seed: int = 0,
    jobs: int = 0,
    timeout: float = TIMEOUT,
    out: str | os.PathLike[str] | None = None,
    **params: float,
) -> Bench:
    """Measure error over time, as ``crosscheck bench`` does.

    Errors are measured first, in several worker processes. Then everything is timed, one case at a time, in one
    process. Times mean something only if the machine does nothing else.

    Parameters
    ----------
    scene
        A scene with a headline error, or one from a file; see `run`. The error of a scene from a file is its distance
        from the certified run of our own solver at the end.
    engines
        Names of engines; by default all that are installed and not optional.
    profiles
        Names of profiles; by default all that are ranked.
    dimension
        2 or 3; by default the scene's first, with ``full`` all.
    dts, iterations
        Steps [s] and iteration counts; by default the scene's own.
    full
        Whether to run all steps of the scene and to time until the intervals are narrow, which takes up to two hours.
    seed
        Seed of the random order of timings.
    jobs, timeout, out
        As in `sweep`.
    **params
        Parameters of the scene.

    Raises
    ------
    SceneError
        For a scene without a headline error, one from a file without a certified run, an unknown parameter, or if no
        case has a result.
    EngineError
        For an unknown engine or profile, one that is not installed, or one of your own: the timing process can load
        only engines that are in a package.

    Examples
    --------
    >>> import contact_crosscheck as cc
    >>> measured = cc.bench("stack", engines=["mujoco", "bullet"], dimension=3)
    >>> measured.plot()
    """
    named = [engines] if isinstance(engines, str) else engines
    with apart():
        name = scene_named(scene)
        for each in named or ():
            if not isinstance(each, str) or registry.is_introduced(each):
                raise EngineError("engines: an engine is timed in a process of its own, so it must be in a package; "
                                  "crosscheck new-adapter makes one")  # fmt: skip
            engine_named(each)
        request = Request(
            [name],
            list(registry.usual() if named is None else named),
            list(profiles),
            [] if dimension is None else [dimension],
            [parse_dt(str(dt)) for dt in dts],
            list(iterations),
            {key: number_of(key, value) for key, value in params.items()},
            "full" if full else "quick",
        )
        wanted = Sweep(request, request.dts, request.iterations, request.params or {})
        slots = accuracy_slots(wanted)
        if not slots:
            raise SceneError("bench: no case fits these engines, profiles and dimension")
        console = terminal(stderr=True)
        with _store(out) as store:
            run = run_plan(store, f"bench: {name}", slots, console, jobs, timeout, finish=False, recorded=False)
            observations = store.observations(run)
            if not any(each.outcome is Outcome.OK for each in observations):
                raise SceneError(f"bench: no case has a result: {observations[0].reason}")
            units = timed_units(wanted, observations)
            lost = [each.reason for each in certified_of(observations).values() if each.reason]
            if lost and not any(unit.purpose == "work" for unit in units):
                raise SceneError(f"bench: {lost[0]}")
            time_units(store, run, [name], units, FULL if full else QUICK, seed, console)
            if not store.missing(run):
                store.finish(run)
            tables = speed.tables_of(store, run)
        primary = primary_of(name)
        for table in tables.values():
            table.attrs |= {"run": run.id if out is not None else "", "commit": run.commit, "error": primary.name}
        return Bench(tables, speed.quality_line(tables["timings"]))
