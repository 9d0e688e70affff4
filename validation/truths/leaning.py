r"""Bodies that lean on their contacts and rotate from rest: one angle with an acceleration by angle and squared spin.

            /       phi'' = a(phi, phi'^2)           d(phi'^2)/d(phi) = 2 a(phi, phi'^2)
           /
          /         time = integral of d(phi)/phi',  singular at the start from rest:
    =====/=====     phi = start + (end - start) s^2  removes that

Ends that slide with Coulomb friction are of this kind as long as none stops or lifts: friction is a share of a force
that depends on angle and spin. Energy is not conserved, so the square is integrated step by step.

Metrics and checks of leaning bodies that stand or slide down are here as well.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from adapters.scene import Scene
from adapters.trajectory import Sampling, Trajectory
from validation import bounds, metrics
from validation.canonical import Check, Measured, Params, Variation

#: Steps of the classical Runge-Kutta method: twice as many change nothing at 1e-9.
STEPS = 200
#: Rotation of the measurement of sliding bodies [rad], and the time after it [s], for runs with a delay of the error of
#: a step of 1/60 s.
TOLD, AFTERMATH = math.radians(8.0), 0.2
#: Duration of a run of standing bodies [s].
DURATION = 2.0

#: Cells of bodies at a lean of 60 degrees with ``ratio`` times the necessary friction: one stands, one slides.
STANDS_AND_SLIDES: tuple[Params, ...] = ({}, {"ratio": 0.8})
QUICK = tuple(Variation(params) for params in STANDS_AND_SLIDES)
FULL = tuple(Variation({"ratio": r, "lean": lean}) for r in (0.5, 0.8, 1.02, 1.05, 2.0) for lean in (45.0, 60.0, 75.0))

#: ``rates(angle, square)`` of an angle [rad] and the square of its rate [1/s^2]: its acceleration [rad/s^2], and
#: another rate to integrate over time.
Rates = Callable[[float, float], tuple[float, float]]


@dataclass(frozen=True)
class Turn:
    """A turn from rest: time [s] and |phi'| [rad/s] at its end, the further integral, and the path.

    ``path`` is the integral of |phi'| d(phi) [rad^2/s]: half of it times arm and step is the motion of a contact by
    steps of first order.
    """

    time: float
    spin: float
    gathered: float
    path: float


def turn(rates: Rates, start: float, end: float) -> Turn | None:
    """Turn from rest at ``start`` to ``end`` [rad]; None if it does not go there."""
    way = end - start

    def slopes(s: float, under: float) -> tuple[float, float, float]:
        """Slopes of phi'^2/s^2, of the time and of the further integral."""
        acceleration, gained = rates(start + way * s * s, max(0.0, under) * s * s)
        pace = 2.0 * abs(way) / math.sqrt(under) if under > 0.0 else math.nan
        return 0.0 if s == 0.0 else (4.0 * acceleration * way - 2.0 * under) / s, pace, gained * pace

    step, time, gathered, path = 1.0 / STEPS, 0.0, 0.0, 0.0
    under = 2.0 * rates(start, 0.0)[0] * way  # phi'^2/s^2 of a start with a constant acceleration
    for k in range(STEPS):
        s, before = k * step, k * step * math.sqrt(max(0.0, under))
        one = slopes(s, under)
        two = slopes(s + 0.5 * step, under + 0.5 * step * one[0])
        three = slopes(s + 0.5 * step, under + 0.5 * step * two[0])
        four = slopes(s + step, under + step * three[0])
        under, time, gathered = (
            total + step / 6.0 * (one[i] + 2.0 * (two[i] + three[i]) + four[i])
            for i, total in enumerate((under, time, gathered))
        )
        path += 0.5 * abs(way) * ((s + step) ** 2 - s * s) * (before + (s + step) * math.sqrt(max(0.0, under)))
    return None if math.isnan(time) else Turn(time, math.sqrt(under), gathered, path)


def key(p: Params) -> tuple[tuple[str, float], ...]:
    """Parameters as the key of a cached fall."""
    return tuple(sorted(p.items()))


# ---- metrics ----


def sampling(scene: Scene) -> Sampling:
    """Every step; contacts over the last second."""
    return Sampling(1, max(0.0, scene.duration - bounds.WINDOW))


def way(scene: Scene, trajectory: Trajectory, body: int) -> float:
    """Largest displacement of a point of a body [m]: of its centre plus of its outermost point by rotation."""
    pose, d = trajectory.pose[:, body], scene.dimension
    centre = float(np.linalg.norm(pose[:, :d] - pose[0, :d], axis=1).max())
    return centre + metrics.turned(pose) * metrics.reach(scene.bodies[body].shape)


def load(trajectory: Trajectory, a: int, b: int, axis: int, weight: float) -> Measured:
    """Mean force of body a on body b along an axis at the end, over ``weight`` [N s a step]."""
    late = metrics.late_impulses(trajectory, a, b, bounds.WINDOW)
    return (None, metrics.UNAVAILABLE) if late is None else (float(late[:, axis].mean()) / weight, "")


def outcome(scene: Scene, truth: Mapping[str, float], found: Mapping[str, Measured]) -> Measured:
    """Displacement of a standing body, in lengths; largest relative error of the times of a sliding one."""
    if "moved" in truth:
        value, reason = found["moved"]
        return (None, reason) if value is None else (value / scene.params["length"], "")
    return metrics.relative_error(found, truth, [name for name in truth if name.startswith("passing_time")])


# ---- checks ----


def checks(
    p: Params,
    dt: float,
    truth: Mapping[str, float],
    heights: Mapping[str, float],
    balance: str,
    again: Callable[[float], Turn | None],
    bent: Callable[[float, float], float],
) -> list[Check]:
    """Contacts of a standing body may be found one step late at either end; a fall has an error of first order.

    ``balance`` is the source of the loads of a standing body; the rest as in `standing_checks` and `sliding_checks`.
    """
    if "moved" in truth:
        return standing_checks(p, dt, truth, heights, balance)
    source = "Newton's and Euler's laws with Coulomb's friction at what slides on the floor, integrated"
    return sliding_checks(p, dt, truth, again, bent, source)


def standing_checks(
    p: Params, dt: float, truth: Mapping[str, float], heights: Mapping[str, float], source: str
) -> list[Check]:
    """Contacts of a standing body may be found one step late at either end.

    A free end accelerates by at most 3/2 g, as that of a rod falling about its other end; the displacement of the
    centre and that of a corner by rotation are added, so each end counts twice. ``heights`` are the loads, each with
    the share of the length over which its moment acts.
    """
    still = bounds.Bound(
        6.0 * p["g"] * dt * dt + bounds.ROUND_OFF * p["length"],
        "both ends found one step late, 3/2 g dt^2 each, in motion of the centre and by rotation",
    )
    found = [still.check("moved", "m", truth["moved"], "friction of the floor holds")]
    carried = bounds.carried(dt)
    for name, height in heights.items():
        because = carried.because if height == 1.0 else f"{carried.because}, over the height of the head"
        found.append(bounds.Bound(carried.value / height, because).check(name, "weights", truth[name], source))
    return found


def sliding_checks(
    p: Params,
    dt: float,
    truth: Mapping[str, float],
    again: Callable[[float], Turn | None],
    bent: Callable[[float, float], float],
    source: str,
) -> list[Check]:
    """A fall has the error of steps of first order.

    Both ends rotate about a point at most a length from either: each step moves them away by L (w dt)^2/2. ``again`` is
    the fall from a lean with an error [rad], ``bent`` the acceleration of the lean at a lean and a squared spin.
    """
    fall, length, g = again(0.0), p["length"], p["g"]
    assert fall is not None  # refused when the scene was made
    carried_away = 0.5 * length * dt * fall.path + 1.5 * g * dt * dt
    others = [again(side * carried_away / length) for side in (-1.0, 1.0)]
    start = math.radians(p["lean"])
    fast = max(abs(bent(start - TOLD, fall.spin**2)), abs(bent(start, 0.0)))
    because = "half a step by the order of the scheme, one for a contact found late, and ends that steps move"
    time = 1.5 * dt + max(math.inf if other is None else abs(other.time - fall.time) for other in others)
    spin = 1.5 * dt * fast + max(math.inf if other is None else abs(other.spin - fall.spin) for other in others)
    bound = {"passing_time": ("s", bounds.Bound(time, because)), "passing_spin": ("rad/s", bounds.Bound(spin, because))}
    found = []
    for name in (name for name in truth if name.startswith("passing")):
        unit, owed = bound[name.partition("[")[0]]
        found.append(owed.check(name, unit, truth[name], source))
    stays = bounds.Bound(
        carried_away + bounds.ROUND_OFF * length, "steps move the ends, L (w dt)^2/2 each; one found a step late"
    )
    return [*found, stays.check("let_go", "m", truth["let_go"], "both ends push until then")]
