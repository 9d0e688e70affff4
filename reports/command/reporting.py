"""``report`` and ``bundle``: one self-contained page about a run, and everything about it as one archive."""

from __future__ import annotations

import json
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from adapters.engine import EngineError
from reports.command.files import FILE, writable
from reports.command.group import AS_JSON, OUT, main
from reports.stages import stage
from reports.terminal import terminal
from reports.wording import missing_text
from validation.store import Store


@main.command()
@click.argument("run", default="latest")
@click.option("-o", "--output", type=FILE, help="File to write; OUT/report.html by default.")
@click.option("--open", "show", is_flag=True, help="Also open it in the browser.")
@AS_JSON
@OUT
def report(run: str, output: Path | None, show: bool, as_json: bool, out: Path) -> None:
    """Write the report of RUN (the latest by default) as one HTML file that needs no network.

    The last bench in the same store, if there is one, becomes its part about speed.
    """
    path = writable(output or out / "report.html", "output")
    with _extra("report"):
        from reports.page import load_source, render
    with stage(terminal(stderr=True), "report"):
        source = load_source(out, run)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(render(source), encoding="utf-8")
    if source.missing:
        said = missing_text(source.missing, len(source.run.plan))
        click.echo(f"crosscheck: run {source.run.id}: {said}", err=True)
    click.echo(
        json.dumps({"run": source.run.id, "path": str(path), "missing": source.missing}) if as_json else str(path)
    )
    if show and not webbrowser.open(path.resolve().as_uri()):
        click.echo(f"crosscheck: open: no browser was found; the report is {path}", err=True)


@main.command()
@click.argument("run", default="latest")
@click.option("-o", "--output", type=FILE, help="File to write; OUT/crosscheck-<run>.zip by default.")
@AS_JSON
@OUT
def bundle(run: str, output: Path | None, as_json: bool, out: Path) -> None:
    """Write RUN (the latest by default) as one archive: raw rows, environment, report, citation, checksums."""
    with _extra("bundle"):
        from reports.bundle import write_bundle
    store = Store(out, create=False)
    path = writable(output or out / f"crosscheck-{store.run(run).id}.zip", "output")
    store.close()
    names = write_bundle(out, run, path)
    click.echo(json.dumps({"path": str(path), "files": names}) if as_json else str(path))


@contextmanager
def _extra(command: str) -> Iterator[None]:
    """Say how to get what is missing: the page's libraries are an extra."""
    try:
        yield
    except ImportError as error:
        raise EngineError(f"{command}: {error.name} is missing; pip install 'contact-crosscheck[report]'") from None
