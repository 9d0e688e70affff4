"""Tolerances that scenes share, each with its reason.

A bound is derived from the scene and the step: truth + step + round-off. It depends neither on the engine nor on an
iteration count. A bound of a single scene is derived in that scene's file; bounds of several scenes are here.

Natural units of a step of length dt under gravity g
    x1 = g dt^2     the distance that one step of free fall adds
    v1 = g dt       the speed that one step of free fall adds
A fixed-step method that finds contact at the end of a step has errors of a few of these.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from adapters.scene import Scene
from adapters.scene.lift import size_across
from adapters.scene.shapes import reach
from validation.canonical import Check
from validation.metrics import OUT_OF_PLANE

#: A thousand velocity updates of one unit of round-off (2.2e-16) each, and a factor of five for the order of additions:
#: the error of a result that is exact at every step length.
ROUND_OFF = 1e-12
#: Growth of a disturbance up to which doubles resolve a motion: the horizon of the reference's certificate
#: (`reference_solver.certificate.truth.GROWTH`).
GROWTH = 1e3
#: A body slower than this share of v1 counts as at rest: in a hundred steps it moves less than one step of free fall.
STILL = 0.01
#: A fixed-step method cannot separate impacts within this many steps: one step finds the first, late, the next moves
#: the bodies apart, and the second is found late as well.
APART = 4.0
#: Loads and energies at rest are averaged over this time at the end [s].
WINDOW = 1.0


@dataclass(frozen=True)
class Bound:
    """How far a value may be from its truth, in its own unit, and why."""

    value: float
    because: str

    def check(self, metric: str, unit: str, truth: float, source: str) -> Check:
        """The check of one metric with this bound; ``source`` is where its truth comes from."""
        return Check(metric, unit, truth, self.value, self.because, source)


# ---- laws that hold exactly at every step length ----


def exact(scale: float = 1.0) -> Bound:
    """A law that holds at every dt; ``scale`` is the size of the numbers that are added, in the metric's unit."""
    return Bound(ROUND_OFF * scale, "exact law at every dt: only round-off of at most 1000 velocity updates remains")


def exact_laws(scales: Mapping[str, tuple[str, float]], truth: Mapping[str, float], source: str) -> list[Check]:
    """One `exact` check per metric; ``scales``: its unit and the size of the numbers that are added."""
    return [exact(scale).check(name, unit, truth[name], source) for name, (unit, scale) in scales.items()]


def bookkeeping(scale: float = 1.0) -> Bound:
    """Sums that are equal by a conservation law, whatever the contact law."""
    return Bound(ROUND_OFF * scale, "impulses must sum to m dv up to round-off, whatever the contact law")


def planar(scene: Scene, dt: float, growth: float = 1.0) -> Check:
    """Largest distance of a 2-D scene from its plane [m] on a 3-D engine.

    A 2-D scene embedded in 3-D is symmetric about the plane y = 0, and so are gravity and loads. A symmetric contact
    law preserves that symmetry at every step: every y stays 0. What remains is the round-off of positions and of
    distances in free flight, which a motion may amplify: up to `GROWTH` times, or by ``growth`` where the scene states
    more. Round-off can also make one of two mirrored contacts begin a step before the other: one step of a force across
    the plane, as in `straight`, with the largest load over the mass in the place of gravity where there is none. Where
    round-off may grow to a hundredth of the smallest free body (a tilt of half a degree) nothing is judged.
    """
    size, most = size_across(scene), max(growth, GROWTH)
    smallest = min((reach(body.shape) for body in scene.bodies if body.motion == "free"), default=size)
    if not ROUND_OFF * most * size <= 0.01 * smallest:
        why = (
            f"not judged: round-off of {size:.2g} m, amplified {_count(most)} times, is more than a hundredth of a body"
        )
        return Check(OUT_OF_PLANE, "m", None, None, why, "")
    gravity = math.hypot(*scene.gravity)
    loads = (math.hypot(*body.force) / body.mass for body in scene.bodies if body.motion == "free")
    pull = gravity or max(loads, default=0.0)
    step, what = pull * (dt * dt), "g dt^2" if gravity or not pull else "F dt^2/m"
    because = (
        f"mirror symmetry: one step of a force across the plane, {what}, and round-off amplified {_count(most)} times"
    )
    source = "a 2-D scene embedded in 3-D is symmetric about its plane"
    return Check(OUT_OF_PLANE, "m", 0.0, step + ROUND_OFF * most * size, because, source)


def _count(times: float) -> str:
    return f"{times:.0f}" if times < 1e5 else f"{times:.2g}"


def saddle(exponent: float) -> float:
    """Growth of a deviation that starts from rest at a saddle, y'' = r^2 y, in ``exponent`` = r t.

    The exponent is limited to 700, where doubles overflow; nothing is judged long before.
    """
    return math.cosh(min(exponent, 700.0))


# ---- bodies at rest ----


def slips(interfaces: int, g: float, dt: float) -> Bound:
    """Drift [m] of a body above ``interfaces`` contacts: the sum of the slips below it."""
    because = "each of n interfaces may slip by one step of free fall, and slips add up: n g dt^2"
    return Bound(interfaces * (g * dt * dt), because)


def found_late(g: float, dt: float, place: float) -> Bound:
    """Overlap [m] of one contact; ``place`` [m] is the coordinate whose round-off limits it.

    An overlap belongs to one interface: if its contact is missing for one step (it starts at a gap of exactly 0, which
    may count as open), the upper body falls relative to the lower one with at most the full g, since the lower one is
    held or falls too, and adds x1. The next step finds the contact; more than x1 needs a contact that was missing
    twice or held too little.
    """
    because = "one interface whose contact is found one step late: one step of free fall, g dt^2, whatever lies above"
    return Bound(g * dt * dt + ROUND_OFF * place, because)


def landed(speed: float, g: float, dt: float, place: float) -> Bound:
    """Position [m] of a body that came to rest by an impact at ``speed`` [m/s]; ``place`` [m] as in `found_late`.

    The impact is found up to one step late, speed dt deep, and a solver need not correct the overlap.
    """
    because = "the impact is found up to one step late, v dt deep, and the rest one more step of free fall: + g dt^2"
    return Bound(speed * dt + g * dt * dt + ROUND_OFF * place, because)


def still_energy(mass: float, g: float, dt: float) -> Bound:
    """Kinetic energy [J] of bodies at rest with a total ``mass``."""
    because = "n bodies slower than the limit of motion, v1/100 = g dt/100"
    return Bound(0.5 * mass * (STILL * (g * dt)) ** 2, because)


def settled(interfaces: int, dt: float, duration: float) -> Bound:
    """Time [s] until bodies that start at rest on ``interfaces`` contacts are at rest again."""
    because = "moving at v1/100 for longer would use up the drift of n g dt^2; and the last second must be at rest"
    return Bound(min(interfaces / STILL * dt, duration - WINDOW), because)


def carried(dt: float, window: float | None = None) -> Bound:
    """Mean load over ``window`` [s], by default the last `WINDOW`, relative to the weight above."""
    when = "the last second" if window is None else f"{window:.2g} s"
    because = f"bodies slower than v1/100 before and after {when} leave 2 v1/100 of momentum unaccounted"
    return Bound(2.0 * STILL * dt / (window or WINDOW), because)


def steady() -> Bound:
    """Load of any one step, and so its standard deviation from step to step, relative to the weight above."""
    because = "a body slower than v1/100 changes its momentum by at most 2 m v1/100 a step"
    return Bound(2.0 * STILL, because)


def load(
    name: str, dt: float, truth: Mapping[str, float], source: str, window: float | None = None, share: float = 1.0
) -> list[Check]:
    """Checks of a load over time (`metrics.over_time`): its mean over ``window`` [s], and the least and the greatest.

    Only those in ``truth``. ``share``: the weight above over the reference of the load.
    """
    allowed = {"mean": carried(dt, window), "least": steady(), "greatest": steady()}
    found = [(f"{name}[{by}]", Bound(share * bound.value, bound.because)) for by, bound in allowed.items()]
    return [bound.check(metric, "1", truth[metric], source) for metric, bound in found if metric in truth]


# ---- rebounds ----


def rebound_late(e: float, speed: float, dt: float) -> float:
    """Error [m] of the height after one rebound at ``speed`` [m/s] whose impact is found within a step.

    A fixed-step method finds the ball at a depth within (0, v dt], which costs (1 - e^2) v dt of height, and has speeds
    to half a step of gravity, which costs e (1 + e) v dt / 2.
    """
    return (1.0 - e * e + 0.5 * e * (1.0 + e)) * speed * dt


# ---- sticking and sliding ----


def straight(g: float, dt: float, way: float) -> Bound:
    """Distance [m] from a straight line of a body that slides or rolls ``way`` [m] along it."""
    return Bound(g * dt * dt + ROUND_OFF * way, "one step of a force across the path: g dt^2")


def stuck(g: float, dt: float, duration: float) -> Bound:
    """Mean speed [m/s] of a sticking body."""
    because = "a sticking box may move by one step of free fall, g dt^2, over the whole run"
    return Bound(g * dt * dt / duration, because)


def driven(g: float, dt: float, window: float) -> Bound:
    """Mean acceleration [m/s^2] over ``window`` seconds under constant forces."""
    because = "constant force is exact in every scheme: only motion below v1/100 = g dt/100 is forgiven"
    return Bound(STILL * g * dt / window, because)
