"""Results as files: JSON, JSON Lines, CSV, Markdown, JUnit XML, and as a DataFrame."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from adapters.stages import stage
from adapters.whole import write
from reports.brief import Judged, judged
from reports.findings import finding_line, grouped, refusals
from reports.matrix import UNJUDGED, leaving, legend, matrix_of, status_of, unjudged, unranked, versions_of
from reports.wording import LABELS, cell, mark_of, markdown, plural
from validation.judging.rows import Row, frame, is_alarming
from validation.records.store import Run, Store

if TYPE_CHECKING:
    import pandas as pd
    from junitparser import TestCase

Plain = Mapping[str, Any]


def load(folder: str | Path = "crosscheck-out", run: str = "latest", nulls: bool = False) -> pd.DataFrame:
    """Rows of a run as a DataFrame, judged with today's checks, laws and findings.

    With ``nulls`` also rows of the trivial answers, which need no engine (engine ``none``). Its ``attrs`` are
    those of `described`.

    Raises
    ------
    StoreError
        If the folder has no results or no such run.
    """
    chosen, found = _read(folder, run)
    table = frame([*found.rows, *(found.nulls if nulls else ())])
    return described(table, chosen.id, chosen.commit, found.rows)


def described(table: pd.DataFrame, run: str, commit: str, rows: Sequence[Row]) -> pd.DataFrame:
    """The table, with run, commit and engine versions in its ``attrs``."""
    table.attrs |= {"run": run, "commit": commit, "versions": versions_of([vars(row) for row in rows])}
    return table


def load_rows(folder: str | Path = "crosscheck-out", run: str = "latest") -> list[Row]:
    """Rows of a run; see `load`."""
    return list(_read(folder, run)[1].rows)


def _read(folder: str | Path, run: str) -> tuple[Run, Judged]:
    store = Store(Path(folder), create=False)
    try:
        chosen = store.run(run)
        return chosen, judged(store, chosen)
    finally:
        store.close()


def as_json(rows: Sequence[Plain]) -> str:
    """One JSON array."""
    return json.dumps(list(rows), allow_nan=False, indent=1)


def as_jsonl(rows: Sequence[Plain]) -> str:
    """One JSON object per line."""
    return "".join(json.dumps(row, allow_nan=False) + "\n" for row in rows)


def as_csv(rows: Sequence[Plain]) -> str:
    """Flat table: parameters as ``e=0.8 height=1``, lists joined by ``;``."""
    stream = StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(COLUMNS)
    for row in rows:
        flat = flattened(row).values()
        writer.writerow([cell(repr(value) if isinstance(value, float) else value) for value in flat])
    return stream.getvalue()


#: Columns of a flat table.
COLUMNS = tuple(name for name in Row.__dataclass_fields__ if name not in ("slot", "log"))


def flattened(row: Plain) -> dict[str, Any]:
    """A row without nested values."""
    return {name: _flat(row.get(name)) for name in COLUMNS}  # rows of an older file have fewer


def _flat(value: Any) -> Any:
    if value is None or isinstance(value, str | float):  # most of them; the check for a table is slow
        return value
    if isinstance(value, Mapping):
        return " ".join(f"{k}={v:.12g}" for k, v in value.items())
    return ";".join(str(item) for item in value) if isinstance(value, list) else value


def as_markdown(rows: Sequence[Plain]) -> str:
    """Verdict matrix and findings that need attention, for a step summary."""
    matrix, versions = matrix_of(rows), versions_of(rows)
    heads = [
        markdown(f"{engine}/{profile}") + f"<br>{markdown(versions.get(engine, ''))}"
        for engine, profile in matrix.columns
    ]
    out = ["| scene | " + " | ".join(heads) + " |", "|---" * (len(heads) + 1) + "|"]
    for line in matrix.lines:
        fields = [matrix.fields.get((line, column)) for column in matrix.columns]
        out.append(f"| {markdown(line[0])} {line[1]}-D | " + " | ".join(f.text if f else "" for f in fields) + " |")
    out += [""]
    beside = (*unranked(matrix.columns), *leaving(rows), *unjudged(rows), *refusals(rows))
    lines = (legend(matrix), *filter(None, [status_of(matrix)]), *beside)
    out += [f"{markdown(line)}\n" for line in lines]
    for mark, group in grouped(rows):
        out.append(f"**{LABELS[mark]}**: {plural(len(group), 'check')}")
        out += [f"* {markdown(finding_line(row))}" for row in group if is_alarming(row)]
    return "\n".join(out) + "\n"


def as_junit(rows: Sequence[Plain]) -> str:
    """JUnit XML: a suite per engine and profile; failures are only those with exit status 1."""
    from junitparser import JUnitXml, TestCase, TestSuite

    cases: dict[str, list[TestCase]] = {}
    for row in rows:
        name = f"{row['engine']}/{row['profile']}"
        params = _flat(row["slot"]["params"])
        case = TestCase(
            f"{row['metric']} {params} dt={row['dt']:.6g} it={row['iterations'] or 'own'}",
            f"{name}.{row['scene']}{row['dimension']}d",
        )
        _mark_case(case, row)
        cases.setdefault(name, []).append(case)
    document = JUnitXml("contact-crosscheck")
    for name, own in cases.items():
        suite = TestSuite(name)
        suite.add_testcases(own)  # at once: a suite counts all its cases after each addition
        document.add_testsuite(suite)
    document.update_statistics()
    return bytes(document.tostring()).decode()


def _mark_case(case: TestCase, row: Plain) -> None:
    from junitparser import Error, Failure, Skipped

    mark = mark_of(row)
    if mark in ("crashed", "timed_out"):
        failed = Error(finding_line(row))
        failed.text = row["log"]
        case.result = [failed]
    elif is_alarming(row):
        case.result = [Failure(finding_line(row))]
    elif mark in UNJUDGED:
        case.result = [Skipped(row["reason"])]
    elif mark != "pass":
        case.system_out = finding_line(row)


@stage("writing files")
def write_all(folder: Path, rows: Sequence[Plain], nulls: Sequence[Plain] = ()) -> dict[str, Path]:
    """Write rows.jsonl, rows.csv, summary.md and, if there are any, the rows of nulls as nulls.csv into ``folder``."""
    texts = {"rows.jsonl": as_jsonl(rows), "rows.csv": as_csv(rows), "summary.md": as_markdown(rows)}
    if nulls:
        texts["nulls.csv"] = as_csv(nulls)
    for name, text in texts.items():
        write(folder / name, text)
    return {name: folder / name for name in texts}
