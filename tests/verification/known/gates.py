"""Motions with truths of their own (E76): nothing certified is farther off than it says, nearly all is certified.

Numbers of each motion are drawn from a seed. Truths are closed forms, or differential equations of the few coordinates
that are left, integrated by the classical Runge-Kutta method; none of them knows a contact problem of the solver.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from reference_solver.settings import TOLERANCE
from tests.verification.gate import Gate
from tests.verification.known import blows, corners, crossing, edges, planar, rubbing, spatial
from tests.verification.known.motion import TRUTH, Miss, Motion, miss
from tests.verification.space import SPACES

#: Numbers that each motion is tried with, and steps a second in which it is recorded.
SEEDS, RATE = 6, 60
#: Largest error of what is certified [m]: of a motion of some metres a thousand tolerances, in a hundred pieces.
ALLOWED = 1e3 * TOLERANCE
#: Share that must be certified: a contact of measure zero among random ones would be refused at most once.
CERTIFIED = 1.0 - 1.0 / SEEDS

Draw = Callable[[np.random.Generator], Motion]

#: Motions by name.
MOTIONS: dict[str, Draw] = {
    **{
        f"{name}, {space.name}": partial(draw, space)
        for name, draw in {
            "board on rollers": planar.rollers,
            "ball spinning in a wedge": planar.wedge,
            "box falling on an edge that slides": planar.sliding_fall,
            "ball over the edge of a box": planar.off_the_edge,
            "rimless wheel": planar.rimless_wheel,
            "box off the end of a table": edges.off_the_table,
            "slabs that slide on each other": rubbing.slabs,
            "rod that slides in a V": rubbing.rod_in_a_v,
            "box that rebounds on a corner": corners.falls_on_a_corner,
        }.items()
        for space in SPACES
    },
    **{
        f"{name}, {space.name}": partial(draw, space.dimension)
        for name, draw in {
            "ball in a room": blows.in_a_room,
            "ball whose rebounds end on a slope": blows.down_a_slope,
            "balls that touch and are hit": blows.struck_cluster,
        }.items()
        for space in SPACES
    },
    "ball rolling over an edge": partial(edges.ball_over_a_box, "rolls"),
    "ball slipping over an edge": partial(edges.ball_over_a_box, "slips"),
    "smooth ball over an edge": partial(edges.ball_over_a_box, "smooth"),
    "box that spins on its base": partial(rubbing.spinning_boxes, 1),
    "box over the corner of a table": edges.slides_over_a_corner,
    "rod that crosses a rod": crossing.crossed_rods,
    "ball on a turntable": spatial.turntable,
    "lopsided ball that rolls": partial(spatial.lopsided_ball, False),
    "lopsided ball that a torque rolls": partial(spatial.lopsided_ball, True),
    "rod that a torque spins up": spatial.rod_spun_up,
    "ball slipping along a groove": spatial.groove,
    "ball spinning in a corner": spatial.corner,
    "box on three corners at once": spatial.three_corners,
}


def misses(name: str, seeds: int = SEEDS) -> list[Miss]:
    """Certify one motion with the numbers of all seeds."""
    found = []
    for seed in range(seeds):
        motion = MOTIONS[name](np.random.default_rng(seed))
        steps = 5 * max(4, round(motion.time * RATE / 5))
        found.append(miss(motion, steps))
    return found


def beyond(name: str, found: list[Miss]) -> Gate:
    """Return the row of how far certified runs are off, over their X and what the truth may be off."""
    worst = max((each.off / (each.bound + TRUTH) for each in found if not each.refused), default=0.0)
    return Gate.at_most("known motion: error over X", name, worst, 1.0, _made_by(name))


def gates() -> Iterator[Gate]:
    """Yield all rows."""
    for name in MOTIONS:
        found = misses(name)
        yield beyond(name, found)
        yield from kept(name, found)


def kept(name: str, found: list[Miss]) -> Iterator[Gate]:
    """Yield how far certified runs are off, and how many are certified."""
    certified = [each.off for each in found if not each.refused]
    yield Gate.at_most("known motion: error [m]", name, max(certified, default=0.0), ALLOWED, _made_by(name))
    share = len(certified) / len(found)
    yield Gate.at_least("known motion: share certified", name, share, CERTIFIED, _made_by(name))


def _made_by(name: str) -> str:
    return "planar" if name.endswith("planar") else "spatial"
