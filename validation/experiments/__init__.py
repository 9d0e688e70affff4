"""Experiments on engines, as data, one module per engine: what tuning tries, and what proves a reason.

An experiment switches off the mechanism that a reason names and says what must come of it; where nothing can be
switched, a deviation law predicts the value independently. `validation.tuning` and `validation.proofs` run them.
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


@cache
def experiments_of(engine: str) -> tuple[Experiment, ...]:
    """All experiments of ``engine``; none for an engine without a module here."""
    return tuple(_module(engine, "EXPERIMENTS"))


@cache
def candidates_of(engine: str) -> Mapping[str, tuple[Any, ...]]:
    """Stock settings that tuning may change, and the values it tries; empty for an engine without a module here."""
    return dict(_module(engine, "CANDIDATES"))


def _module(engine: str, name: str) -> Any:
    if not engine.isidentifier() or find_spec(f"{__name__}.{engine}") is None:
        return ()
    return getattr(import_module(f"{__name__}.{engine}"), name)
