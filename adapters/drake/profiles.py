"""Profiles of Drake: they differ in the approximation of contact in a step, or have no step but an accuracy.

default   Lagged, as shipped: a convex problem whose friction is regularised by the last step's load
sap       SAP: linear dissipation, and friction with gliding (separation proportional to slip)
tamsi     TAMSI: an implicit step by Newton's method, sub-stepped until it converges
similar   SAP's friction with the dissipation of the others
cenic     CENIC: the continuous plant, by an integrator that chooses its steps so that each is accurate
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType
from typing import Any

from adapters import settings
from adapters.drake.shipped import ACCURACY, DISSIPATION, MODULUS, POINT_STIFFNESS, RELAXATION, STICTION
from adapters.engine import EngineError, ProfileRule, Setting
from adapters.needs import Needs

#: Word of `approximation` for the continuous plant.
CONTINUOUS = "cenic"
#: Names of the engine's own approximations of a step.
APPROXIMATIONS: Mapping[str, str] = MappingProxyType(
    {"lagged": "kLagged", "sap": "kSap", "tamsi": "kTamsi", "similar": "kSimilar"}
)
KINDS: Mapping[str, settings.Check] = MappingProxyType(
    {
        "approximation": settings.word(*APPROXIMATIONS, CONTINUOUS),
        "accuracy": settings.number(1e-10, 0.1),
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


def _continuous(needs: Needs, dt: float) -> list[Setting]:
    """As `rule`, with an accuracy; relaxation times are of SAP alone."""
    first, *others = rule(CONTINUOUS, "steps follow from the accuracy; the bench's step is the longest of them")
    because = f"estimated error of a step [m]; with {ACCURACY:g}, as shipped, friction of a blow is off by a sixth"
    return [first, Setting("accuracy", 1e-6, because, "SimulatorConfig.accuracy; measured with 1.51.1"), *others]


def _rule(approximation: str, why: str, needs: Needs, dt: float) -> list[Setting]:
    return rule(approximation, why)


_RULES: dict[str, Callable[[Needs, float], list[Setting]]] = {
    "default": partial(_rule, "lagged", "as shipped"),
    "sap": partial(_rule, "sap", "the convex approximation, solved to convergence"),
    "tamsi": partial(_rule, "tamsi", "the implicit step of earlier releases"),
    "similar": partial(_rule, "similar", "SAP's friction with Hunt's and Crossley's dissipation"),
    CONTINUOUS: _continuous,
}
PROFILES: Mapping[str, ProfileRule] = MappingProxyType(_RULES)


def checked(asked: Mapping[str, Any]) -> dict[str, Any]:
    """Settings with valid names and values for the engine; see `adapters.settings.checked`. `OWN` may be missing.

    Raises
    ------
    EngineError
        Also for an accuracy of a profile that has a step.
    """
    kinds = {**KINDS, OWN: settings.rows(*_KINDS_OF_A_ROW)} if OWN in asked else KINDS
    found = settings.checked("drake", kinds, asked, ("accuracy",))
    if found["approximation"] == CONTINUOUS:
        return {"accuracy": ACCURACY, **found}
    if "accuracy" in found:
        raise EngineError(f"accuracy: of approximation={CONTINUOUS} only; {found['approximation']} has a step")
    return found
