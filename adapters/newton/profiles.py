"""Profiles of Newton's XPBD solver: settings and their reasons.

default   `SolverXPBD` and its shapes as constructed
tuned     more iterations, without rolling and spinning friction
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from adapters import settings
from adapters.engine import ProfileRule, Setting
from adapters.needs import Needs
from adapters.newton import shapes
from adapters.newton.shipped import (
    GAP,
    ITERATIONS,
    REBOUND_ITERATIONS,
    RELAXATION,
    ROLLING,
    TORSIONAL,
)

#: Iterations of `tuned`: a fifth to the 50th power is 0 in single precision.
TUNED_ITERATIONS = 50
KINDS: Mapping[str, settings.Check] = MappingProxyType(
    {
        "iterations": settings.whole(1, 10_000),
        "relaxation": settings.number(1e-6, 2.0),
        "weighted": settings.flag,
        "rebounds": settings.flag,
        "rebound_iterations": settings.whole(1, 10_000),
        "torsional": settings.number(0.0, 1e9),
        "rolling": settings.number(0.0, 1e9),
        **shapes.KINDS,
    }
)
_SOLVER, _SHAPE = "SolverXPBD", shapes.SHAPE


def default_profile(needs: Needs, dt: float) -> list[Setting]:
    """As constructed; restitution is switched on if the scene has one, because it is off by default."""
    said = "as shipped"
    return [
        Setting("iterations", ITERATIONS, f"{said}: iterations on positions", f"{_SOLVER}, iterations"),
        Setting(
            "relaxation", RELAXATION, f"{said}: share of an overlap that an iteration corrects",
            f"{_SOLVER}, rigid_contact_relaxation",
        ),
        Setting(
            "weighted", True, f"{said}: a body's correction is divided by the number of its contacts",
            f"{_SOLVER}, rigid_contact_con_weighting",
        ),
        Setting(
            "rebounds", needs.restitution > 0.0, "off as shipped, which ignores restitution; on where the "
                                                 "scene has any",
            f"{_SOLVER}, enable_restitution",
        ),
        Setting(
            "rebound_iterations", REBOUND_ITERATIONS, f"{said}: iterations of rebounds",
            f"{_SOLVER}, rigid_contact_restitution_iterations",
        ),
        Setting("torsional", TORSIONAL, f"{said}: friction about the normal [m]", f"{_SHAPE}, mu_torsional"),
        Setting("rolling", ROLLING, f"{said}: friction against rolling [m]", f"{_SHAPE}, mu_rolling"),
        shapes.GAP_AS_SHIPPED,
    ]  # fmt: skip


def tuned_profile(needs: Needs, dt: float) -> list[Setting]:
    """Best stock settings for what the scene needs."""
    changed = {
        "iterations": (
            TUNED_ITERATIONS,
            "two iterations do not remove overlap and slip fully; the rest moves the body in the next steps",
            "derived",
        ),
        "torsional": (0.0, "the scene has no such friction", f"{_SHAPE}, mu_torsional"),
        "rolling": (0.0, "the scene has no such friction", f"{_SHAPE}, mu_rolling"),
        "gap": (max(GAP, needs.top_speed * dt), "no body passes it within a step", "derived"),
    }
    return [
        Setting(each.name, *changed[each.name]) if each.name in changed else each
        for each in default_profile(needs, dt)
    ]  # fmt: skip


PROFILES: Mapping[str, ProfileRule] = MappingProxyType({"default": default_profile, "tuned": tuned_profile})
