"""Contacts of MotrixSim as springs, step by step: balls on a floor, and blows without a load.

Bodies, blows and records are those of MuJoCo's laws (`adapters.mujoco.predictions`); the force is another.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from adapters.law import Law, Measure, Prediction, settings_of
from adapters.law.moved_starts import PERTURBATIONS, scale_of
from adapters.law.single_precision import ROUNDINGS, UNIT
from adapters.mujoco.blows import blow_of, metrics_of
from adapters.mujoco.contact_law import ContactLaw, Impedance
from adapters.mujoco.motions import is_vertical
from adapters.mujoco.motrixsim.profiles import PROFILES
from adapters.mujoco.predictions import ball_metrics
from adapters.scene import Disc, Scene, Sphere
from adapters.stepping import step_count

#: How far `Spring.rebound_ratio` is off from 0.1 m/s on: single precision rounds the place where a ball is found.
OFF = 5e-5
#: Part of a metric's scale by which moved starts may change it for a prediction.
EITHER = 1e-2


class Spring(ContactLaw):
    """One contact, with the impedance d of ``solimp``, up to D, and the velocity after a step of load g.

        v' = v + (1 - d) g dt - ((d/D)^2 k x + d/D b v') dt

    while it pushes [measured]; k = 1/(T z)^2 and b = 2/T of ``solref`` (T, z), for any mass. MuJoCo's has v for v'.
    """

    @classmethod
    def of_settings(cls, settings: Mapping[str, Any], dt: float) -> Spring:
        """Spring of a profile's settings."""
        time, ratio = settings["solref"]
        return cls(dt, 2.0 / time, (time * ratio) ** -2, Impedance.of(settings["solimp"]), 1.0, settings["margin"])

    def force(self, gap: float, velocity: float, load: float) -> float:
        """See `ContactLaw.force`."""
        overlap = gap - self.margin
        if overlap >= 0.0:
            return 0.0
        d = self.impedance(overlap)
        share = d / self.impedance.deep
        push = -(share**2) * self.stiffness * overlap + (1.0 - d) * load
        after = (velocity + self.dt * push) / (1.0 + share * self.damping * self.dt)
        return max(0.0, (after - velocity) / self.dt - load)


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
