"""Profiles of Box2D 2.3: settings and their reasons.

default   as shipped
tuned     best stock settings for the needs of a scene

Most parameters of Box2D are compiled-in lengths. A user can choose the unit instead: its manual recommends scaling a
world whose bodies are not between 0.1 and 10 units large. ``units_per_metre`` is that choice.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

from adapters import settings
from adapters.box2d.shipped import (
    MAX_TRANSLATION,
    POLYGON_RADIUS,
    POSITION_ITERATIONS,
    VELOCITY_ITERATIONS,
)
from adapters.engine import ProfileRule, Setting
from adapters.needs import Needs
from adapters.receipts.probes import slide_speed

KINDS: Mapping[str, settings.Check] = MappingProxyType(
    {
        "iterations": settings.whole(1, 2**31 - 1),
        "position_iterations": settings.whole(1, 2**31 - 1),
        "continuous": settings.flag,
        "skin": settings.number(0.0, 1e6),
        "units_per_metre": settings.number(1e-6, 1e6),
        "early_restitution": settings.flag,
    }
)
#: Largest unit that `tuned` chooses: slop and threshold are then 0.08 mm and 16 mm/s.
FINEST = 64.0
#: Skin of resting boxes in `tuned` [length].
THIN = 1e-4


def default_profile(needs: Needs, dt: float) -> list[Setting]:
    """As shipped, in metres."""
    said = "as shipped"
    return [
        Setting("iterations", VELOCITY_ITERATIONS, f"{said}: velocity iterations", "manual, Simulating the World"),
        Setting("position_iterations", POSITION_ITERATIONS, f"{said}", "manual, Simulating the World"),
        Setting("continuous", True, f"{said}: bodies are swept against static ones", "b2World.h"),
        Setting("skin", POLYGON_RADIUS, f"{said}: around each polygon", "b2Settings.h, b2_polygonRadius"),
        Setting("units_per_metre", 1.0, "the manual's MKS units", "manual, Units"),
        Setting(
            "early_restitution",
            False,
            f"{said}: velocities are taken after gravity of this step",
            "b2Island.cpp, Solve",
        ),
    ]


def tuned_profile(needs: Needs, dt: float) -> list[Setting]:
    """Best stock settings for what the scene needs."""
    return [
        Setting(
            "iterations",
            _sweeps(needs.mass_ratio),
            "100 hold a column of twenty; a heavy load needs about as many as its mass ratio to the body below it",
            "measured: columns and unequal masses",
        ),
        Setting("position_iterations", 10, "the default of its testbed", "measured"),
        Setting(
            "continuous",
            True,
            "as shipped: without it a fast body passes through a thin one",
            "b2World.h, SetContinuousPhysics",
        ),
        Setting(
            "skin",
            THIN if needs.regime == "rest" else 0.0,
            "1 % of the shipped one; faces that touch at the start stay in contact, whatever their rounding"
            if needs.regime == "rest"
            else "boxes have their own size",
            "b2PolygonShape, m_radius",
        ),
        Setting("units_per_metre", units(needs, dt), _WHY_UNITS, "manual, Units; b2Settings.h"),
        Setting("early_restitution", False, "as shipped: a user would have to correct it in PreSolve", "b2Island.cpp"),
    ]


def _sweeps(ratio: float) -> int:
    return 100 if ratio < 100.0 else 1000 if ratio < 1000.0 else 10000


_WHY_UNITS = (
    "slop and restitution threshold are compiled-in lengths, and small in a smaller unit of length; motion beyond "
    "2 units a step is cut off, which limits the choice by the speed"
)


def units(needs: Needs, dt: float) -> float:
    """Largest power of two, at most `FINEST` and at least 1, without clamping the fastest body of a scene."""
    # A rebound can double a speed, and blows can transfer the energy of a heavy body to a light one.
    gain = max(2.0, math.sqrt(needs.mass_ratio)) if needs.regime == "impact" else 2.0
    # Property checks use these settings too, with a box that slides so fast.
    fastest = dt * max(gain * needs.top_speed, slide_speed(needs.friction))
    return min(FINEST, max(1.0, 2.0 ** math.floor(math.log2(MAX_TRANSLATION / fastest))))


PROFILES: Mapping[str, ProfileRule] = MappingProxyType({"default": default_profile, "tuned": tuned_profile})
