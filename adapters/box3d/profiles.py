"""Profiles of Box3D: settings and their reasons.

default   as shipped
tuned     contacts as stiff as the substeps resolve, more substeps, and the speed of one step of gravity as threshold
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from adapters import settings
from adapters.box3d.shipped import (
    CONTACT_HERTZ,
    DAMPING_RATIO,
    MAXIMUM_SPEED,
    PUSH_SPEED,
    RECYCLED,
    RESTITUTION_THRESHOLD,
    STIFFEST,
    SUBSTEPS,
)
from adapters.engine import ProfileRule, Setting
from adapters.needs import Needs

#: Substeps of `tuned`.
TUNED_SUBSTEPS = 8
#: Units per metre of `tuned`, for bodies under a load.
FINEST = 64.0

KINDS: Mapping[str, settings.Check] = MappingProxyType(
    {
        "substeps": settings.whole(1, 10**6),
        "hertz": settings.number(0.0, 1e9),
        "damping_ratio": settings.number(0.0, 1e6),
        "push_speed": settings.number(0.0, 1e6),
        "restitution_threshold": settings.number(0.0, 1e6),
        "maximum_speed": settings.number(1e-3, 1e6),
        "continuous": settings.flag,
        "warm_starting": settings.flag,
        "recycle_distance": settings.number(0.0, 1e6),
        "fast_rotation": settings.flag,
        "units_per_metre": settings.number(1e-6, 1e6),
    }
)

_WORLD, _STEP = "types.c, b3DefaultWorldDef", "manual, Simulation: sub-step count"


def default_profile(needs: Needs, dt: float) -> list[Setting]:
    """As shipped."""
    said = "as shipped"
    return [
        Setting("substeps", SUBSTEPS, f"{said}: substeps of a step", _STEP),
        Setting("hertz", CONTACT_HERTZ, f"{said}: contacts are springs of 30 Hz, 60 Hz against static bodies", _WORLD),
        Setting(
            "damping_ratio", DAMPING_RATIO, f"{said}: over-damped, so overlapping bodies are not thrown apart", _WORLD
        ),
        Setting("push_speed", PUSH_SPEED, f"{said}: overlaps are corrected at up to 3 m/s", _WORLD),
        Setting("restitution_threshold", RESTITUTION_THRESHOLD, f"{said}: restitution is 0 below 1 m/s", _WORLD),
        Setting("maximum_speed", MAXIMUM_SPEED, f"{said}: faster bodies are slowed to it", _WORLD),
        Setting("continuous", True, f"{said}: fast bodies are swept against static ones", _WORLD),
        Setting("warm_starting", True, f"{said}: each step starts with the impulses of the last one", "box3d.h"),
        Setting(
            "recycle_distance",
            RECYCLED,
            f"{said}: contact points are used again while bodies move by less than 5 cm",
            "constants.h, B3_CONTACT_RECYCLE_DISTANCE",
        ),
        Setting("fast_rotation", False, f"{said}: a body turns by at most 45 degrees a step", "types.h, b3BodyDef"),
        Setting("units_per_metre", 1.0, "the manual's MKS units", "manual, Units"),
    ]


def tuned_profile(needs: Needs, dt: float) -> list[Setting]:
    """Best stock settings for what the scene needs."""
    changed = {
        "substeps": Setting(
            "substeps",
            TUNED_SUBSTEPS,
            "twice the substeps: contacts can be twice as stiff, and loads pass farther up a column",
            "measured: columns, unequal masses",
        ),
        "hertz": Setting(
            "hertz",
            STIFFEST * TUNED_SUBSTEPS / dt,
            "the stiffness that substeps resolve, and the limit of the engine; bodies do not sink in",
            "measured: columns; physics_world.c, an eighth of the substep rate",
        ),
        "restitution_threshold": Setting(
            "restitution_threshold",
            needs.gravity * dt,
            "the speed that gravity adds in a step is no blow; without gravity every approach rebounds",
            "types.h, b3WorldDef: restitutionThreshold",
        ),
        "maximum_speed": Setting(
            "maximum_speed",
            max(MAXIMUM_SPEED, 4.0 * needs.top_speed),
            "no body of the scene is slowed, even after a blow by a heavy one",
            "types.h, b3WorldDef: maximumLinearSpeed",
        ),
        "recycle_distance": Setting(
            "recycle_distance", 0.0, "contacts are detected anew in every step", "box3d.h: 0 switches it off"
        ),
        "fast_rotation": Setting(
            "fast_rotation", True, "no spin of the scene is clamped", "types.h, b3BodyDef: allowFastRotation"
        ),
        "units_per_metre": Setting(
            "units_per_metre",
            FINEST if needs.pull > 0.0 else 1.0,
            "contacts act from 2 cm ahead, a compiled-in length, at the sides of seams too; in a smaller unit "
            "of length that is little"
            if needs.pull > 0.0
            else "as shipped: contacts of a fast body must be found ahead",
            "constants.h, B3_SPECULATIVE_DISTANCE",
        ),
    }
    return [changed.get(each.name, each) for each in default_profile(needs, dt)]


PROFILES: Mapping[str, ProfileRule] = MappingProxyType({"default": default_profile, "tuned": tuned_profile})
