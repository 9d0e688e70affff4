"""Profiles of Newton's VBD: settings and their reasons.

default   `SolverVBD` and its shapes as constructed
tuned     stiff contacts, solved with more sweeps
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from adapters import settings
from adapters.engine import ProfileRule, Setting
from adapters.needs import Needs
from adapters.newton import shapes

#: Sweeps over bodies. [`SolverVBD`, iterations]
ITERATIONS, TUNED_ITERATIONS = 10, 100
#: Stiffness of `tuned` [N/m]: a kilogram sinks by a micrometre.
TUNED_STIFFNESS = 1e7
KINDS: Mapping[str, settings.Check] = MappingProxyType(
    {
        "iterations": settings.whole(1, 100_000),
        **shapes.SPRING_KINDS,
        **shapes.KINDS,
    }
)


def default_profile(needs: Needs, dt: float) -> list[Setting]:
    """As constructed."""
    return [
        Setting("iterations", ITERATIONS, "as shipped: sweeps over all bodies", "SolverVBD, iterations"),
        *shapes.SPRINGS_AS_SHIPPED,
        shapes.GAP_AS_SHIPPED,
    ]


def tuned_profile(needs: Needs, dt: float) -> list[Setting]:
    """Stiff contacts; a profile does not know masses, so damping stays."""
    changed = {
        "iterations": (TUNED_ITERATIONS, "a load passes one body a sweep", "derived"),
        "stiffness": (TUNED_STIFFNESS, "a spring of 2.5 kN/m gives way by 4 mm under a kilogram", "derived"),
    }
    return [Setting(x.name, *changed[x.name]) if x.name in changed else x for x in default_profile(needs, dt)]


PROFILES: Mapping[str, ProfileRule] = MappingProxyType({"default": default_profile, "tuned": tuned_profile})
