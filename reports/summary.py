"""Summary of a run for the terminal: the matrix, then the short answers, then commands for details.

matrix -> unexpected results (if any) -> best engine per scene -> what is wrong and what fixes it -> commands

If the scenes do not fit on a screen, groups are shown (`reports.overview`), unless all are requested.
"""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from adapters.stages import stage
from reports import overview
from reports.answers import Answer, Costs, answers, choices
from reports.findings import REFUSED, alarms, families, refusals
from reports.fixes import profile_costs
from reports.matrix import (
    Matrix,
    leaving,
    legend,
    matrix_of,
    repeated,
    status_of,
    sweeps_of,
    tables_of,
    unjudged,
    unranked,
    versions_of,
)
from reports.wording import at, called, plural, roles_line, unstated

Plain = Mapping[str, Any]
#: Largest number of alarm families in the list; `crosscheck findings --new` lists all.
MOST_ALARMS = 6
#: Number of lines of a table above its first row.
HEAD = 2


@stage("printing")
def show(
    rows: Sequence[Plain],
    console: Console,
    costs: Costs | None = None,
    files: Iterable[Path] = (),
    every: bool = False,
    out: Path | None = None,
    run: str = "",
) -> None:
    """Print the summary of a run, fitted to the width of ``console``; with ``every``, of each scene.

    ``out`` is the folder of its results, and ``run`` its id if it is not the latest: printed commands contain both.
    """
    place = at(out, run)
    matrix = matrix_of(rows)
    tables, wider = (tables_of(matrix, versions_of(rows), console.width, roles) for roles in (False, True))
    families = overview.families_of(rows)
    grouped = overview.by_family(rows, families)
    short = overview.table_of(grouped, list(families))
    long = len(tables) > 1 and sum(table.row_count + HEAD for table in tables) > overview.FIRST_LOOK
    if long and _fits(short, console) and not every:
        with_roles = overview.table_of(grouped, list(families), roles=True)
        roles = [] if _fits(with_roles, console) else [roles_line(matrix.columns)]
        _show_families(rows, families, short if roles else with_roles, roles, console, place)
        _where(rows, console, files, place, {"crosscheck show --all": "the same for every scene"})
        return
    # Roles of profiles follow their names if that needs no further table, else they are in a line below.
    roles = [roles_line(matrix.columns)] if len(wider) > len(tables) else []
    for table in tables if roles else wider:
        console.print(table)
    explained = [legend(matrix)] if any(row["outcome"] not in REFUSED for row in rows) else []
    for line in (
        *explained,
        *filter(None, roles),
        *_beside(matrix),
        *sweeps_of(matrix),
        *unranked(matrix.columns),
        *leaving(rows),
        *unjudged(rows),
        *repeated(rows),
    ):
        console.print(_folded(line, console, ""), style="dim")
    for line in refusals(rows):
        console.print(_folded(line, console, ""))
    _alarms(rows, console, place)
    _choices(rows, console, costs)
    _answers(rows, console)
    _where(rows, console, files, place)


def _show_families(
    rows: Sequence[Plain],
    families: Mapping[str, Sequence[str]],
    table: Table,
    roles: Sequence[str],
    console: Console,
    place: str,
) -> None:
    """The same by group of scenes; ``roles`` are those of the profiles that the table does not show."""
    console.print(table)
    matrix = matrix_of(rows)
    explained = overview.legend(overview.by_family(rows, families))
    for line in (
        explained,
        *filter(None, roles),
        *_beside(matrix),
        *unranked(matrix.columns),
        *leaving(rows),
        *unjudged(rows),
        *repeated(rows),
    ):
        console.print(_folded(line, console, ""), style="dim")
    ran = ", ".join(f"{engine} {version.partition('+')[0]}" for engine, version in versions_of(rows).items())
    console.print(_folded(ran, console, ""), style="dim")
    for line in refusals(rows):
        console.print(_folded(line, console, ""))
    _alarms(rows, console, place)
    _heading("Best engine per group: passes every check, or fails the fewest", console)
    wide = max(map(len, families))
    for name, line in overview.choices(rows, families):
        console.print(_folded(f"{name:<{wide}}  {line}", console))
    found = answers(rows)
    worst = overview.worst_answers(rows, found, families)
    count = f" ({len(worst)} of {len(found)})" if len(worst) < len(found) else ""
    _heading(f"What is wrong as shipped, and what fixes it: the worst scene of each group{count}", console)
    for answer in worst:
        console.print(_folded(answer.line, console))
    _elsewhere(worst, console)


def _fits(table: Table, console: Console) -> bool:
    """Whether a table is no wider than the terminal."""
    return console.measure(table, options=console.options.update(max_width=sys.maxsize)).maximum <= console.width


def _beside(matrix: Matrix) -> list[str]:
    """The regression status in one line; empty if nothing fails."""
    return list(filter(None, [status_of(matrix)]))


def _heading(text: str, console: Console) -> None:
    console.print()
    console.print(Text(text, style="bold"))


def _folded(text: str, console: Console, indent: str = "  ") -> Text:
    """Text in lines of the console's width; later lines are indented by four more."""
    later = indent + "    "
    folded = textwrap.fill(
        text, console.width, initial_indent=indent, subsequent_indent=later, break_on_hyphens=False,
        break_long_words=False,
    )  # fmt: skip
    return Text(folded)


def _alarms(rows: Sequence[Plain], console: Console, place: str) -> None:
    found = alarms(rows)
    if not found:
        return
    total = sum(len(family.rows) for family in found)
    _heading(f"Needs attention: {plural(total, 'unexpected result')} (exit status 1)", console)
    for family in found[:MOST_ALARMS]:
        console.print(_folded(family.line, console))
    if len(found) > MOST_ALARMS:
        more = f"... {len(found) - MOST_ALARMS} more lines: crosscheck findings --new{place}"
        console.print(_folded(more, console))


def _choices(rows: Sequence[Plain], console: Console, costs: Costs | None) -> None:
    order = ", cheapest first" if costs else ""
    _heading(f"Best engine per scene (passes every check{order})", console)
    found = choices(rows, costs)
    names = called(choice.scene for choice in found)
    wide = max(map(len, names.values()), default=0)
    for choice in found:
        console.print(_folded(f"{names[choice.scene]:<{wide}}  {choice.line}", console))


def _answers(rows: Sequence[Plain], console: Console) -> None:
    found = answers(rows)
    _heading("What is wrong, and what fixes it" if found else _nothing_wrong(rows), console)
    for answer in found:
        console.print(_folded(answer.line, console))
    _elsewhere(found, console)


def _elsewhere(found: Iterable[Answer], console: Console) -> None:
    """What profiles that a run recommends break in other scenes than its own."""
    for line in profile_costs((answer.engine, profile) for answer in found for profile in answer.better):
        console.print(_folded(line, console), style="dim")


def _nothing_wrong(rows: Sequence[Plain]) -> str:
    """Text for a run in which no profile fails at its own iteration count."""
    if all(row["outcome"] in REFUSED for row in rows):
        return "Nothing was judged: no engine of this run can run any of it"
    judged = [row for row in rows if row["tolerance"] is not None and row["outcome"] not in REFUSED]
    if not judged:
        return "Nothing was judged: no check of this run has a finite tolerance"
    if any(row["physics"] != "pass" for row in judged):
        return "Only checks at other iteration counts fail or have no value"
    refused = sum(row["outcome"] == "refused" and row["tolerance"] is not None for row in rows)
    passes = f"Every check passes that was judged; {refused} are REFUSED" if refused else "Every check passes"
    return ". ".join(filter(None, (passes, unstated(rows))))


def _where(
    rows: Sequence[Plain],
    console: Console,
    files: Iterable[Path],
    place: str,
    more: Mapping[str, str] = MappingProxyType({}),
) -> None:
    failing = sum(len(family.rows) for family in families(rows))
    _heading("Next", console)
    commands = [*more.items(), ("crosscheck report --open", "one HTML page")]
    if failing:
        one = [] if more else [("crosscheck explain ID", "one check: cause and fix")]
        commands = [("crosscheck findings", f"{plural(failing, 'failed check')} by cause"), *one, *commands]
    whole = [(command + place, what) for command, what in commands]
    wide = max(len(command) for command, _ in whole)
    for command, what in whole:
        # A command is not broken, so it can be copied; without room beside it, its explanation comes above.
        if wide + max(len(other) for _, other in whole) + 4 <= console.width:
            console.print(Text(f"  {command:<{wide}}  {what}"))
        else:
            console.print(Text(f"  # {what}\n  {command}"), soft_wrap=True)
    written = [str(path) for path in files]
    if written:
        line = f"Written ({plural(len(rows), 'check')}): {', '.join(written)}"
        console.print(_folded(line, console), soft_wrap=True)
