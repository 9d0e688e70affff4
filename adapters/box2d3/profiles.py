"""Profiles of Box2D 3.1: settings with their reasons.

default   as shipped
tuned     contacts as stiff as the small steps resolve, more of those, and a threshold of what gravity adds in a step
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

#: Small steps of `tuned`.
TUNED_SUBSTEPS = 8
#: Units a metre of `tuned`, for what rests or slides.
FINEST = 64.0
#: Damping ratios of `tuned`: of what slides, and of all else.
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
        Setting("substeps", SUBSTEPS, f"{said}: small steps of a step", "manual, Simulation: sub-step count"),
        Setting("hertz", CONTACT_HERTZ, f"{said}: contacts are springs of 30 Hz, 60 Hz against what is fixed", source),
        Setting("damping_ratio", DAMPING_RATIO, f"{said}: over-damped, so that nothing is thrown out", source),
        Setting("push_speed", PUSH_SPEED, f"{said}: overlaps are pushed out at up to 3 m/s", source),
        Setting("restitution_threshold", RESTITUTION_THRESHOLD, f"{said}: nothing rebounds below 1 m/s", source),
        Setting("maximum_speed", MAXIMUM_SPEED, f"{said}: what is faster is slowed to it", source),
        Setting("continuous", True, f"{said}: fast bodies are swept against what does not move", source),
        Setting("units_per_metre", 1.0, "the manual's MKS units", "manual, Units"),
    ]


def tuned_profile(needs: Needs, dt: float) -> list[Setting]:
    """Best stock settings for what the scene needs."""
    return [
        Setting(
            "substeps",
            TUNED_SUBSTEPS,
            "twice the small steps: contacts may be twice as stiff, and loads travel farther up a column",
            "measured: columns, unequal masses",
        ),
        Setting(
            "hertz",
            STIFFEST * TUNED_SUBSTEPS / dt,
            "as stiff as the small steps resolve, beyond which the engine cuts it: bodies do not sink in",
            "measured: columns; solver.c, a quarter of the rate of the small steps",
        ),
        Setting(
            "damping_ratio",
            SLIDING_DAMPING if needs.slide else RESTING_DAMPING,
            "a stiff contact that is damped as shipped throws single roundings back"
            + ("" if needs.slide else ": so much more of it lets columns rest"),
            "measured: columns, inclines, boxes that start in the ground",
        ),
        Setting("push_speed", PUSH_SPEED, "as shipped", "types.c, b2DefaultWorldDef"),
        Setting(
            "restitution_threshold",
            needs.gravity * dt,
            "what gravity adds in a step is no blow; without gravity everything rebounds",
            "types.h, b2WorldDef: restitutionThreshold",
        ),
        Setting(
            "maximum_speed",
            max(MAXIMUM_SPEED, 4.0 * needs.top_speed),
            "nothing of the scene is slowed, a blow from something heavy included",
            "types.h, b2WorldDef: maximumLinearSpeed",
        ),
        Setting("continuous", True, "as shipped: without it a fast body passes through a thin one", "types.h"),
        Setting(
            "units_per_metre",
            FINEST if needs.regime == "rest" else 1.0,
            "contacts are seen 2 cm ahead, a length that is compiled in, the sides of seams as well; it is small in a "
            "finer unit"
            if needs.regime == "rest"
            else "as shipped: a fast body must be seen ahead",
            "manual, Units; core.h, B2_SPECULATIVE_DISTANCE; measured: a box that slides over seams",
        ),
    ]


PROFILES: Mapping[str, ProfileRule] = MappingProxyType({"default": default_profile, "tuned": tuned_profile})
