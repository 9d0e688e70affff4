"""Chipmunk's profiles: settings and their reasons.

default   as shipped
tuned     best stock settings for the needs of a scene
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from adapters.chipmunk.shipped import COLLISION_BIAS, COLLISION_PERSISTENCE, COLLISION_SLOP, ITERATIONS
from adapters.engine import EngineError, ProfileRule, Setting
from adapters.needs import Needs
from adapters.settings import LARGEST_INT, Check, finite, number, whole

#: Ranges of settings. Those of `UNSET` are Chipmunk's own unless they are set.
KINDS: Mapping[str, Check] = MappingProxyType(
    {
        "iterations": whole(1, LARGEST_INT),
        "collision_slop": number(0.0, math.inf),
        "collision_bias": number(0.0, 1.0),
        "collision_persistence": whole(1, LARGEST_INT),
        "start_overlap": number(0.0, math.inf),
        "damping": number(0.0, 1.0),
        "idle_speed_threshold": number(0.0, math.inf),
        "sleep_time_threshold": number(0.0, math.inf),
    }
)
UNSET = ("damping", "idle_speed_threshold", "sleep_time_threshold")
#: Overlap without correction, as a share of the smallest body.
SLOP_SHARE = 1e-3
#: Start overlap of touching bodies, as a share of the fall in a step.
START_SHARE = 0.3
SETTING_NAMES = ("iterations", "collision_slop", "collision_bias", "collision_persistence", "start_overlap")


def default_profile(needs: Needs, dt: float) -> list[Setting]:
    """As shipped: the values of ``pymunk.Space()``."""
    shipped, source = "as shipped", "cpSpace.c, cpSpaceInit"
    return [
        Setting("iterations", ITERATIONS, shipped, source),
        Setting("collision_slop", COLLISION_SLOP, shipped, source),
        Setting("collision_bias", COLLISION_BIAS, f"{shipped}: 0.9 to the 60th per second", source),
        Setting("collision_persistence", COLLISION_PERSISTENCE, shipped, source),
        Setting("start_overlap", 0.0, "the scene starts as given", ""),
    ]


def tuned_profile(needs: Needs, dt: float) -> list[Setting]:
    """Best stock settings for what the scene needs."""
    slop, resting = SLOP_SHARE * needs.smallest_size, needs.regime == "rest"
    heavy = needs.mass_ratio >= 100.0
    return [
        Setting(
            "iterations",
            100 if heavy else 30,
            "the mass ratio needs them: at 1/60 s a column under 100 times its mass falls with 30 iterations, "
            "not with 100"
            if heavy
            else "a flat landing is right to 1e-8 and a column of ten rests; each iteration reduces the error",
            "measured: flat box against iterations, columns",
        ),
        Setting(
            "collision_slop",
            slop,
            "a thousandth of the smallest body; the shipped 0.1 m is a tenth of it, and with 0 contacts come and go",
            "cpArbiter.c, cpArbiterPreStep",
        ),
        Setting(
            "collision_bias",
            COLLISION_BIAS if resting else 1.0,
            "as shipped: resting bodies need their overlaps corrected"
            if resting
            else "1 switches the overlap correction off, which would add energy to every impact that is found late",
            "cpSpaceStep.c; measured: a ball with e = 1 then keeps its energy to 2e-15 over 100 s",
        ),
        Setting(
            "collision_persistence",
            1,
            "with the shipped 3 a contact that forms again starts from old impulses, and can pull",
            "cpArbiter.c, cpArbiterUpdate and cpArbiterApplyCachedImpulse",
        ),
        Setting(
            "start_overlap",
            _start_overlap(needs, slop, dt) if resting else 0.0,
            "touching pairs start 0.3 g dt^2 deep, inside the slop, which is never corrected; in an exactly "
            "touching start contacts come and go, and bodies move by g dt^2"
            if resting
            else "bodies that collide must not start with an overlap: a shock would pass through the whole "
            "chain at once",
            "crosscheck tune chipmunk --group stand: half the slop was deeper than needed and no steadier",
        ),
    ]


def _start_overlap(needs: Needs, slop: float, dt: float) -> float:
    """Start overlap of touching bodies [m]: a share of g dt^2, and at most half the slop."""
    fall = START_SHARE * (needs.pull * dt * dt)
    return min(0.5 * slop, fall) if fall > 0.0 else 0.5 * slop


PROFILES: Mapping[str, ProfileRule] = MappingProxyType({"default": default_profile, "tuned": tuned_profile})


def checked(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Settings with valid names and values for the engine; a bad value would abort the process."""
    for name in settings:
        if name not in KINDS:
            raise EngineError(f"{name}: chipmunk has no such setting, it has {', '.join(SETTING_NAMES)}")
    for name in SETTING_NAMES:
        if name not in settings:
            raise EngineError(f"{name}: this setting is missing")
    for name in ("iterations", "collision_persistence"):
        value = settings[name]
        if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value < 2**31:
            raise EngineError(f"{name}: {value!r} must be a whole number from 1 to 2147483647")
    for name, high in (("collision_slop", math.inf), ("collision_bias", 1.0), ("start_overlap", math.inf)):
        value = settings[name]
        number = isinstance(value, int | float) and not isinstance(value, bool) and finite(value)
        if not number or not 0.0 <= value <= high:
            limit = " and at most 1" if high == 1.0 else ""
            raise EngineError(f"{name}: {value!r} must be a finite number, at least 0{limit}")
    for name in set(UNSET) & set(settings):
        if wanted := KINDS[name](settings[name]):
            raise EngineError(f"{name}: {settings[name]!r} must be {wanted}")
    if settings["start_overlap"] > settings["collision_slop"]:
        raise EngineError("start_overlap: must not exceed collision_slop, it would be pushed out again")
    return dict(settings)
