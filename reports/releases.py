"""Results of an engine's releases: a line per release, then the changes in each, as text, Markdown and JSON.

``make releases`` publishes the page, which has changes in sentences with the engine's own release notes.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from reports.changes import kind_of
from reports.terminal import print_table
from reports.wording import at, markdown, number, plural
from validation.judging.comparison import Change, Kind
from validation.judging.verdicts import Physics
from validation.records.store import RELEASE_TITLE, Store
from validation.releases import history
from validation.releases.bisection import Found
from validation.releases.history import Step, Told, cell_of, mended, sentence
from validation.releases.notes import explanations

#: Largest number of families of changes on the terminal for one release; --json and --markdown have all.
SHOWN = 6


def _line(told: Told, first: Told, steps: Sequence[Step]) -> tuple[str, ...]:
    """Version and counts of rows: failed, no result, passed although listed for others, changed; the pace."""
    if told.reason:
        return (told.version, "-", "-", "-", "-", "-", told.reason)
    moved = sum(len(step.family.changes) for step in steps if step.after == told.version)
    better = sum(mended(row) for row in told.rows)
    note = "; ".join(f"no verdicts of {said}" for said in told.doubted)
    counts = (told.count(Physics.FAIL), told.ended or "-", better or "-", moved or "-")
    pace = told.pace(first)
    return (told.version, *map(str, counts), "-" if pace is None else f"x{number(pace, 3)}", note)


#: Headings of `_line`, and the text of a pace.
HEADINGS = ("release", "failed", "no result", "fixed", "changed", "time", "")
PACE = "time: relative to the first release; median over scenes, each relative to a Python loop on the same machine"


def _first(releases: Sequence[Told]) -> Told:
    """The first timed release, with a pace of 1."""
    return next((told for told in releases if told.times), releases[0])


def as_text(releases: Sequence[Told], steps: Sequence[Step], console: Console, out: Path | None = None) -> None:
    """A line per release, then the changes in each: families of changes, the most serious first.

    ``out`` is the folder in which the commands below find the results; None for the usual one.
    """
    rows, first = max((len(told.rows) for told in releases), default=0), _first(releases)
    head = f"{first.engine}: {plural(len(releases), 'release')}, {plural(rows, 'check')} each"
    console.print(Text(head, style="bold"))
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for heading in HEADINGS[:-1]:
        table.add_column(heading, justify="left" if heading == HEADINGS[0] else "right", no_wrap=True)
    table.add_column("", overflow="fold")
    for told in releases:
        table.add_row(*_line(told, first, steps))
    print_table(table, console, highlight=False)
    if first.times:
        console.print(Text(PACE, style="dim"))
    for version in dict.fromkeys(step.after for step in steps):
        own = [step for step in steps if step.after == version]
        console.print()
        console.print(Text(f"changed in {version}, after {own[0].before}", style="bold"))
        moved = Table(box=None, pad_edge=False, padding=(0, 1, 0, 1), show_header=False)
        moved.add_column(no_wrap=True)
        moved.add_column(overflow="fold")
        for step in own[:SHOWN]:
            more = len(step.family.changes) - 1
            rest = f", and {more} like it" if more else ""
            moved.add_row(mark(step.family.first), sentence(step.family.first) + rest)
        console.print(moved, highlight=False)
        if len(own) > SHOWN:
            console.print(Text(f"  ... and {len(own) - SHOWN} more", style="dim"))
        name = releases[0].engine
        console.print(Text(f"  crosscheck compare {name}=={own[0].before} {name}=={version}{at(out)}", style="dim"))


def mark(change: Change) -> str:
    """Kind of a change, in one word."""
    return {Kind.FLIP: "verdict", Kind.OUTCOME: "outcome", Kind.ERROR: "value"}.get(change.kind, "other")


def as_table(releases: Sequence[Told], steps: Sequence[Step]) -> str:
    """A line per release, in Markdown."""
    out, first = ["| " + " | ".join(HEADINGS) + " |", "|---" * len(HEADINGS) + "|"], _first(releases)
    out += ["| " + " | ".join(markdown(cell) for cell in _line(told, first, steps)) + " |" for told in releases]
    return "\n".join(out) + "\n"


def as_markdown(releases: Sequence[Told], steps: Sequence[Step]) -> str:
    """Two tables: releases, and changes."""
    out = [as_table(releases, steps)]
    if steps:
        out += ["| in | after | checks | what changed | by |", "|---|---|---|---|---|"]
    for step in steps:
        first = step.family.first
        size = f"{number(first.size, 3)} tol" if first.size else ""
        cells = (step.after, step.before, str(len(step.family.changes)), sentence(first), size)
        out.append("| " + " | ".join(markdown(cell) for cell in cells) + " |")
    return "\n".join(out) + "\n"


def as_json(releases: Sequence[Told], steps: Sequence[Step]) -> str:
    """Releases with their counts, and all steps."""
    listed = [
        {
            "release": told.name,
            "rows": len(told.rows),
            "fails": told.count(Physics.FAIL),
            "no_answer": told.ended,
            "mended": sum(mended(row) for row in told.rows),
            "time": told.pace(_first(releases)),
            "reason": told.reason,
            "without_verdicts": list(told.doubted),
        }
        for told in releases
    ]
    return json.dumps({"releases": listed, "steps": [step.as_dict() for step in steps]}, indent=1)


# ---- the published page ---------------------------------------------------------------------------------------------

HEAD = """# Physics over engine releases

Made by `make releases`{commit}. The same cases of every scene of the standard suite ran on each release, with one
adapter and in an environment of its own, after property checks. A check is one measured quantity of one case.
*failed* counts checks outside their tolerance; *no result* those whose case crashed, hung or failed a property check;
*fixed* those that pass although they are known failures of other releases; *changed* those that began or ceased to
fail, or whose value changed by more than its noise, which is the effect of moving the start by the last place.
`crosscheck bisect` finds each of these steps again. Release notes are quoted beside a step that they may explain; no
build with that one change was made to prove it.
"""


def sentences(engine: str, steps: Sequence[Step]) -> list[str]:
    """Changes by release: a paragraph per release and explanation, with a line per profile and scene."""
    groups: dict[tuple[str, str], dict[str, dict[tuple[str, str], list[Step]]]] = {}
    for step in steps:
        change = step.family.first
        why = "; ".join(explanations(engine, change.scene, change.profile, step.before, step.after))
        told = groups.setdefault((step.before, step.after), {}).setdefault(why, {})
        told.setdefault((change.profile, change.scene), []).append(step)
    out = []
    for (before, after), paragraphs in groups.items():
        for why, places in paragraphs.items():
            lines = [f"  * {profile} {scene}: {_moved(own)}" for (profile, scene), own in places.items()]
            out.append("\n".join([f"**{after}** (after {before}). {why[0].upper()}{why[1:]}.", *lines]))
    return out


def _moved(own: Sequence[Step]) -> str:
    """``2 checks begin to fail, 14 change their value; first `drift` (3-D) 1e-9 m (pass) -> 0.1 m (fail)``."""
    changes = [change for step in own for change in step.family.changes]
    flips = [change.regressed for change in changes if change.kind is Kind.FLIP]
    ends = [change.regressed for change in changes if change.kind is Kind.OUTCOME]
    counts = (
        (sum(flips), "begins to fail", "begin to fail"),
        (len(flips) - sum(flips), "ceases to fail", "cease to fail"),
        (sum(ends), "ends without a result", "end without a result"),
        (len(ends) - sum(ends), "has a result again", "have a result again"),
        (sum(change.kind is Kind.ERROR for change in changes), "changes its value", "change their value"),
    )
    said = [f"{plural(count, 'check')} {one if count == 1 else more}" for count, one, more in counts if count]
    first = own[0].family.first
    return f"{', '.join(said)}; first `{first.metric}` ({cell_of(first)}) {first.before} -> {first.after}"


def page(store: Store) -> str:
    """Markdown: of each engine in the store a table of its releases and the sentences."""
    made = {run.commit for run in store.runs() if run.title.startswith(RELEASE_TITLE) and run.plan}
    out = [HEAD.format(commit=f"; its results were made at {' and '.join(sorted(made))}" if all(made) and made else "")]
    for engine in history.engines(store):
        results = history.told(store, engine)
        steps = history.steps(results)
        out += [f"## {engine}", "", as_table(results, steps)]
        out += [f"{PACE}.", ""] if any(each.times for each in results) else []
        said = sentences(engine, steps)
        out += [f"* {line}" for line in said] or ["Nothing changed."]
        out.append("")
    return "\n".join(out)


# ---- one change ------------------------------------------------------------------------------------------------------


def found_as_plain(found: Found, engine: str, versions: Sequence[str], commands: Sequence[str]) -> dict[str, Any]:
    """Result of a bisection, as plain data."""
    return {
        "engine": engine,
        "before": versions[found.before],
        "after": versions[found.after],
        "not_asked_between": [versions[index] for index in found.unknown],
        "asked": [versions[index] for index in found.asked],
        "silent": {versions[index]: reason for index, reason in found.silent.items()},
        "change": found.change.as_dict(),
        "cell": cell_of(found.change),
        "others": None if found.others is None else [[versions[i], versions[j]] for i, j in found.others],
        "commands": list(commands),
    }


def found_as_text(plain: dict[str, Any]) -> str:
    """Result of a bisection, in sentences."""
    change = plain["change"]
    where = f"{change['profile']} {change['scene']} {plain['cell']}"
    lines = [
        f"{kind_of(change['kind'], change['regressed'])} since {plain['engine']} {plain['after']}: {where} "
        f"{change['metric']}",
        f"  {plain['engine']} {plain['before']}: {change['before']}",
        f"  {plain['engine']} {plain['after']}: {change['after']}",
    ]
    for version in plain["not_asked_between"]:
        lines.append(f"  {version} lies between and cannot run: {plain['silent'][version]}")
    lines.append(f"ran {plural(len(plain['asked']), 'release')}: {', '.join(plain['asked'])}")
    if plain["others"] is None:
        lines.append("whether it is the only change: --all runs every release")
    elif plain["others"]:
        others = ", ".join(f"{a} -> {b}" for a, b in plain["others"])
        lines.append(f"not the only change of this check: also {others}")
    else:
        lines.append("the only change of this check: every release ran")
    return "\n".join([*lines, "to run it again:", *(f"  {command}" for command in plain["commands"])])


if __name__ == "__main__":
    results, target = sys.argv[1:]
    opened = Store(Path(results), create=False)
    Path(target).write_text(page(opened), encoding="utf-8")
    opened.close()
