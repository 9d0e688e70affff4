"""Work points: error and cost of every run of an engine; cost at equal error, and error at equal cost.

Errors come from observations, costs from timings, both from the store. Nothing is measured here.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from adapters.registry import is_ranked
from validation.bench.reading import POINT, SERIES, grouped, identity, table_of, timings_summary
from validation.bench.statistics import lower_envelope
from validation.cells import Observation, Outcome, Slot, scene_of
from validation.files.distance import CertifiedRuns, certified_runs, posed, primary_of
from validation.posed import is_file, resolve
from validation.records.store import Run, Store

if TYPE_CHECKING:
    import pandas as pd

#: Errors at which costs are compared.
ERROR_LEVELS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
#: Costs at which errors are compared [s/s].
COST_LEVELS = (1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1, 3e-1, 1.0)
#: A row of `timings_summary`.
Row = Mapping[Hashable, Any]


def work_points(
    store: Store,
    run: Run,
    observations: Iterable[Observation] | None = None,
    summary: pd.DataFrame | None = None,
) -> pd.DataFrame:
    """Error and cost: one row per scene, dimension, engine, profile, step and iteration count.

    Columns: `POINT` (``iterations`` None: the profile's own), ``params``, ``slot`` (the timed case, as the command
    reproduces it), ``engine_version``; ``error`` (the largest over ``cells`` cases), ``error_name``, ``unit``,
    ``worst`` (parameters of the worst case), ``outcome``, ``reason`` (why error or cost is missing);
    ``cost``, ``cost_low``, ``cost_high``, ``cost_minimum`` [s/s], ``rounds``, ``width``, ``drifts``;
    ``cost_corrected`` (minus the cost per step of an empty scene on the same engine and profile),
    ``cost_sampled`` (with every step read, if timed); ``state_hash`` of the timed call;
    ``on_front`` (on the lower envelope of its series), ``best`` (on that over all engines).
    ``observations`` and ``summary`` (`timings_summary`) are those of the run, if already read.
    """
    groups: dict[tuple[Any, ...], list[Observation]] = defaultdict(list)
    everything = list(store.observations(run) if observations is None else observations)
    certified = certified_of(everything)
    for observation in measured(everything, certified):
        slot = observation.slot
        if is_file(slot.scene) or resolve(slot.scene).primary:
            groups[tuple(getattr(slot, name) for name in POINT)].append(observation)
    summary = timings_summary(store, run) if summary is None else summary
    work = summary[summary["purpose"] == "work"] if len(summary) else summary
    costs = {(tuple(row[name] for name in POINT), row["sampled"]): row for row in work.to_dict("records")}
    empty = _empty_per_step(summary)
    rows = []
    for key, members in groups.items():
        row = accuracy(members, certified)
        row |= _cost_columns(costs.get((key, False)), costs.get((key, True)))
        row["cost_corrected"] = row["cost"] - empty.get(key[1:4], math.nan) / row["dt"]
        row["reason"] = row["reason"] or ("" if math.isfinite(row["cost"]) else "not timed")
        rows.append(row)
    return with_fronts(table_of(rows))


def certified_of(observations: Sequence[Observation]) -> CertifiedRuns:
    """The certified runs of scenes from files."""
    return certified_runs(o for o in observations if is_file(o.slot.scene))


def measured(observations: Iterable[Observation], certified: CertifiedRuns) -> Iterator[Observation]:
    """Observations without the certified runs themselves."""
    apart = {run.slot for run in certified.values()}
    return (observation for observation in observations if observation.slot not in apart)


def accuracy(members: Sequence[Observation], certified: CertifiedRuns | None = None) -> dict[str, Any]:
    """Identity, headline error and outcome of one work point from the observations of its cases.

    ``certified`` are the runs from which errors of scenes from files are measured.
    """
    first = min(members, key=lambda observation: _position(observation.slot))
    primary = primary_of(first.slot.scene)
    errors = [_error(observation, certified or {}) for observation in members]
    bad = [o for o in members if o.outcome is not Outcome.OK]
    missing = [reason for value, reason in errors if value is None]
    values = [-1.0 if value is None else value for value, _ in errors]
    worst = max(range(len(members)), key=values.__getitem__)
    reason = f"{bad[0].outcome.value}: {bad[0].reason}" if bad else (missing[0] if missing else "")
    return {
        **identity(first.slot),
        "engine_version": first.engine_version,
        "error": math.nan if reason else values[worst],
        "error_name": primary.name,
        "unit": primary.unit,
        "worst": dict(members[worst].slot.params),
        "cells": len(members),
        "outcome": (bad[0] if bad else first).outcome.value,
        "reason": reason,
    }


def _position(slot: Slot) -> int:
    """Place of a slot among the variations of its scene; the first one is timed."""
    canonical, given = resolve(slot.scene), dict(slot.params)
    complete = canonical.complete(given)
    for k, params in enumerate(primary_of(slot.scene).variations(slot.dt)):
        if all(complete[name] == value for name, value in params.items()):
            return k
    return 10**6


def _error(observation: Observation, certified: CertifiedRuns) -> tuple[float | None, str]:
    if observation.outcome is not Outcome.OK:
        return None, observation.reason
    slot, metrics = observation.slot, observation.metrics
    if is_file(slot.scene):
        run = certified.get(posed(slot))
        if run is None or run.reason:
            return None, run.reason if run else "no certified run to measure from: it has no result"
        metrics = {**metrics, **run.metrics}
    return primary_of(slot.scene).error(scene_of(slot), slot.dt, metrics)


def _cost_columns(plain: Row | None, sampled: Row | None) -> dict[str, Any]:
    names = ("cost", "cost_low", "cost_high", "cost_minimum", "width")
    usable = plain is not None and not plain["void"]
    row: dict[str, Any] = {name: plain[name] if plain and usable else math.nan for name in names}
    row["rounds"] = plain["rounds"] if plain else 0
    row["drifts"] = bool(plain and plain["drifts"])
    row["state_hash"] = plain["state_hash"] if plain else ""
    row["cost_sampled"] = sampled["cost"] if sampled and not sampled["void"] else math.nan
    return row


def with_fronts(points: pd.DataFrame) -> pd.DataFrame:
    """Mark the points on lower envelopes: of each series, and over all ranked profiles of a scene."""
    points = points.copy()
    for column, names in (("on_front", SERIES), ("best", SERIES[:2])):
        points[column] = False
        known = points if column == "on_front" else points[_has_rank(points)]
        if len(known):
            for _, group in known.groupby(names, sort=False):
                points.loc[group.index, column] = lower_envelope(group["cost"], group["error"])
    return points


def time_at_equal_error(points: pd.DataFrame, levels: Sequence[float] = ERROR_LEVELS) -> pd.DataFrame:
    """Cheapest point of each series with at most the error of each level; nothing is interpolated.

    Columns: `SERIES`, ``level``; ``cost``, ``cost_low``, ``cost_high``, ``cost_corrected``, ``error``, ``dt``,
    ``iterations``, ``slot``; ``rank`` (1 is the cheapest of its scene, dimension and level), ``tied`` (its interval
    overlaps that of the cheapest, so that their order is open), ``times_cheapest``; ``reason`` if no point reaches the
    level.
    """
    return _ranked(_at_levels(points, levels, "cost", "error"), "cost", "times_cheapest")


def error_at_equal_time(points: pd.DataFrame, levels: Sequence[float] = COST_LEVELS) -> pd.DataFrame:
    """Point of each series with the smallest error among those that cost at most each level [s/s].

    Columns as in `time_at_equal_error`, with ``times_best`` (error over the best error of its scene and level).
    """
    return _ranked(_at_levels(points, levels, "error", "cost"), "error", "times_best")


def _at_levels(points: pd.DataFrame, levels: Sequence[float], column: str, limited: str) -> pd.DataFrame:
    """Of each series, the point that is best in ``column`` among those with at most each level of ``limited``."""
    columns = ("cost", "cost_low", "cost_high", "cost_corrected", "error", "dt", "iterations", "slot")
    nothing = {**dict.fromkeys(columns[:6], math.nan), "iterations": None, "slot": None}
    least = {"error": "smallest error in this sweep is {:.2g}", "cost": "cheapest point costs {:.2g} s/s"}[limited]
    rows = []
    for names, group in grouped(points, SERIES):
        series, members = dict(zip(SERIES, names, strict=True)), group.to_dict("records")
        known = [point for point in members if not math.isnan(point["cost"]) and not math.isnan(point["error"])]
        # Of points that are equal in this column, the one that is better in the other.
        known.sort(key=lambda point: (point[column], point[limited]))
        reasons = [point["reason"] for point in members if point["reason"]]
        why = least.format(min(point[limited] for point in known)) if known else next(iter(reasons), "not timed")
        for level in levels:
            best = next((point for point in known if point[limited] <= level), None)
            found = {**nothing, "reason": why} if best is None else {**{n: best[n] for n in columns}, "reason": ""}
            rows.append({**series, "level": level, **found})
    return table_of(rows)


def _has_rank(table: pd.DataFrame) -> pd.Series:
    """Which rows have a ranked profile."""
    import pandas as pd

    known = [is_ranked(engine, profile) for engine, profile in zip(table["engine"], table["profile"], strict=True)]
    return pd.Series(known, index=table.index, dtype=bool)


def _ranked(table: pd.DataFrame, column: str, factor: str) -> pd.DataFrame:
    if len(table):
        names = [table[name] for name in ("scene", "dimension", "level")]
        grouped = table[column].where(_has_rank(table)).groupby(names)
        table["rank"] = grouped.rank(method="min")
        table["tied"] = _tied(table, column)
        best = grouped.transform("min")
        table[factor] = np.where(
            best > 0.0, table[column] / best.where(best > 0.0), np.where(table[column] == 0, 1, np.inf)
        )
        table.loc[table[column].isna(), factor] = math.nan
    return table


def _tied(table: pd.DataFrame, column: str) -> pd.Series:
    """Which rows are indistinguishable from the best of their scene, dimension and level.

    Costs have the bootstrap interval of their median: two that overlap are tied. Errors are deterministic: only equal
    ones are tied.
    """
    tied = table["rank"] == 1
    if column != "cost":
        return tied
    for _, group in table.groupby(["scene", "dimension", "level"]):
        best = group[group["rank"] == 1]
        if len(best):
            tied.loc[group.index] = (group["cost_low"] <= best["cost_high"].max()) & group["rank"].notna()
    return tied


def _empty_per_step(summary: pd.DataFrame) -> dict[tuple[Any, ...], float]:
    """Cost of a step of an empty scene [s] by dimension, engine, profile."""
    out = {}
    for row in summary.to_dict("records"):
        if row["purpose"] == "overhead" and row["scene"] == "empty" and not row["sampled"] and not row["void"]:
            out[row["dimension"], row["engine"], row["profile"]] = row["per_step"]
    return out
