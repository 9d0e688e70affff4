"""Profiles of Box2D 3.1: settings and their reasons.

default   as shipped
tuned     contacts as stiff as the substeps resolve, more substeps, and the speed of one step of gravity as threshold
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from adapters import settings
from adapters.box2d3.shipped import (
    CONTACT_HERTZ,
    DAMPING_RATIO,
    MAXIMUM_SPEED,
    PUSH_SPEED,
    RESTITUTION_THRESHOLD,
    STIFFEST,
    SUBSTEPS,
)
from adapters.engine import ProfileRule, Setting
from adapters.needs import Needs

#: Substeps of `tuned`.
TUNED_SUBSTEPS = 8
#: Units per metre of `tuned`, for resting or sliding bodies.
FINEST = 64.0
#: Damping ratios of `tuned`: for sliding bodies, and for all others.
SLIDING_DAMPING, RESTING_DAMPING = 50.0, 2000.0

KINDS: Mapping[str, settings.Check] = MappingProxyType(
    {
        "substeps": settings.whole(1, 10**6),
        "hertz": settings.number(0.0, 1e9),
        "damping_ratio": settings.number(0.0, 1e6),
        "push_speed": settings.number(0.0, 1e6),
        "restitution_threshold": settings.number(0.0, 1e6),
        "maximum_speed": settings.number(1e-3, 1e6),
        "continuous": settings.flag,
        "units_per_metre": settings.number(1e-6, 1e6),
    }
)


def default_profile(needs: Needs, dt: float) -> list[Setting]:
    """As shipped."""
    said, source = "as shipped", "types.h, b2WorldDef; types.c, b2DefaultWorldDef"
    return [
        Setting("substeps", SUBSTEPS, f"{said}: substeps of a step", "manual, Simulation: sub-step count"),
        Setting("hertz", CONTACT_HERTZ, f"{said}: contacts are springs of 30 Hz, 60 Hz against static bodies", source),
        Setting(
            "damping_ratio", DAMPING_RATIO, f"{said}: over-damped, so overlapping bodies are not thrown apart", source
        ),
        Setting("push_speed", PUSH_SPEED, f"{said}: overlaps are corrected at up to 3 m/s", source),
        Setting("restitution_threshold", RESTITUTION_THRESHOLD, f"{said}: restitution is 0 below 1 m/s", source),
        Setting("maximum_speed", MAXIMUM_SPEED, f"{said}: faster bodies are slowed to it", source),
        Setting("continuous", True, f"{said}: fast bodies are swept against static ones", source),
        Setting("units_per_metre", 1.0, "the manual's MKS units", "manual, Units"),
    ]


def tuned_profile(needs: Needs, dt: float) -> list[Setting]:
    """Best stock settings for what the scene needs."""
    return [
        Setting(
            "substeps",
            TUNED_SUBSTEPS,
            "twice the substeps: contacts can be twice as stiff, and loads pass farther up a column",
            "measured: columns, unequal masses",
        ),
        Setting(
            "hertz",
            STIFFEST * TUNED_SUBSTEPS / dt,
            "the stiffness that substeps resolve, and the limit of the engine; bodies do not sink in",
            "measured: columns; solver.c, a quarter of the substep rate",
        ),
        Setting(
            "damping_ratio",
            SLIDING_DAMPING if needs.slide else RESTING_DAMPING,
            "a stiff contact with the shipped damping amplifies single-precision rounding"
            + ("" if needs.slide else "; with this much more columns rest"),
            "measured: columns, inclines, boxes that start in the ground",
        ),
        Setting("push_speed", PUSH_SPEED, "as shipped", "types.c, b2DefaultWorldDef"),
        Setting(
            "restitution_threshold",
            needs.gravity * dt,
            "the speed that gravity adds in a step is no blow; without gravity every approach rebounds",
            "types.h, b2WorldDef: restitutionThreshold",
        ),
        Setting(
            "maximum_speed",
            max(MAXIMUM_SPEED, 4.0 * needs.top_speed),
            "no body of the scene is slowed, even after a blow by a heavy one",
            "types.h, b2WorldDef: maximumLinearSpeed",
        ),
        Setting("continuous", True, "as shipped: without it a fast body passes through a thin one", "types.h"),
        Setting(
            "units_per_metre",
            FINEST if needs.regime == "rest" else 1.0,
            "contacts act from 2 cm ahead, a compiled-in length, at the sides of seams too; in a smaller unit "
            "of length that is little"
            if needs.regime == "rest"
            else "as shipped: contacts of a fast body must be found ahead",
            "manual, Units; core.h, B2_SPECULATIVE_DISTANCE; measured: a box that slides over seams",
        ),
    ]


PROFILES: Mapping[str, ProfileRule] = MappingProxyType({"default": default_profile, "tuned": tuned_profile})
