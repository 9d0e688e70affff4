"""``ask``: from a symptom to the scene that shows it and to a fix; ``field``: public reports, run again."""

from __future__ import annotations

import json
import math
import shlex
import sys
from collections.abc import Sequence
from dataclasses import asdict

import click
from rich.console import Console
from rich.table import Table
from rich.text import Text

from adapters import registry
from reports.command import statuses
from reports.command.group import AS_JSON, main
from reports.command.selection import WORKERS
from reports.cures import nothing_to_paste, recorded_fixes, recorded_paste, recorded_text
from reports.terminal import terminal
from reports.wording import number, reproduce
from validation.field import CURED, Finding, ask, matching
from validation.field.symptoms import matches, stems
from validation.posed import resolve
from validation.settings.cures import Cure, cures_of
from validation.settings.switching import Reading

#: Largest number of scenes that are named beside the best one.
OTHERS = 3


@main.command("ask", epilog="Example: crosscheck ask my ball does not bounce")
@click.argument("words", nargs=-1, required=True)
@AS_JSON
def ask_command(words: tuple[str, ...], as_json: bool) -> None:
    """Find a scene and a fix from a symptom in your words.

    WORDS are yours, such as: grip slips; my ball does not bounce; or the number of a known report. Name an engine for
    the lines to paste. Nothing is run: the numbers are those of the tables of fixes.
    """
    text = " ".join(words)
    known = {facts.package.lower(): name for name in registry.names() if (facts := registry.facts(name))}
    known |= {name: name for name in registry.names()}
    named = list(dict.fromkeys(known[word] for word in text.lower().split() if word in known))
    symptom = " ".join(word for word in text.split() if word.lower() not in known)
    found = matches(symptom, named)
    if not found:
        reason = f"nothing is known of {symptom!r}; see crosscheck list scenes, and crosscheck field for known reports"
        raise click.BadParameter(reason, param_hint="WORDS")
    best = found[0]
    # Beside the best: what has as many of the words, or one that it does not have.
    beside = [m for m in found[1:] if len(m.words) >= len(best.words) or set(m.words) - set(best.words)]
    others = [match.scene for match in beside if match.scene][:OTHERS]
    about = [best.report.engine] if best.report and "#" in text else named
    fixes = recorded_fixes(best.scene, about or registry.names())
    missed = [] if best.score == math.inf else [word for word in stems(symptom).values() if word not in best.words]
    if as_json:
        plain = {
            "scene": best.scene, "command": best.command, "words": best.words, "missed": missed, "others": others,
            "report": best.report.source if best.report else None,
            "fixes": [{**asdict(fix), "paste": recorded_paste(fix)} for fix in fixes],
        }  # fmt: skip
        click.echo(json.dumps(plain, indent=1, default=str))
        return
    console = terminal()
    console.print(Text(best.command or f"{best.scene}: {resolve(best.scene).title}", style="bold"), soft_wrap=True)
    if missed:
        console.print(Text(f"no match for: {', '.join(missed)}", style="dim"))
    if best.report and (not about or {best.report.engine, best.report.about} & set(about)):
        console.print(Text(f"known report {best.report.source}: {best.report.symptom}"))
    if best.scene:
        _show_fixes(best.scene, about, fixes, text, console)
    if others:
        near = (f"{name} ({resolve(name).title.lower()})" for name in others)
        console.print(Text(f"or: {'; '.join(near)}", style="dim"))


def _show_fixes(scene: str, named: Sequence[str], fixes: Sequence[Cure], text: str, console: Console) -> None:
    for fix in fixes:
        console.print()
        console.print(Text(f"{fix.engine} as shipped: {fix.failing} of {fix.judged} checks fail", style="bold"))
        console.print(Text(recorded_text(fix)))
        if fix.recommended and fix.engine in named:
            console.print(Text(recorded_paste(fix) or nothing_to_paste(fix)), soft_wrap=True)
    for engine in named:
        if engine not in {fix.engine for fix in fixes}:
            search = f"no fix is on record; to search: crosscheck cure {engine} {scene}"
            console.print(Text(f"{engine}: {search if cures_of(engine) else 'has no table of fixes'}"))
    if not fixes and not named:
        console.print(Text("no fix of an engine as shipped is on record"))
    console.print()
    console.print(Text(f"run it: crosscheck run {scene}" + "".join(f" --engine {engine}" for engine in named)))
    helped = [fix.engine for fix in fixes if fix.recommended and fix.engine not in named]
    if helped:
        engines = " or ".join(dict.fromkeys(helped))
        console.print(
            Text(f"lines to paste: name {engines}, as in: crosscheck ask {shlex.join(text.split())} {helped[0]}")
        )


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
        raise click.BadParameter(f"no known report has {' or '.join(words)}", param_hint="WORDS")
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
    console.print(table, highlight=False)
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
