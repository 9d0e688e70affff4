"""``frontier``: breaking points of each engine, each with its two neighbouring cases."""

from __future__ import annotations

import json
import sys
from typing import Any

import click
from rich.console import Console
from rich.table import Table
from rich.text import Text

from adapters import registry
from reports.command import statuses
from reports.command.completion import scene_names
from reports.command.files import wrong
from reports.command.group import AS_JSON, main
from reports.command.selection import WORKERS, Cases, gathered, missing
from reports.terminal import print_roles, print_table, terminal
from reports.wording import profiles_called, reproduce
from validation.catalogue import matching
from validation.questions.frontier import FULL_RATIO, QUICK_RATIO, Bracket, axes, brackets, search, value_text

#: Largest number of results whose commands are printed without ``--commands``.
FEW = 6


@main.command(epilog="Example: crosscheck frontier thin_wall")
@click.argument("scenes", nargs=-1, shell_complete=scene_names)
@gathered("cases", Cases, only=("engine", "profile", "dim"))
@click.option(
    "--quick/--full",
    "coarse",
    default=True,
    help="Stop when the two ends are a factor 1.3 (quick, the default) or 1.03 (full) apart.",
)
@click.option("--jobs", default=1, show_default=True, type=WORKERS, help="Worker processes.")
@click.option("--commands", is_flag=True, help="Print the commands that run both ends again.")
@AS_JSON
def frontier(cases: Cases, coarse: bool, jobs: int, commands: bool, as_json: bool) -> None:
    """Find breaking points: how far a scene goes until it fails.

    Bisects for each engine and profile the largest time step, stack height, mass ratio, overlap, spin and impact speed,
    and the fewest iterations. Each result is a case that still works and one that fails, with how it fails and the
    commands that run both again. SCENES without such a quantity are refused. Exits with 4 if a named engine is not
    installed.
    """
    names = list(dict.fromkeys(scene.name for pattern in cases.scenes for scene in matching(pattern)))
    known = dict.fromkeys(name for name, _ in axes())
    for name in names:
        if name not in known:
            raise wrong(f"scenes: {name} has no breaking point to search; {', '.join(known)} have")
    engines = list(cases.engine) or registry.usual()
    for name in engines:
        registry.find(name)
    found = brackets(names, engines, profiles_called(cases.profile, engines), cases.dim, coarse)
    if not found:
        raise wrong("scenes: no breaking point fits this selection of engines, profiles and dimensions")
    console, progress = terminal(), terminal(stderr=True)
    said = None
    for still, _ in search(found, QUICK_RATIO if coarse else FULL_RATIO, jobs):
        if still != said:
            progress.print(f"{still} of {len(found)} searches left", style="dim", highlight=False)
        said = still
    if as_json:
        click.echo(json.dumps([_as_plain(each) for each in found], indent=1))
    else:
        _show(found, commands or len(found) <= FEW, console)
    absent = missing(cases.engine, engines)
    for line in absent:
        progress.print(line, markup=False, highlight=False, soft_wrap=True)
    sys.exit(statuses.verdict(False, not absent))


def _who(bracket: Bracket) -> str:
    return f"{bracket.base.engine}/{bracket.base.profile} {bracket.base.dimension}-D"


def _show(found: list[Bracket], commands: bool, console: Console) -> None:
    kinds = dict.fromkeys((each.base.scene, each.frontier.name) for each in found)
    meant = ""
    for scene, name in kinds:
        own = [each for each in found if (each.base.scene, each.frontier.name) == (scene, name)]
        first = own[0].frontier
        console.print()
        params = " ".join(f"{k}={v:g}" for k, v in first.params.items())
        console.print(Text(f"{name} ({scene}{' ' + params if params else ''})", style="bold"))
        if first.survives != meant:
            console.print(Text(f"works if it {first.survives}", style="dim"))
        meant = first.survives
        table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 2))
        for heading in ("engine, profile", "works", "fails", "how"):
            table.add_column(heading)
        for each in own:
            table.add_row(_who(each), *_cells(each))
        print_table(table, console, highlight=False)
        for each in own if commands else ():
            for end, said in ((each.survives, "works"), (each.fails, "fails")):
                if end is not None:
                    console.print(Text(f"  {said}: {reproduce(end.slot.as_dict())}"), soft_wrap=True)
    print_roles(((each.base.engine, each.base.profile) for each in found), console)
    if not commands and found:
        console.print()
        console.print(Text("--commands prints the commands of both ends, --json everything", style="dim"))


def _cells(bracket: Bracket) -> tuple[str, str, str]:
    if bracket.refused:
        return "-", "-", bracket.refused
    good, bad = bracket.survives, bracket.fails
    said = [value_text(bracket.frontier, end.value) if end else "" for end in (good, bad)]
    return said[0] or "none", said[1] or "none", bad.fate if bad else "works to the end of the range"


def _as_plain(bracket: Bracket) -> dict[str, Any]:
    ends = {
        name: None if end is None else {
            "value": end.value, "fate": end.fate, "slot": end.slot.as_dict(), "command": reproduce(end.slot.as_dict())
        }
        for name, end in (("survives", bracket.survives), ("fails", bracket.fails))
    }  # fmt: skip
    slot, frontier = bracket.base, bracket.frontier
    return {
        "scene": slot.scene, "dimension": slot.dimension, "engine": slot.engine, "profile": slot.profile,
        "what": frontier.name, "unit": frontier.unit, "predicate": frontier.survives, "said": bracket.text,
        "refused": bracket.refused, "cells": bracket.cells, **ends,
    }  # fmt: skip
