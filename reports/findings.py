"""Findings: rows that do not pass, one line each: measured, truth, tolerance and why, and how to reproduce it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from reports.wording import LABELS, mark_of, number, params_text, reproduce

#: Marks in the order in which findings are printed.
ORDER = ("crashed", "timed_out", "invalid", "new", "drifted", "fail", "known", "explained")


def finding_line(row: Mapping[str, Any]) -> str:
    """One line for one row."""
    label = LABELS[mark_of(row)]
    where = f"{row['engine']}/{row['profile']} {row['scene']} {row['dimension']}-D {params_text(row['slot']['params'])}"
    if row["value"] is None:
        what = row["reason"]
    else:
        what = (
            f"{row['metric']} {number(row['value'], 6)} {row['unit']}, truth {number(row['truth'], 6)}, "
            f"tolerance {number(row['tolerance'], 3)} ({row['because']})"
        )
        if row["reason"]:
            what += f"; {row['reason']}"
    return f"{label}: {where.strip()}: {what} | {reproduce(row['slot'])}"


def grouped(rows: Iterable[Mapping[str, Any]]) -> Iterator[tuple[str, list[Mapping[str, Any]]]]:
    """Rows that do not pass, by mark, most serious first."""
    groups: dict[str, list[Mapping[str, Any]]] = defaultdict(list)
    for row in rows:
        groups[mark_of(row)].append(row)
    for mark in ORDER:
        if groups[mark]:
            yield mark, groups[mark]


def lines(rows: Sequence[Mapping[str, Any]], most: int | None) -> Iterator[str]:
    """Lines of all findings; of known and explained ones at most ``most`` per engine, profile, scene and metric.

    A starved stack fails twenty interfaces at once: the worst row stands for the group, with a count.
    """
    for mark, group in grouped(rows):
        if most is None or mark in ("crashed", "timed_out", "invalid", "new", "drifted"):
            yield from (finding_line(row) for row in group)
            continue
        families: dict[tuple[Any, ...], list[Mapping[str, Any]]] = defaultdict(list)
        for row in group:
            metric = row["metric"].partition("[")[0]
            families[row["engine"], row["profile"], row["scene"], metric].append(row)
        for family in families.values():
            worst = sorted(family, key=_severity, reverse=True)
            for row in worst[:most]:
                rest = len(family) - most
                yield finding_line(row) + (f" (and {rest} more like it)" if rest > 0 else "")


def _severity(row: Mapping[str, Any]) -> float:
    if row["error"] is None or not row["tolerance"]:
        return 0.0
    return abs(row["error"]) / row["tolerance"]
