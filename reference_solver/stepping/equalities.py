"""Contact forces while modes are held: rows as equalities, also where some of them say the same (E37).

    (G M^-1 F) lambda = -(G M^-1 f + gamma)

G: normals of pressed contacts, tangents of those that stick. F: G^T, but for a slip `J_n^T - mu J_t^T d`.
"""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.stepping.islands import first_of
from reference_solver.stepping.lasting import (
    BODIES,
    CONTACTS,
    OPEN,
    SLIP,
    STICK,
    TANGENTS,
    VELOCITIES,
    Indices,
    Lasting,
)

#: What the rows of a phase are: independent; redundant, with forces that are not unique; contradictory.
INDEPENDENT, REDUNDANT, CONTRADICTORY = 0, 1, 2
#: A pivot below this share of its scaled row is round-off.
RANK = 1e-10
#: The same for its product with the smallest pivot before it, which round-off has been divided by: contacts that are
#: about to meet have a small one, and what is left of a row that says the same as others is then not small itself.
GROWN = 1e-13
#: The same for the square of the matrix.
RANK_SQUARED = 1e-13
#: Corrections of a solution of redundant rows; each gains the digits that squaring the matrix cost.
CORRECTIONS = 4
#: Redundant rows that miss each other by more than this share of their accelerations contradict each other.
CONSISTENT = 1e-8
#: Smallest weight of a force that redundant rows may carry, as a share of the largest.
LIGHT = 1e-6


@inner_kernel
def list_rows(lasting: Lasting) -> int:
    """Number the equalities; -1 if there is no room for them."""
    count = 0
    for k in range(lasting.size[CONTACTS]):
        if lasting.mode[k] == OPEN:
            continue
        held = held_rows(lasting, k)
        if count + held > len(lasting.right):
            return -1
        for row in range(held):
            lasting.unknown[count, 0], lasting.unknown[count, 1] = k, row
            count += 1
    return count


@inner_kernel
def held_rows(lasting: Lasting, k: int) -> int:
    """Equalities of a contact that is not open: of its normal, and of its tangents where it sticks."""
    return 1 + (lasting.size[TANGENTS] if lasting.mode[k] == STICK else 0)


@inner_kernel
def effect(lasting: Lasting, sliding: bool, k: int, side: int, row: int, d: int) -> float:
    """Change of velocity d of a body by a unit of force `row` of contact k, with the friction of its slip."""
    change = lasting.response[k, side, row, d]
    if sliding and row == 0 and lasting.mode[k] == SLIP:
        for t in range(lasting.size[TANGENTS]):
            change -= lasting.friction[k] * lasting.direction[k, t] * lasting.response[k, side, 1 + t, d]
    return change


@inner_kernel
def assemble(lasting: Lasting, first: int, last: int, sliding: bool) -> None:
    """Fill the matrix of the equalities from ``first`` to before ``last``; ``sliding``: with the friction of slips.

    Most contacts share no body: whether two do is asked before anything is multiplied.
    """
    for j in range(first, last):
        kj, rj = lasting.unknown[j, 0], lasting.unknown[j, 1]
        for i in range(first, last):
            lasting.matrix[i, j] = 0.0
        for side in range(2):
            body = lasting.body[kj, side]
            moves = False
            for d in range(lasting.size[VELOCITIES]):
                lasting.change[d] = effect(lasting, sliding, kj, side, rj, d)
                moves = moves or lasting.change[d] != 0.0
            if not moves:
                continue
            for i in range(first, last):
                ki = lasting.unknown[i, 0]
                if lasting.body[ki, 0] == body or lasting.body[ki, 1] == body:
                    ri = lasting.unknown[i, 1]
                    lasting.matrix[i, j] = row_change(lasting, ki, ri, body, lasting.matrix[i, j])


@inner_kernel
def row_change(lasting: Lasting, k: int, row: int, body: int, before: float) -> float:
    """What row of contact k says to the `change` of a body's velocities, added to ``before``."""
    total = before
    side = 0 if lasting.body[k, 0] == body else 1
    if lasting.body[k, side] == body:
        for d in range(lasting.size[VELOCITIES]):
            total += lasting.jacobian[k, side, row, d] * lasting.change[d]
    return total


@inner_kernel
def row_scale(lasting: Lasting, i: int) -> float:
    """Inverse effective mass of equality i, that of the plain row [1/kg]."""
    k, row = lasting.unknown[i, 0], lasting.unknown[i, 1]
    mass = 0.0
    for side in range(2):
        for d in range(lasting.size[VELOCITIES]):
            mass += lasting.jacobian[k, side, row, d] * lasting.response[k, side, row, d]
    return mass


@inner_kernel
def list_entries(matrix: Array, i: int, first: int, last: int, filled: Indices) -> int:
    """List the columns from ``first`` to before ``last`` in which row i is not zero, in order; how many there are."""
    entries = 0
    for c in range(first, last):
        if matrix[i, c] != 0.0:
            filled[entries] = c
            entries += 1
    return entries


@inner_kernel
def factorise(lasting: Lasting, first: int, last: int) -> bool:
    """Factors L U of the equalities from ``first`` to before ``last``, with row interchanges noted in `order`.

    False where a pivot is round-off. Pivots are compared as entries over the roots of both rows' scales, squared: no
    root is taken, so that units of powers of two change no bit.
    """
    factor, order, scale, filled = lasting.factor, lasting.order, lasting.spare, lasting.filled
    for i in range(first, last):
        scale[i] = lasting.other[i] = row_scale(lasting, i)
        if scale[i] == 0.0:
            return False
        for j in range(first, last):
            factor[i, j] = lasting.matrix[i, j]
        order[i] = i
    least = 1.0
    for j in range(first, last):
        best = j
        for i in range(j + 1, last):
            if factor[i, j] ** 2 * scale[best] > factor[best, j] ** 2 * scale[i]:
                best = i
        pivot = factor[best, j] ** 2 / (scale[best] * lasting.other[j])
        if not (pivot > RANK**2 and pivot * least > GROWN**2):
            return False
        least = min(least, pivot)
        if best != j:
            for c in range(first, last):
                factor[j, c], factor[best, c] = factor[best, c], factor[j, c]
            order[j], order[best] = order[best], order[j]
            scale[j], scale[best] = scale[best], scale[j]
        entries = list_entries(factor, j, j + 1, last, filled)
        for i in range(j + 1, last):
            if factor[i, j] != 0.0:
                share = factor[i, j] = factor[i, j] / factor[j, j]
                for e in range(entries):
                    factor[i, filled[e]] -= share * factor[j, filled[e]]
    return True


@inner_kernel
def substitute(lasting: Lasting, first: int, last: int) -> None:
    """Solve for `answer` by the factors L U."""
    factor, x = lasting.factor, lasting.answer
    for i in range(first, last):
        left = lasting.right[lasting.order[i]]
        for c in range(first, i):
            left -= factor[i, c] * x[c]
        x[i] = left
    for j in range(last - 1, first - 1, -1):
        left = x[j]
        for c in range(j + 1, last):
            left -= factor[j, c] * x[c]
        x[j] = left / factor[j, j]


@inner_kernel
def force_weight(lasting: Lasting, i: int) -> float:
    """Weight of unknown i, squared, where forces are not unique: changes go by what they carry."""
    k, row = lasting.unknown[i, 0], lasting.unknown[i, 1]
    return abs(lasting.usual[k, 0]) * (lasting.friction[k] if row > 0 else 1.0)


@inner_kernel
def square(lasting: Lasting, first: int, last: int) -> int:
    """Factors of A W A^T for the matrix A of redundant rows, W weights of forces, squared; up to which row they go."""
    largest = 0.0
    for j in range(first, last):
        largest = max(largest, force_weight(lasting, j) * row_scale(lasting, j))
    for j in range(first, last):
        scale = row_scale(lasting, j)
        weight = max(force_weight(lasting, j) * scale, LIGHT**2 * largest) if largest > 0.0 else 1.0
        lasting.weight[j] = weight / scale
        lasting.order[j] = j
    for i in range(first, last):
        square_row(lasting, first, i, list_entries(lasting.matrix, i, first, last, lasting.filled))
    return int(decompose(lasting, first, last))


@inner_kernel
def least_change(lasting: Lasting, first: int, last: int, rank: int, told: float) -> int:
    """Solve redundant rows for the `answer` nearest to ``told`` times the usual forces; how well they agree.

    The change is W A^T y of the solution of A W A^T y = r, by the factors that `square` left: Cholesky's method without
    roots, with interchanges, which ended where pivots were round-off, and corrections of what squaring cost.
    """
    x, y = lasting.answer, lasting.spare
    for j in range(first, last):
        x[j] = told * lasting.usual[lasting.unknown[j, 0], lasting.unknown[j, 1]]
    miss = 0.0
    for _ in range(CORRECTIONS):
        for i in range(first, last):
            left = lasting.right[i]
            for c in range(first, last):
                left -= lasting.matrix[i, c] * x[c]
            y[i] = left
        miss = 0.0
        for i in range(first, last):
            size = abs(lasting.right[i]) + lasting.scale[lasting.unknown[i, 0]]
            miss = max(miss, abs(y[i]) / size if size > 0.0 else 0.0)
        substitute_square(lasting, first, last, rank)
        change = lasting.other
        for c in range(first, last):
            change[c] = 0.0
        for i in range(first, last):
            for c in range(first, last):
                change[c] += lasting.matrix[i, c] * y[i]
        for c in range(first, last):
            x[c] += lasting.weight[c] * change[c]
    return REDUNDANT if miss <= CONSISTENT else CONTRADICTORY


@inner_kernel
def square_row(lasting: Lasting, first: int, i: int, entries: int) -> None:
    """Row i of A W A^T from ``first`` up to its diagonal, into `factor`; ``entries`` of A's row are listed.

    Four sums at a time: a processor does not wait for one to be added before it begins the next.
    """
    matrix, factor, weighed, filled = lasting.matrix, lasting.factor, lasting.other, lasting.filled
    for e in range(entries):
        weighed[e] = matrix[i, filled[e]] * lasting.weight[filled[e]]
    for at_once in range(first, i + 1, 4):
        j, k, m = min(at_once + 1, i), min(at_once + 2, i), min(at_once + 3, i)
        a, b, c, d = 0.0, 0.0, 0.0, 0.0
        for e in range(entries):
            at = filled[e]
            a += weighed[e] * matrix[at_once, at]
            b += weighed[e] * matrix[j, at]
            c += weighed[e] * matrix[k, at]
            d += weighed[e] * matrix[m, at]
        factor[i, at_once], factor[i, j], factor[i, k], factor[i, m] = a, b, c, d


@inner_kernel
def decompose(lasting: Lasting, first: int, last: int) -> int:
    """Factors L D L^T of the lower half of `factor`, in place; up to which row they go: others are redundant.

    Interchanges are noted in `order`.
    """
    factor, column = lasting.factor, lasting.other
    most = 0.0
    for j in range(first, last):
        best = j
        for i in range(j, last):
            if factor[i, i] > factor[best, best]:
                best = i
        pivot = factor[best, best]
        if j == first:
            most = pivot
        if not pivot > RANK_SQUARED * most:
            return j
        if best != j:
            interchange(lasting, first, last, j, best)
        for i in range(j + 1, last):
            factor[i, j] /= pivot
            column[i] = factor[i, j]
        for i in range(j + 1, last):
            if column[i] != 0.0:
                share = column[i] * pivot
                for c in range(j + 1, i + 1):
                    factor[i, c] -= share * column[c]
    return last


@inner_kernel
def interchange(lasting: Lasting, first: int, last: int, j: int, best: int) -> None:
    """Put row and column ``best`` of a symmetric matrix, whose lower half `factor` has, before those from j on."""
    factor, order = lasting.factor, lasting.order
    order[j], order[best] = order[best], order[j]
    factor[j, j], factor[best, best] = factor[best, best], factor[j, j]
    for c in range(first, j):
        factor[j, c], factor[best, c] = factor[best, c], factor[j, c]
    for c in range(j + 1, best):
        factor[c, j], factor[best, c] = factor[best, c], factor[c, j]
    for c in range(best + 1, last):
        factor[c, j], factor[c, best] = factor[c, best], factor[c, j]


@inner_kernel
def substitute_square(lasting: Lasting, first: int, last: int, rank: int) -> None:
    """Solution of the decomposed system for the right side `spare`, in place; zero from row ``rank`` on."""
    factor, y, order, z = lasting.factor, lasting.spare, lasting.order, lasting.other
    for i in range(first, rank):
        left = y[order[i]]
        for c in range(first, i):
            left -= factor[i, c] * z[c]
        z[i] = left
    for i in range(rank - 1, first - 1, -1):
        left = z[i] / factor[i, i]
        for c in range(i + 1, rank):
            left -= factor[c, i] * z[c]
        z[i] = left
    for i in range(first, last):
        y[i] = 0.0
    for i in range(first, rank):
        y[order[i]] = z[i]


@inner_kernel
def solve_rows(lasting: Lasting, count: int, sliding: bool, told: float, again: bool) -> int:
    """Solve the equalities, near ``told`` times the usual forces where there is a choice; what rows are.

    Clusters of contacts that share no body that moves are solved one after the other, and `unknown` and `right` are
    put into that order: their cost goes with the cube of a cluster, and what is redundant in one is so there alone.
    ``again``: where no slip has turned since, forces are what they are.
    """
    join_bodies(lasting)
    found, last = INDEPENDENT, 0
    while last < count:
        first, last = last, gather_cluster(lasting, last, count)
        if again and not turned(lasting, first, last):
            for i in range(first, last):
                lasting.answer[i] = lasting.force[lasting.unknown[i, 0], lasting.unknown[i, 1]]
            continue
        assemble(lasting, first, last, sliding)
        found = max(found, solve_for(lasting, first, last, factors_of(lasting, first, last), told))
    return found


@inner_kernel
def turned(lasting: Lasting, first: int, last: int) -> bool:
    """Whether friction of any of these equalities' contacts goes another way than when forces were found."""
    for i in range(first, last):
        if lasting.turned[lasting.unknown[i, 0]] == 1:
            return True
    return False


@inner_kernel
def factors_of(lasting: Lasting, first: int, last: int) -> int:
    """Factors of the assembled matrix, for any number of right sides; the rank where its square has them, -1 else."""
    return -1 if factorise(lasting, first, last) else square(lasting, first, last)


@inner_kernel
def solve_for(lasting: Lasting, first: int, last: int, rank: int, told: float) -> int:
    """Solve for one right side by `factors_of`; what rows are."""
    if rank >= 0:
        return int(least_change(lasting, first, last, rank, told))
    substitute(lasting, first, last)
    return INDEPENDENT


@inner_kernel
def moves(lasting: Lasting, k: int, side: int) -> bool:
    """Whether forces move a body of contact k; one of both they do."""
    for d in range(lasting.size[VELOCITIES]):
        if lasting.response[k, side, 0, d] != 0.0:
            return True
    return False


@inner_kernel
def cluster_of(lasting: Lasting, k: int) -> int:
    """Label of the cluster that contact k belongs to."""
    return int(first_of(lasting.label, lasting.body[k, 0 if moves(lasting, k, 0) else 1]))


@inner_kernel
def join_bodies(lasting: Lasting) -> None:
    """Label bodies that contacts hold together alike."""
    label = lasting.label
    for i in range(lasting.size[BODIES]):
        label[i] = i
    for k in range(lasting.size[CONTACTS]):
        if lasting.mode[k] != OPEN and moves(lasting, k, 0) and moves(lasting, k, 1):
            a, b = first_of(label, lasting.body[k, 0]), first_of(label, lasting.body[k, 1])
            label[max(a, b)] = min(a, b)


@inner_kernel
def gather_cluster(lasting: Lasting, first: int, count: int) -> int:
    """Put equalities of the cluster of number ``first`` before those of others, in their order; where it ends."""
    unknown, right, last = lasting.unknown, lasting.right, first
    cluster = cluster_of(lasting, unknown[first, 0])
    for i in range(first, count):
        k, row, value = unknown[i, 0], unknown[i, 1], right[i]
        if cluster_of(lasting, k) != cluster:
            continue
        for j in range(i, last, -1):
            unknown[j, 0], unknown[j, 1], right[j] = unknown[j - 1, 0], unknown[j - 1, 1], right[j - 1]
        unknown[last, 0], unknown[last, 1], right[last] = k, row, value
        last += 1
    return last


@inner_kernel
def row_value(lasting: Lasting, k: int, row: int, vectors: Array) -> float:
    """Row of contact k times vectors (n, V) of its bodies."""
    total = 0.0
    for d in range(lasting.size[VELOCITIES]):
        a, b = lasting.body[k, 0], lasting.body[k, 1]
        total += lasting.jacobian[k, 0, row, d] * vectors[a, d] + lasting.jacobian[k, 1, row, d] * vectors[b, d]
    return total


@inner_kernel
def force_contacts(lasting: Lasting, again: bool) -> int:
    """Forces and accelerations that hold all modes at the evaluated state; what the rows are.

    ``again``: only slips that are noted as `Lasting.turned` differ from what the forces were found for.
    """
    count = list_rows(lasting)
    if count < 0:
        return CONTRADICTORY
    found = INDEPENDENT
    if count > 0:
        for i in range(count):
            k, row = lasting.unknown[i, 0], lasting.unknown[i, 1]
            lasting.right[i] = -(row_value(lasting, k, row, lasting.free) + lasting.gamma[k, row])
        found = solve_rows(lasting, count, True, 1.0, again)
    for k in range(lasting.size[CONTACTS]):
        for row in range(1 + lasting.size[TANGENTS]):
            lasting.force[k, row] = 0.0
    for i in range(count):
        lasting.force[lasting.unknown[i, 0], lasting.unknown[i, 1]] = lasting.answer[i]
    for k in range(lasting.size[CONTACTS]):
        if lasting.mode[k] == SLIP:
            for t in range(lasting.size[TANGENTS]):
                lasting.force[k, 1 + t] = -lasting.friction[k] * lasting.force[k, 0] * lasting.direction[k, t]
    accelerate(lasting)
    return found


@inner_kernel
def accelerate(lasting: Lasting) -> None:
    """Accelerations of all bodies by loads and contact forces."""
    for i in range(lasting.size[BODIES]):
        for d in range(lasting.size[VELOCITIES]):
            lasting.acceleration[i, d] = lasting.free[i, d]
    for k in range(lasting.size[CONTACTS]):
        for row in range(1 + lasting.size[TANGENTS]):
            push(lasting, lasting.acceleration, k, row, lasting.force[k, row])


@inner_kernel
def push(lasting: Lasting, vectors: Array, k: int, row: int, size: float) -> None:
    """Add what a force or impulse of ``size`` along a row of contact k does to its bodies."""
    if size != 0.0:
        for side in range(2):
            for d in range(lasting.size[VELOCITIES]):
                vectors[lasting.body[k, side], d] += size * lasting.response[k, side, row, d]
