"""The kept table of fixes: ``cures.csv`` in an engine's folder, by scene *and dimension*.

A fix measured in 2-D is not claimed for 3-D.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from functools import cache
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from adapters import whole
from adapters.engine_folder import CURES, PANELS, rows_of
from adapters.registry import find
from validation.canonical import Params
from validation.fixes.panel import Changes, Cost, Panel
from validation.running.plan import QUICK_DT


@dataclass(frozen=True)
class Shown:
    """A check as shipped and with the fix: its case, truth, tolerance and values; None where there is no value."""

    metric: str
    unit: str
    params: Params
    truth: float
    tolerance: float
    before: float | None
    after: float | None


@dataclass(frozen=True)
class Cure:
    """The fix of an engine as shipped on one scene and dimension.

    Parameters
    ----------
    cells
        Parameters of the cells that ran, where they differ from the scene's defaults.
    failing, left, judged
        Number of checks of these cells that fail as shipped and with the fix, and of all.
    metric, unit, params, truth, tolerance, before, after
        The first of `shown`; older tables have only this one.
    changes
        Settings of the fix with their values in that cell; empty if no change helps.
    profile
        Profile with all of these settings; empty if there is none.
    others
        Other single settings that correct as many checks alone.
    tried
        Number of tried changes.
    cost_before, cost_after
        CPU time per step [s] in that cell; None where it was not timed.
    mends
        Kinds of metrics, without index, that failed as shipped and pass in all cells with the fix. Nothing is claimed
        for other kinds; empty in older tables.
    dt
        Step of the cells [s].
    alone, alone_after
        Where the fix has several settings: the one with the largest effect alone that breaks nothing, if it removes at
        least half of the error of the shown check, and the value with it.
    panel
        What it does in other cases; None where it was not tried there.
    shown
        Of each kind of check that the fix corrects (or that fails, if none) the one with the largest error.
    """

    engine: str
    version: str
    shipped: str
    scene: str
    dimension: int
    cells: tuple[Params, ...]
    failing: int
    left: int
    judged: int
    metric: str
    unit: str
    params: Params
    truth: float
    tolerance: float
    before: float | None
    after: float | None
    changes: Changes
    profile: str
    others: tuple[Changes, ...]
    tried: int
    cost_before: float | None
    cost_after: float | None
    mends: tuple[str, ...] = ()
    dt: float = QUICK_DT
    alone: Changes = field(default_factory=dict)
    alone_after: float | None = None
    panel: Panel | None = None
    shown: tuple[Shown, ...] = ()

    @property
    def helps(self) -> bool:
        """Whether there is a fix."""
        return self.left < self.failing

    @property
    def withdrawn(self) -> bool:
        """Whether it breaks more checks of the panel than it mends: it is counted, and not printed."""
        return self.panel is not None and self.panel.withdrawn

    @property
    def recommended(self) -> bool:
        """Whether it corrects at least half of the failing checks, and breaks no more than it mends."""
        return self.helps and 2 * self.left <= self.failing and not self.withdrawn

    @property
    def times(self) -> float | None:
        """Cost of the fix over the cost as shipped."""
        return self.cost_after / self.cost_before if self.cost_before and self.cost_after else None


@cache
def cures_of(engine: str) -> Mapping[tuple[str, int], Cure]:
    """Listed fixes by scene and dimension; empty for an engine without them."""
    return {(cure.scene, cure.dimension): cure for cure in rows_of(engine, CURES, read) if cure.engine == engine}


#: Format of fields of the table: JSON for composite or optional ones, text for the rest.
_TEXT = ("engine", "version", "shipped", "scene", "metric", "unit", "profile")


def write(cures: Iterable[Cure], path: Path) -> None:
    """Write a table of fixes; the old one stays until it is complete."""
    names, rows = [field.name for field in fields(Cure)], []
    for cure in cures:
        rounded = replace(cure, cost_before=_digits(cure.cost_before, 3), cost_after=_digits(cure.cost_after, 3))
        values = [getattr(rounded, name) for name in names]
        rows.append([v if n in _TEXT else json.dumps(v, default=_plain) for n, v in zip(names, values, strict=True)])
    _write(path, names, rows)


def _write(path: Path, names: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    lines = StringIO(newline="")
    csv.writer(lines, lineterminator="\n").writerows([names, *rows])
    whole.write(path, lines.getvalue())


def _plain(value: Any) -> Any:
    """A numpy number as a Python number, a panel as a table."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Shown):
        return asdict(value)
    if isinstance(value, Panel):
        return asdict(replace(value, breaks=tuple(replace(each, slot=None) for each in value.breaks)))
    raise TypeError(f"{value!r} cannot be written into a table of cures")


def _digits(value: float | None, digits: int) -> float | None:
    return None if value is None else float(f"{value:.{digits}g}")


@cache
def panels_of(engine: str) -> Mapping[str, Panel]:
    """Listed panels of an engine's profiles, of the installed release; see `of_profile`."""
    rows = rows_of(engine, PANELS, _read_panels)
    return {profile: panel for version, profile, panel in rows if version == find(engine).version}


def _read_panels(path: Path) -> list[tuple[str, str, Panel]]:
    with path.open(encoding="utf-8", newline="") as lines:
        return [(row["version"], row["profile"], _panel_of(json.loads(row["panel"]))) for row in csv.DictReader(lines)]


def write_panels(version: str, panels: Mapping[str, Panel], path: Path) -> None:
    """Write the panels of profiles."""
    rows = [(version, name, json.dumps(panel, default=_plain)) for name, panel in panels.items()]
    _write(path, ("version", "profile", "panel"), rows)


def _panel_of(plain: Mapping[str, Any]) -> Panel:
    return Panel(**{**plain, "breaks": tuple(Cost(**each) for each in plain["breaks"])})


def read(path: Path) -> list[Cure]:
    """Read a table of fixes."""
    with path.open(encoding="utf-8", newline="") as lines:
        return [_cure_of(row) for row in csv.DictReader(lines)]


def _cure_of(row: Mapping[str, str]) -> Cure:
    values: dict[str, Any] = {name: text if name in _TEXT else json.loads(text) for name, text in row.items()}
    others = tuple(_settings(each) for each in values["others"])
    values |= {"cells": tuple(values["cells"]), "others": others}
    values |= {name: _settings(values[name]) for name in ("changes", "alone") if name in values}
    values["mends"] = tuple(values.get("mends", ()))  # older tables do not have it
    values["shown"] = tuple(Shown(**each) for each in values.get("shown", ()))
    if panel := values.get("panel"):
        values["panel"] = _panel_of(panel)
    return Cure(**values)


def _settings(plain: Mapping[str, Any]) -> dict[str, Any]:
    """Settings with tuples again, which JSON turned into lists."""
    return {name: tuple(value) if isinstance(value, list) else value for name, value in plain.items()}
