"""``run`` and ``run-cell``: make cells run, judge them, keep and show what came out."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import click
from rich.console import Console

from adapters import registry
from adapters.scene import SceneError
from reports import exports
from reports.command.files import FILE, folder, writable
from reports.command.group import AS_JSON, OUT, main
from reports.command.selection import request_from, selection
from reports.progress import run_plan
from reports.summary import show
from validation.cells import Slot, slot_from_dict
from validation.plan import slots
from validation.posed import resolve
from validation.rows import Row, rows_of
from validation.store import Store
from validation.workers import TIMEOUT, run_cells


@main.command()
@selection
@click.option("--jobs", default=0, type=click.IntRange(0), help="Worker processes; 0: one per core.")
@click.option("--timeout", default=TIMEOUT, show_default=True, type=click.FloatRange(1.0), help="Per cell [s].")
@click.option("--dry-run", is_flag=True, help="Say how many cells there are, and stop.")
@click.option("--fresh", is_flag=True, help="Start a new run even if one can be resumed.")
@click.option("--keep-trajectories", is_flag=True, help="Keep every trajectory as .npz in OUT/trajectories.")
@click.option("--junit", type=FILE, help="Also write JUnit XML to this file.")
@click.option("--markdown", type=FILE, help="Also write a Markdown summary to this file.")
@AS_JSON
@OUT
def run(out: Path, as_json: bool, **options: Any) -> None:
    """Run SCENES (names, globs or files; all by default) and judge them.

    Exits with 1 if a row is new, drifted, INVALID, CRASHED, TIMED OUT or missing, with 2 if the call is wrong.
    """
    console = Console(stderr=True)
    options["full"] = not options["quick"]
    for name in ("junit", "markdown"):
        if options[name]:
            writable(options[name], name)
    request = request_from(options)
    chosen = slots(request)
    if not chosen:
        raise SceneError("scenes: no cell fits this selection")
    if options["dry_run"]:
        click.echo(json.dumps({"cells": len(chosen)}) if as_json else f"{len(chosen)} cells")
        return
    folder(out)
    for name in request.scenes:
        for note in resolve(name).notes:
            console.print(f"{name}: {note}", markup=False, highlight=False, soft_wrap=True)
    store = Store(out)
    keep = out / "trajectories" if options["keep_trajectories"] else None
    title = f"{request.suite}: {' '.join(request.scenes)}"
    done = run_plan(store, title, chosen, console, options["jobs"], options["timeout"], keep, options["fresh"])
    rows = rows_of(done.id, store.observations(done), chosen)
    store.close()
    _show(rows, out, as_json, console, options)
    sys.exit(1 if any(row.alarming for row in rows) else 0)


def _show(rows: list[Row], out: Path, as_json: bool, console: Console, options: dict[str, Any]) -> None:
    plain = [row.as_dict() for row in rows]
    written = exports.write_all(out, plain)
    if options["junit"]:
        options["junit"].write_text(exports.as_junit(plain), encoding="utf-8")
    if options["markdown"]:
        options["markdown"].write_text(exports.as_markdown(plain), encoding="utf-8")
    if as_json:
        click.echo(exports.as_json(plain))
    show(plain, console, files=written.values())


@main.command("run-cell")
@click.option("--batch", is_flag=True, help="Read one JSON object per line, write one observation per line.")
@click.option("--timeout", default=TIMEOUT, show_default=True, type=click.FloatRange(1.0), help="Per cell [s].")
@click.option("--jobs", default=1, show_default=True, type=click.IntRange(1), help="Worker processes.")
def run_cell(batch: bool, timeout: float, jobs: int) -> None:
    """Run slots given as JSON on stdin, print observations as JSON on stdout; for any scheduler to drive."""
    text = sys.stdin.read()
    cells = [_slot(line) for line in (text.splitlines() if batch else [text]) if line.strip()]
    if not cells:
        raise SceneError("slot: nothing on stdin")
    for observation in run_cells(cells, jobs, timeout):
        click.echo(json.dumps(observation.as_dict(), default=str))


def _slot(text: str) -> Slot:
    try:
        data = json.loads(text)
    except json.JSONDecodeError as error:
        raise SceneError(f"slot: is not JSON: {error}") from None
    if not isinstance(data, dict):
        raise SceneError("slot: must be a JSON object")
    slot = slot_from_dict(data)
    registry.find(slot.engine)
    return slot
