"""Profiles of Kamino: settings and their reasons.

default   `SolverKamino` as constructed: PADMM
tuned     PADMM with another share of overlaps to correct
dvi       its other solver of the same problem, as constructed: projected Gauss-Seidel
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from adapters import settings
from adapters.engine import ProfileRule, Setting
from adapters.needs import Needs
from adapters.newton import shapes

#: Most iterations of PADMM and alternations of DVI. [`PADMMSolverConfig`, `DVISolverConfig`]
ITERATIONS = {"padmm": 200, "dvi": 24}
#: Residual at which each stops [m/s]. [the same, tolerance]
TOLERANCE = {"padmm": 1e-6, "dvi": 1e-5}
#: Share of an overlap that a step removes, and overlap that is left [m]. [`ConstraintStabilizationConfig`]
RECOVERY, LEFT = 0.01, 1e-6
KINDS: Mapping[str, settings.Check] = MappingProxyType(
    {
        "method": settings.word(*ITERATIONS),
        "iterations": settings.whole(1, 100_000),
        "tolerance": settings.number(1e-12, 1.0),
        "recovery": settings.number(0.0, 1.0),
        "left": settings.number(0.0, 1e9),
        "warm_start": settings.flag,
        **shapes.KINDS,
    }
)
_STABLE = "ConstraintStabilizationConfig"


def _shipped(method: str) -> list[Setting]:
    said, config = "as shipped", {"padmm": "PADMMSolverConfig", "dvi": "DVISolverConfig"}[method]
    return [
        Setting("method", method, "how the contacts of a step are solved", "SolverKamino.Config, dynamics_solver"),
        Setting("iterations", ITERATIONS[method], f"{said}: most iterations", f"{config}, max_iterations"),
        Setting("tolerance", TOLERANCE[method], f"{said}: residual at which it stops [m/s]", f"{config}, tolerance"),
        Setting("recovery", RECOVERY, f"{said}: share of an overlap that a step removes", f"{_STABLE}, gamma"),
        Setting("left", LEFT, f"{said}: overlap that is left [m]", f"{_STABLE}, delta"),
        Setting("warm_start", True, f"{said}: from the impulses of the step before", f"{config}, warmstart_mode"),
        shapes.GAP_AS_SHIPPED,
    ]


def default_profile(needs: Needs, dt: float) -> list[Setting]:
    """PADMM as constructed."""
    return _shipped("padmm")


def dvi_profile(needs: Needs, dt: float) -> list[Setting]:
    """DVI as constructed."""
    return _shipped("dvi")


def tuned_profile(needs: Needs, dt: float) -> list[Setting]:
    """PADMM that lifts what rests out of its overlaps, and leaves rebounds alone."""
    recovery = (
        (0.0, "correcting an overlap makes the rebound from it faster", "measured")
        if needs.regime == "impact"
        else (0.2, "with a hundredth a step, boxes that slide and stand sink by 0.2 mm", "measured")
    )
    return [Setting(x.name, *recovery) if x.name == "recovery" else x for x in _shipped("padmm")]


PROFILES: Mapping[str, ProfileRule] = MappingProxyType(
    {"default": default_profile, "tuned": tuned_profile, "dvi": dvi_profile}
)
