"""Summary of a sweep for the terminal: number of cases that pass every check, by engine; details are in its table."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Table
from rich.text import Text

from reports.tables import grid
from reports.wording import called

if TYPE_CHECKING:
    import pandas as pd


def counted(found: pd.DataFrame) -> Table:
    """Number of cases of every scene, engine and profile that can run it, and of those that pass all judged checks."""
    names = called(found["scene"])
    shown = grid("engine/profile", "scene", "cases", "pass", "fail", "no result")
    for (engine, profile, scene, dimension), cells in found.groupby(
        ["engine", "profile", "scene", "dimension"], sort=False
    ):
        if (cells["outcome"] == "unsupported").all():
            continue
        answered = cells[cells["outcome"].isin(["ok", "diverged"])]
        passing = int(answered["passes"].sum())
        words = (f"{engine}/{profile}", f"{names[str(scene)]} {dimension}-D", str(len(cells)), str(passing),
                 str(len(answered) - passing), str(len(cells) - len(answered)))  # fmt: skip
        shown.add_row(*map(Text, words))
    return shown
