"""A gas of rods in one line: at e = 1 rods of equal mass exchange their speeds, as if they passed through each other.

    |o-->   <--o  o->    <--o|      take the lengths out: n points that pass each other in L - n d,
    |                        |      each flying freely from wall to wall; sorted, and i d put back,
    |<--------- L ---------->|      they are the rods at any time

The whole history of collisions has a closed form [D. W. Jepsen, J. Math. Phys. 6 (1965) 405]. Each point keeps its
speed, so the last collision is as exact as the first; a missed collision, or two taken for one, gives a rod the speed
of another. A rod without rotation is a ball that stays in line.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from adapters.engine import Array
from adapters.scene import Body, HalfSpace, Pair, Scene
from adapters.trajectory import Trajectory
from validation import bounds
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Variation
from validation.scenes.parts import DELAY, PHASES, along, at, ball, mass_of, phases, states

RADIUS = 0.125
#: The fractional parts of k times the one and k^2 times the other are evenly distributed over (0, 1), without a common
#: period; with speeds that grow like positions three points would meet at one place.
PLACES, SPEEDS = math.sqrt(2.0), math.sqrt(3.0)
#: Error of a normal: a difference, its length and a division, each with a rounding of a unit or two.
NORMAL = 8.0 * float(np.finfo(float).eps)


@dataclass(frozen=True)
class Meeting:
    """Two points that pass each other, or one (twice) at a wall.

    ``closing`` is their closing speed [m/s], ``rank`` the number of points to the left: rods ``rank - 1`` and ``rank``
    touch, counted from 0; the walls are at the ends.
    """

    time: float
    points: tuple[int, int]
    closing: float
    rank: int


def flights(p: Params) -> tuple[Array, Array]:
    """Places [m] of the points, (n,), when the gas began, and their velocities [m/s]; both evenly spread."""
    order = np.arange(1, int(p["n"]) + 1)
    return p["room"] * np.mod(order * PLACES, 1.0), p["v"] * (2.0 * np.mod(order**2 * SPEEDS, 1.0) - 1.0)


def flown(p: Params, t: float) -> tuple[Array, Array]:
    """Places [m] and velocities [m/s] of the points after ``t`` seconds between walls at 0 and ``room``."""
    start, velocity = flights(p)
    # On a ring of twice the room, whose second half is the way back.
    ring = np.mod(start + velocity * t, 2.0 * p["room"])
    out = ring < p["room"]
    return np.where(out, ring, 2.0 * p["room"] - ring), np.where(out, velocity, -velocity)


def rods(p: Params, t: float) -> tuple[Array, Array]:
    """Places of the centres of the rods [m] and their velocities [m/s], left to right, ``t`` after the beginning."""
    place, velocity = flown(p, t)
    order = np.argsort(place)
    return place[order] + 2.0 * RADIUS * (np.arange(len(order)) + 0.5), velocity[order]


def _passes(angle: float, rate: float, ring: float, first: float, last: float) -> Iterator[float]:
    """Times between ``first`` and ``last`` at which angle + rate t is a multiple of ``ring``."""
    if rate == 0.0:
        return
    ends = sorted((angle + rate * t) / ring for t in (first, last))
    for k in range(math.ceil(ends[0]), math.floor(ends[1]) + 1):
        yield (k * ring - angle) / rate


def meetings(p: Params) -> list[Meeting]:
    """All meetings from the start of the scene until a quarter after its end, in order of time."""
    start, velocity = (values.tolist() for values in flights(p))
    first, last = p["delay"], p["delay"] + 1.25 * p["duration"]
    found: list[tuple[float, tuple[int, int], float]] = []
    for k, (place, speed) in enumerate(zip(start, velocity, strict=True)):
        found += [(t, (k, k), abs(speed)) for t in _passes(place, speed, p["room"], first, last)]
    for k, m in combinations(range(len(start)), 2):
        for side in (1.0, -1.0):  # on the same half of the ring, and on opposite ones
            angle, rate = start[k] - side * start[m], velocity[k] - side * velocity[m]
            found += [(t, (k, m), abs(rate)) for t in _passes(angle, rate, 2.0 * p["room"], first, last)]
    return [Meeting(t, points, u, _rank(p, t, points)) for t, points, u in sorted(found)]


def _rank(p: Params, t: float, points: tuple[int, int]) -> int:
    """Rods to the left of a collision, including the left one of the two; at the walls 0 and n."""
    place, _ = flown(p, t)
    left = int(sum(place[k] < place[points[0]] for k in range(len(place)) if k not in points))
    if points[0] != points[1]:
        return left + 1
    return left if left == 0 and place[points[0]] < 0.5 * p["room"] else len(place)


def shifted(p: Params, seen: list[Meeting]) -> list[float]:
    """Error of the points of each collision by all earlier ones, together [m per s of step].

    In a collision found late the rods overlap by their approach in that time: both continue from there, each displaced
    by that distance. At a wall the displacement is twice that.
    """
    off, before = [0.0] * int(p["n"]), []
    for meeting in seen:
        k, m = meeting.points
        before.append(off[k] if k == m else off[k] + off[m])
        for point in meeting.points:  # the point at a wall is listed twice
            off[point] += meeting.closing
    return before


def coarsest(p: Params) -> float:
    """Largest step [s] at which the collisions of each rod stay in order, with none at the end.

    The time error of a collision is the error of its points over their closing speed.
    """
    seen = meetings(p)
    late = [off / meeting.closing for off, meeting in zip(shifted(p, seen), seen, strict=True)]
    largest, end = math.inf, p["delay"] + p["duration"]
    for k, meeting in enumerate(seen):
        largest = min(largest, abs(meeting.time - end) / (bounds.APART + late[k]))
        for m in range(k + 1, len(seen)):
            if abs(seen[m].rank - meeting.rank) <= 1:
                largest = min(largest, (seen[m].time - meeting.time) / (bounds.APART + late[k] + late[m]))
    return largest


def strayed(p: Params, seen: list[Meeting], begun: float = 0.0, rounded: bool = True) -> float:
    """Largest distance of a rod from the line [m] by rounding of all normals, from ``begun`` at the start.

    A normal with the error q pushes two rods across the line with u q each, one at a wall with 2 u q. Rods at distances
    y and y' from the line have a normal error of up to (y + y')/d: round ends amplify distances in each collision.
    """
    off, across = [begun] * int(p["n"]), [0.0] * int(p["n"])
    normal = NORMAL if rounded else 0.0
    now = p["delay"]
    for meeting in [*seen, None]:
        then = meeting.time if meeting else p["delay"] + p["duration"]
        off = [y + v * (then - now) for y, v in zip(off, across, strict=True)]
        now = then
        if meeting is None:
            break
        met = [k for k in (meeting.rank - 1, meeting.rank) if 0 <= k < len(off)]
        turned = normal + sum(off[k] for k in met) / (2.0 * RADIUS) if len(met) == 2 else 2.0 * normal
        for k in met:
            across[k] += meeting.closing * turned
    return max(off)


def growth(scene: Scene) -> float:
    """Largest amplification of distances from the line by collisions: 1e5 in the 16 of the defaults.

    Distances out of the plane grow like those in the plane, as in `strayed`.
    """
    end = scene.params["delay"] + scene.duration
    return strayed(scene.params, [each for each in meetings(scene.params) if each.time < end], 1.0, rounded=False)


def make(dimension: int, params: Params) -> Scene:
    """Build the scene: the gas has flown for ``delay`` seconds when it begins."""
    p = params
    place, velocity = rods(p, p["delay"])
    length = p["room"] + 2.0 * RADIUS * len(place)
    walls = (
        Body("left", HalfSpace(along(dimension, 1.0), 0.0), motion="fixed"),
        Body("right", HalfSpace(along(dimension, -1.0), -length), motion="fixed"),
    )
    gas = [
        at(
            ball(f"rod{k}", dimension, p["mass"], RADIUS, 0.0),
            dimension,
            along(dimension, float(x)),
            along(dimension, float(v)),
        )
        for k, (x, v) in enumerate(zip(place, velocity, strict=True), 1)
    ]
    pairs = (Pair(restitution=1.0, friction=0.0),)
    return Scene("rod_gas", 1, dimension, (*walls, *gas), pairs, (0.0,) * dimension, p["duration"], p)


def exact(scene: Scene) -> dict[str, float]:
    """Free flights without error."""
    return {"misplaced": 0.0, "wrong_speed": 0.0, "energy_defect": 0.0, "astray": 0.0}


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Largest errors of places and velocities at the end, of the total energy, and largest distance from the line."""
    p, d = scene.params, scene.dimension
    place, velocity = rods(p, p["delay"] + p["duration"])
    x, v = trajectory.pose[-1, 2:, 0], trajectory.twist[-1, 2:, :d]
    return {
        "misplaced": (float(np.abs(x - place).max()), ""),
        "wrong_speed": (float(np.abs(v[:, 0] - velocity).max()), ""),
        "energy_defect": (abs(float((v**2).sum() / (velocity**2).sum()) - 1.0), ""),
        "astray": (float(np.linalg.norm(trajectory.pose[:, 2:, 1:d], axis=2).max()), ""),
    }


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """Speeds are exchanged exactly, even if late; delays of earlier collisions add up in the places.

    Sorting does not increase the largest error of a place.
    """
    p, n = scene.params, len(scene.bodies) - 2
    seen = [meeting for meeting in meetings(p) if meeting.time < p["delay"] + p["duration"]]
    off = [sum(m.closing * m.points.count(k) for m in seen) for k in range(n)]
    length = p["room"] + 2.0 * RADIUS * n
    late = bounds.Bound(
        max(off) * dt + bounds.ROUND_OFF * length,
        "each collision is found up to one step late and displaces its rods by their approach in that time, twice "
        "that at a wall: the largest sum over a flight",
    )
    line = bounds.Bound(
        strayed(p, seen) + bounds.ROUND_OFF * length,
        "round ends amplify the rounding of a normal, from collision to collision: the largest sum over all of them",
    )
    source = "Jepsen's free flights: momentum and energy of rods of equal mass, collision after collision"
    found = [
        late.check("misplaced", "m", truth["misplaced"], source),
        bounds.exact(len(seen) * p["v"]).check("wrong_speed", "m/s", truth["wrong_speed"], source),
        bounds.exact(max(1, len(seen))).check("energy_defect", "1", truth["energy_defect"], "conservation of energy"),
        line.check("astray", "m", truth["astray"], "nothing acts across the line"),
    ]
    return found if dt <= coarsest(p) else [check.unjudged() for check in found]


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Largest error of a velocity, over the fastest flight."""
    value, reason = found["wrong_speed"]
    return (None, reason) if value is None else (value / scene.params["v"], "")


SCENE = CanonicalScene(
    name="rod_gas",
    version=1,
    title="Gas of rods in one line, between two walls",
    symptoms=(
        "particles on a line do not exchange their speeds",
        "a one-dimensional gas loses energy",
        "a chain of elastic collisions between two walls goes out of order",
        "beads on a wire pass through each other",
        "a gas of hard rods cools down",
        "collisions of many bodies in a row are lost or doubled",
        "the velocity distribution of colliding particles changes in one dimension",
        "carts on an air track collide wrongly again and again",
    ),
    family="many impacts",
    figure=__doc__ or "",
    law="sorted free flights in L - n d, plus i d: collisions exchange speeds",
    dimensions=(2,),
    parameters=(
        Parameter("n", 6, "1", "number of rods", 1, 1000, integer=True),
        Parameter("v", 2.0, "m/s", "no rod is faster", 0.0, 1e2, positive=True),
        Parameter("room", 5.0, "m", "free length of the line, L - n d", 0.0, 1e3, positive=True),
        Parameter("duration", 3.75, "s", "16 collisions, none near the end", 0.0, 1e3, positive=True),
        Parameter("delay", DELAY, "s", "time that the gas has moved before the start: phases of collisions", 0.0, 10.0),
        mass_of("each rod"),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    growth=growth,
    quick=(Variation({}),),
    full=tuple(
        Variation({"n": n, "room": room, "duration": duration})
        for n, room, duration in ((6.0, 5.0, 3.75), (6.0, 10.0, 7.5), (10.0, 20.0, 2.5), (16.0, 20.0, 2.75))
    ),
    planted=({},),
    primary=Primary(
        "velocity error",
        "1",
        f"largest error of a rod's velocity at the end over the fastest, {PHASES} phases of the collisions",
        "collisions only exchange velocities: one missed, doubled or too soft gives a rod a wrong one",
        phases,
        error,
        "the whole scene",
    ),
    words={
        "misplaced": "has a rod off its place by {value}",
        "wrong_speed": "gives a rod a speed that is off by {value}",
        "energy_defect": "changes the energy by {value} (relative)",
        "astray": "pushes a rod off the line by {value}",
    },
)
