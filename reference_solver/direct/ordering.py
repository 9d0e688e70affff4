"""Order of elimination: reverse Cuthill-McKee on the graph of touching bodies (E43).

Numbering bodies in the order of a breadth-first search from the rim of a pile keeps neighbours close together, and
the reverse of that order fills less. A column gets a matrix a few entries wide, however tall it is.
"""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.direct.problem import CONTACTS, NODES, VELOCITY_COUNT, Problem

#: Searches for a body on the rim: each starts where the one before ended. More than two rarely move it.
RIM_SEARCHES = 2


@inner_kernel
def order_bodies(problem: Problem) -> bool:
    """Number the free bodies that touch anything and lay out the triangles; False if these have no room."""
    body = problem.body
    link(problem)
    nodes = 0
    for i in range(len(body)):
        body.node[i], body.mark[i] = -1, -1
    for c in range(problem.size[CONTACTS]):
        for side in range(2):
            seed = problem.contact.body[c, side]
            if body.weight[seed, 0] > 0.0 and body.node[seed] < 0:
                for search in range(RIM_SEARCHES):
                    seed = visit(problem, seed, nodes, 2 * seed + search)[1]
                before, nodes = nodes, visit(problem, seed, nodes, -2)[0]
                for k in range(before, nodes):
                    body.node[body.queue[k]] = k
    for i in range(len(body)):
        if body.node[i] >= 0:
            body.node[i] = nodes - 1 - body.node[i]
            body.queue[body.node[i]] = i
    problem.size[NODES] = nodes
    return lay_out(problem)


@inner_kernel
def joins(problem: Problem, c: int) -> bool:
    """Whether contact c is the first one between two free bodies. Contacts of one pair are neighbours."""
    a, b = problem.contact.body[c, 0], problem.contact.body[c, 1]
    if problem.body.weight[a, 0] == 0.0 or problem.body.weight[b, 0] == 0.0:
        return False
    return c == 0 or problem.contact.body[c - 1, 0] != a or problem.contact.body[c - 1, 1] != b


@inner_kernel
def link(problem: Problem) -> None:
    """Neighbours of every body, grouped by body."""
    body, contact = problem.body, problem.contact
    for i in range(len(body)):
        body.degree[i] = 0
    for c in range(problem.size[CONTACTS]):
        if joins(problem, c):
            body.degree[contact.body[c, 0]] += 1
            body.degree[contact.body[c, 1]] += 1
    begin = 0
    for i in range(len(body)):
        body.begin[i] = begin
        begin += body.degree[i]
        body.degree[i] = 0
    for c in range(problem.size[CONTACTS]):
        if joins(problem, c):
            for side in range(2):
                i, other = contact.body[c, side], contact.body[c, 1 - side]
                problem.neighbour[body.begin[i] + body.degree[i]] = other
                body.degree[i] += 1


@inner_kernel
def visit(problem: Problem, seed: int, first: int, mark: int) -> tuple[int, int]:
    """Breadth-first search from `seed`, neighbours by ascending degree, into the queue from entry `first` on.

    `mark` tells this search from earlier ones. Returns the end of the queue and the last body reached.
    """
    body = problem.body
    body.queue[first], body.mark[seed] = seed, mark
    end, k = first + 1, first
    while k < end:
        i, new = body.queue[k], end
        for n in range(body.begin[i], body.begin[i] + body.degree[i]):
            other = problem.neighbour[n]
            if body.mark[other] == mark:
                continue
            body.mark[other] = mark
            place = end
            while place > new and body.degree[body.queue[place - 1]] > body.degree[other]:
                body.queue[place] = body.queue[place - 1]
                place -= 1
            body.queue[place] = other
            end += 1
        k += 1
    return end, body.queue[end - 1]


@inner_kernel
def lay_out(problem: Problem) -> bool:
    """First entry and start of every row of the lower triangle; False if there is no room for all of them."""
    body, width = problem.body, problem.size[VELOCITY_COUNT]
    problem.start[0] = 0
    for node in range(problem.size[NODES]):
        i, least = body.queue[node], node
        for n in range(body.begin[i], body.begin[i] + body.degree[i]):
            least = min(least, body.node[problem.neighbour[n]])
        for k in range(node * width, (node + 1) * width):
            problem.first[k] = least * width
            problem.start[k + 1] = problem.start[k] + k - least * width
    return problem.start[problem.size[NODES] * width] <= len(problem.lower)
