"""One step of the whole world: islands of bodies that can meet, each gathered and stepped by itself (E29)."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel, spliced_kernel
from reference_solver.direct.problem import Problem, problem_part
from reference_solver.journal import journal_part
from reference_solver.model import Array
from reference_solver.planar.broadphase import pair_bodies
from reference_solver.planar.certificate import is_finite
from reference_solver.planar.columns import (
    BODY_INTEGERS,
    BODY_REALS,
    COS,
    EXTENT,
    LOAD,
    MOTION,
    REACH,
    SIN,
)
from reference_solver.planar.located import located_step
from reference_solver.planar.manifolds import keep_remembered, pass_on
from reference_solver.planar.meeting import Meeting
from reference_solver.planar.state import (
    CANDIDATES,
    FIXED,
    FREE,
    KEPT,
    REMEMBERED,
    Bodies,
    Ledger,
    Pairs,
    Rows,
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
    Islands,
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
    pairs: Pairs,
    rows: Rows,
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
    for attempt in range(len(ROOM) + 1):
        if attempt == len(ROOM):
            gather_all(bodies, world.islands)
        elif not find_islands(bodies, pairs, rows, options, world.islands, ROOM[attempt]):
            return False
        confined = 1.0 if attempt < len(ROOM) else 0.0
        outcome = step_islands(bodies, pairs, rows, problem, sub, ledger, options, tally, world, confined)
        if outcome == MADE:
            return True
        keep(world.tally, tally)
        if outcome == NO_ROOM:
            return False
    return True


@inner_kernel
def bound_step(bodies: Bodies, pairs: Pairs, options: Options, islands: Islands, room: float) -> None:
    """Where bodies may be within the step: as far as speeds and loads take them, times ``room``."""
    for i in range(len(bodies.kind)):
        reach = bodies.real[i, REACH] + options.margin * bodies.real[i, EXTENT]
        for k in range(2):
            way = abs(bodies.twist[i, k]) * options.dt
            if bodies.kind[i, MOTION] == FREE:
                way += 0.5 * options.dt * options.dt * abs(bodies.real[i, LOAD + k])
                way = room * way + options.margin * bodies.real[i, EXTENT]
            way += 1e-14 * abs(bodies.pose[i, k])
            islands.limit[i, k] = bodies.pose[i, k] - way
            islands.limit[i, 2 + k] = bodies.pose[i, k] + way
            pairs.bounds[i, k] = islands.limit[i, k] - reach
            pairs.bounds[i, 2 + k] = islands.limit[i, 2 + k] + reach


@inner_kernel
def find_islands(bodies: Bodies, pairs: Pairs, rows: Rows, options: Options, islands: Islands, room: float) -> bool:
    """Join all free bodies that may meet within the step; False if there is no room for candidates."""
    bound_step(bodies, pairs, options, islands, room)
    if not pair_bodies(bodies, pairs, rows, options):
        return False
    join_candidates(bodies, islands, pairs.candidate, rows.counts[CANDIDATES])
    return True


@spliced_kernel
def step_islands(
    bodies: Bodies,
    pairs: Pairs,
    rows: Rows,
    problem: Problem,
    sub: SubStep,
    ledger: Ledger,
    options: Options,
    tally: Array,
    world: World,
    confined: float,
) -> int:
    """Make the step of every island; bodies change only if all stayed in their bounds, where they are confined."""
    islands = world.islands
    opened, journal = tally[OPENED], sub.journal
    pieces, entries, contacts = journal.used[0], journal.used[1], journal.used[2]
    rows.counts[KEPT] = ledger.used[0] = 0
    outcome = MADE
    for i in range(len(bodies.kind)):
        if bodies.kind[i, MOTION] != FREE or root(islands, i) != i:
            continue
        count = list_members(islands, i)
        gather(bodies, world, count)
        if opened == 0.0:
            tally[OPENED] = 0.0  # each island has a first solve, in which an overlap is one of the start
        local, own, around = part(world.bodies, count), sub_part(sub, world, count), pairs_part(pairs, world, count)
        own.lasting.size[BODIES] = count
        own.clock[CONFINED], own.clock[ESCAPED] = confined, 0.0
        rows.counts[REMEMBERED] = 0
        made = located_step(local, around, rows, problem_part(problem, count), own, ledger, options, tally)
        if not made:
            outcome = NO_ROOM
        elif rows.counts[KEPT] + rows.counts[REMEMBERED] > len(rows.kept_key):
            rows.counts[CANDIDATES] = 0  # it is rows that there are too few of
            outcome = NO_ROOM
        elif own.clock[ESCAPED] > 0.0:
            outcome = LEFT_BOUNDS
        if outcome != MADE:
            own.clock[LEFT] = own.clock[UNSETTLED] = 0.0
            journal.used[0], journal.used[1], journal.used[2] = pieces, entries, contacts
            rows.counts[REMEMBERED] = 0
            return outcome
        keep_remembered(rows)
        for k in range(count):
            for d in range(3):
                islands.pose[islands.member[k], d] = local.pose[k, d]
                islands.twist[islands.member[k], d] = local.twist[k, d]
    pass_on(rows)
    scatter(bodies, islands, options)
    return MADE


@inner_kernel
def gather(bodies: Bodies, world: World, count: int) -> None:
    """Copy the bodies of an island to the front of the local arrays, and their bounds; in order of place as well."""
    local, islands = world.bodies, world.islands
    for k in range(count):
        i = islands.member[k]
        for d in range(3):
            local.pose[k, d], local.twist[k, d] = bodies.pose[i, d], bodies.twist[i, d]
        for d in range(BODY_REALS):
            local.real[k, d] = bodies.real[i, d]
        for d in range(BODY_INTEGERS):
            local.kind[k, d] = bodies.kind[i, d]
        for d in range(4):
            world.limit[k, d] = islands.limit[i, d]
        world.order[k] = k


@inner_kernel
def part(local: Bodies, count: int) -> Bodies:
    """The first bodies."""
    return Bodies(
        local.pose[:count],
        local.twist[:count],
        local.pseudo[:count],
        local.real[:count],
        local.kind[:count],
        local.vertex,
        local.start[:count],
        local.pressed[:count],
    )


@inner_kernel
def pairs_part(pairs: Pairs, world: World, count: int) -> Pairs:
    """Laws of all pairs, and room for those of the first bodies."""
    return Pairs(pairs.restitution, pairs.friction, pairs.bounds[:count], world.order[:count], pairs.candidate)


@inner_kernel
def sub_part(sub: SubStep, world: World, count: int) -> SubStep:
    """The sub-step of the first bodies."""
    paths, meeting = sub.meeting.paths, sub.meeting
    some = Paths(paths.begin[:count], paths.end[:count], paths.pose[:count], paths.coefficient[:count])
    pair = Meeting(
        part(world.bodies, count),
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
        sub.before[:count],
        sub.start[:count],
        sub.after[:count],
        sub.gain[:count],
        sub.path[:count],
        sub.pose[:count],
        sub.turn[:count],
        sub.final[:count],
        sub.tally,
        sub.closing[:count],
        sub.probe,
        sub.lasting,
        pair,
        world.limit[:count],
        journal_part(sub.journal, count),
    )


@inner_kernel
def scatter(bodies: Bodies, islands: Islands, options: Options) -> None:
    """Take over the states at the end of the step; what forces do not move goes on with its velocity."""
    for i in range(len(bodies.kind)):
        if bodies.kind[i, MOTION] == FIXED:
            continue
        for d in range(3):
            if bodies.kind[i, MOTION] == FREE:
                bodies.pose[i, d], bodies.twist[i, d] = islands.pose[i, d], islands.twist[i, d]
            else:
                bodies.pose[i, d] += options.dt * bodies.twist[i, d]
        bodies.real[i, COS], bodies.real[i, SIN] = math.cos(bodies.pose[i, 2]), math.sin(bodies.pose[i, 2])
