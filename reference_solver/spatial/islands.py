"""One step of the whole world: islands of bodies that can meet, each gathered and stepped by itself (E29)."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel, spliced_kernel
from reference_solver.direct.problem import Problem, problem_part
from reference_solver.journal import journal_part
from reference_solver.model import Array
from reference_solver.spatial.broadphase import bound_bodies, pair_bodies
from reference_solver.spatial.flight import place_at, reach_of
from reference_solver.spatial.located import located_step
from reference_solver.spatial.manifolds import keep_remembered, pass_on
from reference_solver.spatial.meeting import Meeting
from reference_solver.spatial.operations import Spatial
from reference_solver.spatial.separation import radius_of
from reference_solver.spatial.state import (
    CANDIDATES,
    FIXED,
    FREE,
    HALF_SPACE,
    KEPT,
    REMEMBERED,
    Bodies,
    Detection,
    Ledger,
    Manifolds,
    Memory,
    SubStep,
    World,
)
from reference_solver.stepping.accounting import keep
from reference_solver.stepping.clock import CONFINED, ESCAPED, LEFT, UNSETTLED
from reference_solver.stepping.islands import (
    LEFT_BOUNDS,
    MADE,
    NO_ROOM,
    ROOM,
    gather_all,
    join_candidates,
    list_members,
    root,
)
from reference_solver.stepping.lasting import BODIES
from reference_solver.stepping.options import Options
from reference_solver.stepping.paths import Paths
from reference_solver.tally import OPENED


@spliced_kernel
def step_world(
    bodies: Bodies,
    detection: Detection,
    room: Manifolds,
    memory: Memory,
    problem: Problem,
    sub: SubStep,
    ledger: Ledger,
    options: Options,
    tally: Array,
    world: World,
) -> bool:
    """One step; False if an array is too small: called again, it makes the step anew."""
    if not is_finite(bodies):
        return True
    keep(tally, world.tally)
    space = Spatial(bodies, bodies.pose, bodies.twist)
    for attempt in range(len(ROOM) + 1):
        if attempt == len(ROOM):
            gather_all(space, world.islands)
        else:
            bound_step(bodies, options, world, ROOM[attempt])
            if not pair_bodies(bodies, detection, options):
                return False
            join_candidates(space, world.islands, detection.candidate, detection.found[CANDIDATES])
        confined = 1.0 if attempt < len(ROOM) else 0.0
        outcome = step_islands(bodies, detection, room, memory, problem, sub, ledger, options, tally, world, confined)
        if outcome == MADE:
            return True
        keep(world.tally, tally)
        if outcome == NO_ROOM:
            return False
    return True


@inner_kernel
def is_finite(bodies: Bodies) -> bool:
    """Whether every velocity is a number: comparisons with what is not would be silently false."""
    for i in range(len(bodies)):
        for k in range(6):
            if not math.isfinite(bodies.twist[i, k]):
                return False
    return True


@inner_kernel
def bound_step(bodies: Bodies, options: Options, world: World, room: float) -> None:
    """Where bodies may be within the step, turned at will: as far as speeds and loads take them, times ``room``."""
    limit = world.islands.limit
    bound_bodies(bodies, options)
    for i in range(len(bodies)):
        far = reach_of(bodies, i) + radius_of(bodies, i) if bodies.kind[i] != HALF_SPACE else math.inf
        for k in range(3):
            way = abs(bodies.twist[i, k]) * options.dt
            if bodies.motion[i] == FREE:
                way += 0.5 * options.dt * options.dt * abs(bodies.acceleration[i, k])
                way = room * way + options.margin * bodies.extent[i]
            way += 1e-14 * abs(bodies.pose[i, k])  # rounding of the sums
            limit[i, k], limit[i, 3 + k] = bodies.pose[i, k] - way, bodies.pose[i, k] + way
            if bodies.turning[i]:
                bodies.low[i, k] = min(bodies.low[i, k], bodies.pose[i, k] - far)
                bodies.high[i, k] = max(bodies.high[i, k], bodies.pose[i, k] + far)
            bodies.low[i, k] -= way
            bodies.high[i, k] += way


@spliced_kernel
def step_islands(
    bodies: Bodies,
    detection: Detection,
    room: Manifolds,
    memory: Memory,
    problem: Problem,
    sub: SubStep,
    ledger: Ledger,
    options: Options,
    tally: Array,
    world: World,
    confined: float,
) -> int:
    """Make the step of every island; bodies change only if all stayed in their bounds, where they are confined."""
    islands, found = world.islands, detection.found
    opened, journal = tally[OPENED], sub.journal
    pieces, entries, contacts = journal.used[0], journal.used[1], journal.used[2]
    found[KEPT] = ledger.filled[0] = 0
    outcome = MADE
    for i in range(len(bodies)):
        if bodies.motion[i] != FREE or root(islands, i) != i:
            continue
        count = list_members(islands, i)
        gather(bodies, world, count)
        if opened == 0.0:
            tally[OPENED] = 0.0  # each island has a first solve, in which an overlap is one of the start
        local, own, around = world.bodies[:count], sub_part(sub, world, count), detection_part(detection, world, count)
        own.lasting.size[BODIES] = count
        own.clock[CONFINED], own.clock[ESCAPED] = confined, 0.0
        found[REMEMBERED] = -1
        made = located_step(local, around, room, memory, problem_part(problem, count), own, ledger, options, tally)
        if not made:
            outcome = NO_ROOM
        elif found[KEPT] + max(found[REMEMBERED], 0) > len(world.kept):
            found[CANDIDATES] = 0  # it is manifolds that there are too few of
            outcome = NO_ROOM
        elif own.clock[ESCAPED] > 0.0:
            outcome = LEFT_BOUNDS
        if outcome != MADE:
            own.clock[LEFT] = own.clock[UNSETTLED] = 0.0
            journal.used[0], journal.used[1], journal.used[2] = pieces, entries, contacts
            return outcome
        keep_remembered(detection, memory, world.kept)
        for k in range(count):
            world.end[islands.member[k]] = local[k]
    pass_on(detection, world.kept, sub.past)
    scatter(bodies, world, options)
    return MADE


@inner_kernel
def gather(bodies: Bodies, world: World, count: int) -> None:
    """Copy the bodies of an island to the front of the local ones, and their bounds; in order of place as well."""
    islands = world.islands
    for k in range(count):
        world.bodies[k] = bodies[islands.member[k]]
        for d in range(6):
            world.limit[k, d] = islands.limit[islands.member[k], d]
        world.order[k] = k


@inner_kernel
def detection_part(detection: Detection, world: World, count: int) -> Detection:
    """Laws of all pairs, and room for those of the first bodies."""
    return Detection(
        detection.found,
        detection.restitution,
        detection.friction,
        world.order[:count],
        detection.candidate,
        detection.polygon,
        detection.polygon_edge,
    )


@inner_kernel
def sub_part(sub: SubStep, world: World, count: int) -> SubStep:
    """The sub-step of the first bodies."""
    paths, meeting = sub.meeting.paths, sub.meeting
    some = Paths(paths.begin[:count], paths.end[:count], paths.pose[:count], paths.coefficient[:count])
    pair = Meeting(
        world.bodies[:count],
        some,
        meeting.trial,
        meeting.kind,
        meeting.size,
        meeting.offset,
        meeting.vector,
        meeting.corner,
        meeting.watched,
    )
    return SubStep(
        sub.clock,
        sub.trial,
        sub.opened,
        sub.saved,
        sub.struck,
        sub.lasting,
        sub.held[:count],
        sub.noted,
        sub.rows,
        sub.end_pose[:count],
        sub.end_twist[:count],
        sub.start_pose[:count],
        sub.kept,
        sub.probe,
        pair,
        world.limit[:count],
        sub.past,
        journal_part(sub.journal, count),
    )


@inner_kernel
def scatter(bodies: Bodies, world: World, options: Options) -> None:
    """Take over the states at the end of the step; what forces do not move goes on with its velocity."""
    for i in range(len(bodies)):
        if bodies.motion[i] == FREE:
            bodies[i] = world.end[i]
        elif bodies.motion[i] != FIXED:
            for k in range(6):
                bodies.rate[i, k] = 0.0
            place_at(bodies, i, options.dt, bodies, i)
