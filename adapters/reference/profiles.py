"""Profiles of our own solver: its settings and their reasons.

classical   a fixed number of sweeps, as in textbooks
reference   the loop of events: motion in closed form, or to a tolerance, from one event to the next, and certified
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import fields
from types import MappingProxyType
from typing import Any

from adapters.engine import ProfileRule, Setting
from adapters.needs import Needs
from adapters.settings import LARGEST_INT, Check, either, flag, number, whole, word

SOURCE = "docs/solver"
#: Reasons of the solver's settings; the values themselves are the solver's own.
REASONS = {
    "iterations": "as in textbooks and engines: a fixed cost, with a residual of any size",
    "residual": "sweep until every contact equation holds to this share of its own speed; null: fixed sweeps",
    "max_sweeps": "limit for problems that do not converge; reaching it is reported as not converged",
    "relaxation": "1 is plain projected Gauss-Seidel; null estimates the best factor from the residuals",
    "position_correction": "split: overlap is corrected through pseudo-velocities that carry no energy",
    "beta": "share of an overlap that is corrected per step",
    "slop": "gap or overlap that is left alone [m]; classical: twice what the load closes in a step, g dt^2, so that a "
    "corner that an unfinished solve lifts stays a contact and boxes do not rock",
    "warm_starting": "each contact starts from its impulse of the step before, matched by feature",
    "solver": "scalar: equation after equation, as in textbooks; block: those of a manifold together, which "
    "does not stall",
    "direct": "where sweeps converge slowly (mass ratios, tall columns) Newton's method completes the step; it needs a "
    "residual stop, and is not used with fixed sweeps",
    "tolerance": "the loop of events: error that a step may make where contacts turn, as a share of the motion in it; "
    "all other motion is exact to round-off",
    "margin": "pairs with e = 0 are in contact within this share of the smallest half width, and close by at most the "
    "gap; pairs with e > 0 only where they touch, so that no body is slowed before its impact",
}
#: What acts on steps, and on the loop of events not.
STEPS = frozenset(REASONS) - {"tolerance"}


def classical_profile(needs: Needs, dt: float) -> list[Setting]:
    """Fixed sweeps."""
    from reference_solver import Settings

    return _as_settings(Settings.classical(dt, pull=needs.pull), STEPS)


def reference_profile(needs: Needs, dt: float) -> list[Setting]:
    """A tolerance: nothing else acts on the loop of events."""
    from reference_solver import Settings

    return _as_settings(Settings.reference(dt), REASONS.keys() - STEPS)


def _as_settings(chosen: Any, names: Collection[str]) -> list[Setting]:
    return [
        Setting(field.name, getattr(chosen, field.name), REASONS[field.name], SOURCE)
        for field in fields(chosen)
        if field.name in names
    ]


#: Ranges of settings; the solver's own `Settings` describes each.
KINDS: Mapping[str, Check] = MappingProxyType(
    {
        "iterations": whole(1, LARGEST_INT),
        "residual": either(number(0.0, 1.0), None),
        "max_sweeps": whole(1, LARGEST_INT),
        "relaxation": either(number(0.0, 2.0), None),
        "position_correction": word("split", "baumgarte", "none"),
        "beta": number(0.0, 1.0),
        "slop": number(0.0, math.inf),
        "warm_starting": flag,
        "solver": word("scalar", "block"),
        "margin": number(0.0, 0.1),
        "direct": flag,
        "tolerance": number(1e-11, 1e-5),  # the certificate makes runs to a tenth and to ten times as well
    }
)
#: Settings of the exact profile before it was a loop of events.
FORMER: Mapping[str, str] = MappingProxyType(
    {
        "accuracy": "tolerance of profile reference takes its place",
        "scheme": "the profile takes its place: reference goes from event to event, classical makes steps",
    }
)
PROFILES: Mapping[str, ProfileRule] = MappingProxyType({"classical": classical_profile, "reference": reference_profile})
