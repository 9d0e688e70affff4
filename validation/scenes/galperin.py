"""A large ball drives a small one against a wall: collisions that count the digits of pi.

    wall |   o  m       <-- ( M )     every impact is elastic, all in one line
         |                 V          N = ceil(pi/t) - 1 impacts, t = atan(sqrt(m/M)):
         |                            M/m = 1, 100, 10000: 3, 31, 314

In the plane of sqrt(M) V and sqrt(m) v the energy is a circle on which two impacts, with the ball and with the wall,
turn by the angle 2 t; it ends when the small ball cannot catch up. After j impacts of the balls
V_j = V cos(2 j t) towards the wall and v_j = sqrt(M/m) V sin(2 j t) [G. Galperin, Regul. Chaotic Dyn. 8 (2003) 375].
One impact too many or too few shows in both speeds.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise

from adapters.scene import Body, HalfSpace, Pair, Scene
from adapters.trajectory import Trajectory
from validation import bounds
from validation.canonical import CanonicalScene, Check, Measured, Parameter, Params, Primary, Track, Variation
from validation.scenes.parts import PHASES, along, at, ball, between_impacts, delay, mass_of, phases, states

SMALL, LARGE = 0.1, 0.4
#: Runs for this long after the last impact [s]: softest engine compared keeps contact for about 0.05 s.
AFTERMATH = 0.35


def _turn(params: Params) -> float:
    """Angle t of the docstring [rad]."""
    return math.atan(math.sqrt(1.0 / params["ratio"]))


def count(params: Params) -> int:
    """Number of impacts, of balls and with the wall: the j-th keeps j t below pi."""
    turns = math.pi / _turn(params)
    # Where pi/t is whole the last impact has no speed: one less, decided to round-off.
    return (round(turns) if abs(turns - round(turns)) < 1e-9 else math.ceil(turns)) - 1


def impacts(params: Params) -> list[tuple[float, float, float]]:
    """Time [s] of every impact, and the speeds of the small and the large ball after it, away from the wall [m/s]."""
    r, time = params["ratio"], params["delay"]
    gap, between = params["gap"], 0.0
    small, large, found = 0.0, -params["v"], []
    for k in range(count(params)):
        if k % 2 == 0:
            time += between / (small - large)
            gap += small * (between / (small - large))
            between = 0.0
            common = (small + r * large) / (1.0 + r)
            small, large = 2.0 * common - small, 2.0 * common - large
        else:
            wait = gap / -small
            time, between, gap = time + wait, between + wait * (large - small), 0.0
            small = -small
        found.append((time, small, large))
    return found


def make(dimension: int, params: Params) -> Scene:
    """Build the scene; the small ball rests ``gap`` before the wall."""
    p = params
    wall = Body("wall", HalfSpace(along(dimension, 1.0), 0.0), motion="fixed")
    small = at(ball("small", dimension, p["mass"], SMALL, 0.0), dimension, along(dimension, p["gap"] + SMALL))
    large = at(
        ball("large", dimension, p["ratio"] * p["mass"], LARGE, 0.0),
        dimension,
        along(dimension, p["gap"] + 2.0 * SMALL + p["v"] * p["delay"] + LARGE),
        along(dimension, -p["v"]),
    )
    pairs = (Pair(restitution=1.0, friction=0.0),)
    duration = impacts(p)[-1][0] + AFTERMATH
    return Scene("galperin", 1, dimension, (wall, small, large), pairs, (0.0,) * dimension, duration, p)


def exact(scene: Scene) -> dict[str, float]:
    """Rotations by 2 t: the closed form after the last impact."""
    p, turn = scene.params, _turn(scene.params)
    n = count(p)
    hits = (n + 1) // 2  # impacts of the balls come first, third, ...
    small = math.sqrt(p["ratio"]) * p["v"] * math.sin(2.0 * hits * turn)
    # The small ball has the wall's direction after an impact with the large one, and the other after the wall.
    return {
        "small_speed": small if n % 2 == 0 else -small,
        "large_speed": -p["v"] * math.cos(2.0 * hits * turn),
        "energy_defect": 0.0,
    }


def measure(scene: Scene, trajectory: Trajectory) -> dict[str, Measured]:
    """Velocities at the end, away from the wall; energy relative to that of the large ball."""
    p = scene.params
    small, large = (float(v) for v in trajectory.twist[-1, 1:, 0])
    energy = (small**2 / p["ratio"] + large**2) / p["v"] ** 2
    return {"small_speed": (small, ""), "large_speed": (large, ""), "energy_defect": (abs(energy - 1.0), "")}


def growth(scene: Scene) -> float:
    """Factor by which blows amplify a distance of the balls from their line: 4e10 in 31 impacts at ratio 100, gap 2 m.

    Two balls that hit at the speed u, at a distance y from the line, have a normal tilted by y/R, R being the sum of
    their radii: an elastic blow adds 2 u y/R to their speed across it. The smooth wall adds none.
    """
    found = impacts(scene.params)
    ends = [time for time, _, _ in found[2::2]] + [scene.duration]
    off, across = 1.0, 0.0
    for (time, small, large), end in zip(found[::2], ends, strict=True):
        across += 2.0 * (large - small) * off / (SMALL + LARGE)
        off += across * (end - time)
    return off


def checks(scene: Scene, dt: float, truth: dict[str, float]) -> list[Check]:
    """Each impact is exact even if found late, and round-off of n of them adds up; they must lie steps apart."""
    p, n = scene.params, count(scene.params)
    source = "Galperin's rotations: conservation of momentum and energy, impact after impact"
    allowed = {
        "small_speed": ("m/s", bounds.exact(n * p["v"] * math.sqrt(p["ratio"]))),
        "large_speed": ("m/s", bounds.exact(n * p["v"])),
        "energy_defect": ("1", bounds.exact(n)),
    }
    found = [bound.check(name, unit, truth[name], source) for name, (unit, bound) in allowed.items()]
    times = [time for time, _, _ in impacts(p)]
    apart = min((later - earlier for earlier, later in pairwise(times)), default=math.inf)
    return found if apart >= bounds.APART * dt else [check.unjudged() for check in found]


def track(scene: Scene) -> Track:
    """The large ball: straight from impact to impact."""
    known = [(time, large) for time, _, large in impacts(scene.params)]
    x = between_impacts(scene.bodies[2].pose[0], -scene.params["v"], known)
    return Track("large", lambda t: along(scene.dimension, x(t)))


def error(scene: Scene, dt: float, found: Mapping[str, Measured]) -> Measured:
    """Distance of the two speeds from their point on the circle of energy, over its radius."""
    truth, p = exact(scene), scene.params
    small, large = found["small_speed"], found["large_speed"]
    if small[0] is None or large[0] is None:
        return None, small[1] or large[1]
    off = (small[0] - truth["small_speed"]) / math.sqrt(p["ratio"]), large[0] - truth["large_speed"]
    return math.hypot(*off) / p["v"], ""


SCENE = CanonicalScene(
    name="galperin",
    version=1,
    title="Collisions that count the digits of pi",
    symptoms=(
        "the count of collisions does not give the digits of pi",
        "two sliding blocks and a wall should collide 31 or 314 times",
        "collisions are missed when many happen in one time step",
        "a light block between a heavy block and a wall bounces too few times",
        "counting clacks of colliding blocks gives the wrong number",
        "a very large mass ratio makes collisions go missing",
        "blocks colliding for pi: the simulation loses energy",
        "many fast impacts against a heavy body are lost",
    ),
    family="many impacts",
    figure=__doc__ or "",
    law="N = ceil(pi/t) - 1,  V_j = V cos(2 j t),  v_j = sqrt(M/m) V sin(2 j t),  t = atan(sqrt(m/M))",
    dimensions=(2, 3),
    parameters=(
        Parameter("ratio", 16.0, "1", "mass of the large ball over that of the small one; 16: 12 impacts", 1.0, 1e6),
        Parameter("v", 1.0, "m/s", "of the large ball, towards the wall", 0.0, 1e2, positive=True),
        Parameter("gap", 1.0, "m", "of the small ball; sets the times between impacts", 0.0, 1e3, positive=True),
        delay("the balls first meet"),
        mass_of("the small ball", 0.5),
    ),
    make=make,
    exact=exact,
    measure=measure,
    rule=checks,
    sampling=states,
    track=track,
    growth=growth,
    standard=(Variation({}), Variation({"ratio": 100.0, "gap": 2.0})),  # 12 and 31 impacts
    full=tuple(Variation({"ratio": r, "gap": 2.0}) for r in (1.0, 3.0, 16.0, 100.0)),
    planted=({},),
    primary=Primary(
        "velocity error",
        "1",
        f"distance of both speeds from the exact point on the circle of energy, over its radius, {PHASES} phases of "
        "the contact",
        "a dozen impacts in the right order: one too many, too few or too soft moves the point on the circle",
        phases,
        error,
        "the whole scene: 12 impacts",
    ),
    words={
        "small_speed": "leaves the small ball with {value}",
        "large_speed": "leaves the large ball with {value}",
        "energy_defect": "changes the energy by {value} (relative)",
    },
)
