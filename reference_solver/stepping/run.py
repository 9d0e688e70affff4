"""Runs of located and of fixed steps, and the step of the whole world: islands of bodies that can meet (E29)."""

from __future__ import annotations

from typing import Any

from reference_solver.compilation import inner_kernel, kernel, spliced_kernel
from reference_solver.journal import close_step, keep_state
from reference_solver.stepping.accounting import keep
from reference_solver.stepping.clock import CONFINED, ESCAPED, LEFT, UNSETTLED
from reference_solver.stepping.driver import step_island
from reference_solver.stepping.islands import LEFT_BOUNDS, MADE, NO_ROOM, ROOM, gather_all, list_members, root
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
        sampled = stride > 0 and (k + 1) % stride == 0
        if sampled and len(buffer.real) > 0 and buffer.offset[k // stride] + len(whole.ledger.real) > len(buffer.real):
            return k
        if not step_world(whole, world):
            return k
        close_step(whole.sub.journal)
        if sampled:
            s = (k + 1) // stride - 1
            sample_state(whole, buffer, s)
            if len(buffer.real) > 0:
                buffer.offset[s + 1] += contacts_entered(whole, buffer, buffer.offset[s])
    return steps


@kernel
def run_steps(whole: Island, buffer: Any, first: int, steps: int, stride: int) -> int:
    """Make fixed steps of all bodies; otherwise as `run_located`."""
    for k in range(first, steps):
        sampled = stride > 0 and (k + 1) % stride == 0
        if sampled and len(buffer.real) > 0 and buffer.offset[k // stride] + most_contacts(whole) > len(buffer.real):
            return k
        keep_state(whole.sub.journal, whole.bodies.pose, whole.bodies.twist)
        if not make_fixed_step(whole):
            return k
        close_step(whole.sub.journal)
        if sampled:
            s = (k + 1) // stride - 1
            sample_state(whole, buffer, s)
            if len(buffer.real) > 0:
                buffer.offset[s + 1] += contacts_found(whole, buffer, buffer.offset[s])
    return steps


@inner_kernel
def sample_state(whole: Island, buffer: Any, s: int) -> None:
    """Write poses and twists as sample s, without contacts yet."""
    copy_vectors(whole.bodies.pose, buffer.pose[s])
    copy_vectors(whole.bodies.twist, buffer.twist[s])
    buffer.offset[s + 1] = buffer.offset[s]


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
