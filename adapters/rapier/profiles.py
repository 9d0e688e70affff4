"""Profiles of Rapier: settings with their reasons.

default   as shipped
tuned     stiffer contacts and more of the small steps that a step is made of
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from adapters.engine import EngineError, ProfileRule, Setting
from adapters.needs import Needs

#: Small steps of a step, as shipped. [`IntegrationParameters.num_solver_iterations`]
SUBSTEPS = 4
#: Small steps of `tuned`: more of them add up their roundings.
TUNED_SUBSTEPS = 8
#: Rates of the springs of contacts between moving bodies, and against fixed ones [1/s].
FREQUENCY, STATIC_FREQUENCY = 30.0, 60.0
#: Damping ratio of both.
DAMPING = 10.0
#: Overlap that is left alone, and distance at which contacts are seen ahead, in units of length.
ALLOWED, PREDICTION = 0.005, 0.02

SETTING_NAMES = (
    "iterations",
    "substeps",
    "frequency",
    "static_frequency",
    "damping_ratio",
    "allowed_error",
    "prediction",
    "friction_model",
    "recycling",
)
FRICTION_MODELS = ("simplified", "coulomb")


def default_profile(needs: Needs, dt: float) -> list[Setting]:
    """As shipped: what ``IntegrationParameters()`` holds."""
    said, source = "as shipped", "rapier3d, IntegrationParameters"
    return [
        Setting("iterations", 1, f"{said}: one sweep in each small step", source),
        Setting("substeps", SUBSTEPS, f"{said}: small steps of a step", source),
        Setting("frequency", FREQUENCY, f"{said}: contacts of moving bodies are springs of 30 Hz", source),
        Setting("static_frequency", STATIC_FREQUENCY, f"{said}: against fixed bodies 60 Hz", source),
        Setting("damping_ratio", DAMPING, said, source),
        Setting("allowed_error", ALLOWED, f"{said}: overlap that is left alone", source),
        Setting("prediction", PREDICTION, f"{said}: contacts are seen so far ahead", source),
        Setting("friction_model", "simplified", f"{said}: one friction constraint per manifold", source),
        Setting("recycling", True, f"{said}: manifolds of bodies that hardly moved are kept", source),
    ]


def tuned_profile(needs: Needs, dt: float) -> list[Setting]:
    """Best stock settings for what the scene needs."""
    stiff = 1.0 / dt
    source = "measured: columns, unequal masses"
    return [
        Setting("iterations", 4, "more sweeps in each small step, for loads on light bodies", source),
        Setting("substeps", TUNED_SUBSTEPS, "twice the small steps: impulses travel farther up a column", source),
        Setting("frequency", stiff, "contacts as stiff as a step resolves, so that bodies do not sink in", source),
        Setting("static_frequency", stiff, "the same against fixed bodies", source),
        Setting("damping_ratio", DAMPING, "as shipped: over-damped, so that nothing is thrown out", source),
        Setting("allowed_error", 1e-5 * needs.smallest_size, "5 mm of overlap would be left alone as shipped", source),
        Setting("prediction", PREDICTION, "as shipped", "rapier3d, IntegrationParameters"),
        Setting(
            "friction_model",
            "simplified",
            "as shipped: the other one gives a box less friction along its own axes than along its diagonal",
            "measured: 0.936 mu g at 0 degrees, mu g at 45",
        ),
        Setting("recycling", False, "contacts are found anew in every step", "rapier3d, contact_recycling"),
    ]


PROFILES: Mapping[str, ProfileRule] = MappingProxyType({"default": default_profile, "tuned": tuned_profile})


def checked(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Settings whose names and numbers the engine can take.

    Raises
    ------
    EngineError
        Naming the first setting that is unknown, missing or of the wrong kind.
    """
    for name in settings:
        if name not in SETTING_NAMES:
            raise EngineError(f"{name}: rapier has no such setting, it has {', '.join(SETTING_NAMES)}")
    for name in SETTING_NAMES:
        if name not in settings:
            raise EngineError(f"{name}: this setting is missing")
    for name in ("iterations", "substeps"):
        count = settings[name]
        if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= 10**6:
            raise EngineError(f"{name}: {count!r} must be a whole number from 1 to 1000000")
    if settings["friction_model"] not in FRICTION_MODELS:
        raise EngineError(f"friction_model: {settings['friction_model']!r} must be one of {', '.join(FRICTION_MODELS)}")
    if not isinstance(settings["recycling"], bool):
        raise EngineError(f"recycling: {settings['recycling']!r} must be true or false")
    for name in ("frequency", "static_frequency", "damping_ratio", "allowed_error", "prediction"):
        value = settings[name]
        number = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
        if not number or not 0.0 <= value <= 1e9:
            raise EngineError(f"{name}: {value!r} must be a number from 0 to 1e9")
    return dict(settings)
