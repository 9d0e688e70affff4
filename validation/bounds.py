"""The vocabulary of stated tolerances: bounds that scenes owe, each with the reason for it.

A bound is derived from the scene and the step alone: truth + step + round-off. It cannot see which engine is judged,
and an iteration count earns no allowance. What only one scene owes is derived in that scene's file; what several owe
stands here, once.

Natural units of a step of length dt under gravity g
    x1 = g dt^2     the distance that one step of free fall adds
    v1 = g dt       the speed that one step of free fall adds
A fixed-step method that locates contact within a step cannot be asked for less than a few of these.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from adapters.lift import size_across
from adapters.scene import Scene
from adapters.shapes import reach
from validation.canonical import Check
from validation.metrics import OUT_OF_PLANE

#: A thousand velocity updates of one unit of round-off (2.2e-16) each, and a factor of five for the order of
#: additions: what is left of an answer that has an exact law at every step length.
ROUND_OFF = 1e-12
#: Growth of a disturbance up to which a motion can be told in doubles: the horizon of the reference's certificate
#: (`reference_solver.certificate.truth.GROWTH`).
GROWTH = 1e3
#: A body slower than this share of v1 does not move: in a hundred steps it gains less than one step of free fall.
STILL = 0.01
#: Impacts that follow each other within this many steps are one to a method of fixed steps: one step finds the first,
#: late, the next moves the bodies apart, and the second is found late as well.
APART = 4.0
#: Loads and energies of what stands are averaged over this much time at the end [s].
WINDOW = 1.0


@dataclass(frozen=True)
class Bound:
    """How far a value may be from its truth, in its own unit, and why."""

    value: float
    because: str

    def check(self, metric: str, unit: str, truth: float, source: str) -> Check:
        """The check of one metric with this bound; ``source`` is where its truth comes from."""
        return Check(metric, unit, truth, self.value, self.because, source)


# ---- answers that every step length gives exactly ----


def exact(scale: float = 1.0) -> Bound:
    """A law that holds at every dt; ``scale`` is the size of the numbers that are added, in the metric's unit."""
    return Bound(ROUND_OFF * scale, "exact law at every dt: only round-off of at most 1000 velocity updates remains")


def exact_laws(scales: Mapping[str, tuple[str, float]], truth: Mapping[str, float], source: str) -> list[Check]:
    """One `exact` check per metric; ``scales``: its unit and the size of the numbers that are added."""
    return [exact(scale).check(name, unit, truth[name], source) for name, (unit, scale) in scales.items()]


def bookkeeping(scale: float = 1.0) -> Bound:
    """Sums that a conservation law ties to each other, whatever the contact law."""
    return Bound(ROUND_OFF * scale, "impulses are bookkeeping: they must add up to m dv to round-off, whatever the law")


def planar(scene: Scene, dt: float, growth: float = 1.0) -> Check:
    """How far a planar scene may leave its plane [m] on an engine that lives in space.

    What is lifted is its own mirror image in the plane y = 0, and so are gravity and loads. A law of contact that does
    not tell left from right keeps a motion mirrored that begins so, at every step: every y stays 0. What remains is
    round-off of the numbers that are added, places and ways of free flight, which a motion may multiply: up to `GROWTH`
    times, or by ``growth`` where the scene knows that its own motion multiplies it by more. And of two contacts which
    mirror each other round-off lets one be found a step before the other: one step of a force across the plane, as in
    `straight`; where there is no gravity the largest load over the mass stands for it. Where round-off may grow to a
    hundredth of the smallest free body (a tilt of half a degree) nothing is judged.
    """
    size, most = size_across(scene), max(growth, GROWTH)
    smallest = min((reach(body.shape) for body in scene.bodies if body.motion == "free"), default=size)
    if not ROUND_OFF * most * size <= 0.01 * smallest:
        why = f"not judged: round-off of {size:.2g} m, grown {_count(most)} times, is more than a hundredth of a body"
        return Check(OUT_OF_PLANE, "m", None, None, why, "")
    gravity = math.hypot(*scene.gravity)
    loads = (math.hypot(*body.force) / body.mass for body in scene.bodies if body.motion == "free")
    pull = gravity or max(loads, default=0.0)
    step, what = pull * (dt * dt), "g dt^2" if gravity or not pull else "F dt^2/m"
    because = f"mirror symmetry: one step of a force across the plane, {what}, and round-off grown {_count(most)} times"
    source = "what is lifted is its own mirror image in its plane"
    return Check(OUT_OF_PLANE, "m", 0.0, step + ROUND_OFF * most * size, because, source)


def _count(times: float) -> str:
    return f"{times:.0f}" if times < 1e5 else f"{times:.2g}"


def saddle(exponent: float) -> float:
    """By how much what is off a saddle grows that leaves it from rest, y'' = r^2 y, in ``exponent`` = r t.

    Beyond 700, where a double ends, it is told as that: nothing is judged long before.
    """
    return math.cosh(min(exponent, 700.0))


# ---- what stands ----


def slips(interfaces: int, g: float, dt: float) -> Bound:
    """Drift [m] of what stands on ``interfaces`` contacts: a body's drift is the sum of the slips below it."""
    because = "each of n interfaces may slip by what one step of free fall adds, and slips add up: n g dt^2"
    return Bound(interfaces * (g * dt * dt), because)


def found_late(g: float, dt: float, place: float) -> Bound:
    """Overlap [m] of one contact; ``place`` [m] is the coordinate whose round-off it is told to.

    An overlap belongs to one interface: if its contact is missing for one step (it starts at a gap of exactly 0, which
    may count as open), the upper body falls relative to the lower one with at most the full g, since the lower one is
    held or falls too, and adds x1. The next step finds the contact; more than x1 needs a contact that was missing
    twice or held too little.
    """
    because = "one interface whose contact is found one step late: one step of free fall, g dt^2, whatever lies above"
    return Bound(g * dt * dt + ROUND_OFF * place, because)


def landed(speed: float, g: float, dt: float, place: float) -> Bound:
    """Place [m] of what came to rest by an impact at ``speed`` [m/s]; ``place`` [m] as in `found_late`.

    The impact is found up to one step late, speed dt deep, and nothing says that a solver must push out what it finds.
    """
    because = "the impact is found up to one step late, v dt deep, and the rest one more step of free fall: + g dt^2"
    return Bound(speed * dt + g * dt * dt + ROUND_OFF * place, because)


def still_energy(mass: float, g: float, dt: float) -> Bound:
    """Kinetic energy [J] of bodies of ``mass`` in all that do not move."""
    because = "n bodies below the speed that counts as motion, v1/100 = g dt/100"
    return Bound(0.5 * mass * (STILL * (g * dt)) ** 2, because)


def settled(interfaces: int, dt: float, duration: float) -> Bound:
    """Time [s] until what starts at rest on ``interfaces`` contacts is at rest again."""
    because = "moving at v1/100 for longer would use up the drift of n g dt^2; and the last second must be at rest"
    return Bound(min(interfaces / STILL * dt, duration - WINDOW), because)


def carried(dt: float, window: float | None = None) -> Bound:
    """Mean load over ``window`` [s], by default the last `WINDOW`, relative to the weight that is carried."""
    when = "the last second" if window is None else f"{window:.2g} s"
    because = f"bodies slower than v1/100 before and after {when} leave 2 v1/100 of momentum unaccounted"
    return Bound(2.0 * STILL * dt / (window or WINDOW), because)


def steady() -> Bound:
    """Load of any one step, and so its standard deviation from step to step, relative to the weight that is carried."""
    because = "a body slower than v1/100 changes its momentum by at most 2 m v1/100 a step"
    return Bound(2.0 * STILL, because)


def load(
    name: str, dt: float, truth: Mapping[str, float], source: str, window: float | None = None, share: float = 1.0
) -> list[Check]:
    """Checks of a load over time (`metrics.over_time`): its mean over ``window`` [s], and the least and the greatest.

    Those that ``truth`` names. ``share``: the weight that is carried over what the load is relative to.
    """
    allowed = {"mean": carried(dt, window), "least": steady(), "greatest": steady()}
    found = [(f"{name}[{by}]", Bound(share * bound.value, bound.because)) for by, bound in allowed.items()]
    return [bound.check(metric, "1", truth[metric], source) for metric, bound in found if metric in truth]


# ---- what bounces ----


def rebound_late(e: float, speed: float, dt: float) -> float:
    """Height [m] that one rebound at ``speed`` [m/s] may be off by, where its impact is found within a step.

    A fixed-step method finds the ball at a depth within (0, v dt], which costs (1 - e^2) v dt of height, and knows
    speeds to half a step of gravity, which costs e (1 + e) v dt / 2.
    """
    return (1.0 - e * e + 0.5 * e * (1.0 + e)) * speed * dt


# ---- what sticks or slides ----


def straight(g: float, dt: float, way: float) -> Bound:
    """Distance [m] from a straight line of what slides or rolls ``way`` [m] along it."""
    return Bound(g * dt * dt + ROUND_OFF * way, "one step of a force across the path: g dt^2")


def stuck(g: float, dt: float, duration: float) -> Bound:
    """Mean speed [m/s] of what sticks."""
    because = "a sticking box may move by what one step of free fall adds, g dt^2, over the whole run"
    return Bound(g * dt * dt / duration, because)


def driven(g: float, dt: float, window: float) -> Bound:
    """Mean acceleration [m/s^2] over ``window`` seconds under constant forces."""
    because = "constant force is exact in every scheme: only motion below v1/100 = g dt/100 is forgiven"
    return Bound(STILL * g * dt / window, because)
