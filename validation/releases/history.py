"""Rows over releases, and changes from one release to the next."""

from __future__ import annotations

import json
import statistics
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from packaging.version import Version

from validation.bench.agreement import ratios
from validation.cells import Observation, Outcome, Slot, slot_from_dict
from validation.findings import Finding, row_key
from validation.findings.files import findings_of
from validation.judging.comparison import Change, Family, Kind, compare_rows, families
from validation.judging.rows import Row, rows_of
from validation.judging.verdicts import Physics
from validation.records.store import RELEASE_TITLE, Store

#: Outcomes with a result of the engine; the others are reasons for having none.
ANSWERS = (Outcome.OK.value, Outcome.DIVERGED.value, Outcome.CRASHED.value, Outcome.TIMED_OUT.value)
#: Outcomes of cells that ran to the end and are not judged.
UNJUDGED = (Outcome.INVALID.value, Outcome.REFUSED.value)
#: Outcomes without a value to judge: fewer failures are no improvement if these increase.
ENDED = (Outcome.CRASHED.value, Outcome.TIMED_OUT.value, *UNJUDGED)
#: Engine, profile, scene, dimension.
Key = tuple[str, str, str, int]


@dataclass(frozen=True)
class Told:
    """Rows of one release.

    Parameters
    ----------
    reason
        Why it has no result; empty if it has.
    doubted
        Profiles without verdicts on this release, with the property check that fails there.
    times
        Time of a scene over that of the yardstick (`validation.releases.timing`), where timed.
    """

    engine: str
    version: str
    rows: tuple[Row, ...]
    reason: str = ""
    doubted: tuple[str, ...] = ()
    times: Mapping[Key, float] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """``myengine==3.2.7``."""
        return f"{self.engine}=={self.version}"

    def count(self, physics: Physics) -> int:
        """Number of rows with this verdict."""
        return sum(row.physics == physics.value for row in self.rows)

    @property
    def ended(self) -> int:
        """Number of rows without verdict because their cell crashed, hung, or failed a property check."""
        return sum(row.outcome in ENDED for row in self.rows)

    def pace(self, other: Told) -> float | None:
        """Median over scenes of this release's time over that of ``other``; None if no scene is timed on both."""
        both = [self.times[key] / other.times[key] for key in self.times if key in other.times]
        return statistics.median(both) if both else None


@dataclass(frozen=True)
class Step:
    """Rows of one kind that changed together, between successive releases with a result."""

    before: str
    after: str
    family: Family

    def as_dict(self) -> dict[str, Any]:
        """Plain data: the largest change, and the number of rows."""
        return {"before": self.before, "after": self.after, "rows": len(self.family.changes)} | {
            "change": self.family.first.as_dict()
        }


def versions(store: Store, engine: str) -> list[str]:
    """Releases of an engine in the store, oldest first."""
    titles = (run.title.removeprefix(f"{RELEASE_TITLE}{engine}==") for run in store.release_runs(engine))
    return [str(version) for version in sorted({Version(title.partition(":")[0]) for title in titles})]


def engines(store: Store) -> list[str]:
    """Engines with releases in the store."""
    titles = [run.title.removeprefix(RELEASE_TITLE) for run in store.runs() if run.title.startswith(RELEASE_TITLE)]
    return list(dict.fromkeys(title.partition("==")[0] for title in titles))


def observations(store: Store, engine: str, version: str) -> list[Observation]:
    """The newest result of a release for every cell; a missing result never replaces one."""
    found: dict[Slot, Observation] = {}
    for run in store.release_runs(engine, version):
        for observation in store.observations(run):
            kept = found.get(observation.slot)
            answers = observation.outcome.value in (*ANSWERS, *UNJUDGED)
            if kept is None or answers or kept.outcome.value not in ANSWERS:
                found[observation.slot] = observation
    return list(found.values())


def times(store: Store, engine: str, version: str) -> dict[Key, float]:
    """Time of each timed scene on a release over that of the yardstick; the newest ratio of each."""
    found: dict[Key, float] = {}
    for run in store.release_runs(engine, version):
        for row in ratios(store, run).to_dict("records"):
            key = str(row["engine"]), str(row["profile"]), str(row["scene"]), int(row["dimension"])
            found[key] = float(row["ratio"])
    return found


def told_by(engine: str, version: str, found: Iterable[Observation], taken: Mapping[Key, float] | None = None) -> Told:
    """Judge the results of a release; a profile with a failed property check there has no verdicts.

    With settings of a user nothing is declared, so nothing can fail.
    """
    found = list(found)
    doubts: dict[str, str] = {}
    for observation in found:
        broken = [slip for slip in observation.receipts if not slip["holds"]]
        if broken and not observation.slot.is_own and observation.slot.profile not in doubts:
            doubts[observation.slot.profile] = f"receipt {broken[0]['quantity']} fails in {observation.slot.scene}"
    rows = tuple(_doubted(row, doubts) for row in rows_of(f"{engine}=={version}", found))
    answered = any(row.outcome in (*ANSWERS, *UNJUDGED) for row in rows)
    reason = "" if answered else next((row.reason for row in rows), "it was not run")
    said = tuple(f"{profile}: {why}" for profile, why in doubts.items())
    return Told(engine, version, rows, reason, said, taken or {})


def _doubted(row: Row, doubts: dict[str, str]) -> Row:
    """A row without verdict where its profile fails a property check: a pass by chance is none."""
    why = doubts.get(row.profile)
    if why is None or row.outcome in UNJUDGED:
        return row
    return replace(row, outcome=Outcome.INVALID.value, physics=None, standing=None, reason=f"no verdict: {why}")


def told(store: Store, engine: str, wanted: Sequence[str] = (), cells: Sequence[Slot] = ()) -> list[Told]:
    """Rows of releases of an engine, oldest first; of all stored ones and all cells if none is named."""
    asked = set(cells)
    out = []
    for version in wanted or versions(store, engine):
        found = observations(store, engine, version)
        chosen = [o for o in found if not asked or o.slot in asked]
        out.append(told_by(engine, version, chosen, times(store, engine, version)))
    return out


def steps(releases: Sequence[Told]) -> list[Step]:
    """Changes from each release to the next with the same cells, the most serious first within a release."""
    last: dict[tuple[str, str], tuple[str, dict[str, Any]]] = {}
    found: list[Step] = []
    for release in releases:
        plain = [row.as_dict() for row in release.rows if row.outcome in ANSWERS]
        before = {identity(row): last[identity(row)] for row in plain if identity(row) in last}
        for name in dict.fromkeys(name for name, _ in before.values()):
            olds = [row for other, row in before.values() if other == name]
            changes = [c for c in compare_rows(olds, plain) if c.kind not in (Kind.ADDED, Kind.REMOVED)]
            found += [Step(name, release.version, family) for family in families(changes)]
        last |= {identity(row): (release.version, row) for row in plain}
    return found


def identity(row: dict[str, Any]) -> tuple[str, str]:
    """Identity of a row: slot and metric."""
    return json.dumps(row["slot"], sort_keys=True), str(row["metric"])


def mended(row: Row) -> bool:
    """Whether a row passes on a release outside the range of its finding.

    A value that passes within the band of its finding was marginal, and has not changed.
    """
    finding = finding_of(row)
    if finding is None or row.physics != Physics.PASS.value or finding.family.holds_for(row.engine_version):
        return False
    return row.value is None or not finding.holds(row.value)


def finding_of(row: Row) -> Finding | None:
    """The finding of a row, for any release."""
    findings = findings_of(row.engine)
    return None if findings is None else findings.members.get(row_key(slot_from_dict(row.slot), row.metric))


def sentence(change: Change) -> str:
    """``default bounce 3-D e=0.8 apex[1]: 0.1 m (fail) -> 0.2 m (fail)``."""
    where = f"{change.profile} {change.scene} {cell_of(change)}"
    return f"{where} {change.metric}: {change.before} -> {change.after}"


def cell_of(change: Change) -> str:
    """``3-D n=10 at 4 iterations``: the cell of a changed row."""
    iterations = change.slot.get("iterations")
    asked = f"at {iterations} iterations" if iterations else ""
    return " ".join(text for text in (f"{change.dimension}-D", change.params, asked) if text)
