"""A contact of MotrixSim as a spring, step by step: MuJoCo's, but for its damper."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from adapters.mujoco.contact_law import ContactLaw, Impedance

#: How far `Spring.rebound_ratio` is off from 0.1 m/s on: single precision rounds the place where a ball is found.
OFF = 5e-5


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
