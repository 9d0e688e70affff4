"""``run --invariance``: what an answer depends on and must not: order of bodies, place, heading, company."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from typing import Any

import click
from rich.console import Console
from rich.table import Table
from rich.text import Text

from reports.terminal import terminal
from reports.wording import number, reproduce
from validation.catalogue import CATALOGUE
from validation.cells import Slot
from validation.posed import resolve
from validation.questions.invariance import FACTOR, MOVES, RELATIONS, Change, compare
from validation.running.plan import QUICK_DT


def cells_of(slots: Iterable[Slot], named: bool) -> list[Slot]:
    """One cell per scene, dimension, engine and profile: the representative one, or what the call named."""
    chosen: dict[tuple[Any, ...], Slot] = {}
    for slot in slots:
        key = (slot.scene, slot.dimension, slot.engine, slot.profile)
        canonical = resolve(slot.scene)
        asked = slot if named or slot.scene not in CATALOGUE else slot.with_params(dict(canonical.representative))
        plain = asked.iterations is None or named
        if plain and asked.ulp == 0 and (named or slot.dt == QUICK_DT):
            chosen.setdefault(key, asked.with_params(dict(canonical.minimal(dict(asked.params)))))
    return list(chosen.values())


def compare_and_show(slots: Sequence[Slot], as_json: bool) -> bool:
    """Ask every cell everything; whether nothing mattered that must not."""
    console, progress = terminal(), terminal(stderr=True)
    found: list[tuple[Slot, list[Change]]] = []
    for slot in slots:
        who = f"{slot.engine}/{slot.profile} {slot.scene} {slot.dimension}-D"
        progress.print(who, style="dim", markup=False, highlight=False)
        found.append((slot, compare(slot)))
    if as_json:
        plain = [
            {"slot": slot.as_dict(), "changes": [{**asdict(change), "holds": change.holds} for change in changes]}
            for slot, changes in found
        ]
        click.echo(json.dumps(plain, indent=1))
    else:
        _show(found, console)
    return all(change.holds for _, changes in found for change in changes)


def _show(found: Sequence[tuple[Slot, list[Change]]], console: Console) -> None:
    for scene in dict.fromkeys((slot.scene, slot.dimension) for slot, _ in found):
        own = [(slot, changes) for slot, changes in found if (slot.scene, slot.dimension) == scene]
        console.print()
        params = own[0][0].params_text()
        console.print(Text(f"{scene[0]} {scene[1]}-D{' ' + params if params else ''}", style="bold"))
        table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 2))
        for heading in ("engine, profile", "nothing changed by", "changed by"):
            table.add_column(heading, overflow="fold")
        for slot, changes in own:
            good = ", ".join(change.relation for change in changes if change.holds and not change.refused)
            bad = "; ".join(_text(change) for change in changes if not change.holds)
            silent = [change for change in changes if change.refused and not change.lost]
            if len(silent) == len(changes):
                good, bad = "-", silent[0].refused
            table.add_row(f"{slot.engine}/{slot.profile}", good, bad)
        console.print(table, highlight=False)
        for slot, changes in own:
            if any(not change.holds for change in changes):
                console.print(Text(f"  {reproduce(slot.as_dict())} --invariance", style="dim"), soft_wrap=True)
                break
    moves = ", ".join(map(str, MOVES))
    console.print()
    said = (
        f"A change counts above {FACTOR:g} times the largest one from starts moved by {moves} units in the last place."
    )
    console.print(Text(said, style="dim"))
    console.print(Text("; ".join(f"{each.name}: {each.says}" for each in RELATIONS), style="dim"))


def _text(change: Change) -> str:
    if change.lost:
        return f"{change.relation} (no answer: {change.refused})"
    return f"{change.relation} ({change.metric} by {number(change.change, 2)}, may by {number(change.allowed, 1)})"
