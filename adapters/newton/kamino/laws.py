"""Designed deviations of Kamino from the textbook, predicted from scene and step only."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from adapters.law import Deviation, Law, Measure, Prediction, deviations, settings_of
from adapters.law.moved_starts import EITHER
from adapters.law.single_motions import corner_law, rounded_motions, standstills
from adapters.law.single_precision import PLACES, UNIT, Method, plane_law, rounded_law
from adapters.law.unswept import passing_law
from adapters.newton.kamino.profiles import PROFILES
from adapters.scene import Scene
from adapters.scene.lift import size_across

_RELEASES = ("1.8.",)
_SOURCE = "kamino: built for floats"
#: Metrics by scene of blows in free space: of one after ``delay``, and of several.
BLOWS: Mapping[str, tuple[str, ...]] = {
    "impact": ("rebound_ratio", "rebound_speed", "velocity_change", "impulse", "momentum_defect"),
    "head_on": ("rebound_ratio", "first_speed", "second_speed", "impulse", "momentum_defect"),
    "off_centre": ("ball_speed", "bar_speed", "spin", "energy_lost", "impulse", "momentum_defect"),
    "oblique": ("rebound_ratio", "sideways"),
    "flat_box": ("rebound_ratio", "impulse", "edge_speed", "sideways"),
    "stacked_balls": ("small_speed", "large_speed", "energy_lost"),
    "closing_wall": ("speed[1]", "speed[2]", "speed[3]"),
    "cradle": ("momentum_defect", "energy_defect", *(f"speed[{k}]" for k in range(1, 6))),
    "galperin": ("small_speed", "large_speed", "energy_defect"),
    "rod_gas": ("wrong_speed", "energy_defect"),
}


def blow_law(metric: str, profile: str) -> Law:
    """Blows with e; one with e < 1 gets a share of its overlap as further speed: of the rest of its step.

    None where several blows with e < 1 get different shares, and where they magnify a place off by its rounding.
    """

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        chosen = settings_of(PROFILES[profile], scene, dt)
        lossy = any(restitution < 1.0 for restitution, _ in scene.materials())
        if chosen["recovery"] and lossy and (len(scene.bodies) > 2 or "delay" not in scene.params):
            return None
        blow = scene.params.get("delay", 0.0) / dt
        added = chosen["recovery"] * (math.ceil(blow) - blow)
        method = Method(lambda e, speed: e + added if e < 1.0 else e, 1, max(UNIT, chosen["tolerance"]))
        rounded = rounded_law(metric, method)
        found = rounded(scene, dt, measure)
        if found is None or len(scene.bodies) == 2:
            return found
        first = next(k for k, body in enumerate(scene.bodies) if body.motion == "free")
        x, y, *others = scene.bodies[first].pose
        bodies = list(scene.bodies)
        bodies[first] = replace(bodies[first], pose=(x, y + 2.0 * UNIT * size_across(scene), *others))
        moved = rounded(replace(scene, bodies=tuple(bodies)), dt, measure)
        return found if moved is not None and abs(moved[0] - found[0]) <= EITHER * max(1.0, abs(found[0])) else None

    return law


DEVIATIONS: tuple[Deviation, ...] = deviations(
    "newton_kamino",
    PROFILES,
    BLOWS,
    blow_law,
    "the step of a blow removes a share of the overlap by adding velocity (none in `tuned`); velocities are solved to "
    "1e-6 or 1e-5 m/s and are in single precision",
    "ConstraintStabilizationConfig, gamma; PADMMSolverConfig, DVISolverConfig, tolerance; motion in "
    "adapters/law/single_precision.py",
    _RELEASES,
)
DEVIATIONS += deviations(
    "newton_kamino",
    ("default", "tuned"),
    {"oblique": ("forward_speed",)},
    blow_law,
    "friction of a blow is limited by all of its impulse, with that of the overlap; velocities are solved to 1e-6 m/s",
    "ConstraintStabilizationConfig, gamma; motion in adapters/law/single_precision.py",
    _RELEASES,
)
DEVIATIONS += deviations(
    "newton_kamino",
    PROFILES,
    {scene: ("out_of_plane",) for scene in ("flat_box", "closing_wall", "edge_drop", "kane", "galperin", "rod_gas")},
    lambda metric, profile: plane_law,
    "single precision rounds differently on both sides of a plane",
    f"{_SOURCE}; band in adapters/law/single_precision.py",
    _RELEASES,
)
DEVIATIONS += deviations(
    "newton_kamino",
    ("tuned",),
    {"edge_drop": ("rise", "spin", "impulse")},
    lambda metric, profile: corner_law(metric, lambda scene, dt: (1.0, 0.0), 0.0),
    "single precision, 2^-24 relative",
    f"{_SOURCE}; motion in adapters/law/single_motions.py",
    _RELEASES,
)
DEVIATIONS += deviations(
    "newton_kamino",
    PROFILES,
    {"thin_wall": ("rebound_ratio", "beyond")},
    lambda metric, profile: passing_law(metric, PLACES),
    "there is no swept collision detection: a contact counts from the overlap on, and no step ends with the ball in "
    "the plate",
    "ConstrainedDynamicsConfig, cull_speculative_contacts; motion in adapters/law/unswept.py",
    _RELEASES,
)
DEVIATIONS += standstills("newton_kamino", PROFILES, {"far_origin": ("stopping_distance",)}, _SOURCE, _RELEASES)
DEVIATIONS += rounded_motions(
    "newton_kamino",
    PROFILES,
    {
        "kept": {"rack": ("momentum_defect", "energy_defect", "asymmetry")},
        "flown": {"flight": ("fall", "fall_speed", "throw_speed", "throw_way", "heading_spread", "drift_across")},
    },
    _SOURCE,
    _RELEASES,
)
