"""MuJoCo's documented contact law for one body on one plane, as an exact scalar recurrence.

    gap r, normal velocity v, acceleration without contact a0, one contact, no rotation

    if r < 0:  aref = -b v - k d(r) r                       spring and damper of `solref`
               f    = max(0, (aref - a0) / (1 + s (1 - d)/d))   per unit of mass
    v <- v + h (a0 + f),   r <- r + h v                     semi-implicit Euler

s = 1 for frictionless and elliptic contacts. The pyramidal cone replaces the normal by four edges ``n +- mu t`` that
share one regulariser; together they act like a normal with s = mu^2 (1 + mu^2)/2. Nothing here runs the engine: the
adapter uses the law for declarations, contact laws use it for predictions.

Sources: MuJoCo documentation, "Modeling: solver parameters" (impedance, reference; equations solref_standard and
solref_direct) and "Computation: constraint model"; the factor of the pyramid follows from writing the four edge rows
of equal regulariser R_edge = 2 mu^2 R_row, R_row built on the edge's own diagonal (1 + mu^2)/m, as one row.
"""

from __future__ import annotations

from dataclasses import dataclass

from adapters.mujoco.shipped import IMPEDANCE_RANGE, SMALLEST_FRICTION


@dataclass(frozen=True)
class Impedance:
    """``solimp``: impedance d as a function of depth.

    Parameters
    ----------
    at_surface, deep
        d at depth 0 and from ``width`` [m] on.
    midpoint, power
        Inflection (fraction of the width) and exponent of the spline between them.
    """

    at_surface: float
    deep: float
    width: float
    midpoint: float
    power: float

    @classmethod
    def of(cls, solimp: tuple[float, ...]) -> Impedance:
        """Read the five numbers, clamped as MuJoCo clamps them."""
        low, high = IMPEDANCE_RANGE
        surface, deep = (min(max(d, low), high) for d in solimp[:2])
        return cls(surface, deep, *solimp[2:])

    def __call__(self, gap: float) -> float:
        """Impedance at ``gap`` [m]."""
        x = abs(gap) / self.width
        if x >= 1.0 or self.at_surface == self.deep:
            return self.deep
        if self.power == 1.0:
            y = x
        elif x <= self.midpoint:
            y = x**self.power / self.midpoint ** (self.power - 1.0)
        else:
            y = 1.0 - (1.0 - x) ** self.power / (1.0 - self.midpoint) ** (self.power - 1.0)
        return self.at_surface + y * (self.deep - self.at_surface)


def softness_of(cone: str, condim: int, mu: float) -> float:
    """Factor s of the regulariser: 1, or that of a pyramid."""
    if cone != "pyramidal" or condim == 1:
        return 1.0
    mu = max(mu, SMALLEST_FRICTION)
    return 0.5 * mu**2 * (1.0 + mu**2)


@dataclass(frozen=True)
class ContactLaw:
    """The scalar law of one contact at step ``dt`` [s].

    ``damping`` b [1/s] and ``stiffness`` k [1/s^2] of aref; ``softness`` is s of the module's text;
    contact acts at gaps below ``margin`` [m] and counts r from there.
    """

    dt: float
    damping: float
    stiffness: float
    impedance: Impedance
    softness: float
    margin: float = 0.0

    @classmethod
    def of(
        cls,
        dt: float,
        solref: tuple[float, float],
        solimp: tuple[float, ...],
        softness: float,
        margin: float = 0.0,
    ) -> ContactLaw:
        """Law of a contact with these parameters; ``softness`` as `softness_of` gives it."""
        impedance = Impedance.of(solimp)
        deep = impedance.deep
        if solref[0] > 0.0:
            time_constant = max(solref[0], 2.0 * dt)  # "refsafe": never stiffer than two steps
            damping = 2.0 / (deep * time_constant)
            stiffness = 1.0 / (deep * time_constant * solref[1]) ** 2
        else:
            damping, stiffness = -solref[1] / deep, -solref[0] / deep**2
        return cls(dt, damping, stiffness, impedance, softness, margin)

    def force(self, gap: float, velocity: float, load: float) -> float:
        """Contact force per unit of mass [m/s^2]; ``load`` is the acceleration without it."""
        overlap = gap - self.margin
        if overlap >= 0.0:
            return 0.0
        d = self.impedance(overlap)
        reference = -self.damping * velocity - self.stiffness * d * overlap
        return max(0.0, (reference - load) / (1.0 + self.softness * (1.0 - d) / d))

    def advance(self, gap: float, velocity: float, load: float) -> tuple[float, float, float]:
        """Gap, velocity after one step, and the contact's velocity change in it [m/s]."""
        change = self.dt * self.force(gap, velocity, load)
        velocity = velocity + self.dt * load + change
        return gap + self.dt * velocity, velocity, change

    def rebound_ratio(self, speed: float, phase: float, duration: float = 1.0) -> float:
        """Speed after over speed before, without load, the surface crossed ``phase`` steps (0, 1] before a step ends.

        ``duration`` [s] bounds the contact time.
        """
        gap, velocity, time = -phase * self.dt * speed, -speed, 0.0
        while gap < self.margin and time < duration:
            gap, velocity, _ = self.advance(gap, velocity, 0.0)
            time += self.dt
        return velocity / speed
