"""``nulls``: errors of trivial answers, which need no engine, check by check."""

from __future__ import annotations

import json
from typing import Any

import click
from rich.table import Table
from rich.text import Text

from reports.command.completion import scene_names
from reports.command.group import AS_JSON, main
from reports.command.selection import parameter
from reports.terminal import terminal
from reports.wording import number, params_text
from validation.catalogue import matching
from validation.questions.nulls import NULLS, nulls_of
from validation.running.plan import QUICK_DT


@main.command("nulls", epilog="Example: crosscheck nulls impact")
@click.argument("scenes", nargs=-1, shell_complete=scene_names)
@click.option("--param", multiple=True, metavar="NAME=VALUE", help="Set a parameter of the scene.")
@click.option("--dim", multiple=True, type=click.IntRange(2, 3), help="Only 2-D or only 3-D.")
@AS_JSON
def nulls(scenes: tuple[str, ...], param: tuple[str, ...], dim: tuple[int, ...], as_json: bool) -> None:
    """Score trivial answers that need no engine.

    The trivial answers are: nothing moves; nothing touches; what touches sticks. The skill of an engine in a check is
    1 minus its error divided by that of the best trivial answer; `explain` and the report print it.
    """
    rows: list[dict[str, Any]] = []
    for scene in dict.fromkeys(scene.name for pattern in scenes or ("*",) for scene in matching(pattern)):
        (canonical,) = matching(scene)
        params = dict(map(parameter, param)) or dict(canonical.representative)
        for dimension in canonical.dimensions:
            if dim and dimension not in dim:
                continue
            made = canonical.scene(dimension, params)
            for check in canonical.checks(made, QUICK_DT):
                if check.truth is None or check.bound is None:
                    continue
                found = nulls_of(scene, dimension, params, QUICK_DT, check.metric, check.truth)
                rows.append({
                    "scene": scene, "dimension": dimension, "params": params, "metric": check.metric,
                    "unit": check.unit, "truth": check.truth, "tolerance": check.bound,
                    "nulls": {each.name: {"value": each.value, "error": each.error, "reason": each.reason}
                              for each in found},
                })  # fmt: skip
    if as_json:
        click.echo(json.dumps(rows, indent=1))
        return
    console = terminal()
    for head in dict.fromkeys((row["scene"], row["dimension"], params_text(row["params"])) for row in rows):
        console.print(
            Text(f"{head[0]} {head[1]}-D{' ' + head[2] if head[2] else ''}: errors of trivial answers", style="bold")
        )
        table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
        for heading in ("check", "truth", "tolerance", *NULLS):
            table.add_column(heading, overflow="fold", no_wrap=heading == "check")
        for row in rows:
            if (row["scene"], row["dimension"]) == head[:2]:
                errors = [number(row["nulls"].get(name, {}).get("error"), 2) for name in NULLS]
                unit = "" if row["unit"] == "1" else f" [{row['unit']}]"
                name = f"{row['metric']}{unit}"
                table.add_row(Text(name), number(row["truth"], 4), number(row["tolerance"], 2), *errors)
        console.print(table, highlight=False)
