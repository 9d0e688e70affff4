r"""A domino is pushed: it falls back, or it falls over and hits the next one.

     __        __         goes over if  w0^2 > 2 p^2 (1 - cos(alpha)),   p^2 = 3 g/(4 rho),  alpha = atan(width/height)
    |  | w0   |  |        its corner meets the next face at  sin(theta) = gap/height, with
    |  | ->   |  |           w^2 = w0^2 - 2 p^2 (cos(alpha - theta) - cos(alpha))
    |  |      |  |        there both turn about their feet:
    |__+      |__+           w1' = w - (1 + e) w b1/(b1 + b2),   b1 = h (cos(theta) + nu sin(theta))
    =======gap======         w2' =     (1 + e) w b2/(b1 + b2),   b2 = h cos(theta) - nu width

The blow acts at one height, with equal lever arms about both feet: without friction nu between the dominoes they share
the spin, whatever that height is. Friction of the floor must hold both feet, which works for thick dominoes that stand
well apart: a high blow throws back the foot of a thin one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from adapters.scene import Pair, Scene, SceneError
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Steps, Variation
from validation.scenes.parts import along, at, block, floor, mass_of, standard_gravity, states, upward
from validation.truths.pivoting import WORDS, Pivot, fall_checks

#: Share of the angle of the hit at which the first domino is measured, and the angle [rad] for the second.
TOLD, STRUCK = 0.9, math.radians(3.0)
#: Time of the run beyond that [s], for runs that are late by the error of a step of 1/60 s.
AFTERMATH = 0.1
#: Number of angles at which the grip of a foot and the gap are checked.
ASKED = 50


def _pivot(p: Params) -> Pivot:
    return Pivot(p["aspect"] * p["height"], p["height"], p["g"])


def _spin(p: Params) -> float:
    """Spin of the push [rad/s]: ``ratio`` times the least that moves the centre over the foot."""
    on = _pivot(p)
    return p["ratio"] * math.sqrt(2.0 * on.rate * (1.0 - math.cos(on.alpha)))


def _hit(p: Params) -> float:
    """Rotation of the first domino at which it hits the second [rad]."""
    return math.asin(p["gap"])


def _top(p: Params, spin: float) -> float:
    """Largest turn of a domino that falls back [rad]."""
    on = _pivot(p)
    return on.alpha - math.acos(min(1.0, math.cos(on.alpha) + spin**2 / (2.0 * on.rate)))


def _shares(p: Params) -> tuple[float, float]:
    """Spin of the first and of the second domino after the blow, over that before."""
    theta, nu = _hit(p), p["rub"]
    first = math.cos(theta) + nu * math.sin(theta)
    second = math.cos(theta) - nu * p["aspect"]
    return 1.0 - (1.0 + p["e"]) * first / (first + second), (1.0 + p["e"]) * second / (first + second)


def _feet_hold(p: Params) -> bool:
    """Whether friction of the floor holds both feet in the blow, and both press on it."""
    on, theta = _pivot(p), _hit(p)
    lost, won = (share - before for share, before in zip(_shares(p), (1.0, 0.0), strict=True))
    # Impulse between the dominoes, along the floor, over m rho w, which turns the first about its foot.
    blow = -lost * 4.0 / 3.0 * on.arm / (on.height * (math.cos(theta) + p["rub"] * math.sin(theta)))
    for change, angle, side in ((lost, theta - on.alpha, -1.0), (won, -on.alpha, 1.0)):
        # The foot provides the momentum of the centre beyond the blow and its friction.
        across = change * math.cos(angle) - side * blow
        up = -change * math.sin(angle) + side * p["rub"] * blow
        if up <= 0.0 or abs(across) > p["mu"] * up:
            return False
    return True


def _foot_holds(p: Params, start: float, spin: float, end: float) -> bool:
    """Whether friction of the floor holds a foot between two angles of its diagonal, and it presses."""
    on = _pivot(p)
    grips = [on.grip(start, spin, float(phi)) for phi in np.linspace(start, end, ASKED)]
    return all(up > 0.0 and abs(across) <= p["mu"] * up for across, up in grips)


def _follows(p: Params, first: float, second: float) -> float:
    """Rotation [rad] of the first when the second is measured; infinite if it catches up before.

    ``first``, ``second``: spins after the blow [rad/s].
    """
    on, theta = _pivot(p), _hit(p)
    until = on.time(-on.alpha, second, STRUCK - on.alpha)
    dt, turn, spin, other, own = until / ASKED, theta, first, 0.0, second
    for _ in range(ASKED):
        for _ in range(10):  # mid-point steps, of which the gap needs no more than three digits
            half = turn + 0.05 * dt * spin, other + 0.05 * dt * own
            spin += 0.1 * dt * on.rate * math.sin(half[0] - on.alpha)
            own += 0.1 * dt * on.rate * math.sin(half[1] - on.alpha)
            turn, other = turn + 0.1 * dt * spin, other + 0.1 * dt * own
        # Corner of the first against the face of the second, along its normal.
        width, wide = on.width, p["gap"] * on.height + on.width
        if on.height * math.sin(turn - other) + width > wide * math.cos(other) + 1e-9:
            return math.inf
    return turn


def _after(p: Params) -> tuple[float, float]:
    """Spins after the blow [rad/s]."""
    on = _pivot(p)
    spin = on.speed(-on.alpha, _spin(p), _hit(p) - on.alpha)
    first, second = _shares(p)
    return first * spin, second * spin


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: both stand, the foot of the first at 0; its push turns it clockwise about that foot.

    Raises
    ------
    SceneError
        For a push that just balances the first, for feet that do not hold, or for a second domino that does not reach
        its angle or is caught up by the first.
    """
    p, on = params, _pivot(params)
    spin, width, height = _spin(p), on.width, on.height
    if p["ratio"] == 1.0:
        raise SceneError("domino.ratio: at 1 the domino balances on its foot; choose less or more")
    end = _top(p, spin) if p["ratio"] < 1.0 else _hit(p)
    if not _foot_holds(p, -on.alpha, spin, end - on.alpha):
        raise SceneError(f"domino.mu: {p['mu']:g} does not hold the foot of the pushed domino")
    if p["ratio"] < 1.0:
        # By symmetry it is back after twice the time to the top.
        half = on.time(end - on.alpha, 0.0, -on.alpha)
        duration = 1.5 * half
    else:
        first, second = _after(p)
        if not _feet_hold(p):
            raise SceneError(f"domino.mu: {p['mu']:g} does not hold both feet where the dominoes meet")
        if on.speed(-on.alpha, second, STRUCK - on.alpha) == 0.0:
            raise SceneError(
                f"domino.ratio: at {p['ratio']:g} the second domino does not turn {math.degrees(STRUCK):g} degrees"
            )
        after = _follows(p, first, second)
        if math.isinf(after):
            raise SceneError(f"domino.e: at {p['e']:g} the first domino catches up with the second")
        ends = ((_hit(p) - on.alpha, first, after - on.alpha), (-on.alpha, second, STRUCK - on.alpha))
        if not all(_foot_holds(p, *way) for way in ends):
            raise SceneError(f"domino.mu: {p['mu']:g} does not hold both feet after the dominoes have met")
        duration = sum(_times(p)) + AFTERMATH
    place = (
        along(dimension, -0.5 * width, 0.5 * height),
        along(dimension, p["gap"] * height + 0.5 * width, 0.5 * height),
    )
    bodies = [
        at(block(name, dimension, p["mass"], width, height), dimension, x)
        for name, x in zip(("first", "second"), place, strict=True)
    ]
    push = (0.5 * height * spin, 0.5 * width * spin, -spin)
    bodies[0] = replace(bodies[0], twist=push)
    pairs = (Pair(restitution=0.0, friction=p["mu"]), Pair("first", "second", p["e"], p["rub"]))
    return Scene("domino", 1, dimension, (floor(dimension), *bodies), pairs, upward(dimension, -p["g"]), duration, p)


def _times(p: Params) -> tuple[float, float]:
    """Times until the dominoes hit, and from there until the second is measured [s]."""
    on = _pivot(p)
    return (
        on.time(-on.alpha, _spin(p), _hit(p) - on.alpha),
        on.time(-on.alpha, _after(p)[1], STRUCK - on.alpha),
    )


def exact(scene: Scene) -> dict[str, float]:
    """Pendulums about their feet, and one blow between them."""
    p, on = scene.params, _pivot(scene.params)
    spin = _spin(p)
    if p["ratio"] < 1.0:
        return {"highest": _top(p, spin), "edge_moved": 0.0, "next_moved": 0.0}
    told = TOLD * _hit(p) - on.alpha
    return {
        "passing_time": on.time(-on.alpha, spin, told),
        "passing_spin": on.speed(-on.alpha, spin, told),
        "edge_moved": 0.0,
        "struck_time": sum(_times(p)),
        "struck_spin": on.speed(-on.alpha, _after(p)[1], STRUCK - on.alpha),
    }


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Passages of both dominoes through angles, largest rotation, motion of the first foot and the second domino."""
    p, on = scene.params, _pivot(scene.params)
    turn, rate = -metrics.tilt(trajectory, 1), -metrics.tilt_rate(trajectory, 1)
    time, spin = metrics.crossing(trajectory.t, turn, rate, TOLD * _hit(p))
    struck = metrics.crossing(trajectory.t, -metrics.tilt(trajectory, 2), -metrics.tilt_rate(trajectory, 2), STRUCK)
    foot = metrics.point(trajectory, 1, along(scene.dimension, 0.5 * on.width, -0.5 * on.height))
    until = float(trajectory.t[int(np.argmax(turn))]) if time[0] is None else time[0]
    moved = np.linalg.norm(foot - foot[0], axis=1)[trajectory.t <= until]
    pose = trajectory.pose[:, 2]
    way = float(np.linalg.norm(pose[:, : scene.dimension] - pose[0, : scene.dimension], axis=1).max())
    return {
        "highest": (float(turn.max()), ""),
        "passing_time": time,
        "passing_spin": spin,
        "edge_moved": (float(moved.max()), ""),
        "struck_time": struck[0],
        "struck_spin": struck[1],
        "next_moved": (way + metrics.turned(pose) * metrics.reach(scene.bodies[2].shape), ""),
    }


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """The checks of a fall (`fall_checks`), from a spin at the start; the blow is found up to one step late.

    The lever arms of both feet stay equal, and both have rotated a step more: a step of acceleration.
    """
    p, on, g = scene.params, _pivot(scene.params), scene.params["g"]
    spin, source = (
        _spin(p),
        "energy of pendulums that are held by their feet; Newton's law of restitution where they meet",
    )
    if p["ratio"] < 1.0:
        carried = on.carried_away(-on.alpha, spin, truth["highest"] - on.alpha, dt) + g * dt * dt
        kick = 1.5 * dt * on.rate * math.sin(on.alpha) + on.rate * carried / (on.arm * spin)
        off = max(abs(_top(p, spin + side * kick) - truth["highest"]) for side in (-1.0, 1.0))
        over = (spin + kick) ** 2 >= 2.0 * on.rate * (1.0 - math.cos(on.alpha))
        top = bounds.Bound(
            math.inf if over else off,
            "the spin at the start to 1.5 steps of acceleration, step order and a late contact; an edge carried away",
        )
        foot = bounds.Bound(carried + bounds.ROUND_OFF * on.arm, "steps move the foot, rho (w dt)^2/2 each; g dt^2")
        still = bounds.Bound(
            2.0 * g * dt * dt + bounds.ROUND_OFF * on.height,
            "one contact found one step late, g dt^2, and a corner that sinks or slips as far",
        )
        return [
            top.check("highest", "rad", truth["highest"], source),
            foot.check("edge_moved", "m", truth["edge_moved"], source),
            still.check("next_moved", "m", truth["next_moved"], "nothing touches it"),
        ]
    hit, second = _hit(p) - on.alpha, _after(p)[1]
    step = dt * on.rate * math.sin(on.alpha)
    off = _shares(p)[1] * on.spin_off(-on.alpha, spin, hit, dt) + step
    time = (
        1.5 * dt
        + on.time_off(-on.alpha, spin, hit, dt)
        + dt
        + on.time_off(-on.alpha, second, STRUCK - on.alpha, dt, off)
    )
    late = bounds.Bound(
        time, "the error of the fall before, one step for the blow, and the time of a spin with that error"
    )
    fast = bounds.Bound(
        on.spin_off(-on.alpha, second, STRUCK - on.alpha, dt, off),
        "the second's share of the error of the first's spin, a step of acceleration for a blow found late, and its "
        "own",
    )
    return [
        *fall_checks(on, -on.alpha, TOLD * _hit(p) - on.alpha, dt, truth, spin=spin),
        late.check("struck_time", "s", truth["struck_time"], source),
        fast.check("struck_spin", "rad/s", truth["struck_spin"], source),
    ]


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Relative error of the second's spin, or of the rotation at which the first turns back."""
    metric = "highest" if scene.params["ratio"] < 1.0 else "struck_spin"
    return metrics.relative_error(found, exact(scene), [metric])


SCENE = CanonicalScene(
    name="domino",
    family="hard",
    version=1,
    title="Domino that is pushed against the next one",
    symptoms=(
        "dominoes fall too fast or too slowly",
        "a domino does not knock over the next one",
        "a chain of dominoes stops in the middle",
        "dominoes slide instead of toppling",
        "a row of domino tiles falls at the wrong speed",
        "a falling domino passes through its neighbour",
        "the wave of toppling bricks dies out",
        "a domino that is tapped tips over though it should fall back",
    ),
    figure=__doc__ or "",
    law="falls over if w0^2 > (3 g/2 rho)(1 - cos(alpha)); passes on (1 + e)/2 of its spin where sin(theta) = "
    "gap/height",
    dimensions=(2,),
    parameters=(
        Parameter(
            "ratio",
            1.5,
            "1",
            "spin of the push over the least that moves the centre over the foot",
            0.0,
            10.0,
            positive=True,
        ),
        Parameter(
            "aspect", 0.5, "1", "width over height: thick, so that a blow does not throw the feet back", 0.1, 2.0
        ),
        Parameter("gap", 0.6, "1", "between the dominoes, over their height", 0.05, 0.95),
        Parameter(
            "e", 0.5, "1", "restitution where they meet, so that they part; nothing bounces off the floor", 0.0, 1.0
        ),
        Parameter("rub", 0.01, "1", "friction where they meet: next to none, so that their feet hold", 0.0, 10.0),
        Parameter("mu", 0.6, "1", "friction of the floor: must hold their feet", 0.0, 10.0),
        Parameter("height", 10.0, "m", "of a domino: the taller, the slower", 0.0, 1e3, positive=True),
        standard_gravity(),
        mass_of("a domino"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    quick=(Variation({"ratio": 0.9}), Variation({})),
    full=tuple(Variation({"ratio": ratio}) for ratio in (0.5, 0.9, 1.3, 1.5, 2.0)),
    planted=({"ratio": 0.9}, {}),
    primary=Primary(
        "outcome error",
        "1",
        "relative errors of the spin that is passed on, and of the angle at which a domino with too small a push "
        "turns back",
        "a row of dominoes depends on whether each falls over, and on the spin that it passes on",
        lambda dt: [{}, {"ratio": 0.9}],
        error,
        "the whole scene: push, fall and blow",
    ),
    steps=Steps((1.0 / 60.0, 1.0 / 240.0)),
    words=WORDS
    | {
        "highest": "comes back at {value}",
        "struck_time": "has turned the next one after {value}",
        "struck_spin": "turns the next one with {value}",
        "next_moved": "moves the next one by {value} without touching it",
    },
)
