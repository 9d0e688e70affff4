"""Tables to take away: inside the page, compressed, as links that work without JavaScript."""

from __future__ import annotations

import base64
import gzip
import io
import zipfile
from dataclasses import dataclass

from markupsafe import Markup

from reports.exports import as_csv
from reports.page.source import Source


@dataclass(frozen=True)
class File:
    """A file inside the page."""

    name: str
    what: str
    size: int
    href: Markup


def takeaway(source: Source) -> list[File]:
    """All rows as CSV; with a bench, its tables as CSV in one archive."""
    # No time stamp inside, so that the same run gives the same page.
    rows = gzip.compress(as_csv(source.rows).encode(), 9, mtime=0)
    files = [_file("rows.csv.gz", f"all {len(source.rows)} judged values, one row each", "application/gzip", rows)]
    if source.bench is not None:
        files.append(_file("bench.zip", "tables of the bench as CSV", "application/zip", _bench(source)))
    return files


def _file(name: str, what: str, kind: str, content: bytes) -> File:
    data = base64.b64encode(content).decode()
    return File(name, what, len(content), Markup(f"data:{kind};base64,{data}"))


def _bench(source: Source) -> bytes:
    assert source.bench is not None
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, table in source.bench.tables.items():
            flat = table.drop(columns=["slot"], errors="ignore")
            entry = zipfile.ZipInfo(f"{name}.csv")  # 1980: no time stamp either
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, flat.to_csv(index=False))
    return stream.getvalue()
