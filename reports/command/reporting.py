"""``report`` and ``bundle``: one self-contained page about a run, and everything about it as one archive."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from adapters.engine import EngineError
from reports.command.group import OUT, main
from validation.store import Store


@main.command()
@click.argument("run", default="latest")
@click.option("-o", "--output", type=Path, help="File to write; OUT/report.html by default.")
@OUT
def report(run: str, output: Path | None, out: Path) -> None:
    """Write the report of RUN (the latest by default) as one HTML file that needs no network.

    The last bench in the same store, if there is one, becomes its part about speed.
    """
    with _extra("report"):
        from reports.page import load_source, render
    source = load_source(out, run)
    path = output or out / "report.html"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(render(source), encoding="utf-8")
    click.echo(str(path))


@main.command()
@click.argument("run", default="latest")
@click.option("-o", "--output", type=Path, help="File to write; OUT/crosscheck-<run>.zip by default.")
@OUT
def bundle(run: str, output: Path | None, out: Path) -> None:
    """Write RUN (the latest by default) as one archive: raw rows, environment, report, citation, checksums."""
    with _extra("bundle"):
        from reports.bundle import write_bundle
    store = Store(out, create=False)
    path = output or out / f"crosscheck-{store.run(run).id}.zip"
    store.close()
    write_bundle(out, run, path)
    click.echo(str(path))


@contextmanager
def _extra(command: str) -> Iterator[None]:
    """Say how to get what is missing: the page's libraries are an extra."""
    try:
        yield
    except ImportError as error:
        raise EngineError(f"{command}: {error.name} is missing; pip install 'contact-crosscheck[report]'") from None
