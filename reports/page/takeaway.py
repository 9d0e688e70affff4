"""Tables for download: inside the page, compressed, as links that work without JavaScript."""

from __future__ import annotations

import base64
import gzip
import io
import json
import zipfile
from dataclasses import dataclass
from typing import Any

from markupsafe import Markup

from reports.exports import flattened
from reports.page.source import Source

#: Columns that only ``crosscheck bundle`` has: identities of cases, durations, skills, and the error, which is value
#: minus truth.
ELSEWHERE = frozenset({"cells", "state_hash", "wall_time_s", "error", "skill", "null"})


@dataclass(frozen=True)
class File:
    """A file inside the page."""

    name: str
    what: str
    size: int
    href: Markup


def takeaway(source: Source) -> list[File]:
    """All rows as JSON, column by column; with a bench, its tables as CSV in one archive."""
    # No time stamp inside, so that the same run gives the same page.
    rows = gzip.compress(json.dumps(columns(source), separators=(",", ":")).encode(), 9, mtime=0)
    what = f"all {len(source.rows)} values and their checks, a list per column: pandas.read_json"
    files = [_file("rows.json.gz", what, "application/gzip", rows)]
    if source.bench is not None:
        files.append(
            _file(
                "bench.zip",
                "tables of the bench as CSV (its single timings: crosscheck bundle)",
                "application/zip",
                _bench(source),
            )
        )
    return files


def columns(source: Source) -> dict[str, list[Any]]:
    """Values of every row by column: equal values are neighbours, which halves the largest part of the page."""
    flat = [flattened(row) for row in source.rows]
    return {name: [row[name] for row in flat] for name in (flat[0] if flat else ()) if name not in ELSEWHERE}


def _file(name: str, what: str, kind: str, content: bytes) -> File:
    data = base64.b64encode(content).decode()
    return File(name, what, len(content), Markup(f"data:{kind};base64,{data}"))


def _bench(source: Source) -> bytes:
    assert source.bench is not None
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, table in source.bench.tables.items():
            if name == "timings":  # one line per round; ``crosscheck bundle`` has them
                continue
            flat = table.drop(columns=["slot"], errors="ignore")
            entry = zipfile.ZipInfo(f"{name}.csv")  # 1980: no time stamp either
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, flat.to_csv(index=False, float_format="%.6g"))  # times have three valid digits
    return stream.getvalue()
