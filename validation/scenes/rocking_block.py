r"""A tilted block rocks from edge to edge, with decreasing amplitude.

        __           theta'' = -p^2 sin(alpha - theta),  p^2 = 3 g/(4 rho),  alpha = atan(width/height)
       |  \          where it lands on the other edge:   w+ = eta w-,  eta = 1 - 3/2 sin(alpha)^2
      /    \
      \__   \        cos(alpha - theta_n+1) - cos(alpha) = eta^2 (cos(alpha - theta_n) - cos(alpha))
         \__/
    ======+======    [G. W. Housner, Bull. Seismol. Soc. Am. 53 (1963) 403]

The landing is an impact at both edges at once, without rebound: the former edge separates, and angular momentum about
the other one is conserved. A solver with a bounce, or sticking at the first edge, has another eta.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from adapters.engine import Array
from adapters.scene import Pair, Scene, SceneError
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Variation
from validation.scenes.parts import block, floor, mass_of, standard_gravity, states, tilted, upward
from validation.truths.pivoting import Pivot

#: Landings that are judged, and the amplitudes after them.
LANDINGS = 3
#: An amplitude counts if the block rises to it faster than this many steps of its acceleration, as slower ones are
#: within the error of a landing.
FAST = 20.0


def pivot(p: Params) -> Pivot:
    """The block on one of its edges; its angle is ``alpha - theta``."""
    return Pivot(p["aspect"] * p["height"], p["height"], p["g"])


def eta(p: Params) -> float:
    """Share of the spin after a landing."""
    return 1.0 - 1.5 * math.sin(pivot(p).alpha) ** 2


def _amplitudes(p: Params) -> list[float]:
    """Tilt [rad] at the start and after each landing."""
    on, keep = pivot(p), eta(p) ** 2
    tops = [p["tilt"] * on.alpha]
    for _ in range(LANDINGS):
        tops.append(_top(on, keep * _height(on, tops[-1])))
    return tops


def _height(on: Pivot, theta: float) -> float:
    """Height of the centre by a tilt, over the arm."""
    return 2.0 * math.sin(on.alpha - 0.5 * theta) * math.sin(0.5 * theta)


def _top(on: Pivot, height: float) -> float:
    """Tilt [rad] at which the centre is raised by ``height`` arms."""
    return on.alpha - math.acos(min(1.0, height + math.cos(on.alpha)))


def _fall(on: Pivot, theta: float) -> float:
    """Time [s] from rest at ``theta`` to the floor."""
    return on.time(on.alpha - theta, 0.0, on.alpha)


def _landings(on: Pivot, tops: list[float]) -> list[float]:
    """Times [s] of the landings from these amplitudes."""
    falls = [_fall(on, theta) for theta in tops]
    return [float(t) for t in falls[0] + np.cumsum([0.0, *(2.0 * fall for fall in falls[1:])])]


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the block rests on its lower left edge.

    Raises
    ------
    SceneError
        For a block too wide to rock, and for friction that does not hold it at a landing.
    """
    p, on = params, pivot(params)
    square = math.sin(on.alpha) ** 2
    if eta(p) <= 0.0:
        raise SceneError(f"rocking_block.aspect: a block of {p['aspect']:g} stays where it lands, below 1.41 it rocks")
    needed = 3.0 * math.sin(on.alpha) * math.cos(on.alpha) / (4.0 - 3.0 * square)
    if p["mu"] <= needed:
        raise SceneError(f"rocking_block.mu: {p['mu']:g} lets it slide where it lands; it needs {needed:.3g}")
    tops = _amplitudes(p)
    angle = on.alpha - tops[0]
    centre = (on.arm * math.sin(angle), on.arm * math.cos(angle))
    body = tilted(block("block", dimension, p["mass"], on.width, on.height), dimension, centre, tops[0])
    duration = _landings(on, tops)[-1]  # the one after the last amplitude
    return Scene(
        "rocking_block",
        1,
        dimension,
        (floor(dimension), body),
        (Pair(restitution=0.0, friction=p["mu"]),),
        upward(dimension, -p["g"]),
        duration,
        p,
    )


def exact(scene: Scene) -> dict[str, float]:
    """Housner's amplitudes, and the times of a pendulum about its edge."""
    on, tops = pivot(scene.params), _amplitudes(scene.params)
    truth = {f"amplitude[{n}]": tops[n] for n in range(1, LANDINGS + 1)}
    times = _landings(on, tops)
    return truth | {f"landing[{n}]": times[n - 1] for n in range(1, LANDINGS + 1)} | {"slid": 0.0}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Sign changes of the tilt, the largest tilts between them, and the motion of the middle of the base."""
    on, theta = pivot(scene.params), metrics.tilt(trajectory)
    after = _changes(theta)
    measured: dict[str, Measured] = {}
    for n in range(1, LANDINGS + 1):
        if len(after) < n:
            measured[f"amplitude[{n}]"] = measured[f"landing[{n}]"] = (None, f"it lands less than {n} times")
            continue
        k = after[n - 1]
        until = after[n] if len(after) > n else len(theta)
        measured[f"amplitude[{n}]"] = (float(np.abs(theta[k:until]).max()), "")
        share = theta[k - 1] / (theta[k - 1] - theta[k])
        measured[f"landing[{n}]"] = (float(trajectory.t[k - 1] + share * trajectory.dt), "")
    base = metrics.point(trajectory, 1, (0.0, -0.5 * on.height))[-1, 0]
    return measured | {"slid": (abs(float(base) - 0.5 * on.width), "")}


def _changes(theta: Array) -> list[int]:
    """Samples at which the tilt has another sign than before; a tilt of 0 has none."""
    signs = np.sign(theta)
    known = np.flatnonzero(signs)
    return [int(b) for a, b in pairwise(known) if signs[a] != signs[b]]


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """A landing is found up to one step late, w dt turned too far, and the errors of landings add up.

    In heights of the centre over the arm that is ``sin(alpha) w dt``: the block has fallen too far by it, of which
    eta^2 remains, and it rises from a tilt that is already on the other side by it, about an edge as deep in the floor.
    The order of the scheme gives half a step of acceleration before and after, ``eta (1 + eta)/2`` of it. Earlier
    errors are reduced by eta^2. Steps also move the edge.
    """
    p, on, tops = scene.params, pivot(scene.params), _amplitudes(scene.params)
    keep, source = eta(p), "angular momentum about the edge that it lands on [Housner 1963]; energy in between"
    because = "a landing is found up to one step late, and step orders differ by half a step of acceleration around it"
    rocked = [on.carried_away(on.alpha - theta, 0.0, on.alpha, dt) for theta in tops]
    found, off, late, slid = [], rocked[0] / on.arm, 1.5 * dt, rocked[0] + p["g"] * dt * dt
    late += _stretched(on, tops[0], off)
    for n in range(1, LANDINGS + 1):
        landing = bounds.Bound(late + 0.5 * dt, "one step for each landing before, and the error of each amplitude")
        found.append(landing.check(f"landing[{n}]", "s", truth[f"landing[{n}]"], source))
        spin = on.speed(on.alpha - tops[n - 1], 0.0, on.alpha)
        cost = (1.0 + keep**2 + 0.5 * keep * (1.0 + keep)) * math.sin(on.alpha) * spin * dt
        off = keep**2 * off + cost + 2.0 * rocked[n] / on.arm
        fast = keep * spin > FAST * on.rate * math.sin(on.alpha) * dt
        top = bounds.Bound(_tilted(on, tops[n], off), because)
        check = top.check(f"amplitude[{n}]", "rad", truth[f"amplitude[{n}]"], source)
        found.append(check if fast else check.unjudged())
        late += dt + 2.0 * _stretched(on, tops[n], off)
        slid += 2.0 * rocked[n] + p["g"] * dt * dt
    # At the end it is upright, up to its rotation in the error of the last landing's time.
    turned = min(on.speed(on.alpha - tops[-1], 0.0, on.alpha) * late, on.alpha)
    moved = bounds.Bound(
        slid + 0.5 * on.width * (1.0 - math.cos(turned)),
        "steps move the edge, rho (w dt)^2/2 each; g dt^2 for each contact found late; and the tilt at the end",
    )
    return [*found, moved.check("slid", "m", truth["slid"], "friction holds")]


def _tilted(on: Pivot, theta: float, off: float) -> float:
    """Error of a tilt [rad] whose height is off by ``off`` arms."""
    height = _height(on, theta)
    low = _top(on, max(0.0, height - off))
    return max(_top(on, height + off) - theta, theta - low)


def _stretched(on: Pivot, theta: float, off: float) -> float:
    """Error of the time of a fall [s] from a tilt whose height is off by ``off`` arms."""
    error = _tilted(on, theta, off)
    high = min(theta + error, 0.999 * on.alpha)
    return max(abs(_fall(on, high) - _fall(on, theta)), abs(_fall(on, theta) - _fall(on, max(theta - error, 1e-9))))


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Largest error of an amplitude, over the first tilt."""
    truth, off = exact(scene), []
    for n in range(1, LANDINGS + 1):
        value, reason = found[f"amplitude[{n}]"]
        if value is None:
            return None, reason
        off.append(abs(value - truth[f"amplitude[{n}]"]))
    return metrics.largest(off) / (scene.params["tilt"] * pivot(scene.params).alpha), ""


SCENE = CanonicalScene(
    name="rocking_block",
    version=1,
    title="Block that rocks from edge to edge",
    symptoms=(
        "a rocking block stops rocking too soon or never",
        "a block that rocks from corner to corner loses too much energy",
        "a vase that was nudged keeps rocking for ever",
        "a slender column in an earthquake rocks wrongly",
        "a rocking cabinet bounces instead of rocking",
        "the rocking of a block does not decay as Housner says",
        "a tilted box that falls back onto its base jumps",
        "a wobbling fridge on its edges does not settle",
        "a block rocking on its two edges slides sideways",
    ),
    family="hard",
    figure=__doc__ or "",
    law="w+ = eta w-, eta = 1 - 3/2 sin(alpha)^2 at each landing; a pendulum about its edge in between",
    dimensions=(2,),
    parameters=(
        Parameter("tilt", 0.5, "1", "tilt at the start, over that at which the block balances", 0.01, 0.95),
        Parameter("aspect", 0.25, "1", "width over height; below 1.41 it rocks", 0.05, 1.4),
        Parameter("height", 10.0, "m", "of the block, a column: the taller, the slower", 0.0, 1e3, positive=True),
        Parameter("mu", 0.6, "1", "friction: must hold the edges where it lands", 0.0, 10.0, positive=True),
        standard_gravity(),
        mass_of("the block"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    quick=(Variation({}), Variation({"aspect": 0.5, "tilt": 0.7})),
    full=tuple(Variation({"aspect": a, "tilt": t}) for a in (0.15, 0.25, 0.5) for t in (0.3, 0.5, 0.8)),
    planted=({},),
    primary=Primary(
        "amplitude error",
        "1",
        "largest error of the amplitudes after three landings, over the first tilt",
        "a landing on two edges at once, three times",
        lambda dt: [{}, {"aspect": 0.5, "tilt": 0.7}],
        error,
        "the whole scene: the block rocks and lands three times",
    ),
    words={
        "amplitude": "tilts to {value} after a landing",
        "landing": "lands after {value}",
        "slid": "slides along by {value}",
    },
)
