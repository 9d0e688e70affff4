"""``bench --targets``: ratios of time to each engine, at 10 sweeps and at equal error, with floors and targets."""

from __future__ import annotations

import json
import os
import random
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from itertools import groupby
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.text import Text

from adapters import registry
from adapters.scene import SceneError
from reports.stages import say, stage
from reports.wording import number
from validation.bench import reading, targets
from validation.bench.targets import AT_END, AT_ERROR, AT_SWEEPS, Row, Table
from validation.bench.work import work_points
from validation.identity import machine
from validation.records.store import MissingError, Store

#: Widths of the columns, 99 characters in all, and their headings in two lines.
WIDTHS = (8, 18, 18, 4, 12, 12, 8, 12)
HEADINGS = (
    ("against", " ratio at", " ratio at", "our", "our error", "their error", "floor/", ""),
    ("", " 10 sweeps", " equal error", "sw.", "(10 sweeps)", "(10 sweeps)", "target", ""),
)
#: Units with a prefix: errors are shown in thousandths.
SMALL = {"m": "mm", "J": "mJ"}
KEY = """\
Ratio: their CPU time of a step over ours in the same round, median [95 % interval]; above 1 ours
is faster. Equal error: ours with the fewest sweeps (sw.), 10 or more, whose errors are larger
than theirs by at most 1 %. Ten sweeps are of engines that sweep; others run as their profile
says. Floor and target hold for the ratio with a star."""
MARKS = {"target": "meets target", "floor": "meets floor"}


def show_targets(console: Console, as_json: bool, out: Path, scenes: Sequence[str], seed: int | None) -> None:
    """Measure all rows of the table, or those of ``scenes``, and print them.

    Raises
    ------
    SceneError
        For a scene that is not in the table.
    """
    asked = _chosen(targets.table(), scenes)
    seed = seed if seed is not None else random.SystemRandom().randrange(10**6)
    load = os.getloadavg()
    for name, reason in _absent(asked).items():
        click.echo(f"crosscheck: {name} is not shown: {reason}", err=True)
    with stage(console, "targets"), console.status("") as status:
        rows = list(targets.measure(asked, seed, lambda text: status.update(Text(text))))
    if not scenes:
        rows += _lead(out, asked)
    protocol = {"seed": seed, "machine": machine(), "load_before": load, "load_after": os.getloadavg()}
    protocol["versions"] = {name: registry.find(name).version for name in [registry.solver(), *asked.opponents]}
    if as_json:
        plain = [{**asdict(row), "mark": row.mark} for row in rows]
        click.echo(json.dumps({"protocol": protocol, "rows": plain}, indent=1, allow_nan=False))
        return
    for line in lines(rows):
        click.echo(line)
    say(console, f"seed {seed}, load {load[0]:.1f} before and {os.getloadavg()[0]:.1f} after")


def _chosen(asked: Table, scenes: Sequence[str]) -> Table:
    """The table with only the rows of ``scenes``; all if none is named."""
    known = list(dict.fromkeys(case.scene for case in asked.cases))
    for name in scenes:
        if name not in known:
            raise SceneError(f"targets: the table has no scene {name!r}, only {', '.join(known)}")
    return replace(asked, cases=tuple(case for case in asked.cases if not scenes or case.scene in scenes))


def _absent(asked: Table) -> dict[str, str]:
    """Opponents that are not installed, and why."""
    found = {name: registry.find(name) for name in asked.opponents}
    return {name: engine.reason for name, engine in found.items() if engine.engine is None}


def _lead(out: Path, asked: Table) -> list[Row]:
    """The row that is computed from the newest benchmark in ``out``, if there is one."""
    try:
        store = Store(out, create=False)
    except MissingError:
        return []
    try:
        runs = [run for run in reading.bench_runs(store) if run.finished]
        return [targets.lead(work_points(store, runs[-1]), asked.twice)] if runs else []
    finally:
        store.close()


def lines(rows: Sequence[Row]) -> list[str]:
    """The table as text: a line for each scene with the names of its errors, below it a line for each opponent."""
    table = [*map(_line, HEADINGS), "-" * (sum(WIDTHS) + len(WIDTHS) - 1)]
    for scene, those in groupby(rows, lambda row: row.scene):
        members = list(those)
        table.append(f"{scene}{_names(members)}")
        for _, pair in groupby(members, lambda row: row.against):
            table.append(_line(_cells({row.at: row for row in pair})))
    profiles = dict.fromkeys(row.against for row in rows if "/" in row.against)
    return [*table, "", *KEY.splitlines(), f"Profiles: {', '.join([_ours(), *profiles])}"]


def _ours() -> str:
    return f"{registry.solver()}/{registry.profile_of(registry.solver(), 'textbook')} (ours)"


def _line(cells: Sequence[Any]) -> str:
    return " ".join(f"{cell!s:<{width}}" for cell, width in zip(cells, WIDTHS, strict=True)).rstrip()


def _names(rows: Sequence[Row]) -> str:
    """Names of a scene's errors with their shown units; for the share of levels the numbers behind it."""
    counts = rows[0].counts
    if "levels" in counts:
        return f": {counts['ahead']} of {counts['levels']}; {counts['only_ours']} more are reached by ours only"
    names = next((row.our_error or row.their_error for row in rows if row.our_error or row.their_error), {})
    shown = (f"{name} [{SMALL.get(unit, unit)}]" for name, unit in map(_parts, names))
    return f"; error: {', '.join(shown)}" if names else ""


def _parts(name: str) -> tuple[str, str]:
    what, _, unit = name.removesuffix("]").partition(" [")
    return what, unit


def _cells(pair: Mapping[str, Row]) -> list[str]:
    """Columns of one opponent, from its rows by way of comparison."""
    first = next(iter(pair.values()))
    judged = next((row for row in pair.values() if row.floor is not None), first)
    errors = pair.get(AT_SWEEPS, first)
    equal = pair.get(AT_ERROR)
    return [
        first.against.partition("/")[0],
        _ratio(pair.get(AT_SWEEPS)),
        _ratio(equal),
        f"x{equal.sweeps}" if equal and equal.sweeps else "",
        _errors(errors.our_error),
        _errors(errors.their_error),
        _floor_and_target(judged),
        MARKS.get(judged.mark, judged.mark),
    ]


def _ratio(row: Row | None) -> str:
    if row is None or row.at == AT_END:
        return ""
    if row.measured is None:
        return f" {targets.NOT_THERE}" if row.reason.startswith(targets.NOT_THERE) else " -"
    star = "*" if row.floor is not None else " "
    if row.low is None or row.high is None:
        return f"{star}{row.measured:.0%}"
    return f"{star}{_digits(row.measured)} [{_digits(row.low)} {_digits(row.high)}]"


def _digits(ratio: float) -> str:
    return f"{ratio:.2f}" if ratio < 10.0 else f"{ratio:.3g}"


def _errors(errors: Mapping[str, float]) -> str:
    shown = (number((1e3 if _parts(name)[1] in SMALL else 1.0) * value, 2) for name, value in errors.items())
    return ", ".join(shown)


def _floor_and_target(row: Row) -> str:
    if row.floor is None:
        return ""
    if row.at == AT_END:
        return f"<= {1e3 * row.floor:g}"
    return f"{row.floor:g}/{row.target:g}"
