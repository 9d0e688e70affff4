"""The console of every command, which prints text unchanged.

Names of scenes, reasons and settings come from files and plugins. Rich would read ``[red]`` in them as a style,
``[/]`` as an error and ``:ok:`` as a picture. Only our own code sets styles, as `rich.text.Text` or ``style=``.
"""

from __future__ import annotations

from collections.abc import Iterable

from rich.console import Console
from rich.text import Text

from reports.wording import roles_line


def terminal(stderr: bool = False, width: int | None = None) -> Console:
    """Return a console on stdout, or on stderr, that reads no markup and no emoji codes in any text."""
    return Console(stderr=stderr, width=width, markup=False, emoji=False)


def print_roles(columns: Iterable[tuple[str, str]], console: Console) -> None:
    """Print the roles of the profiles of ``(engine, profile)``, once below tables that name them."""
    if line := roles_line(columns):
        console.print(Text(line, style="dim"), highlight=False)
