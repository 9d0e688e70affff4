"""``residuals``: violations of the laws of contact by the impulses that engines report."""

from __future__ import annotations

import json

import click
from rich.table import Table
from rich.text import Text

from reports.command.group import AS_JSON, main
from reports.command.posing import cells_of
from reports.command.selection import Cases, selection
from reports.terminal import print_roles, terminal
from reports.wording import number, reproduce
from validation.questions.residuals import LAWS, Residuals, ask
from validation.running.apart import Apart
from validation.running.plan import slots


@main.command("residuals", epilog="Example: crosscheck residuals pinch")
@selection
@AS_JSON
def residuals(cases: Cases, as_json: bool) -> None:
    """Check reported contact forces against the laws of contact.

    Runs one case of each scene. Numbers are relative to the largest impulse of the run (work: also to the fastest
    contact). For an engine that reports no forces, the reason is printed instead.
    """
    cells = cells_of(slots(cases.request()), bool(cases.param or cases.iterations or cases.dt))
    progress = terminal(stderr=True)
    found: list[Residuals] = []
    with Apart() as apart:
        for slot in cells:
            progress.print(f"{slot.engine}/{slot.profile} {slot.scene} {slot.dimension}-D", style="dim", markup=False)
            found.append(ask(slot, apart))
    if as_json:
        plain = [
            {"slot": each.slot.as_dict(), "command": reproduce(each.slot.as_dict()), "contacts": each.contacts,
             "refused": each.refused, "residuals": {name: list(value) for name, value in each.values.items()}}
            for each in found
        ]  # fmt: skip
        click.echo(json.dumps(plain, indent=1))
        return
    _show(found)


def _show(found: list[Residuals]) -> None:
    console = terminal()
    for scene in dict.fromkeys((each.slot.scene, each.slot.dimension) for each in found):
        own = [each for each in found if (each.slot.scene, each.slot.dimension) == scene]
        params = own[0].slot.params_text()
        console.print()
        console.print(Text(f"{scene[0]} {scene[1]}-D{' ' + params if params else ''}", style="bold"))
        table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 2))
        for heading in ("engine, profile", *LAWS):
            table.add_column(heading)
        refusals = []
        for each in own:
            who = f"{each.slot.engine}/{each.slot.profile}"
            reasons = dict.fromkeys(reason for value, reason in each.values.values() if value is None)
            if reasons:
                refusals.append(f"{who}: {'; '.join(reasons)}")
            else:
                table.add_row(who, *(number(value, 2) for value, _ in each.values.values()))
        if table.row_count:
            console.print(table, highlight=False)
        for line in refusals:
            console.print(Text(f"  {line}", style="dim"))
    console.print()
    print_roles(((each.slot.engine, each.slot.profile) for each in found), console)
    laws = "; ".join(f"{name}: {law}" for name, law in LAWS.items())
    console.print(
        Text(f"Largest violation of each law, as a share of the largest impulse or work: {laws}", style="dim")
    )
