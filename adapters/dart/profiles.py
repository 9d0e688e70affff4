"""Profiles of DART: everything alike but the solver of the contact problem.

default   Dantzig's pivoting, as shipped: a boxed LCP, so that the cone of friction is a pyramid
pgs       projected Gauss-Seidel on the same boxed LCP
nsgs      non-smooth Gauss-Seidel with Coulomb's own cone
fbf       forward-backward-forward splitting with Coulomb's own cone
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType
from typing import Any

from adapters import settings
from adapters.dart.shipped import SOLVED
from adapters.engine import ProfileRule, Setting
from adapters.needs import Needs

#: What Dantzig's solver takes, which pivots and has neither iterations nor a tolerance, and what the others take.
PIVOTING: Mapping[str, settings.Check] = MappingProxyType(
    {
        "solver": settings.word("dantzig", "pgs", "nsgs", "fbf"),
        "detector": settings.word("fcl", "dart", "ode", "bullet"),
    }
)
SWEEPING: Mapping[str, settings.Check] = MappingProxyType(
    {**PIVOTING, "iterations": settings.whole(1, 10**6), "tolerance": settings.number(0.0, 1.0)}
)
_SOURCE = "dartpy 6.20, dart.constraint"


def _pivoting(needs: Needs, dt: float) -> list[Setting]:
    return [
        Setting("solver", "dantzig", "as shipped: pivots to the solution of a boxed LCP", _SOURCE),
        Setting("detector", "fcl", "as shipped", "World.getCollisionDetector"),
    ]


def _sweeping(solver: str, why: str, needs: Needs, dt: float) -> list[Setting]:
    return [
        Setting("solver", solver, why, _SOURCE),
        Setting("detector", "fcl", "as shipped", "World.getCollisionDetector"),
        Setting(
            "iterations",
            SWEEPS[solver],
            "30 as shipped leave a column unsolved" if solver == "pgs" else "100 as shipped leave two boxes unsolved",
            _SOURCE,
        ),
        Setting("tolerance", TOLERANCES[solver], "changes below it stop the sweeps", _SOURCE),
    ]


#: Profiles whose friction is a pyramid along the axes of the floor.
PYRAMIDS = ("default", "pgs")
#: Changes below which the sweeps of a profile stop, as a share.
TOLERANCES = {"pgs": 1e-12, "nsgs": 1e-10, "fbf": 1e-8}
#: Sweeps of a profile at most.
SWEEPS = {"pgs": 200, "nsgs": 1000, "fbf": 1000}

_RULES: dict[str, Callable[[Needs, float], list[Setting]]] = {
    "default": _pivoting,
    "pgs": partial(_sweeping, "pgs", "the sweeps of a textbook on the pyramid of the shipped solver"),
    "nsgs": partial(_sweeping, "nsgs", "the exact cone: friction opposes the slip, whatever its direction"),
    "fbf": partial(_sweeping, "fbf", "the exact cone by another method"),
}
PROFILES: Mapping[str, ProfileRule] = MappingProxyType(_RULES)


def solved(profile: str, rough: bool) -> float:
    """What a profile's solver leaves of a single contact, as a share: with friction ten times its own tolerance."""
    return max(SOLVED, 10.0 * TOLERANCES.get(profile, 0.0)) if rough else SOLVED


def checked(asked: Mapping[str, Any]) -> dict[str, Any]:
    """Settings whose names and numbers the engine can take; see `adapters.settings.checked`.

    A solver that is asked for in the place of Dantzig's, alone, brings the sweeps and the tolerance of its own profile.
    """
    name = asked.get("solver")
    if name == "dantzig":
        return settings.checked("dart", PIVOTING, asked)
    if name in TOLERANCES and not {"iterations", "tolerance"} & set(asked):
        asked = {**asked, "iterations": SWEEPS[name], "tolerance": TOLERANCES[name]}
    return settings.checked("dart", SWEEPING, asked)
