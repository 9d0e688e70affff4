"""``schema``: the JSON Schema of scene files, for editors and programs."""

from __future__ import annotations

import json
from pathlib import Path

import click

from adapters.whole import write
from reports.command.files import FILE, writable
from reports.command.group import main


@main.command(epilog="Example: crosscheck schema")
@click.option("-o", "--output", type=FILE, help="File to write instead of the terminal.")
def schema(output: Path | None) -> None:
    """Print the JSON Schema of scene files.

    An editor can use it to complete and check scene files. `format` in a scene file is the version of the schema.
    """
    from validation.files.scene_files import json_schema

    text = json.dumps(json_schema(), indent=2, sort_keys=True) + "\n"
    if output is None:
        click.echo(text, nl=False)
    else:
        write(writable(output, "output"), text)
