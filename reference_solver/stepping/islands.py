"""Islands: bodies that can meet each other within a step, each stepped by itself (E29).

Free bodies whose places within the step may overlap are joined; bodies that forces do not move join nobody, and belong
to every island that may touch them. Places are bounds that hold unless an impact makes a body faster: where one leaves
its own its island is stepped again with wider ones, together with whoever it may meet in these. Bodies that can meet
nobody make their step together, which costs less: with nothing to solve or to meet none knows of another.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.stepping.broadphase import bodies_of
from reference_solver.stepping.operations import Bodies, is_free
from reference_solver.structures import structure

Indices = NDArray[np.int64]

#: Entries of `Islands.size`: entries of the lists of bodies that forces do not move, bodies of the island gathered.
NODES, MEMBERS = 0, 1
SIZES = 2
#: How many times as far a body may get that leaves its bounds as it got there: it goes on until the step ends.
FARTHER = 2.0
#: Times that an island is stepped again in wider bounds, and how often whoever it meets there had made his step before,
#: so that all do it anew: a few are seen, more are no use, and what is left is one island without bounds.
WIDENINGS, RESTARTS = 16, 8

#: What became of an attempt: all islands made their step; one left its bounds for good; an array was too small; one
#: was joined with another that had made its step. And of wider bounds: nobody else is met in them.
MADE, LEFT_BOUNDS, NO_ROOM, JOINED, ALONE = 0, 1, 2, 3, 4


@structure
class Islands(NamedTuple):
    """Which free bodies belong together; n bodies, c candidates, d axes."""

    size: Indices  # (SIZES,)
    label: Indices  # (n,): lowest free body of the island
    first: Indices  # (n,): first entry of the list of unmoved bodies of the island, -1: none
    following: Indices  # (c,): next entry of that list
    unmoved: Indices  # (c,): body of an entry
    member: Indices  # (n,): bodies of the island gathered, ascending
    local: Indices  # (n,): place of a body among them
    mark: Indices  # (n,): island that a body was listed in last
    next_free: Indices  # (n,): free body of the same island that follows, -1 after the last
    last: Indices  # (n,): last one so far
    limit: Array  # (n, 2 d): lower and upper bounds of the centres within the step [m]
    reach: Array  # (n,): how far a body, turned at will, gets from its centre [m]
    plane: Array  # (n, d + 1): normal and offset [m] of a half-space that keeps its normal, zeros of all else
    pose: Array  # (n, P): at the end of the step
    twist: Array  # (n, V)


def allocate_islands(dimension: int, bodies: int, candidates: int) -> Islands:
    """Return room for the islands of ``bodies`` bodies."""
    n, p, v = bodies, 3 if dimension == 2 else 7, 3 * (dimension - 1)
    whole = [np.zeros(n, np.int64) for _ in range(7)]
    return Islands(
        size=np.zeros(SIZES, np.int64),
        label=whole[0],
        first=whole[1],
        following=np.zeros(candidates, np.int64),
        unmoved=np.zeros(candidates, np.int64),
        member=whole[2],
        local=whole[3],
        mark=whole[4],
        next_free=whole[5],
        last=whole[6],
        limit=np.zeros((n, 2 * dimension)),
        reach=np.zeros(n),
        plane=np.zeros((n, dimension + 1)),
        pose=np.zeros((n, p)),
        twist=np.zeros((n, v)),
    )


@inner_kernel
def first_of(label: Indices, i: int) -> int:
    """Lowest body joined with body i so far; shortens the way there."""
    while label[i] != i:
        label[i] = label[label[i]]
        i = label[i]
    return i


@inner_kernel
def root(islands: Islands, i: int) -> int:
    """Lowest body joined with free body i so far."""
    return first_of(islands.label, i)


@inner_kernel
def join(islands: Islands, i: int, j: int) -> None:
    """Let free bodies i and j belong together."""
    i, j = root(islands, i), root(islands, j)
    islands.label[max(i, j)] = min(i, j)


@inner_kernel
def list_unmoved(islands: Islands, island: int, body: int) -> None:
    """Let an unmoved body belong to an island as well; it may be listed twice."""
    entry = islands.size[NODES]
    islands.unmoved[entry], islands.following[entry] = body, islands.first[island]
    islands.first[island] = entry
    islands.size[NODES] = entry + 1


@inner_kernel
def list_members(islands: Islands, island: int) -> int:
    """Fill `member` with the bodies of an island in ascending order; their number."""
    count = 0
    i = island
    while i >= 0:
        islands.member[count] = i
        count += 1
        i = islands.next_free[i]
    entry = islands.first[island]
    while entry >= 0:
        body = islands.unmoved[entry]
        if islands.mark[body] != island:
            islands.mark[body] = island
            k = count
            while k > 0 and islands.member[k - 1] > body:
                islands.member[k] = islands.member[k - 1]
                k -= 1
            islands.member[k] = body
            count += 1
        entry = islands.following[entry]
    for k in range(count):
        islands.local[islands.member[k]] = k
    islands.size[MEMBERS] = count
    return count


@inner_kernel
def open_islands(islands: Islands) -> None:
    """Let every body be by itself, and in no island's list."""
    islands.size[NODES] = 0
    for i in range(len(islands.label)):
        islands.label[i], islands.first[i], islands.mark[i], islands.next_free[i] = i, -1, -1, -1


@inner_kernel
def gather_all(bodies: Bodies, islands: Islands) -> None:
    """Let all bodies be one island."""
    open_islands(islands)
    first, last = -1, -1
    for i in range(len(islands.label)):
        if is_free(bodies, i):
            if last >= 0:
                islands.next_free[last] = i
            first, last = i if first < 0 else first, i
            islands.label[i] = first
    for i in range(len(islands.label)):
        if first >= 0 and not is_free(bodies, i):
            list_unmoved(islands, first, i)


@inner_kernel
def may_meet(islands: Islands, a: int, b: int) -> bool:
    """Whether two bodies can meet while their centres stay in their bounds: those are no farther apart than both reach.

    Bounding boxes of round bodies that lie askew to each other overlap long before. What is no number may meet all.
    """
    axes, apart, across = islands.limit.shape[1] // 2, 0.0, False
    for d in range(axes):
        low, high = islands.limit[a, d] - islands.limit[b, axes + d], islands.limit[b, d] - islands.limit[a, axes + d]
        apart += max(low, high, 0.0) ** 2
        across = across or islands.plane[a, d] != 0.0 or islands.plane[b, d] != 0.0
    if across:
        return not (least_height(islands, a, b) > islands.reach[b] or least_height(islands, b, a) > islands.reach[a])
    return not apart > (islands.reach[a] + islands.reach[b]) ** 2


@inner_kernel
def least_height(islands: Islands, f: int, s: int) -> float:
    """Least height of the centre of body s over half-space f while both stay in their bounds; 0 over all else [m]."""
    axes = islands.limit.shape[1] // 2
    height = -islands.plane[f, axes]
    for d in range(axes):
        n = islands.plane[f, d]
        low, high = islands.limit[s, d] - islands.limit[f, axes + d], islands.limit[s, axes + d] - islands.limit[f, d]
        height += n * (low if n > 0.0 else high)
    return height


@inner_kernel
def join_candidates(bodies: Bodies, islands: Islands, candidate: Indices, count: int) -> None:
    """Join the free bodies of the first ``count`` candidates that may meet; list what forces do not move."""
    met = 0
    open_islands(islands)
    for k in range(count):
        a, b = bodies_of(candidate[k])
        if may_meet(islands, a, b):
            candidate[met] = candidate[k]
            met += 1
            if is_free(bodies, a) and is_free(bodies, b):
                join(islands, a, b)
    count = met
    link_members(bodies, islands)
    for k in range(count):
        a, b = bodies_of(candidate[k])
        if not is_free(bodies, a):
            list_unmoved(islands, root(islands, b), a)
        elif not is_free(bodies, b):
            list_unmoved(islands, root(islands, a), b)
    join_lonely(bodies, islands)


@inner_kernel
def link_members(bodies: Bodies, islands: Islands) -> None:
    """Chain the free bodies of each island in ascending order."""
    for i in range(len(islands.label)):
        if is_free(bodies, i):
            label = root(islands, i)
            islands.next_free[i] = -1
            if label != i:
                islands.next_free[islands.last[label]] = i
            islands.last[label] = i


@inner_kernel
def leaves(limit: Array, i: int, d: int, place: float, way: float) -> bool:
    """Whether body i may leave its bounds along axis d on a ``way`` from a ``place``; if so they become wider [m]."""
    axes = limit.shape[1] // 2
    low, high = limit[i, d], limit[i, axes + d]
    if low <= place - way and place + way <= high:
        return False
    middle = 0.5 * (low + high)
    half = FARTHER * (abs(place - middle) + way)
    limit[i, d], limit[i, axes + d] = middle - half, middle + half
    return True


@inner_kernel
def widen(bodies: Bodies, islands: Islands, island: int, limit: Array) -> int:
    """Take over the bounds ``limit`` of an island that was gathered last, with whoever may be met in them.

    ``ALONE`` if that is nobody, so that its step goes on. ``MADE`` if it can be stepped again: whoever was joined has
    not made his step. ``JOINED`` if somebody has, and all have to; ``LEFT_BOUNDS`` where there is no room to list them.
    """
    outcome, count = ALONE, islands.size[MEMBERS]
    for k in range(count):
        i = islands.member[k]
        if not is_free(bodies, i):
            continue
        wider = False
        for d in range(limit.shape[1]):
            wider = wider or limit[k, d] != islands.limit[i, d]
            islands.limit[i, d] = limit[k, d]
        for j in range(len(islands.label) if wider else 0):
            if is_free(bodies, j):
                other = root(islands, j)
                if other != root(islands, island) and may_meet(islands, i, j):
                    outcome = JOINED if other < island or outcome == JOINED else MADE
                    join_lists(islands, root(islands, island), other)
            elif islands.mark[j] != island and may_meet(islands, i, j):
                if islands.size[NODES] == len(islands.unmoved):
                    return LEFT_BOUNDS
                islands.mark[j] = island
                list_unmoved(islands, root(islands, island), j)
                outcome = MADE if outcome == ALONE else outcome
    if outcome == ALONE:
        return outcome
    link_members(bodies, islands)
    for j in range(len(islands.label)):
        islands.mark[j] = -1  # all are listed again
    return outcome


@inner_kernel
def join_lists(islands: Islands, a: int, b: int) -> None:
    """Let two islands, of the lowest bodies a and b, be one."""
    join(islands, a, b)
    kept, other = min(a, b), max(a, b)
    entry = islands.first[other]
    if entry >= 0:
        while islands.following[entry] >= 0:
            entry = islands.following[entry]
        islands.following[entry] = islands.first[kept]
        islands.first[kept] = islands.first[other]


@inner_kernel
def join_lonely(bodies: Bodies, islands: Islands) -> None:
    """Let all bodies that can meet nobody be one island."""
    lowest, last = -1, -1
    for i in range(len(islands.label)):
        if is_free(bodies, i) and islands.label[i] == i and islands.next_free[i] < 0 and islands.first[i] < 0:
            if last < 0:
                lowest = i
            else:
                islands.label[i] = lowest
                islands.next_free[last] = i
            last = i
