"""Overview of a run of many scenes: one matrix of groups that fits on a screen, and an answer per group.

A matrix of forty scenes has two hundred lines on a terminal of eighty columns, and its answers five hundred. If the
scenes of a run do not fit on a screen (`FIRST_LOOK`), groups of scenes replace them; ``crosscheck show --all`` and
the report show every scene.
"""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.table import Table
from rich.text import Text

from adapters.registry import is_ranked
from reports.answers import FIXES, Answer, configured
from reports.findings import ALARMING
from reports.matrix import ALARM, STYLES, Field, Matrix, matrix_of
from reports.wording import MARKS, plural, word_of
from validation.canonical import FAMILIES
from validation.posed import resolve

Plain = Mapping[str, Any]
#: Lines of a terminal without scrolling.
FIRST_LOOK = 30
#: Largest number of profiles in a line of the nearest ones.
NEAREST = 3


def families_of(rows: Sequence[Plain]) -> dict[str, list[str]]:
    """Group -> its scenes in the order of the rows: the known groups in their order, then others by name."""
    found: dict[str, list[str]] = defaultdict(list)
    for scene in dict.fromkeys(row["scene"] for row in rows):
        found[resolve(scene).family].append(scene)
    names = [name for name in FAMILIES if name in found] + sorted(set(found) - set(FAMILIES))
    return {name: found[name] for name in names}


def by_family(rows: Sequence[Plain], families: Mapping[str, Sequence[str]]) -> Matrix:
    """Matrix of groups instead of scenes; dimension 0 means all together."""
    family = {scene: name for name, scenes in families.items() for scene in scenes}
    return matrix_of({**row, "scene": family[row["scene"]], "dimension": 0} for row in rows)


def table_of(matrix: Matrix, families: Sequence[str], roles: bool = False) -> Table:
    """Terminal table: a line per engine and profile, with its role if wanted; a column per group, a word a line."""
    table = Table(box=SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=0)
    table.add_column("engine,\nprofile", no_wrap=True)
    for name in families:
        table.add_column(name.replace(" ", "\n"), no_wrap=True)
    for engine in dict.fromkeys(engine for engine, _ in matrix.columns):
        table.add_row(Text(engine, style="bold"))
        for column in (column for column in matrix.columns if column[0] == engine):
            fields = [matrix.fields.get(((name, 0), column)) for name in families]
            role = f" ({word_of(*column)})" if roles and word_of(*column) else ""
            name = column[1].replace("+", "\n    +") + role  # a user's own settings, a line each
            table.add_row(Text(f"  {name}"), *(_cell(field) for field in fields))
    return table


def _cell(field: Field | None) -> Text:
    """``pass``, the share of checks that fail, with ``!`` where some are unexpected, or ``-``."""
    if field is None:
        return Text("")
    if field.mark not in MARKS:
        return Text("-", style=STYLES.get(field.mark, ""))
    text = share(field.missed, field.judged) if field.missed else "pass"
    if field.mark in ALARMING:
        return Text(f"{text} !", style=ALARM)
    return Text(text, style=STYLES.get(field.mark, ""))


def share(part: float, whole: float) -> str:
    """Per cent without digits; 0 % and 100 % only for exactly none and all."""
    per_cent = 100.0 * part / whole
    if 0.0 < per_cent < 1.0:
        return "<1 %"
    return f"{math.floor(per_cent) if per_cent > 99.0 else round(per_cent)} %"


def legend(matrix: Matrix) -> str:
    """Explanation of the numbers and signs that occur."""
    marks = {field.mark for field in matrix.fields.values()}
    said = ["Percentage of checks that fail, over all scenes of a group, 2-D and 3-D."]
    if marks & set(ALARMING):
        said.append("Marked with !: some results are unexpected, as listed below.")
    if "unsupported" in marks:
        said.append("A dash: the engine cannot run these scenes.")
    return " ".join(said)


def choices(rows: Sequence[Plain], families: Mapping[str, Sequence[str]]) -> Iterator[tuple[str, str]]:
    """Group, and the profiles that pass every row of all its scenes; else the nearest ones."""
    matrix = by_family(rows, families)
    asked: dict[tuple[str, tuple[str, str]], set[str]] = defaultdict(set)
    family = {scene: name for name, scenes in families.items() for scene in scenes}
    for row in configured(rows):
        asked[family[row["scene"]], (row["engine"], row["profile"])].add(row["scene"])
    for name, scenes in families.items():
        own = {c: f for (line, c), f in matrix.fields.items() if line[0] == name and f.judged and is_ranked(*c)}
        good = [_named(c, len(asked[name, c]), len(scenes)) for c, f in own.items() if not f.missed]
        others = sorted((f.missed / f.judged, c) for c, f in own.items() if f.missed)
        near = [f"{'/'.join(c)} {share(own[c].missed, own[c].judged)}" for _, c in others][:NEAREST]
        said = ", ".join(good) if good else "none passes every check" if own else "no verdict: no engine can run it"
        yield name, said + (f"; nearest: {', '.join(near)}" if near and len(good) < NEAREST else "")


def _named(column: tuple[str, str], asked: int, scenes: int) -> str:
    """``engine/profile``, with the number of scenes that it can run if not all."""
    return "/".join(column) + (f" ({asked} of {plural(scenes, 'scene')} run)" if asked < scenes else "")


def shortened(answer: Answer) -> Answer:
    """The answer without single settings if a whole profile fixes it: ``explain`` shows them."""
    cure, _, _ = answer.cure.partition("; ")
    return replace(answer, cure=cure.partition(", by ")[0]) if re.match(FIXES, cure) else answer


def worst_answers(
    rows: Sequence[Plain], found: Sequence[Answer], families: Mapping[str, Sequence[str]]
) -> list[Answer]:
    """Of the answers ``found``, for each engine and group the one about the scene with most failed rows.

    Only for profiles as shipped: answers of `reports.answers` about others list only worse results.
    """
    family = {scene: name for name, scenes in families.items() for scene in scenes}
    shipped: dict[str, str] = {}
    for row in rows:
        shipped.setdefault(row["engine"], row["profile"])
    worst: dict[tuple[str, str], Answer] = {}
    for answer in found:
        key = answer.engine, family[answer.scene]
        if answer.profile == shipped[answer.engine] and (key not in worst or answer.failing > worst[key].failing):
            worst[key] = answer
    order = list(families)
    chosen = sorted(worst.values(), key=lambda a: (list(shipped).index(a.engine), order.index(family[a.scene])))
    return [shortened(answer) for answer in chosen]
