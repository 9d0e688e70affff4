"""``run --invariance``: metamorphic tests (order of bodies, place, heading, distant bodies)."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import click
from rich.console import Console
from rich.table import Table
from rich.text import Text

from adapters.registry import find
from reports.terminal import print_roles, terminal
from reports.wording import number, reproduce
from validation.catalogue import CATALOGUE
from validation.cells import Slot
from validation.findings.files import findings_folder
from validation.judging.verdicts import Standing
from validation.posed import resolve
from validation.questions.breaks import breaks_of, listed, standing_of, write
from validation.questions.invariance import FACTOR, INVISIBLE, MOVES, RELATIONS, Change, compare
from validation.running.plan import QUICK_DT

#: Words for the regression status of a violation.
LABELS = {Standing.KNOWN: "known", Standing.NEW: "NEW", Standing.DRIFTED: "drifted"}


def cells_of(slots: Iterable[Slot], named: bool) -> list[Slot]:
    """One case per scene, dimension, engine and profile: the representative one, or that of the call if ``named``."""
    chosen: dict[tuple[Any, ...], Slot] = {}
    for slot in slots:
        key = (slot.scene, slot.dimension, slot.engine, slot.profile)
        canonical = resolve(slot.scene)
        asked = slot if named or slot.scene not in CATALOGUE else slot.with_params(dict(canonical.representative))
        plain = asked.iterations is None or named
        if plain and asked.ulp == 0 and (named or slot.dt == QUICK_DT):
            chosen.setdefault(key, asked.with_params(dict(canonical.minimal(dict(asked.params)))))
    return list(chosen.values())


@dataclass(frozen=True)
class Judged:
    """Effect of a relation, and its regression status among the listed violations."""

    change: Change
    standing: Standing | None
    reason: str

    @property
    def alarming(self) -> bool:
        """Whether it makes the command fail: a violation that is not listed, or one that differs from its listing."""
        return not self.change.holds if self.standing is None else self.standing is not Standing.KNOWN


def compare_and_show(slots: Sequence[Slot], as_json: bool, keep: bool = False) -> bool:
    """Test every case with every relation; whether no violation is new or changed.

    With ``keep``, violations of causes that have a reason are listed first.
    """
    console, progress = terminal(), terminal(stderr=True)
    found: list[tuple[Slot, list[Change]]] = []
    for slot in slots:
        who = f"{slot.engine}/{slot.profile} {slot.scene} {slot.dimension}-D"
        progress.print(who, style="dim", markup=False, highlight=False)
        found.append((slot, compare(slot)))
        if keep:  # after every case, because a suite takes long and may be interrupted
            _keep(slot.engine, [(slot, change) for change in found[-1][1]])
    judged = [(slot, [_judged(slot, change) for change in changes]) for slot, changes in found]
    if as_json:
        click.echo(json.dumps([_plain(slot, each) for slot, each in judged], indent=1))
    else:
        _show(judged, console)
    return not any(each.alarming for _, own in judged for each in own)


def _keep(engine: str, found: Sequence[tuple[Slot, Change]]) -> None:
    folder = findings_folder(engine)
    if folder is not None and breaks_of(engine).families:
        write(folder, listed(engine, find(engine).version, found))


def _judged(slot: Slot, change: Change) -> Judged:
    return Judged(change, *standing_of(slot, find(slot.engine).version, change))


def _plain(slot: Slot, judged: Sequence[Judged]) -> dict[str, Any]:
    """One case as JSON: every relation with its physics, regression status and reason, named as in rows."""
    changes = [
        {
            **asdict(each.change), "holds": each.change.holds,
            "physics": None if each.change.refused and not each.change.lost
            else "pass" if each.change.holds else "fail",
            "standing": each.standing.value if each.standing else None, "reason": each.reason,
        }
        for each in judged
    ]  # fmt: skip
    return {"slot": slot.as_dict(), "changes": changes}


def _show(found: Sequence[tuple[Slot, list[Judged]]], console: Console) -> None:
    for scene in dict.fromkeys((slot.scene, slot.dimension) for slot, _ in found):
        own = [(slot, changes) for slot, changes in found if (slot.scene, slot.dimension) == scene]
        console.print()
        params = own[0][0].params_text()
        console.print(Text(f"{scene[0]} {scene[1]}-D{' ' + params if params else ''}", style="bold"))
        table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 2))
        for heading in ("engine, profile", "no change by", "changed by"):
            table.add_column(heading, overflow="fold")
        reasons: dict[str, None] = {}
        for slot, judged in own:
            changes = [each.change for each in judged]
            good = ", ".join(change.relation for change in changes if change.holds and not change.refused)
            bad = "; ".join(_text(each) for each in judged if not each.change.holds or each.standing)
            reasons |= dict.fromkeys(
                f"{each.standing.value}: {each.reason}" for each in judged if each.reason and each.standing
            )
            silent = [change for change in changes if change.refused and not change.lost]
            if len(silent) == len(changes):
                good, bad = "-", silent[0].refused
            table.add_row(f"{slot.engine}/{slot.profile}", good, bad)
        console.print(table, highlight=False)
        for reason in reasons:
            console.print(Text(f"  {reason}"))
        for slot, judged in own:
            if any(each.alarming for each in judged):
                console.print(Text(f"  {reproduce(slot.as_dict())} --invariance", style="dim"), soft_wrap=True)
                break
    moves = ", ".join(map(str, MOVES))
    console.print()
    print_roles(((slot.engine, slot.profile) for slot, _ in found), console)
    said = (
        f"A change counts if it is larger than {INVISIBLE:g} of the check's tolerance and than {FACTOR:g} times the "
        f"largest effect of moving or turning the start by {moves} units in the last place."
    )
    console.print(Text(said, style="dim"))
    console.print(Text("; ".join(f"{each.name}: {each.says}" for each in RELATIONS), style="dim"))


def _text(judged: Judged) -> str:
    change = judged.change
    said = f" {LABELS[judged.standing]}" if judged.standing else ""
    if change.holds:
        return f"{change.relation}{said}"
    if change.lost:
        return f"{change.relation}{said} (no result: {change.refused})"
    return (
        f"{change.relation}{said} ({change.metric} by {number(change.change, 2)}; allowed: {number(change.allowed, 1)})"
    )
