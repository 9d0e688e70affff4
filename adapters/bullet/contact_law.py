"""Bullet's contact law for one ball over a fixed face, as a scalar recurrence.

    gap d, velocity v (up), pull g (down)                                       one step of dt
      d < reach and d <= solved_gap ?                            contact seen at the old gap
      free velocity      u = v - g dt - k (1 + |v|) v dt         (k: drag of the multibody path)
      rebound            r = e max(0, -s) if |s| >= threshold    s = u (multibody) or v (rigid body)
      target             r - (d + slop)/dt          if d > -slop: closing the gap counts as a velocity
                         r - erp (d + slop)/dt      else: Baumgarte, or a push velocity for this step only
      v <- max(u, target),   d <- d + (v + push) dt

It needs neither Bullet nor a scene; its parameters come from a profile's settings (`ContactLaw.of`). The adapter
declares the rebounds of its profiles with it, and the deviation laws explain results by it. Sources: bullet3 at
6c888f4, btSequentialImpulseConstraintSolver.cpp:890-970 (rigid body), btMultiBodyConstraintSolver.cpp:770-815 and
btMultiBody.cpp:843 (multibody).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from adapters.bullet.shipped import (
    BREAKING_THRESHOLD,
    DAMPING,
    ERP,
    LARGEST_SPEED,
    RESTITUTION_THRESHOLD,
    SLOP,
    SPLIT_DEPTH,
)

#: Number of phases of a step for a range of rebounds.
PHASES = 64
Range = tuple[float, float]


@dataclass(frozen=True)
class ContactLaw:
    """Parameters of the recurrence; `of` takes them from settings.

    Parameters
    ----------
    multibody
        Restitution acts on the velocity after gravity and drag instead of the one before.
    damping
        Drag [1/s] and [1/m]: a body loses ``damping (1 + |v|) v`` of speed per second.
    erp
        Fraction of an overlap corrected per step.
    slop
        Overlap without correction [m].
    threshold
        Approach speed below which there is no rebound [m/s].
    solved_gap
        Contacts at larger gaps are seen but not solved [m].
    split_depth
        Overlaps at least this deep are corrected by a velocity for one step only [m].
    largest_speed
        Velocities are clamped to this after a step [m/s].
    breaking
        A contact is seen below this share of the smaller shape's bounding radius.
    """

    multibody: bool
    damping: float
    erp: float
    slop: float
    threshold: float
    solved_gap: float
    split_depth: float
    largest_speed: float
    breaking: float

    @classmethod
    def of(cls, settings: Mapping[str, Any]) -> ContactLaw:
        """Law of a ball under ``settings``; other parameters are as shipped.

        The multibody path splits no impulses, the rigid-body path clamps no velocities.
        """
        multibody = not settings.get("useMaximalCoordinates", 0)
        split_depth = settings.get("splitImpulsePenetrationThreshold", SPLIT_DEPTH)
        return cls(
            multibody=multibody,
            damping=settings.get("linearDamping", DAMPING),
            erp=settings.get("contactERP", ERP),
            slop=settings.get("contactSlop", SLOP),
            threshold=settings.get("restitutionVelocityThreshold", RESTITUTION_THRESHOLD),
            solved_gap=settings.get("contactProcessingThreshold", math.inf),
            split_depth=math.inf if multibody else split_depth,
            largest_speed=LARGEST_SPEED if multibody else math.inf,
            breaking=settings.get("contactBreakingThreshold", BREAKING_THRESHOLD),
        )

    def drag(self, speed: float, dt: float) -> float:
        """Loss of velocity in one step of a body (or of spin) at ``speed`` [m/s]."""
        return self.damping * (1.0 + abs(speed)) * speed * dt

    def contact(self, gap: float, before: float, free: float, e: float, dt: float) -> tuple[float, float]:
        """Velocity after the contact, and the velocity that only moves the body in this step [m/s].

        Parameters
        ----------
        gap
            Clearance before the step [m].
        before, free
            Velocity at the start of the step, and with gravity and drag but without contact [m/s].
        """
        sampled = free if self.multibody else before
        rebound = e * max(0.0, -sampled) if abs(sampled) >= self.threshold else 0.0
        separation = gap + self.slop
        if separation > 0.0:
            return max(free, rebound - separation / dt), 0.0
        correction = -self.erp * separation / dt
        if separation <= -self.split_depth:
            return max(free, rebound), correction
        return max(free, rebound + correction), 0.0


@dataclass(frozen=True)
class Fall:
    """Samples of one ball: clearance [m], velocity [m/s] (both at 0..steps) and contact impulse over mass [m/s]."""

    gap: NDArray[np.float64]
    velocity: NDArray[np.float64]
    impulse: NDArray[np.float64]


def fall(law: ContactLaw, radius: float, gap: float, velocity: float, e: float, g: float, dt: float, n: int) -> Fall:
    """Follow a ball of ``radius`` [m] for ``n`` steps of ``dt`` [s]."""
    reach = law.breaking * math.sqrt(3.0) * radius  # a sphere's bounding radius is that of its bounding cube
    gaps, velocities, impulses = [gap], [velocity], [0.0]
    for _ in range(n):
        free = velocity - g * dt - law.drag(velocity, dt)
        after, push = free, 0.0
        if gap < reach and gap <= law.solved_gap:
            after, push = law.contact(gap, velocity, free, e, dt)
        impulses.append(after - free)
        velocity = max(-law.largest_speed, min(law.largest_speed, after))
        gap += (velocity + push) * dt
        gaps.append(gap)
        velocities.append(velocity)
    return Fall(np.array(gaps), np.array(velocities), np.array(impulses))


def loss_in_one_second(law: ContactLaw, dt: float) -> float:
    """Share of 1 m/s (or 1 rad/s) lost by drag in a second of flight."""
    steps, speed = min(max(8, round(1.0 / dt)), 1000), 1.0
    for _ in range(steps):
        speed -= law.drag(speed, dt)
    left: float = speed ** (1.0 / (steps * dt))
    return 1.0 - left


def drag_share(law: ContactLaw, speed: float, braking: float, dt: float, time: float) -> float:
    """Speed lost by drag in a slide, relative to that lost by friction.

    Parameters
    ----------
    speed
        At the start [m/s]; the slide does not stop within ``time`` [s].
    braking
        Deceleration by friction [m/s^2].
    """
    lost, steps = 0.0, math.ceil(time / dt - 1e-9)
    for _ in range(steps):
        drag = law.drag(speed, dt)
        lost += drag
        speed -= braking * dt + drag
    return lost / (braking * steps * dt)


@lru_cache(maxsize=256)
def rebound_range(law: ContactLaw, radius: float, v: float, e: float, dt: float, lead: float, time: float) -> Range:
    """Least and greatest v+/v, over the phases of a step, of a ball that starts ``lead`` steps above a face.

    Parameters
    ----------
    time
        Time of the speed after the start [s].

    Returns ------- (least, greatest), widened for values between two phases: within a phase interval the gap changes by
    ``v dt / PHASES``, hence ``gap/dt`` by ``v / PHASES``, in the braking step and in the one before.
    """
    steps = math.ceil(time / dt - 1e-9)
    gaps = [(lead + (k + 0.5) / PHASES) * v * dt for k in range(PHASES)]
    ratios = [float(fall(law, radius, gap, -v, e, 0.0, dt, steps).velocity[-1]) / v for gap in gaps]
    return min(ratios) - 2.0 / PHASES, max(ratios) + 2.0 / PHASES
