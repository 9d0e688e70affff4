"""``sweep``: thousands of cases over parameters, as one table; resumable."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path

import click

from adapters.scene import SceneError
from adapters.whole import write
from reports.command import statuses
from reports.command.files import FILE, folder, writable
from reports.command.group import AS_JSON, OUT, main
from reports.command.reporting import extra
from reports.command.selection import JOBS, SECONDS, Cases, cluster, gathered, missing, option, selection
from reports.progress import run_plan
from reports.sweep import counted
from reports.terminal import print_roles, terminal
from reports.wording import at, csv_of, plural
from validation.judging.rows import ALARMING_OUTCOMES, rows_of
from validation.questions.sweeping import Kind, Study, grid, listed, points, range_from, study_slots, table
from validation.records.store import Store
from validation.workers import TIMEOUT

#: Points of --random and --sobol where --samples does not say.
SAMPLES = 256


@dataclass(frozen=True)
class Sweeping:
    """Options of ``sweep`` beside its cases."""

    grid: tuple[str, ...] = option((), "COUNT evenly spaced values.", metavar="N=LOW:HIGH:COUNT[:log]")
    lists: tuple[str, ...] = option((), "These values.", "--list", metavar="N=A,B,C")
    random: tuple[str, ...] = option((), "Values at random, --samples of them.", metavar="N=LOW:HIGH[:log]")
    sobol: tuple[str, ...] = option((), "Values of a Sobol sequence, --samples of them.", metavar="N=LOW:HIGH[:log]")
    samples: int | None = option(None, "Number of points of --random and --sobol.", show_default=str(SAMPLES), type=int)
    seed: int = option(0, "Seed of --random and --sobol.", show_default=True, type=click.IntRange(0))
    jobs: int = option(0, "Worker processes; 0: one per core.", type=JOBS)
    timeout: float = option(TIMEOUT, "Time limit per case [s].", type=SECONDS, show_default=True)
    dry_run: bool = option(False, "Print the number of cases, and stop.")
    cluster: str = cluster()
    fresh: bool = option(False, "Start a new run even if one can be resumed.")
    csv: Path | None = option(None, "Table of the cases; OUT/sweep.csv by default.", type=FILE)
    parquet: Path | None = option(None, "Also write the table as Parquet to this file.", type=FILE)


@main.command(epilog="Example: crosscheck sweep bounce --grid e=0:1:50")
@selection
@gathered("how", Sweeping)
@AS_JSON
@OUT
def sweep(cases: Cases, how: Sweeping, out: Path, as_json: bool) -> None:
    """Run scenes over grids of parameters, into one table.

    The table has one line per case. Grids and lists are crossed with each other and with --samples points. Failed
    checks do not change the exit status, since a study looks for them. Exits with 1 if cases are INVALID, crashed,
    timed out or missing, with 4 if not all of it ran.
    """
    console = terminal(stderr=True)
    csv = how.csv or out / "sweep.csv"
    if not cases.scenes:
        raise SceneError("scenes: a sweep needs the name of a scene")
    request, study = cases.request(), _study(how)
    chosen = study_slots(request, study)
    if not chosen:
        raise SceneError("scenes: no case fits this selection")
    if how.dry_run:
        click.echo(json.dumps({"cells": len(chosen)}) if as_json else plural(len(chosen), "case"))
        return
    folder(out)
    if how.csv:
        writable(csv, "csv")
    if how.parquet:
        writable(how.parquet, "parquet")
        with extra("sweep", "parquet"):
            import pyarrow  # noqa: F401  (asked for before anything runs, not after)
    store = Store(out)
    title = f"sweep: {' '.join(request.scenes)}"
    done = run_plan(store, title, chosen, console, how.jobs, how.timeout, None, how.fresh, cluster=how.cluster,
                    finish=False)  # fmt: skip
    rows, complete = rows_of(done.id, store.observations(done), chosen), not store.missing(done)
    found = table(rows)
    write(csv, csv_of(found))
    if how.parquet:
        found.to_parquet(how.parquet, index=False)
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
    console.print(f"table: {csv}", markup=False, highlight=False, soft_wrap=True)
    console.print(f"what fails and why: crosscheck findings{at(out)}", markup=False, highlight=False, soft_wrap=True)
    absent = missing(cases.engine, request.engines)
    for line in absent:
        console.print(line, markup=False, highlight=False, soft_wrap=True)
    broken = any(row.outcome in ALARMING_OUTCOMES or (row.outcome == "refused" and row.alarming) for row in rows)
    sys.exit(statuses.verdict(broken, complete and not absent))


def _study(how: Sweeping) -> Study:
    crossed: dict[str, list[float]] = {}
    for name, values in [*map(grid, how.grid), *map(listed, how.lists)]:
        if name in crossed:
            raise SceneError(f"sweep: {name} is varied twice")
        crossed[name] = values
    kinds: dict[Kind, tuple[str, ...]] = {"random": how.random, "sobol": how.sobol}
    ranges = [(kind, range_from(text, kind, 2)[0]) for kind, texts in kinds.items() for text in texts]
    names = [each.name for _, each in ranges]
    for name in names:
        if names.count(name) > 1 or name in crossed:
            raise SceneError(f"sweep: {name} is varied twice")
    if how.samples is not None and not ranges:
        raise SceneError("samples: belongs to --random and --sobol")
    with extra("sweep"):
        return Study(crossed, points(ranges, SAMPLES if how.samples is None else how.samples, how.seed))
