"""Error bounds of the solver and of the independent solution, measured: ``make certify ARGS="--help"``."""

from __future__ import annotations

import json
import math
import multiprocessing
import os
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from importlib import import_module
from itertools import groupby
from typing import Any

import click
from rich.console import Console
from rich.table import Table

from adapters.isolation import end_with
from reports.command.group import AS_JSON
from reports.terminal import terminal
from reports.wording import number
from tests.verification.fuzzing import show_random
from tests.verification.gate import Gate
from tests.verification.orders import PHASES, RATES, orders
from tests.verification.self_test import JUDGED, PROMISED, SIZES, trials

#: Modules beside this one with error bounds, in the order in which they are measured and shown. The
#: independent solution comes first: it needs few kernels, and the other process compiles the rest meanwhile. Parts of
#: minutes come before parts of seconds, so that both processes end at about the same time.
PARTS = (
    "event_driven.gates",
    "impact",
    "friction",
    "columns",
    "overlaps",
    "conservation",
    "rotation",
    "known.gates",
    "random_scenes",
    "falling",
    "piles",
    "turning",
    "turning_in_space",
    "detection",
    "metamorphic",
    "hard_cases.gates",
    "self_test",
)
#: Number of processes; each has its own kernels in memory [300 MB], and the stated times are for two cores.
WORKERS = 2
#: Width of a table that goes to a file [characters]; a terminal has its own.
WIDTH = 150


@click.command()
@AS_JSON
@click.option(
    "--order", is_flag=True, help="Instead, show how errors of classical and fixed_step fall with the time step."
)
@click.option(
    "--self-test", is_flag=True, help="Instead, corrupt results one at a time and see whether the certificate notices."
)
@click.option(
    "--random", "count", type=click.IntRange(1), help="Instead, compare N random scenes with variants of them."
)
@click.option("--seed", default=0, show_default=True, type=click.IntRange(0), help="Seed of the first random scene.")
@click.option("--dim", multiple=True, type=click.IntRange(2, 3), help="Random scenes: only 2-D or only 3-D.")
@click.option("--chains", is_flag=True, help="Random scenes: rows of bodies, in which impacts accumulate.")
def certify(
    as_json: bool, order: bool, self_test: bool, count: int | None, seed: int, dim: tuple[int, ...], chains: bool
) -> None:
    """Test the reference solver against its stated accuracy.

    Measures every stated error bound, and those of the independent solution that it is compared with. Exits with 1 if
    one does not hold. With --random, random scenes are solved, certified, and solved again mirrored, moved, to
    other tolerances and so on. A certified result that differs is a defect, and the command exits with 1; refused
    scenes are listed with the reason.
    """
    console = terminal(stderr=True)
    if not console.is_terminal:
        console = terminal(stderr=True, width=WIDTH)
    if order:
        show_orders(console, as_json)
        return
    if self_test:
        sys.exit(show_self_test(console, as_json))
    if count is not None:
        sys.exit(show_random(console, as_json, count, seed, dim or (2, 3), chains))
    found = side_by_side(measured, PARTS, console)
    gates = [gate for part in PARTS for gate in found[part]]
    if as_json:
        click.echo(json.dumps([_finite(asdict(gate)) for gate in gates], indent=1))
    console.print(_table(gates))
    broken = sum(not gate.holds for gate in gates)
    console.print(f"{len(gates) - broken} of {len(gates)} bounds hold")
    sys.exit(1 if broken else 0)


def show_orders(console: Console, as_json: bool) -> None:
    """Print the fitted orders of all cases; these are observations without bounds."""
    with console.status("halving steps"):
        found = list(orders())
    if as_json:
        click.echo(json.dumps([asdict(row) for row in found], indent=1))
    table = Table(title=f"Orders, largest error of {PHASES} phases", title_justify="left")
    for heading in ("case", "made by", "order", *(f"at 1/{rate} s" for rate in (RATES[0], RATES[-1]))):
        table.add_column(heading, no_wrap=True)
    for row in found:
        slope = "round-off" if row.order is None else f"{row.order:.2f}"
        table.add_row(row.case, row.made_by, slope, number(row.errors[0], 3), number(row.errors[-1], 3))
    console.print(table)


def show_self_test(console: Console, as_json: bool) -> int:
    """Print which planted corruptions are noticed at which size; return 1 if too few are at the judged size, else 0."""
    with console.status("planting corruptions"):
        found = list(trials())
    if as_json:
        rows = [(trial.corruption, trial.size, trial.seen) for trial in found]
        plain = [
            {"family": c.family, "corruption": c.name, "scene": c.scene, "size": size, "caught": bool(seen), "by": seen}
            for c, size, seen in rows
        ]
        click.echo(json.dumps(plain, indent=1))
    table = Table(title="Planted corruptions: noticed by", title_justify="left")
    for heading in ("family", "what is corrupted", "scene", *(f"{size:g}" for size in SIZES), "where missed"):
        table.add_column(heading)
    for corruption, group in groupby(found, lambda trial: trial.corruption):
        seen = [trial.seen[0] if trial.seen else "MISSED" for trial in group]
        why = corruption.missed if "MISSED" in seen else ""
        table.add_row(corruption.family, corruption.name, corruption.scene, *seen, why)
    console.print(table)
    judged = [trial for trial in found if trial.size == JUDGED]
    caught = sum(bool(trial.seen) for trial in judged)
    console.print(f"{caught} of {len(judged)} noticed at size {JUDGED:g}, {PROMISED:.0%} required")
    for trial in judged:
        if not trial.seen:
            console.print(f"missed: {trial.corruption.name}, {trial.corruption.scene}: {trial.corruption.missed}")
    return 0 if caught >= PROMISED * len(judged) else 1


def side_by_side(measure: Callable[[str], Any], parts: Sequence[str], console: Console) -> dict[str, Any]:
    """Return ``measure(part)`` of every part, measured in several processes, with progress on stderr."""
    results: dict[str, Any] = {}
    start = time.perf_counter()
    # New interpreters: compiled kernels and threads do not survive a fork on every platform.
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(WORKERS, context, end_with, (os.getpid(),)) as pool:
        jobs = {pool.submit(measure, part): part for part in parts}
        for job in as_completed(jobs):
            results[jobs[job]] = job.result()
            elapsed = time.perf_counter() - start
            console.print(f"{len(results)}/{len(parts)} {jobs[job]}, {elapsed:.0f} s after the start", style="dim")
    return results


def measured(part: str) -> list[Gate]:
    """Measure the bounds of one part; a part that cannot be measured is a bound that does not hold."""
    gates: list[Gate] = []
    try:
        gates.extend(import_module(f"tests.verification.{part}").gates())
    except Exception as error:
        gates.append(Gate.at_most(f"{part}: could not be measured", repr(error), math.nan, 0.0, part))
    return gates


def _finite(row: dict[str, Any]) -> dict[str, Any]:
    """Row with null for nan and infinity, which JSON does not have."""
    return {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in row.items()}


def _table(gates: Iterable[Gate]) -> Table:
    table = Table(title="Error bounds: measured and stated", title_justify="left")
    for heading in ("quantity", "case", "measured", "bound", "made by", ""):
        table.add_column(heading)
    for gate in gates:
        mark = "holds" if gate.holds else "FAILS"
        words = (gate.quantity, gate.case)
        table.add_row(*words, number(gate.measured), number(gate.gate), gate.made_by, mark)
    return table


if __name__ == "__main__":
    certify()
