"""``bench --piles``: cost of a step in a pile, cut at events or fixed, over the number of bodies."""

from __future__ import annotations

import json
from dataclasses import asdict

import click
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from reports.speed import duration
from validation.bench.piles import KINDS, Lap, Row, exponents, laps, rows
from validation.bench.statistics import Fit, Spread


def show_piles(console: Console, as_json: bool, most: int, seed: int) -> None:
    """Time piles of all kinds with up to ``most`` bodies; print cost, ratio and exponents."""
    found: list[Lap] = []
    for kind in KINDS:
        for lap in laps(kind, most, seed):
            if not found or (found[-1].kind, found[-1].bodies) != (lap.kind, lap.bodies):
                console.print(f"clocking {lap.bodies} {kind}", style="dim", highlight=False)
            found.append(lap)
    summary = rows(found)
    if as_json:
        click.echo(
            json.dumps({"laps": [asdict(lap) for lap in found], "rows": [asdict(row) for row in summary]}, indent=1)
        )
    console.print(_costs(summary))
    console.print(_exponents(summary))


def _costs(summary: list[Row]) -> Table:
    table = Table(title="CPU time of a step of a pile: median, 95 % interval", title_justify="left", box=SIMPLE_HEAD)
    for heading in ("pile", "bodies"):
        table.add_column(heading, no_wrap=True)
    for heading in ("located", "fixed_step", "ratio"):
        table.add_column(heading)  # without room beside its median, an interval is below it
    for row in summary:
        seconds = (_seconds(row.reference), _seconds(row.fixed_step))
        ratio = f"{row.ratio.median:.2g} [{row.ratio.low:.2g}, {row.ratio.high:.2g}]"
        table.add_row(row.kind, str(row.bodies), *seconds, ratio)
    return table


def _exponents(summary: list[Row]) -> Table:
    table = Table(title="Cost of a step ~ bodies^p", title_justify="left", box=SIMPLE_HEAD)
    for heading in ("pile", "bodies", "p, located", "p, fixed_step"):
        table.add_column(heading, no_wrap=True)
    for kind, fits in exponents(summary).items():
        sizes = [row.bodies for row in summary if row.kind == kind]
        table.add_row(kind, f"{sizes[0]} to {sizes[-1]}", *(_fit(fit) for fit in fits))
    return table


def _seconds(cost: Spread) -> str:
    return f"{duration(cost.median)} [{duration(cost.low)}, {duration(cost.high)}]"


def _fit(fit: Fit | None) -> str:
    return "-" if fit is None else f"{fit.exponent:.2f} +- {fit.standard_error:.2f}"
