"""Islands: bodies that can meet each other within a step, each stepped by itself (E29).

Free bodies whose places within the step may overlap are joined; bodies that forces do not move join nobody, and belong
to every island that may touch them. Places are bounds that hold unless an impact makes a body faster: a body that
leaves its own ends the attempt, and the step is made again with wider ones, in the end as one island. Bodies that can
meet nobody make their step together, which costs less: with nothing to solve or to meet none knows of another.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.stepping.operations import Bodies, is_free
from reference_solver.structures import structure

Indices = NDArray[np.int64]

#: Entries of `Islands.size`: entries of the lists of bodies that forces do not move, bodies of the island gathered.
NODES, MEMBERS = 0, 1
SIZES = 2
#: By how much farther than loads and speeds alone take it a body may get, one attempt after the other. An elastic
#: impact with a heavy body doubles its speed and adds twice that of the other; the last attempt has no bounds.
ROOM = (1.0, 8.0)

#: What became of an attempt: all islands made their step; one left its bounds; an array was too small.
MADE, LEFT_BOUNDS, NO_ROOM = 0, 1, 2


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
    """Join the free bodies of the first ``count`` candidates, a n + b, that may meet; list what forces do not move."""
    n, met = len(islands.label), 0
    open_islands(islands)
    for k in range(count):
        a, b = candidate[k] // n, candidate[k] % n
        if may_meet(islands, a, b):
            candidate[met] = candidate[k]
            met += 1
            if is_free(bodies, a) and is_free(bodies, b):
                join(islands, a, b)
    count = met
    for i in range(n):
        if is_free(bodies, i):
            label = root(islands, i)
            if label != i:
                islands.next_free[islands.last[label]] = i
            islands.last[label] = i
    for k in range(count):
        a, b = candidate[k] // n, candidate[k] % n
        if not is_free(bodies, a):
            list_unmoved(islands, root(islands, b), a)
        elif not is_free(bodies, b):
            list_unmoved(islands, root(islands, a), b)
    join_lonely(bodies, islands)


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
