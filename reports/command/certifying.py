"""``certify``: what the solver and the oracle promise, measured beside the gate."""

from __future__ import annotations

import json
import math
import multiprocessing
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from importlib import import_module
from typing import Any

import click
from rich.console import Console
from rich.table import Table

from reference_solver.certification import Gate
from reports.command.group import AS_JSON, main
from reports.wording import number

#: Modules of `reference_solver.certification` that answer for gates, in the order in which they are shown.
PARTS = ("impact", "friction", "columns", "conservation", "rotation", "metamorphic", "event_driven")
#: Processes side by side; the parts are of such lengths that more would wait for the longest.
WORKERS = 2


@main.command()
@AS_JSON
def certify(as_json: bool) -> None:
    """Measure every gate of the reference solver and its oracle; exits with 1 if one does not hold."""
    console = Console(stderr=True)
    found = side_by_side(measured, PARTS, console)
    gates = [gate for part in PARTS for gate in found[part]]
    if as_json:
        click.echo(json.dumps([_finite(asdict(gate)) for gate in gates], indent=1))
    console.print(_table(gates))
    broken = sum(not gate.holds for gate in gates)
    console.print(f"{len(gates) - broken} of {len(gates)} gates hold")
    sys.exit(1 if broken else 0)


def side_by_side(measure: Callable[[str], Any], parts: Sequence[str], console: Console) -> dict[str, Any]:
    """Return ``measure(part)`` of every part, made in processes of their own, and say on stderr how far it is."""
    results: dict[str, Any] = {}
    start = time.perf_counter()
    # A fresh interpreter each: compiled kernels and threads do not survive a fork on every platform.
    with ProcessPoolExecutor(WORKERS, multiprocessing.get_context("spawn")) as pool:
        jobs = {pool.submit(measure, part): part for part in parts}
        for job in as_completed(jobs):
            results[jobs[job]] = job.result()
            elapsed = time.perf_counter() - start
            console.print(f"[dim]{len(results)}/{len(parts)} {jobs[job]}, {elapsed:.0f} s after the start[/dim]")
    return results


def measured(part: str) -> list[Gate]:
    """Measure the gates of one part; one that cannot be measured is a gate that does not hold."""
    gates: list[Gate] = []
    try:
        gates.extend(import_module(f"reference_solver.certification.{part}").gates())
    except Exception as error:
        gates.append(Gate.at_most(f"{part}: could not be measured", repr(error), math.nan, 0.0, part))
    return gates


def _finite(row: dict[str, Any]) -> dict[str, Any]:
    """JSON has no nan and no infinity: null."""
    return {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in row.items()}


def _table(gates: Iterable[Gate]) -> Table:
    table = Table(title="Gates: measured beside promised", title_justify="left")
    for heading in ("quantity", "case", "measured", "gate", "made by", ""):
        table.add_column(heading)
    for gate in gates:
        mark = "holds" if gate.holds else "FAILS"
        table.add_row(gate.quantity, gate.case, number(gate.measured), number(gate.gate), gate.made_by, mark)
    return table
