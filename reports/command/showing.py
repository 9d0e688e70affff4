"""``show``, ``findings``, ``explain``: results of a stored run, from the overview to a single check."""

from __future__ import annotations

import difflib
import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.table import Table
from rich.text import Text

from adapters.registry import is_ranked
from adapters.scene import SceneError
from adapters.settings.own import given, suffix_of
from reports import brief
from reports.answers import Costs, answers, choices
from reports.command.completion import engine_names, row_ids, scene_names
from reports.command.group import AS_JSON, OUT, main
from reports.command.proving import proof_of, prove_and_show
from reports.command.selection import SET
from reports.findings import Family, families, grouped, has_answer, severity
from reports.fixes import ROLES, Change, changes, fix, how_measured, profile_costs, told_cure
from reports.matrix import matrix_of
from reports.summary import show as show_summary
from reports.tables import title_of
from reports.terminal import print_roles, print_table, terminal
from reports.wording import (
    LABELS,
    at,
    called,
    first_of,
    mark_of,
    measured,
    missing_text,
    number,
    params_text,
    plural,
    profiles_called,
    quantity,
    reproduce,
    row_id,
    word_of,
)
from validation.bench import reading
from validation.cells import Observation
from validation.judging.rows import is_alarming
from validation.metrics import OUT_OF_PLANE
from validation.posed import is_file
from validation.questions.nulls import skill_of
from validation.records.store import HELPERS, Run, Store
from validation.releases.bisection import is_meant
from validation.running.plan import Request, slots

Plain = Mapping[str, Any]
#: Text for the ratio of error to tolerance if there is no tolerance.
NO_RATIO = "-"
#: Width of an explanation as text [characters], as a cell of a notebook shows it.
TEXT = 100


@dataclass(frozen=True)
class Which:
    """The run of a folder that is shown.

    Parameters
    ----------
    title
        Scenes and options of the run.
    latest
        Whether it was chosen as the latest.
    others
        Number of other runs in the folder.
    larger
        The latest other run with more cases; empty if there is none.
    """

    run: str
    title: str
    cases: int
    latest: bool
    others: int
    larger: str

    @property
    def named(self) -> str:
        """Id of the run for commands; empty for the latest."""
        return "" if self.latest else self.run

    def line(self, command: str, out: Path) -> str:
        """The shown run, and the commands that show another one."""
        text = f"Run {self.run}{', the latest' if self.latest and self.others else ''}: {self.title}"
        text += f" ({plural(self.cases, 'case')})."
        if self.latest and self.larger:
            text += f" A larger run: crosscheck {command} {self.larger}{at(out)}."
        if self.others:
            text += f" All runs: crosscheck list runs{at(out)}."
        return text


def which(store: Store, chosen: Run, asked: str) -> Which:
    """The run of a store that ``asked`` has chosen."""
    others = [run for run in store.runs() if run.id != chosen.id]
    larger = [run.id for run in others if len(run.plan) > len(chosen.plan) and not run.title.startswith(HELPERS)]
    title = title_of(chosen.title)
    return Which(chosen.id, title, len(chosen.plan), asked == "latest", len(others), "".join(larger[-1:]))


@dataclass(frozen=True)
class Kept:
    """Judged rows of one run, and its number of cases, read at one time."""

    run: str
    rows: Sequence[Plain]
    planned: int
    missing: int
    which: Which

    def counted(self) -> dict[str, Any]:
        """Id of the run, number of planned cases, and number of those without an observation."""
        return {"run": self.run, "planned": self.planned, "missing": self.missing}

    def say_missing(self) -> None:
        """Print the number of planned cases without an observation on stderr, if there are any."""
        if self.missing:
            click.echo(f"crosscheck: run {self.run}: {missing_text(self.missing, self.planned)}", err=True)


@contextmanager
def _opened(out: Path) -> Iterator[Store]:
    store = Store(out, create=False)
    try:
        yield store
    finally:
        store.close()


def load(store: Store, run: str) -> Kept:
    """Judged rows of a run.

    Raises
    ------
    StoreError
        If there is no such run.
    """
    chosen = store.run(run)
    rows = [row.as_dict() for row in brief.judged(store, chosen).rows]
    return Kept(chosen.id, rows, len(chosen.plan), store.missing(chosen), which(store, chosen, run))


@main.command(epilog="Example: crosscheck show --all")
@click.argument("run", default="latest")
@click.option("--all", "every", is_flag=True, help="Every scene, also where there are so many that groups are shown.")
@AS_JSON
@OUT
def show(run: str, every: bool, as_json: bool, out: Path) -> None:
    """Show the verdicts of a run again.

    Shows what `run` showed: the matrix, the best engines, what is wrong and what fixes it. RUN is an id that `list
    runs` prints; the latest by default. The first line says which run is shown.
    """
    with _opened(out) as store:
        kept, timed = load(store, run), reading.bench_runs(store)
        costs = brief.costs(store, timed[-1]) if timed else {}
    if as_json:
        click.echo(json.dumps(_as_plain(kept.rows, costs) | kept.counted(), indent=1))
        return
    console = terminal()
    console.print(Text(kept.which.line("show", out), style="dim"))
    show_summary(kept.rows, console, costs, every=every, out=out, run=kept.which.named)
    kept.say_missing()
    report = out / "report.html"
    if report.is_file():
        console.print(Text(f"  report: {report}"), soft_wrap=True)


def _as_plain(rows: Sequence[Plain], costs: Costs) -> dict[str, Any]:
    found = matrix_of(rows)
    fields = [
        {"scene": scene, "dimension": dimension, "engine": engine, "profile": profile, "swept": swept,
         "mark": field.mark, "judged": field.judged, "missed": field.missed}
        for swept, every in ((False, found.fields), (True, found.swept))
        for ((scene, dimension), (engine, profile)), field in every.items()
    ]  # fmt: skip
    return {
        "matrix": fields,
        "choices": [choice.as_dict() for choice in choices(rows, costs)],
        "answers": [answer.as_dict() for answer in answers(rows)],
    }


@main.command(epilog="Example: crosscheck findings --scene bounce")
@click.argument("run", default="latest")
@click.option("--engine", multiple=True, metavar="E", shell_complete=engine_names, help="Only this engine.")
@click.option("--scene", multiple=True, metavar="S", shell_complete=scene_names, help="Only this scene.")
@click.option("--profile", multiple=True, metavar="P", help="Only this profile.")
@click.option(
    "--new", is_flag=True, help="Only unexpected results, which make `run` exit with 1: new, changed, INVALID, crashed."
)
@click.option("--all", "every", is_flag=True, help="Every failed check, not the worst of each cause.")
@click.option(
    "--prove", metavar="ID", help="Run the experiments that test the stated cause ID (or 'all'); needs no RUN."
)
@AS_JSON
@OUT
def findings(
    run: str, every: bool, as_json: bool, out: Path, new: bool, prove: str | None, **wanted: Sequence[str]
) -> None:
    """List the checks of a run that fail, by cause.

    RUN is an id that `list runs` prints; the latest by default. The first line says which run is shown. Failures of
    one engine, profile, scene and kind of quantity are one line, which shows the worst; the most serious come first.
    With --prove, the mechanism that a cause names is switched off: checks that fail because of it must then pass, and
    must still fail when another suspect is switched off instead. Exits with 1 if an experiment contradicts its cause.
    """
    if prove:
        prove_and_show(prove, wanted["engine"], as_json)
        return
    with _opened(out) as store:
        kept = load(store, run)
    rows = kept.rows
    kept.say_missing()
    wanted["scene"] = [scene_of(told, {row["scene"] for row in rows}) for told in wanted["scene"]]
    wanted["profile"] = profiles_called(wanted["profile"], {row["engine"] for row in rows})
    for name, asked in wanted.items():
        there = list(dict.fromkeys(row[name] for row in rows))
        if absent := [one for one in asked if one not in there]:
            close = difflib.get_close_matches(absent[0], there, n=1)
            hint = f", did you mean {close[0]!r}?" if close else f", but of {first_of(there)}"
            raise SceneError(f"--{name}: this run has no check of {absent[0]!r}{hint}")
    rows = [row for row in rows if all(row[name] in asked for name, asked in wanted.items() if asked)]
    if new:
        rows = [row for row in rows if is_alarming(row)]
    if not as_json:
        terminal().print(Text(kept.which.line("findings", out), style="dim"))
    if every:
        chosen = [row for _, group in grouped(rows) for row in group]
        if as_json:
            click.echo(json.dumps([{**row, "id": row_id(row)} for row in chosen], indent=1))
        else:
            _print_rows(chosen, terminal())
        return
    found = families(rows)
    if as_json:
        click.echo(json.dumps([family.as_dict() for family in found], indent=1))
        return
    _print_families(
        found, terminal(), "no unexpected result" if new else "no such check fails", at(out, kept.which.named)
    )


def _grid(*headings: str) -> Table:
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for heading in headings:
        table.add_column(heading, overflow="fold")
    return table


def _print_families(found: Sequence[Family], console: Console, nothing: str, place: str) -> None:
    if not found:
        console.print(nothing)
        return
    names = called(family.scene for family in found)
    for mark in dict.fromkeys(family.mark for family in found):
        own = [family for family in found if family.mark == mark]
        console.print()
        count = sum(len(family.rows) for family in own)
        console.print(Text(f"{LABELS[mark]}: {plural(count, 'check')}, {plural(len(own), 'line')}", style="bold"))
        table = _grid("id", "engine, scene", "worst check", "checks")
        table.columns[0].no_wrap = True
        for family in own:
            who = f"{family.engine}/{family.profile} {names[family.scene]}"
            table.add_row(row_id(family.worst), who, _worst(family.worst), str(len(family.rows)))
        print_table(table, console, highlight=False)
    console.print()
    print_roles(((family.engine, family.profile) for family in found), console)
    said = f"crosscheck explain ID{place} says everything about a check; --all lists every check."
    console.print(Text(said), style="dim")


def _worst(row: Plain) -> str:
    if not has_answer(row):
        return f"{row['dimension']}-D {row['metric']}: {row['reason']}"
    asked = "" if row["iterations"] is None else f"at {row['iterations']} iterations"
    where = " ".join(text for text in (f"{row['dimension']}-D", params_text(row["slot"]["params"]), asked) if text)
    right = "" if row["truth"] is None else f" instead of {number(row['truth'])}"
    allowed = "" if row["tolerance"] is None else f" +- {number(row['tolerance'], 2)}"
    unit = "" if row["unit"] == "1" or not right else f" {row['unit']}"
    return f"{row['metric']} {measured(row)}{right}{allowed}{unit} ({where})"


def _ratio(row: Plain) -> str:
    return number(severity(row), 3) if row["error"] is not None and row["tolerance"] else NO_RATIO


def _print_rows(rows: Sequence[Plain], console: Console) -> None:
    table, names = _grid("id", "status", "engine, scene", "check"), called(row["scene"] for row in rows)
    for row in rows:
        who = f"{row['engine']}/{row['profile']} {names[row['scene']]}"
        table.add_row(row_id(row), LABELS[mark_of(row)], who, _worst(row))
    print_table(table, console, highlight=False)
    print_roles(((row["engine"], row["profile"]) for row in rows), console)


@main.command(epilog="Example: crosscheck explain ENGINE/default/bounce")
@click.argument("row", metavar="CHECK", shell_complete=row_ids)
@click.argument("run", default="latest")
@click.option("--run", "named", hidden=True)
@SET
@AS_JSON
@OUT
def explain(row: str, run: str, named: str | None, set: tuple[str, ...], as_json: bool, out: Path) -> None:
    """Explain one check: values, truth, tolerance, cause and fix.

    CHECK is an id that `findings` prints (or its first digits), or ENGINE/PROFILE/SCENE[/METRIC], which means the
    check with the largest error there; SCENE may be a scene file, by its path or its name. With --set, PROFILE has
    these settings of your own. RUN is an id that `list runs` prints; the latest by default.
    """
    asked, row = row, _with_settings(row, set)
    with _opened(out) as store:
        kept = load(store, named or run)
        rows = kept.rows
        try:
            found = find_row(rows, row)
        except SceneError:
            _check_own(asked, set, {row["scene"] for row in rows})
            raise
        observations = store.observations(store.run(kept.run), found["engine"], found["scene"])
    better, paste, said, differing = _cure(rows, observations, found)
    again = reproduce(found["slot"]) + at(out)
    if as_json:
        plain = [
            {"name": c.name, "before": c.before, "after": c.after, "because": c.because, "role": c.role}
            for c in differing
        ]
        worth, against = skill_of(found)
        cure = {"profile": better, "changes": plain, "paste": paste}
        click.echo(
            json.dumps(
                {
                    **found,
                    "id": row_id(found),
                    "command": again,
                    "cure": cure,
                    "skill": worth,
                    "skill_against": against,
                },
                indent=1,
            )
        )
        return
    _print_explanation(found, _out_of_plane_text(rows, found), better, (paste, said), differing, again, terminal())


def explanation(rows: Sequence[Plain], observations: Sequence[Observation], row: Plain, again: str) -> str:
    """Output of `explain` for a row, as text; ``again`` is the command or sentence about running it again."""
    better, paste, said, differing = _cure(rows, observations, row)
    console = terminal(width=TEXT)
    with console.capture() as captured:
        _print_explanation(row, _out_of_plane_text(rows, row), better, (paste, said), differing, again, console)
    return "\n".join(line.rstrip() for line in captured.get().splitlines())


def _with_settings(row: str, sets: Sequence[str]) -> str:
    """The row's name, in which the profile has these settings.

    Raises
    ------
    SceneError
        If ``row`` is an id, whose settings are fixed.
    """
    engine, slash, rest = row.partition("/")
    profile, more, where = rest.partition("/")
    if sets and not (slash and more):
        raise SceneError(f"set: changes a profile; name the check as ENGINE/PROFILE/SCENE, not {row!r}")
    return f"{engine}{slash}{profile}{suffix_of(given(sets))}{more}{where}"


def _check_own(row: str, sets: Sequence[str], scenes: Collection[str]) -> None:
    """Refuse settings that the engine of a row does not have or take, as `run` does.

    Raises
    ------
    EngineError
        For the first of them, with its name.
    """
    named = named_by(row, scenes) if sets else {}
    if named.get("scene") in scenes:
        slots(Request((named["scene"],), (named["engine"],), (named["profile"],), sets=given(sets)))


def scene_of(told: str, scenes: Collection[str]) -> str:
    """Scene of a run by its name.

    A scene file may also be named by its path without the hash, or by its file name, with or without the ending.

    Raises
    ------
    SceneError
        If several files of the run have that name.
    """
    if told in scenes:
        return told
    paths = {scene.rpartition("@")[0]: scene for scene in scenes if is_file(scene)}
    named = [path for path in sorted(paths) if told in (Path(path).name, Path(path).stem)]
    if told not in paths and len(named) > 1:
        raise SceneError(f"scene: this run has several files called {told!r}: {', '.join(named)}")
    return paths.get(told, paths[named[0]] if named else told)


def named_by(name: str, scenes: Collection[str]) -> dict[str, str]:
    """Parts of ENGINE/PROFILE/SCENE[/METRIC]; the path of a scene file may contain slashes."""
    engine, profile, *rest = name.split("/", 2)
    found = {"engine": engine, "profile": profiles_called([profile], [engine])[0]}
    if not rest:
        return found
    ends = [k for k, letter in enumerate(rest[0]) if letter == "/"] + [len(rest[0])]
    end = next((k for k in reversed(ends) if scene_of(rest[0][:k], scenes) in scenes), ends[0])
    found["scene"] = scene_of(rest[0][:end], scenes)
    return found | ({"metric": rest[0][end + 1 :]} if rest[0][end + 1 :] else {})


def find_row(rows: Sequence[Plain], name: str) -> Plain:
    """Return the row ``name``.

    Raises
    ------
    SceneError
        If there is none, or if ids of several rows begin with it.
    """
    if "/" in name:
        named = named_by(name, {row["scene"] for row in rows})
        metric = named.pop("metric", "")
        fits = [row for row in rows if all(row[key] == value for key, value in named.items())]
        if metric:
            fits = [row for row in fits if is_meant(row["metric"], metric)]
        if not fits:
            raise SceneError(f"check: this run has no check {name!r}{_near(rows, name)}")
        return max(fits, key=severity)
    found = [row for row in rows if row_id(row).startswith(name.lower())]
    if len(found) != 1:
        many = f"the ids of {len(found)} checks begin" if found else "no id of this run begins"
        raise SceneError(f"check: {many} with {name!r}; crosscheck findings lists ids; or name it ENGINE/PROFILE/SCENE")
    return found[0]


def _near(rows: Sequence[Plain], name: str) -> str:
    """The existing name that is most like one that does not exist; without one, where names are listed."""
    names = [f"{row['engine']}/{row['profile']}/{row['scene']}" for row in rows]
    known = [*names, *(f"{who}/{row['metric']}" for who, row in zip(names, rows, strict=True))]
    close = difflib.get_close_matches(name, dict.fromkeys(known), n=1)
    return f", did you mean {close[0]!r}?" if close else "; crosscheck findings lists what fails"


def _cure(rows: Sequence[Plain], observations: Sequence[Observation], row: Plain) -> tuple[str, str, str, list[Change]]:
    """A profile of the same engine that passes this row, lines to paste, their description, and its changes.

    Unranked profiles are no fixes: they differ in more than settings, so lines to paste would not reproduce them.
    """
    if mark_of(row) == "pass" or row["outcome"] == "refused":  # a profile without a certificate is no fix of one
        return "", "", "", []
    same = ("engine", "scene", "dimension", "params", "dt", "metric")
    good = [
        other["profile"] for other in rows
        if other["physics"] == "pass" and other["iterations"] is None and all(other[n] == row[n] for n in same)
        and is_ranked(row["engine"], other["profile"])
    ]  # fmt: skip
    better = good[0] if good and good[0] != row["profile"] else ""
    where = (observations, row["scene"], row["dimension"], row["engine"], row["profile"], better)
    params = row["slot"]["params"]
    paste, said = fix(row, observations, better)
    return better, paste, said, changes(*where, params) if better else []


def skill_text(row: Plain) -> str:
    """``0.98 (1: exact; 0: as wrong as the trivial answer "did nothing")``; empty without a skill."""
    value, said = skill_of(row)
    if value is None:
        return ""
    return f'{number(value, 4)} (1: exact; 0: as wrong as the trivial answer "{said}")'


def _why(change: Change) -> str:
    return f"{change.because}; {change.role}" if change.role else change.because


def _out_of_plane_text(rows: Sequence[Plain], row: Plain) -> str:
    """Distance by which the case of a row leaves its plane, if it does: the row sees only the motion in the plane."""
    if row["metric"] == OUT_OF_PLANE:
        return ""
    for other in rows:
        if other["cells"] == row["cells"] and other["metric"] == OUT_OF_PLANE and other["physics"] == "fail":
            return f"the scene leaves its plane by {measured(other, 3)}; this check sees only the motion in the plane"
    return ""


def _measured_text(row: Plain) -> str:
    if row["value"] is None:
        return f"no value: {row['reason']}"
    text = f"{row['metric']} = {measured(row, 8)}"
    why = "no certificate" if row["outcome"] == "refused" else "the measurement contradicts itself"
    return text if has_answer(row) else f"{text}; not judged: {why}"


def _print_explanation(
    row: Plain,
    beside: str,
    better: str,
    fixed: tuple[str, str],
    differing: Sequence[Change],
    again: str,
    console: Console,
) -> None:
    iterations = "the profile's own" if row["iterations"] is None else str(row["iterations"])
    asked = ", ".join(filter(None, (f"{row['scene']} {row['dimension']}-D", params_text(row["params"]))))
    table = _grid("", "")
    table.show_header = False
    table.columns[0].no_wrap = True
    off = f" = {_ratio(row)} tolerances" if severity(row) else ""
    plain = row["outcome"] in ("refused", "invalid") or row["physics"] == "pass"
    skill, why = skill_text(row), "reason" if plain else "cause"
    role = f" ({word})" if (word := word_of(row["engine"], row["profile"])) else ""
    lines = [
        ("check", f"{row_id(row)}, {LABELS[mark_of(row)]}"),
        ("engine", f"{row['engine']} {row['engine_version']}, profile {row['profile']}{role}"),
        ("case", f"{asked}; step {number(row['dt'], 4)} s, iterations: {iterations}"),
        ("measured", _measured_text(row)),
        ("truth", f"{quantity(row['truth'], row['unit'], 8)}   ({row['source']})"),
        ("error", f"{quantity(row['error'], row['unit'], 4)}{off}" if row["error"] is not None else "-"),
        ("tolerance", f"{quantity(row['tolerance'], row['unit'], 4)}: {row['because']}"),
        *([("skill", skill)] if skill else []),
        *([(why, row["reason"])] if row["reason"] else []),
        *([("off plane", beside)] if beside else []),
    ]
    if better:
        lines.append(("fix", f"profile {better} passes this check. It changes:"))
        idle = [c for c in differing if c.role == ROLES[""]]
        lines += [("", f"{c.name} {c.before} -> {c.after}: {_why(c)}") for c in differing if c not in idle]
        if idle:
            lines.append(("", "not needed: " + ", ".join(f"{c.name} {c.before} -> {c.after}" for c in idle)))
        lines.append(("", how_measured(row["engine"], row["scene"], row["dimension"], row["profile"], better)))
        lines += [("", cost) for cost in profile_costs([(row["engine"], better)])]
    recorded = told_cure(row) if mark_of(row) != "pass" else ""
    lines += [("smallest fix" if better else "fix", recorded)] if recorded else []
    lines += [("test cause", proof)] if mark_of(row) == "known" and (proof := proof_of(row)) else []
    lines.append(("run again", again))
    for name, text in lines:
        table.add_row(Text(name, style="bold"), Text(text))
    console.print(table)
    paste, said = fixed
    if said:
        console.print()
        console.print(Text(said, style="bold"))
        console.print(Text(paste), soft_wrap=True)
