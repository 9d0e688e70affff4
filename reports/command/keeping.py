"""``merge`` and ``prune``: join results of several machines, delete old ones."""

from __future__ import annotations

import json
from pathlib import Path

import click

from adapters.scene import SceneError
from reports.brief import Kept
from reports.command.files import FOLDER
from reports.command.group import AS_JSON, OUT, main
from reports.command.selection import DAYS, gathered
from reports.wording import plural
from validation.records.keeping import Rules, doomed, prune
from validation.records.keeping import merge as merge_stores
from validation.records.store import Store


@main.command(epilog="Example: crosscheck merge other-out")
@click.argument("sources", metavar="FOLDER...", nargs=-1, required=True, type=FOLDER)
@AS_JSON
@OUT
def merge(sources: tuple[Path, ...], as_json: bool, out: Path) -> None:
    """Add the runs of other folders to this one.

    FOLDERs have results of `run`. Runs that OUT has already are skipped.
    """
    merged = {}
    for source in sources:
        Store(source, create=False).close()  # all must exist before the first is merged
    store = Store(out)
    try:
        for source in sources:
            merged[str(source)] = vars(merge_stores(store, source))
    finally:
        store.close()
    if as_json:
        click.echo(json.dumps(merged))
        return
    for name, found in merged.items():
        line = f"{name}: {plural(found['runs'], 'new run')}, {found['known']} there already, "
        line += plural(found["rows"], "result")
        click.echo(line + (f"; {plural(found['differing'], 'result')} differ, ours stay" if found["differing"] else ""))


@main.command("prune", epilog="Example: crosscheck prune --keep 50 --dry-run")
@click.option("--keep", type=click.IntRange(1), help="Keep this many of the runs with the same title, the newest.")
@click.option("--older-than", "days", type=DAYS, metavar="DAYS", help="Delete runs older than this.")
@click.option("--unfinished", is_flag=True, help="Delete interrupted runs, and damaged ones.")
@click.option("--recordings", is_flag=True, help="Delete replays, except of the newest run of each title.")
@click.option("--dry-run", is_flag=True, help="Only print what would be deleted.")
@AS_JSON
@OUT
@gathered("rules", Rules)
def prune_(rules: Rules, dry_run: bool, as_json: bool, out: Path) -> None:
    """Delete old runs.

    The options say which. The newest finished run of each title always stays in OUT.
    """
    if rules == Rules():
        raise SceneError("prune: needs --keep, --older-than, --unfinished or --recordings")
    store = Store(out, create=False, write=not dry_run)
    try:
        if dry_run:
            going = [*doomed(store.runs(), rules), *(store.damaged().values() if rules.unfinished else ())]
        else:
            going = prune(store, rules)
            kept = Kept(store.path.parent)
            kept.forget(run.id for run in going)
            kept.close()
    finally:
        store.close()
    if as_json:
        click.echo(json.dumps({"runs": [run.id for run in going], "dry_run": dry_run}))
        return
    for run in going:
        click.echo(f"{run.id}  {run.title}")
    click.echo(f"{plural(len(going), 'run')} {'would be deleted' if dry_run else 'deleted'}")
