"""Contact forces while modes are held: rows as equalities, also where some of them say the same (E37).

    (G M^-1 F) lambda = -(G M^-1 f + gamma)

G: normals of pressed contacts, tangents of those that stick. F: G^T, but for a slip `J_n^T - mu J_t^T d`.
"""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.model import Array
from reference_solver.stepping.lasting import BODIES, CONTACTS, OPEN, SLIP, STICK, TANGENTS, VELOCITIES, Lasting

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
        held = 1 + (lasting.size[TANGENTS] if lasting.mode[k] == STICK else 0)
        if count + held > len(lasting.right):
            return -1
        for row in range(held):
            lasting.unknown[count, 0], lasting.unknown[count, 1] = k, row
            count += 1
    return count


@inner_kernel
def effect(lasting: Lasting, sliding: bool, k: int, side: int, row: int, d: int) -> float:
    """Change of velocity d of a body by a unit of force `row` of contact k, with the friction of its slip."""
    change = lasting.response[k, side, row, d]
    if sliding and row == 0 and lasting.mode[k] == SLIP:
        for t in range(lasting.size[TANGENTS]):
            change -= lasting.friction[k] * lasting.direction[k, t] * lasting.response[k, side, 1 + t, d]
    return change


@inner_kernel
def assemble(lasting: Lasting, count: int, sliding: bool) -> None:
    """Fill the matrix of the equalities; ``sliding``: with the friction of slips."""
    for j in range(count):
        kj, rj = lasting.unknown[j, 0], lasting.unknown[j, 1]
        for i in range(count):
            lasting.matrix[i, j] = 0.0
        for side in range(2):
            body = lasting.body[kj, side]
            for d in range(lasting.size[VELOCITIES]):
                change = effect(lasting, sliding, kj, side, rj, d)
                if change == 0.0:
                    continue
                for i in range(count):
                    ki, ri = lasting.unknown[i, 0], lasting.unknown[i, 1]
                    if lasting.body[ki, 0] == body:
                        lasting.matrix[i, j] += lasting.jacobian[ki, 0, ri, d] * change
                    if lasting.body[ki, 1] == body:
                        lasting.matrix[i, j] += lasting.jacobian[ki, 1, ri, d] * change


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
def eliminate(lasting: Lasting, count: int) -> bool:
    """Solve for `answer` by elimination with row interchanges; False where a pivot is round-off.

    Pivots are compared as entries over the roots of both rows' scales, squared: no root is taken, so that units of
    powers of two change no bit.
    """
    factor, x, scale = lasting.factor, lasting.answer, lasting.spare
    for i in range(count):
        scale[i] = lasting.other[i] = row_scale(lasting, i)
        if scale[i] == 0.0:
            return False
        for j in range(count):
            factor[i, j] = lasting.matrix[i, j]
        x[i] = lasting.right[i]
    least = 1.0
    for j in range(count):
        best = j
        for i in range(j + 1, count):
            if factor[i, j] ** 2 * scale[best] > factor[best, j] ** 2 * scale[i]:
                best = i
        pivot = factor[best, j] ** 2 / (scale[best] * lasting.other[j])
        if not (pivot > RANK**2 and pivot * least > GROWN**2):
            return False
        least = min(least, pivot)
        if best != j:
            for c in range(count):
                factor[j, c], factor[best, c] = factor[best, c], factor[j, c]
            x[j], x[best] = x[best], x[j]
            scale[j], scale[best] = scale[best], scale[j]
        for i in range(j + 1, count):
            share = factor[i, j] / factor[j, j]
            if share != 0.0:
                for c in range(j + 1, count):
                    factor[i, c] -= share * factor[j, c]
                x[i] -= share * x[j]
    for j in range(count - 1, -1, -1):
        for c in range(j + 1, count):
            x[j] -= factor[j, c] * x[c]
        x[j] /= factor[j, j]
    return True


@inner_kernel
def force_weight(lasting: Lasting, i: int) -> float:
    """Weight of unknown i, squared, where forces are not unique: changes go by what they carry."""
    k, row = lasting.unknown[i, 0], lasting.unknown[i, 1]
    return abs(lasting.usual[k, 0]) * (lasting.friction[k] if row > 0 else 1.0)


@inner_kernel
def least_change(lasting: Lasting, count: int, told: float) -> int:
    """Solve redundant rows for the `answer` nearest to ``told`` times the usual forces; how well they agree.

    With the matrix A and the weights W, squared, the change is W A^T y of the solution of A W A^T y = r: Cholesky's
    method without roots, with interchanges, which ends where pivots are round-off, and corrections of what squaring
    cost.
    """
    factor, x, y, order = lasting.factor, lasting.answer, lasting.spare, lasting.order
    largest = 0.0
    for j in range(count):
        largest = max(largest, force_weight(lasting, j) * row_scale(lasting, j))
    for j in range(count):
        scale = row_scale(lasting, j)
        weight = max(force_weight(lasting, j) * scale, LIGHT**2 * largest) if largest > 0.0 else 1.0
        lasting.weight[j] = weight / scale
        x[j] = told * lasting.usual[lasting.unknown[j, 0], lasting.unknown[j, 1]]
        order[j] = j
    for i in range(count):
        for j in range(i + 1):
            total = 0.0
            for c in range(count):
                total += lasting.matrix[i, c] * lasting.weight[c] * lasting.matrix[j, c]
            factor[i, j] = factor[j, i] = total
    rank = decompose(lasting, count)
    miss = 0.0
    for _ in range(CORRECTIONS):
        for i in range(count):
            y[i] = lasting.right[i]
            for c in range(count):
                y[i] -= lasting.matrix[i, c] * x[c]
        miss = 0.0
        for i in range(count):
            size = abs(lasting.right[i]) + lasting.scale[lasting.unknown[i, 0]]
            miss = max(miss, abs(y[i]) / size if size > 0.0 else 0.0)
        substitute(lasting, count, rank)
        for c in range(count):
            change = 0.0
            for i in range(count):
                change += lasting.matrix[i, c] * y[i]
            x[c] += lasting.weight[c] * change
    return REDUNDANT if miss <= CONSISTENT else CONTRADICTORY


@inner_kernel
def decompose(lasting: Lasting, count: int) -> int:
    """Factors L D L^T of `factor` with interchanges noted in `order`, in place; its rank."""
    factor, order = lasting.factor, lasting.order
    first = 0.0
    for j in range(count):
        best = j
        for i in range(j, count):
            if factor[i, i] > factor[best, best]:
                best = i
        pivot = factor[best, best]
        if j == 0:
            first = pivot
        if not pivot > RANK_SQUARED * first:
            return j
        if best != j:
            order[j], order[best] = order[best], order[j]
            for c in range(count):
                factor[j, c], factor[best, c] = factor[best, c], factor[j, c]
            for c in range(count):
                factor[c, j], factor[c, best] = factor[c, best], factor[c, j]
        for i in range(j + 1, count):
            factor[i, j] /= pivot
        for i in range(j + 1, count):
            for c in range(j + 1, i + 1):
                factor[i, c] -= factor[i, j] * pivot * factor[c, j]
                factor[c, i] = factor[i, c]
    return count


@inner_kernel
def substitute(lasting: Lasting, count: int, rank: int) -> None:
    """Solution of the decomposed system for the right side `spare`, in place; zero for what is redundant."""
    factor, y, order, z = lasting.factor, lasting.spare, lasting.order, lasting.other
    for i in range(rank):
        z[i] = y[order[i]]
        for c in range(i):
            z[i] -= factor[i, c] * z[c]
    for i in range(rank - 1, -1, -1):
        z[i] /= factor[i, i]
        for c in range(i + 1, rank):
            z[i] -= factor[c, i] * z[c]
    for i in range(count):
        y[i] = 0.0
    for i in range(rank):
        y[order[i]] = z[i]


@inner_kernel
def solve_rows(lasting: Lasting, count: int, told: float) -> int:
    """Solve matrix answer = right, near ``told`` times the usual forces where there is a choice; what rows are."""
    if eliminate(lasting, count):
        return INDEPENDENT
    return least_change(lasting, count, told)


@inner_kernel
def row_value(lasting: Lasting, k: int, row: int, vectors: Array) -> float:
    """Row of contact k times vectors (n, V) of its bodies."""
    total = 0.0
    for d in range(lasting.size[VELOCITIES]):
        a, b = lasting.body[k, 0], lasting.body[k, 1]
        total += lasting.jacobian[k, 0, row, d] * vectors[a, d] + lasting.jacobian[k, 1, row, d] * vectors[b, d]
    return total


@inner_kernel
def force_contacts(lasting: Lasting) -> int:
    """Forces and accelerations that hold all modes at the evaluated state; what the rows are."""
    count = list_rows(lasting)
    if count < 0:
        return CONTRADICTORY
    found = INDEPENDENT
    if count > 0:
        assemble(lasting, count, True)
        for i in range(count):
            k, row = lasting.unknown[i, 0], lasting.unknown[i, 1]
            lasting.right[i] = -(row_value(lasting, k, row, lasting.free) + lasting.gamma[k, row])
        found = solve_rows(lasting, count, 1.0)
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
