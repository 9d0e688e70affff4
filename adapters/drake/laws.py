"""Designed deviations of Drake from the textbook, predicted from scene and step only."""

from __future__ import annotations

from collections.abc import Mapping

from adapters.drake.landing import landing_law
from adapters.drake.profiles import APPROXIMATIONS, PROFILES
from adapters.law import Deviation, deviations

#: Scenes of a ball that falls straight onto a floor without restitution, or of two overlapping balls, and the metrics
#: that this determines.
FALLING: Mapping[str, tuple[str, ...]] = {
    "impact": ("rebound_ratio", "rebound_speed", "velocity_change", "impulse", "momentum_defect"),
    "bounce": (*(f"apex[{n}]" for n in range(1, 6)), "apex_growth", "rest_time"),
    "overlap": ("thrown",),
}

DEVIATIONS: tuple[Deviation, ...] = deviations(
    "drake",
    [profile for profile in PROFILES if profile == "default" or profile in APPROXIMATIONS],
    FALLING,
    landing_law,
    "contacts are springs with dissipation: an overlap is corrected, with Hunt and Crossley's dissipation at up "
    "to 1/d, 20 mm/s as shipped, with SAP within its relaxation time",
    "MultibodyPlant, discrete contact; recurrence in adapters/drake/landing.py",
    ("1.51.",),
)
