"""Lists rows that do not pass as findings: what may be listed, what never is, and how wide a finding's band is.

    rows of a run  ->  propose  ->  families with what is new, drifted or gone, and refusals  ->  accepted

A proposal changes nothing. A family is written only once somebody has said, or said again, why its rows are as they
are; the entries of all others, and of every cell that did not run to its end, stay as they stand.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field

from validation.canonical import Check
from validation.cells import Slot, slot_from_dict
from validation.findings import Family, Finding, Findings, Key, row_key, solutions_of
from validation.judging.rows import Row, predictions_of
from validation.judging.studies import study_of
from validation.judging.verdicts import is_marginal
from validation.running.plan import is_standard

#: Starts moved by so many units in the last place show how far a value scatters.
MOVES = (1, -1, 2, -2)
#: The band of a scattering value, in units of the largest change that the four moves made: for a normal scatter that
#: change is 1.7 standard deviations in the mean, so that a new value leaves the band once in a million times.
SCATTER_FACTOR = 4.0
#: Least band: a hundredth of the check's tolerance, below which nobody cares, and a millionth of the value, which is
#: what a residual at which an iteration stops one sweep sooner or later on another machine makes of it.
TOLERANCE_SHARE, VALUE_SHARE = 0.01, 1e-6


@dataclass
class Change:
    """One family of a proposal.

    Parameters
    ----------
    family
        As it stands; for rows that no family covers yet a draft without reason and source.
    same, new
        Members as listed, and those that are not listed yet.
    drifted
        Members that left their band: what is listed, and what is found now.
    gone
        Listed rows that pass now, or whose check is no longer stated.
    """

    family: Family
    same: dict[Key, Finding] = field(default_factory=dict)
    new: dict[Key, Finding] = field(default_factory=dict)
    drifted: dict[Key, tuple[Finding, Finding]] = field(default_factory=dict)
    gone: dict[Key, Finding] = field(default_factory=dict)

    @property
    def is_draft(self) -> bool:
        """Whether nobody has said yet why these rows fail."""
        return not self.family.reason

    @property
    def asks(self) -> bool:
        """Whether accepting it would change what is listed."""
        return bool(self.new or self.drifted or self.gone)


@dataclass(frozen=True)
class Proposal:
    """What listing a run would change for one engine, and the rows that are refused, each with why."""

    engine: str
    changes: tuple[Change, ...]
    kept: Mapping[Key, Finding]
    refused: tuple[tuple[Row, str], ...]
    left_out: tuple[Row, ...] = ()


def slots_to_move(rows: Iterable[Row], engine: str, about: Callable[[Key], bool] = lambda key: True) -> list[Slot]:
    """Slots whose scatter must be known: each cell of the standard suite that fails, or nearly, once per move.

    ``about``: which rows are to be listed.
    """
    cells: dict[Slot, None] = {}
    for row in rows:
        if row.engine != engine or not about(row_key(slot_from_dict(row.slot), row.metric)):
            continue
        if row.floor is None and _may_be_listed(row) and not _is_study(row):
            cells[slot_from_dict(row.slot)] = None
    return [Slot(**{**vars(slot), "ulp": ulp}) for slot in cells for ulp in MOVES]


def _may_be_listed(row: Row) -> bool:
    if row.outcome != "ok" or row.value is None or row.standing == "explained" or _never(row):
        return False
    slot = slot_from_dict(row.slot)
    return (row.physics == "fail" or is_marginal(row.value, _check(row))) and is_standard(slot)


def propose(
    rows: Iterable[Row], engine: str, findings: Findings | None, about: Callable[[Key], bool] = lambda key: True
) -> Proposal:
    """Compare ``rows`` of a run with what is listed for ``engine``; see `Change` and `Proposal`.

    ``rows`` carry their scatter (`Row.floor`), so the run's cells have been run from moved starts as well. What
    ``about`` does not hold for stays as it is listed; what must not be listed is refused there as well, and rows that
    are new or drifted are told as left out.
    """
    findings = findings or Findings(engine, {}, (), {})
    changes: dict[str, Change] = {name: Change(family) for name, family in findings.families.items()}
    kept, refused, judged, left_out = dict(findings.members), [], set(), []
    for row in rows:
        slot = slot_from_dict(row.slot)
        if row.engine != engine or not is_standard(slot):
            continue
        key = row_key(slot, row.metric)
        if row.outcome not in ("ok", "diverged"):
            # What gave no answer says nothing about a finding: its entries stay.
            if row.outcome == "invalid":
                refused.append((row, "its receipts or its certificate do not hold"))
            continue
        judged.add(key)
        if not about(key) and not _must_not_be_listed(row):
            fails = row.outcome == "diverged" or (row.physics == "fail" and row.standing != "explained")
            left_out += [row] if fails and (key not in findings.members or row.standing == "drifted") else []
            continue
        why, found = _entry(row)
        family = findings.members[key].family if key in findings.members else findings.family_of(key)
        if why:
            refused.append((row, why))
        elif found is None:
            if key in kept:
                finding = kept.pop(key)
                changes[finding.family.id].gone[key] = finding
        elif family is not None and not family.holds_for(row.engine_version):
            refused.append((row, f"family {family.id} holds for {family.releases}, not for {row.engine_version}"))
        else:
            family = family or _draft(row)
            change = changes.setdefault(family.id, Change(family))
            _place(change, key, Finding(family, *found), kept)
    for key in _no_longer_stated(kept, judged):
        finding = kept.pop(key)
        changes[finding.family.id].gone[key] = finding
    return Proposal(engine, tuple(changes.values()), kept, tuple(refused), tuple(left_out))


def _place(change: Change, key: Key, found: Finding, kept: dict[Key, Finding]) -> None:
    old = kept.pop(key, None)
    if old is None:
        change.new[key] = found
    elif old.diverged != found.diverged or (old.value is None) != (found.value is None):
        change.drifted[key] = (old, found)
    elif old.value is None or (found.value is not None and abs(found.value - old.value) <= old.band):
        change.same[key] = old
    else:
        change.drifted[key] = (old, found)


def _no_longer_stated(kept: Mapping[Key, Finding], judged: set[Key]) -> list[Key]:
    """Entries of cells that ran to their end, of checks that those cells did not have."""
    cells = {key[:6] for key in judged}
    return [key for key in kept if key[:6] in cells and key not in judged]


def _must_not_be_listed(row: Row) -> str:
    """Why nobody may list a row, whatever its scatter; nothing if one may."""
    if _never(row) and row.physics == "fail":
        return "its profile promises a solution: what fails there is mended, not listed"
    covered = row.truth is not None and row.tolerance is not None and row.value is not None
    if (
        covered
        and row.outcome == "ok"
        and row.standing != "explained"
        and row.physics == "fail"
        and predictions_of(row)
    ):
        return "a deviation law speaks about it and misses: the law or the engine has changed"
    return ""


def _entry(row: Row) -> tuple[str, tuple[float | None, float, bool] | None]:
    """Why a row is refused, or its (value, band, diverged); neither where there is nothing to list."""
    if why := _must_not_be_listed(row):
        return why, None
    if row.outcome == "diverged":
        return "", (None, 0.0, True)
    if row.truth is None or row.tolerance is None or row.standing == "explained":
        return "", None
    if row.value is None:
        return "", (None, 0.0, False)
    if row.physics == "pass" and not is_marginal(row.value, _check(row)):
        return "", None
    if row.floor is None and not _is_study(row):
        return "its scatter is not known: the cell has not been run from moved starts", None
    width = band(row.value, row.tolerance, row.floor or 0.0)
    if row.physics == "pass" and abs(row.value - row.truth) + width <= row.tolerance:
        return "", None
    return "", (row.value, width, False)


def band(value: float, tolerance: float, scatter: float) -> float:
    """Half width within which a value is the same finding, from its largest change under moved starts."""
    return max(SCATTER_FACTOR * scatter, TOLERANCE_SHARE * tolerance, VALUE_SHARE * abs(value))


def _never(row: Row) -> bool:
    return row.profile in solutions_of(row.engine)


def _is_study(row: Row) -> bool:
    """What several cells say together is one of few values; it does not scatter with the last bits of a start."""
    return study_of(row.scene, row.metric) is not None


def _check(row: Row) -> Check:
    return Check(row.metric, row.unit, row.truth, row.tolerance, row.because, row.source)


def _draft(row: Row) -> Family:
    """Family of rows that nobody has given a reason for: one profile, scene and kind of metric."""
    metric = row.metric.partition("[")[0]
    release = ".".join(row.engine_version.partition("+")[0].split(".")[:2])
    name = f"{row.profile}-{row.scene}-{metric}".replace("_", "-")
    return Family(name, (row.profile,), row.scene, (metric,), "", "", f"=={release}.*")


def accepted(proposal: Proposal, families: Collection[str]) -> dict[Key, Finding]:
    """Members that are listed once the ``families`` (ids) are accepted; all others stand as before."""
    members = dict(proposal.kept)
    for change in proposal.changes:
        members |= change.same
        if change.family.id in families and not change.is_draft:
            members |= change.new
            members |= {key: now for key, (_, now) in change.drifted.items()}
        else:
            members |= change.gone
            members |= {key: before for key, (before, _) in change.drifted.items()}
    return members
