"""``bench``: cost of an answer of a given error."""

from __future__ import annotations

import json
import os
import random
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.text import Text

from adapters import registry
from adapters.scene import SceneError
from reports import speed
from reports.command import statuses
from reports.command.files import folder
from reports.command.group import AS_JSON, OUT, main
from reports.command.selection import JOBS, SECONDS, Cases, gathered, missing, option, selection
from reports.command.targets import show_targets
from reports.progress import run_plan
from reports.stages import stage
from reports.terminal import print_roles, terminal
from reports.wording import at, plural
from validation.bench import agreement, reading
from validation.bench.lane import FULL, QUICK, Limits, run_lane
from validation.bench.sweep import Sweep, accuracy_slots, answered, benched, timed_units
from validation.bench.units import Unit
from validation.bench.work import certified_of
from validation.cells import Outcome, Slot
from validation.files.distance import primary_of
from validation.records.store import MissingError, Run, Store
from validation.workers import TIMEOUT

#: Least share of the time ratios of two bench runs on one machine that must agree within their intervals.
AGREEMENT = 0.9


@dataclass(frozen=True)
class Benching:
    """Options of ``bench`` beside its cases."""

    jobs: int = option(0, "Worker processes for the errors; 0: one per core.", type=JOBS)
    timeout: float = option(TIMEOUT, "Time limit per case [s].", type=SECONDS, show_default=True)
    seed: int | None = option(None, "Seed of the random order of timings; drawn and printed if not given.", type=int)
    against: str | None = option(None, "Compare the time ratios with an earlier benchmark, or 'latest'.", metavar="RUN")
    dry_run: bool = option(False, "Print the number of cases, and stop.")
    fresh: bool = option(False, "Start a new run, and reuse no result of an earlier one.")
    targets: bool = option(
        False, "Instead, compare the textbook step with each engine, and the ratios with floors and targets."
    )
    brief: bool = option(False, "Print no tables; they are in OUT/bench and in the report.")


@main.command(epilog="Example: crosscheck bench stack")
@selection
@gathered("how", Benching)
@AS_JSON
@OUT
def bench(cases: Cases, how: Benching, out: Path, as_json: bool) -> None:
    """Measure error against time, over steps and iterations.

    SCENES are names, globs, scene files or models, as for run. The error on a file is the distance from the certified
    run of our own solver at the end; where there is none, a line says why.

    Prints CPU time at equal error, scaling and overhead of SCENES. Errors are measured first, in worker processes; then
    cases are timed one at a time. --quick takes a minute on two cores: a dozen scenes, each in its first dimension
    unless --dim names others. --full takes up to two hours (piles of a thousand boxes). With --against, exits with 1 if
    fewer than 90 % of the time ratios agree. With --targets, times the textbook profile against other engines at 10
    sweeps and at equal error, in under ten minutes on one core; a ratio below its floor is shown and is no failure.
    """
    console = terminal(stderr=True)
    if how.targets:
        show_targets(console, as_json, out, cases.scenes, how.seed)
        return
    if cases.ulp:
        raise SceneError("ulp: moves the start of a run; it has no meaning for a benchmark")
    if cases.standard:
        raise SceneError("standard: is a suite of judged cases; a benchmark is --quick or --full")
    wanted, title, cells = plan_of(cases)
    request = wanted.request
    if not cells:
        raise SceneError("scenes: no case fits this selection")
    if how.dry_run:
        click.echo(json.dumps({"cells": len(cells)}) if as_json else plural(len(cells), "case"))
        return
    absent = missing(cases.engine, request.engines)
    for line in absent:
        click.echo(f"crosscheck: {line}", err=True)
    if all(registry.find(name).engine is None for name in request.engines):
        sys.exit(statuses.INCOMPLETE)
    store = Store(folder(out))
    earlier = _earlier(store, how.against)
    seed = how.seed if how.seed is not None else random.SystemRandom().randrange(10**6)
    source, known = ("", []) if how.fresh else answered(store, cells)
    if known:
        console.print(f"reusing {len(known)} of {plural(len(cells), 'result')} of run {source}")
    run = run_plan(
        store, title, cells, console, how.jobs, how.timeout, None, how.fresh, finish=False,
        recorded=False, known=known,
    )  # fmt: skip
    if not any(observation.outcome is Outcome.OK for observation in store.observations(run)):
        store.close()
        click.echo("crosscheck: bench: no case has a result, so there is nothing to time", err=True)
        sys.exit(statuses.INCOMPLETE)
    limits = QUICK if request.suite == "quick" else FULL
    with stage(console, "timing"):
        units = timed_units(wanted, store.observations(run))
        if not _measurable(store, run, units):
            store.close()
            sys.exit(statuses.INCOMPLETE)
        time_units(store, run, request.scenes, units, limits, seed, console)
    if not store.missing(run):
        store.finish(run)
    _show(store, run, out, as_json, how.brief, console if as_json else terminal())
    agrees = _compare(store, earlier, run, console) if earlier else True
    store.close()
    sys.exit(statuses.verdict(not agrees, not absent))


def plan_of(cases: Cases) -> tuple[Sweep, str, list[Slot]]:
    """Sweep, title and cases of a benchmark with these options."""
    request = replace(cases.request(), ulps=(0,))
    if not cases.scenes:
        request = replace(request, scenes=benched(request.suite))
    wanted = Sweep(request, tuple(request.dts), tuple(request.iterations), dict(request.params or {}))
    return wanted, f"bench {request.suite}: {cases.words(request.scenes)}", accuracy_slots(wanted)


def _measurable(store: Store, run: Run, units: Sequence[Unit]) -> bool:
    """Whether any case has an error, so that timing it makes sense; prints why others have none."""
    for each in certified_of(store.observations(run)).values():
        if each.reason:
            click.echo(f"crosscheck: bench: {each.slot.scene} {each.slot.dimension}-D: {each.reason}", err=True)
    return any(unit.purpose == "work" for unit in units)


def _earlier(store: Store, name: str | None) -> Run | None:
    """Run to compare with; raises before anything runs."""
    if name is None:
        return None
    found = [run for run in reading.bench_runs(store) if name in ("latest", run.id)]
    if not found:
        raise MissingError(f"against: there is no benchmark {name!r} in {store.path}")
    return found[-1]


def time_units(
    store: Store, run: Run, scenes: Sequence[str], units: Sequence[Unit], limits: Limits, seed: int, console: Console
) -> None:
    """Time all units and store the times of ``run``, with the protocol."""
    console.print(f"timing {plural(len(units), 'case')}, one at a time, in random order (seed {seed})", highlight=False)
    started, load = time.monotonic(), os.getloadavg()
    store.clear_timings(run)
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("timing", total=None)
        for timing in run_lane(units, limits, seed):
            store.add_timings(run, [timing])
            slot = timing.slot
            progress.update(task, description=f"round {timing.round + 1}: {slot.scene} on {slot.engine}")
    protocol = {
        "seed": seed,
        "limits": asdict(limits),
        "clock": "CPU time of the process (all threads), cost of reading the clock taken off; wall time beside it",
        "unit": "build outside the clock, warm, then one call advance(n); 'sampled': one step at a time, state read",
        "primary": {
            scene: {name: getattr(primary_of(scene), name) for name in ("name", "unit", "law", "because", "state")}
            for scene in scenes
        },
        "lane_seconds": round(time.monotonic() - started, 1),
        "load_before": load,
        "load_after": os.getloadavg(),
    }
    store.set_protocol(run, protocol)


def _show(store: Store, run: Run, out: Path, as_json: bool, brief: bool, console: Console) -> None:
    tables, protocol = speed.tables_of(store, run), store.protocol(run) or {}
    written = speed.write_all(out, run, protocol, tables, speed.raw_of(store, run))
    if as_json:
        click.echo(speed.as_json(run, protocol, tables))
    console.print(speed.quality_line(tables["timings"]), highlight=False)
    if speed.busy(tables["timings"]):
        console.print(Text(speed.busy(tables["timings"]), style="bold"))
    if not brief:
        _print_tables(tables, console)
    where = f"run {run.id}, seed {protocol.get('seed')}; written: {written[0].parent}"
    console.print(Text(where), soft_wrap=True)
    console.print(Text(f"figures of error against time: crosscheck report --open{at(out)}"), soft_wrap=True)


def _print_tables(tables: speed.Tables, console: Console) -> None:
    ranked = not speed.busy(tables["timings"])
    for table in speed.level_tables(tables["work_points"], ranked):
        console.print(table)
    console.print(Text(speed.key(ranked), style="dim"))
    print_roles(tables["work_points"][["engine", "profile"]].itertuples(index=False, name=None), console)
    beside = speed.overhead_table(tables["overhead"]), speed.scaling_table(tables["scaling"], tables["scaling_fits"])
    for table in beside:
        if table.row_count:  # a short bench may have none
            console.print(table)


def _compare(store: Store, earlier: Run, run: Run, console: Console) -> bool:
    """Print how well two bench runs agree; whether that is well enough."""
    both = agreement.agreement(agreement.ratios(store, earlier), agreement.ratios(store, run))
    if len(both) == 0:
        console.print(f"against {earlier.id}: the two benchmarks have no case of the same versions in common")
        return False
    share = float(both["agrees"].mean())
    for row in both[~both["agrees"]].to_dict("records"):
        console.print(_disagreement(row), highlight=False)
    console.print(f"against {earlier.id}: {share:.1%} of {len(both)} time ratios agree within their intervals")
    return share >= AGREEMENT


def _disagreement(row: Mapping[Any, Any]) -> str:
    what = f"{row['purpose']} {row['scene']} {row['dimension']}-D {row['engine']}/{row['profile']} dt {row['dt']:.3g}"
    first, second = (
        f"{row[f'ratio_{k}']:.3g} [{row[f'ratio_low_{k}']:.3g}, {row[f'ratio_high_{k}']:.3g}]" for k in (1, 2)
    )
    return f"  {what} {row['params_text']} x{row['iterations']:g}: {first}, now {second}"
