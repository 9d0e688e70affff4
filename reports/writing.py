"""Files of results: written whole or not at all, and tables that a spreadsheet may open."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from reports.wording import cell

if TYPE_CHECKING:
    import pandas as pd


def write(path: Path, text: str) -> None:
    """Write a file under another name, and rename it: a reader or a kill never finds half of it.

    A device, and a file in a folder that may not be written, is written as it is.
    """
    path = path.resolve()
    if (path.exists() and not path.is_file()) or not os.access(path.parent, os.W_OK):
        path.write_text(text, encoding="utf-8")
        return
    part = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        part.write_text(text, encoding="utf-8")
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def csv_of(table: pd.DataFrame) -> str:
    """A table as CSV; text that looks like a formula is quoted, headings as well."""
    return str(table.map(cell).rename(columns=cell).to_csv(index=False, lineterminator="\n"))
