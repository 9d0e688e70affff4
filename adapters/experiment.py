"""Experiments on engines, as data: what tuning tries, what proves a reason, what cures.

An experiment switches off the mechanism that a reason names and says what must come of it; where nothing can be
switched, a deviation law predicts the value independently. `tuning`, `proofs` and `decisive` in `validation.settings`
run them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any


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
        Settings that switch the mechanism off: the row must PASS with them, or come ``within``.
    idle
        Settings that another explanation would blame: with them the row must still FAIL.
    within
        How near the truth counts as a PASS with the mechanism off, in the metric's unit: round-off of an engine whose
        numbers are coarser than what the check allows. A row that is this near as it is shows nothing.
    dt
        Step of the row [s], where it fails at another than that of the quick suite.
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
    within: float = 0.0
    dt: float | None = None


@dataclass(frozen=True)
class Cured:
    """What fails as shipped and passes with a better profile; `validation.settings.decisive` finds by which settings.

    Parameters
    ----------
    shipped, better
        The two profiles.
    scene, cells
        The cells that are asked, as what differs from the scene's defaults: an easy one and the hard ones.
    metrics
        Checks that are asked of them; all by default. Named where the better profile does not pass all.
    """

    shipped: str
    better: str
    scene: str
    cells: tuple[Mapping[str, float], ...]
    metrics: tuple[str, ...] = ()
    dimension: int = 2
