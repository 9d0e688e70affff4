"""What a located step asks of space (`stepping.operations`), from the instant an island is gathered to its end.

And what contact solves ask (`stepping.iteration`).
"""

from __future__ import annotations

import math

import numpy as np

from reference_solver.compilation import inner_kernel, spliced_kernel
from reference_solver.direct.problem import problem_part
from reference_solver.journal import journal_part, keep_state
from reference_solver.model import Array
from reference_solver.spatial import flight, impact, jam, midpoint, phase, slide, time_of_impact
from reference_solver.spatial.block import sweep_blocks
from reference_solver.spatial.broadphase import bound_bodies, find_overlaps
from reference_solver.spatial.certificate import certify, open_solve, point_work
from reference_solver.spatial.direct import mend_velocities, solve_directly
from reference_solver.spatial.entries import enter_fixed_step, enter_impact, enter_sub_step
from reference_solver.spatial.entries import enter_settled as enter_settled_piece
from reference_solver.spatial.kinematics import relative_twist, velocity_at
from reference_solver.spatial.ledger import enter_contacts, enter_impulses
from reference_solver.spatial.manifolds import keep_remembered, pair_key, pass_on
from reference_solver.spatial.meeting import Meeting
from reference_solver.spatial.motion import accelerate, collect_momentum, displace, spin_of
from reference_solver.spatial.operations import Spatial
from reference_solver.spatial.operations import displace as displace_from_start
from reference_solver.spatial.position import correct_positions
from reference_solver.spatial.prepare import warm_start
from reference_solver.spatial.residual import natural_map
from reference_solver.spatial.separation import radius_of
from reference_solver.spatial.sequential_impulses import sweep_points
from reference_solver.spatial.state import (
    CANDIDATES,
    FIXED,
    FREE,
    HALF_SPACE,
    KEPT,
    MANIFOLDS,
    POINTS,
    REMEMBERED,
    Bodies,
    Detection,
    Island,
    Manifolds,
    SubStep,
    World,
)
from reference_solver.spatial.step import copy_contacts, step
from reference_solver.spatial.sticking import prepare_wrenches
from reference_solver.spatial.touching import detect_touching
from reference_solver.spatial.vector import add, row, times, times_transposed
from reference_solver.stepping import operations
from reference_solver.stepping.accounting import keep
from reference_solver.stepping.broadphase import boxes_part
from reference_solver.stepping.clock import HELD, LEFT, MOST_SOFT_IN_SPACE, UNSETTLED
from reference_solver.stepping.islands import join_candidates, leaves
from reference_solver.stepping.iteration import solve_velocities
from reference_solver.stepping.lasting import BODIES
from reference_solver.stepping.lasting import CONTACTS as LASTING
from reference_solver.stepping.ledger import Buffer, copy_ledger
from reference_solver.stepping.noise import SHORT
from reference_solver.stepping.options import Options
from reference_solver.stepping.paths import Paths
from reference_solver.stepping.phase import NO_PHASE
from reference_solver.stepping.vectors import copy_vectors
from reference_solver.tally import CONTACT_WORK, LOAD_WORK, SURFACE_WORK

#: Contacts of a phase that cost little: with more of them phases that creep try the patience of the step the sooner.
CHEAP = 4


@inner_kernel
def is_free(island: Island, i: int) -> bool:
    """Whether forces move body i."""
    return bool(island.bodies.motion[i] == FREE)


@inner_kernel
def patience(island: Island) -> int:
    """Soft events of a step in space, where those of bodies with faces cost much."""
    return MOST_SOFT_IN_SPACE


@spliced_kernel
def manifolds_of(island: Island) -> Manifolds:
    """Those found last; spliced, as numba returns no part of an array."""
    return island.room[: island.detection.found[MANIFOLDS]]


@inner_kernel
def find_contacts(island: Island) -> int:
    """Number of manifolds found for the state of the clock; -1 if an array is too small."""
    found = detect_touching(
        island.bodies, island.detection, island.room, island.memory, island.sub.past, island.options, island.sub.clock
    )
    return found if island.ledger.used[0] + POINTS * found <= len(island.ledger.real) else -1


@inner_kernel
def find_touching(island: Island) -> bool:
    """Points that touch or last."""
    return find_contacts(island) >= 0


@inner_kernel
def weigh_clusters(island: Island) -> None:
    """Of the points that touch."""
    jam.weigh_clusters(island.bodies, manifolds_of(island), island.sub, island.options, island.tally)


@inner_kernel
def begin_solve(island: Island) -> None:
    """Velocities of the start, and what a manifold needs to be solved as a whole."""
    copy_vectors(island.bodies.twist, island.bodies.before)
    for i in range(len(island.bodies)):
        for d in range(3):
            island.bodies.momentum_before[i, d] = island.bodies.angular_momentum[i, d]
    prepare_wrenches(island.bodies, manifolds_of(island), island.options)


@inner_kernel
def levers_of_start(island: Island) -> None:
    """Frames and levers before they were those of mid-drift."""
    midpoint.levers_of_start(island.bodies, manifolds_of(island), island.sub, island.options)


@inner_kernel
def collide_now(island: Island) -> int:
    """Impacts, from ``before`` to ``first``."""
    bodies, manifolds, sub = island.bodies, manifolds_of(island), island.sub
    return int(impact.collide_now(bodies, manifolds, island.problem, sub, island.options, island.tally))


@inner_kernel
def press_until_stick(island: Island, most: float, struck: bool) -> float:
    """From ``first`` to ``twist``; at impulse level it is one solve at mid-drift."""
    bodies, manifolds, problem, sub = island.bodies, manifolds_of(island), island.problem, island.sub
    if sub.clock[HELD] > 0.0 and len(manifolds) > 0:
        midpoint.press_at_mid_drift(bodies, manifolds, problem, sub, island.options, island.tally, most)
        return most
    return float(slide.press_until_stick(bodies, manifolds, problem, sub, island.options, island.tally, most, struck))


@inner_kernel
def press_for(island: Island, length: float, struck: bool) -> float:
    """Also up to the first end of a slide."""
    return press_until_stick(island, length, struck)


@inner_kernel
def end_series(island: Island, length: float) -> bool:
    """Points that are hit again and again."""
    return bool(impact.end_series(island.bodies, manifolds_of(island), island.sub, island.options, length))


@inner_kernel
def end_rocking(island: Island, length: float) -> tuple[float, float]:
    """No rule for more than two points that are hit in turn is known."""
    return 0.0, math.inf


@inner_kernel
def end_solve(island: Island) -> None:
    """Velocities of the end, and the tally before the work of the force phase."""
    copy_vectors(island.bodies.twist, island.bodies.last)
    keep(island.tally, island.sub.saved)


@inner_kernel
def enter_path(island: Island, length: float) -> float:
    """The frozen path, or that of a phase where rows turn along it."""
    bodies, manifolds, sub, options, tally = (
        island.bodies,
        manifolds_of(island),
        island.sub,
        island.options,
        island.tally,
    )
    smooth = phase.enter_phase(bodies, manifolds, sub, options, tally, sub.clock[LEFT], length)
    if smooth == NO_PHASE:
        return NO_PHASE
    if smooth > 0.0:
        length = smooth
        phase.part_points(bodies, manifolds, options, length)
    elif sub.clock[HELD] == 0.0:
        slide.certify_press(bodies, manifolds, options, tally, length)
    flight.begin_flight(bodies, manifolds, sub, options, length)
    return smooth


@inner_kernel
def return_to_start(island: Island) -> None:
    """Velocities and angular momenta; poses have not changed yet."""
    flight.undo(island.bodies)


@inner_kernel
def next_impact(island: Island, length: float) -> float:
    """On the paths of the bodies."""
    return float(
        time_of_impact.next_impact(
            island.bodies, island.detection, manifolds_of(island), island.sub, island.options, length
        )
    )


@inner_kernel
def leaves_bounds(island: Island, end: float) -> bool:
    """By the sum of all terms of the path."""
    bodies, limit, found = island.bodies, island.sub.limit, False
    for i in range(len(bodies)):
        if bodies.motion[i] != FREE:
            continue
        for k in range(3):
            way = end * (abs(bodies.twist[i, k]) + 0.5 * end * abs(flight.curvature(bodies, i, 0)[k]))
            if bodies.curved[i]:
                c = bodies.path[i, k]
                way = end * (abs(c[1]) + end * (abs(c[2]) + end * (abs(c[3]) + end * (abs(c[4]) + end * abs(c[5])))))
            found = leaves(limit, i, k, bodies.pose[i, k], way) or found
    return found


@inner_kernel
def follow_path(island: Island, length: float, end: float, curved: bool) -> float:
    """A phase that an impact cuts is made again up to there; a frozen sub-step is cut."""
    bodies, manifolds, sub, options, tally = (
        island.bodies,
        manifolds_of(island),
        island.sub,
        island.options,
        island.tally,
    )
    held = sub.clock[HELD] > 0.0
    if curved and end < length:
        phase.cut_phase(bodies, manifolds, sub, end)
        length = end
    remember_forces(island, length)
    if end < length or held:
        cut_work(bodies, manifolds, sub, options, tally, end, end / length)
    if held:
        midpoint.exchange_levers(manifolds, sub)
        enter_impulses(bodies, manifolds, manifolds.hit, island.ledger)
        midpoint.exchange_levers(manifolds, sub)
        enter_impulses(bodies, manifolds, manifolds.impulse, island.ledger)
    else:
        enter_contacts(bodies, manifolds, island.ledger)
    keep_state(sub.journal, bodies.pose, bodies.before)
    pushed = not curved and len(manifolds) > 0 and correct_positions(bodies, manifolds, options, tally)
    flight.move_along(bodies, end, end == length and not curved)
    if curved:
        phase.end_phase(bodies, sub, tally, end)
    if pushed:
        displace(bodies, options.dt)
    sub.clock[UNSETTLED] = end if held and len(manifolds) > 0 else 0.0
    enter_sub_step(bodies, manifolds, sub, options, end)
    return end


@inner_kernel
def cut_work(
    bodies: Bodies, manifolds: Manifolds, sub: SubStep, options: Options, tally: Array, end: float, share: float
) -> None:
    """Impulses, and work in the tally, of a sub-step that was solved at full length and cut at ``end``."""
    for entry in (CONTACT_WORK, SURFACE_WORK, LOAD_WORK):
        tally[entry] = sub.saved[entry]
    accelerate(bodies, end)
    open_solve(bodies, end, tally)
    for i in range(len(bodies)):
        for k in range(6):
            bodies.twist[i, k] = bodies.first[i, k] + share * (bodies.last[i, k] - bodies.first[i, k])
    for m in range(len(manifolds)):
        v, w = relative_twist(bodies.twist, manifolds, m, options.rotation)
        v_start, w_start = relative_twist(bodies.start, manifolds, m, options.rotation)
        for p in range(manifolds.points[m]):
            for k in range(3):
                manifolds.impulse[m, p, k] *= share
            both = add(velocity_at(v, w, manifolds, m, p), velocity_at(v_start, w_start, manifolds, m, p))
            done, moved, _ = point_work(bodies, manifolds, m, p, both)
            tally[CONTACT_WORK], tally[SURFACE_WORK] = tally[CONTACT_WORK] + done, tally[SURFACE_WORK] + moved
    copy_vectors(bodies.first, bodies.twist)


@inner_kernel
def remember_forces(island: Island, length: float) -> None:
    """Keep the forces of the sub-step: they start the next solve, and tell which contacts last (E20).

    In a very short sub-step the impulses stem from round-off and turning normals rather than from forces; what was
    known before is the better guess.
    """
    bodies, manifolds, memory, dt = island.bodies, manifolds_of(island), island.memory, island.options.dt
    for m in range(len(manifolds)):
        memory.pair[m] = pair_key(bodies, manifolds.body_a[m], manifolds.body_b[m])
        memory.points[m] = manifolds.points[m]
        for p in range(manifolds.points[m]):
            memory.feature[m, p] = manifolds.feature[m, p]
            known, divisor = row(manifolds.impulse[m], p, 0), max(length, SHORT * dt)
            ends = not impact.carries(manifolds, m, p, length / dt)
            if length < SHORT * dt and manifolds.force[m, p, 2] > 0.0:
                known, divisor = row(manifolds.force[m], p, 0), 1.0
            force = times_transposed(manifolds.frame, m, known)
            for d in range(3):
                memory.impulse[m, p, d] = 0.0 if ends else force[d] / divisor
    island.detection.found[REMEMBERED] = len(manifolds)


@inner_kernel
def note_touching(island: Island) -> int:
    """Of all points that touch."""
    return int(impact.note_touching(island.bodies, manifolds_of(island), island.sub, island.options))


@inner_kernel
def mark_contact(island: Island, k: int, ending: int) -> None:
    """In the table of manifolds."""
    row = island.sub.lasting.row[k]
    island.room.ending[row // POINTS, row % POINTS] = ending


@inner_kernel
def ending_of(island: Island, k: int) -> int:
    """As the table of manifolds has it."""
    row = island.sub.lasting.row[k]
    return int(island.room.ending[row // POINTS, row % POINTS])


@inner_kernel
def number_of(island: Island, i: int) -> int:
    """As the table of bodies has it."""
    return int(island.bodies.number[i])


@inner_kernel
def end_blow(island: Island) -> None:
    """Angular momenta follow the velocities, which are those after it already."""
    bodies, manifolds = island.bodies, manifolds_of(island)
    for i in range(len(bodies)):
        if bodies.gyroscopic[i]:
            collect_momentum(bodies, i, row(bodies.before, i, 3))
    enter_impulses(bodies, manifolds, manifolds.hit, island.ledger)
    keep_state(island.sub.journal, bodies.pose, bodies.before)
    enter_impact(bodies, manifolds, island.sub, island.options)


@inner_kernel
def gained_speed(island: Island, length: float) -> tuple[float, float]:
    """Of all components of each velocity."""
    bodies, gained, loaded = island.bodies, 0.0, 0.0
    for i in range(len(bodies)):
        for k in range(3):
            if bodies.motion[i] == FREE:
                gained = max(gained, abs(bodies.twist[i, k] - bodies.first[i, k]))
                loaded = max(loaded, length * abs(bodies.acceleration[i, k]))
    return gained, loaded


@inner_kernel
def price_of_creeping(island: Island) -> float:
    """Systems grow with the contacts noted."""
    return max(1.0, island.sub.lasting.size[LASTING] / CHEAP)


@inner_kernel
def find_loaded(island: Island) -> int:
    """Points of the end, with the forces that they carried: the clock tells that it is them who are wanted."""
    return find_contacts(island)


@inner_kernel
def put_back(island: Island) -> None:
    """Poses, and what goes with them: axes, inertia, and the spin that an angular momentum has about those axes."""
    bodies, lasting = island.bodies, island.sub.lasting
    space = Spatial(bodies, bodies.pose, bodies.twist)
    for i in range(len(bodies)):
        if bodies.motion[i] == FREE:
            displace_from_start(space, lasting, i)
            if bodies.gyroscopic[i]:
                w = spin_of(bodies, i, row(bodies.angular_momentum, i, 0))
                for d in range(3):
                    bodies.twist[i, 3 + d] = w[d]


@inner_kernel
def close_gaps(island: Island) -> bool:
    """By displacements of all points."""
    return bool(midpoint.close_gaps(island.bodies, manifolds_of(island), island.options))


@inner_kernel
def deepest_overlap(island: Island) -> float:
    """Of all points."""
    return float(midpoint.deepest(island.bodies, manifolds_of(island)))


@inner_kernel
def misses_end(island: Island, time: float) -> bool:
    """Of all points."""
    return bool(midpoint.misses_end(island.bodies, manifolds_of(island), island.options, time))


@inner_kernel
def solve_end(island: Island, time: float) -> None:
    """Starts from the impulses of the sub-step."""
    bodies, manifolds, options, tally = island.bodies, manifolds_of(island), island.options, island.tally
    prepare_wrenches(bodies, manifolds, options)
    midpoint.take_back(bodies, manifolds, options, tally)
    open_solve(bodies, 0.0, tally)
    warm_start(bodies, manifolds, options)
    solve_velocities(bodies, manifolds, island.problem, options, tally)
    certify(bodies, manifolds, options, tally)
    midpoint.keep_change(bodies, manifolds, time)
    enter_impulses(bodies, manifolds, manifolds.hit, island.ledger)


@inner_kernel
def enter_settled(island: Island) -> None:
    """As a piece of no length."""
    enter_settled_piece(island.bodies, manifolds_of(island), island.sub, island.options)


@inner_kernel
def find_islands(whole: Island, world: World) -> bool:
    """By bounding boxes of all that a body, turned at will, may sweep."""
    bodies, options, limit, boxes = whole.bodies, whole.options, world.islands.limit, whole.detection.boxes
    bound_bodies(bodies, boxes, options)
    for i in range(len(bodies)):
        far = flight.reach_of(bodies, i) + radius_of(bodies, i) if bodies.kind[i] != HALF_SPACE else math.inf
        world.islands.reach[i] = far + options.margin * bodies.extent[i]
        if bodies.kind[i] == HALF_SPACE:
            normal = times(bodies.axes, i, row(bodies.geometry, i, 0))
            for k in range(3):
                world.islands.plane[i, k] = 0.0 if bodies.turning[i] else normal[k]
            world.islands.plane[i, 3] = bodies.geometry[i, 3]
        for k in range(3):
            way = abs(bodies.twist[i, k]) * options.dt
            if bodies.motion[i] == FREE:
                way += 0.5 * options.dt * options.dt * abs(bodies.acceleration[i, k])
                way += options.margin * bodies.extent[i]
            way += 1e-14 * abs(bodies.pose[i, k])  # rounding of the sums
            limit[i, k], limit[i, 3 + k] = bodies.pose[i, k] - way, bodies.pose[i, k] + way
            if bodies.turning[i]:
                boxes.low[i, k] = min(boxes.low[i, k], bodies.pose[i, k] - far)
                boxes.high[i, k] = max(boxes.high[i, k], bodies.pose[i, k] + far)
            boxes.low[i, k] -= way
            boxes.high[i, k] += way
    if not find_overlaps(bodies, whole.detection, options):
        return False
    join_candidates(whole, world.islands, boxes.candidate, whole.detection.found[CANDIDATES])
    return True


@inner_kernel
def begin_islands(whole: Island) -> None:
    """Counts of what is kept and entered."""
    whole.detection.found[KEPT] = whole.ledger.used[0] = 0


@inner_kernel
def gather(whole: Island, world: World, count: int) -> Island:
    """Bodies in order of their place, and their bounds."""
    for k in range(count):
        i = world.islands.member[k]
        world.bodies[k] = whole.bodies[i]
        for d in range(6):
            world.limit[k, d] = world.islands.limit[i, d]
    whole.sub.lasting.size[BODIES] = count
    whole.detection.found[REMEMBERED] = -1
    laws = whole.detection
    detection = Detection(
        laws.found,
        laws.restitution,
        laws.friction,
        boxes_part(laws.boxes, count),
        laws.polygon,
        laws.polygon_edge,
    )
    return Island(
        world.bodies[:count],
        detection,
        whole.room,
        whole.memory,
        problem_part(whole.problem, count),
        sub_part(whole.sub, world, count),
        whole.ledger,
        whole.options,
        whole.tally,
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
        meeting.sunk,
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
def keep_memory(island: Island, world: World) -> bool:
    """In order of the pairs."""
    found = island.detection.found
    if found[KEPT] + max(found[REMEMBERED], 0) > len(world.kept):
        found[CANDIDATES] = 0  # it is manifolds that there are too few of
        return False
    keep_remembered(island.detection, island.memory, world.kept)
    return True


@inner_kernel
def keep_end(island: Island, world: World) -> None:
    """All of their records."""
    for k in range(len(island.bodies)):
        world.end[world.islands.member[k]] = island.bodies[k]


@inner_kernel
def end_islands(whole: Island, world: World) -> None:
    """What forces do not move goes on with its velocity."""
    bodies = whole.bodies
    pass_on(whole.detection, world.kept, whole.sub.past)
    for i in range(len(bodies)):
        if bodies.motion[i] == FREE:
            bodies[i] = world.end[i]
        elif bodies.motion[i] != FIXED:
            for k in range(6):
                bodies.rate[i, k] = 0.0
            flight.place_at(bodies, i, whole.options.dt, bodies, i)


@inner_kernel
def contacts_entered(whole: Island, buffer: Buffer, start: int) -> int:
    """All of the ledger."""
    return int(copy_ledger(whole.ledger, buffer, start))


@inner_kernel
def most_contacts(whole: Island) -> int:
    """As many as there is room to find."""
    return POINTS * len(whole.room)


@inner_kernel
def make_fixed_step(whole: Island) -> bool:
    """The step of `step.py`."""
    done = step(whole.bodies, whole.detection, whole.room, whole.memory, whole.problem, whole.options, whole.tally)
    if done:
        found = whole.room[: whole.detection.found[MANIFOLDS]]
        enter_fixed_step(whole.sub.journal, whole.bodies, found, whole.options)
    return bool(done)


@inner_kernel
def contacts_found(whole: Island, buffer: Buffer, start: int) -> int:
    """Those of the last step."""
    return int(copy_contacts(whole.room[: whole.detection.found[MANIFOLDS]], buffer, start))


operations.provide_all(Island, globals())
for asked, kernel in (
    (operations.sweep_blocks, sweep_blocks),
    (operations.sweep_rows, sweep_points),
    (operations.natural_map, natural_map),
    (operations.solve_directly, solve_directly),
    (operations.mend_velocities, mend_velocities),
):
    operations.provide(asked, np.recarray, kernel)
