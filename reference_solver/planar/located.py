"""What a located step asks of the plane (`stepping.operations`), from the instant an island is gathered to its end.

And what contact solves ask (`stepping.iteration`).
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.direct.problem import problem_part
from reference_solver.journal import journal_part
from reference_solver.planar import curve, flight, impact, jam, midpoint, press, rocking, slide, time_of_impact
from reference_solver.planar.block import prepare_blocks, sweep_blocks
from reference_solver.planar.broadphase import find_overlaps
from reference_solver.planar.certificate import certify, open_solve
from reference_solver.planar.columns import (
    BODY_INTEGERS,
    BODY_REALS,
    COS,
    ENDING,
    EXTENT,
    FORCE_N,
    FORCE_T,
    LOAD,
    MOTION,
    NUMBER,
    PN,
    PT,
    REACH,
    SHAPE,
    SIN,
    SIZE,
)
from reference_solver.planar.direct import mend_velocities, solve_directly
from reference_solver.planar.entries import enter_fixed_step, enter_impact, enter_sub_step
from reference_solver.planar.entries import enter_settled as enter_settled_piece
from reference_solver.planar.lasting import displace
from reference_solver.planar.ledger import enter_contacts
from reference_solver.planar.manifolds import detect, keep_remembered, pass_on, row_key
from reference_solver.planar.meeting import Meeting
from reference_solver.planar.position import correct_positions
from reference_solver.planar.residual import natural_map
from reference_solver.planar.rows import warm_start
from reference_solver.planar.sequential_impulses import sweep_rows
from reference_solver.planar.state import (
    CANDIDATES,
    CONTACTS,
    FIXED,
    FREE,
    HALF_SPACE,
    KEPT,
    REMEMBERED,
    Bodies,
    Island,
    Pairs,
    Rows,
    SubStep,
    World,
)
from reference_solver.planar.step import copy_contacts, step
from reference_solver.stepping import operations
from reference_solver.stepping.broadphase import boxes_part
from reference_solver.stepping.clock import BRIEF, HELD, JAMMED, MOST_SOFT, ROCKING, UNSETTLED
from reference_solver.stepping.islands import join_candidates, leaves
from reference_solver.stepping.iteration import solve_velocities
from reference_solver.stepping.lasting import BODIES
from reference_solver.stepping.ledger import Buffer, copy_ledger
from reference_solver.stepping.noise import SHORT
from reference_solver.stepping.paths import Paths
from reference_solver.stepping.phase import NO_PHASE
from reference_solver.stepping.vectors import copy_vectors


@inner_kernel
def is_free(island: Island, i: int) -> bool:
    """Whether forces move body i."""
    return bool(island.bodies.kind[i, MOTION] == FREE)


@inner_kernel
def patience(island: Island) -> int:
    """Soft events of a step in the plane, where they cost little."""
    return MOST_SOFT


@inner_kernel
def find_touching(island: Island) -> bool:
    """All rows first, as clusters are weighed by what is near: `begin_solve` keeps those that touch."""
    return bool(detect(island.bodies, island.pairs, island.rows, island.options)) and has_room(island)


@inner_kernel
def has_room(island: Island) -> bool:
    """Whether the ledger can take all rows."""
    return island.ledger.used[0] + island.rows.counts[CONTACTS] <= len(island.ledger.real)


@inner_kernel
def weigh_clusters(island: Island) -> None:
    """Of the rows that are near."""
    jam.weigh_clusters(island.bodies, island.rows, island.sub, island.options, island.tally)


@inner_kernel
def begin_solve(island: Island) -> None:
    """Rows that touch, their blocks, and the velocities of the start."""
    impact.keep_touching(island.bodies, island.pairs, island.rows, island.sub, island.options.dt)
    prepare_blocks(island.bodies, island.rows)
    copy_vectors(island.bodies.twist, island.sub.before)


@inner_kernel
def levers_of_start(island: Island) -> None:
    """Rows before they were turned to mid-drift."""
    midpoint.levers_of_start(island.bodies, island.rows, island.options)


@inner_kernel
def collide_now(island: Island) -> int:
    """Impacts, from ``sub.before`` to ``sub.start``."""
    return int(impact.collide_now(island.bodies, island.rows, island.problem, island.sub, island.options, island.tally))


@inner_kernel
def press_until_stick(island: Island, most: float, struck: bool) -> float:
    """From ``sub.start`` to ``bodies.twist``; rows tell by themselves whether impacts came first."""
    return float(
        slide.press_until_stick(
            island.bodies, island.rows, island.problem, island.sub, island.options, island.tally, most
        )
    )


@inner_kernel
def press_for(island: Island, length: float, struck: bool) -> float:
    """One solve: no slide's end is looked for."""
    press.press(island.bodies, island.rows, island.problem, island.sub, island.options, island.tally, length)
    return length


@inner_kernel
def end_series(island: Island, length: float) -> bool:
    """Rows that are hit again and again."""
    return bool(impact.end_series(island.bodies, island.rows, island.sub, island.options, length))


@inner_kernel
def end_rocking(island: Island, length: float) -> tuple[float, float]:
    """Manifolds of two points, hit in turn."""
    longest, shortest = rocking.end_rocking(island.bodies, island.rows, island.sub, length)
    return longest, shortest


@inner_kernel
def end_solve(island: Island) -> None:
    """``bodies.twist`` are the velocities of the end."""


@inner_kernel
def enter_path(island: Island, length: float) -> float:
    """The frozen path, or that of a phase where rows turn along it."""
    bodies, rows, sub = island.bodies, island.rows, island.sub
    flight.begin_flight(bodies, rows, sub, length)
    if sub.clock[HELD] > 0.0 or sub.clock[BRIEF] > 0.0 or not curve.turns(bodies, rows, sub, length, island.options.dt):
        return 0.0
    if sub.clock[ROCKING] > 0.0 or sub.clock[JAMMED] > 0.0:
        return NO_PHASE
    curved = curve.curve(bodies, rows, sub, island.tally)
    return curved if curved > 0.0 else NO_PHASE


@inner_kernel
def return_to_start(island: Island) -> None:
    """Poses have not changed yet."""
    copy_vectors(island.sub.before, island.bodies.twist)


@inner_kernel
def next_impact(island: Island, length: float) -> float:
    """On the paths of ``sub.path``."""
    return float(
        time_of_impact.next_impact(island.bodies, island.pairs, island.rows, island.sub, island.options, length)
    )


@inner_kernel
def leaves_bounds(island: Island, end: float) -> bool:
    """By the sum of all terms of the path."""
    bodies, sub, found = island.bodies, island.sub, False
    for i in range(len(bodies.kind)):
        if bodies.kind[i, MOTION] != FREE:
            continue
        for k in range(2):
            c = sub.path[i, k]
            way = end * (abs(c[1]) + end * (abs(c[2]) + end * (abs(c[3]) + end * (abs(c[4]) + end * abs(c[5])))))
            found = leaves(sub.limit, i, k, sub.pose[i, k], way) or found
    return found


@inner_kernel
def follow_path(island: Island, length: float, end: float, curved: bool) -> float:
    """A phase that an impact cuts is made again up to there; a frozen sub-step is cut."""
    bodies, rows, sub, options, tally = island.bodies, island.rows, island.sub, island.options, island.tally
    if curved:
        end = curve.follow_curve(bodies, island.pairs, rows, sub, options, length, end)
        curve.enter_curve(bodies, rows, sub, tally)
        length = end
    else:
        pushed = rows.counts[CONTACTS] > 0 and correct_positions(bodies, rows, options, tally)
        flight.move_along(bodies, sub, end, end == length)
        if pushed:
            flight.push_bodies(bodies, options.dt)
    remember_forces(bodies, rows, length, options.dt)
    if end < length:
        press.cut_work(bodies, rows, sub, tally, end, end / length)
    sub.clock[UNSETTLED] = end if sub.clock[HELD] > 0.0 and rows.counts[CONTACTS] > 0 else 0.0
    enter_contacts(bodies, rows, island.ledger)
    enter_sub_step(bodies, rows, sub, options, end, curved)
    return end


@inner_kernel
def remember_forces(bodies: Bodies, rows: Rows, length: float, dt: float) -> None:
    """Keep the forces of the sub-step: they start the next solve, and tell which contacts last (E20).

    In a very short sub-step the impulses stem from round-off and turning normals rather than from forces; what was
    known before is the better guess.
    """
    for c in range(rows.counts[CONTACTS]):
        rows.old_key[c] = row_key(bodies, rows, c)
        lasts = 0.0 if rows.real[c, PN] <= 0.0 else 1.0
        if length < SHORT * dt and rows.real[c, FORCE_N] > 0.0:
            rows.old_impulse[c, 0] = lasts * rows.real[c, FORCE_N]
            rows.old_impulse[c, 1] = lasts * rows.real[c, FORCE_T]
        else:
            rows.old_impulse[c, 0] = lasts * rows.real[c, PN] / max(length, SHORT * dt)
            rows.old_impulse[c, 1] = lasts * rows.real[c, PT] / max(length, SHORT * dt)
    rows.counts[REMEMBERED] = rows.counts[CONTACTS]


@inner_kernel
def note_touching(island: Island) -> int:
    """Of all rows that touch."""
    return int(impact.note_touching(island.bodies, island.rows, island.sub, island.options))


@inner_kernel
def mark_contact(island: Island, k: int, ending: int) -> None:
    """In the table of rows."""
    island.rows.integer[island.sub.lasting.row[k], ENDING] = ending


@inner_kernel
def ending_of(island: Island, k: int) -> int:
    """As the table of rows has it."""
    return int(island.rows.integer[island.sub.lasting.row[k], ENDING])


@inner_kernel
def number_of(island: Island, i: int) -> int:
    """As the table of bodies has it."""
    return int(island.bodies.kind[i, NUMBER])


@inner_kernel
def end_blow(island: Island) -> None:
    """Velocities are those after it already."""
    rows = island.rows
    for c in range(rows.counts[CONTACTS]):
        rows.real[c, PN] = rows.real[c, PT] = 0.0
    enter_contacts(island.bodies, rows, island.ledger)
    enter_impact(island.bodies, rows, island.sub, island.bodies.pose, island.options)


@inner_kernel
def gained_speed(island: Island, length: float) -> tuple[float, float]:
    """Of both components of each velocity."""
    bodies, gained, loaded = island.bodies, 0.0, 0.0
    for i in range(len(bodies.kind)):
        for k in range(2):
            if bodies.kind[i, MOTION] == FREE:
                gained = max(gained, abs(bodies.twist[i, k] - island.sub.start[i, k]))
                loaded = max(loaded, length * abs(bodies.real[i, LOAD + k]))
    return gained, loaded


@inner_kernel
def price_of_creeping(island: Island) -> float:
    """Phases of the plane cost little, however many their contacts."""
    return 1.0


@inner_kernel
def find_loaded(island: Island) -> int:
    """Rows of the end, with the forces that they carried."""
    if not detect(island.bodies, island.pairs, island.rows, island.options):
        return -1
    if not impact.keep_loaded(island.bodies, island.pairs, island.rows):
        return 0
    prepare_blocks(island.bodies, island.rows)
    return int(island.rows.counts[CONTACTS]) if has_room(island) else -1


@inner_kernel
def put_back(island: Island) -> None:
    """Poses, and what goes with them."""
    bodies, lasting = island.bodies, island.sub.lasting
    for i in range(len(bodies.kind)):
        if bodies.kind[i, MOTION] == FREE:
            displace(bodies, lasting, i)


@inner_kernel
def close_gaps(island: Island) -> bool:
    """By displacements of all rows."""
    return bool(midpoint.close_gaps(island.bodies, island.rows, island.sub, island.options))


@inner_kernel
def deepest_overlap(island: Island) -> float:
    """Of all rows."""
    return float(midpoint.deepest(island.bodies, island.rows))


@inner_kernel
def misses_end(island: Island, time: float) -> bool:
    """Of all rows."""
    return bool(midpoint.misses_end(island.bodies, island.rows, island.options, time))


@inner_kernel
def solve_end(island: Island, time: float) -> None:
    """Starts from the impulses of the sub-step."""
    bodies, rows, options, tally = island.bodies, island.rows, island.options, island.tally
    midpoint.take_back(bodies, rows, options, tally)
    open_solve(bodies, 0.0, tally)
    warm_start(bodies, rows, options)
    solve_velocities(bodies, rows, island.problem, options, tally)
    certify(bodies, rows, options, tally)
    midpoint.keep_change(rows, time)
    enter_contacts(bodies, rows, island.ledger)


@inner_kernel
def enter_settled(island: Island) -> None:
    """As a piece of no length."""
    enter_settled_piece(island.bodies, island.rows, island.sub, island.options)


@inner_kernel
def find_islands(whole: Island, world: World) -> bool:
    """By bounding boxes of all that a body may sweep."""
    bodies, options, limit, boxes = whole.bodies, whole.options, world.islands.limit, whole.pairs.boxes
    for i in range(len(bodies.kind)):
        if bodies.kind[i, SHAPE] == HALF_SPACE:
            c, s, x, y = bodies.real[i, COS], bodies.real[i, SIN], bodies.real[i, SIZE], bodies.real[i, SIZE + 1]
            stays, plane = 1.0 if bodies.twist[i, 2] == 0.0 else 0.0, world.islands.plane[i]
            plane[0], plane[1], plane[2] = stays * (c * x - s * y), stays * (s * x + c * y), bodies.real[i, SIZE + 2]
        reach = world.islands.reach[i] = bodies.real[i, REACH] + options.margin * bodies.real[i, EXTENT]
        for k in range(2):
            way = abs(bodies.twist[i, k]) * options.dt
            if bodies.kind[i, MOTION] == FREE:
                way += 0.5 * options.dt * options.dt * abs(bodies.real[i, LOAD + k])
                way += options.margin * bodies.real[i, EXTENT]
            way += 1e-14 * abs(bodies.pose[i, k])  # rounding of the sums
            limit[i, k], limit[i, 2 + k] = bodies.pose[i, k] - way, bodies.pose[i, k] + way
            boxes.low[i, k], boxes.high[i, k] = limit[i, k] - reach, limit[i, 2 + k] + reach
    if not find_overlaps(bodies, whole.pairs, whole.rows, options):
        return False
    join_candidates(whole, world.islands, boxes.candidate, whole.rows.counts[CANDIDATES])
    return True


@inner_kernel
def begin_islands(whole: Island) -> None:
    """Counts of what is kept and entered."""
    whole.rows.counts[KEPT] = whole.ledger.used[0] = 0


@inner_kernel
def gather(whole: Island, world: World, count: int) -> Island:
    """Bodies in order of their place, and their bounds."""
    bodies, local, islands = whole.bodies, world.bodies, world.islands
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
    whole.sub.lasting.size[BODIES] = count
    whole.rows.counts[REMEMBERED] = 0
    laws = whole.pairs
    pairs = Pairs(laws.restitution, laws.friction, boxes_part(laws.boxes, count))
    return Island(
        bodies_part(local, count),
        pairs,
        whole.rows,
        problem_part(whole.problem, count),
        sub_part(whole.sub, world, count),
        whole.ledger,
        whole.options,
        whole.tally,
    )


@inner_kernel
def bodies_part(local: Bodies, count: int) -> Bodies:
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
def sub_part(sub: SubStep, world: World, count: int) -> SubStep:
    """The sub-step of the first bodies."""
    paths, meeting = sub.meeting.paths, sub.meeting
    some = Paths(paths.begin[:count], paths.end[:count], paths.pose[:count], paths.coefficient[:count])
    pair = Meeting(
        bodies_part(world.bodies, count),
        some,
        meeting.trial,
        meeting.kind,
        meeting.size,
        meeting.offset,
        meeting.vector,
        meeting.corner,
        meeting.watched,
        meeting.sunk,
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
        sub.opened,
        sub.struck,
        sub.saved,
        sub.closing[:count],
        sub.probe,
        sub.lasting,
        pair,
        world.limit[:count],
        journal_part(sub.journal, count),
    )


@inner_kernel
def keep_memory(island: Island, world: World) -> bool:
    """In order of the keys of all rows."""
    rows = island.rows
    if rows.counts[KEPT] + rows.counts[REMEMBERED] > len(rows.kept_key):
        rows.counts[CANDIDATES] = 0  # it is rows that there are too few of
        return False
    keep_remembered(rows)
    return True


@inner_kernel
def keep_end(island: Island, world: World) -> None:
    """Poses and velocities."""
    for k in range(len(island.bodies.pose)):
        i = world.islands.member[k]
        for d in range(3):
            world.islands.pose[i, d], world.islands.twist[i, d] = island.bodies.pose[k, d], island.bodies.twist[k, d]


@inner_kernel
def end_islands(whole: Island, world: World) -> None:
    """What forces do not move goes on with its velocity."""
    bodies, islands = whole.bodies, world.islands
    pass_on(whole.rows)
    for i in range(len(bodies.kind)):
        if bodies.kind[i, MOTION] == FIXED:
            continue
        for d in range(3):
            if bodies.kind[i, MOTION] == FREE:
                bodies.pose[i, d], bodies.twist[i, d] = islands.pose[i, d], islands.twist[i, d]
            else:
                bodies.pose[i, d] += whole.options.dt * bodies.twist[i, d]
        bodies.real[i, COS], bodies.real[i, SIN] = math.cos(bodies.pose[i, 2]), math.sin(bodies.pose[i, 2])


@inner_kernel
def contacts_entered(whole: Island, buffer: Buffer, start: int) -> int:
    """All of the ledger."""
    return int(copy_ledger(whole.ledger, buffer, start))


@inner_kernel
def most_contacts(whole: Island) -> int:
    """As many as there is room to find."""
    return len(whole.rows.real)


@inner_kernel
def make_fixed_step(whole: Island) -> bool:
    """The step of `step.py`."""
    done = step(whole.bodies, whole.pairs, whole.rows, whole.problem, whole.options, whole.tally)
    if done:
        enter_fixed_step(whole.sub.journal, whole.bodies, whole.rows, whole.options)
    return bool(done)


@inner_kernel
def contacts_found(whole: Island, buffer: Buffer, start: int) -> int:
    """Those of the last step."""
    return int(copy_contacts(whole.rows, buffer, start))


operations.provide_all(Island, globals())
for asked, kernel in (
    (operations.sweep_blocks, sweep_blocks),
    (operations.sweep_rows, sweep_rows),
    (operations.natural_map, natural_map),
    (operations.solve_directly, solve_directly),
    (operations.mend_velocities, mend_velocities),
):
    operations.provide(asked, Bodies, kernel)
