"""Profiles of DART: everything alike but the solver of the contact problem.

default   Dantzig's pivoting, as shipped: a boxed LCP, so that the cone of friction is a pyramid
pgs       projected Gauss-Seidel on the same boxed LCP
nsgs      non-smooth Gauss-Seidel with Coulomb's own cone
fbf       forward-backward-forward splitting with Coulomb's own cone
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType
from typing import Any

from adapters.engine import EngineError, ProfileRule, Setting
from adapters.needs import Needs

SETTING_NAMES = ("solver", "detector", "iterations", "tolerance")
SOLVERS = ("dantzig", "pgs", "nsgs", "fbf")
DETECTORS = ("fcl", "dart", "ode", "bullet")
_SOURCE = "dartpy 6.20, dart.constraint"


def _pivoting(needs: Needs, dt: float) -> list[Setting]:
    return [
        Setting("solver", "dantzig", "as shipped: pivots to the solution of a boxed LCP", _SOURCE),
        Setting("detector", "fcl", "as shipped", "World.getCollisionDetector"),
    ]


def _sweeping(solver: str, count: int, tolerance: float, why: str, needs: Needs, dt: float) -> list[Setting]:
    return [
        Setting("solver", solver, why, _SOURCE),
        Setting("detector", "fcl", "as shipped", "World.getCollisionDetector"),
        Setting(
            "iterations", count, "30 as shipped leave a column unsolved" if solver == "pgs" else "as shipped", _SOURCE
        ),
        Setting("tolerance", tolerance, "changes below it stop the sweeps", _SOURCE),
    ]


_RULES: dict[str, Callable[[Needs, float], list[Setting]]] = {
    "default": _pivoting,
    "pgs": partial(_sweeping, "pgs", 200, 1e-12, "the sweeps of a textbook on the pyramid of the shipped solver"),
    "nsgs": partial(
        _sweeping, "nsgs", 1000, 1e-10, "the exact cone: friction opposes the slip, whatever its direction"
    ),
    "fbf": partial(_sweeping, "fbf", 1000, 1e-8, "the exact cone by another method"),
}
PROFILES: Mapping[str, ProfileRule] = MappingProxyType(_RULES)


def checked(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Settings whose names and numbers the engine can take.

    Raises
    ------
    EngineError
        Naming the first setting that is unknown, missing or of the wrong kind.
    """
    for name in settings:
        if name not in SETTING_NAMES:
            raise EngineError(f"{name}: dart has no such setting, it has {', '.join(SETTING_NAMES)}")
    for name, words in (("solver", SOLVERS), ("detector", DETECTORS)):
        if settings.get(name) not in words:
            raise EngineError(f"{name}: {settings.get(name)!r} must be one of {', '.join(words)}")
    if settings["solver"] == "dantzig":
        if set(settings) & {"iterations", "tolerance"}:
            raise EngineError("iterations: dantzig pivots, it has neither iterations nor a tolerance")
        return dict(settings)
    count: Any = settings.get("iterations")
    tolerance: Any = settings.get("tolerance")
    if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= 10**6:
        raise EngineError(f"iterations: {count!r} must be a whole number from 1 to 1000000")
    number = isinstance(tolerance, int | float) and not isinstance(tolerance, bool) and math.isfinite(tolerance)
    if not number or not 0.0 <= tolerance <= 1.0:
        raise EngineError(f"tolerance: {tolerance!r} must be a number from 0 to 1")
    return dict(settings)
