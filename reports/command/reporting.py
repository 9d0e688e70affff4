"""``report``, ``dashboard``, ``bundle``: a page about one run, a page about all runs, and a run as one archive."""

from __future__ import annotations

import json
import webbrowser
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import click

from adapters import stages
from adapters.engine import EngineError
from adapters.extras import install
from adapters.whole import write
from reports.command.files import FILE, writable
from reports.command.group import AS_JSON, OUT, main
from reports.command.showing import which
from reports.stages import say, stage
from reports.terminal import terminal
from reports.wording import missing_text
from validation.records.store import MissingError, Store


@main.command(epilog="Example: crosscheck report --open")
@click.argument("run", default="latest")
@click.option("-o", "--output", type=FILE, help="File to write; OUT/report.html by default.")
@click.option("--open", "show", is_flag=True, help="Also open it in the browser.")
@AS_JSON
@OUT
def report(run: str, output: Path | None, show: bool, as_json: bool, out: Path) -> None:
    """Write the report of a run as one HTML page.

    RUN is an id that `list runs` prints; the latest by default. The page needs no network. The last benchmark in the
    same folder, if there is one, becomes its part about speed.
    """
    path = writable(output or out / "report.html", "output")
    with extra("report"):
        from reports.page import load_source, render
    with stage(terminal(stderr=True), "report"):
        source = load_source(out, run)
        path.parent.mkdir(parents=True, exist_ok=True)
        write(path, render(source))
    if not as_json:
        store = Store(out, create=False)
        click.echo(which(store, source.run, run).line("report", out), err=True)
        store.close()
    if source.missing:
        said = missing_text(source.missing, len(source.run.plan))
        click.echo(f"crosscheck: run {source.run.id}: {said}", err=True)
    click.echo(
        json.dumps({"run": source.run.id, "path": str(path), "missing": source.missing}) if as_json else str(path)
    )
    if show and not webbrowser.open(path.resolve().as_uri()):
        click.echo(f"crosscheck: open: no browser was found; the report is {path}", err=True)


@main.command(epilog="Example: crosscheck dashboard")
@click.option("-o", "--output", type=FILE, help="File to write; OUT/dashboard.html by default.")
@click.option("--open", "show", is_flag=True, help="Also open it in the browser.")
@AS_JSON
@OUT
def dashboard(output: Path | None, show: bool, as_json: bool, out: Path) -> None:
    """Write one HTML page about all runs and releases.

    The page shows errors, times, and where they moved, for all runs in OUT. Each run is judged once; its
    verdicts are stored beside the results.
    """
    path = writable(output or out / "dashboard.html", "output")
    with extra("dashboard"):
        from reports.dashboard import events, render
        from reports.dashboard.series import panels
    store, console = Store(out, create=False), terminal(stderr=True)
    with stage(console, "dashboard"):
        found = panels(store, out, lambda line: say(console, line))
        reports = {run.id: f"report-{run.id}.html" for run in store.runs() if (out / f"report-{run.id}.html").is_file()}
        made = _made([run.commit for run in store.runs() if run.plan])
        store.close()
        if not found:
            raise MissingError(f"out: {out} has no finished run of a scene to show")
        shown = sum(len(panel.points) > 1 for panel in found)
        path.parent.mkdir(parents=True, exist_ok=True)
        write(path, render(found, f"{shown} series{made}", reports))
    moved = sum(len(events(panel)) for panel in found)
    result = {"path": str(path), "panels": len(found), "moved": moved}
    click.echo(json.dumps(result) if as_json else str(path))
    if show and not webbrowser.open(path.resolve().as_uri()):
        click.echo(f"crosscheck: open: no browser was found; the dashboard is {path}", err=True)


def _made(commits: Sequence[str]) -> str:
    """Commits of the shown runs, oldest first; empty outside a checkout."""
    known = list(dict.fromkeys(filter(None, commits)))
    if len(known) <= 1:
        return "".join(f" of commit {name}" for name in known)
    return f" of {len(known)} commits, {known[0]} to {known[-1]}"


@main.command(epilog="Example: crosscheck bundle")
@click.argument("run", default="latest")
@click.option("-o", "--output", type=FILE, help="File to write; OUT/crosscheck-<run>.zip by default.")
@AS_JSON
@OUT
def bundle(run: str, output: Path | None, as_json: bool, out: Path) -> None:
    """Write a run as one archive.

    RUN is an id that `list runs` prints; the latest by default. The archive has raw results, environment, report,
    citation and checksums.
    """
    with extra("bundle"):
        from reports.bundle import write_bundle
    store = Store(out, create=False)
    path = writable(output or out / f"crosscheck-{store.run(run).id}.zip", "output")
    store.close()
    names = write_bundle(out, run, path)
    click.echo(json.dumps({"path": str(path), "files": names}) if as_json else str(path))


@contextmanager
def extra(command: str, name: str = "report") -> Iterator[None]:
    """Turn a missing library of an extra into an error that says how to install it."""
    try:
        with stages.stage(stages.START):
            yield
    except ImportError as error:
        raise EngineError(f"{command}: {error.name} is missing; {install(name)}") from None
