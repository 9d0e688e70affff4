"""Profiles of Drake: they differ only in the approximation of contact in a step.

default   Lagged, as shipped: a convex problem whose friction is regularised by the last step's load
sap       SAP: linear dissipation, and friction with gliding (separation proportional to slip)
tamsi     TAMSI: an implicit step by Newton's method, sub-stepped until it converges
similar   SAP's friction with the dissipation of the others
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType
from typing import Any

from adapters import settings
from adapters.drake.shipped import DISSIPATION, MODULUS, POINT_STIFFNESS, RELAXATION, STICTION
from adapters.engine import ProfileRule, Setting
from adapters.needs import Needs

#: Names of the engine's own approximations.
APPROXIMATIONS: Mapping[str, str] = MappingProxyType(
    {"lagged": "kLagged", "sap": "kSap", "tamsi": "kTamsi", "similar": "kSimilar"}
)
KINDS: Mapping[str, settings.Check] = MappingProxyType(
    {
        "approximation": settings.word(*APPROXIMATIONS),
        "boxes": settings.word("hydroelastic", "point"),
        "point_stiffness": settings.number(1.0, 1e15),
        "modulus": settings.number(1.0, 1e15),
        "dissipation": settings.number(0.0, 1e6),
        "relaxation_time": settings.number(0.0, 1e6),
        "stiction_tolerance": settings.number(1e-12, 1.0),
    }
)
#: Setting of a model: contact parameters of each body, in the order of the bodies. A row is friction;
#: the kind of surface: ``none``, ``rigid`` or ``compliant``; its resolution [m]; modulus [Pa]; stiffness of
#: a point [N/m]; dissipation [s/m]; relaxation time [s].
OWN = "own"
_KINDS_OF_A_ROW: tuple[settings.Check, ...] = (
    settings.number(0.0, 1e6),
    settings.word("none", "rigid", "compliant"),
    *[settings.number(0.0, 1e300)] * 5,
)
_PLANT, _GRAPH = "MultibodyPlantConfig", "SceneGraphConfig.default_proximity_properties"


def rule(approximation: str, why: str) -> list[Setting]:
    """Drake's settings as shipped except for the approximation of contact; boxes have surfaces."""
    return [
        Setting("approximation", approximation, why, f"{_PLANT}.discrete_contact_approximation"),
        Setting("boxes", "hydroelastic", "otherwise a pair of shapes has one contact point, and boxes rock", _PLANT),
        Setting("point_stiffness", POINT_STIFFNESS, "as shipped: of pairs with a ball [N/m]", _GRAPH),
        Setting("modulus", MODULUS, "as shipped: of free boxes [Pa]", _GRAPH),
        Setting("dissipation", DISSIPATION, "as shipped [s/m]; SAP has its own", _GRAPH),
        Setting("relaxation_time", RELAXATION, "as shipped: SAP's dissipation [s]", _GRAPH),
        Setting("stiction_tolerance", STICTION, "as shipped: friction of slower slips is viscous [m/s]", _PLANT),
    ]


def _rule(approximation: str, why: str, needs: Needs, dt: float) -> list[Setting]:
    return rule(approximation, why)


_RULES: dict[str, Callable[[Needs, float], list[Setting]]] = {
    "default": partial(_rule, "lagged", "as shipped"),
    "sap": partial(_rule, "sap", "the convex approximation, solved to convergence"),
    "tamsi": partial(_rule, "tamsi", "the implicit step of earlier releases"),
    "similar": partial(_rule, "similar", "SAP's friction with Hunt's and Crossley's dissipation"),
}
PROFILES: Mapping[str, ProfileRule] = MappingProxyType(_RULES)


def checked(asked: Mapping[str, Any]) -> dict[str, Any]:
    """Settings with valid names and values for the engine; see `adapters.settings.checked`. `OWN` may be missing."""
    kinds = {**KINDS, OWN: settings.rows(*_KINDS_OF_A_ROW)} if OWN in asked else KINDS
    return settings.checked("drake", kinds, asked)
