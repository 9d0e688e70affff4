"""Series over runs and over releases: the points of every panel, their steps and flips."""

from __future__ import annotations

import gc
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from reports.brief import Brief, Kept, Key, Summary, summarise
from reports.dashboard.steps import ERROR, TIME, Rule, Step, steps
from reports.page.charts import EXACT
from validation.bench import reading
from validation.bench.agreement import ratios
from validation.posed import resolve
from validation.records.store import RELEASE_TITLE, SCATTER_TITLE, Run, Store
from validation.releases import history
from validation.releases.timing import CALLED
from validation.running.plan import QUICK_DT

#: Indices in a `reports.brief.Brief`.
FAILS, JUDGED, SURE = 1, 2, 3


class Point(NamedTuple):
    """One run or release in a panel; a tuple, because 500 runs of the quick suite have a third of a million.

    Parameters
    ----------
    label, title
        Label on the axis; full name.
    error
        Largest primary error of the newest point's cases; None if not all were run.
    fails, judged
        Numbers of checks of those cases.
    lost, mended
        Cases in which a check began or ceased to fail since the last point with them, if moved starts do not explain
        it.
    """

    label: str
    title: str
    run: str
    version: str
    error: float | None
    fails: int
    judged: int
    lost: int = 0
    mended: int = 0
    ratio: float | None = None


@dataclass(frozen=True)
class Panel:
    """One engine, profile, scene and dimension, over runs or over releases."""

    key: Key
    over: str
    points: tuple[Point, ...]
    unit: str
    law: str
    error_steps: tuple[tuple[int, Step], ...]
    time_steps: tuple[tuple[int, Step], ...]
    opponent: str = ""
    anchor: str = ""

    @property
    def name(self) -> str:
        """``bounce 3-D``."""
        return f"{self.key[2]} {self.key[3]}-D"

    @property
    def flips(self) -> list[int]:
        """Points at which a verdict flips."""
        return [i for i, point in enumerate(self.points) if point.lost or point.mended]

    @property
    def moved(self) -> bool:
        """Whether a point is marked."""
        return bool(self.error_steps or self.time_steps or self.flips)


@dataclass
class _Entry:
    """A run or a release before it is divided into panels."""

    label: str
    title: str
    run: str
    summary: Summary
    ratios: Mapping[Key, tuple[float, str]] = field(default_factory=dict)
    commit: str = ""


class _Answer(NamedTuple):
    """Data of an entry for a panel: cases, none if only timed; ratio of times and opponent."""

    entry: _Entry
    cells: Mapping[str, Brief]
    times: tuple[float, str] | None


def panels(store: Store, folder: Path, say: Callable[[str], None] = lambda line: None) -> list[Panel]:
    """All panels of a store: over its runs, then over its releases."""
    kept = Kept(folder)
    try:
        with _nothing_thrown_away():
            over_runs = _divided(_runs(store, kept, say), "runs")
            released = [_releases(store, kept, engine) for engine in history.engines(store)]
            over_releases = [panel for entries in released for panel in _divided(entries, "releases")]
    finally:
        kept.close()
    return over_runs + over_releases


@contextmanager
def _nothing_thrown_away() -> Iterator[None]:
    """Disable garbage collection: 500 runs have a million small tuples, and collection took a third of the time."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


def _runs(store: Store, kept: Kept, say: Callable[[str], None]) -> list[_Entry]:
    """Runs in the order of their start; a bench adds times to the run before it, or is its own entry."""
    entries: list[_Entry] = []
    timed = {run.id for run in reading.bench_runs(store)}
    for run in store.runs():
        if not run.finished or run.title.startswith((SCATTER_TITLE, RELEASE_TITLE)):
            continue
        summary = kept.get(run.id)
        if summary is None:
            say(f"judging run {run.id}")
            of_bench = run.id in timed
            summary = Summary({}, {}, _times(ratios(store, run))) if of_bench else summarise(store.observations(run))
            kept.put(run.id, summary)
        last = entries[-1] if entries else None
        if run.id in timed and last and not last.ratios and last.commit == run.commit:
            last.ratios = summary.times
        else:
            entries.append(_Entry(run.date[5:10], _said(run), run.id, summary, summary.times, run.commit))
    return entries


def _said(run: Run) -> str:
    return f"{run.commit or 'unknown commit'}, {run.date[:16].replace('T', ' ')}, run {run.id}"


def _releases(store: Store, kept: Kept, engine: str) -> list[_Entry]:
    entries = []
    for version in history.versions(store, engine):
        runs = store.release_runs(engine, version)
        name = f"{engine}=={version} " + " ".join(run.id for run in runs)
        summary = kept.get(name)
        if summary is None:
            found = history.observations(store, engine, version)
            taken = {key: (ratio, CALLED) for key, ratio in history.times(store, engine, version).items()}
            summary = replace(summarise(found, history.told_by(engine, version, found).rows), times=taken)
            kept.put(name, summary)
        entries.append(_Entry(version, f"{engine} {version}", runs[-1].id, summary, summary.times))
    return entries


def _times(table: pd.DataFrame) -> dict[Key, tuple[float, str]]:
    """Ratio of each unit's time to its opponent's at the quick step (else at its own), with the opponent."""
    found: dict[Key, tuple[float, str]] = {}
    for row in table.to_dict("records"):
        key = (str(row["engine"]), str(row["profile"]), str(row["scene"]), int(row["dimension"]))
        if row["purpose"] == "work" and (row["dt"] == QUICK_DT or key not in found):
            found[key] = (float(row["ratio"]), str(row["opponent"]))
    return found


def _divided(entries: Sequence[_Entry], over: str) -> list[Panel]:
    """Panels of the entries, in one pass over each entry, because a search for each panel is slow."""
    columns: dict[Key, list[_Answer]] = defaultdict(list)
    asked: dict[Key, None] = {}
    for entry in entries:
        cells = {key: briefs for key, briefs in entry.summary.cells.items() if briefs}
        asked |= dict.fromkeys(cells)
        for key in dict.fromkeys((*cells, *entry.ratios)):
            columns[key].append(_Answer(entry, cells.get(key, {}), entry.ratios.get(key)))
    return [_panel(key, over, columns[key]) for key in sorted(asked)]


def _panel(key: Key, over: str, present: Sequence[_Answer]) -> Panel:
    points = _points(key[0], present)
    primary = resolve(key[2]).primary
    return Panel(
        key,
        over,
        points,
        primary.unit if primary else "",
        primary.law if primary else "",
        tuple(_steps([p.error for p in points], ERROR, EXACT)),
        tuple(_steps([p.ratio for p in points], TIME, 0.0)),
        ", ".join(sorted({answer.times[1] for answer in present if answer.times})),
        "-".join((over, *map(str, key))).replace("_", "-"),
    )


def _points(engine: str, present: Sequence[_Answer]) -> tuple[Point, ...]:
    """A point for each result; one equal to the result before it reuses its counts."""
    newest = next(answer.cells for answer in reversed(present) if answer.cells)
    wanted = [slot for slot, brief in newest.items() if brief[0] is not None]
    points: list[Point] = []
    before: dict[str, Brief] = {}
    earlier: Mapping[str, Brief] | None = None
    counted: tuple[float | None, int, int] = (None, 0, 0)
    for entry, own, times in present:
        flips = (0, 0)
        if own != earlier:
            cells = {slot: brief for slot, brief in own.items() if slot in newest}
            counted, flips, earlier = _counted(cells, wanted), _flips(before, cells), own
            before |= cells
        version = entry.summary.versions.get(engine, "")
        ratio = times[0] if times else None
        points.append(Point(entry.label, entry.title, entry.run, version, *counted, *flips, ratio))
    return tuple(points)


def _counted(cells: Mapping[str, Brief], wanted: Sequence[str]) -> tuple[float | None, int, int]:
    """Largest error, if all selected cases have one; failed checks; judged checks."""
    errors = [error for slot in wanted if slot in cells and (error := cells[slot][0]) is not None]
    largest = max(errors) if errors and len(errors) == len(wanted) else None
    fails = judged = 0
    for _, failing, asked, _ in cells.values():
        fails, judged = fails + failing, judged + asked
    return largest, fails, judged


def _flips(before: Mapping[str, Brief], cells: Mapping[str, Brief]) -> tuple[int, int]:
    """Cases in which a check begins to fail, and ceases to."""
    lost = mended = 0
    for slot, now in cells.items():
        was = before.get(slot)
        if was is not None and now[JUDGED]:
            lost += bool(now[SURE] and not was[FAILS])
            mended += bool(was[SURE] and not now[FAILS])
    return lost, mended


def _steps(values: Sequence[float | None], rule: Rule, exact: float) -> list[tuple[int, Step]]:
    """Steps by index of the point; errors below ``exact`` are one level."""
    there = [(i, max(abs(value), exact)) for i, value in enumerate(values) if value is not None and (value or exact)]
    return [(there[step.at][0], step) for step in steps([value for _, value in there], rule)]


def by_engine(found: Sequence[Panel]) -> dict[tuple[str, str], list[Panel]]:
    """Panels by axis and engine."""
    groups: dict[tuple[str, str], list[Panel]] = defaultdict(list)
    for panel in found:
        groups[panel.over, panel.key[0]].append(panel)
    return dict(groups)
