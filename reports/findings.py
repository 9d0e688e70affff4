"""Findings: rows that do not pass, by family or one line each, with the command that reproduces them.

A stack with too few iterations fails at twenty interfaces at once. A family is therefore one engine, profile, scene and
kind of metric with one standing, represented by its worst row.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from reports.wording import LABELS, MARKS, mark_of, measured, number, params_text, quantity, reproduce, row_id
from validation.judging.rows import is_alarming
from validation.posed import is_file

Plain = Mapping[str, Any]
#: Marks with exit status 1 of the command.
ALARMING = MARKS[: MARKS.index("fail")]
#: Outcomes of cases without an answer that is judged, and their words.
REFUSED = {"unsupported": "UNSUPPORTED", "not_installed": "NOT INSTALLED", "refused": "REFUSED"}
#: Marks of cases without a valid result: their rows have one reason, and no worst metric.
WHOLE = MARKS[: MARKS.index("new")]
#: Marks of findings in display order.
ORDER = MARKS[: MARKS.index("pass")]


def finding_line(row: Plain) -> str:
    """One line for one row."""
    label = LABELS[mark_of(row)]
    where = f"{row['engine']}/{row['profile']} {row['scene']} {row['dimension']}-D {params_text(row['slot']['params'])}"
    if row["iterations"] is not None:
        where = f"{where.strip()} at {row['iterations']} iterations"
    what = said(row, 6)
    if has_answer(row):
        what += f" ({row['because']})" + (f"; {row['reason']}" if row["reason"] else "")
    return f"{label}: {where.strip()}: {what} | {reproduce(row['slot'])}"


def has_answer(row: Plain) -> bool:
    """Whether a row has a valid value: a REFUSED or INVALID one has only a reason."""
    return row["value"] is not None and row["outcome"] not in ("refused", "invalid")


def said(row: Plain, digits: int = 4) -> str:
    """Measured value, truth and tolerance; or why there is no valid value."""
    if not has_answer(row):
        return str(row["reason"])
    truth, tolerance = quantity(row["truth"], row["unit"], digits), number(row["tolerance"], 3)
    return f"{row['metric']} {measured(row, digits)}, truth {truth}, tolerance {tolerance}"


def first_reason(row: Plain) -> str:
    """The first reason of a row without an answer, and the number of others."""
    first, *others = str(row["reason"]).split("; ")
    return f"{first} (and {len(others)} more)" if others else first


def grouped(rows: Iterable[Plain]) -> Iterator[tuple[str, list[Plain]]]:
    """Rows that do not pass, by mark, most serious first."""
    groups: dict[str, list[Plain]] = defaultdict(list)
    for row in rows:
        groups[mark_of(row)].append(row)
    for mark in ORDER:
        if groups[mark]:
            yield mark, groups[mark]


@dataclass(frozen=True)
class Family:
    """Rows of one engine, profile, scene, kind of metric and standing, the worst first.

    Cases without a result form one family for each reason, of all metrics (``"*"``), whatever its numbers are.
    """

    mark: str
    engine: str
    profile: str
    scene: str
    metric: str
    rows: tuple[Plain, ...]

    @property
    def worst(self) -> Plain:
        """The row farthest outside its tolerance."""
        return self.rows[0]

    @property
    def where(self) -> str:
        """Case of its worst row: ``3-D n=20 at 4 iterations``."""
        row = self.worst
        count = "" if row["iterations"] is None else f"at {row['iterations']} iterations"
        return " ".join(text for text in (f"{row['dimension']}-D", params_text(row["slot"]["params"]), count) if text)

    @property
    def line(self) -> str:
        """One line: standing, engine, metric and error of its worst row."""
        count = f"{len(self.rows)} checks"
        more = "" if len(self.rows) == 1 else f" ({count})" if self.mark in WHOLE else f", the worst of {count}"
        what = first_reason(self.worst) if self.mark in ("refused", "invalid") else said(self.worst)
        return f"{LABELS[self.mark]}: {self.engine}/{self.profile} {self.scene} {self.where}: {what}{more}"

    def as_dict(self) -> dict[str, Any]:
        """Plain data (JSON-ready): the family, its worst row, and the ids of all its rows."""
        names = ("mark", "engine", "profile", "scene", "metric")
        head = {name: getattr(self, name) for name in names}
        ids = [row_id(row) for row in self.rows]
        return {**head, "count": len(self.rows), "worst": dict(self.worst), "reason": self.worst["reason"], "rows": ids}


def families(rows: Iterable[Plain]) -> list[Family]:
    """All findings by family: most serious standing first, then in the order of the rows."""
    found: list[Family] = []
    for mark, group in grouped(rows):
        members: dict[tuple[str, str, str, str], list[Plain]] = defaultdict(list)
        for row in group:
            kind = row["reason"] if mark in WHOLE else row["metric"].partition("[")[0]
            if mark in ("refused", "invalid"):  # "bodies overlap: by ...": the numbers differ from case to case
                kind = kind.partition(":")[0]
            members[row["engine"], row["profile"], row["scene"], kind].append(row)
        for (engine, profile, scene, kind), own in members.items():
            metric = "*" if mark in WHOLE else kind
            found.append(Family(mark, engine, profile, scene, metric, tuple(sorted(own, key=severity, reverse=True))))
    return found


def refusals(rows: Sequence[Plain]) -> Iterator[str]:
    """One line per engine and scene that it cannot run, with the reason; per profile where one refuses to answer.

    An engine that is not installed has one line for all scenes. The matrix covers the catalogue's scenes, which are
    listed only if there is nothing else. Refusals of checks of one case, each with its numbers, share a line.
    """
    found: dict[tuple[Any, ...], str] = {}
    nothing = all(row["outcome"] in REFUSED for row in rows)
    for row in rows:
        outcome, reason = row["outcome"], row["reason"]
        shown = nothing or (is_file(row["scene"]) and outcome != "not_installed")
        if outcome in REFUSED and mark_of(row) != "refused" and shown:
            scene = "" if outcome == "not_installed" else f" {row['scene']}"
            who, kind = row["engine"], reason
            if outcome == "refused":
                who, kind = f"{row['engine']}/{row['profile']}", reason.partition(":")[0].partition(";")[0]
            found.setdefault((REFUSED[outcome], who, scene, kind), reason)
    return (f"{label}: {who}{scene}: {reason}" for (label, who, scene, _), reason in found.items())


def severity(row: Plain) -> float:
    """|error| in units of the tolerance; 0 without an error or a tolerance."""
    if row["error"] is None or not row["tolerance"]:
        return 0.0
    return float(abs(row["error"]) / row["tolerance"])


def alarms(rows: Sequence[Plain]) -> list[Family]:
    """Families with exit status 1 of the command."""
    return families([row for row in rows if is_alarming(row)])
