"""``report``: one self-contained page about a run."""

from __future__ import annotations

from pathlib import Path

import click

from adapters.engine import EngineError
from reports.command.group import OUT, main


@main.command()
@click.argument("run", default="latest")
@click.option("-o", "--output", type=Path, help="File to write; OUT/report.html by default.")
@OUT
def report(run: str, output: Path | None, out: Path) -> None:
    """Write the report of RUN (the latest by default) as one HTML file that needs no network.

    The last bench in the same store, if there is one, becomes its part about speed.
    """
    try:
        from reports.page import load_source, render
    except ImportError as error:
        raise EngineError(f"report: {error.name} is missing; pip install 'contact-crosscheck[report]'") from None
    source = load_source(out, run)
    path = output or out / "report.html"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(render(source), encoding="utf-8")
    click.echo(str(path))
