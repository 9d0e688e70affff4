"""Experiments on engines, as data, one module per engine: what tuning tries, what proves a reason, what cures.

An experiment switches off the mechanism that a reason names and says what must come of it; where nothing can be
switched, a deviation law predicts the value independently. `validation.tuning`, `validation.proofs` and
`validation.decisive` run them; what the last one measured stands in ``decisive.csv``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from validation.cells import Slot
from validation.plan import QUICK_DT


@dataclass(frozen=True)
class Experiment:
    """One mechanism, switched off on one row that fails because of it.

    Parameters
    ----------
    family
        Identifier of the reason in the engine's findings.
    says
        What is shown, in one sentence.
    profile, scene, dimension, params, iterations, metric
        The row: it must FAIL as it is.
    off
        Settings that switch the mechanism off: the row must PASS with them.
    idle
        Settings that another explanation would blame: with them the row must still FAIL.
    """

    family: str
    says: str
    profile: str
    scene: str
    metric: str
    off: Mapping[str, Any]
    params: Mapping[str, float] = field(default_factory=dict)
    dimension: int = 2
    iterations: int | None = None
    idle: Sequence[Mapping[str, Any]] = ()

    def slot(self, engine: str) -> Slot:
        """The row's cell, as the profile has it."""
        params = tuple(sorted(self.params.items()))
        return Slot(self.scene, params, self.dimension, engine, self.profile, QUICK_DT, self.iterations)


@dataclass(frozen=True)
class Cured:
    """What fails as shipped and passes with a better profile: `validation.decisive` finds out by which settings.

    Parameters
    ----------
    scene, cells
        The cells that are asked, as what differs from the scene's defaults: an easy one and the hard ones.
    metrics
        Checks that are asked of them; all by default. Named where the better profile does not pass all.
    """

    scene: str
    cells: tuple[Mapping[str, float], ...]
    metrics: tuple[str, ...] = ()
    dimension: int = 2
    shipped: str = "default"
    better: str = "tuned"

    def slots(self, engine: str) -> list[Slot]:
        """The cells as the shipped profile has them."""
        return [
            Slot(self.scene, tuple(sorted(cell.items())), self.dimension, engine, self.shipped, QUICK_DT)
            for cell in self.cells
        ]


@cache
def experiments_of(engine: str) -> tuple[Experiment, ...]:
    """All experiments of ``engine``; none for an engine without a module here."""
    return tuple(_module(engine, "EXPERIMENTS"))


@cache
def candidates_of(engine: str) -> Mapping[str, tuple[Any, ...]]:
    """Stock settings that tuning may change, and the values it tries; empty for an engine without a module here."""
    return dict(_module(engine, "CANDIDATES"))


@cache
def cured_of(engine: str) -> tuple[Cured, ...]:
    """Cures whose settings are measured one by one; none for an engine without a module here."""
    return tuple(_module(engine, "CURED"))


@cache
def belongs_of(engine: str) -> Mapping[str, str]:
    """Settings that mean nothing without another one, and which; they are switched with it."""
    return dict(_module(engine, "BELONGS"))


def _module(engine: str, name: str) -> Any:
    if not engine.isidentifier() or find_spec(f"{__name__}.{engine}") is None:
        return ()
    return getattr(import_module(f"{__name__}.{engine}"), name, ())
