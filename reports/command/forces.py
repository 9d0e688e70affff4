"""``forces``: what each engine's contact forces mean, and whether they are true."""

from __future__ import annotations

import json

import click
from rich.console import Console
from rich.padding import Padding
from rich.text import Text

from adapters.engine import EngineError
from adapters.engine_folder import READ, folder_of
from adapters.registry import find
from reports import readings
from reports.command.completion import engine_names
from reports.command.group import AS_JSON, main
from reports.tables import grid
from reports.terminal import terminal
from validation.questions.kept_readings import measure_all, write


@main.command(epilog="Example: crosscheck forces ENGINE")
@click.argument("engines", nargs=-1, shell_complete=engine_names)
@click.option("--measure", is_flag=True, help="Measure the installed release again; seconds.")
@click.option("--keep", is_flag=True, help="Measure, and write the table into readings.csv of the engine's folder.")
@AS_JSON
def forces(engines: tuple[str, ...], measure: bool, keep: bool, as_json: bool) -> None:
    """Show what contact forces of engines mean, and if true.

    For each public call that reads a contact force or impulse: what its number is, and how far it is off in six
    situations in which the forces are known: boxes at rest, on a slope, in a slide, through a blow, in flight, in a
    grip. With one engine, a script of the bare engine follows that reads a force rightly.
    """
    for engine in engines:
        find(engine)  # raises if there is no such engine; its kept table needs no installation
    names = list(engines) or readings.engines()
    found = {}
    for engine in names:
        entries = list(measure_all(engine)) if measure or keep else None
        if keep:
            folder = folder_of(engine)
            if folder is None or entries is None:
                raise EngineError(f"forces: {engine} has no folder of its own to keep {READ} in")
            write(entries, folder / READ)
        found[engine] = readings.told(engine, entries)
    if as_json:
        click.echo(json.dumps(list(found.values()), indent=1))
        return
    console = terminal()
    for told in found.values():
        _show(told, console)
    if any(each["rows"] for told in found.values() for each in told["readings"]):
        console.print(Text(f"\noff: {readings.SCALE}"))
    if len(names) == 1 and found[names[0]]["script"]:
        console.print(Text("\nreads it rightly:", style="bold"))
        console.print(Text(found[names[0]]["script"].rstrip()), soft_wrap=True)


def _show(told: readings.Plain, console: Console) -> None:
    console.print(Text(f"\n{told['engine']} {told['version']}".rstrip(), style="bold"))
    if not told["readings"]:
        console.print("  it lists no way to read a contact force")
    for each in told["readings"]:
        console.print(Text(f"\n{each['call']}", style="bold"))
        console.print(Text(each["means"]))
        console.print(Text(f"correction of overlaps: {each['correction']}"))
        if each["hint"]:
            console.print(Text(each["hint"]))
        table = grid("", *readings.LAWS)
        for row in each["rows"]:
            table.add_row(row["profile"], *(row["cells"][name] for name in readings.LAWS))
        console.print(table)
        for cause in each["causes"]:
            console.print(Padding(Text(cause), (0, 0, 0, 2)))
