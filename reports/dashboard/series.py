"""Series over runs and over releases: the points of every panel, their steps and flips."""

from __future__ import annotations

import gc
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

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

#: Places in a `reports.brief.Brief`.
FAILS, SURE = 1, 3


@dataclass(frozen=True)
class Point:
    """One run or release in a panel.

    Parameters
    ----------
    label, title
        Shown on the axis; said in full.
    error
        Largest primary error of the cells that the newest point has; None if it did not run them all.
    fails, judged
        Checks of those cells.
    lost, mended
        Cells in which a check began or ceased to fail since the point before that ran them, and not from a start
        alone that was moved by the last place, where those were asked.
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
        """Whether anything is marked."""
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
    """No garbage is looked for: the million small tuples of 500 runs all stay, and looking took a third of the time."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


def _runs(store: Store, kept: Kept, say: Callable[[str], None]) -> list[_Entry]:
    """Runs by the order in which they were made; a bench brings times to the run before it, or stands for itself."""
    entries: list[_Entry] = []
    timed = {run.id for run in reading.bench_runs(store)}
    for run in store.runs():
        if not run.finished or run.title.startswith((SCATTER_TITLE, RELEASE_TITLE)):
            continue
        if run.id in timed:
            times = _times(ratios(store, run))
            if entries and not entries[-1].ratios and entries[-1].commit == run.commit:
                entries[-1].ratios = times
            else:
                entries.append(_Entry(_day(run), _said(run), run.id, Summary({}, {}), times, run.commit))
            continue
        summary = kept.get(run.id)
        if summary is None:
            say(f"judging run {run.id}")
            summary = summarise(store.observations(run))
            kept.put(run.id, summary)
        entries.append(_Entry(_day(run), _said(run), run.id, summary, commit=run.commit))
    return entries


def _day(run: Run) -> str:
    return run.date[5:10]


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
            summary = summarise(found, history.told_by(engine, version, found).rows)
            kept.put(name, summary)
        taken = {key: (ratio, CALLED) for key, ratio in history.times(store, engine, version).items()}
        entries.append(_Entry(version, f"{engine} {version}", runs[-1].id, summary, taken))
    return entries


def _times(table: pd.DataFrame) -> dict[Key, tuple[float, str]]:
    """Ratio to its opponent of each unit at the quick step (else at its own), the opponent named."""
    found: dict[Key, tuple[float, str]] = {}
    for row in table.to_dict("records"):
        key = (str(row["engine"]), str(row["profile"]), str(row["scene"]), int(row["dimension"]))
        if row["purpose"] == "work" and (row["dt"] == QUICK_DT or key not in found):
            found[key] = (float(row["ratio"]), str(row["opponent"]))
    return found


def _divided(entries: Sequence[_Entry], over: str) -> list[Panel]:
    keys: dict[Key, None] = {}
    for entry in entries:
        keys |= dict.fromkeys(entry.summary.cells)
    return [_panel(key, over, entries) for key in sorted(keys)]


def _panel(key: Key, over: str, entries: Sequence[_Entry]) -> Panel:
    present = [entry for entry in entries if entry.summary.cells.get(key) or key in entry.ratios]
    newest = next(entry.summary.cells[key] for entry in reversed(present) if entry.summary.cells.get(key))
    points: list[Point] = []
    before: dict[str, Brief] = {}
    for entry in present:
        cells = {slot: b for slot, b in entry.summary.cells.get(key, {}).items() if slot in newest}
        points.append(_point(entry, key, cells, newest, before))
        before |= cells
    primary = resolve(key[2]).primary
    opponents = {entry.ratios[key][1] for entry in present if key in entry.ratios}
    return Panel(
        key,
        over,
        tuple(points),
        primary.unit if primary else "",
        primary.law if primary else "",
        tuple(_steps([p.error for p in points], ERROR, EXACT)),
        tuple(_steps([p.ratio for p in points], TIME, 0.0)),
        ", ".join(sorted(opponents)),
        "-".join((over, *map(str, key))).replace("_", "-"),
    )


def _point(
    entry: _Entry, key: Key, cells: Mapping[str, Brief], newest: Mapping[str, Brief], before: Mapping[str, Brief]
) -> Point:
    wanted = {slot for slot, brief in newest.items() if brief[0] is not None}
    errors = [cells[slot][0] for slot in wanted if slot in cells and cells[slot][0] is not None]
    complete = bool(wanted) and len(errors) == len(wanted)
    both = [(before[slot], cells[slot]) for slot in cells if slot in before and cells[slot][2]]
    return Point(
        entry.label,
        entry.title,
        entry.run,
        entry.summary.versions.get(key[0], ""),
        max(error for error in errors if error is not None) if complete else None,
        sum(brief[1] for brief in cells.values()),
        sum(brief[2] for brief in cells.values()),
        sum(bool(now[SURE] and not was[FAILS]) for was, now in both),
        sum(bool(was[SURE] and not now[FAILS]) for was, now in both),
        entry.ratios[key][0] if key in entry.ratios else None,
    )


def _steps(values: Sequence[float | None], rule: Rule, exact: float) -> list[tuple[int, Step]]:
    """Steps by index of the point; errors below ``exact`` are one level."""
    there = [(i, max(abs(value), exact)) for i, value in enumerate(values) if value is not None and (value or exact)]
    return [(there[step.at][0], step) for step in steps([value for _, value in there], rule)]


def by_engine(found: Sequence[Panel]) -> dict[tuple[str, str], list[Panel]]:
    """Panels by what they run over and engine."""
    groups: dict[tuple[str, str], list[Panel]] = defaultdict(list)
    for panel in found:
        groups[panel.over, panel.key[0]].append(panel)
    return dict(groups)
