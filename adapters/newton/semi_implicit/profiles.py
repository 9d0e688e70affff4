"""Profile of Newton's semi-implicit solver: settings and their reasons.

default   `SolverSemiImplicit` and its shapes as constructed
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from adapters import settings
from adapters.engine import ProfileRule, Setting
from adapters.needs import Needs
from adapters.newton.shipped import DAMPING, GAP, STIFFNESS

#: Slope of friction over the slip [N s/m]. [`ModelBuilder.ShapeConfig`, kf]
SLOPE = 1000.0
#: Share of a spin that is lost in a second. [`SolverSemiImplicit`, angular_damping]
SPIN_DAMPING = 0.05
KINDS: Mapping[str, settings.Check] = MappingProxyType(
    {
        "stiffness": settings.number(1e-6, 1e12),
        "damping": settings.number(0.0, 1e12),
        "slope": settings.number(0.0, 1e12),
        "spin_damping": settings.number(0.0, 1e3),
        "gap": settings.number(0.0, 1e9),
    }
)


def default_profile(needs: Needs, dt: float) -> list[Setting]:
    """As constructed; the step bounds stiffness and damping for a given mass, which a profile does not know."""
    said, shape = "as shipped", "ModelBuilder.ShapeConfig"
    return [
        Setting("stiffness", STIFFNESS, f"{said}: of a contact [N/m]", f"{shape}, ke"),
        Setting("damping", DAMPING, f"{said}: of a contact that closes [N s/m]", f"{shape}, kd"),
        Setting("slope", SLOPE, f"{said}: friction over slip below the cone [N s/m]", f"{shape}, kf"),
        Setting("spin_damping", SPIN_DAMPING, f"{said}: of spins [1/s]", "SolverSemiImplicit, angular_damping"),
        Setting("gap", GAP, f"{said}: contacts are sought within it, of each shape [m]", "ModelBuilder.rigid_gap"),
    ]


PROFILES: Mapping[str, ProfileRule] = MappingProxyType({"default": default_profile})
