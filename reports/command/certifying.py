"""``certify``: what the solver and the oracle promise, measured beside the gate."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from importlib import import_module

import click
from rich.console import Console
from rich.table import Table

from reports.command.group import AS_JSON, main
from reports.wording import number

#: Modules of `reference_solver.certification` that answer for gates, in the order in which they are shown.
PARTS = ("event_driven",)


@main.command()
@AS_JSON
def certify(as_json: bool) -> None:
    """Measure every gate of the reference solver's event-driven oracle; exits with 1 if one does not hold."""
    console = Console(stderr=True)
    found = []
    for part in PARTS:
        module = import_module(f"reference_solver.certification.{part}")
        with console.status(f"certifying {part}"):
            found += list(module.gates())
    if as_json:
        click.echo(json.dumps([asdict(gate) for gate in found], indent=1))
    table = Table(title="Gates: measured beside promised", title_justify="left")
    for heading in ("quantity", "case", "measured", "gate", "made by", ""):
        table.add_column(heading)
    for gate in found:
        mark = "holds" if gate.holds else "FAILS"
        table.add_row(gate.quantity, gate.case, number(gate.measured), number(gate.gate), gate.made_by, mark)
    console.print(table)
    sys.exit(0 if all(gate.holds for gate in found) else 1)
