"""Lists failing rows as findings: which rows may be listed, and how wide a finding's band is.

    rows of a run  ->  propose  ->  families with what is new, drifted or gone, and refusals  ->  accepted

A proposal changes nothing. A family is written only after a person has stated or confirmed its cause; all other
entries, and those of cells that did not finish, stay unchanged.

How wide a band is
    An engine repeats its results bit by bit; on another machine it rounds differently. The effect on a value is sampled
    by starts moved by some units in the last place (`MOVES`): the band is four times the largest change by four of
    them. One in 380 normal values leaves such a band, because the largest of four changes scatters itself (1.94
    standard deviations in the mean, with a spread of a third). That band may be too wide to show changes: a value that
    scatters by a fifth of itself has a band of 1.6 times itself, which contains zero, so a finding that comes ten times
    nearer to the truth, or passes, stays the same. Where a band reaches the tolerance of its check, or hides a change
    to a third (`hides`), twelve more starts run (`MORE_MOVES`). The band is then the prediction interval of Student's t
    for one more draw, at one in a thousand, of values and, if all lie on one side of the truth, of the logarithms of
    their distances from it. Towards the truth the end of the logarithms is used, because round-off multiplies these
    distances; away from it the end of the values, because that of the logarithms can lie beyond the size of the scene.
    Of values multiplied by e^.4, one standard deviation, one in 110 leaves it; of the band of four, which contains the
    truth, one in 150. Logarithms of four moves are not enough: their band reaches from a nineteenth to nineteen times
    the value. A band that still reaches the tolerance belongs to a row that passes, or nearly, from some starts, or
    whose draws lie on both sides of the truth: a single run cannot show its drift. Of 86 rows of columns, piles and
    grips with such bands 8 showed a PASS as a change, with bands of sixteen starts 40 do; 24 pass from some starts.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from validation.canonical import Check
from validation.cells import Observation, Outcome, Slot, slot_from_dict
from validation.findings import Family, Finding, Findings, Key, Unsupported, row_key, solutions_of
from validation.judging.rows import ALARMING_OUTCOMES, Row, predictions_of
from validation.judging.studies import study_of
from validation.judging.verdicts import is_marginal
from validation.metrics import REALISED, UNTOLD
from validation.running.plan import is_standard

#: Moves of the start, in units in the last place, that sample the scatter of a value.
MOVES = (1, -1, 2, -2)
#: Further moves where the band from those is too wide to show changes.
MORE_MOVES = tuple(sign * move for move in range(3, 9) for sign in (1, -1))
#: Band of a scattering value, in units of the largest change by the four moves.
SCATTER_FACTOR = 4.0
#: Two-sided quantile .001 of Student's t by degrees of freedom: starts without a value are missing.
STUDENT = {12: 4.3178, 13: 4.2208, 14: 4.1405, 15: 4.0728, 16: 4.0150}
#: A band is too wide if it contains a value nearer to the truth by this share of the distance.
HIDDEN = 2.0 / 3.0
#: Least band: a hundredth of the check's tolerance, which is negligible, and a millionth of the value, the effect of an
#: iteration that stops one sweep earlier or later on another machine.
TOLERANCE_SHARE, VALUE_SHARE = 0.01, 1e-6


@dataclass
class Change:
    """One family of a proposal.

    Parameters
    ----------
    family
        The listed family; for rows without one a draft without reason and source.
    same, new
        Members as listed, and new ones.
    drifted
        Members outside their band: the listed and the new finding.
    gone
        Listed rows that pass now, or whose check no longer exists.
    bands
        Members with too wide a band, as listed and with a band from more starts.
    """

    family: Family
    same: dict[Key, Finding] = field(default_factory=dict)
    new: dict[Key, Finding] = field(default_factory=dict)
    drifted: dict[Key, tuple[Finding, Finding]] = field(default_factory=dict)
    gone: dict[Key, Finding] = field(default_factory=dict)
    bands: dict[Key, tuple[Finding, Finding]] = field(default_factory=dict)

    @property
    def is_draft(self) -> bool:
        """Whether the family has no cause yet."""
        return not self.family.reason

    @property
    def asks(self) -> bool:
        """Whether accepting it would change the list."""
        return bool(self.new or self.drifted or self.gone or self.bands)


@dataclass(frozen=True)
class Proposal:
    """Changes of the list of one engine by a run, and refused rows with their reasons.

    ``unsupported`` are entries of a first list, see `refusals`.
    """

    engine: str
    changes: tuple[Change, ...]
    kept: Mapping[Key, Finding]
    refused: tuple[tuple[Row, str], ...]
    left_out: tuple[Row, ...] = ()
    unsupported: tuple[Unsupported, ...] = ()


#: Values of a row: of the unmoved cell, then of its moved starts.
Draws = tuple[float, ...]


def slots_to_move(rows: Iterable[Row], engine: str, about: Callable[[Key], bool] = lambda key: True) -> list[Slot]:
    """Slots for the scatter: each cell of the standard suite that fails, or nearly, once per move.

    ``about`` selects the rows to list.
    """
    return _moved(rows, engine, about, MOVES, lambda row: row.floor is None)


def slots_to_move_further(
    rows: Iterable[Row], engine: str, draws: Mapping[Key, Draws], about: Callable[[Key], bool] = lambda key: True
) -> list[Slot]:
    """Slots of cells with a row whose band from `MOVES` is too wide; once per further move."""

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
    """Values of every row of ``observations``, unmoved start first, then by size of the move; valid cells only."""
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

    ``rows`` have their scatter (`Row.floor`), from moved starts; ``draws`` are the values of rows with further starts.
    Rows that ``about`` does not select stay as listed; among them, rows that must not be listed are refused too, and
    new or drifted ones are reported as left out.
    """
    rows, findings = list(rows), findings or Findings(engine, {}, (), {})
    first = () if findings.members or findings.unsupported else tuple(refusals(rows, engine))
    findings = replace(findings, unsupported=(*findings.unsupported, *first))
    changes: dict[str, Change] = {name: Change(family) for name, family in findings.families.items()}
    kept, refused, judged, left_out = dict(findings.members), [], set(), []
    # What an engine does not realise is declared by its adapter, or mended; its effects are no known failures.
    otherwise = {slot_from_dict(row.slot) for row in rows if row.metric.startswith(REALISED)}
    for row in rows:
        slot = slot_from_dict(row.slot)
        if row.engine != engine or not is_standard(slot):
            continue
        key = row_key(slot, row.metric)
        if row.outcome not in ("ok", "diverged"):
            # A cell without a result does not change a finding: its entries stay.
            if row.outcome in ("refused", *ALARMING_OUTCOMES):
                refused.append((row, f"{row.outcome}: {row.reason}"))
            told = row.outcome != "unsupported" or row.reason in UNTOLD
            if not told and not findings.unsupported_by(slot):
                refused.append((row, "the engine refuses the case: write that as [[unsupported]], with its reason"))
            continue
        if slot in otherwise and row.physics == "fail":
            refused.append((row, "its property checks do not hold"))
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
    return Proposal(engine, tuple(changes.values()), kept, tuple(refused), tuple(left_out), first)


def refusals(rows: Iterable[Row], engine: str) -> Iterator[Unsupported]:
    """Dimensions and scenes that the engine refuses with every profile, in its own words.

    An engine without a list has none of them listed; with a list each would be new, and the run would fail.
    """
    asked: dict[tuple[str, int], list[Row]] = {}
    for row in rows:
        if row.engine == engine and is_standard(slot_from_dict(row.slot)):
            asked.setdefault((row.scene, row.dimension), []).append(row)
    why = {where: own[0].reason for where, own in asked.items() if {row.outcome for row in own} == {"unsupported"}}
    whole = {d for _, d in asked if all(where in why for where in asked if where[1] == d)}
    for d in sorted(whole):
        said = next(why[where] for where in asked if where[1] == d)
        yield Unsupported(f"refuses-{d}-d", ("*",), "*", d, said, "the adapter refuses these cases")
    for (scene, d), said in why.items():
        if d not in whole:
            yield Unsupported(f"refuses-{scene}-{d}-d", ("*",), scene, d, said, "the adapter refuses these cases")


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
    """Entries of finished cells whose check does not exist any more."""
    cells = {key[:6] for key in judged}
    return [key for key in kept if key[:6] in cells and key not in judged]


def _must_not_be_listed(row: Row) -> str:
    """Why a row must not be listed, whatever its scatter; empty if it may."""
    if _never(row) and row.physics == "fail":
        return "its profile is exact: a failure there must be fixed, not listed"
    covered = row.truth is not None and row.tolerance is not None and row.value is not None
    if (
        covered
        and row.outcome == "ok"
        and row.standing != "explained"
        and row.physics == "fail"
        and predictions_of(row)
    ):
        return "a contact law predicts another value: the law or the engine has changed"
    return ""


#: Value, band, whether it diverged, and the ends of an asymmetric band.
Entry = tuple[float | None, float, bool, tuple[float, float] | None]


def _entry(row: Row, draws: Draws = ()) -> tuple[str, Entry | None]:
    """Why a row is refused, or its entry; neither where there is nothing to list."""
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
        return "its scatter is unknown: the case was not run from moved starts", None
    moved = [abs(each - row.truth) for each in draws[1:]]
    farthest = max(moved, default=abs(row.value - row.truth) + (row.floor or 0.0))
    if row.physics == "pass" and farthest <= row.tolerance:  # it fails neither here nor from a moved start
        return "", None
    if len(draws) - 1 in STUDENT:
        return "", (row.value, 0.0, False, _ends(row, draws))
    return "", (row.value, _width(row, draws), False, None)


def band(value: float, tolerance: float, scatter: float) -> float:
    """Half width within which a value is the same finding, from its largest change under moved starts."""
    return max(SCATTER_FACTOR * scatter, TOLERANCE_SHARE * tolerance, VALUE_SHARE * abs(value))


def _width(row: Row, draws: Draws) -> float:
    """Half width from four moved starts; rows of a cell with further starts for another row have more."""
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
    """Prediction interval of one more draw; never narrower than all draws (see above).

    Where draws lie on both sides of the truth, or on it, only values are used, not logarithms of distances.
    """
    side = math.copysign(1.0, draws[0] - truth)
    away = [(each - truth) * side for each in draws]
    near, far = _student(away)
    if min(away) > 0.0:
        near = max(near, math.exp(_student([math.log(each) for each in away])[0]))
    low, high = sorted((truth + side * near, truth + side * far))
    return low, high


def _student(points: Sequence[float]) -> tuple[float, float]:
    """Interval that contains one more normal point in all but one of a thousand cases."""
    half = STUDENT[len(points) - 1] * math.sqrt(1.0 + 1.0 / len(points)) * statistics.stdev(points)
    mean = statistics.fmean(points)
    return mean - half, mean + half


def hides(row: Row, ends: tuple[float, float]) -> bool:
    """Whether the band of a failing row contains values that pass, or any at a third of its distance."""
    if row.value is None or row.truth is None or row.tolerance is None:
        return False
    distance = abs(row.value - row.truth)
    nearest = 0.0 if ends[0] <= row.truth <= ends[1] else min(abs(end - row.truth) for end in ends)
    reaches = row.physics == "fail" and nearest <= row.tolerance
    return reaches or nearest <= (1.0 - HIDDEN) * distance


def _never(row: Row) -> bool:
    return row.profile in solutions_of(row.engine)


def _is_study(row: Row) -> bool:
    """A study has one of few values, which do not scatter with the last bits of a start."""
    return study_of(row.scene, row.metric) is not None


def _check(row: Row) -> Check:
    return Check(row.metric, row.unit, row.truth, row.tolerance, row.because, row.source)


def _draft(row: Row) -> Family:
    """Family of rows without a cause yet: one profile, scene and kind of metric."""
    metric = row.metric.partition("[")[0]
    release = ".".join(row.engine_version.partition("+")[0].split(".")[:2])
    name = f"{row.profile}-{row.scene}-{metric}".replace("_", "-")
    return Family(name, (row.profile,), row.scene, (metric,), "", "", f"=={release}.*")


def accepted(proposal: Proposal, families: Collection[str]) -> dict[Key, Finding]:
    """Members of the list after the ``families`` (ids) are accepted; all others are unchanged."""
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
