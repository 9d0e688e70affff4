"""``list``, ``describe``, ``doctor``, ``check-adapter``: what is available, and tests of adapters."""

from __future__ import annotations

import json
import math
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any, NoReturn

import click

from adapters import registry
from adapters.engine import EngineError
from adapters.engine_folder import NUMBERS, folder_of
from adapters.scene import SceneError
from reports import listing, tables
from reports.command.completion import engine_names, names_of_either
from reports.command.files import FOLDER, folder
from reports.command.group import AS_JSON, OUT, main
from reports.terminal import terminal
from reports.wording import profiles_called
from validation.settings import kept_numbers


@main.command("list", epilog="Example: crosscheck list scenes")
@click.argument("what", type=click.Choice(["scenes", "suites", "engines", "checks", "runs"]))
@click.option("--reasons", is_flag=True, help="With checks: the reason of each tolerance.")
@click.option("--sensitivity", is_flag=True, help="With checks: the smallest planted fault that each notices.")
@click.option(
    "--engine", metavar="E", help="With --sensitivity: engine that gets the faults; the reference solver by default."
)
@click.option("--profile", metavar="P", help="With --sensitivity: its profile; by default the exact one.")
@AS_JSON
@OUT
def list_(
    what: str, reasons: bool, sensitivity: bool, engine: str | None, profile: str | None, as_json: bool, out: Path
) -> None:
    """List scenes, suites, engines, checks or runs.

    `list runs` prints the ids that other commands take as RUN. With --sensitivity, prints the smallest planted fault
    (10, 1 or 0.1 %) of each parameter that makes a check or a property check fail; this takes three minutes. Scenes
    that the reference solver cannot run go to the first tuned engine that can.
    """
    data: list[Any]
    for name, given in (("reasons", reasons), ("sensitivity", sensitivity)):
        if given and what != "checks":
            raise SceneError(f"{name}: belongs to checks, not to {what}")
    for name, text in (("engine", engine), ("profile", profile)):
        if text is not None and not sensitivity:
            raise SceneError(f"{name}: belongs to --sensitivity")
    if sensitivity:
        from validation.questions import detection

        named, engine = engine is not None, engine or registry.solver()
        registry.load(engine)
        profile = profiles_called([profile], [engine])[0] if profile else registry.profile_of(engine, "solution")
        if profile is None:
            raise EngineError(f"profile: {engine} has no exact profile; name one with --profile")
        best = [(name, registry.profile_of(name, "tuned")) for name in registry.usual() if not named and name != engine]
        others = [(registry.load(name), tuned) for name, tuned in best if tuned and registry.find(name).engine]
        found = detection.detection(registry.load(engine), profile, 2, others=others)
        data = list(detection.lines(found.seen))
    elif what == "runs":
        from validation.records.store import Store

        store = Store(out, create=False)
        names = ("id", "date", "commit", "title", "finished")
        data = [{name: getattr(run, name) for name in names} for run in store.runs()]
    else:
        data = {
            "scenes": listing.scenes,
            "suites": listing.suites,
            "engines": listing.engines,
            "checks": listing.checks,
        }[what]()
    if as_json:
        click.echo(json.dumps(data, indent=1))
    elif sensitivity:
        tables.sensitivity(data, detection.only_by_receipts(found.seen), found.blind, terminal())
    else:
        tables.listed(what, data, terminal(), reasons)


@main.command(epilog="Example: crosscheck describe bounce")
@click.argument("name", shell_complete=names_of_either)
@click.option("--measure", is_flag=True, help="Of an engine, also measure what it does when nothing is set [seconds].")
@click.option("--keep", is_flag=True, help="Of an engine, measure and write numbers.csv of its folder.")
@AS_JSON
def describe(name: str, measure: bool, keep: bool, as_json: bool) -> None:
    """Describe a scene or an engine.

    For a scene: figure, law, parameters, checks with the reasons of their tolerances. For an engine: profiles, settings
    with reasons, quirks, and what it does when nothing is set: as it is documented, and as it is measured on request.
    """
    if measure and name not in registry.names():
        raise EngineError(f"measure: {name} is no engine")
    if keep:
        own = folder_of(name)
        if own is None:
            raise EngineError(f"keep: {name} is no engine with a folder of its own for {NUMBERS}")
        kept_numbers.write(list(kept_numbers.measure_all(name)), own / NUMBERS)
    data = listing.describe(name, measure)
    if as_json:
        click.echo(json.dumps(data, indent=1, default=str))
    else:
        tables.described(data, terminal())


@main.command(epilog="Example: crosscheck doctor")
@AS_JSON
def doctor(as_json: bool) -> None:
    """Check the installation.

    Prints engines, versions, CPU, caches, and other packages that have the names of ours.
    """
    data = listing.doctor()
    if as_json:
        click.echo(json.dumps(data, indent=1))
    else:
        tables.health(data, terminal())
    sys.exit(1 if any("is not ours" in problem for problem in data["problems"]) else 0)


@main.command("check-adapter", epilog="Example: crosscheck check-adapter myengine")
@click.argument("name", shell_complete=engine_names, required=False)
@click.option(
    "--self-test",
    "testing",
    is_flag=True,
    help="Instead, plant faults in a toy engine and see whether each is noticed.",
)
@AS_JSON
def check_adapter_(name: str | None, testing: bool, as_json: bool) -> None:
    """Test an adapter for conformance.

    Exits with 1 if a check fails. A check is refused, not passed, if the engine refuses its scenes. Expected failures
    that the adapter lists are shown as such, and as unexpected passes if they hold.
    """
    if testing == (name is not None):
        raise click.UsageError("name an engine, or give --self-test")
    if testing:
        _self_test(as_json)
    from adapters.conformance import check_adapter

    findings = check_adapter(registry.load(str(name)))
    if as_json:
        click.echo(json.dumps([{**asdict(each), "holds": each.holds} for each in findings], indent=1))
    else:
        for finding in findings:
            click.echo(str(finding))
    sys.exit(0 if all(finding.holds for finding in findings) else 1)


def _self_test(as_json: bool) -> NoReturn:
    """Print each planted fault when it is tried: its size, the check that must notice it, and whether it did."""
    from adapters.conformance.self_test import self_test

    rows = []
    for row in self_test():
        rows.append({**asdict(row), "size": None if math.isnan(row.size) else row.size})
        if not as_json:
            size = "" if math.isnan(row.size) else f"{row.size:g} {row.unit}"
            click.echo(f"{'ok  ' if row.caught else 'FAIL'}  {row.fault}{f', {size}' if size else ''}: {row.check}")
    missed = sum(not row["caught"] for row in rows)
    if as_json:
        click.echo(json.dumps(rows, indent=1))
    else:
        click.echo(f"{len(rows) - missed} of {len(rows)} as they must be; the first is the toy without a fault")
    sys.exit(1 if missed else 0)


@main.command("new-adapter", epilog="Example: crosscheck new-adapter myengine")
@click.argument("name")
@click.option("--into", type=FOLDER, default=Path("."), help="Folder to write to.")
@click.option("--pipe", is_flag=True, help="The engine is a program, in any language, that speaks JSON lines.")
@AS_JSON
def new_adapter(name: str, into: Path, pipe: bool, as_json: bool) -> None:
    """Write a package for an engine of your own.

    It works as it is, and its test runs the conformance checks. With --pipe the engine is a process; PROTOCOL.txt in
    the package says on one page what it answers.
    """
    from adapters.new_adapter import write_package

    written = [str(path) for path in write_package(name, folder(into, "into"), pipe)]
    if as_json:
        click.echo(json.dumps({"name": name, "files": written}, indent=1))
        return
    for path in written:
        click.echo(f"wrote {path}")
    click.echo(f"next: pip install -e {into / name}, and crosscheck check-adapter {name}")
