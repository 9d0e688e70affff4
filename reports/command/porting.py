"""``ports``: whether the ports of an engine move bodies as the engine does."""

from __future__ import annotations

import json
import sys
from dataclasses import replace

import click

from adapters import registry
from reports import ports as rendering
from reports.command import statuses
from reports.command.completion import engine_names
from reports.command.group import AS_JSON, main
from reports.command.posing import cells_of
from reports.command.selection import Cases, gathered
from reports.stages import say
from reports.terminal import terminal
from validation.releases import driving
from validation.releases.choosing import ported, ports_of
from validation.releases.kept import keep, row_of
from validation.running.plan import slots


@main.command(epilog="Example: crosscheck ports ENGINE PORT --scene stack")
@click.argument("original", metavar="ENGINE", shell_complete=engine_names)
@click.argument("named", metavar="[PORT]...", nargs=-1, shell_complete=engine_names)
@click.option("--scene", "scenes", multiple=True, metavar="S", help="Only this scene (repeat for more).")
@click.option("--release", "version", default="", metavar="V", help="A release that all have; else the newest.")
@gathered("cases", Cases, only=("param", "profile", "dim", "dt"))
@click.option("--keep", "kept", is_flag=True, help="Enter the results into the table of the engine's folder.")
@AS_JSON
def ports(
    original: str,
    named: tuple[str, ...],
    version: str,
    cases: Cases,
    kept: bool,
    as_json: bool,
) -> None:
    """Compare an engine with its ports, scene by scene.

    Runs one case of each scene. All run in one environment, in the same release. A difference beyond round-off is run
    again with other settings in both, until one makes it go. Exits with 1 if none does, with 4 if a case failed.
    """
    console = terminal(stderr=True)
    known = named or tuple(ports_of(original))
    chosen = ported(original, known, version)
    shared = {profile for name in known if (engine := registry.adapter(name)) for profile in engine.profiles}
    request = replace(cases, engine=(original,)).request()
    wanted = cells_of(slots(request), bool(cases.param or cases.dt))
    highest = {slot.scene: slot.dimension for slot in sorted(wanted, key=lambda slot: slot.dimension)}
    wanted = [s for s in wanted if s.profile in shared and (cases.dim or s.dimension == highest[s.scene])]
    rows = []
    for told in driving.compare(chosen, known, wanted, lambda line: say(console, line)):
        rows.append(row_of(told, chosen.version))
        if kept:
            keep(original, told, chosen.version)
        line = f"{told.port} {rendering.case_of(rows[-1])}: {rendering.sentence(rows[-1])}"
        click.echo(line, err=as_json)
    if as_json:
        click.echo(json.dumps({"release": chosen.version, "cases": rows}, indent=1))
    else:
        for port in known:
            click.echo(rendering.counts(rows, port))
    alarming = any(row["verdict"] == "differs" and not row["proof"] for row in rows)
    sys.exit(statuses.verdict(alarming, not any(row["verdict"] == "failed" for row in rows)))
