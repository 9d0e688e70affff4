"""Lists rows that do not pass as findings: what may be listed, what never is, and how wide a finding's band is.

    rows of a run  ->  propose  ->  families with what is new, drifted or gone, and refusals  ->  accepted

A proposal changes nothing. A family is written only once somebody has said, or said again, why its rows are as they
are; the entries of all others, and of every cell that did not run to its end, stay as they stand.

How wide a band is
    An engine does the same again, bit by bit; on another machine it rounds otherwise. What that makes of a value is
    drawn by starts moved by some units in the last place (`MOVES`): four times the largest change that four of them
    make. Of normal values one in 380 leaves such a band, for the largest of four changes is a draw itself (1.94
    standard deviations in the mean, but with a spread of a third).
    That is so wide that it may hide what it is there to show: a value that scatters by a fifth of itself has a band
    of 1.6 times itself, which holds zero, and a finding that comes ten times nearer to the truth, or passes, is still
    the same. Where a band reaches the tolerance of its own check, or hides a change to a third (`hides`), twelve more
    starts are asked (`MORE_MOVES`), and the band is what Student's t expects of one more draw, at one in a thousand, of
    values and of the logarithms of their distances from the truth, if all lie on one side of it: the logarithm's end
    towards the truth, which distances that are multiplied by what a rounding grows to cannot reach, and the values' end
    away from it, for a logarithm's runs away (two kinds of draws a thousandfold apart: beyond the size of the scene).
    Of values multiplied by e^.4, one standard deviation, one in 110 leaves it; of the band of four, which holds the
    truth, one in 150. The logarithm of four moves would not do: it holds a nineteenth and nineteen times the value.
    What then still reaches the tolerance is a row that some starts on the same machine pass or come near to passing, or
    whose draws lie on both sides of the truth: no single run can see it drift. Of 86 rows of columns, piles and
    grips with such bands 8 saw that they pass, and with bands of sixteen starts 40 do; 24 pass from some of them.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from validation.canonical import Check
from validation.cells import Observation, Outcome, Slot, slot_from_dict
from validation.findings import Family, Finding, Findings, Key, row_key, solutions_of
from validation.judging.rows import Row, predictions_of
from validation.judging.studies import study_of
from validation.judging.verdicts import is_marginal
from validation.running.plan import is_standard

#: Starts moved by so many units in the last place show how far a value scatters.
MOVES = (1, -1, 2, -2)
#: Further starts where the band from those hides what it is there to show.
MORE_MOVES = tuple(sign * move for move in range(3, 9) for sign in (1, -1))
#: The band of a scattering value, in units of the largest change that the four moves made.
SCATTER_FACTOR = 4.0
#: Two-sided quantile .001 of Student's t by degrees of freedom: starts that left no value are missing.
STUDENT = {12: 4.3178, 13: 4.2208, 14: 4.1405, 15: 4.0728, 16: 4.0150}
#: A band hides what comes nearer to the truth by this share of its distance.
HIDDEN = 2.0 / 3.0
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
    bands
        Members as listed, with a band that hides what it should show; and with one from more starts.
    """

    family: Family
    same: dict[Key, Finding] = field(default_factory=dict)
    new: dict[Key, Finding] = field(default_factory=dict)
    drifted: dict[Key, tuple[Finding, Finding]] = field(default_factory=dict)
    gone: dict[Key, Finding] = field(default_factory=dict)
    bands: dict[Key, tuple[Finding, Finding]] = field(default_factory=dict)

    @property
    def is_draft(self) -> bool:
        """Whether nobody has said yet why these rows fail."""
        return not self.family.reason

    @property
    def asks(self) -> bool:
        """Whether accepting it would change what is listed."""
        return bool(self.new or self.drifted or self.gone or self.bands)


@dataclass(frozen=True)
class Proposal:
    """What listing a run would change for one engine, and the rows that are refused, each with why."""

    engine: str
    changes: tuple[Change, ...]
    kept: Mapping[Key, Finding]
    refused: tuple[tuple[Row, str], ...]
    left_out: tuple[Row, ...] = ()


#: Values of a row: of the cell as it is, then of its moved starts.
Draws = tuple[float, ...]


def slots_to_move(rows: Iterable[Row], engine: str, about: Callable[[Key], bool] = lambda key: True) -> list[Slot]:
    """Slots whose scatter must be known: each cell of the standard suite that fails, or nearly, once per move.

    ``about``: which rows are to be listed.
    """
    return _moved(rows, engine, about, MOVES, lambda row: row.floor is None)


def slots_to_move_further(
    rows: Iterable[Row], engine: str, draws: Mapping[Key, Draws], about: Callable[[Key], bool] = lambda key: True
) -> list[Slot]:
    """Slots of cells with a row whose band, from `MOVES` alone, hides what it should show; once per further move."""

    def is_hidden(row: Row) -> bool:
        known = draws.get(row_key(slot_from_dict(row.slot), row.metric), ())
        return row.floor is not None and len(known) <= 1 + len(MOVES) and hides(row, _ends(row, known))

    return _moved(rows, engine, about, MORE_MOVES, is_hidden)


def _moved(
    rows: Iterable[Row], engine: str, about: Callable[[Key], bool], moves: Iterable[int], which: Callable[[Row], bool]
) -> list[Slot]:
    cells: dict[Slot, None] = {}
    for row in rows:
        if row.engine != engine or not about(row_key(slot_from_dict(row.slot), row.metric)):
            continue
        if _may_be_listed(row) and not _is_study(row) and which(row):
            cells[slot_from_dict(row.slot)] = None
    return [Slot(**{**vars(slot), "ulp": ulp}) for slot in cells for ulp in moves]


def draws_of(observations: Iterable[Observation]) -> dict[Key, Draws]:
    """Values of every row of ``observations``: the unmoved start first, then moved ones by how far; of sound cells."""
    found: dict[Key, dict[int, float]] = {}
    for observation in observations:
        if observation.outcome is Outcome.OK:
            for metric, (value, _) in observation.metrics.items():
                if value is not None and math.isfinite(value):
                    key = row_key(observation.slot, metric)
                    found.setdefault(key, {})[observation.slot.ulp] = value
    order = (0, *MOVES, *MORE_MOVES)
    return {key: tuple(by[ulp] for ulp in order if ulp in by) for key, by in found.items() if 0 in by}


def _may_be_listed(row: Row) -> bool:
    if row.outcome != "ok" or row.value is None or row.standing == "explained" or _never(row):
        return False
    slot = slot_from_dict(row.slot)
    return (row.physics == "fail" or is_marginal(row.value, _check(row))) and is_standard(slot)


def propose(
    rows: Iterable[Row],
    engine: str,
    findings: Findings | None,
    about: Callable[[Key], bool] = lambda key: True,
    draws: Mapping[Key, Draws] | None = None,
) -> Proposal:
    """Compare ``rows`` of a run with what is listed for ``engine``; see `Change` and `Proposal`.

    ``rows`` carry their scatter (`Row.floor`), so the run's cells have been run from moved starts as well; ``draws``
    are the values of those that were asked for more of them. What
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
        why, found = _entry(row, (draws or {}).get(key, ()))
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
            _place(change, key, Finding(family, *found), kept, row)
    for key in _no_longer_stated(kept, judged):
        finding = kept.pop(key)
        changes[finding.family.id].gone[key] = finding
    return Proposal(engine, tuple(changes.values()), kept, tuple(refused), tuple(left_out))


def _place(change: Change, key: Key, found: Finding, kept: dict[Key, Finding], row: Row) -> None:
    old = kept.pop(key, None)
    if old is None:
        change.new[key] = found
    elif old.diverged != found.diverged or (old.value is None) != (found.value is None):
        change.drifted[key] = (old, found)
    elif old.value is None or (found.value is not None and old.holds(found.value)):
        if found.ends is not None and old.ends is None and hides(row, _about(old.value or 0.0, old.band)):
            change.bands[key] = (old, found)
        else:
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


#: Value, band, whether it diverged, and the ends of a band that is not as wide on both sides.
Entry = tuple[float | None, float, bool, tuple[float, float] | None]


def _entry(row: Row, draws: Draws = ()) -> tuple[str, Entry | None]:
    """Why a row is refused, or what is listed of it; neither where there is nothing to list."""
    if why := _must_not_be_listed(row):
        return why, None
    if row.outcome == "diverged":
        return "", (None, 0.0, True, None)
    if row.truth is None or row.tolerance is None or row.standing == "explained":
        return "", None
    if row.value is None:
        return "", (None, 0.0, False, None)
    if row.physics == "pass" and not is_marginal(row.value, _check(row)):
        return "", None
    if row.floor is None and not _is_study(row):
        return "its scatter is not known: the cell has not been run from moved starts", None
    ends = _ends(row, draws)
    if row.physics == "pass" and max(abs(end - row.truth) for end in ends) <= row.tolerance:
        return "", None
    if len(draws) - 1 in STUDENT:
        return "", (row.value, 0.0, False, ends)
    return "", (row.value, _width(row, draws), False, None)


def band(value: float, tolerance: float, scatter: float) -> float:
    """Half width within which a value is the same finding, from its largest change under moved starts."""
    return max(SCATTER_FACTOR * scatter, TOLERANCE_SHARE * tolerance, VALUE_SHARE * abs(value))


def _width(row: Row, draws: Draws) -> float:
    """Half width from four moved starts; rows of a cell that was moved further for another one have more."""
    value, tolerance = row.value or 0.0, row.tolerance or 0.0
    few = draws[: 1 + len(MOVES)]
    scatter = max((abs(each - value) for each in few), default=0.0) if len(few) > 1 else row.floor or 0.0
    return band(value, tolerance, scatter)


def _ends(row: Row, draws: Draws) -> tuple[float, float]:
    """Least and largest value of the same finding."""
    value, tolerance, truth = row.value or 0.0, row.tolerance or 0.0, row.truth or 0.0
    if len(draws) - 1 not in STUDENT:
        return _about(value, _width(row, draws))
    low, high = one_more(draws, truth)
    least = band(value, tolerance, 0.0)
    return min(low, value - least), max(high, value + least)


def _about(value: float, width: float) -> tuple[float, float]:
    return value - width, value + width


def one_more(draws: Draws, truth: float) -> tuple[float, float]:
    """Ends between which one more draw lies; never narrower than all draws (see above).

    Where draws lie on both sides of the truth, or on it, their distances have no logarithms, and values alone count.
    """
    side = math.copysign(1.0, draws[0] - truth)
    away = [(each - truth) * side for each in draws]
    near, far = _student(away)
    if min(away) > 0.0:
        near = max(near, math.exp(_student([math.log(each) for each in away])[0]))
    low, high = sorted((truth + side * near, truth + side * far))
    return low, high


def _student(points: Sequence[float]) -> tuple[float, float]:
    """Ends between which one more of normal points lies, in all but one of a thousand cases."""
    half = STUDENT[len(points) - 1] * math.sqrt(1.0 + 1.0 / len(points)) * statistics.stdev(points)
    mean = statistics.fmean(points)
    return mean - half, mean + half


def hides(row: Row, ends: tuple[float, float]) -> bool:
    """Whether a band holds values that pass, of a row that fails, or any as near as a third of its distance."""
    if row.value is None or row.truth is None or row.tolerance is None:
        return False
    distance = abs(row.value - row.truth)
    nearest = 0.0 if ends[0] <= row.truth <= ends[1] else min(abs(end - row.truth) for end in ends)
    reaches = row.physics == "fail" and nearest <= row.tolerance
    return reaches or nearest <= (1.0 - HIDDEN) * distance


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
            members |= {key: now for key, (_, now) in (*change.drifted.items(), *change.bands.items())}
        else:
            members |= change.gone
            members |= {key: before for key, (before, _) in (*change.drifted.items(), *change.bands.items())}
    return members
