"""Designed deviations of MotrixSim from the textbook, predicted from scene and step only."""

from __future__ import annotations

from collections.abc import Mapping

from adapters.law import Deviation, Law, Measure, Prediction, deviations, settings_of
from adapters.law.moved_starts import EITHER, PERTURBATIONS, scale_of
from adapters.law.single_motions import corner_law, rounded_motions, standstills
from adapters.law.single_precision import PLACES, ROUNDINGS, UNIT, Method, plane_law, rounded_law
from adapters.law.unswept import passing_law
from adapters.mujoco.blows import blow_of, metrics_of
from adapters.mujoco.motions import is_vertical
from adapters.mujoco.motrixsim.profiles import PROFILES
from adapters.mujoco.motrixsim.springs import Spring
from adapters.mujoco.predictions import ball_metrics
from adapters.scene import Disc, Scene, Sphere
from adapters.stepping import step_count

_SOURCE, _RELEASES = "motrixsim.real_dtype(): float32", ("0.10.",)
#: Metrics of blows without gravity, by scene, of hard contacts that correct no overlap.
BLOWS: Mapping[str, tuple[str, ...]] = {
    "impact": ("rebound_ratio", "rebound_speed", "velocity_change", "impulse", "momentum_defect"),
    "head_on": ("rebound_ratio", "first_speed", "second_speed", "impulse", "momentum_defect"),
    "off_centre": ("ball_speed", "bar_speed", "spin", "energy_lost", "impulse", "momentum_defect"),
    "stacked_balls": ("small_speed", "large_speed", "energy_lost"),
    "cradle": ("momentum_defect", "energy_defect", *(f"speed[{k}]" for k in range(1, 6))),
    "galperin": ("small_speed", "large_speed", "energy_defect"),
    "oblique": ("rebound_ratio", "forward_speed", "spin_speed"),
    "pair_matrix": tuple(f"{name}[{k}]" for k in range(1, 5) for name in ("restitution", "friction")),
    "closing_wall": ("speed[1]", "speed[2]", "speed[3]"),
    "rod_gas": ("wrong_speed", "energy_defect", "misplaced"),
}
#: Metrics of balls on a floor and of blows, by scene, of springs.
SPRINGS: Mapping[str, tuple[str, ...]] = {
    "impact": BLOWS["impact"],
    "bounce": (*(f"apex[{n}]" for n in range(1, 6)), "apex_interval_ratio", "apex_growth", "rest_time"),
    "head_on": BLOWS["head_on"][:-1],
}


def spring_law(metric: str, profile: str) -> Law:
    """A ball on a floor, or a blow without rotation, from several starts that differ by round-off."""

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        settings, blow, steps = (
            settings_of(PROFILES[profile], scene, dt),
            blow_of(scene),
            step_count(scene.duration, dt),
        )
        ball = len(scene.bodies) == 2 and isinstance(scene.bodies[1].shape, Disc | Sphere) and is_vertical(scene)
        if settings["erp"] is not None or not (ball or blow):
            return None
        spring = Spring.of_settings(settings, dt)
        fastest = max(max(map(abs, body.twist)) for body in scene.bodies)

        def read(moved: float) -> float | None:
            if ball:
                return ball_metrics(scene, measure, spring, moved)[metric][0]
            return metrics_of(scene, blow, blow.after(spring, steps, moved)).get(metric) if blow else None

        # Places are up to a metre and a half.
        value, *others = (read(k * ROUNDINGS * UNIT) for k in (0.0, *PERTURBATIONS))
        spread = [abs(other - value) for other in others if value is not None and other is not None]
        if value is None or len(spread) < len(others) or max(spread) > EITHER * scale_of(scene, metric):
            return None
        return value, 2.0 * max(spread) + ROUNDINGS * UNIT * max(scale_of(scene, metric), fastest)

    return law


def blow_law(metric: str, profile: str) -> Law:
    """Blows of hard contacts; with friction across both of its axes, whose limits are a square, only the rebound."""
    rounded = rounded_law(metric, Method(lambda e, speed: e))

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        slanted = scene.dimension == 3 and any(body.twist[0] and body.twist[1] for body in scene.bodies)
        rough = any(friction for _, friction in scene.materials())
        return None if slanted and rough and metric != "rebound_ratio" else rounded(scene, dt, measure)

    return law


DEVIATIONS: tuple[Deviation, ...] = deviations(
    "motrixsim",
    ("tuned",),
    BLOWS,
    blow_law,
    "single precision, 2^-24 relative",
    f"{_SOURCE}; motion in adapters/law/single_precision.py",
    _RELEASES,
)
DEVIATIONS += deviations(
    "motrixsim",
    ("default",),
    SPRINGS,
    spring_law,
    "contact is a critically damped spring (0.02 s) that never pulls, and e is none of its parameters",
    "msd.ConstraintForceModel, impedance; motion in adapters/mujoco/motrixsim/springs.py",
    _RELEASES,
)
DEVIATIONS += deviations(
    "motrixsim",
    PROFILES,
    {scene: ("out_of_plane",) for scene in ("off_centre", "oblique", "pair_matrix", "flat_box")},
    lambda metric, profile: plane_law,
    "single precision rounds differently on both sides of a plane",
    f"{_SOURCE}; band in adapters/law/single_precision.py",
    _RELEASES,
)
DEVIATIONS += deviations(
    "motrixsim",
    PROFILES,
    {"thin_wall": ("rebound_ratio", "beyond")},
    lambda metric, profile: passing_law(metric, PLACES),
    "there is no swept collision detection: no step ends with the ball in the plate, so the contact is never found",
    "measured with 0.10.1; motion in adapters/law/unswept.py",
    _RELEASES,
)
DEVIATIONS += deviations(
    "motrixsim",
    ("tuned",),
    {"edge_drop": ("rise", "spin", "impulse")},
    lambda metric, profile: corner_law(metric, lambda scene, dt: (1.0, 0.0), 0.0),
    "single precision, 2^-24 relative",
    f"{_SOURCE}; motion in adapters/law/single_motions.py",
    _RELEASES,
)
DEVIATIONS += deviations(
    "motrixsim",
    ("default",),
    {"head_on": ("momentum_defect",)},
    blow_law,
    "single precision, 2^-24 relative",
    f"{_SOURCE}; motion in adapters/law/single_precision.py",
    _RELEASES,
)
DEVIATIONS += standstills("motrixsim", PROFILES, {"far_origin": ("stopping_distance",)}, _SOURCE, _RELEASES)
DEVIATIONS += rounded_motions(
    "motrixsim",
    PROFILES,
    {
        "kept": {"cradle": ("momentum_defect",), "rack": ("momentum_defect",)},
        "booked": {"off_centre": ("momentum_defect",), "impact": ("momentum_defect",)},
        "flown": {
            "flight": ("fall", "fall_speed", "throw_speed", "throw_way", "heading_spread", "drift_across", "ball_spin")
        },
    },
    _SOURCE,
    _RELEASES,
)
