"""``releases`` and ``bisect``: since which release an engine gives its results."""

from __future__ import annotations

import json
import re
import shlex
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

import click
from rich.console import Console

from adapters.plain import one_line
from adapters.scene import SceneError
from reports import releases as rendering
from reports.command import statuses
from reports.command.completion import engine_names, scene_names
from reports.command.files import folder
from reports.command.group import AS_JSON, OUT, main
from reports.command.selection import JOBS, SECONDS, Cases, Command, gathered
from reports.progress import progress_on
from reports.stages import say
from reports.terminal import terminal
from reports.wording import plural, profile_words
from validation.cells import Observation, Slot, format_dt, plane_of, slot_from_dict
from validation.posed import resolve
from validation.records.store import Store
from validation.releases import environments, history
from validation.releases.bisection import Unchanged, bisect, is_meant
from validation.releases.choosing import Release, chosen
from validation.releases.driving import Effort, drive, planned, time
from validation.releases.floors import moved_starts
from validation.workers import TIMEOUT


def _cells(command: Command) -> Command:
    """Options of both commands that select cases and say how they run: ``cases`` and ``effort``."""
    for wrap in (
        gathered("cases", Cases, only=("param", "profile", "set", "dim", "dt", "iterations")),
        click.option("--jobs", default=0, type=JOBS, help="Worker processes; 0: one per core."),
        click.option("--timeout", default=TIMEOUT, show_default=True, type=SECONDS, help="Time limit per case [s]."),
        click.option("--fresh", is_flag=True, help="Run again what OUT has already."),
        click.option(
            "--try", "anyway", is_flag=True, help="Also releases outside the range that the adapter supports."
        ),
        gathered("effort", Effort),
    )[::-1]:
        command = wrap(command)
    return command


@main.command(epilog="Example: crosscheck releases ENGINE latest stack")
@click.argument("named", metavar="ENGINE", required=False, shell_complete=engine_names)
@click.argument("which", metavar="A..B|LIST|latest", required=False)
@click.argument("scenes", nargs=-1, shell_complete=scene_names)
@_cells
@click.option(
    "--times", is_flag=True, help="Also time one case of each scene, relative to a Python loop on the same machine."
)
@click.option("--environments", "listed", is_flag=True, help="List and check the environments of releases.")
@click.option("--remove", metavar="NAME", help="With --environments: remove this one, or 'all'.")
@click.option("--markdown", is_flag=True, help="Print Markdown on stdout.")
@AS_JSON
@OUT
def releases(
    named: str | None,
    which: str | None,
    cases: Cases,
    effort: Effort,
    times: bool,
    listed: bool,
    remove: str | None,
    markdown: bool,
    as_json: bool,
    out: Path,
) -> None:
    """Run scenes on releases of an engine.

    A..B is a range; a LIST such as 3.0.0,3.1.6, or latest, works as well. Prints what changed, and in which release.
    Each release gets its own environment, once; results that are in OUT already are not run again. Exits with 4 if a
    release cannot be installed, imported or run here; the table says why.
    """
    if listed or remove:
        _environments(remove, as_json)
        return
    if named is None or which is None:
        raise SceneError("releases: name an engine and its releases, such as: crosscheck releases ENGINE 3.0.0..3.2.7")
    asked, wanted, console = _prepared(named, which, cases, effort, out)
    store = Store(out)
    results = [_drive(store, release, wanted, effort, console, times) for release in asked]
    results = _with_floors(store, asked, wanted, results, effort, console)
    store.close()
    moved = history.steps(results)
    if as_json:
        click.echo(rendering.as_json(results, moved))
    elif markdown:
        click.echo(rendering.as_markdown(results, moved), nl=False)
    else:
        rendering.as_text(results, moved, terminal(), out)
    sys.exit(statuses.INCOMPLETE if any(each.reason for each in results) else statuses.FINE)


def _prepared(
    engine: str, which: str, cases: Cases, effort: Effort, out: Path, least: int = 1
) -> tuple[list[Release], list[Slot], Console]:
    """Releases and cases; raises for a wrong call before anything is installed."""
    console = terminal(stderr=True)
    request = replace(cases, engine=(engine,), standard=True).request()
    folder(out)
    asked = chosen(engine, which)
    if len(asked) < least:
        raise SceneError(f"releases: {which} is one release; a comparison needs two")
    wanted = planned(asked, request, effort, lambda line: say(console, line))
    if not wanted:
        raise SceneError("scenes: no case fits this selection")
    return asked, wanted, console


def _drive(
    store: Store, release: Release, wanted: Sequence[Slot], effort: Effort, console: Console, times: bool = False
) -> history.Told:
    """Run one release with a progress line, time it if wanted, and judge it."""
    with progress_on(console) as progress:
        task = progress.add_task(release.name, total=len(wanted))

        def seen(observation: Observation) -> None:
            progress.update(task, advance=1, description=f"{release.name} {observation.slot.scene}")

        try:
            found = drive(store, release, wanted, effort, lambda line: say(console, line), seen)
            if times:
                progress.update(task, description=f"{release.name} timing")
                time(store, release, found, effort, lambda line: say(console, line))
        except KeyboardInterrupt:
            say(console, "interrupted: finished cases are kept; the same command resumes")
            raise
    taken = history.times(store, release.engine, release.version)
    result = history.told_by(release.engine, release.version, found, taken)
    say(console, f"{release.name}: {result.reason or plural(len(found), 'case')}")
    return result


def _with_floors(
    store: Store,
    asked: Sequence[Release],
    wanted: Sequence[Slot],
    results: Sequence[history.Told],
    effort: Effort,
    console: Console,
) -> list[history.Told]:
    """Results of releases, with the noise floors of all values that changed between them."""
    starts, out = moved_starts(results), []
    again = replace(effort, fresh=False)  # results of a moment ago are stored
    for release, before in zip(asked, results, strict=True):
        if release.version in starts:
            before = _drive(store, release, [*wanted, *starts[release.version]], again, console)
        out.append(before)
    return out


@main.command("bisect", epilog="Example: crosscheck bisect ENGINE A..B stack --check drift")
@click.argument("named", metavar="ENGINE", shell_complete=engine_names)
@click.argument("which", metavar="A..B")
@click.argument("scene", shell_complete=scene_names)
@click.option("--check", required=True, metavar="CHECK", help="Quantity: apex[1], or apex for all of them.")
@click.option("--all", "every", is_flag=True, help="Run every release, to see whether it is the only change.")
@_cells
@AS_JSON
@OUT
def bisect_(
    named: str, which: str, scene: str, check: str, every: bool, cases: Cases, effort: Effort, as_json: bool, out: Path
) -> None:
    """Find the release that changed a check.

    Searches the releases A to B of ENGINE for the one in which CHECK of SCENE begins or ceases to fail, or changes by
    more than its noise. If there are several cases, it follows the one with the largest change. It runs log2(n) of n
    releases, and none whose results are in OUT already. Exits with 4 if A or B cannot run.
    """
    asked, wanted, console = _prepared(named, which, replace(cases, scenes=(scene,)), effort, out, 2)
    known = dict.fromkeys(metric for slot in wanted for metric in _metrics(slot))
    if not any(is_meant(metric, check) for metric in known):
        kinds = ", ".join(dict.fromkeys(re.sub(r"\[\d+\]", "", metric) for metric in known))
        raise SceneError(f"check: {scene} has no check {one_line(check, 60)!r}; it has {kinds}")
    store = Store(out)
    try:
        found = bisect(
            len(asked), wanted, check, lambda i, cells: _drive(store, asked[i], cells, effort, console), every
        )
    finally:
        store.close()
    versions = [release.version for release in asked]
    if isinstance(found, Unchanged):
        _say_unchanged(found, versions, check, scene, as_json)
    commands = _commands(named, versions[found.before], versions[found.after], slot_from_dict(found.change.slot), out)
    plain = rendering.found_as_plain(found, named, versions, commands)
    click.echo(json.dumps(plain, indent=1) if as_json else rendering.found_as_text(plain))


def _metrics(slot: Slot) -> list[str]:
    """Names of all checks of a case, and of those that judge several cases together."""
    canonical = resolve(slot.scene)
    scene = canonical.scene(slot.dimension, dict(slot.params))
    checks = (*canonical.checks(scene, slot.dt), *plane_of(canonical, scene, slot.dt))
    return [*(check.metric for check in checks), *(study.name for study in canonical.studies)]


def _say_unchanged(found: Unchanged, versions: Sequence[str], check: str, scene: str, as_json: bool) -> NoReturn:
    """Print that nothing was found, and exit."""
    same = f"{check} of {scene} is the same in {versions[0]} and {versions[-1]}"
    said = found.reason.replace("release 0 ", f"{versions[0]} ").replace(
        f"release {len(versions) - 1} ", f"{versions[-1]} "
    )
    click.echo(json.dumps({"found": None, "reason": said or same}) if as_json else said or same)
    sys.exit(statuses.INCOMPLETE if found.reason else statuses.FINE)


def _commands(engine: str, before: str, after: str, slot: Slot, out: Path) -> list[str]:
    """Commands that reproduce the two cases: run both, compare both."""
    name, _, _ = slot.scene.rpartition("@")
    parts = ["crosscheck", "releases", engine, f"{before},{after}", name or slot.scene, *profile_words(slot)]
    parts += ["--dim", str(slot.dimension), "--dt", format_dt(slot.dt)]
    if slot.iterations is not None:
        parts += ["--iterations", str(slot.iterations)]
    for key, value in slot.params:
        parts += ["--param", f"{key}={value!r}"]
    where = [] if out == Path("crosscheck-out") else ["--out", str(out)]
    compare = ["crosscheck", "compare", f"{engine}=={before}", f"{engine}=={after}"]
    return [shlex.join([*parts, "--fresh", *where]), shlex.join([*compare, *where])]


def _environments(remove: str | None, as_json: bool) -> None:
    """List, check and remove environments."""
    found = environments.found()
    if remove:
        going = [each for each in found if remove in ("all", each.name)]
        if not going and remove != "all":
            raise SceneError(f"remove: there is no environment {remove!r}; releases --environments lists them")
        for each in going:
            environments.remove(each)
            click.echo(f"removed {each.name}", err=True)
        found = environments.found()
    data = [
        {
            "name": each.name,
            "python": each.receipt.get("python", ""),
            "packages": each.receipt.get("packages", {}),
            "files": each.receipt.get("files", ""),
            "bytes": environments.size(each),
            "wrong": environments.check(each),
        }
        for each in found
    ]
    if as_json:
        click.echo(json.dumps(data, indent=1))
    else:
        for row in data:
            state = row["wrong"] or "as installed"
            click.echo(f"{row['name']}  Python {row['python']}  {row['bytes'] / 2**20:.0f} MiB  {state}")
        click.echo(f"{plural(len(data), 'environment')} in {environments.folder()}")
    sys.exit(statuses.ALARM if any(row["wrong"] for row in data) else statuses.FINE)
