"""Measurements of an engine without our adapter, and our rows that confirm or contradict them.

``measured.toml`` in an engine's folder has the facts, each in one of three ways:

    ``scene``     a cell, a metric, ``low`` and ``high`` as measured, ``found`` by our cell: it is as measured, or
                  contradicted, with why (``because``)
    ``test``      a test that asserts it, where no scene shows it
    ``unasked``   why no scene or test can show it

Where a source leaves conditions open (a step, a radius, a time of reading) and our cell disagreed, other conditions
were tried until one agreed. That is no test of the fact: ``chosen`` names them, and it is shown. The conditions in a
``because`` were found in the same way.

`crosscheck describe ENGINE` shows them; a test runs the cells and compares each ``found`` with the results.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from adapters.engine_folder import inside
from validation.cells import Slot, parse_dt
from validation.posed import resolve
from validation.running.plan import QUICK_DT
from validation.settings.switching import switched

FILE = "measured.toml"
#: Results of our cells for a fact.
SHOWN, CONTRADICTED, TESTED, UNASKED = "as measured", "contradicted", "tested", "not checked"


@dataclass(frozen=True)
class Fact:
    """One measurement of an engine without our adapter.

    Parameters
    ----------
    says
        What was measured, in one line.
    scene, profile, dimension, params, dt, iterations, settings
        The cell that shows it, with ``settings`` switched.
    metric, low, high
        Range of the metric if the cell confirms the measurement; with ``error``, of its distance from the truth.
    found
        Result of our cell.
    because
        Why our cell disagrees, if it does.
    test, unasked
        See this module.
    chosen
        Conditions that the source leaves open, chosen after another choice had disagreed; see this module.
    """

    says: str
    scene: str = ""
    profile: str = ""
    metric: str = ""
    low: float = 0.0
    high: float = 0.0
    found: float = 0.0
    error: bool = False
    dimension: int = 2
    params: Mapping[str, float] = field(default_factory=dict)
    dt: float = QUICK_DT
    iterations: int | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)
    because: str = ""
    test: str = ""
    unasked: str = ""
    chosen: str = ""

    @property
    def standing(self) -> str:
        """Which of the three ways it is, and whether our cell agrees."""
        if not self.scene:
            return TESTED if self.test else UNASKED
        return SHOWN if self.holds(self.found) else CONTRADICTED

    def holds(self, value: float) -> bool:
        """Whether a value confirms the measurement."""
        return self.low <= value <= self.high

    def slot(self, engine: str) -> Slot:
        """The cell that shows it."""
        params = resolve(self.scene).minimal(self.params)
        slot = Slot(self.scene, params, self.dimension, engine, self.profile, self.dt, self.iterations)
        settings = {name: tuple(v) if isinstance(v, list) else v for name, v in self.settings.items()}
        return switched(slot, settings) if settings else slot

    def number_of(self, metrics: Mapping[str, tuple[float | None, str]]) -> float | None:
        """The value of this fact, from the metrics of its cell."""
        value = metrics[self.metric][0] if self.metric in metrics else None
        if value is None or not self.error:
            return value
        canonical = resolve(self.scene)
        truth = canonical.exact(canonical.scene(self.dimension, dict(self.params)))[self.metric]
        return abs(value - float(truth))


@cache
def facts_of(engine: str) -> tuple[Fact, ...]:
    """Facts of ``engine`` in order; none if it has no file.

    Raises
    ------
    TypeError, ValueError
        If its file is not one of facts.
    """
    path = inside(engine, FILE)
    if path is None:
        return ()
    return tuple(_fact(raw) for raw in tomllib.loads(path.read_text(encoding="utf-8")).get("fact", ()))


def _fact(raw: Mapping[str, Any]) -> Fact:
    values = dict(raw)
    if "dt" in values:
        values["dt"] = parse_dt(str(values["dt"]))
    fact = Fact(**values)
    if sum(map(bool, (fact.scene, fact.test, fact.unasked))) != 1:
        raise ValueError(f"{fact.says}: needs one of a case, a test and a reason why it is not tested")
    if (fact.standing == CONTRADICTED) != bool(fact.because):
        raise ValueError(f"{fact.says}: a contradiction by a case needs a reason, and only that has one")
    if fact.chosen and fact.standing not in (SHOWN, TESTED):
        raise ValueError(f"{fact.says}: a choice made afterwards is stated only for agreement")
    return fact
