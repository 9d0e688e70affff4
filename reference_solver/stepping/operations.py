"""What the step asks of a dimension, by name.

A kernel that calls one of these functions is compiled once for each dimension: the callee is chosen by the type of the
first argument, the dimension's ``Bodies`` (in space an array of records) or its ``Island``, while numba infers types.
Callees are compiled as part of their caller, so that the caller's machine code is found on disk again by the next
process. Uncompiled, a table does the same.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from numba.extending import overload

from reference_solver.compilation import INNER_OPTIONS, config

#: The bodies of either dimension: what operations are chosen by.
Bodies: TypeAlias = Any
#: The bodies of an island of either dimension, or of the whole world, with all that their step works on.
Island: TypeAlias = Any


def operation(function: Callable[..., Any]) -> Any:
    """Make a function of the step out of the documented, empty ``function``; dimensions `provide` what it does."""
    table: dict[type, Any] = {}
    if config.DISABLE_JIT:

        def chosen(first: Any, *others: Any) -> Any:
            return table[type(first)](first, *others)

        chosen.__name__, chosen.__doc__ = function.__name__, function.__doc__
        chosen.table = table  # type: ignore[attr-defined]
        return chosen

    @overload(function, jit_options=INNER_OPTIONS, strict=False)
    def pick(first: Any, *others: Any) -> Any:
        found = table.get(getattr(first, "instance_class", np.recarray))
        return None if found is None else found.py_func

    function.table = table  # type: ignore[attr-defined]
    return function


def provide(name: Any, bodies: type, kernel: Any) -> None:
    """Let the operation ``name`` be ``kernel`` where the first argument is a ``bodies``."""
    name.table[bodies] = kernel


@operation
def is_free(bodies: Any, i: int) -> bool:
    """Whether forces move body i."""
    raise NotImplementedError


@operation
def hold(bodies: Any, rows: Any, lasting: Any, c: int, k: int) -> None:
    """Note the touching features of row c as contact k: bodies, friction, and features in body axes.

    Fills ``lasting.body[k]``, ``lasting.friction[k]``, ``lasting.kind[k]``, ``lasting.place[k]``; bodies stand at the
    start of the phase.
    """


@operation
def next_features(bodies: Any, lasting: Any, k: int) -> bool:
    """Let contact k go on with other features that touch in its place; False, with those it has, if all were tried.

    Bodies stand at the start of the phase.
    """
    raise NotImplementedError


@operation
def evaluate(bodies: Any, lasting: Any) -> None:
    """Follow the noted features of all contacts at the present poses and twists.

    Fills gap, frame, jacobian, response (rows of J M^-1), speed (u = J v) and gamma = (dJ/dt) v of every contact.
    """


@operation
def free_accelerations(bodies: Any, lasting: Any) -> None:
    """Fill ``lasting.free``: accelerations of all bodies without contacts, at the present poses and twists."""


@operation
def displace(bodies: Any, lasting: Any, i: int) -> None:
    """Put body i at ``lasting.base[i]`` moved by ``lasting.displacement[i]``."""


@operation
def displacement_rate(bodies: Any, lasting: Any, i: int, stage: int) -> None:
    """Fill ``lasting.rate[stage, i]`` from the displacement and ``bodies.twist[i]``."""


@operation
def displacement_curvature(bodies: Any, lasting: Any, i: int, end: int) -> None:
    """Fill ``lasting.bend[end, i]``, second derivative of the displacement, also from ``lasting.acceleration[i]``."""


@operation
def feature_limits(bodies: Any, lasting: Any, k: int, place: int) -> None:
    """Fill ``lasting.monitor[place, k, FEATURE:]``: distances of contact k from where its features end [m].

    Positive within, infinite where there is no such end. From the ends of lines and faces, and from where the normal
    looks out of an edge or a corner no more.
    """
    raise NotImplementedError


# ---- Contact solves (`stepping.iteration`): rows of the plane, manifolds of space.


@operation
def sweep_blocks(bodies: Bodies, rows: Any, options: Any, relaxation: float) -> None:
    """One sweep over all manifolds, the rows of each solved together (E12)."""
    raise NotImplementedError


@operation
def sweep_rows(bodies: Bodies, rows: Any, options: Any, relaxation: float, backwards: int, push: int) -> None:
    """One sweep, row after row (E10, E11); with the points of a manifold ``backwards``, with ``push`` rows (E16)."""
    raise NotImplementedError


@operation
def natural_map(bodies: Bodies, rows: Any, options: Any) -> float:
    """Largest scaled natural-map residual over all rows, dimensionless (E14)."""
    raise NotImplementedError


@operation
def solve_directly(bodies: Bodies, rows: Any, options: Any, problem: Any, budget: int, fresh: bool) -> float:
    """Set the impulses that the direct solver finds within `budget` factorisations; returns their residual."""
    raise NotImplementedError


@operation
def mend_velocities(bodies: Bodies, rows: Any, options: Any) -> None:
    """Build velocities anew from impulses, should they differ by more than round-off."""
    raise NotImplementedError


# ---- The located step (`stepping.driver`): an island goes from event to event.


@operation
def patience(island: Any) -> int:
    """Soft events located in a step, less one for each body."""
    raise NotImplementedError


@operation
def find_touching(island: Any) -> bool:
    """Find the contacts that touch or carried load a moment ago (E20); False if an array is too small."""
    raise NotImplementedError


@operation
def weigh_clusters(island: Any) -> None:
    """Weigh each cluster of bodies that touch, and tell the clock which jam (E28)."""


@operation
def begin_solve(island: Any) -> None:
    """Keep the velocities with which the sub-step begins, and prepare the rows found."""


@operation
def levers_of_start(island: Any) -> None:
    """Bring back the rows that the sub-step began with, after a solve at mid-drift."""


@operation
def collide_now(island: Any) -> int:
    """Solve the impacts of all touching contacts together (E21); what they were (`stepping.impacts`)."""
    raise NotImplementedError


@operation
def press_until_stick(island: Any, most: float, struck: bool) -> float:
    """Solve the force phase up to the first end of a slide, at most ``most``; return its length (E23).

    ``struck``: impacts came first.
    """
    raise NotImplementedError


@operation
def press_for(island: Any, length: float, struck: bool) -> float:
    """Solve the force phase again for contacts that are held for ``length``; return its length."""
    raise NotImplementedError


@operation
def end_series(island: Any, length: float) -> bool:
    """Mark rebounds whose series ends within ``length`` (E22); whether any was marked, so that all is solved anew."""
    raise NotImplementedError


@operation
def end_rocking(island: Any, length: float) -> tuple[float, float]:
    """Mark contacts between which bodies rock to rest (E22): time until the last has, shortest until one returns."""
    raise NotImplementedError


@operation
def end_solve(island: Any) -> None:
    """Keep the velocities with which the sub-step ends."""


@operation
def enter_path(island: Any, length: float) -> float:
    """Find the paths of all bodies; the length of the phase they belong to, 0 where the frozen solve is exact.

    `phase.NO_PHASE` where rows turn and there is no phase (E35), or where it must not be looked for.
    """
    raise NotImplementedError


@operation
def return_to_start(island: Any) -> None:
    """Put bodies where the sub-step began, with their velocities there."""


@operation
def next_impact(island: Any, length: float) -> float:
    """First time up to ``length`` at which bodies meet on their paths (E24); < 0 if an array is too small."""
    raise NotImplementedError


@operation
def leaves_bounds(island: Any, end: float) -> bool:
    """Whether any free body's path until ``end`` may leave the bounds given for the step; its own become wider."""
    raise NotImplementedError


@operation
def follow_path(island: Any, length: float, end: float, curved: bool) -> float:
    """Move along the paths until ``end`` of ``length``, enter impulses and work; where it was, to the last digits.

    ``curved``: the paths are those of a phase.
    """
    raise NotImplementedError


@operation
def note_touching(island: Any) -> int:
    """Note the contacts that touch in the room of a phase, each with its normal row alone; how many, -1 if too many.

    Fills ``lasting.row[k]``, ``body[k]``, ``friction[k]``, ``jacobian[k, :, 0]``, ``response[k, :, 0]``,
    ``speed[k, 0]``, in ``usual[k, 0]`` its e, and in ``speeds[k]`` the speed below which it neither meets nor parts.
    """
    raise NotImplementedError


@operation
def mark_contact(island: Any, k: int, ending: int) -> None:
    """Say what becomes of noted contact k in the impact (`stepping.impacts`)."""


@operation
def ending_of(island: Any, k: int) -> int:
    """Return what becomes of noted contact k in the impact."""
    raise NotImplementedError


@operation
def number_of(island: Any, i: int) -> int:
    """Return the number that body i has in the world."""
    raise NotImplementedError


@operation
def end_blow(island: Any) -> None:
    """Enter an impact that another one follows at once; velocities are those after it."""


@operation
def gained_speed(island: Any, length: float) -> tuple[float, float]:
    """Largest change of a velocity in a sub-step, and what loads do in it, over free bodies [m/s]."""
    raise NotImplementedError


@operation
def price_of_creeping(island: Any) -> float:
    """What a phase counts that was cut short, in units of one that costs little."""
    raise NotImplementedError


@operation
def find_loaded(island: Any) -> int:
    """Find the contacts that carried load in the sub-step that ended, or overlap; how many, < 0 without room."""
    raise NotImplementedError


@operation
def put_back(island: Any) -> None:
    """Put all bodies where `driver.keep_places` found them."""
    raise NotImplementedError


@operation
def close_gaps(island: Any) -> bool:
    """Move bodies until the gaps of the contacts found are closed (E28); whether rows are not what they were."""
    raise NotImplementedError


@operation
def deepest_overlap(island: Any) -> float:
    """Largest overlap of the contacts found, as a share of the smaller half width."""
    raise NotImplementedError


@operation
def misses_end(island: Any, time: float) -> bool:
    """Whether velocities are not those that contacts held over ``time`` allow at its end; gives rows their impulses."""
    raise NotImplementedError


@operation
def solve_end(island: Any, time: float) -> None:
    """Find the impulses of contacts held over ``time`` anew, with their rows at its end, and enter the change."""


@operation
def enter_settled(island: Any) -> None:
    """Enter what was changed of poses and impulses at the end of a sub-step at impulse level."""


# ---- The step of the whole world (`stepping.run`): islands are gathered, stepped and put back.


@operation
def find_islands(whole: Any, world: Any) -> bool:
    """Join the free bodies that may meet within the way they go; False if an array is too small."""
    raise NotImplementedError


@operation
def begin_islands(whole: Any) -> None:
    """Nothing is kept for the next step yet, and no contact of this one entered."""


@operation
def gather(whole: Any, world: Any, count: int) -> Any:
    """Copy the ``count`` bodies listed as members to the front of the world's room; the island they are."""


@operation
def keep_memory(island: Any, world: Any) -> bool:
    """Keep what is remembered of the island's contacts for the next step; False if there is too little room."""
    raise NotImplementedError


@operation
def keep_end(island: Any, world: Any) -> None:
    """Keep the states in which the island's bodies end the step."""


@operation
def end_islands(whole: Any, world: Any) -> None:
    """Take over all states and memories at the end of the step."""


@operation
def contacts_entered(whole: Any, buffer: Any, start: int) -> int:
    """Write the contacts of the ledger from index ``start`` on; return how many."""
    raise NotImplementedError


# ---- The fixed step of the whole world (`stepping.run`).


@operation
def most_contacts(whole: Any) -> int:
    """Contacts that there is room for."""
    raise NotImplementedError


@operation
def make_fixed_step(whole: Any) -> bool:
    """One step with one contact problem, entered in the journal; False if an array is too small."""
    raise NotImplementedError


@operation
def contacts_found(whole: Any, buffer: Any, start: int) -> int:
    """Write the contacts of the last fixed step from index ``start`` on; return how many."""
    raise NotImplementedError


#: What an island's dimension provides, all of it.
OF_ISLANDS = (
    is_free,
    patience,
    find_touching,
    weigh_clusters,
    begin_solve,
    levers_of_start,
    collide_now,
    press_until_stick,
    press_for,
    end_series,
    end_rocking,
    end_solve,
    enter_path,
    return_to_start,
    next_impact,
    leaves_bounds,
    follow_path,
    note_touching,
    mark_contact,
    ending_of,
    number_of,
    end_blow,
    gained_speed,
    price_of_creeping,
    find_loaded,
    put_back,
    close_gaps,
    deepest_overlap,
    misses_end,
    solve_end,
    enter_settled,
    find_islands,
    begin_islands,
    gather,
    keep_memory,
    keep_end,
    end_islands,
    contacts_entered,
    most_contacts,
    make_fixed_step,
    contacts_found,
)


def provide_all(island: type, names: dict[str, Any]) -> None:
    """Let all operations of an island be the kernels of the same names.

    Raises
    ------
    KeyError
        If one is missing.
    """
    for operation_of_island in OF_ISLANDS:
        provide(operation_of_island, island, names[operation_of_island.__name__])
