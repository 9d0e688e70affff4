"""What changed between two runs.

Deterministic values are equal to the last bit or they changed; a change counts only if it is larger than the noise
floor of its cell, measured by moving the start by one and two units in the last place, and larger than a hundredth of
its tolerance: smaller changes are ignored. Verdict flips come first, then errors, then speed. Rows on one side only are
reported, and are neither better nor worse, but for a failure of a case that both ran; so are checks that are newer than
the run of one side.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from enum import Enum
from typing import Any

from adapters.stages import stage
from validation.cells import slot_from_dict
from validation.metrics import NEWER

Plain = Mapping[str, Any]
#: Share of a tolerance by which an error must change to count.
COUNTS = 0.01


class Kind(Enum):
    """Kinds of changes, most serious first."""

    FLIP = "verdict flipped"
    OUTCOME = "outcome changed"
    ERROR = "value changed"
    SPEED = "speed changed"
    ADDED = "only in B"
    REMOVED = "not run in B"


@dataclass(frozen=True)
class Change:
    """One difference between two runs.

    Parameters
    ----------
    regressed
        True if B is worse: it fails where A passed, its error or time grew, or it has no result any more. Rows that
        were not run are neither.
    size
        Of a value: change of the error in units of the tolerance. Of a time: ratio B / A.
    """

    kind: Kind
    regressed: bool
    engine: str
    profile: str
    scene: str
    dimension: int
    params: str
    metric: str
    before: str
    after: str
    size: float
    slot: Mapping[str, Any]
    note: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Plain data (JSON-ready)."""
        return {**asdict(self), "kind": self.kind.value, "size": self.size if math.isfinite(self.size) else None}


def _identity(row: Plain) -> tuple[str, str]:
    """Rows of two runs correspond if slot and metric agree; run, versions and hashes may differ."""
    return json.dumps(row["slot"], sort_keys=True), row["metric"]


def checks_in(rows: Iterable[Plain]) -> dict[tuple[str, str], Plain]:
    """Rows by slot and metric, without checks that are newer than their run."""
    return {_identity(row): row for row in rows if row.get("reason") != NEWER}


@stage("comparing runs")
def compare_rows(before: Iterable[Plain], after: Iterable[Plain]) -> list[Change]:
    """All changes of rows from ``before`` to ``after``, most serious first."""
    before = list(before)
    a, b = checks_in(before), checks_in(after)
    ran = {slot for (slot, _), row in a.items() if row["outcome"] == "ok"}
    newer = set(map(_identity, before)) - a.keys()
    changes = [change for key in a.keys() & b.keys() if (change := _row_change(a[key], b[key]))]
    changes += [_make(Kind.REMOVED, False, a[key], _state(a[key]), "-", 0.0) for key in a.keys() - b.keys()]
    changes += [_added(b[key], held=key[0] in ran and key not in newer) for key in b.keys() - a.keys()]
    return sorted(changes, key=by_seriousness)


def _added(row: Plain, held: bool) -> Change:
    """A check of one side only: newly failing where the other side ran the case and, as it ``held``, has no row of it.

    What an engine realises is a check where it is not what was asked.
    """
    if held and row["outcome"] == "ok" and row["physics"] == "fail":
        size = abs(row["error"]) / row["tolerance"] if row["error"] is not None and row["tolerance"] else 0.0
        return _make(Kind.FLIP, True, row, "held", _state(row), size)
    return _make(Kind.ADDED, False, row, "-", _state(row), 0.0)


def by_seriousness(change: Change) -> tuple[Any, ...]:
    """Sort key: flips before errors before speed, regressions first, larger ones first."""
    kinds = list(Kind)
    size = change.size if math.isfinite(change.size) else math.inf
    return (kinds.index(change.kind), not change.regressed, -abs(size), change.engine, change.profile, change.scene,
            change.dimension, change.params, change.metric, change.slot.get("iterations") or 0)  # fmt: skip


def _row_change(a: Plain, b: Plain) -> Change | None:
    if a["outcome"] != b["outcome"]:
        return _make(Kind.OUTCOME, b["outcome"] != "ok", b, _state(a), _state(b), 0.0, b["reason"])
    if a["physics"] != b["physics"]:
        return _make(Kind.FLIP, b["physics"] != "pass", b, _state(a), _state(b), _growth(a, b), _versions(a, b))
    if a["value"] == b["value"]:
        return None
    if a["value"] is None or b["value"] is None:
        return _make(Kind.ERROR, b["value"] is None, b, _state(a), _state(b), 0.0, b["reason"])
    floor = max((row["floor"] for row in (a, b) if row.get("floor") is not None), default=0.0)
    least = max(floor, COUNTS * (b["tolerance"] or 0.0))
    if abs(b["value"] - a["value"]) <= least:
        return None
    growth = _growth(a, b)
    if b["tolerance"]:
        note = f"more than its floor {floor:.1g}" if least == floor else "more than a hundredth of its tolerance"
    else:
        note = "has no tolerance: any changed bit counts"
    return _make(Kind.ERROR, growth > 0.0, b, _state(a), _state(b), growth, f"{note}; {_versions(a, b)}")


def _growth(a: Plain, b: Plain) -> float:
    """Change of |error| in units of the tolerance; of the value where there is no truth."""
    if a["error"] is None or b["error"] is None or not b["tolerance"]:
        return 0.0
    grown: float = (abs(b["error"]) - abs(a["error"])) / b["tolerance"]
    return grown


def _versions(a: Plain, b: Plain) -> str:
    if a["engine_version"] != b["engine_version"]:
        return f"{b['engine']} {a['engine_version']} -> {b['engine_version']}"
    return f"same engine version {b['engine_version']}"


def _state(row: Plain) -> str:
    if row["outcome"] != "ok":
        return str(row["outcome"])
    unit = "" if row["unit"] == "1" else f" {row['unit']}"
    value = "no value" if row["value"] is None else f"{row['value']:.10g}{unit}"
    return f"{value} ({row['physics'] or 'not judged'})"


def _make(kind: Kind, regressed: bool, row: Plain, before: str, after: str, size: float, note: str = "") -> Change:
    slot = slot_from_dict(row["slot"])
    return Change(
        kind,
        regressed,
        row["engine"],
        row["profile"],
        row["scene"],
        row["dimension"],
        slot.params_text(),
        row["metric"],
        before,
        after,
        size,
        row["slot"],
        note,
    )


@dataclass(frozen=True)
class Family:
    """Changes of one kind and direction of one engine, profile, scene and kind of metric, the largest first."""

    changes: tuple[Change, ...]

    @property
    def first(self) -> Change:
        """The largest one."""
        return self.changes[0]


def families(changes: Iterable[Change]) -> list[Family]:
    """Groups of changes, ordered by their most serious ones."""
    found: dict[tuple[Any, ...], list[Change]] = {}
    for change in sorted(changes, key=by_seriousness):
        where = change.engine, change.profile, change.scene, change.metric.partition("[")[0]
        found.setdefault((change.kind, change.regressed, *where), []).append(change)
    return [Family(tuple(own)) for own in found.values()]


#: A change of speed counts if its whole interval lies beyond this factor: ten per cent is noticeable, and more than the
#: difference of two runs of the same code on a shared machine.
PRACTICAL = 1.1


def compare_speeds(before: Iterable[Plain], after: Iterable[Plain]) -> list[Change]:
    """Changes of speed between two bench runs.

    Each side lists ratios of a unit's time to its opponent's in the same rounds (columns of
    `validation.bench.agreement.ratios`), so a busier or slower machine changes both. The interval of the quotient
    follows from the bootstrap intervals of both sides.
    """
    a, b = times_in(before), times_in(after)
    changes = []
    for key in a.keys() & b.keys():
        low = b[key]["ratio_low"] / a[key]["ratio_high"]
        high = b[key]["ratio_high"] / a[key]["ratio_low"]
        if low <= PRACTICAL and high >= 1.0 / PRACTICAL:
            continue
        slot = slot_from_dict(b[key]["slot"])
        size = b[key]["ratio"] / a[key]["ratio"]
        was, now = (f"{row['ratio']:.3g} x {row['opponent']}" for row in (a[key], b[key]))
        note = f"interval x{low:.3g} to x{high:.3g}, threshold x{PRACTICAL:g}; {b[key]['purpose']}"
        changes.append(
            Change(
                Kind.SPEED,
                size > 1.0,
                slot.engine,
                slot.profile,
                slot.scene,
                slot.dimension,
                slot.params_text(),
                "time",
                was,
                now,
                size,
                b[key]["slot"],
                note,
            )
        )
    return sorted(changes, key=by_seriousness)


def times_in(ratios: Iterable[Plain]) -> dict[tuple[str, str, str], Plain]:
    """Ratios of times by what was timed, and against which opponent."""
    return {(row["purpose"], json.dumps(row["slot"], sort_keys=True), row["opponent"]): row for row in ratios}


#: Values of ``--fail-on``, and the changes that each selects.
FAIL_ON = {
    "never": lambda change: False,
    "flips": lambda change: change.kind in (Kind.FLIP, Kind.OUTCOME) and change.regressed,
    "regressions": lambda change: change.regressed,
    "changes": lambda change: True,
}


def failing(changes: Sequence[Change], fail_on: str) -> bool:
    """Whether ``changes`` contain one that ``fail_on`` (a key of `FAIL_ON`) selects."""
    return any(map(FAIL_ON[fail_on], changes))
