"""Experiments on engines, as data: for tuning, proofs of causes, and fixes.

An experiment switches off the mechanism of a cause and states the expected effect; where it cannot be switched, a
contact law predicts the value independently. `tuning`, `proofs` and `decisive` in `validation.settings` run them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Experiment:
    """A mechanism that is switched off on a row that fails because of it.

    Parameters
    ----------
    family
        Identifier of the family in the engine's findings.
    says
        The result, in one sentence.
    profile, scene, dimension, params, iterations, metric
        The row, which must FAIL without changes.
    off
        Settings that switch the mechanism off: the row must PASS with them, or come ``within``.
    idle
        Settings of another explanation: with them the row must still FAIL.
    within
        Distance from the truth that counts as a PASS with the mechanism off, in the metric's unit: round-off of an
        engine with less precision than the tolerance. A row that is this near without changes proves nothing.
    dt
        Step of the row [s], if not that of the quick suite.
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
    """Checks that fail as shipped and pass with a better profile; `validation.settings.decisive` finds the settings.

    Parameters
    ----------
    shipped, better
        The two profiles.
    scene, cells
        Cells, by what differs from the scene's defaults: an easy one and hard ones.
    metrics
        Their checks; all by default. Given where the better profile does not pass all.
    """

    shipped: str
    better: str
    scene: str
    cells: tuple[Mapping[str, float], ...]
    metrics: tuple[str, ...] = ()
    dimension: int = 2


@dataclass(frozen=True)
class Effect:
    """Where a setting should show that it acts; `validation.settings.effects` sets it there.

    Parameters
    ----------
    set
        A value other than the profile's.
    scene, metric, params, dimension, profile
        The case, and what is shown of it; the profile as shipped by default.
    needs
        Settings without which it is known to do nothing (``with``).
    beyond
        A value beyond a limit of the engine, which ``set`` is: both then give the same.
    in_steps
        Whether that limit is a multiple of the step; ``set`` is for 1/240 s.
    unless
        Settings with which it is not limited.
    because, source
        Why it does nothing, or is limited, as the engine has it.
    untried
        Why there is no such case.
    """

    set: Any = None
    scene: str = ""
    metric: str = ""
    params: Mapping[str, float] = field(default_factory=dict)
    dimension: int = 2
    profile: str | None = None
    needs: Mapping[str, Any] = field(default_factory=dict)
    beyond: Any = None
    in_steps: bool = False
    unless: Mapping[str, Any] = field(default_factory=dict)
    because: str = ""
    source: str = ""
    untried: str = ""
