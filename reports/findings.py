"""Findings: rows that do not pass, one line each: measured, truth, tolerance and why, and how to reproduce it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from reports.wording import LABELS, mark_of, number, params_text, reproduce
from validation.posed import is_file

#: Marks that make the command exit with 1.
ALARMING = ("crashed", "timed_out", "missing", "invalid", "new", "drifted")
#: Marks in the order in which findings are printed.
ORDER = ("crashed", "timed_out", "missing", "invalid", "new", "drifted", "fail", "known", "explained")


def finding_line(row: Mapping[str, Any]) -> str:
    """One line for one row."""
    label = LABELS[mark_of(row)]
    where = f"{row['engine']}/{row['profile']} {row['scene']} {row['dimension']}-D {params_text(row['slot']['params'])}"
    if row["iterations"] is not None:
        where = f"{where.strip()} at {row['iterations']} iterations"
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
    """Lines of all findings; at most ``most`` per family, the worst first, with a count of the rest.

    A starved stack fails twenty interfaces at once: a family is one engine, profile, scene and kind of metric; of
    what makes the command fail, also one cell.
    """
    for mark, group in grouped(rows):
        families: dict[tuple[Any, ...], list[Mapping[str, Any]]] = defaultdict(list)
        for row in group:
            cell = repr(row["slot"]) if mark in ALARMING else ""
            families[row["engine"], row["profile"], row["scene"], row["metric"].partition("[")[0], cell].append(row)
        for family in families.values():
            worst = sorted(family, key=_severity, reverse=True)
            for row in worst[:most]:
                rest = 0 if most is None else len(family) - most
                yield finding_line(row) + (f" (and {rest} more like it)" if rest > 0 else "")


def refusals(rows: Iterable[Mapping[str, Any]]) -> Iterator[str]:
    """One line per engine and scene file that it cannot run, with its reason: no fault of either."""
    found: dict[tuple[Any, ...], None] = {}
    for row in rows:
        if row["outcome"] == "unsupported" and is_file(row["scene"]):
            found[row["engine"], row["scene"], row["reason"]] = None
    return (f"UNSUPPORTED: {engine} {scene}: {reason}" for engine, scene, reason in found)


def _severity(row: Mapping[str, Any]) -> float:
    if row["error"] is None or not row["tolerance"]:
        return 0.0
    return abs(row["error"]) / row["tolerance"]
