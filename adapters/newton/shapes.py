"""Settings and documented defaults of Newton's shapes that its solvers share."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from adapters import settings
from adapters.engine import Quirk, Setting
from adapters.newton.shipped import DAMPING, GAP, STIFFNESS
from adapters.unset import Unset

SHAPE = "ModelBuilder.ShapeConfig"
_GAP = "ModelBuilder.rigid_gap"
KINDS: Mapping[str, settings.Check] = MappingProxyType({"gap": settings.number(0.0, 1e9)})
GAP_AS_SHIPPED = Setting(
    "gap", GAP, "as shipped: shapes are tested for contact when their distance is below the sum of their gaps [m]", _GAP
)
FRICTION_UNSET = Unset("friction of a pair", "1: mu", SHAPE, 1.0)
GAP_UNSET = Unset("detection gap of a pair [m]", f"{2.0 * GAP:g}: {GAP:g} for each shape", _GAP)

# ---- contacts that are springs ---------------------------------------------------------------------------------------

SPRING_KINDS: Mapping[str, settings.Check] = MappingProxyType(
    {"stiffness": settings.number(1e-6, 1e12), "damping": settings.number(0.0, 1e12)}
)
SPRINGS_AS_SHIPPED = (
    Setting("stiffness", STIFFNESS, "as shipped: of a contact [N/m]", f"{SHAPE}, ke"),
    Setting("damping", DAMPING, "as shipped: of a contact that closes [N s/m]", f"{SHAPE}, kd"),
)
SPRINGS_UNSET = (
    Unset("restitution of a pair", "none: contacts are springs with dampers", SHAPE),
    Unset("stiffness of a contact [N/m]", f"{STIFFNESS:g}: ke", SHAPE, STIFFNESS),
    Unset("damping of a contact [N s/m]", f"{DAMPING:g}: kd", SHAPE, DAMPING),
)
SPRING_REBOUND = "spring and damper: the rebound depends on mass and step, not on e"


def spring_quirk(what_we_do: str) -> Quirk:
    """Restitution that has no effect."""
    return Quirk(
        "restitution is ignored: contacts are springs of 2.5 kN/m with dampers of 100 N s/m, whatever the mass",
        what_we_do,
        f"{SHAPE}, restitution, ke, kd",
    )
