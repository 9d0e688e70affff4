"""The first screen: the finding of the run in a headline, and the engines as shipped beside their tuned profiles.

Everything is computed from the rows of the run: engines, shares and numbers.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache

from adapters.registry import facts, names
from reports.answers import configured
from reports.overview import share
from reports.page.conclusions import answering
from reports.page.source import Plain, Source
from reports.page.verdicts import family_of
from reports.palette import role_of
from reports.wording import ROLE_WORDS, joined, mark_of
from validation.canonical import Restitution
from validation.posed import resolve

#: Roles of the two profiles that are shown first for each engine.
FIRST, SECOND = ("shipped", "textbook"), ("tuned", "solution")
#: Share of failed checks above which an engine does not do what it is set to.
MOST = 0.5


@dataclass(frozen=True)
class Half:
    """A column of the first matrix: a profile, its name for people, and its place among all columns."""

    profile: str
    word: str
    place: int


@cache
def called(engine: str) -> str:
    """Name of an engine for people: the first word of its title; if others begin so too, all before a bracket."""
    titles = {name: known.title for name in names() if (known := facts(name))}
    if engine not in titles:
        return engine
    short = titles[engine].split()[0]
    alone = [title.split()[0] for title in titles.values()].count(short) == 1
    return short if alone else titles[engine].partition(" (")[0]


def word_of(profile: str) -> str:
    """Name of a profile for people by its role; without a role its own name."""
    return ROLE_WORDS.get(role_of(profile) or "", profile)


def halves(source: Source) -> list[tuple[str, list[Half]]]:
    """Per engine at most two columns: as shipped and tuned; for an engine without roles its first two."""
    found = []
    for engine in source.engines:
        own = [Half(p, word_of(p), k) for k, (name, p) in enumerate(source.columns) if name == engine]
        chosen = [half for roles in (FIRST, SECOND) for half in own if role_of(half.profile) in roles]
        found.append((engine, (chosen or own)[:2]))
    return found


def shares(rows: Iterable[Plain]) -> dict[tuple[str, str], float]:
    """Share of the judged checks that fail, per engine and word of its profile."""
    passed: dict[tuple[str, str], list[bool]] = {}
    for row in configured(rows):
        passed.setdefault((row["engine"], word_of(row["profile"])), []).append(mark_of(row) == "pass")
    return {key: 1.0 - sum(own) / len(own) for key, own in passed.items()}


def shown(source: Source, series: bool) -> tuple[str, Restitution] | None:
    """First scene of the run that shows restitution as a series of heights, or as a ratio of speeds."""
    declared = ((scene, resolve(scene).restitution) for scene in source.scenes)
    return next(((scene, found) for scene, found in declared if found and bool(found.heights) is series), None)


def rebounds(source: Source) -> list[Plain]:
    """Rows that measure a restitution in the scenes for which the page shows it."""
    restitutions = filter(None, (shown(source, series) for series in (True, False)))
    return [
        r for scene, found in restitutions for r in source.of(scene=scene) if family_of(r["metric"]) == found.metric
    ]


def headline(source: Source) -> str:
    """The finding: engines that do not rebound as set, where, whether tuning helps; else the one with most failures."""
    if not answering(source):
        return "No check has a result."
    rebound = shares(rebounds(source))
    wrong = [e for e in source.engines if rebound.get((e, "as shipped"), 0.0) > MOST]
    if not wrong:
        return _most_failures(source)
    scenes = list(dict.fromkeys(row["scene"] for row in rebounds(source)))
    return f"{_rebounds(wrong, rebound)} ({'scene' if len(scenes) == 1 else 'scenes'} {joined(scenes)})"


def _rebounds(wrong: Sequence[str], rebound: dict[tuple[str, str], float]) -> str:
    tuned = [e for e in wrong if (e, "tuned") in rebound]
    mended = [e for e in tuned if rebound[e, "tuned"] == 0.0]
    said = f"{joined(map(called, wrong))} {_verb(wrong)} not rebound as set"
    if len(tuned) == len(wrong) and not mended:
        return f"{said}, neither as shipped nor tuned"
    if not mended:
        return f"As shipped, {said}"
    who = {1: "it", 2: "both"}.get(len(wrong), "all") if mended == wrong else joined(map(called, mended))
    return f"As shipped, {said}; tuned, {who} {_verb(mended)}"


def _verb(engines: Sequence[str]) -> str:
    return "does" if len(engines) == 1 else "do"


def _most_failures(source: Source) -> str:
    """If all engines rebound as set, or none ran such a scene: most failures as shipped, and those when tuned."""
    found = shares(source.rows)
    shipped = {engine: part for (engine, word), part in found.items() if word == "as shipped"}
    if not shipped:
        worst = max(found, key=lambda key: found[key])
        return f"{called(worst[0])} ({worst[1]}) fails {_percent(found[worst])} of its checks"
    engine = max(shipped, key=lambda name: shipped[name])
    if shipped[engine] == 0.0:
        return f"As shipped, {called(engine) if len(shipped) == 1 else 'every engine'} passes every check"
    said = f"As shipped, {called(engine)} fails {_percent(shipped[engine])} of its checks"
    said += ", the most of all engines" if len(shipped) > 1 else ""
    return said + (f"; tuned, {_percent(found[engine, 'tuned'])}" if (engine, "tuned") in found else "")


def _percent(part: float) -> str:
    return share(part, 1.0) if part else "none"
