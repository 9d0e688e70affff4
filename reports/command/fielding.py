"""``field``: public reports, run again."""

from __future__ import annotations

import json
import sys

import click
from rich.table import Table
from rich.text import Text

from reports.command import statuses
from reports.command.files import wrong
from reports.command.group import AS_JSON, main
from reports.command.selection import WORKERS
from reports.symptoms.answers import near
from reports.terminal import print_table, terminal
from reports.wording import number, reproduce
from validation.field import CURED, Finding, ask, matching
from validation.settings.switching import Reading


@main.command("field", epilog="Example: crosscheck field stack")
@click.argument("words", nargs=-1)
@click.option("--jobs", default=1, show_default=True, type=WORKERS, help="Worker processes.")
@click.option("--commands", is_flag=True, help="Print the command of every report.")
@AS_JSON
def field(words: tuple[str, ...], jobs: int, commands: bool, as_json: bool) -> None:
    """Run known reports (public questions and bugs) again.

    Prints whether each is still true of the installed engines. WORDS choose reports by repository, engine or scene; all
    by default. Exits with 1 if a report is no longer true.
    """
    chosen = matching(words)
    if not chosen:
        hint = "".join(f"; did you mean {name!r}?" for name in near(words).values())
        raise wrong(f"words: no known report has {' or '.join(map(repr, words))}{hint}")
    found = ask(chosen, jobs)
    if as_json:
        click.echo(json.dumps([_as_plain(each) for each in found], indent=1))
    else:
        _show(found, commands)
    sys.exit(statuses.verdict(not all(each.as_said for each in found), True))


def _show(found: list[Finding], commands: bool) -> None:
    console = terminal()
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for heading in ("report, engine", "symptom", "on this machine"):
        table.add_column(heading, overflow="fold")
    for each in found:
        note = each.note
        who = f"{_broken(note.source, console.width // 3)}\n{note.about}" + (
            "" if note.about == note.engine else f", run on {note.engine}"
        )
        table.add_row(Text(who), Text(note.symptom), Text(_said(each)))
        table.add_row("", "", "")
    print_table(table, console, highlight=False)
    for each in found if commands else ():
        console.print(Text(f"{each.note.source}: {reproduce(each.note.slot.as_dict())}"), soft_wrap=True)
    if not commands:
        console.print(Text("--commands prints the command of every report", style="dim"))


def _broken(source: str, width: int) -> str:
    """``owner/repository#number``, on two lines if it is wider than its column: half a number cannot be searched."""
    return source if len(source) < width else source.replace("/", "/\n", 1)


def _said(each: Finding) -> str:
    note = each.note
    text = _word(each.now) + ("" if each.as_said else f" (the report says: {_word(note.said)})")
    if each.before is not None:
        text += f"\n{note.engine}/{note.profile} {note.scene} {note.dimension}-D: {note.metric} {_number(each.before)}"
    if each.after is not None:
        text += f"; with {note.cure_text}: {_number(each.after)}"
    return text


def _word(said: str) -> str:
    return "fixed" if said == CURED else said


def _number(found: Reading) -> str:
    if found.value is None:
        return found.reason
    unit = "" if found.check.unit == "1" else f" {found.check.unit}"
    return f"{number(found.value, 3)}{unit} (truth {number(found.check.truth, 3)})"


def _as_plain(each: Finding) -> dict[str, object]:
    note = each.note
    return {
        "source": note.source, "about": note.about, "symptom": note.symptom, "slot": note.slot.as_dict(),
        "metric": note.metric, "command": reproduce(note.slot.as_dict()), "cure": note.cure_text, "said": note.said,
        "now": each.now, "as_said": each.as_said,
        "value": each.before.value if each.before else None, "cured": each.after.value if each.after else None,
    }  # fmt: skip
