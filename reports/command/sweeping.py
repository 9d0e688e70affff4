"""``sweep``: thousands of cases over parameters, as one table; resumable."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import click

from adapters.scene import SceneError
from adapters.whole import write
from reports.command import statuses
from reports.command.files import FILE, folder, writable
from reports.command.group import AS_JSON, OUT, main
from reports.command.reporting import extra
from reports.command.selection import CLUSTER, JOBS, SECONDS, missing, request_from, selection
from reports.progress import run_plan
from reports.sweep import counted
from reports.terminal import print_roles, terminal
from reports.wording import at, csv_of, plural
from validation.judging.rows import ALARMING_OUTCOMES, rows_of
from validation.questions.sweeping import Kind, Range, Study, grid, listed, points, range_from, study_slots, table
from validation.records.store import Store
from validation.workers import TIMEOUT


@main.command(epilog="Example: crosscheck sweep bounce --grid e=0:1:50")
@selection
@click.option("--grid", multiple=True, metavar="N=LOW:HIGH:COUNT[:log]", help="COUNT evenly spaced values.")
@click.option("--list", "lists", multiple=True, metavar="N=A,B,C", help="These values.")
@click.option("--random", multiple=True, metavar="N=LOW:HIGH[:log]", help="Values at random, --samples of them.")
@click.option(
    "--sobol", multiple=True, metavar="N=LOW:HIGH[:log]", help="Values of a Sobol sequence, --samples of them."
)
@click.option("--samples", default=256, show_default=True, type=int, help="Number of points of --random and --sobol.")
@click.option("--seed", default=0, show_default=True, type=click.IntRange(0), help="Seed of --random and --sobol.")
@click.option("--jobs", default=0, type=JOBS, help="Worker processes; 0: one per core.")
@click.option("--timeout", default=TIMEOUT, show_default=True, type=SECONDS, help="Time limit per case [s].")
@click.option("--dry-run", is_flag=True, help="Print the number of cases, and stop.")
@CLUSTER
@click.option("--fresh", is_flag=True, help="Start a new run even if one can be resumed.")
@click.option("--csv", "csv_file", type=FILE, help="Table of the cases; OUT/sweep.csv by default.")
@click.option("--parquet", type=FILE, help="Also write the table as Parquet to this file.")
@AS_JSON
@OUT
def sweep(out: Path, as_json: bool, **options: Any) -> None:
    """Run scenes over grids of parameters, into one table.

    The table has one line per case. Grids and lists are crossed with each other and with --samples points. Failed
    checks do not change the exit status, since a study looks for them. Exits with 1 if cases are INVALID, crashed,
    timed out or missing, with 4 if not all of it ran.
    """
    console = terminal(stderr=True)
    files = {"csv": options["csv_file"] or out / "sweep.csv", "parquet": options["parquet"]}
    if not options["scenes"]:
        raise SceneError("scenes: a sweep needs the name of a scene")
    request, study = request_from(options), _study(options)
    chosen = study_slots(request, study)
    if not chosen:
        raise SceneError("scenes: no case fits this selection")
    if options["dry_run"]:
        click.echo(json.dumps({"cells": len(chosen)}) if as_json else plural(len(chosen), "case"))
        return
    folder(out)
    for name in ("csv", "parquet"):
        if options[f"{name}_file" if name == "csv" else name]:
            writable(files[name], name)
    if options["parquet"]:
        with extra("sweep", "parquet"):
            import pyarrow  # noqa: F401  (asked for before anything runs, not after)
    store = Store(out)
    title = f"sweep: {' '.join(request.scenes)}"
    limits = options["jobs"], options["timeout"]
    done = run_plan(store, title, chosen, console, *limits, fresh=options["fresh"], cluster=options["cluster"],
                    finish=False)  # fmt: skip
    rows, complete = rows_of(done.id, store.observations(done), chosen), not store.missing(done)
    found = table(rows)
    write(files["csv"], csv_of(found))
    if options["parquet"]:
        found.to_parquet(files["parquet"], index=False)
    if complete:
        store.finish(done)  # after its files: the same command would write them again
    store.close()
    if as_json:
        click.echo(json.dumps(json.loads(found.to_json(orient="records", double_precision=15)), indent=1))
    console.print(counted(found))
    unsupported = int((found["outcome"] == "unsupported").sum())
    if unsupported:
        console.print(f"unsupported: {plural(unsupported, 'case')}, which the engine cannot run", highlight=False)
    print_roles(((slot.engine, slot.profile) for slot in chosen), console)
    console.print(f"table: {files['csv']}", markup=False, highlight=False, soft_wrap=True)
    console.print(f"what fails and why: crosscheck findings{at(out)}", markup=False, highlight=False, soft_wrap=True)
    absent = missing(options["engine"], request.engines)
    for line in absent:
        console.print(line, markup=False, highlight=False, soft_wrap=True)
    broken = any(row.outcome in ALARMING_OUTCOMES or (row.outcome == "refused" and row.alarming) for row in rows)
    sys.exit(statuses.verdict(broken, complete and not absent))


def _study(options: dict[str, Any]) -> Study:
    crossed: dict[str, list[float]] = {}
    for name, values in [*map(grid, options["grid"]), *map(listed, options["lists"])]:
        if name in crossed:
            raise SceneError(f"sweep: {name} is varied twice")
        crossed[name] = values
    kinds: list[tuple[Kind, str]] = [
        *(("random", t) for t in options["random"]),
        *(("sobol", t) for t in options["sobol"]),
    ]
    ranges: list[tuple[Kind, Range]] = [(kind, range_from(text, kind, 2)[0]) for kind, text in kinds]
    names = [each.name for _, each in ranges]
    for name in names:
        if names.count(name) > 1 or name in crossed:
            raise SceneError(f"sweep: {name} is varied twice")
    with extra("sweep"):
        return Study(crossed, points(ranges, options["samples"], options["seed"]))
