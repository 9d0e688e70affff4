"""The group of all subcommands, and what they share: wrong calls become one line and exit code 2."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from adapters.engine import EngineError
from adapters.scene import SceneError
from validation.findings import FindingsError
from validation.store import StoreError

#: Everything a wrong call can raise; the command turns each into one line and exit code 2.
WRONG_CALL = (SceneError, EngineError, StoreError, FindingsError)
OUT = click.option("--out", default="crosscheck-out", show_default=True, type=Path, help="Folder for results.")
AS_JSON = click.option("--json", "as_json", is_flag=True, help="Print JSON on stdout.")


class _Group(click.Group):
    """Prints what a wrong call raises as one line and exits with 2."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except WRONG_CALL as error:
            click.echo(f"crosscheck: {error}", err=True)
            ctx.exit(2)
        except KeyboardInterrupt:
            ctx.exit(130)


@click.group(cls=_Group, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="contact-crosscheck", prog_name="crosscheck")
def main() -> None:
    """Run the same contact scenes on physics engines, and say how wrong each one is, at what cost."""
