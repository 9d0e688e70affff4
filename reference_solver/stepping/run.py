"""A run of located steps, and the step of the whole world: islands of bodies that can meet, each by itself (E29)."""

from __future__ import annotations

from typing import Any

from reference_solver.compilation import kernel, spliced_kernel
from reference_solver.journal import close_step
from reference_solver.stepping.accounting import keep
from reference_solver.stepping.clock import CONFINED, ESCAPED, LEFT, UNSETTLED
from reference_solver.stepping.driver import step_island
from reference_solver.stepping.islands import LEFT_BOUNDS, MADE, NO_ROOM, ROOM, gather_all, list_members, root
from reference_solver.stepping.operations import (
    Island,
    begin_islands,
    end_islands,
    find_islands,
    gather,
    is_free,
    keep_end,
    keep_memory,
    sample_located,
)
from reference_solver.stepping.vectors import are_finite
from reference_solver.tally import OPENED


@kernel
def run_located(whole: Island, world: Any, buffer: Any, first: int, steps: int, stride: int) -> int:
    """Make steps ``first`` .. ``steps`` - 1 of all bodies, sampling after every ``stride`` of them (0: never).

    Returns the number of steps done: fewer than ``steps`` when an array must grow, or when the contact buffer could not
    take a full sample more. The caller grows it and calls again.
    """
    for k in range(first, steps):
        sampled = stride > 0 and (k + 1) % stride == 0
        if sampled and len(buffer.real) > 0 and buffer.offset[k // stride] + len(whole.ledger.real) > len(buffer.real):
            return k
        if not step_world(whole, world):
            return k
        close_step(whole.sub.journal)
        if sampled:
            sample_located(whole, buffer, (k + 1) // stride - 1)
    return steps


@spliced_kernel
def step_world(whole: Island, world: Any) -> bool:
    """One step; False if an array is too small: called again, it makes the step anew."""
    if not are_finite(whole.bodies.twist):
        return True
    keep(whole.tally, world.tally)
    for attempt in range(len(ROOM) + 1):
        if attempt == len(ROOM):
            gather_all(whole, world.islands)
        elif not find_islands(whole, world, ROOM[attempt]):
            return False
        outcome = step_islands(whole, world, attempt < len(ROOM))
        if outcome == MADE:
            return True
        keep(world.tally, whole.tally)
        if outcome == NO_ROOM:
            return False
    return True


@spliced_kernel
def step_islands(whole: Island, world: Any, confined: bool) -> int:
    """Make the step of every island; bodies change only if all stayed in their bounds, where they are confined."""
    islands, journal, clock, tally = world.islands, whole.sub.journal, whole.sub.clock, whole.tally
    opened, pieces, entries, contacts = tally[OPENED], journal.used[0], journal.used[1], journal.used[2]
    begin_islands(whole)
    for i in range(len(islands.label)):
        if not is_free(whole, i) or root(islands, i) != i:
            continue
        island = gather(whole, world, list_members(islands, i))
        if opened == 0.0:
            tally[OPENED] = 0.0  # each island has a first solve, in which an overlap is one of the start
        clock[CONFINED], clock[ESCAPED] = 1.0 if confined else 0.0, 0.0
        outcome = NO_ROOM
        if step_island(island):
            outcome = LEFT_BOUNDS if clock[ESCAPED] > 0.0 else MADE
        if outcome == MADE and not keep_memory(island, world):
            outcome = NO_ROOM
        if outcome != MADE:
            clock[LEFT] = clock[UNSETTLED] = 0.0
            journal.used[0], journal.used[1], journal.used[2] = pieces, entries, contacts
            return outcome
        keep_end(island, world)
    end_islands(whole, world)
    return MADE
