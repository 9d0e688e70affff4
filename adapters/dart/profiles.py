"""Profiles of DART: they differ only in the solver of the contact problem.

default   Dantzig's pivoting, as shipped: a boxed LCP, so the friction cone is a pyramid
pgs       projected Gauss-Seidel on the same boxed LCP
nsgs      non-smooth Gauss-Seidel with Coulomb's cone
fbf       forward-backward-forward splitting with Coulomb's cone
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

_PLAIN: Mapping[str, settings.Check] = {
    "solver": settings.word("dantzig", "pgs", "nsgs", "fbf"),
    "detector": settings.word("fcl", "dart", "ode", "bullet"),
}
_SWEPT: Mapping[str, settings.Check] = {
    "iterations": settings.whole(1, 10**6),
    "tolerance": settings.number(0.0, 1.0),
}
_SECOND: Mapping[str, settings.Check] = {
    "second_sweeps": settings.whole(1, 10**6),
    "second_tolerance": settings.number(0.0, 1.0),
}
#: Settings of each solver: Dantzig's pivots, without sweeps or a tolerance; PGS is its own fallback.
TAKEN: Mapping[str, Mapping[str, settings.Check]] = MappingProxyType(
    {
        "dantzig": {**_PLAIN, **_SECOND},
        "pgs": {**_PLAIN, **_SWEPT},
        "nsgs": {**_PLAIN, **_SWEPT, **_SECOND},
        "fbf": {**_PLAIN, **_SWEPT, **_SECOND},
    }
)
KINDS: Mapping[str, settings.Check] = MappingProxyType({**_PLAIN, **_SWEPT, **_SECOND})
_SOURCE = "dartpy 6.20, dart.constraint"


def _second() -> list[Setting]:
    """Fallback if the solver finds no solution."""
    source = "BoxedLcpConstraintSolver, secondary solver; PgsBoxedLcpSolverOption"
    why = "as shipped: iterations of projected Gauss-Seidel where the solver finds no solution"
    return [
        Setting("second_sweeps", SECOND_SWEEPS, why, source),
        Setting("second_tolerance", SECOND_TOLERANCE, "as shipped: a smaller relative change stops them", source),
    ]


def _pivoting(needs: Needs, dt: float) -> list[Setting]:
    return [
        Setting("solver", "dantzig", "as shipped: pivots to the solution of a boxed LCP", _SOURCE),
        Setting("detector", "fcl", "as shipped", "World.getCollisionDetector"),
        *_second(),
    ]


def _sweeping(solver: str, why: str, needs: Needs, dt: float) -> list[Setting]:
    return [
        Setting("solver", solver, why, _SOURCE),
        Setting("detector", "fcl", "as shipped", "World.getCollisionDetector"),
        Setting(
            "iterations",
            SWEEPS[solver],
            "the shipped 30 do not solve a column" if solver == "pgs" else "the shipped 100 do not solve two boxes",
            _SOURCE,
        ),
        Setting("tolerance", TOLERANCES[solver], "a smaller relative change stops the iterations", _SOURCE),
        *([] if solver == "pgs" else _second()),
    ]


#: Profiles whose friction is a pyramid along the axes of the floor.
PYRAMIDS = ("default", "pgs")
#: Profiles whose friction is a cone, and the largest number of free boxes in one problem: two with a mass ratio of 100
#: take 35 to 90 s for 5 s of motion, a column of ten more than 3 min (measured with 6.20.0 on one core; Dantzig's 3 s).
CONES = ("nsgs", "fbf")
#: Profiles with sweeps over single contacts.
SWEEPERS = ("pgs", "nsgs")
MOST_BOXES = 1
#: Relative changes at which the sweeps of a profile stop.
TOLERANCES = {"pgs": 1e-12, "nsgs": 1e-10, "fbf": 1e-8}
#: Largest number of sweeps of a profile.
SWEEPS = {"pgs": 200, "nsgs": 1000, "fbf": 1000}

#: Sweeps of the fallback, and relative and absolute changes at which they stop; the absolute is a thousandth of it.
SECOND_SWEEPS, SECOND_TOLERANCE = 30, 1e-3

_RULES: dict[str, Callable[[Needs, float], list[Setting]]] = {
    "default": _pivoting,
    "pgs": partial(_sweeping, "pgs", "projected Gauss-Seidel on the friction pyramid of the shipped solver"),
    "nsgs": partial(_sweeping, "nsgs", "the exact cone: friction opposes the slip, whatever its direction"),
    "fbf": partial(_sweeping, "fbf", "the exact cone by another method"),
}
PROFILES: Mapping[str, ProfileRule] = MappingProxyType(_RULES)


def solved(profile: str, rough: bool) -> float:
    """Relative residual of a profile's solver for a single contact: with friction ten times its own tolerance."""
    return max(SOLVED, 10.0 * TOLERANCES.get(profile, 0.0)) if rough else SOLVED


def checked(asked: Mapping[str, Any]) -> dict[str, Any]:
    """Settings with valid names and values for the engine; see `adapters.settings.checked`.

    A solver set alone in place of Dantzig's has the sweeps and the tolerance of its own profile.
    """
    name = asked.get("solver")
    if name in TOLERANCES and not {"iterations", "tolerance"} & set(asked):
        kept = {key: value for key, value in asked.items() if key in TAKEN[name]}
        asked = {**kept, "iterations": SWEEPS[name], "tolerance": TOLERANCES[name]}
    return settings.checked("dart", TAKEN.get(str(name), {**_PLAIN, **_SWEPT, **_SECOND}), asked)
