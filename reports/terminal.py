"""The console of every command, which prints text unchanged.

Names of scenes, reasons and settings come from files and plugins. Rich would read ``[red]`` in them as a style,
``[/]`` as an error and ``:ok:`` as a picture. Only our own code sets styles, as `rich.text.Text` or ``style=``.
"""

from __future__ import annotations

from collections.abc import Iterable

from rich.console import Console
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from reports.wording import roles_line

#: Below this width [columns] a table has a paragraph for each row, since columns would be a few letters wide.
NARROW = 60


def terminal(stderr: bool = False, width: int | None = None) -> Console:
    """Return a console on stdout, or on stderr, that reads no markup and no emoji codes in any text."""
    return Console(stderr=stderr, width=width, markup=False, emoji=False)


def print_table(table: Table, console: Console, highlight: bool | None = None) -> None:
    """Print a table; where its columns do not fit, each row as its first cell and a paragraph of the others."""
    if console.width >= NARROW:
        console.print(table, highlight=highlight)
        return
    _, *headings = (f"{column.header}: " if column.header else "" for column in table.columns)
    for first, *others in zip(*(column.cells for column in table.columns), strict=True):
        console.print(Text(str(first), style="bold"))
        told = (f"{name}{cell}" for name, cell in zip(headings, map(str, others), strict=True) if cell not in ("", "-"))
        console.print(Padding(Text("; ".join(told)), (0, 0, 0, 2)))


def print_roles(columns: Iterable[tuple[str, str]], console: Console) -> None:
    """Print the roles of the profiles of ``(engine, profile)``, once below tables that name them."""
    if line := roles_line(columns):
        console.print(Text(line, style="dim"), highlight=False)
