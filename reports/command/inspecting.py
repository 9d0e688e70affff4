"""``list``, ``describe``, ``doctor``, ``check-adapter``: what there is, and whether it is sound."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from adapters import registry
from adapters.engine import EngineError
from adapters.scene import SceneError
from reports import listing, tables
from reports.command.completion import engine_names, names_of_either
from reports.command.group import AS_JSON, OUT, main
from reports.terminal import terminal
from validation.detection import Seen, detection, lines, only_by_receipts
from validation.store import Store


@main.command("list")
@click.argument("what", type=click.Choice(["scenes", "engines", "checks", "runs"]))
@click.option("--sensitivity", is_flag=True, help="Of checks: what each can see, by planted faults of three sizes.")
@click.option("--engine", metavar="E", help="Engine that gets the faults; our solver by default.")
@click.option("--profile", metavar="P", help="Its profile that passes; by default the one that promises a solution.")
@AS_JSON
@OUT
def list_(what: str, sensitivity: bool, engine: str | None, profile: str | None, as_json: bool, out: Path) -> None:
    """List scenes, engines, checks, or the runs in OUT.

    With --sensitivity: the smallest planted fault (10, 1, 0.1 %) of each parameter that makes a check fail or breaks a
    receipt; takes a minute.
    """
    data: list[Any]
    seen: list[Seen] = []
    if sensitivity:
        if what != "checks":
            raise SceneError("sensitivity: checks have one, not " + what)
        engine = engine or registry.solver()
        profile = profile or registry.profile_of(engine, "solution")
        if profile is None:
            raise EngineError(f"profile: {engine} has none that promises a solution; name one with --profile")
        seen = detection(registry.load(engine), profile, 2)
        data = list(lines(seen))
    elif what == "runs":
        store = Store(out, create=False)
        names = ("id", "date", "commit", "title", "finished")
        data = [{name: getattr(run, name) for name in names} for run in store.runs()]
    else:
        data = {"scenes": listing.scenes, "engines": listing.engines, "checks": listing.checks}[what]()
    if as_json:
        click.echo(json.dumps(data, indent=1))
    elif sensitivity:
        tables.sensitivity(data, only_by_receipts(seen), terminal())
    else:
        tables.listed(what, data, terminal())


@main.command()
@click.argument("name", shell_complete=names_of_either)
@AS_JSON
def describe(name: str, as_json: bool) -> None:
    """Describe a scene or an engine: law, parameters, checks with reasons; profiles, settings, quirks."""
    data = listing.describe(name)
    if as_json:
        click.echo(json.dumps(data, indent=1, default=str))
    else:
        tables.described(data, terminal())


@main.command()
@AS_JSON
def doctor(as_json: bool) -> None:
    """Check the installation: engines, versions, CPU, caches, and whose packages are on this path."""
    data = listing.doctor()
    if as_json:
        click.echo(json.dumps(data, indent=1))
    else:
        tables.health(data, terminal())
    sys.exit(1 if any("is not ours" in problem for problem in data["problems"]) else 0)


@main.command("check-adapter")
@click.argument("name", shell_complete=engine_names)
@AS_JSON
def check_adapter_(name: str, as_json: bool) -> None:
    """Run the conformance checks on the adapter of an engine; exits with 1 if it breaks one."""
    from adapters.conformance import check_adapter

    findings = check_adapter(registry.load(name))
    if as_json:
        click.echo(json.dumps([asdict(finding) for finding in findings], indent=1, default=str))
    else:
        for finding in findings:
            click.echo(str(finding))
    sys.exit(0 if all(finding.holds for finding in findings) else 1)
