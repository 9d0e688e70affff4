"""Runs of located and of fixed steps, and the step of the whole world: islands of bodies that can meet (E29)."""

from __future__ import annotations

from typing import Any

from reference_solver.compilation import inner_kernel, kernel, spliced_kernel
from reference_solver.journal import close_step, keep_state
from reference_solver.stepping.accounting import keep
from reference_solver.stepping.clock import CONFINED, ESCAPED, LEFT, UNSETTLED
from reference_solver.stepping.driver import step_island
from reference_solver.stepping.islands import (
    ALONE,
    LEFT_BOUNDS,
    MADE,
    NO_ROOM,
    RESTARTS,
    WIDENINGS,
    gather_all,
    list_members,
    root,
    widen,
)
from reference_solver.stepping.operations import (
    Island,
    begin_islands,
    contacts_entered,
    contacts_found,
    end_islands,
    find_islands,
    gather,
    is_free,
    keep_end,
    keep_memory,
    make_fixed_step,
    most_contacts,
)
from reference_solver.stepping.vectors import are_finite, copy_vectors
from reference_solver.tally import OPENED


@kernel
def run_located(whole: Island, world: Any, buffer: Any, first: int, steps: int, stride: int) -> int:
    """Make steps ``first`` .. ``steps`` - 1 of all bodies, sampling after every ``stride`` of them (0: never).

    Returns the number of steps done: fewer than ``steps`` when an array must grow, or when the contact buffer could not
    take a full sample more. The caller grows it and calls again.
    """
    for k in range(first, steps):
        if lacks_room(buffer, k, stride, len(whole.ledger.real)) or not step_world(whole, world):
            return k
        s = end_step(whole, buffer, k, stride)
        if s >= 0:
            buffer.offset[s + 1] += contacts_entered(whole, buffer, buffer.offset[s])
    return steps


@kernel
def run_steps(whole: Island, buffer: Any, first: int, steps: int, stride: int) -> int:
    """Make fixed steps of all bodies; otherwise as `run_located`."""
    for k in range(first, steps):
        if lacks_room(buffer, k, stride, most_contacts(whole)):
            return k
        keep_state(whole.sub.journal, whole.bodies.pose, whole.bodies.twist)
        if not make_fixed_step(whole):
            return k
        s = end_step(whole, buffer, k, stride)
        if s >= 0:
            buffer.offset[s + 1] += contacts_found(whole, buffer, buffer.offset[s])
    return steps


@inner_kernel
def lacks_room(buffer: Any, k: int, stride: int, most: int) -> bool:
    """Whether the sample after step k may not take the ``most`` contacts that there can be."""
    if stride == 0 or (k + 1) % stride > 0 or len(buffer.real) == 0:
        return False
    return bool(buffer.offset[k // stride] + most > len(buffer.real))


@inner_kernel
def end_step(whole: Island, buffer: Any, k: int, stride: int) -> int:
    """Write poses and twists if a sample follows step k; its number if contacts are to follow, else -1."""
    close_step(whole.sub.journal)
    if stride == 0 or (k + 1) % stride > 0:
        return -1
    s = (k + 1) // stride - 1
    copy_vectors(whole.bodies.pose, buffer.pose[s])
    copy_vectors(whole.bodies.twist, buffer.twist[s])
    buffer.offset[s + 1] = buffer.offset[s]
    return s if len(buffer.real) > 0 else -1


@spliced_kernel
def step_world(whole: Island, world: Any) -> bool:
    """One step; False if an array is too small: called again, it makes the step anew."""
    if not are_finite(whole.bodies.twist):
        return True
    keep(whole.tally, world.tally)
    if not find_islands(whole, world):
        return False
    outcome, confined = MADE, True
    for attempt in range(RESTARTS + 1):
        if outcome == LEFT_BOUNDS or attempt == RESTARTS:
            gather_all(whole, world.islands)
            confined = False
        outcome = step_islands(whole, world, confined)
        if outcome == MADE:
            return True
        keep(world.tally, whole.tally)
        if outcome == NO_ROOM:
            return False
    return True


@spliced_kernel
def step_islands(whole: Island, world: Any, confined: bool) -> int:
    """Make the step of every island; bodies change only if all stayed in their bounds, where they are confined."""
    islands, journal, used = world.islands, whole.sub.journal, whole.ledger.used
    clock, tally = whole.sub.clock, whole.tally
    opened, pieces, entries, contacts = tally[OPENED], journal.used[0], journal.used[1], journal.used[2]
    begin_islands(whole)
    for i in range(len(islands.label)):
        if not is_free(whole, i) or root(islands, i) != i:
            continue
        keep(tally, world.before)
        piece, entry, contact, listed = journal.used[0], journal.used[1], journal.used[2], used[0]
        outcome = NO_ROOM
        island, goes_on = gather(whole, world, list_members(islands, i)), False
        for attempt in range(WIDENINGS + 1):
            if opened == 0.0 and not goes_on:
                tally[OPENED] = 0.0  # each island has a first solve, in which an overlap is one of the start
            clock[CONFINED], clock[ESCAPED] = 1.0 if confined else 0.0, 0.0
            if not step_island(island, goes_on):
                outcome = NO_ROOM
                break
            if clock[ESCAPED] == 0.0:
                outcome = MADE
                if not keep_memory(island, world):
                    outcome = NO_ROOM
                else:
                    keep_end(island, world)
                break
            outcome = LEFT_BOUNDS
            if attempt == WIDENINGS:
                break
            outcome = widen(whole, islands, i, island.sub.limit)
            goes_on = outcome == ALONE
            if goes_on:
                continue
            if outcome != MADE:
                break
            keep(world.before, tally)
            clock[LEFT] = clock[UNSETTLED] = 0.0
            journal.used[0], journal.used[1], journal.used[2], used[0] = piece, entry, contact, listed
            island = gather(whole, world, list_members(islands, i))
        if outcome != MADE:
            clock[LEFT] = clock[UNSETTLED] = 0.0
            journal.used[0], journal.used[1], journal.used[2] = pieces, entries, contacts
            return outcome
    end_islands(whole, world)
    return MADE
