"""``accept``: shows how a run would change the list of known failures, cause by cause, and prompts for reasons."""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import click
from rich.console import Console
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from adapters import registry
from reports.command.group import AS_JSON, OUT, main
from reports.command.selection import JOBS
from reports.progress import run_plan
from reports.terminal import print_table, terminal
from reports.wording import first_of, number, plural
from validation.cells import Observation, prepare, slot_from_dict
from validation.findings import Family, Findings, FindingsError, Key, files
from validation.findings.files import FAMILIES, MEMBERS, add_entries, findings_of, write_members
from validation.judging.acceptance import (
    Change,
    Draws,
    Proposal,
    accepted,
    draws_of,
    propose,
    slots_to_move,
    slots_to_move_further,
)
from validation.judging.rows import Row, rows_of, with_floors
from validation.records.store import SCATTER_TITLE, Store
from validation.running.plan import is_standard

#: Largest number of refused rows that are printed; the others are counted.
SHOWN = 12


@main.command(epilog="Example: crosscheck accept latest --engine ENGINE")
@click.argument("run", default="latest")
@click.option("--engine", required=True, metavar="E", help="Engine whose list of known failures is updated.")
@click.option(
    "--family", "families", multiple=True, metavar="ID", help="Accept the failures with this cause (repeat for more)."
)
@click.option("--jobs", default=0, type=JOBS, help="Worker processes; 0: one per core.")
@AS_JSON
@OUT
def accept(run: str, engine: str, families: tuple[str, ...], jobs: int, as_json: bool, out: Path) -> None:
    """Add failing checks of a run to the list of known failures.

    RUN is an id that `list runs` prints; the latest by default. Each check that fails, here or from a moved start, is
    listed with its value and a band around it, and with its cause. To measure the band, failed cases are run again from
    initial positions moved by some units in the last place; if the scatter is too wide to notice an improvement, from
    twelve more. If nothing is accepted, the list is empty. Once an engine has a list, every other failure is new, and
    `run` exits with 1.

    The command shows the causes whose lists would change. Those named by --family are accepted. On a terminal you are
    asked about the others; without a terminal they stay as they are. The command refuses checks that a law of the
    engine should predict and does not, cases whose property checks fail, and failures of an exact profile. It changes
    no entry of a case that did not run.

    Exits with 1 if a check is refused, a changed cause is not accepted, or another check is new or changed. Read the
    diff before you commit it: a known failure is listed to be shown, not to be hidden.
    """
    registry.find(engine)
    console = terminal(stderr=True)
    findings = findings_of(engine)
    about = _selection(families, findings)
    rows, draws = _rows_with_scatter(out, run, engine, jobs, console, about)
    proposal = propose(rows, engine, findings, about, draws)
    unknown = set(families) - {change.family.id for change in proposal.changes}
    if unknown:
        raise FindingsError(f"family: {', '.join(sorted(unknown))}: no such cause of {engine} in {FAMILIES}")
    changed = [change for change in proposal.changes if change.asks]
    if changed:
        _print_changes(engine, changed, console)
    chosen, written = _decide(changed, families, console)
    folder = files.findings_folder(engine)
    if folder is None:
        raise FindingsError(f"accept: {engine} is a plain module and has no folder to list findings in")
    members = accepted(_with_reasons(proposal, written), chosen)
    path = folder / MEMBERS
    left = [change.family.id for change in changed if change.family.id not in chosen]
    done = not (left or proposal.refused or proposal.left_out)
    add_entries(folder, [*written, *proposal.unsupported])
    write_members(folder, members)  # an empty list, too, makes every other failure of the engine new
    listed = sorted({m.family.id for m in members.values()})
    if as_json:
        result = {"engine": engine, "rows": len(members), "families": listed, "file": str(path)}
        counts = {"refused": len(proposal.refused), "left_out": len(proposal.left_out)}
        click.echo(json.dumps({**result, **counts, "not_accepted": left}, indent=1))
    else:
        counted = f"{plural(len(members), 'check')} with {plural(len(listed), 'cause')} listed in {path}"
        if findings is None:
            click.echo(f"{engine}: {counted}; from now on every other failure is new, and run exits with 1")
        else:
            click.echo(f"{engine}: {counted}{', as before' if members == findings.members else ''}")
    if proposal.unsupported:
        told = first_of([f"{each.scene} {each.dimension}-D".replace("* ", "all ") for each in proposal.unsupported])
        click.echo(f"cannot run, and listed as that: {told}", err=True)
    _show_refused(proposal.refused)
    if left:
        drafts = any(change.is_draft for change in changed if change.family.id in left)
        file = folder / FAMILIES
        fields = "a [[family]] with id, profiles, scene, metrics, reason and source for each"
        hint = f" (without a terminal: write into {file} {fields}; then name them by --family)"
        click.echo(f"not accepted: {', '.join(left)}{hint if drafts else ''}", err=True)
    if proposal.left_out:
        click.echo(f"not named by --family: {plural(len(proposal.left_out), 'check')} new or changed", err=True)
    sys.exit(0 if done else 1)


def _selection(families: Sequence[str], findings: Findings | None) -> Callable[[Key], bool]:
    """Rows to list: all on a terminal; without one, those of the named causes, if any are named."""
    chosen = set(families)
    if findings is None or not chosen or not chosen <= set(findings.families) or _on_a_terminal():
        return lambda key: True

    def about(key: Key) -> bool:
        member, family = findings.members.get(key), findings.family_of(key)
        return (member.family.id if member else family.id if family else "") in chosen

    return about


def _rows_with_scatter(
    out: Path, run: str, engine: str, jobs: int, console: Console, about: Callable[[Key], bool]
) -> tuple[list[Row], dict[Key, Draws]]:
    """Rows of the engine with their scatter, and draws of each; scatter that the store lacks is measured here."""
    store = Store(out, create=False, write=True)
    try:
        chosen = store.run(run)
        own = [o for o in store.observations(chosen) if o.slot.engine == engine]
        if not all(map(_is_of_this_code, own)):
            raise FindingsError(
                f"run: {chosen.id} was made by other code or another release of {engine} than is installed now; "
                "run it again"
            )
        title = f"{SCATTER_TITLE}{chosen.id}"
        for earlier in (run for run in store.runs() if run.title == title):
            own += filter(_is_of_this_code, store.observations(earlier))
        if not any(is_standard(observation.slot) for observation in own):
            raise FindingsError(f"run: {chosen.id} has no case of the standard suite on {engine}")
        rows = rows_of(chosen.id, own)  # once: laws may take a while, and moved starts are not judged
        moves = slots_to_move(rows, engine, about)
        if moves:
            console.print(f"{plural(len(moves), 'case')} with moved starts, for the scatter of failed checks")
            own += store.observations(run_plan(store, title, moves, console, jobs))
            rows = with_floors(rows, own)
        further = slots_to_move_further(rows, engine, draws_of(own), about)
        if further:
            console.print(f"{plural(len(further), 'case')} with more starts, where a band is too wide to show changes")
            own += store.observations(run_plan(store, title, further, console, jobs))
        return rows, draws_of(own)
    finally:
        store.close()


def _is_of_this_code(observation: Observation) -> bool:
    """Whether this code and this release of the engine made the observation; others must not be listed."""
    return observation.cell == prepare(observation.slot).cell.key()


def _print_changes(engine: str, changes: Sequence[Change], console: Console) -> None:
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for name in ("cause", "listed", "new", "changed", "gone", "other band"):
        table.add_column(name, justify="left" if name == "cause" else "right", no_wrap=name == "cause")
    for change in changes:
        listed = len(change.same) + len(change.drifted) + len(change.gone) + len(change.bands)
        counts = (listed, len(change.new), len(change.drifted), len(change.gone), len(change.bands))
        table.add_row(change.family.id, *map(str, counts))
    console.print(Text(f"Known failures of {engine}: checks per cause", style="bold"))
    print_table(table, console)
    for change in changes:
        reason = change.family.reason or "none yet"
        console.print(Padding(Text(f"{change.family.id}: {reason}"), (0, 0, 0, 2)), highlight=False)


def _decide(changed: Sequence[Change], named: Sequence[str], console: Console) -> tuple[set[str], list[Family]]:
    """Ids of the accepted causes, and those of them that got their reason just now."""
    chosen, written = set(named), []
    for change in changed:
        if change.family.id in chosen and change.is_draft:
            raise FindingsError(f"family: {change.family.id} has no reason; write it into {FAMILIES} first")
        if change.family.id in chosen or not _on_a_terminal():
            continue
        console.print(_details(change), markup=False, highlight=False)
        if not change.is_draft:
            if click.confirm(f"{change.family.id}: is this still the cause: {change.family.reason}?", err=True):
                chosen.add(change.family.id)
            continue
        reason = click.prompt(
            "why do these checks fail (empty: leave them new)", default="", show_default=False, err=True
        )
        source = click.prompt("where is that documented, read or measured", err=True) if reason.strip() else ""
        if reason.strip() and source.strip():
            written.append(replace(change.family, reason=reason.strip(), source=source.strip()))
            chosen.add(change.family.id)
    return chosen, written


def _on_a_terminal() -> bool:
    return sys.stdin.isatty()


def _details(change: Change) -> str:
    """New, changed and gone checks of a cause, by kind of metric."""
    lines = [f"cause {change.family.id}: {', '.join(change.family.profiles)} on {change.family.scene}"]
    for name, entries in (("new", change.new), ("changed", change.drifted), ("gone", change.gone),
                          ("with another band", change.bands)):  # fmt: skip
        kinds = Counter(f"{key[0]} {key[6].partition('[')[0]}" for key in entries)
        lines += [f"  {name}: {count} x {kind}" for kind, count in kinds.items()]
    for key, (old, now) in list(change.drifted.items())[:3]:
        lines.append(f"  {' '.join(filter(None, key))}: {number(old.value, 6)} -> {number(now.value, 6)}")
    for key, now in list(change.new.items())[:3]:
        lines.append(f"  {' '.join(filter(None, key))}: {number(now.value, 6)}")
    return "\n".join(lines)


def _with_reasons(proposal: Proposal, written: Sequence[Family]) -> Proposal:
    """The proposal, with drafts replaced by causes that have a reason now."""
    became = {family.id: family for family in written}
    changes = []
    for change in proposal.changes:
        family = became.get(change.family.id)
        new = {key: replace(found, family=family) for key, found in change.new.items()} if family else change.new
        changes.append(replace(change, family=family or change.family, new=new))
    return replace(proposal, changes=tuple(changes))


def _show_refused(refused: Sequence[tuple[Row, str]]) -> None:
    for why, count in Counter(why for _, why in refused).items():
        click.echo(f"refused: {plural(count, 'check')}: {why}", err=True)
    for row, _ in refused[:SHOWN]:
        where = f"{row.engine}/{row.profile} {row.scene} {row.dimension}-D"
        case = f"{where} {slot_from_dict(row.slot).params_text()}".rstrip()
        click.echo(f"  {case} {row.metric} {number(row.value, 6)}", err=True)
    if len(refused) > SHOWN:
        click.echo(f"  and {len(refused) - SHOWN} more", err=True)
