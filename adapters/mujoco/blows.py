"""MuJoCo's contact law for a blow between bodies without a load: one recurrence of the closing speed.

For two bodies with a contact at a fixed point and normal, the closing speed u follows the scalar law of one contact:
with A the inverse mass at the point, ``du = dt A f``, ``f = (aref - a)/R``, ``R = (1 - d)/d s D/n``. D is the engine's
estimate of A, the sum of the bodies' translational inverse masses; n contacts side by side share the force. Central
blows have D = A; beside the centre the engine is softer by D/A, and a box that lands on four corners stiffer by 4. The
deviation from restitution is thus of order 1 - d.

    head_on      D = A, n = 1         off_centre   D < A, n = 1
    flat_box     D = A, n = 4         edge_drop    D < A, n = 2

Source: MuJoCo documentation, "Computation: constraint model", regulariser R and its estimate of the inverse inertia.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from adapters.mujoco.contact_law import ContactLaw
from adapters.scene import Body, Box, Disc, HalfSpace, Scene, Sphere
from adapters.stepping import step_count


@dataclass(frozen=True)
class Turning:
    """A bar that spins under a ball: its spin [rad/s], the ball's place over its centre [m], the ball's speed [m/s].

    ``moment`` [kg m^2] is the bar's, ``lightness`` [1/kg] the sum of both inverse masses.
    """

    spin: float
    arm: float
    height: float
    coming: float
    moment: float
    lightness: float

    def found(self, late: float) -> tuple[float, float]:
        """Closing speed along the bar's normal [m/s] and inverse mass there [1/kg], ``late`` [s] after they touch."""
        c, s = math.cos(self.spin * late), math.sin(self.spin * late)
        lever = self.arm * c + (self.height - self.coming * late) * s
        return self.coming * c + self.spin * lever, self.lightness + lever * lever / self.moment


@dataclass(frozen=True)
class Blow:
    """A blow of a scene.

    Parameters
    ----------
    gap, closing
        Gap [m] at the start and speed [m/s] with which it closes.
    inverse_mass, estimate
        A and D of the module's text [1/kg].
    contacts
        Number of contacts that share it.
    turning
        Rotation of the struck body meanwhile; None if it does not rotate.
    """

    gap: float
    closing: float
    inverse_mass: float
    estimate: float
    contacts: int
    turning: Turning | None = None

    def as_found(self, dt: float) -> Blow:
        """The blow at the first step that begins in it, where a rotating body has another lever arm and normal."""
        if self.turning is None:
            return self
        reached = self.gap / self.closing / dt
        struck, inverse_mass = self.turning.found((math.ceil(reached) - reached) * dt)
        return replace(self, gap=self.gap / self.closing * struck, closing=struck, inverse_mass=inverse_mass)

    @property
    def energy(self) -> float:
        """Energy of the closing speed, u^2/2A [J], the largest loss of a blow."""
        return 0.5 * self.closing**2 / self.inverse_mass

    def after(self, law: ContactLaw, steps: int, moved: float = 0.0) -> float:
        """Separation speed [m/s], for a gap that is ``moved`` [m] larger."""
        soft = replace(law, softness=law.softness * self.estimate / self.inverse_mass / self.contacts)
        gap, speed = self.gap + moved, -self.closing
        for _ in range(steps):
            gap, speed, _ = soft.advance(gap, speed, 0.0)
        return speed


def blow_of(scene: Scene) -> Blow | None:
    """The blow of a scene with two bodies that collide once without a load; None for other scenes."""
    if len(scene.bodies) != 2 or any(scene.gravity):
        return None
    d, (first, second) = scene.dimension, scene.bodies
    if isinstance(first.shape, HalfSpace) and isinstance(second.shape, Box) and any(second.pose[d if d == 2 else 4 :]):
        arm, below = edge_of(second)
        own = 1.0 / second.mass
        gap = second.pose[d - 1] - below - first.shape.offset
        return Blow(gap, -second.twist[d - 1], own + arm * arm / moment_of(second), own, 2)
    if isinstance(first.shape, HalfSpace) and isinstance(second.shape, Box):
        height, half = second.pose[d - 1], second.shape.half_extents[-1]
        return Blow(height - half - first.shape.offset, -second.twist[d - 1], 1.0 / second.mass, 1.0 / second.mass, 4)
    both = 1.0 / first.mass + 1.0 / second.mass
    if isinstance(second.shape, Disc | Sphere) and isinstance(first.shape, Disc | Sphere):
        gap = second.pose[0] - first.pose[0] - first.shape.radius - second.shape.radius
        return Blow(gap, first.twist[0] - second.twist[0], both, both, 1)
    if isinstance(second.shape, Disc | Sphere) and isinstance(first.shape, Box):
        gap = second.pose[d - 1] - first.pose[d - 1] - first.shape.half_extents[-1] - second.shape.radius
        arm = second.pose[0] - first.pose[0]
        coming, spin = first.twist[d - 1] - second.twist[d - 1], first.twist[2] if d == 2 else -first.twist[4]
        height = first.shape.half_extents[-1] + second.shape.radius
        bar = Turning(spin, arm, height, coming, moment_of(first), both)
        struck, inverse_mass = bar.found(0.0)
        return Blow(gap / coming * struck, struck, inverse_mass, both, 1, bar if spin else None)
    return None


def steps_of(scene: Scene, dt: float) -> int:
    """Steps of the whole scene."""
    return step_count(scene.duration, dt)


def metrics_of(scene: Scene, blow: Blow, after: float) -> dict[str, float]:
    """Metrics of a scene whose bodies separate with ``after`` [m/s], which determines everything else."""
    p, impulse = scene.params, (blow.closing + after) / blow.inverse_mass
    made: dict[str, Callable[[], dict[str, float]]] = {
        "head_on": lambda: {
            "rebound_ratio": after / blow.closing,
            "first_speed": p["v1"] - impulse / p["mass"],
            "second_speed": p["v2"] + impulse / (p["ratio"] * p["mass"]),
            "impulse": impulse,
        },
        "edge_drop": lambda: {
            "rise": impulse / p["mass"] - p["v"],
            "spin": impulse * edge_of(scene.bodies[1])[0] / moment_of(scene.bodies[1]),
            "impulse": impulse,
        },
        "flat_box": lambda: {"rebound_ratio": after / blow.closing, "impulse": impulse},
        "off_centre": lambda: {
            "ball_speed": impulse / p["mass"] - p["v"],
            "bar_speed": p["rise"] - impulse / (p["ratio"] * p["mass"]),
            "spin": impulse * p["offset"] / moment_of(scene.bodies[0]),
            "impulse": impulse,
            "energy_lost": 1.0 - (after / blow.closing) ** 2,
        },
    }
    found = made[scene.name]() if scene.name in made else {}
    # Where a body turns, everything except the lost share depends on the phase of the step.
    return {"energy_lost": found["energy_lost"]} if blow.turning and found else found


def moment_of(body: Body) -> float:
    """Moment of inertia about the axis across the plane of motion [kg m^2]."""
    return body.inertia[1] if isinstance(body.inertia, tuple) else body.inertia


def edge_of(box: Body) -> tuple[float, float]:
    """Lowest edge of a box rotated in the plane of motion: along the floor from the centre, and below it [m]."""
    assert isinstance(box.shape, Box)
    turn = box.pose[2] if len(box.pose) == 3 else -2.0 * math.atan2(box.pose[5], box.pose[3])
    c, s = math.cos(turn), math.sin(turn)
    half = box.shape.half_extents
    corners = [(x * half[0], z * half[-1]) for x in (-1.0, 1.0) for z in (-1.0, 1.0)]
    x, z = min(((c * x - s * z, s * x + c * z) for x, z in corners), key=lambda place: place[1])
    return x, -z
