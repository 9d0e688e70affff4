"""Shows what changed between two runs: text, JSON, and Markdown fit for a pull-request comment."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from reports.wording import number, reproduce
from validation.bench.agreement import ratios
from validation.bench.reading import bench_runs
from validation.comparison import Change, Kind
from validation.rows import rows_of
from validation.store import MissingError, Store


@dataclass(frozen=True)
class Side:
    """One side of a comparison: judged rows, and ratios of times where a bench run has them."""

    rows: Sequence[Mapping[str, Any]]
    ratios: Sequence[Mapping[str, Any]]


def load_side(argument: str, out: Path) -> Side:
    """One side: a run id in ``out``, a results folder (``FOLDER`` or ``FOLDER:RUN``), or a .jsonl file.

    Raises
    ------
    MissingError
        If there is nothing of that name, or a file is not JSON Lines of rows and ratios.
    """
    path = Path(argument)
    if path.suffix == ".jsonl":
        return _load_lines(path)
    folder, _, run = argument.partition(":")
    if Path(folder).is_dir():
        return _load_run(Path(folder), run or "latest")
    return _load_run(out, argument)


def _load_run(folder: Path, run_id: str) -> Side:
    """Rows of the run; ratios of the run itself, or of the last bench run where no run was named."""
    store = Store(folder, create=False)
    try:
        timed = bench_runs(store)
        judged = [run for run in store.runs() if run.id not in {bench.id for bench in timed}]
        run = store.run(run_id) if run_id != "latest" or not judged else judged[-1]
        source = timed[-1:] if run_id == "latest" else [bench for bench in timed if bench.id == run.id]
        tables = [ratios(store, bench) for bench in source]
        table = [{str(k): v for k, v in row.items()} for t in tables for row in t.to_dict("records")]
        return Side([row.as_dict() for row in rows_of(run.id, store.observations(run))], table)
    finally:
        store.close()


def _load_lines(path: Path) -> Side:
    try:
        lines = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise MissingError(f"run: cannot read {path}: {error}") from None
    rows = [line for line in lines if isinstance(line, dict) and {"slot", "metric", "value"} <= set(line)]
    times = [line for line in lines if isinstance(line, dict) and {"slot", "purpose", "ratio"} <= set(line)]
    if len(rows) + len(times) != len(lines):
        raise MissingError(f"run: {path} does not hold rows of this project")
    return Side(rows, times)


def headline(changes: Sequence[Change]) -> str:
    """``2 verdicts flipped (1 regressed), 3 values changed``; or that nothing changed."""
    counts = Counter(change.kind for change in changes)
    worse = Counter(change.kind for change in changes if change.regressed)
    parts = [f"{counts[kind]} {kind.value} ({worse[kind]} regressed)" for kind in Kind if counts[kind]]
    return "; ".join(parts) or "nothing changed"


def _where(change: Change) -> str:
    return f"{change.engine}/{change.profile} {change.scene} {change.dimension}-D {change.params}".strip()


def _size(change: Change) -> str:
    if change.kind is Kind.SPEED:
        return f"x{number(change.size, 3)}"
    return f"{'+' if change.size > 0 else ''}{number(change.size, 3)} tol" if change.size else ""


def as_text(changes: Sequence[Change]) -> str:
    """One line per change, and the headline."""
    lines = [headline(changes)]
    for change in changes:
        trend = "regressed" if change.regressed else "improved or neutral"
        lines.append(
            f"{change.kind.value} ({trend}): {_where(change)} {change.metric}: {change.before} -> {change.after} "
            f"{_size(change)} [{change.note}] | {reproduce(change.slot)}"
        )
    return "\n".join(lines) + "\n"


def as_markdown(changes: Sequence[Change], most: int = 50) -> str:
    """Headline and a table of at most ``most`` changes."""
    out = [f"**contact-crosscheck compare**: {headline(changes)}", ""]
    if changes:
        out += ["| change | | where | metric | before | after | size |", "|---|---|---|---|---|---|---|"]
    for change in changes[:most]:
        mark = "worse" if change.regressed else ""
        cells = [
            change.kind.value,
            mark,
            _where(change),
            f"`{change.metric}`",
            change.before,
            change.after,
            _size(change),
        ]
        out.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    if len(changes) > most:
        out.append(f"\n... and {len(changes) - most} more; `crosscheck compare --json` lists all")
    return "\n".join(out) + "\n"


def as_json(changes: Sequence[Change]) -> str:
    """All changes."""
    return json.dumps({"headline": headline(changes), "changes": [c.as_dict() for c in changes]}, indent=1)
