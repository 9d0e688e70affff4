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
from contact_crosscheck.models import AnyScene, scene_named
from reports import speed
from reports.command.benching import time_units
from reports.exports import described
from reports.progress import run_plan
from reports.terminal import terminal
from validation.bench.lane import FULL, QUICK
from validation.bench.sweep import Sweep, accuracy_slots, timed_units
from validation.bench.work import certified_of
from validation.canonical import CanonicalScene
from validation.catalogue import is_introduced
from validation.cells import Outcome, Slot, parse_dt
from validation.files.distance import primary_of
from validation.identity import commit
from validation.judging.rows import frame, rows_of
from validation.posed import resolve
from validation.questions.nulls import with_skill
from validation.questions.sweeping import Study, study_slots
from validation.records.store import Store
from validation.running.plan import Request
from validation.workers import TIMEOUT

if TYPE_CHECKING:
    import altair as alt


def sweep(
    scene: AnyScene,
    *,
    engine: AnyEngine | Sequence[AnyEngine],
    profile: str | Sequence[str] | None = None,
    dimension: int | None = None,
    dt: float | str | Sequence[float | str] | None = None,
    iterations: int | Sequence[int] | None = None,
    settings: Mapping[str, Any] | None = None,
    jobs: int = 0,
    timeout: float = TIMEOUT,
    out: str | os.PathLike[str] | None = None,
    **params: float | Sequence[float],
) -> pd.DataFrame:
    """Run a scene with every combination of engines, profiles, steps and values of its parameters.

    Parameters
    ----------
    scene, dimension, settings
        As in `run`.
    engine, profile, dt, iterations
        As in `run`, or a list of several; a profile by its role (``tuned``) may have another name on each engine.
    jobs
        Worker processes; 0: one per core. An engine or a scene of your own runs in this process instead.
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
        As `run`, and if nothing has several values.

    Examples
    --------
    >>> import contact_crosscheck as cc
    >>> found = cc.sweep("bounce", engine=["mujoco", "bullet"], e=[0.3, 0.5, 0.7], height=2.0)
    >>> found["off"] = (found.error / found.tolerance).abs()
    >>> found.pivot_table(index="param.e", columns="engine", values="off", aggfunc="max")
    >>> steps = cc.sweep("slide", engine="bullet", profile=["as shipped", "tuned"], dt=[1 / 60, 1 / 240, 1 / 960])
    >>> steps[steps.metric == "stop_distance"].pivot(index="dt", columns="profile", values="error")
    """
    crossed = {name: _values(name, value) for name, value in params.items() if _is_several(value)}
    if not crossed and not any(map(_is_several, (engine, profile, dt, iterations))):
        raise SceneError("sweep: nothing has several values; give a list, or use run")
    fixed = {name: number_of(name, value) for name, value in params.items() if name not in crossed}
    profiles, dts, counts = (_listed(*each) for each in (("profile", profile), ("dt", dt), ("iterations", iterations)))
    own = list(map(engine_named, _listed("engine", engine)))
    with apart():
        name = scene_named(scene)
        canonical = resolve(name)
        if not params:  # a parameter selects one case instead of all of the suite's
            fixed = {each.name: each.default for each in canonical.parameters[:1]}
        slots: list[Slot] = []
        for each in own:
            request = _request(name, canonical, each, profiles, dimension, dts, counts, settings, fixed)
            slots += study_slots(request, Study(crossed, [{}]))
    here, elsewhere = _divided(slots, out)
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
    profiles: Sequence[Any],
    dimension: int | None,
    dts: Sequence[Any],
    iterations: Sequence[Any],
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
        list(dict.fromkeys(profile_named(engine, each, canonical) for each in profiles or [None])),
        [wanted],
        [parse_dt(str(each)) for each in dts],
        list(iterations),
        fixed,
        sets=settings_from(settings),
    )


def _divided(slots: Sequence[Slot], out: str | os.PathLike[str] | None) -> tuple[list[Slot], list[Slot]]:
    """Cases of engines and scenes that exist in this process alone, and the others; only the others can be kept."""
    alone = {
        slot: slot.engine if registry.is_introduced(slot.engine) else slot.scene
        for slot in slots if registry.is_introduced(slot.engine) or is_introduced(slot.scene)
    }  # fmt: skip
    if alone and out is not None:
        raise EngineError(f"out: {next(iter(alone.values()))} exists in this process alone; its results are not kept")
    return [*alone], [slot for slot in slots if slot not in alone]


def _is_several(value: Any) -> bool:
    return isinstance(value, Sequence | np.ndarray | pd.Series) and not isinstance(value, str | bytes)


def _listed(name: str, value: Any) -> list[Any]:
    """One or several values as a list; none for None."""
    if _is_several(value) and not len(value):
        raise (EngineError if name in ("engine", "profile") else SceneError)(f"{name}: the list is empty")
    return list(value) if _is_several(value) else [] if value is None else [value]


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
    scene: AnyScene,
    *,
    engines: AnyEngine | Sequence[AnyEngine] | None = None,
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
        One engine or several, by name or of your own; by default all that are installed and not optional. One of your
        own is timed in this process, the others in one of their own.
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
        For an unknown engine or profile, or one that is not installed.

    Examples
    --------
    >>> import contact_crosscheck as cc
    >>> measured = cc.bench("stack", engines=["mujoco", "bullet"], dimension=3)
    >>> measured.plot()
    """
    named = None if engines is None else list(map(engine_named, _listed("engines", engines)))
    with apart():
        name = scene_named(scene)
        if is_introduced(name):
            raise SceneError(
                f"scene: {name} exists in this process alone; a bench needs a scene of a package or a file"
            )
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
        here, elsewhere = _divided(slots, out)
        console = terminal(stderr=True)
        with _store(out) as store:
            run = run_plan(store, f"bench {name}", elsewhere, console, jobs, timeout, finish=False, recorded=False)
            for slot in here:
                store.add(run, observe(slot))
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
