"""Tables of the timings of a bench run: cost of each unit, overhead of bindings, cost over size.

``cost`` is CPU time per simulated second [s/s] everywhere (1 is real time), so that it compares between steps and
scenes. Tables are pandas DataFrames; each docstring says what a row is. A missing number is NaN, with a reason in the
same row. Work points and comparisons at equal error are in `validation.bench.work`, ratios of two runs in
`validation.bench.agreement`.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from validation.bench.statistics import DRIFT, drift, power_law, spread
from validation.bench.timing import Timing
from validation.cells import Slot
from validation.records.store import RELEASE_TITLE, Run, Store

if TYPE_CHECKING:
    import pandas as pd

#: Columns that identify a series: an engine with a profile on a scene.
SERIES = ["scene", "dimension", "engine", "profile"]
POINT = [*SERIES, "dt", "iterations"]


def bench_runs(store: Store) -> list[Run]:
    """Runs with timings, oldest first, without those of other releases."""
    return [run for run in store.timed_runs() if not run.title.startswith(RELEASE_TITLE)]


def timings_summary(store: Store, run: Run) -> pd.DataFrame:
    """One row per timed unit and way of sampling.

    Columns: ``purpose``, `POINT`, ``params`` (dict), ``slot`` (dict), ``engine_version``, ``bodies``, ``sampled``,
    ``steps``, ``rounds``; ``minimum``, ``median``, ``low``, ``high`` [s of CPU per call]; ``width`` (of the interval,
    relative), ``drift`` (second half of the rounds against the first, relative), ``drifts`` (beyond 5 % and outside
    the interval), ``load`` (median of wall time over CPU time: above 1 the machine was busy); ``cost``,
    ``cost_minimum``, ``cost_low``, ``cost_high`` [s/s], ``per_step`` [s]; ``error``, ``state_hash``, ``states``
    (number of different end states: 1 for a deterministic engine), ``void``.
    """
    import pandas as pd

    groups: dict[tuple[Any, ...], list[Timing]] = defaultdict(list)
    for timing in store.timings(run):
        groups[timing.purpose, timing.slot, timing.sampled].append(timing)
    rows = [_summary(members) for members in groups.values()]
    return table_of(rows) if rows else pd.DataFrame(columns=[*POINT, "purpose", "sampled"])


def _summary(timings: Sequence[Timing]) -> dict[str, Any]:
    first = timings[0]
    void = next((timing.void for timing in timings if timing.void), "")
    # A void unit has no time, because any number would mislead.
    seconds = [math.nan] if void else [timing.seconds for timing in timings]
    found, moved = spread(seconds), drift(seconds)
    simulated = first.steps * first.slot.dt
    outside = abs(moved) > max(DRIFT, found.width)
    return {
        "purpose": first.purpose,
        **identity(first.slot),
        "engine_version": first.engine_version,
        "bodies": first.bodies,
        "sampled": first.sampled,
        "steps": first.steps,
        "rounds": found.n,
        **{name: getattr(found, name) for name in ("minimum", "median", "low", "high", "width")},
        "drift": moved,
        "drifts": outside,
        "load": math.nan if void else float(np.median([t.wall_seconds / t.seconds for t in timings])),
        "cost": found.median / simulated,
        "cost_minimum": found.minimum / simulated,
        "cost_low": found.low / simulated,
        "cost_high": found.high / simulated,
        "per_step": found.median / first.steps,
        "error": math.nan if first.error is None else first.error,
        "state_hash": first.state_hash,
        "states": len({timing.state_hash for timing in timings}),
        "void": void,
    }


def table_of(rows: list[dict[str, Any]]) -> pd.DataFrame:
    """Rows as a table; a missing iteration count stays None, because NaN of pandas equals nothing."""
    import pandas as pd

    table = pd.DataFrame(rows)
    if "iterations" in table:
        table["iterations"] = pd.Series([row["iterations"] for row in rows], dtype=object)
    return table


def identity(slot: Slot) -> dict[str, Any]:
    """Columns that identify the slot of a row."""
    return {
        "scene": slot.scene,
        "dimension": slot.dimension,
        "engine": slot.engine,
        "profile": slot.profile,
        "dt": slot.dt,
        "iterations": slot.iterations,
        "params": dict(slot.params),
        "slot": slot.as_dict(),
    }


def overhead(summary: pd.DataFrame) -> pd.DataFrame:
    """Cost of a step without contact: an empty scene, and one free body. It is mostly the binding's own.

    One row per dimension, engine, profile, scene (``empty``, ``free``) and way of sampling. Columns as in
    `timings_summary`, with ``per_step``, ``per_step_low``, ``per_step_high`` [s].
    """
    table = summary[summary["purpose"] == "overhead"].copy()
    if len(table):
        table["per_step_low"] = table["low"] / table["steps"]
        table["per_step_high"] = table["high"] / table["steps"]
    return table.reset_index(drop=True)


def scaling(summary: pd.DataFrame) -> pd.DataFrame:
    """Cost of a step over the number of bodies (purpose ``bodies``) and of iterations (``iterations``).

    Rows and columns of `timings_summary`, with ``x`` (bodies or iterations), ``per_step``, ``per_step_low``,
    ``per_step_high`` [s]. ``error`` is the largest displacement of a body at the end of the timed call, in sides.
    """
    table = summary[summary["purpose"].isin(["bodies", "iterations"])].copy()
    if len(table):
        table["x"] = np.where(table["purpose"] == "bodies", table["bodies"], table["iterations"]).astype(float)
        table["per_step_low"] = table["low"] / table["steps"]
        table["per_step_high"] = table["high"] / table["steps"]
    return table.reset_index(drop=True)


#: Fits leave out smaller numbers of bodies and iterations, whose cost is mostly the binding's own.
SMALLEST_FITTED = {"bodies": 10.0, "iterations": 3.0}


def scaling_fits(table: pd.DataFrame) -> pd.DataFrame:
    """Exponents p of per_step = a x^p by least squares in logarithms, over x >= `SMALLEST_FITTED`.

    One row per purpose, scene, dimension, engine and profile: ``exponent``, ``standard_error``, ``factor`` [s],
    ``points``, ``smallest``, ``largest`` (of x), ``reason`` if there are too few points.
    """
    import pandas as pd

    rows = []
    for names, group in grouped(table, ["purpose", *SERIES]):
        used = group[(group["void"] == "") & (group["x"] >= SMALLEST_FITTED[names[0]])].sort_values("x")
        fit = power_law(used["x"], used["per_step"])
        row: dict[str, Any] = dict(zip(["purpose", *SERIES], names, strict=True))
        row |= {"smallest": used["x"].min(), "largest": used["x"].max(), "points": len(used)}
        row |= {
            "exponent": fit.exponent if fit else math.nan,
            "standard_error": fit.standard_error if fit else math.nan,
            "factor": fit.factor if fit else math.nan,
            "reason": "" if fit else f"{len(used)} sizes are too few for a fit",
        }
        rows.append(row)
    return pd.DataFrame(rows)


def grouped(table: pd.DataFrame, names: list[str]) -> list[tuple[Any, pd.DataFrame]]:
    """Groups of a table in order of appearance; none of an empty one."""
    return list(table.groupby(names, sort=False)) if len(table) else []
