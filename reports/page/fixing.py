"""Errors of each engine, and the setting that fixes each: before, after, cost, and lines to paste."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace

from reports.answers import Answer, configured, named_kind, wrong_of
from reports.findings import has_answer
from reports.fixes import cure_paste, is_shown, is_standard, known_cures, panel_text, told, told_cures
from reports.page.source import Plain, Source
from reports.wording import amount, mark_of
from validation.fixes.kept import Cure, Shown


@dataclass(frozen=True)
class Fix:
    """Settings that fix a scene; what is wrong in one check, before and after; the cost relative to that before."""

    where: str
    wrong: str
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
    fixes = [_fix(cure, rows, answer, "" if len(known) == 1 else where) for cure, where in known if cure.recommended]
    said = answer.cure.partition("; ")[0].partition(", by ")[0].replace("->", "→")
    return Wrong(answer, fixes, said if fixes else "; ".join([said, *told_cures(*which)]))


def _fix(cure: Cure, rows: Sequence[Plain], answer: Answer, where: str) -> Fix:
    """A fix with one check: that of the answer's words where the fix corrects it, else another one in its own words."""
    failing = [row for row in rows if mark_of(row) != "pass"]
    kind = named_kind(failing)
    shown = cure.shown or (cure,)
    chosen = next((each for each in shown if each.metric.partition("[")[0] == kind), None)
    wrong, untouched = answer.wrong, ""
    if chosen is None:
        chosen, untouched = shown[0], answer.wrong
    own = [row for row in failing if row["dimension"] == cure.dimension and is_shown(chosen, row)]
    told_here = bool(own) and has_answer(own[0])
    if told_here:
        wrong = wrong_of(rows, chosen.metric.partition("[")[0], own)
    said = told(replace(cure, **{field.name: getattr(chosen, field.name) for field in fields(Shown)}))
    check = f"{said.check}{f' at {said.at}' if said.at else ''}"
    before, after = (amount(text, said.unit).replace(" ", "\N{NO-BREAK SPACE}") for text in (said.before, said.after))
    return Fix(
        where,
        wrong,
        said.settings,
        check,
        ("" if told_here else f"{check}: ") + before,  # the run has not this case
        after + (f" (true: {said.truth})" if said.truth else ""),
        f"{said.left or 'not fixed'}: {untouched}" if untouched else said.left,
        f"{said.times}×" if said.times else "",
        cure_paste(cure),
        panel_text(cure.panel),
    )
