"""The kept table of comparisons with ports, in the folder of the engine; ``crosscheck ports --keep`` makes it."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path

from adapters.engine import EngineError
from adapters.engine_folder import PORTS, folder_of, rows_of
from adapters.whole import cache_folder
from validation.cells import format_dt
from validation.releases.environments import locked
from validation.releases.ports import Compared

#: Columns of the kept table: what says which case it is, then what was found.
CASE = ("release", "port", "scene", "dimension", "params", "profile", "dt")
COLUMNS = (*CASE, "verdict", "until", "end", "apart", "body", "since", "growth", "because", "proof")


def row_of(told: Compared, release: str) -> dict[str, str]:
    """Row of the kept table; numbers to three digits."""
    slot = told.slot
    case = {"release": release, "port": told.port, "scene": slot.scene, "dimension": str(slot.dimension)}
    case |= {"params": slot.params_text(), "profile": slot.profile, "dt": format_dt(slot.dt)}
    found = {name: getattr(told, name) for name in COLUMNS[len(CASE) :]}
    return case | {k: f"{v:.3g}" if isinstance(v, float) else v for k, v in found.items()}


def kept(engine: str) -> tuple[dict[str, str], ...]:
    """Rows of the kept table of an engine; none where there is none."""
    return rows_of(engine, PORTS, _read)


def _read(path: Path) -> Iterator[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as stream:
        yield from csv.DictReader(stream)


def keep(engine: str, told: Compared, release: str) -> None:
    """Enter a comparison into the table, in place of the one of the same case."""
    folder = folder_of(engine)
    if folder is None:
        raise EngineError(f"engine: {engine} has no folder to keep a table in")
    with locked(cache_folder() / ".ports.lock"):  # two commands may keep theirs at once
        rows = {tuple(row[name] for name in CASE[1:]): row for row in (*kept(engine), row_of(told, release))}
        with (folder / PORTS).open("w", encoding="utf-8", newline="") as stream:
            writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows[key] for key in sorted(rows))
