"""Profile of Newton's semi-implicit solver: settings and their reasons.

default   `SolverSemiImplicit` and its shapes as constructed
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from adapters import settings
from adapters.engine import ProfileRule, Setting
from adapters.needs import Needs
from adapters.newton import shapes

#: Slope of friction over the slip [N s/m]. [`ModelBuilder.ShapeConfig`, kf]
SLOPE = 1000.0
#: Share of a spin that is lost in a second. [`SolverSemiImplicit`, angular_damping]
SPIN_DAMPING = 0.05
KINDS: Mapping[str, settings.Check] = MappingProxyType(
    {
        **shapes.SPRING_KINDS,
        "slope": settings.number(0.0, 1e12),
        "spin_damping": settings.number(0.0, 1e3),
        **shapes.KINDS,
    }
)


def default_profile(needs: Needs, dt: float) -> list[Setting]:
    """As constructed; the step bounds stiffness and damping for a given mass, which a profile does not know."""
    said = "as shipped"
    return [
        *shapes.SPRINGS_AS_SHIPPED,
        Setting("slope", SLOPE, f"{said}: friction over slip below the cone [N s/m]", f"{shapes.SHAPE}, kf"),
        Setting("spin_damping", SPIN_DAMPING, f"{said}: of spins [1/s]", "SolverSemiImplicit, angular_damping"),
        shapes.GAP_AS_SHIPPED,
    ]


PROFILES: Mapping[str, ProfileRule] = MappingProxyType({"default": default_profile})
