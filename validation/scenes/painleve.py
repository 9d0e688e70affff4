r"""A rod is pushed along the floor, its lower end ahead: it slides, or it jams and vaults.

     \            friction of the end, mu N, raises the normal speed of the end less than N alone, and at
      \   v ->      mu > (i^2 + a^2)/(a b),  of a thin rod (1 + 3 c^2)/(3 s c),  c = cos(lean), s = sin(lean)
     b \          pressing it pulls it down: no force of a slide holds the end up
    ====\===      below: theta'' = (g - b theta'^2)(a - mu b)/(i^2 + a (a - mu b))
       a          beyond: an impact without a collision stops the end at once, w = -b v/(i^2 + a^2 + b^2)

[P. Painleve, Comptes Rendus 121 (1895) 112; F. Genot, B. Brogliato, Eur. J. Mech. A/Solids 18 (1999) 653.] The stop
needs an impulse that holds the end in both directions, with friction over pressure (i^2 + a^2)/(a b): it lies within
the cone exactly where sliding is not possible. It does not depend on the step. Afterwards the rod turns about its end.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache

import numpy as np

from adapters.scene import Pair, Scene, SceneError
from adapters.trajectory import Trajectory
from validation import bounds, metrics
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Variation
from validation.scenes.parts import block, floor, mass_of, standard_gravity, states, tilted, upward
from validation.truths.corners import landing_corner
from validation.truths.leaning import Turn, turn
from validation.truths.pivoting import WORDS, Pivot, fall_checks

#: Rotation at which the rod is measured [rad], to either side.
TOLD = math.radians(3.0)
#: Time of the run beyond that [s], for runs that are late by the error of a step of 1/60 s.
AFTERMATH = 0.1
#: Number of angles at which the grip of the end is checked.
ASKED = 50


def _tilt(p: Params) -> float:
    """Angle of the rod to the vertical at the start [rad], counter-clockwise: its lower end to the right."""
    return math.radians(90.0 - p["lean"])


def _gyration(p: Params) -> float:
    """Square of the radius of gyration [m^2]."""
    return p["length"] ** 2 * (1.0 + p["aspect"] ** 2) / 12.0


def _arm(p: Params, tilt: float) -> tuple[float, float]:
    """The lower end relative to the centre: a to the right, and b below [m]."""
    across, below = landing_corner(p["aspect"] * p["length"], p["length"], tilt)
    return -across, below


def critical(p: Params) -> float:
    """Friction beyond which the end cannot slide."""
    a, b = _arm(p, _tilt(p))
    return (_gyration(p) + a * a) / (a * b)


def friction(p: Params) -> float:
    """Friction of the floor."""
    return p["ratio"] * critical(p)


def _acceleration(p: Params, tilt: float, square: float) -> tuple[float, float]:
    """Angular acceleration [rad/s^2] of the rod with a sliding end, and its deceleration by friction [m/s^2].

    Moments about the centre, N (a - mu b), and the height b of the centre, whose derivative by the tilt is -a.
    """
    a, b = _arm(p, tilt)
    mu, own = friction(p), _gyration(p)
    lever = a - mu * b
    press = own * (p["g"] - b * square) / (own + a * lever)
    return press * lever / own, mu * press


@lru_cache(maxsize=64)
def _slides(key: tuple[tuple[str, float], ...], off: float = 0.0) -> Turn | None:
    """The turn of the sliding rod, from a start that is ``off`` [rad]."""
    p = dict(key)
    start = _tilt(p) + off
    way = math.copysign(TOLD, _acceleration(p, start, 0.0)[0])
    return turn(lambda tilt, square: _acceleration(p, tilt, square), start, start + way)


def _key(p: Params) -> tuple[tuple[str, float], ...]:
    return tuple(sorted(p.items()))


def _vault(p: Params) -> tuple[Pivot, float, float, float]:
    """The rod on its end: angles of its diagonal at the start and at the measurement, and its spin at the start."""
    on = Pivot(p["aspect"] * p["length"], p["length"], p["g"])
    start = on.alpha - _tilt(p)
    _, b = _arm(p, _tilt(p))
    return on, start, start + TOLD, b * p["v"] / (_gyration(p) + on.arm**2)


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the rod's lower end touches the floor, and all of it moves to the right.

    Raises
    ------
    SceneError
        If the rod does not lean over its end, the end would stop or lift before the measurement, or friction would not
        hold it after the jam.
    """
    p = params
    if _arm(p, _tilt(p))[0] <= 0.0:
        raise SceneError(f"painleve.lean: at {p['lean']:g} degrees a rod so thick stands over its end and cannot jam")
    if p["ratio"] < 1.0:
        found = _slides(_key(p))
        if found is None:
            raise SceneError(f"painleve.ratio: at {p['ratio']:g} the end lifts before the rod has turned")
        _, b = _arm(p, _tilt(p))
        slip = p["v"] - found.gathered - abs(found.spin) * b
        if slip <= 0.2 * p["v"]:
            raise SceneError(f"painleve.v: {p['v']:g} m/s is too slow for the end to slide all the way")
        duration = found.time + AFTERMATH
    else:
        on, start, end, spin = _vault(p)
        if on.speed(start, spin, end) == 0.0:
            raise SceneError(f"painleve.v: {p['v']:g} m/s is too slow for the rod to rise on its end")
        for phi in np.linspace(start, end, ASKED):
            across, up = on.grip(start, spin, float(phi))
            if up <= 0.0 or abs(across) > friction(p) * up:
                raise SceneError(f"painleve.v: at {p['v']:g} m/s the end that has jammed lets go again")
        duration = on.time(start, spin, end) + AFTERMATH
    _, below = _arm(p, _tilt(p))
    rod = block("rod", dimension, p["mass"], p["aspect"] * p["length"], p["length"])
    rod = replace(tilted(rod, dimension, (0.0, below), _tilt(p)), twist=(p["v"], *(0.0,) * (3 * dimension - 4)))
    pairs = (Pair(restitution=0.0, friction=friction(p)),)
    gravity = upward(dimension, -p["g"])
    return Scene("painleve", 1, dimension, (floor(dimension), rod), pairs, gravity, duration, p)


def exact(scene: Scene) -> dict[str, float]:
    """Newton's and Euler's laws of a rod with a sliding end, or angular momentum about the jamming end."""
    p = scene.params
    if p["ratio"] < 1.0:
        found = _slides(_key(p))
        assert found is not None  # `make` has refused it
        return {"turning_time": found.time, "turning_spin": found.spin, "slowed": found.gathered, "lifted": 0.0}
    on, start, end, spin = _vault(p)
    return {
        "passing_time": on.time(start, spin, end),
        "passing_spin": on.speed(start, spin, end),
        "edge_moved": 0.0,
    }


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Passage through the measured rotation, speed lost until then, and motion of the lower end."""
    p, t = scene.params, trajectory.t
    turned, rate = metrics.tilt(trajectory) - _tilt(p), metrics.tilt_rate(trajectory)
    end = metrics.point(trajectory, 1, (-0.5 * p["aspect"] * p["length"], -0.5 * p["length"]))
    jams = p["ratio"] >= 1.0
    side = -1.0 if jams else math.copysign(1.0, _acceleration(p, _tilt(p), 0.0)[0])
    time, spin = metrics.crossing(t, side * turned, side * rate, TOLD)
    until = t <= (t[-1] if time[0] is None else time[0])
    slowed: Measured = (None, metrics.NOT_PASSED)
    if time[0] is not None:
        slowed = (p["v"] - float(np.interp(time[0], t, trajectory.twist[:, 1, 0])), "")
    names = ("passing_time", "passing_spin") if jams else ("turning_time", "turning_spin")
    return {
        names[0]: time,
        names[1]: spin,
        "slowed": slowed,
        "lifted": (float(np.abs(end[until, 1]).max()), ""),
        "edge_moved": (float(np.linalg.norm(end - end[0], axis=1)[until].max()), ""),
    }


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """First-order schemes: half a step of acceleration by their order, one for a contact that is found late.

    Steps lift the end off the floor, arm (w dt)^2/2 each; that error is treated as another initial angle. A jamming end
    may slide for the step in which its contact is found.
    """
    p, g = scene.params, scene.params["g"]
    if p["ratio"] >= 1.0:
        on, start, end, spin = _vault(p)
        *found, moved = fall_checks(on, start, end, dt, truth, spin=spin)
        assert moved.bound is not None
        slid = bounds.Bound(moved.bound + p["v"] * dt, f"{moved.because}; v dt until the contact is found")
        return [*found, slid.check("edge_moved", "m", truth["edge_moved"], "the end that has jammed sticks")]
    arm = math.hypot(*_arm(p, _tilt(p)))
    found_turn = _slides(_key(p))
    assert found_turn is not None  # `make` has refused it
    carried = 0.5 * arm * dt * found_turn.path + g * dt * dt
    others = [other for side in (-1.0, 1.0) if (other := _slides(_key(p), side * carried / arm)) is not None]
    late = 1.5 * dt
    fast = max(abs(_acceleration(p, _tilt(p) + side * TOLD, 0.0)[0]) for side in (-1.0, 0.0, 1.0))
    brake = max(_acceleration(p, _tilt(p) + side * TOLD, 0.0)[1] for side in (-1.0, 0.0, 1.0))
    because = "half a step by the order of the scheme, one for a contact found late, and an end that steps move"
    time = late + max(abs(other.time - found_turn.time) for other in others)
    spin_off = late * fast + max(abs(other.spin - found_turn.spin) for other in others)
    lost = late * brake + max(abs(other.gathered - found_turn.gathered) for other in others)
    source = "Newton's and Euler's laws with Coulomb's friction at the end, integrated"
    return [
        bounds.Bound(time, because).check("turning_time", "s", truth["turning_time"], source),
        bounds.Bound(spin_off, because).check("turning_spin", "rad/s", truth["turning_spin"], source),
        bounds.Bound(lost, because).check("slowed", "m/s", truth["slowed"], source),
        bounds.Bound(carried + bounds.ROUND_OFF * p["length"], "steps move it, arm (w dt)^2/2 each; g dt^2").check(
            "lifted", "m", truth["lifted"], "the end stays on the floor"
        ),
    ]


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Relative error of the rod's spin at the measurement."""
    metric = "passing_spin" if scene.params["ratio"] >= 1.0 else "turning_spin"
    return metrics.relative_error(found, exact(scene), [metric])


SCENE = CanonicalScene(
    name="painleve",
    family="hard",
    version=1,
    title="Rod that is pushed along the floor: it slides or jams",
    symptoms=(
        "a pushed rod chatters, jams or hops",
        "chalk squeaks and jumps on the board",
        "a stick pushed along the floor locks up",
        "a sliding rod jams with high friction",
        "a walking robot's foot chatters when it is pushed forwards",
        "frictional jamming or self-locking of a slanted rod",
        "a rod dragged ahead of the hand stutters and digs in",
        "the Painleve paradox",
        "a tool pushed at a steep angle vibrates on the surface",
    ),
    figure=__doc__ or "",
    law="jams at once where mu > (1 + 3 c^2)/(3 s c), with w = -b v/(i^2 + a^2 + b^2); else slides",
    dimensions=(2,),
    parameters=(
        Parameter("ratio", 1.2, "1", "friction over the limit beyond which the end cannot slide", 0.01, 5.0),
        Parameter(
            "lean",
            60.0,
            "degrees",
            "angle of the rod to the floor; near the angle that jams with the least friction",
            20.0,
            80.0,
        ),
        Parameter("v", 6.0, "m/s", "of the rod along the floor", 0.0, 1e3, positive=True),
        Parameter("length", 10.0, "m", "of the rod: the longer, the slower it turns", 0.0, 1e3, positive=True),
        Parameter("aspect", 0.02, "1", "thickness over length of the rod", 0.0, 0.2, positive=True),
        standard_gravity(),
        mass_of("the rod"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    quick=(Variation({}), Variation({"ratio": 0.6})),
    full=tuple(Variation({"ratio": ratio}) for ratio in (0.2, 0.6, 1.05, 1.2, 2.0)),
    planted=({}, {"ratio": 0.6}),
    primary=Primary(
        "spin error",
        "1",
        "relative error of the spin of the rod, jammed and sliding",
        "no smooth law predicts whether the end stops at once, and with which spin",
        lambda dt: [{}, {"ratio": 0.6}],
        error,
        "the whole scene: the end jams and the rod rises on it",
    ),
    words=WORDS
    | {
        "turning_time": "has turned after {value}",
        "turning_spin": "turns with {value} there",
        "slowed": "has lost {value} of its speed by then",
        "lifted": "its end leaves the floor, up or down, by {value}",
    },
)
