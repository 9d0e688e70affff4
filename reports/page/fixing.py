"""Errors of each engine, and the setting that fixes each: before, after, cost, and lines to paste."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from reports.answers import Answer, configured, named_kind
from reports.fixes import cure_paste, is_standard, known_cures, panel_text, told, told_cures
from reports.page.source import Source
from reports.wording import mark_of
from validation.fixes.kept import Cure


@dataclass(frozen=True)
class Fix:
    """Settings that fix a scene, a check before and after, and the cost relative to that before."""

    where: str
    settings: list[tuple[str, str]]
    check: str
    before: str
    after: str
    left: str
    cost: str
    paste: str
    elsewhere: str


@dataclass(frozen=True)
class Wrong:
    """Error of one engine and profile in one scene, its fixes, and the results of its other profiles."""

    answer: Answer
    fixes: list[Fix]
    said: str


def wrongs(source: Source, answers: Iterable[Answer]) -> list[Wrong]:
    """One line per answer: with the fixes that are recommended; without any, with the words of the answer."""
    return [_wrong(source, answer) for answer in answers]


def _wrong(source: Source, answer: Answer) -> Wrong:
    rows = configured(source.of(scene=answer.scene, engine=answer.engine, profile=answer.profile))
    dimensions = sorted({row["dimension"] for row in rows if mark_of(row) != "pass" and is_standard(row)})
    which = (answer.engine, rows[0]["engine_version"], answer.scene, answer.profile, dimensions)
    known = known_cures(*which)
    kind = named_kind(row for row in rows if mark_of(row) != "pass")
    fixes = [_fix(cure, kind, "" if len(known) == 1 else where) for cure, where in known if cure.recommended]
    said = answer.cure.partition("; ")[0].partition(", by ")[0].replace("->", "→")
    return Wrong(answer, fixes, said if fixes else "; ".join([said, *told_cures(*which)]))


def _of(cure: Cure, kind: str) -> Cure:
    """The fix with the numbers of the check that the sentence beside it names, where it fixes that."""
    shown = next((each for each in cure.shown if each.metric.partition("[")[0] == kind), None)
    return replace(cure, **vars(shown)) if shown else cure


def _fix(cure: Cure, kind: str, where: str) -> Fix:
    said = told(_of(cure, kind))
    unit = f"\N{NO-BREAK SPACE}{said.unit}" if said.unit else ""
    return Fix(
        where,
        said.settings,
        f"{said.check}{f' at {said.at}' if said.at else ''}",
        said.before + unit,
        said.after + unit + (f" (true: {said.truth})" if said.truth else ""),
        said.left,
        f"{said.times}×" if said.times else "",
        cure_paste(cure),
        panel_text(cure.panel),
    )
