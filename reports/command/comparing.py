"""``compare``: changes between two runs."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from reports import changes as rendering
from reports.command import statuses
from reports.command.group import AS_JSON, OUT, main
from validation.judging.comparison import FAIL_ON, by_seriousness, compare_rows, compare_speeds, failing


@main.command(epilog="Example: crosscheck compare latest crosscheck-out/rows.jsonl")
@click.argument("before", metavar="A")
@click.argument("after", metavar="B")
@click.option("--only-regressed", is_flag=True, help="Show only what got worse.")
@click.option("--only-changed", is_flag=True, help="Leave out checks that only one side has.")
@click.option(
    "--fail-on", type=click.Choice(list(FAIL_ON)), default="regressions", show_default=True,
    help="Which changes make the command exit with 1.",
)  # fmt: skip
@click.option("--markdown", is_flag=True, help="Print Markdown, fit for a pull-request comment.")
@AS_JSON
@OUT
def compare(
    before: str,
    after: str,
    only_regressed: bool,
    only_changed: bool,
    fail_on: str,
    markdown: bool,
    as_json: bool,
    out: Path,
) -> None:
    """Show what changed between two runs.

    Prints changes from A to B: checks that began or ceased to fail, then errors, then speed. A and B are ids that `list
    runs` prints, or latest; releases that were run into OUT (myengine==3.2.7); results folders (FOLDER or FOLDER:RUN);
    or .jsonl files that `run` wrote. latest~1 is the run before the latest.

    Exits with 1 if something got worse (--fail-on), with 4 if no check is in both.
    """
    a, b = rendering.load_side(before, out), rendering.load_side(after, out)
    changes = sorted(compare_rows(a.rows, b.rows) + compare_speeds(a.ratios, b.ratios), key=by_seriousness)
    if only_regressed:
        changes = [change for change in changes if change.regressed]
    if only_changed:
        changes = [change for change in changes if change.kind not in rendering.ONE_SIDED]
    render = rendering.as_json if as_json else rendering.as_markdown if markdown else rendering.as_text
    click.echo(render(changes, a, b), nl=False)
    sys.exit(statuses.verdict(failing(changes, fail_on), rendering.in_both(a, b) > 0))
