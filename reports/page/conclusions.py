"""Conclusions in sentences: where engines agree, where they differ by a law, where something is wrong.

Every sentence is computed from the rows; none is fixed.
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from adapters.registry import is_ranked
from reports.findings import ALARMING, ORDER, has_answer
from reports.matrix import UNJUDGED
from reports.page.source import Source
from reports.page.verdicts import (
    SAID,
    family_of,
    ratio_of,
    severity,
    slug,
    times,
    why_anchor,
    without_prediction,
)
from reports.wording import joined, mark_of, measured, number, params_text, quantity

Plain = Mapping[str, Any]


def clean_profiles(source: Source, scene: str) -> dict[str, list[str]]:
    """Engine -> its profiles that pass every judged row of ``scene``, in every dimension that the engine has."""
    found: dict[str, list[str]] = {}
    for engine, profile in (column for column in source.columns if is_ranked(*column)):
        rows = [r for r in source.of(scene=scene, engine=engine, profile=profile) if r["outcome"] != "unsupported"]
        judged = [row for row in rows if row["physics"] or row["outcome"] != "ok"]
        if judged and all(mark_of(row) == "pass" for row in judged):
            found.setdefault(engine, []).append(profile)
    return found


#: Largest number of scenes without a clean profile of some engine that are named one by one; of more, a sentence per
#: engine.
FEW = 4
#: Largest number of scenes named in a sentence of the first screen; of more, it says how many, and the groups below
#: name them.
NAMED = 6


def scenes_text(scenes: Sequence[str], of: int) -> str:
    """Names of scenes if they are few, else how many of how many."""
    return joined(scenes) if len(scenes) <= NAMED else f"{len(scenes)} of {of} scenes"


def answering(source: Source) -> list[str]:
    """Engines with at least one judged answer."""
    return [engine for engine in source.engines if any(row["physics"] for row in source.of(engine=engine))]


def answers(source: Source, scene: str, engine: str) -> bool:
    """Whether an engine has a judged answer on a scene."""
    return any(row["physics"] for row in source.of(scene=scene, engine=engine))


def agreement(source: Source) -> str:
    """Where the engines agree."""
    engines = answering(source)
    if not engines:
        return "No engine gave an answer that is judged."
    clean = {scene: clean_profiles(source, scene) for scene in source.scenes}
    everywhere = [scene for scene in source.scenes if engines and all(e in clean[scene] for e in engines)]
    parts = []
    if everywhere:
        who = [f"{engine} ({'/'.join(clean[everywhere[0]][engine])})" for engine in engines]
        same = all(clean[s] == clean[everywhere[0]] for s in everywhere)
        parts.append(
            f"on {scenes_text(everywhere, len(source.scenes))} every engine has a profile within every tolerance"
            + (f": {joined(who)}" if same else "")
            + _spread(source, everywhere[0], clean[everywhere[0]])
        )
    elsewhere = [scene for scene in source.scenes if scene not in everywhere]
    if len(elsewhere) > FEW:
        for engine in engines:
            asked = [scene for scene in source.scenes if answers(source, scene, engine)]
            without = [scene for scene in asked if scene in elsewhere and not clean[scene].get(engine)]
            if without:
                parts.append(f"no profile of {engine} passes everything on {scenes_text(without, len(asked))}")
        return "; ".join(parts) + "."
    for scene in elsewhere:
        who = [f"{e}/{p}" for e, profiles in clean[scene].items() for p in profiles]
        parts.append(f"on {scene} only {joined(who)}" if who else f"on {scene} none passes everything")
    return "; ".join(parts) + "."


def _spread(source: Source, scene: str, clean: Mapping[str, Sequence[str]]) -> str:
    """Largest difference between engines in the scene's first check."""
    rows = [r for r in source.of(scene=scene) if r["profile"] in clean.get(r["engine"], ()) and r["value"] is not None]
    if not rows:
        return ""
    metric, unit = rows[0]["metric"], rows[0]["unit"]
    values: dict[Any, list[float]] = defaultdict(list)
    for row in rows:
        if row["metric"] == metric:
            values[row["dimension"], params_text(row["params"]), row["dt"]].append(row["value"])
    largest = max(max(group) - min(group) for group in values.values())
    return f" (their {metric} in {scene} differs by at most {number(largest, 2)}{'' if unit == '1' else ' ' + unit})"


def departures(source: Source) -> str:
    """Where engines differ by a known law."""
    groups: dict[tuple[str, str], list[Plain]] = defaultdict(list)
    for row in source.rows:
        if row["standing"] == "explained":
            groups[row["engine"], row["profile"]].append(row)
    if not groups:
        return "No failure is what the contact model of an engine predicts."
    total = sum(len(group) for group in groups.values())
    parts = []
    for (engine, profile), group in sorted(groups.items(), key=lambda item: -len(item[1]))[:3]:
        scenes = scenes_text(list(dict.fromkeys(row["scene"] for row in group)), len(source.scenes))
        because = Counter(_law_text(row["reason"]) for row in group).most_common(1)[0][0]
        parts.append(f"{engine}/{profile} on {scenes} ({len(group)}: {because})")
    more = f"; and {len(groups) - 3} more" if len(groups) > 3 else ""
    return f"{total} failures are what the engine's contact model predicts: {'; '.join(parts)}{more}."


def _law_text(reason: str) -> str:
    """First clause of a law's reason, without the prediction of one row."""
    return re.split(r" \(predicted|, |; ", reason)[0].strip()


def wrongs(source: Source) -> str:
    """Where something is wrong: unexpected results first, else the largest failures that are known."""
    counts = Counter(mark_of(row) for row in source.rows)
    alarms = [f"{counts[mark]} {SAID[mark][1]}" for mark in ALARMING if counts[mark]]
    said = ""
    if alarms:
        worst = max((row for row in source.rows if mark_of(row) in ALARMING), key=severity)
        said = f"{joined(alarms)} checks need attention, first {_row_text(worst)}. "
    listed = [row for row in source.rows if mark_of(row) in ("known", "fail")]
    if not listed:
        if not answering(source) and not alarms:
            return "No check has a result."
        return said + ("Nothing else fails." if alarms else "Every failure is what the contact model predicts.")
    worst = max(listed, key=lambda row: ratio_of(row) or 0.0)
    unlisted = f" ({counts['fail']} of engines of which nothing is on record)" if counts["fail"] else ""
    head = "" if alarms else "Nothing is new, changed, invalid or crashed. "
    return f"{said}{head}{len(listed)} checks fail for other causes{unlisted}; the largest is {_row_text(worst)}."


def where_text(row: Plain) -> str:
    """Parameters and iterations that a row sets: ``n=10, 4 iterations``."""
    count = row["iterations"]
    own = "" if count is None else f"{count} iteration{'s' if count > 1 else ''}"
    return ", ".join(text for text in (params_text(row["slot"]["params"]), own) if text)


def _row_text(row: Plain) -> str:
    name = f"{row['engine']}/{row['profile']} on {row['scene']} {row['dimension']}-D"
    where = where_text(row)
    head = f"{name}{' with ' + where if where else ''}, {row['metric']}"
    if not has_answer(row):
        return f"{head}: {row['reason'] or row['outcome']}"
    ratio = ratio_of(row)
    off = f", {times(ratio)} tolerances off" if ratio is not None else ""
    return f"{head}: {measured(row)} instead of {quantity(row['truth'], row['unit'])}{off}"


def sentences(source: Source) -> list[tuple[str, str]]:
    """Three sentences with headings for the first screen."""
    return [
        ("Where they agree", agreement(source)),
        ("Where the contact model explains a failure", departures(source)),
        ("Where something is wrong", wrongs(source)),
    ]


@dataclass(frozen=True)
class FindingFamily:
    """Rows that fail alike, represented by the worst one."""

    engine: str
    profile: str
    scene: str
    dimension: int
    family: str
    count: int
    href: str
    text: str
    reason: str


@dataclass(frozen=True)
class Member:
    """A line of findings: equal texts in 2-D and 3-D share it, with a link to each."""

    scene: str
    family: str
    links: tuple[tuple[int, str], ...]
    count: int
    text: str


@dataclass(frozen=True)
class Reasoned:
    """Findings of one engine and profile with the same reason, with the fix of each of their scenes."""

    anchor: str
    engine: str
    profile: str
    reason: str
    cures: tuple[tuple[str, str], ...]
    members: tuple[Member, ...]


def by_reason(source: Source, mark: str, found: Iterable[FindingFamily]) -> list[Reasoned]:
    """Findings grouped by reason, in the order of the first one of each."""
    # Only the first part of a fix: its settings are listed once, with the errors.
    cured = {(a.engine, a.profile, a.scene): a.cure.partition("; ")[0] for a in source.answers}
    groups: dict[tuple[str, str, str], list[FindingFamily]] = defaultdict(list)
    for finding in found:
        groups[finding.engine, finding.profile, without_prediction(finding.reason)].append(finding)
    grouped = []
    for (engine, profile, reason), members in groups.items():
        by_cure: dict[str, list[str]] = defaultdict(list)
        for scene in dict.fromkeys(member.scene for member in members):
            by_cure[cured.get((engine, profile, scene), "")].append(scene)
        fixes = tuple((joined(scenes), cure) for cure, scenes in by_cure.items() if cure)
        anchor = why_anchor(mark, engine, profile, reason)
        grouped.append(Reasoned(anchor, engine, profile, reason, fixes, _lines(members)))
    return grouped


def _lines(found: Iterable[FindingFamily]) -> tuple[Member, ...]:
    alike: dict[tuple[str, str, str], list[FindingFamily]] = defaultdict(list)
    for each in found:
        alike[each.scene, each.family, each.text].append(each)
    return tuple(
        Member(scene, family, tuple((f.dimension, f.href) for f in own), sum(f.count for f in own), text)
        for (scene, family, text), own in alike.items()
    )


def findings(source: Source) -> list[tuple[str, int, list[FindingFamily]]]:
    """Failing rows by regression status, most serious first, and within it by kind of metric, worst first."""
    groups: dict[str, dict[tuple[Any, ...], list[Plain]]] = defaultdict(lambda: defaultdict(list))
    for row in source.rows:
        mark = mark_of(row)
        if mark not in ("pass", *UNJUDGED):
            key = (row["engine"], row["profile"], row["scene"], row["dimension"], family_of(row["metric"]))
            groups[mark][key].append(row)
    order = [mark for mark in ORDER if mark in groups]
    out = []
    for mark in order:
        families = sorted(groups[mark].items(), key=lambda item: -max(ratio_of(r) or 0.0 for r in item[1]))
        shown = [_finding(key, rows) for key, rows in families]
        out.append((mark, sum(len(rows) for _, rows in families), shown))
    return out


def _finding(key: tuple[Any, ...], rows: Sequence[Plain]) -> FindingFamily:
    worst = max(rows, key=severity)
    engine, profile, scene, dimension, family = key
    where = where_text(worst)
    value = worst["outcome"] if worst["value"] is None else measured(worst)
    text = f"{where + ': ' if where else ''}{worst['metric']} = {value}, "
    text += (
        f"truth {quantity(worst['truth'], worst['unit'])}, tolerance {quantity(worst['tolerance'], worst['unit'], 2)}"
    )
    href = "#" + slug(scene, dimension, "check", family)
    return FindingFamily(
        engine, profile, scene, dimension, family, len(rows), href, text, worst["reason"],
    )  # fmt: skip
