"""Groups of scenes: a line of marks and a sentence each, so that forty scenes read like eight."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from reports.matrix import UNJUDGED, Field, Matrix, matrix_of
from reports.page.conclusions import clean_profiles
from reports.page.source import Source
from reports.page.verdicts import Mark, MatrixLine, family_mark, matrix_lines, slug
from reports.wording import joined, mark_of, plural
from validation.canonical import FAMILIES
from validation.posed import resolve

#: Largest number of scenes that a sentence names one by one.
FEW = 3


@dataclass(frozen=True)
class Family:
    """One group: its scenes, a sentence about the data, a mark per engine and profile, and the lines of its scenes."""

    name: str
    anchor: str
    scenes: tuple[str, ...]
    sentence: str
    marks: list[Mark]
    lines: list[MatrixLine]


def families(source: Source) -> list[Family]:
    """Groups of the run's scenes: the known ones in their order, then others by name."""
    found = matrix_of(source.rows)
    scenes: dict[str, list[str]] = {}
    for scene in source.scenes:
        scenes.setdefault(resolve(scene).family, []).append(scene)
    names = [name for name in FAMILIES if name in scenes] + sorted(set(scenes) - set(FAMILIES))
    return [_family(source, found, name, scenes[name]) for name in names]


def _family(source: Source, found: Matrix, name: str, scenes: Sequence[str]) -> Family:
    lines = [line for line in source.lines if line[0] in scenes]
    anchor = slug("family", name)
    marks = []
    for column in source.columns:
        own: Counter[str] = Counter()
        for line in lines:
            own += found.fields[line, column].marks if (line, column) in found.fields else Counter()
        marks.append(family_mark(Field(own) if own else None, anchor))
    return Family(name, anchor, tuple(scenes), sentence(source, scenes), marks, matrix_lines(source, found, lines))


def sentence(source: Source, scenes: Sequence[str]) -> str:
    """Sentence about some scenes: engines that pass all of them, and where each other engine has no clean profile."""
    clean = {scene: clean_profiles(source, scene) for scene in scenes}
    asked = {
        engine: [s for s in scenes if any(mark_of(r) not in UNJUDGED for r in source.of(scene=s, engine=engine))]
        for engine in source.engines
    }
    whole, lacking = [], []
    for engine, own in asked.items():
        without = [scene for scene in own if not clean[scene].get(engine)]
        if own and not without:
            whole.append(engine if len(own) == len(scenes) else f"{engine} ({len(own)} of {len(scenes)} run)")
        elif without:
            where = joined(without) if len(without) <= FEW else f"{len(without)} of {len(own)}"
            lacking.append(f"{engine} fails {where}")
    if not whole and not lacking:
        return "No engine gave an answer that is judged."
    passing = [f"{joined(whole)} {'passes' if len(whole) == 1 else 'pass'} every check"] if whole else []
    return f"{plural(len(scenes), 'scene')}. With its best profile for each: {'; '.join([*passing, *lacking])}."
