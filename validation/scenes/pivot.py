r"""A box that leans beyond its balance falls over its edge.

       ,+.             phi'' = p^2 sin(phi),   p^2 = 3 g/(4 rho)
      +   \            phi: of the diagonal against the vertical
       \   \           phi'^2 = 2 p^2 (cos(phi_0) - cos(phi))
        \   +          rho: half the diagonal
         \,'
    ======+===========  the edge stays where it is

Friction must hold the edge, whose load decreases, and the solver must rotate a body about a point that is not its
centre. Time and spin are judged when phi passes ``to``, before the side lands, and so is the motion of the edge.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from adapters.scene import Pair, Scene, SceneError
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Variation
from validation.scenes.parts import along, block, floor, mass_of, standard_gravity, states, tilted, upward
from validation.truths.pivoting import WORDS, Pivot, fall_checks

#: Time of the run after the passage of the angle [s]: at least a step of 1/30 s.
AFTERMATH = 0.05
#: Number of angles at which the friction of the edge is checked.
ASKED = 64


def pivot(p: Params) -> Pivot:
    """The box on its edge."""
    return Pivot(p["aspect"] * p["height"], p["height"], p["g"])


def _angles(p: Params) -> tuple[float, float]:
    return math.radians(p["from"]), math.radians(p["to"])


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the box rests on its lower right edge, which touches the floor at the origin.

    Raises
    ------
    SceneError
        If its side lands, or friction cannot hold the edge, before ``to`` is passed.
    """
    p, on = params, pivot(params)
    start, end = _angles(p)
    if not start < end:
        raise SceneError(f"pivot.to: {p['to']:g} must be greater than from, {p['from']:g}")
    # The box turns on with the spin at the end, which grows by less than half of it meanwhile.
    further = end + 1.5 * AFTERMATH * on.speed(start, 0.0, end)
    if further > 0.5 * math.pi - on.alpha:
        raise SceneError(f"pivot.to: at {p['to']:g} degrees the side of a box of this aspect is about to land")
    for angle in np.linspace(start, further, ASKED):
        friction, normal = on.grip(start, 0.0, float(angle))
        if abs(friction) > p["mu"] * normal:
            raise SceneError(f"pivot.mu: {p['mu']:g} does not hold the edge at {math.degrees(angle):.0f} degrees")
    box = tilted(
        block("box", dimension, p["mass"], on.width, on.height),
        dimension,
        (on.arm * math.sin(start), on.arm * math.cos(start)),
        -(start + on.alpha),
    )
    duration = on.time(start, 0.0, end) + AFTERMATH
    pairs = (Pair(restitution=0.0, friction=p["mu"]),)
    return Scene("pivot", 1, dimension, (floor(dimension), box), pairs, upward(dimension, -p["g"]), duration, p)


def exact(scene: Scene) -> dict[str, float]:
    """Energy gives the spin, and its integral the time."""
    on, (start, end) = pivot(scene.params), _angles(scene.params)
    truth = {
        "passing_time": on.time(start, 0.0, end),
        "passing_spin": on.speed(start, 0.0, end),
        "edge_moved": 0.0,
    }
    return truth | ({} if scene.dimension == 2 else {"twisted": 0.0})


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Time and spin of the passage of the diagonal's angle, and the largest displacement of the edge."""
    on, (_, end), d = pivot(scene.params), _angles(scene.params), scene.dimension
    angle, spin = -metrics.tilt(trajectory) - on.alpha, -metrics.tilt_rate(trajectory)
    time, speed = metrics.crossing(trajectory.t, angle, spin, end)
    edge = metrics.point(trajectory, 1, along(d, 0.5 * on.width, -0.5 * on.height))
    before = trajectory.t <= (trajectory.t[-1] if time[0] is None else time[0])
    measured: dict[str, Measured] = {
        "passing_time": time,
        "passing_spin": speed,
        "edge_moved": (float(np.linalg.norm(edge - edge[0], axis=1)[before].max()), ""),
    }
    if d == 3:
        measured["twisted"] = (float(np.linalg.norm(trajectory.twist[:, 1, [3, 5]], axis=1).max()), "")
    return measured


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """Those of any box that falls over an edge; in 3-D it must stay in its plane."""
    on, (start, end) = pivot(scene.params), _angles(scene.params)
    found = fall_checks(on, start, end, dt, truth)
    if "twisted" in truth:
        still = bounds.Bound(
            bounds.STILL * scene.params["g"] * dt / on.arm, "a corner slower than v1/100 = g dt/100 does not move"
        )
        found.append(still.check("twisted", "rad/s", truth["twisted"], "symmetry"))
    return found


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Relative error of the time at which the angle is passed."""
    return metrics.relative_error(found, exact(scene), ["passing_time"])


SCENE = CanonicalScene(
    name="pivot",
    version=1,
    title="Box that falls over its edge",
    symptoms=(
        "a box that falls over its edge slides away at its foot",
        "a tilting block does not rotate about its edge",
        "a falling chimney or tree tips too fast or too slowly",
        "a pole or mast that falls over slides away at its end on the floor",
        "a board that falls over should turn about the edge it stands on",
        "the pivot edge of a toppling box slips or sinks in",
        "a tall box pushed past its balance falls wrongly",
        "the time that a tipping cupboard needs to fall is wrong",
        "a door-shaped plate falls over about its lower edge with the wrong angular speed",
        "a box balanced on its edge does not fall",
    ),
    family="turning",
    figure=__doc__ or "",
    law="phi'' = p^2 sin(phi), p^2 = 3 g/(4 rho), about an edge that stays where it is",
    dimensions=(2, 3),
    parameters=(
        Parameter("from", 10.0, "degrees", "angle of the diagonal to the vertical at the start", 0.01, 80.0),
        Parameter("to", 40.0, "degrees", "at which time and spin are measured, before the side lands", 0.1, 85.0),
        Parameter("aspect", 0.5, "1", "width over height", 0.02, 2.0),
        Parameter("height", 1.0, "m", "of the box", 0.0, 1e3, positive=True),
        Parameter("mu", 0.8, "1", "friction: must hold the edge, to the end", 0.0, 10.0),
        standard_gravity(),
        mass_of("the box"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    quick=(Variation({}), Variation({"from": 1.0, "to": 30.0})),
    full=tuple(Variation({"from": a, "aspect": b}) for a in (1.0, 10.0, 25.0) for b in (0.2, 0.5)),
    planted=({},),
    primary=Primary(
        "time error",
        "1",
        "|t/t_exact - 1| of the time at which the diagonal passes 40 degrees",
        "the time contains all errors of the motion: a slipping edge, lost energy, a late start",
        lambda dt: [{}, {"from": 1.0, "to": 30.0}],
        error,
        "the whole fall",
        order=1,
    ),
    smooth=("passing_time", "passing_spin"),
    words=WORDS | {"twisted": "twists out of the plane with {value}"},
)
