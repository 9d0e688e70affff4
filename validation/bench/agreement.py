"""Ratios of times within a run, and whether two runs agree on them.

A busy or slowing machine hardly changes a ratio that is taken within one round: it slows both sides alike.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from validation.bench.reading import POINT, identity, table_of
from validation.bench.statistics import Spread, spread
from validation.bench.timing import Timing
from validation.cells import Slot
from validation.records.store import Run, Store

if TYPE_CHECKING:
    import pandas as pd


def ratios(store: Store, run: Run) -> pd.DataFrame:
    """Ratio of each unit's time to its opponent's in the same round; a busy machine hardly changes it.

    One row per unit, unsampled: `POINT`, ``purpose``, ``params``, ``engine_version``, ``opponent``,
    ``opponent_version``, ``ratio`` (median over rounds), ``ratio_low``, ``ratio_high`` (bootstrap interval),
    ``rounds``.
    """
    by_unit: dict[tuple[Any, ...], dict[int, Timing]] = defaultdict(dict)
    for timing in store.timings(run):
        if not timing.void and not timing.sampled:
            by_unit[timing.purpose, timing.slot][timing.round] = timing
    rows = []
    for (purpose, slot), own in by_unit.items():
        partner = by_unit.get((purpose, opponent_slot(next(iter(own.values())))))
        found = None if partner is own else ratio(own, partner or {})
        if partner is None or found is None:
            continue
        first, other = next(iter(own.values())), next(iter(partner.values()))
        row = {"purpose": purpose, **identity(slot), "opponent": first.opponent, "rounds": found.n}
        row |= {"engine_version": first.engine_version, "opponent_version": other.engine_version}
        row |= {"ratio": found.median, "ratio_low": found.low, "ratio_high": found.high}
        rows.append(row)
    return table_of(rows)


def ratio(own: Mapping[int, Timing], other: Mapping[int, Timing]) -> Spread | None:
    """Median over rounds of the ratio of step times, ``own`` to ``other``; None for fewer than two common rounds."""
    rounds = sorted(set(own) & set(other))
    if len(rounds) < 2:
        return None
    found = spread([math.log(_rate(own[k]) / _rate(other[k])) for k in rounds])
    return Spread(found.n, *(math.exp(x) for x in (found.minimum, found.median, found.low, found.high)))


def opponent_slot(timing: Timing) -> Slot:
    """Slot of the opponent of a timing's unit: same scene and step, the opponent's own iteration count."""
    engine, _, profile = timing.opponent.partition("/")
    same = timing.slot.iterations if timing.purpose == "iterations" else None
    return replace(timing.slot, engine=engine, profile=profile, iterations=same)


def _rate(timing: Timing) -> float:
    return timing.seconds / timing.steps


def agreement(first: pd.DataFrame, second: pd.DataFrame) -> pd.DataFrame:
    """Ratios of two bench runs side by side; ``agrees`` where their intervals overlap.

    One row per unit that both runs have with the same versions of both engines. The columns ``ratio``, ``ratio_low``,
    ``ratio_high`` have the endings ``_1`` and ``_2``.
    """
    keys = ["purpose", *POINT, "params_text", "engine_version", "opponent", "opponent_version"]

    def keyed(table: pd.DataFrame) -> pd.DataFrame:
        out = table.copy()
        out["params_text"] = [repr(sorted(params.items())) for params in out["params"]]
        out["iterations"] = out["iterations"].astype(float).fillna(0.0)
        return out[[*keys, "ratio", "ratio_low", "ratio_high"]]

    both = keyed(first).merge(keyed(second), on=keys, suffixes=("_1", "_2"))
    both["agrees"] = (both["ratio_low_1"] <= both["ratio_high_2"]) & (both["ratio_low_2"] <= both["ratio_high_1"])
    return both
