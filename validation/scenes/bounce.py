r"""A ball is dropped and bounces until it rests.

      o  h0          h_n = e^(2n) h0
      |      o  h1   interval between apexes shrinks by e
      |     / \  o  h2
      v    /   \/ \/\       at rest after sqrt(2 h0/g) (1 + e)/(1 - e)
    =====================

A central fall: friction cannot act and is 0. The height is the clearance below the ball, so the truth does not depend
on the radius.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from adapters.engine import Array
from adapters.scene import Pair, Scene
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import (
    GRAVITY,
    CanonicalScene,
    Check,
    Measured,
    Parameter,
    Params,
    Primary,
    Restitution,
    Searched,
    Steps,
    Track,
    Variation,
    halves,
)
from validation.scenes.parts import ball, floor, mass_of, standard_gravity, states_and_impulses, upward

RADIUS = 0.5
#: Time after the last impact, or after 1.1 times the time of rest [s].
AFTERMATH = 0.25
#: Apexes compared; the fifth of e = 0.5 is 1e-3 of the drop, below what a step of 1/240 s resolves.
APEXES = 5
#: An arc counts if its launch speed is above this many g dt: shorter ones are a handful of samples.
RESOLVED = 20.0
#: Sixteen drop heights [m], 1 cm apart: about half a step of 1/240 s each, so that phases are spread.
HEIGHTS = tuple(round(1.0 + 0.01 * k, 2) for k in range(16))


def rest_time(e: float, height: float, g: float = GRAVITY) -> float:
    """Sum of the geometric series of bounce times, sqrt(2 h0/g) (1 + e)/(1 - e) [s]; infinite for e = 1."""
    return math.inf if e >= 1.0 else math.sqrt(2.0 * height / g) * (1.0 + e) / (1.0 - e)


def make(dimension: int, params: Params) -> Scene:
    """Build the scene; it runs past rest by a tenth, or for APEXES + 1 arcs if e = 1."""
    e, height, g = params["e"], params["height"], params["g"]
    fall = math.sqrt(2.0 * height / g)
    longest = fall * (2.0 * APEXES + 2.0)
    end = longest if e >= 1.0 else max(1.1 * rest_time(e, height, g), fall) + AFTERMATH
    return Scene(
        "bounce",
        1,
        dimension,
        (floor(dimension), ball("ball", dimension, params["mass"], RADIUS, RADIUS + height)),
        (Pair(restitution=e, friction=params["mu"]),),
        upward(dimension, -g),
        end,
        params,
    )


def exact(scene: Scene) -> dict[str, float]:
    """Apex heights, ratio of apex intervals, rest time; nothing touches the ball in flight."""
    e, height, g = scene.params["e"], scene.params["height"], scene.params["g"]
    truth = {f"apex[{n}]": e ** (2 * n) * height for n in range(1, APEXES + 1)}
    truth |= {"apex_interval_ratio": e, "apex_growth": 0.0, "force_in_flight": 0.0}
    if e < 1.0:
        truth["rest_time"] = rest_time(e, height, g)
    return truth


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Apexes from the three highest samples of each arc; rest as the last time anything moved."""
    up, g, height = scene.dimension - 1, scene.params["g"], scene.params["height"]
    clearance = trajectory.pose[:, 1, up] - RADIUS
    velocity = trajectory.twist[:, 1, up]
    # Twice g dt: a rebound that small ends within the step that made it.
    least = 2.0 * g * trajectory.dt
    times, heights = metrics.apexes(trajectory.t, clearance, velocity, least)
    measured: dict[str, Measured] = {}
    for n in range(1, APEXES + 1):
        none = (0.0, f"there is no apex {n}: the ball does not rise again")
        measured[f"apex[{n}]"] = (float(heights[n - 1]), "") if n <= len(heights) else none
    growth = [b - a for a, b in zip([height, *heights[:APEXES]], heights[:APEXES], strict=False)]
    measured["apex_growth"] = (metrics.largest([0.0, *growth]) / height, "")
    measured["apex_interval_ratio"] = metrics.interval_ratio(times)
    measured["rest_time"] = metrics.last_motion(trajectory.t, velocity, least)
    return measured | {"force_in_flight": _force_in_flight(scene, trajectory, clearance, velocity)}


def _force_in_flight(scene: Scene, trajectory: Trajectory, clearance: Array, velocity: Array) -> Measured:
    """Largest reported force of the floor in steps of flight, relative to the weight.

    A step is in flight if at both of its ends the floor is farther away than the ball moves in a step: an impact found
    early or late acts nearer.
    """
    g, dt, contacts = scene.params["g"], trajectory.dt, trajectory.contacts
    if contacts is None:
        return None, metrics.NOT_RECORDED
    is_far, end = clearance > (np.abs(velocity) + g * dt) * dt, contacts.step
    in_flight = metrics.forces(trajectory, 1, [0])[is_far[end] & is_far[np.maximum(end - 1, 0)]]
    if len(in_flight) == 0:
        return None, "no step is in flight"
    if np.isnan(in_flight).any():
        return None, metrics.UNAVAILABLE
    return float(np.linalg.norm(in_flight, axis=1).max() / (scene.params["mass"] * g)), ""


def track(scene: Scene) -> Track:
    """Parabolas between the exact bounce times."""
    e, height, g = scene.params["e"], scene.params["height"], scene.params["g"]

    def position(t: float) -> tuple[float, ...]:
        return upward(scene.dimension, RADIUS + clearance(e, height, g, t))

    return Track("ball", position)


def clearance(e: float, height: float, g: float, t: float) -> float:
    """Exact clearance below the ball at time t [m]."""
    fall = math.sqrt(2.0 * height / g)
    if t < fall:
        return height - 0.5 * g * t * t
    speed, since = e * g * fall, t - fall
    while speed > 1e-9 * g * fall:
        flight = 2.0 * speed / g
        if since < flight:
            return speed * since - 0.5 * g * since * since
        since, speed = since - flight, e * speed
    return 0.0


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """Tolerances of bounces that are found within a step, not at their time.

    That is `bounds.rebound_late` for each; errors shrink by e^2 with each later bounce.
    """
    e, height, g = scene.params["e"], scene.params["height"], scene.params["g"]
    speed, bound = math.sqrt(2.0 * g * height), 0.0
    found, velocity_error = [], []
    because = "impact located within a step: per bounce (1 - e^2 + e (1+e)/2) v dt, shrinking by e^2; + g dt^2/8"
    for n in range(1, APEXES + 1):
        bound = e * e * bound + bounds.rebound_late(e, speed, dt)
        speed *= e
        if speed <= RESOLVED * g * dt:
            break
        apex = bound + g * dt * dt / 8.0
        velocity_error.append(apex * g / speed)
        name = f"apex[{n}]"
        found.append(
            Check(name, "m", truth[name], apex, because, "energy balance of a bounce that is found late by up to dt")
        )
    found.append(_growth_check(height, g, dt, truth["apex_growth"]))
    if len(velocity_error) >= 3:
        found.append(_interval_check(e, height, g, dt, velocity_error, truth["apex_interval_ratio"]))
    if "rest_time" in truth:
        found.append(_rest_check(e, height, g, dt, truth["rest_time"]))
    if height > 3.0 * g * dt * dt:  # falling from rest the first step is one of flight
        source = "without contact there is no contact force"
        found.append(bounds.exact().check("force_in_flight", "1", truth["force_in_flight"], source))
    return found


def _growth_check(height: float, g: float, dt: float, truth: float) -> Check:
    """No bounce may add energy for e <= 1, even if the impact is found late.

    The semi-implicit step keeps ``H = v^2/2 + g y - s g v dt/2`` in flight, s = +1 velocity first, -1 position first; a
    mid-point step has s = 0. An impact replaces the velocity -|v| that its step began with by e |v|, in the place of
    gravity; the body then moves by e |v| dt (s = +1), by -|v| dt (s = -1, with the old velocity) or by the mean
    (s = 0). At any height y, so however late or early the contact was found,

        H after - H before  =  -(1 - e^2) v^2/2 - (1 - e) g |v| dt/2  <=  0,   and 0 for e = 1.

    So no tolerance for the time of an impact is needed: restitution of gravity's g dt gains |v| dt of height at every
    bounce and must be noticed. The start remains: released at rest at a sample, the ball moves on a parabola whose top
    lies half a step beside that sample, g (dt/2)^2/2 = g dt^2/8 above it.
    """
    because = (
        "e <= 1 adds no energy, and velocity-first and position-first schemes conserve energy in a late impact; "
        "only the top of the first parabola lies up to g dt^2/8 above the sample of release"
    )
    bound = g * dt * dt / 8.0 / height + bounds.ROUND_OFF
    return Check("apex_growth", "1", truth, bound, because, "conservation of energy")


def _interval_check(e: float, height: float, g: float, dt: float, error: list[float], truth: float) -> Check:
    """Intervals (v_n + v_(n+1))/g carry both speed errors and one step of impact location."""
    v = [math.sqrt(2.0 * g * height) * e**n for n in range(4)]
    first, second = (v[1] + v[2]) / g, (v[2] + v[3]) / g
    slack = [(error[n] + error[n + 1]) / g + dt for n in (0, 1)]
    bound = (slack[1] + second / first * slack[0]) / (first - slack[0]) if first > slack[0] else math.inf
    because = "speed errors of the two arcs over g, plus one step of impact location, for both intervals"
    return Check("apex_interval_ratio", "1", truth, bound, because, "t_n = (v_n + v_(n+1))/g")


def _rest_check(e: float, height: float, g: float, dt: float, truth: float) -> Check:
    """Tolerance of the rest time: time of every bounce, unresolved tail, scatter of phases."""
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


def apex_error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Largest distance of a resolved apex from its height, relative to the drop."""
    e, height, g = scene.params["e"], scene.params["height"], scene.params["g"]
    speed, errors = math.sqrt(2.0 * g * height), []
    for n in range(1, APEXES + 1):
        value = found[f"apex[{n}]"][0]
        if e**n * speed <= RESOLVED * g * dt or value is None:
            break
        errors.append(abs(value - e ** (2 * n) * height) / height)
    return (metrics.largest(errors), "") if errors else (None, "no apex is resolved at this step")


def rebound(params: Params, height: float) -> float:
    """Restitution from a first apex: h_1 = e^2 h_0."""
    return math.sqrt(max(height, 0.0) / params["height"])


def _from(e: float, *heights: float) -> tuple[Variation, ...]:
    return tuple(Variation({"e": e, "height": height}) for height in heights)


def _from_all_heights(*restitutions: float) -> tuple[Variation, ...]:
    return tuple(variation for e in restitutions for variation in _from(e, *HEIGHTS))


SCENE = CanonicalScene(
    name="bounce",
    version=1,
    title="Dropped ball, from the first bounce to rest",
    symptoms=(
        "my ball does not bounce",
        "a ball bounces higher and higher",
        "a ball loses height at each bounce",
        "bouncing stops too early or never",
        "a rubber ball dropped on the floor does not come back to its height",
        "the bounce height is wrong for the restitution that I set",
        "a ball with restitution 1 should bounce for ever and loses energy",
        "a ball gains energy with every bounce",
        "energy grows at each bounce off the floor",
        "a dropped ball sticks to the floor on landing",
        "a ball keeps hopping with tiny bounces and never rests",
        "bounce height depends on the frame rate or time step",
        "the last small bounces are swallowed",
        "a perfectly elastic ball slowly dies down",
        "a ball that lies still starts to bounce on its own",
    ),
    family="rebound",
    figure=__doc__ or "",
    law="h_n = e^(2n) h0,  t_rest = sqrt(2 h0/g) (1 + e)/(1 - e)",
    dimensions=(2, 3),
    parameters=(
        Parameter("e", 0.8, "1", "coefficient of restitution of the pair", 0.0, 1.0),
        Parameter(
            "height",
            1.0,
            "m",
            "clearance at release; sets the phase of every impact",
            0.0,
            1e4,
            positive=True,
        ),
        Parameter("mu", 0.0, "1", "friction of the pair; it has no effect on a central impact", 0.0, 10.0),
        standard_gravity(),
        mass_of("the ball"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states_and_impulses,
    track=track,
    # Two phases of the first impact, for an engine may miss an apex at one of them, and two more coefficients, of which
    # 1 shows added energy best. A ball with e = 0.95 bounces for 20 s.
    quick=(
        Variation({}),
        Variation({"height": HEIGHTS[4]}, dimensions=(2,)),
        Variation({"e": 0.5}, dimensions=(2,)),
        Variation({"e": 1.0}),
    ),
    standard=(*_from_all_heights(0.8), *(_from(e, HEIGHTS[0])[0] for e in (0.5, 0.95, 1.0))),
    full=_from_all_heights(0.5, 0.8, 0.95, 1.0),
    planted=({"e": 0.8}, {"e": 1.0}),  # added energy is visible only where a bounce loses none
    primary=Primary(
        "apex error",
        "h0",
        f"largest |h_n - e^2n h0| / h0 over {len(HEIGHTS)} drop heights and all resolved apexes "
        f"(e^n v0 > {RESOLVED:g} g dt, n <= {APEXES})",
        "heights are what one sees of a bounce; they depend on the phase of the first impact, so a single height "
        "may be right by chance",
        lambda dt: [{"height": height} for height in HEIGHTS],
        apex_error,
        "the whole scene: fall, bounces, rest",
        order=1,
    ),
    steps=Steps(full=halves(60.0, 7680.0), full_iterations=(1,)),
    searched=Searched(
        "impact",
        ({"e": 0.5, "height": 1.0}, {"e": 1.0, "height": 1.0}, {"height": 1.03}, {"height": 1.1}),
        ({"height": 1.07}, {"e": 1.0, "height": 1.05}),
    ),
    words={
        "apex": "rebounds at {value}",
        "apex=0": metrics.SILENT,
        "force_in_flight": "reports a contact force of {value} times its weight in flight",
    },
    seen_as={"apex[1]": rebound},
    restitution=Restitution("apex", "e", "height", APEXES),
)
