"""``list``, ``describe`` and ``doctor`` as tables for the terminal, fitted to its width."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from reports.terminal import print_table
from reports.wording import FEW, first_of, number, quantity, roles_line, setting_text, word_of
from validation.cells import format_dt

if TYPE_CHECKING:
    from validation.questions.detection import BlindSpot

Plain = Mapping[str, Any]
#: Note below facts measured without an adapter.
AFTERWARDS = (
    "Chosen afterwards: the source leaves a value open, which was chosen so that the measurement agrees; this "
    "agreement is no test. The conditions in the reason of a contradiction were found afterwards too."
)
#: Units of what a scene needs (`adapters.needs.Needs`), where it has one.
NEED_UNITS = {"smallest_size": "m", "top_speed": "m/s", "gravity": "m/s^2", "pull": "m/s^2"}
#: Columns of each listing: heading and field.
LISTINGS: dict[str, tuple[tuple[str, str], ...]] = {
    "scenes": (("scene", "name"), ("what", "title"), ("dim.", "dimensions"), ("truth", "law")),
    "suites": (
        ("scene", "name"),
        ("quick", "quick"),
        ("standard", "standard"),
        ("full", "full"),
        ("cases of quick", "of_quick"),
    ),
    "engines": (("engine", "name"), ("version", "version"), ("profiles", "profiles"), ("status", "status")),
    "checks": (("check", "name"), ("truth", "truth"), ("tolerance", "bound"), ("because", "because")),
    "runs": (("run", "id"), ("date", "date"), ("commit", "commit"), ("what", "title"), ("finished", "finished")),
}


def grid(*headings: str) -> Table:
    """A table without frames; the first column does not break words."""
    table = Table(box=SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, 2, 0, 0))
    for k, heading in enumerate(headings):
        table.add_column(heading, no_wrap=k == 0, overflow="fold")
    return table


def _heading(text: str, console: Console) -> None:
    console.print()
    console.print(Text(text, style="bold"))


def listed(what: str, entries: Sequence[Plain], console: Console, reasons: bool = False) -> None:
    """Print a listing of scenes, engines, checks or runs; of checks with their reasons on demand."""
    columns = [(heading, name) for heading, name in LISTINGS[what] if reasons or name != "because"]
    table = grid(*(heading for heading, _ in columns))
    last = ""
    for entry in entries:
        shown = {name: _field(entry, name) for _, name in columns}
        if "because" in shown:  # equal reasons are printed once
            shown["because"], last = "as above" if shown["because"] == last else shown["because"], shown["because"]
        table.add_row(*map(Text, shown.values()))
    print_table(table, console)
    if what == "engines" and (line := roles_line((e["name"], name) for e in entries for name in e["profiles"])):
        console.print(Text(line))
    if what == "suites":
        console.print(Text("Numbers of cases: each in 2-D and in 3-D where the scene has both."))
    if what == "checks" and not reasons:
        console.print(Text("First case of each scene, step 1/240 s. Reasons: --reasons, or describe SCENE"))
    for entry in entries:
        if entry.get("reason"):
            console.print(Text(f"{entry['name']}: {entry['reason']}"))


def _field(entry: Plain, name: str) -> str:
    value = entry.get(name)
    if name in ("truth", "bound"):
        return quantity(value, entry["unit"], 3)
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list):
        return ", ".join(map(str, value))
    if name == "date":
        return str(value)[: len("2026-01-01T12:00")].replace("T", " ")
    if name == "title" and "finished" in entry:  # a run's, which names scenes
        return title_of(str(value))
    return setting_text(value) if value is not None else "-"


def title_of(title: str) -> str:
    """A run's title, with the first few of many scenes."""
    asked, options, narrowing = title.partition(" --")
    suite, colon, scenes = asked.partition(": ")
    if len(scenes.split()) > FEW:
        scenes = first_of(scenes.split())
    return f"{suite}{colon}{scenes}{options}{narrowing}"


def described(data: Plain, console: Console) -> None:
    """Print everything about a scene or an engine."""
    if data["kind"] == "scene":
        _scene(data, console)
    else:
        _engine(data, console)


def _scene(data: Plain, console: Console) -> None:
    console.print(Text(f"{data['name']}, version {data['version']}: {data['title']}", style="bold"))
    for k, block in enumerate(re.split(r"\n[ \t]*\n", data["figure"].strip("\n"))):
        drawn = block.startswith(" ")  # indented lines are figures; other lines are wrapped
        if k:
            console.print()
        console.print(Text(block.rstrip() if drawn else " ".join(block.split())), soft_wrap=drawn)
    _heading("Parameters", console)
    table = grid("name", "default", "range", "what")
    for p in data["parameters"]:
        left = "(" if p["positive"] else "["
        table.add_row(
            p["name"], quantity(p["default"], p["unit"]), f"{left}{p['low']:g}, {p['high']:g}]", Text(p["because"])
        )
    print_table(table, console)
    _heading("Checks at the defaults, step 1/240 s", console)
    table = grid("metric", "truth", "tolerance", "because")
    last = ""
    for check in data["checks_at_defaults"]:
        truth, bound = (quantity(check[name], check["unit"]) for name in ("truth", "bound"))
        because = f"{check['because']} ({check['source']})"
        table.add_row(Text(check["metric"]), truth, bound, Text("as above" if because == last else because))
        last = because
    print_table(table, console)
    _heading("What it needs from an engine", console)
    _pairs({name.replace("_", " "): _need(name, value) for name, value in data["needs"].items()}, console)


def _need(name: str, value: Any) -> Any:
    """A need with its unit; ``yes`` or ``no``."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return quantity(value, NEED_UNITS[name]) if name in NEED_UNITS else value


def _engine(data: Plain, console: Console) -> None:
    title = f": {data['title']}" if "title" in data else ""
    console.print(Text(f"{data['name']} {data['version']}{title}, {data['status']}", style="bold"))
    if data["status"] != "installed":
        console.print(Text(data["reason"]))
        _unset(data, console)
        return
    facts = {name: data[name] for name in ("package", "dimensions")}
    step = f"{format_dt(data['customary_dt'])} s"
    _pairs(facts | {"usual step": step, "order of a step": data["scheme"]["order"]}, console)
    _unset(data, console)
    for profile, scenes in data["profiles"].items():
        word = word_of(data["name"], profile)
        _heading(f"Profile {profile}" + (f" ({word})" if word else ""), console)
        _settings(scenes, console)
    if data["settable"]:
        _heading("What can be set (--set NAME=VALUE)", console)
        table = grid("setting", "must be")
        for setting in data["settable"]:
            table.add_row(setting["name"], Text(setting["must_be"]))
        print_table(table, console)
    if data["effects"]:
        versions = ", ".join(dict.fromkeys(told["version"] for told in data["effects"]))
        _heading(f"What each setting does ({data['name']} {versions})", console)
        print_table(effects_table(data["effects"]), console)
    _heading("Quirks, and how the adapter handles them", console)
    table = grid("quirk", "what the adapter does", "source")
    table.columns[0].no_wrap = False
    for quirk in data["quirks"]:
        table.add_row(*(Text(quirk[name]) for name in ("what", "what_we_do", "source")))
    print_table(table, console)
    for version, why in data["known_bad_versions"].items():
        console.print(Text(f"version {version} is known to be bad: {why}"))
    if data["measured"]:
        _heading("Measured without this adapter, and by our cases", console)
        table = grid("measured", "", "our case, test or reason")
        table.columns[0].no_wrap = False
        for fact in data["measured"]:
            table.add_row(Text(fact["says"]), Text(fact["standing"]), Text(_said_of(fact)))
        print_table(table, console)
        if any(fact["chosen"] or fact["because"] for fact in data["measured"]):
            console.print(Text(AFTERWARDS))


def effects_table(rows: Sequence[Plain]) -> Table:
    """What settings do, where it shows, and whether the engine reads them back."""
    table = grid("setting", "read back", "what it does")
    for told in rows:
        case = f"; {shown_by(told)}" if told["scene"] else ""
        table.add_row(told["setting"], told["read"], Text(f"{verdict_of(told)}{case}"))
    return table


def verdict_of(told: Plain) -> str:
    """What a setting does, and why; ``only with`` goes on with the names of others."""
    between = " " if told["verdict"] == "only with" else ": "
    return between.join(filter(None, (told["verdict"], told["because"])))


def shown_by(told: Plain) -> str:
    """The case of a setting: its value, scene and metric, and that without and with it."""
    if not told["scene"]:
        return ""
    before, after = told["before"] or "-", told["after"] or "-"
    changed = "no change" if before == after != "-" else f"{before} -> {after}"
    return f"{told['metric']} of {told['scene']} {changed} at {told['value']}"


def _unset(data: Plain, console: Console) -> None:
    """Print the documented behaviour of an engine without any settings, and the measured one."""
    rows = data["unset"]
    if not rows:
        return
    _heading("When nothing is set", console)
    table = grid("", "documented", "measured", "where it is documented")
    table.columns[0].no_wrap = False
    for row in rows:
        table.add_row(*(Text(text) for text in (row["what"], row["documented"], unset_text(row), row["source"])))
    print_table(table, console)
    for reason in dict.fromkeys(row["reason"] for row in rows if row["reason"]):
        console.print(Text(f"-: not measured: {reason}"))


def unset_text(row: Plain) -> str:
    """The measured behaviour without any settings, with a note if it differs from the documented one."""
    value = row["measured"]
    if value is None:
        return "-"
    said = "never" if math.isinf(value) else number(0.0 if row["agrees"] and row["value"] == 0.0 else value)
    return said if row["agrees"] is not False else f"{said}, differs"


def _said_of(fact: Plain) -> str:
    """The case that shows a fact with its number, the test that asserts it, or the reason for neither."""
    chosen = f"; chosen afterwards: {fact['chosen']}" if fact["chosen"] else ""
    if not fact["scene"]:
        return str(fact["test"] or fact["unasked"]) + chosen
    params = "".join(f" {name}={value:g}" for name, value in fact["params"].items())
    params += "".join(f" {name}={setting_text(value)}" for name, value in fact["settings"].items())
    sweeps = f" {fact['iterations']} iterations" if fact["iterations"] else ""
    cell = f"{fact['profile']} {fact['scene']} {fact['dimension']}-D{params}, step {format_dt(fact['dt'])} s{sweeps}"
    off = "off by " if fact["error"] else ""
    because = f"; {fact['because']}" if fact["because"] else ""
    return f"{cell}: {fact['metric']} {off}{number(fact['found'])}{because}{chosen}"


def _settings(scenes: Mapping[str, Sequence[Plain]], console: Console) -> None:
    """Print one line per setting and value; scenes are listed below, once for all settings with the same ones.

    Fifty names in a column would leave no room in 80 characters for the reason.
    """
    found: dict[tuple[str, str, str], list[str]] = {}
    for scene, settings in scenes.items():
        for s in settings:
            found.setdefault((s["name"], setting_text(s["value"]), s["because"]), []).append(scene)
    marks: dict[tuple[str, ...], str] = {tuple(scenes): ""}
    table = grid("setting", "value", "in", "because")
    for (name, value, because), where in found.items():
        mark = marks.setdefault(tuple(where), f"({len(marks)})")
        table.add_row(name, Text(value), mark, Text(because))
    print_table(table, console)
    for names, mark in marks.items():
        if mark:
            others = tuple(scene for scene in scenes if scene not in names)
            # The smaller set of scenes is listed, and only once.
            but = f"all but {marks.get(others, ', '.join(others))}"
            named = but if len(others) < len(names) else ", ".join(names)
            console.print(Padding(Text(f"{mark} {named}"), (0, 0, 0, 2)))


def _pairs(data: Plain, console: Console) -> None:
    table = Table.grid(padding=(0, 2, 0, 0))
    for name, value in data.items():
        text = number(value) if isinstance(value, float) else setting_text(value)
        table.add_row(Text(str(name)), Text(text))
    console.print(table)


def health(data: Plain, console: Console) -> None:
    """Print the results of ``doctor``."""
    machine = data["machine"]
    _pairs({**machine, "commit": data["commit"] or "-", "executable": data["executable"]}, console)
    console.print()
    table = grid("engine", "version", "status")
    for engine in data["engines"]:
        table.add_row(engine["name"], engine["version"] or "-", Text(engine["reason"] or engine["status"]))
    print_table(table, console)
    console.print()
    table = grid("package", "folder")
    for name, folder in data["packages"].items():
        table.add_row(name, Text(folder))
    cache = data["kernel_cache"]
    table.add_row(
        "compiled kernels", Text(f"{cache['folder'] or 'no folder is writable, so every process compiles them'}")
    )
    print_table(table, console)
    console.print()
    problems = data["problems"]
    console.print(Text("no problem found" if not problems else f"{len(problems)} problem(s)", style="bold"))
    for problem in problems:
        console.print(Text(f"  {problem}"))
    for name, trace in data["traces"].items():
        console.print(Text(f"\ntraceback of {name}", style="bold"))
        for line in trace:
            console.print(Text(f"  {line}"))


def sensitivity(
    entries: Sequence[Plain], receipts_alone: Mapping[str, Sequence[str]], blind: Sequence[BlindSpot], console: Console
) -> None:
    """Print the smallest planted fault that each check or property check notices; unnoticed faults with reasons."""
    table = grid("check or property check", "smallest fault that it notices")
    for entry in entries:
        seen = [f"{fault} {size}" for fault, size in entry.items() if fault != "name" and size]
        table.add_row(Text(entry["name"]), Text(", ".join(seen) or "none of these faults"))
    print_table(table, console)
    for fault, receipts in receipts_alone.items():
        console.print(
            Text(f"{fault}: no check of these scenes notices it; the property checks {', '.join(receipts)} do")
        )
    for line in (
        "Faults: values are set or reported 10, 1 or 0.1 % too low. For added motion 1 % means 0.01 m/s: drift along",
        "x, climb upwards, tremble to and fro along x at every step, pull towards the middle of all bodies; for twirl",
        "0.01 rad/s. flicker: impulses 1 % too high and too low in turn. lasting: 1 % of the last impulses is still",
        "reported where nothing touches any more. uneven: impulses on the last body are 1 % too weak, on others less,",
        "by their order. damping: speeds lose 1 % in a second. late: contacts act 0.01 s late. order: the last body",
        "is 1 % too slow, those before it less, by their order.",
    ):
        console.print(Text(line))
    _heading("Main quantities that depend on a parameter and do not notice 1 % of it,", console)
    for line in (
        "because it changes them by less than the error of one time step, which their tolerance must allow. Noticed",
        "from: the fault that would change them by as much. At steps of: the longest, by halves, at which the same",
        "check notices 1 %, planted and run there. Noticed by: other checks of the scene that notice 1 %.",
    ):
        console.print(Text(line))
    table = grid("quantity", "1 % of", "changes it by", "error of a step", "noticed from", "at steps of", "noticed by")
    for spot in blind:
        at = "no step" if spot.seen_at is None else f"1/{round(1.0 / spot.seen_at)} s"
        numbers = (number(spot.moved), number(spot.allowed), f"{spot.seen_from:.1f} %", at)
        others = ", ".join(spot.seen_by) or "property checks only"
        table.add_row(*(Text(cell) for cell in (f"{spot.scene}/{spot.metric}", spot.fault, *numbers, others)))
    print_table(table, console)
