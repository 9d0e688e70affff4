"""Stated tolerances: for every check a truth, a bound and the reason for the bound.

A bound is derived from the scene and the step alone: truth + step + round-off. It cannot see which engine is
judged, and an iteration count earns no allowance.

Natural units of a step of length dt under gravity g
    x1 = g dt^2     the distance that one step of free fall adds
    v1 = g dt       the speed that one step of free fall adds
A fixed-step method that locates contact within a step cannot be asked for less than a few of these.
"""

from __future__ import annotations

import math

from adapters.scene import Scene
from validation.canonical import Check

#: A thousand velocity updates of one unit of round-off (2.2e-16) each, and a factor of five for the order of
#: additions: what is left of an answer that has an exact law at every step length.
ROUND_OFF = 1e-12
#: Apexes compared; the fifth of e = 0.5 is 1e-3 of the drop, below what a step of 1/240 s resolves.
APEXES = 5
#: An arc counts if its launch speed is above this many g dt: shorter ones are a handful of samples.
RESOLVED = 20.0
#: Impulses and kinetic energy of a stack are averaged over this much time at the end [s].
WINDOW = 1.0


def impact_checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """Bounds for `validation.scenes.impact`."""
    v, mass = scene.params["v"], scene.params["mass"]
    because = "exact law at every dt: only round-off of at most 1000 velocity updates remains"
    source = "Newton's law of restitution; one contact, no external force"
    units = {
        "rebound_ratio": ("1", 1.0),
        "rebound_speed": ("m/s", v),
        "velocity_change": ("m/s", v),
        "impulse": ("N s", mass * v),
    }
    checks = [Check(m, unit, truth[m], ROUND_OFF * scale, because, source) for m, (unit, scale) in units.items()]
    momentum = "impulses are bookkeeping: they must add up to m dv to round-off, whatever the law"
    return [*checks, Check("momentum_defect", "1", 0.0, ROUND_OFF, momentum, "conservation of momentum")]


def bounce_checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """Bounds for `validation.scenes.bounce`.

    A fixed-step method finds the ball at a depth within (0, v dt], which costs (1 - e^2) v dt of height, and knows
    speeds to half a step of gravity, which costs e (1 + e) v dt / 2; errors shrink by e^2 with each later bounce.
    """
    e, height, g = scene.params["e"], scene.params["height"], scene.params["g"]
    per_bounce = 1.0 - e * e + 0.5 * e * (1.0 + e)
    speed, bound = math.sqrt(2.0 * g * height), 0.0
    checks, velocity_error = [], []
    because = "impact located within a step: per bounce (1 - e^2 + e (1+e)/2) v dt, shrinking by e^2; + g dt^2/8"
    for n in range(1, APEXES + 1):
        bound = e * e * bound + per_bounce * speed * dt
        speed *= e
        if speed <= RESOLVED * g * dt:
            break
        apex = bound + g * dt * dt / 8.0
        velocity_error.append(apex * g / speed)
        name = f"apex[{n}]"
        checks.append(Check(name, "m", truth[name], apex, because, "energy balance of a bounce found late by <= dt"))
    checks.append(_growth_check(height, g, dt))
    if len(velocity_error) >= 3:
        checks.append(_interval_check(e, height, g, dt, velocity_error, truth["apex_interval_ratio"]))
    if "rest_time" in truth:
        checks.append(_rest_check(e, height, g, dt, truth["rest_time"]))
    return checks


def _growth_check(height: float, g: float, dt: float) -> Check:
    """No bounce may add energy, whatever e <= 1; an impact that is found late adds none either.

    The semi-implicit step keeps ``H = v^2/2 + g y - s g v dt/2`` in flight, s = +1 velocity first, -1 position first; a
    mid-point step has s = 0. An impact replaces the velocity -|v| that its step began with by e |v|, in the place of
    gravity; the body then moves by e |v| dt (s = +1), by -|v| dt (s = -1, with the old velocity) or by the mean
    (s = 0). At any height y, so however late or early the contact was found,

        H after - H before  =  -(1 - e^2) v^2/2 - (1 - e) g |v| dt/2  <=  0,   and 0 for e = 1.

    So no allowance for the location of an impact is owed: whoever reflects gravity's own g dt as well gains |v| dt of
    height at every bounce and is to be seen. What is left is the start: released at rest at a sample, the ball moves on
    a parabola whose top lies half a step beside that sample, g (dt/2)^2/2 = g dt^2/8 above it.
    """
    because = (
        "e <= 1 adds no energy and both step orders keep their energy through a late impact: only the top of the first "
        "parabola lies up to g dt^2/8 above the sample of release"
    )
    bound = g * dt * dt / 8.0 / height + ROUND_OFF
    return Check("apex_growth", "1", 0.0, bound, because, "conservation of energy")


def _interval_check(e: float, height: float, g: float, dt: float, error: list[float], truth: float) -> Check:
    """Intervals (v_n + v_(n+1))/g carry both speed errors and one step of impact location."""
    v = [math.sqrt(2.0 * g * height) * e**n for n in range(4)]
    first, second = (v[1] + v[2]) / g, (v[2] + v[3]) / g
    slack = [(error[n] + error[n + 1]) / g + dt for n in (0, 1)]
    bound = (slack[1] + second / first * slack[0]) / (first - slack[0]) if first > slack[0] else math.inf
    because = "speed errors of the two arcs over g, plus one step of impact location, for both intervals"
    return Check("apex_interval_ratio", "1", truth, bound, because, "t_n = (v_n + v_(n+1))/g")


def _rest_check(e: float, height: float, g: float, dt: float, truth: float) -> Check:
    """Allowance for the rest time: location of every bounce, unresolved tail, scatter of phases."""
    speed = math.sqrt(2.0 * g * height)
    bounces = math.log(speed / (2.0 * g * dt)) / math.log(1.0 / e) if e > 0.0 and speed > 2.0 * g * dt else 1.0
    tail = 4.0 / (1.0 - e)
    # One bounce found late by a uniform phase changes its speed by (1 - e^2)/e g dt u, u uniform (sd 0.289), and
    # all later times by 2/(1 - e) of that over g; phases are independent, four standard deviations.
    scatter = 4.0 * math.sqrt(bounces) * 2.0 / (1.0 - e) * (1.0 - e * e) / e * 0.289 if e > 0.0 else 0.0
    bound = (bounces + tail + scatter + 1.0) * dt
    because = (
        f"one step for each of {bounces:.0f} bounces, the tail below 2 g dt lasts 4 dt/(1-e), "
        "impact phases scatter (4 sd)"
    )
    return Check("rest_time", "s", truth, bound, because, "geometric series of bounce times")


def stack_checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """Bounds for `validation.scenes.stack`, in natural units of a step.

    Positions add up along the column, overlaps do not. A body's drift is the sum of the slips of the interfaces below
    it, x1 each, hence n x1 at the top. An overlap belongs to one interface: if its contact is missing for one step (it
    starts at a gap of exactly 0, which may count as open), the upper body falls relative to the lower one with at most
    the full g, since the lower one is held or falls too, and adds x1. The next step finds the contact; more than x1
    needs a contact that was missing twice or held too little, which is what the check is for, however high the column.
    """
    n, g, mass = int(scene.params["n"]), scene.params["g"], scene.params["mass"]
    x1, v1 = g * dt * dt, g * dt
    top = scene.bodies[-1].pose[scene.dimension - 1]  # heights are rounded relative to the column's
    settle = min(100.0 * n * dt, scene.duration - WINDOW)
    load = 2.0 * 0.01 * dt / WINDOW
    moved = "each of n interfaces may slip by what one step of free fall adds, and slips add up: n g dt^2"
    sunk = "one interface whose contact is found one step late: one step of free fall, g dt^2, whatever lies above"
    energy = "n bodies below the speed that counts as motion, v1/100 = g dt/100"
    settles = "moving at v1/100 for longer would use up the drift of n g dt^2; and the last second must be at rest"
    carried = "bodies slower than v1/100 before and after the last second leave 2 v1/100 of momentum unaccounted"
    scatter = "a body slower than v1/100 changes its momentum by at most 2 m v1/100 a step"
    source = "static equilibrium"
    checks = [
        Check("settle_time", "s", truth["settle_time"], settle, settles, source),
        Check("drift", "m", truth["drift"], n * x1, moved, source),
        Check("penetration", "m", truth["penetration"], x1 + ROUND_OFF * top, sunk, source),
        Check("kinetic_energy", "J", truth["kinetic_energy"], n * 0.5 * mass * (0.01 * v1) ** 2, energy, source),
        Check("impulse_scatter", "1", truth["impulse_scatter"], 0.02, scatter, source),
    ]
    names = [name for name in truth if name.startswith("interface_impulse")]
    return checks + [Check(name, "1", truth[name], load, carried, "weight above the interface") for name in names]


def incline_checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """Bounds for `validation.scenes.incline`, in natural units of a step."""
    g, half = scene.params["g"], 0.5 * scene.duration
    if "creep" in truth:
        because = "a sticking box may move by what one step of free fall adds, g dt^2, over the whole run"
        source = "Coulomb's law, static"
        return [Check("creep", "m/s", truth["creep"], g * dt * dt / scene.duration, because, source)]
    because = "constant force is exact in every scheme: only motion below v1/100 = g dt/100 is forgiven"
    source = "Coulomb's law, kinetic"
    return [Check("acceleration", "m/s^2", truth["acceleration"], 0.01 * g * dt / half, because, source)]
