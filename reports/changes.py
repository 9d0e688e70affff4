"""Changes between two runs: as text, JSON, and Markdown for a pull-request comment."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from reports import brief
from reports.wording import first_of, markdown, number, plural, reproduce, roles_line
from validation.bench.agreement import ratios
from validation.bench.reading import bench_runs
from validation.judging.comparison import Change, Kind, by_seriousness, checks_in, families, times_in
from validation.records.store import MissingError, Store
from validation.releases.history import told as told_by_releases
from validation.releases.history import versions

#: A release of an engine as a side of a comparison: ``myengine==3.2.7``.
_RELEASE = re.compile(r"[^=/]+==[^=/]+")


@dataclass(frozen=True)
class Side:
    """One side of a comparison: its origin, judged rows, and ratios of times of a bench run."""

    rows: Sequence[Mapping[str, Any]]
    ratios: Sequence[Mapping[str, Any]]
    run: str = ""
    date: str = ""
    commit: str = ""

    @property
    def versions(self) -> dict[str, str]:
        """Engine -> version of the run."""
        return {row["engine"]: row["engine_version"] for row in self.rows if row["engine_version"]}

    @property
    def text(self) -> str:
        """``20261121-101500 (commit 1a2b3c4, 7300 checks)``."""
        commit = f"commit {self.commit[:12]}, " if self.commit else ""
        return f"{self.run or 'checks'} ({commit}{plural(len(self.rows), 'check')})"


def load_side(argument: str, out: Path) -> Side:
    """One side: a run id in ``out``, a release, a results folder (``FOLDER`` or ``FOLDER:RUN``), or a .jsonl file.

    Raises
    ------
    MissingError
        If nothing has that name, or a file is not JSON Lines of rows and ratios.
    """
    if not argument:  # such as an unset variable
        raise MissingError("run: a side is empty; `.` is the folder that you are in")
    if _RELEASE.fullmatch(argument):
        return _load_release(out, *argument.split("=="))
    path = Path(argument)
    if path.suffix == ".jsonl":
        return _load_lines(path)
    folder, _, run = argument.partition(":")
    if Path(folder).is_dir():
        return _load_run(Path(folder), run or "latest")
    if path.name != argument or run:  # not a run id
        raise MissingError(f"run: there is no folder {folder}; crosscheck compare --help says what a side may be")
    return _load_run(out, argument)


def _load_release(out: Path, engine: str, version: str) -> Side:
    """All results of a release, from any run."""
    store = Store(out, create=False)
    try:
        runs = store.release_runs(engine, version)
        if not runs:
            known = ", ".join(versions(store, engine)) or "none"
            raise MissingError(f"run: {store.path} has no release {engine}=={version}; it has {known}")
        (result,) = told_by_releases(store, engine, [version])
        return Side([row.as_dict() for row in result.rows], [], result.name, runs[-1].date, runs[-1].commit)
    finally:
        store.close()


def _load_run(folder: Path, run_id: str) -> Side:
    """Rows of the run; ratios of the run itself, or of the last bench run if no run is named."""
    store = Store(folder, create=False)
    try:
        timed, run = bench_runs(store), store.run(run_id)
        source = timed[-1:] if run_id == "latest" else [bench for bench in timed if bench.id == run.id]
        tables = [ratios(store, bench) for bench in source]
        table = [{str(k): v for k, v in row.items()} for t in tables for row in t.to_dict("records")]
        rows = [row.as_dict() for row in brief.judged(store, run).rows]
        return Side(rows, table, run.id, run.date, run.commit)
    finally:
        store.close()


def _load_lines(path: Path) -> Side:
    if path.exists() and not path.is_file():  # a pipe would block
        raise MissingError(f"run: cannot read {path}: it is not a regular file")
    try:
        lines = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise MissingError(f"run: cannot read {path}: {getattr(error, 'strerror', None) or error}") from None
    rows = [line for line in lines if isinstance(line, dict) and {"slot", "metric", "value"} <= set(line)]
    times = [line for line in lines if isinstance(line, dict) and {"slot", "purpose", "ratio"} <= set(line)]
    if len(rows) + len(times) != len(lines):
        raise MissingError(f"run: {path} does not hold rows of this project")
    return Side(rows, times, ", ".join(dict.fromkeys(str(row["run"]) for row in rows if row.get("run"))) or path.name)


def header(a: Side, b: Side) -> list[str]:
    """Runs, commits, and differing versions of engines."""
    lines = [f"A: {a.text}", f"B: {b.text}"]
    names = list(dict.fromkeys([*a.versions, *b.versions]))
    same = [f"{name} {a.versions[name]}" for name in names if a.versions.get(name) == b.versions.get(name)]
    moved = [
        f"{name} {a.versions.get(name, 'not run')} -> {b.versions.get(name, 'not run')}"
        for name in names if a.versions.get(name) != b.versions.get(name)
    ]  # fmt: skip
    if moved:
        lines.append(f"versions that differ: {', '.join(moved)}")
    if same:
        lines.append(f"same versions: {', '.join(same)}")
    return lines


def in_both(a: Side, b: Side) -> int:
    """Number of checks and of times that both sides have."""
    sides = [[checks_in(each.rows).keys(), times_in(each.ratios).keys()] for each in (a, b)]
    return sum(len(one & other) for one, other in zip(*sides, strict=True))


def headline(changes: Sequence[Change], a: Side, b: Side) -> str:
    """``189 in both: 1 newly failing; 3 value changed (1 worse); 140 only in B``."""
    counts = Counter((change.kind, change.regressed) for change in changes)
    parts, apart = [], []
    for kind in Kind:
        worse, other = counts[kind, True], counts[kind, False]
        if kind is Kind.FLIP:
            parts += [f"{n} {WORDS[regressed]}" for n, regressed in ((worse, True), (other, False)) if n]
        elif kind in ONE_SIDED:
            apart += [f"{other} {kind.value}"] if other else []
        elif worse + other:
            parts.append(f"{worse + other} {kind.value} ({worse} worse)")
    both = in_both(a, b)
    told = f"{both} in both: {'; '.join(parts) or 'none changed'}" if both else "no check is in both"
    return "; ".join([told, *apart])


#: Kinds of checks that only one side has.
ONE_SIDED = (Kind.ADDED, Kind.REMOVED)
#: Word for a check that fails on one side only, by whether it got worse.
WORDS = {True: "newly failing", False: "fixed"}


def kind_of(kind: str, regressed: bool) -> str:
    """``newly failing``, ``fixed``, or another change."""
    return WORDS[regressed] if kind == Kind.FLIP.value else kind


def _where(change: Change) -> str:
    return f"{change.engine}/{change.profile} {change.scene} {change.dimension}-D {change.params}".strip()


def _size(change: Change) -> str:
    if change.kind is Kind.SPEED:
        return f"x{number(change.size, 3)}"
    return f"error {'+' if change.size > 0 else ''}{number(change.size, 3)} tolerances" if change.size else ""


def as_text(changes: Sequence[Change], a: Side, b: Side) -> str:
    """Both sides, the headline, and the largest change of each family, one line each."""
    lines = [*header(a, b), headline(changes, a, b)]
    for family in families(change for change in changes if change.kind not in ONE_SIDED):
        change, more = family.first, len(family.changes) - 1
        flips = change.kind is Kind.FLIP
        trend = "" if flips else " (worse)" if change.regressed else " (not worse)"
        rest = f", and {more} more like it" if more else ""
        said = [
            f"{kind_of(change.kind.value, change.regressed)}{trend}: {_where(change)} {change.metric}:",
            f"{change.before} -> {change.after}", _size(change), f"[{change.note}]" if change.note else "",
        ]  # fmt: skip
        lines.append(" ".join(filter(None, said)) + rest)
        lines.append(f"    {reproduce(change.slot)}")
    lines += _of_one_side(changes)
    lines += filter(None, [roles_line((change.engine, change.profile) for change in changes)])
    return "\n".join(lines) + "\n"


def _of_one_side(changes: Sequence[Change]) -> list[str]:
    """Checks that only one side has: a line for each profile, with its first scenes."""
    found: dict[tuple[Kind, str], Counter[str]] = {}
    for change in sorted(changes, key=by_seriousness):
        if change.kind in ONE_SIDED:
            found.setdefault((change.kind, f"{change.engine}/{change.profile}"), Counter())[change.scene] += 1
    return [
        f"{kind.value}: {who}: {plural(scenes.total(), 'check')} of {first_of(list(scenes))}"
        for (kind, who), scenes in found.items()
    ]


def as_markdown(changes: Sequence[Change], a: Side, b: Side, most: int = 50) -> str:
    """Both sides, the headline, and a table of at most ``most`` families of changes."""
    out = ["**contact-crosscheck compare**: " + headline(changes, a, b), ""]
    out += [f"* {markdown(line)}" for line in header(a, b)]
    found = families(changes)
    if found:
        out += [
            "",
            "| change | | checks | where | metric | before | after | size |",
            "|---|---|---|---|---|---|---|---|",
        ]
    for family in found[:most]:
        change = family.first
        mark = "worse" if change.regressed else ""
        cells = [
            markdown(kind_of(change.kind.value, change.regressed)),
            mark,
            str(len(family.changes)),
            markdown(_where(change)),
            "`" + change.metric.replace("|", "\\|").replace("`", "'") + "`",
            markdown(change.before),
            markdown(change.after),
            markdown(_size(change)),
        ]
        out.append("| " + " | ".join(cells) + " |")
    if len(found) > most:
        left = plural(len(found) - most, "more family")
        out.append(f"\n... and {left}; `crosscheck compare --json` lists every change")
    roles = roles_line((change.engine, change.profile) for change in changes)
    out += [f"\n{markdown(roles)}"] if roles else []
    return "\n".join(out) + "\n"


def as_json(changes: Sequence[Change], a: Side, b: Side) -> str:
    """Both sides and all changes."""
    sides = {
        name: {"run": s.run, "date": s.date, "commit": s.commit, "rows": len(s.rows), "versions": s.versions}
        for name, s in (("a", a), ("b", b))
    }
    said = {"headline": headline(changes, a, b), "in_both": in_both(a, b)}
    return json.dumps({**sides, **said, "changes": [c.as_dict() for c in changes]}, indent=1)
