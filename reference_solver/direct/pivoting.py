"""Complementary pivoting: an answer to a planar problem that Newton's rounds do not find (E45)."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.direct.problem import CONTACTS, VELOCITY_COUNT, Problem

#: Pivots per row of the table before a search is given up: what ends takes one or two.
PIVOTS = 20
#: An entry below this share of the largest of its column is round-off, and no pivot.
NO_PIVOT = 1e-12
#: Covering vectors that are tried: one of ones, then some whose entries lie between one and two, rows apart by the
#: golden section, whose multiples modulo one are nowhere near each other. On redundant contacts round-off may end one
#: search early, and not the next.
COVERINGS, GOLDEN = 4, 0.6180339887498949

#: Rows of a contact in the table: its normal, its tangent and that turned round, its slip.
NORMAL, ALONG, BACK, SLIP, LINES = 0, 1, 2, 3, 4


@inner_kernel
def find_by_pivots(problem: Problem, attempt: int) -> bool:
    """Set ``change`` of all contacts to impulses that solve a problem, which has none now; False if it has no room.

    With p_t = a - b of a contact, and l its slip where it slides, w = q + M z >= 0, z >= 0, z w = 0 for

        z = (p_n, a, b, l),   w = (u_n - b_n, u_t + l, l - u_t, mu p_n - a - b)

    [Stewart & Trinkle, Int. J. Numer. Meth. Eng. 39, 1996], by the pivots of C. E. Lemke, Manage. Sci. 11, 1965:
    with targets that impulses can meet they end at a solution, whatever mu [Anitescu & Potra, Nonlinear Dyn. 14, 1997].
    Where round-off ends them before that, what is found is no solution: the caller measures it.
    """
    contact, count = problem.contact, problem.size[CONTACTS]
    if LINES * count > len(problem.table):
        return False
    write_table(problem, attempt)
    pivot(problem)
    for c in range(count):
        contact.change[c, 0] = contact.change[c, 1] = 0.0
    rows = LINES * count
    for i in range(rows):
        variable = problem.basic[i] - rows
        if 0 <= variable < rows:
            c, line = variable // LINES, variable % LINES
            found = unit(problem, c, line) * max(problem.table[i, rows + 1], 0.0)
            if line == NORMAL:
                contact.change[c, 0] = found
            elif line != SLIP:
                contact.change[c, 1] += found if line == ALONG else -found
    return True


@inner_kernel
def unit(problem: Problem, c: int, line: int) -> float:
    """Of a variable: with k_n and k_t of the contact the entry of M on its own row is 1."""
    admittance = problem.contact.admittance[c, 0 if line == NORMAL else 1]
    if admittance <= 0.0:
        return 0.0
    return float(admittance**0.5 if line == SLIP else admittance**-0.5)


@inner_kernel
def write_table(problem: Problem, attempt: int) -> None:
    """Rows w - M z - d z0 = q, four of each contact; columns are z, the covering variable z0, and q."""
    contact, table, rows = problem.contact, problem.table, LINES * problem.size[CONTACTS]
    for i in range(rows):
        c, line = i // LINES, i % LINES
        own = unit(problem, c, line)
        for j in range(rows):
            table[i, j] = 0.0
            if line != SLIP and j % LINES != SLIP:
                row, column = 0 if line == NORMAL else 1, 0 if j % LINES == NORMAL else 1
                entry = coupling(problem, c, row, j // LINES, column) * own * unit(problem, j // LINES, j % LINES)
                table[i, j] = entry if (line == BACK) != (j % LINES == BACK) else -entry
        if line == NORMAL:
            table[i, rows + 1] = own * contact.excess[c, 0]
        elif line == SLIP:
            first = LINES * c
            table[i, first] = -contact.friction[c] * own * unit(problem, c, NORMAL)
            for side in range(ALONG, SLIP):
                table[i, first + side] = own * unit(problem, c, side)
                table[first + side, i] = -table[i, first + side]
            table[i, rows + 1] = 0.0
        else:
            table[i, rows + 1] = own * contact.excess[c, 1] if line == ALONG else -own * contact.excess[c, 1]
        spread = (i * GOLDEN + attempt / COVERINGS) % 1.0 if attempt > 0 else 0.0
        table[i, rows] = -1.0 - spread


@inner_kernel
def coupling(problem: Problem, c: int, r: int, k: int, q: int) -> float:
    """Velocity in row r of contact c for each impulse in row q of contact k [1/kg]."""
    contact, entry = problem.contact, 0.0
    for side in range(2):
        for other in range(2):
            if contact.body[c, side] == contact.body[k, other]:
                for v in range(problem.size[VELOCITY_COUNT]):
                    entry += contact.jacobian[c, side, r, v] * contact.response[k, other, q, v]
    return entry


@inner_kernel
def pivot(problem: Problem) -> None:
    """Lemke's pivots in place, until the covering variable has left the basis or none is left to make."""
    table, basic, free = problem.table, problem.basic, problem.free
    rows = LINES * problem.size[CONTACTS]
    # Variables by number: w 0 .. rows - 1, z rows .. 2 rows - 1, then z0.
    leaves, worst, enters = -1, 0.0, rows
    for i in range(rows):
        basic[i], free[i] = i, rows + i
        share = table[i, rows + 1] / -table[i, rows]
        if share < worst:
            leaves, worst = i, share
    free[rows] = 2 * rows
    for _ in range(PIVOTS * rows):
        if leaves < 0:
            break
        exchange(problem, rows, leaves, enters)
        gone = basic[leaves]
        basic[leaves], free[enters] = free[enters], gone
        if gone == 2 * rows:
            break
        partner = gone + rows if gone < rows else gone - rows
        for j in range(rows + 1):
            if free[j] == partner:
                enters = j
        leaves = first_to_leave(problem, rows, enters)


@inner_kernel
def exchange(problem: Problem, rows: int, row: int, column: int) -> None:
    """Make the variable of ``column`` basic, and that of ``row`` free: a Jordan exchange."""
    table = problem.table
    inverse = 1.0 / table[row, column]
    table[row, column] = 1.0
    for j in range(rows + 2):
        table[row, j] *= inverse
    for i in range(rows):
        factor = table[i, column]
        if i != row and factor != 0.0:
            table[i, column] = 0.0
            for j in range(rows + 2):
                table[i, j] -= factor * table[row, j]


@inner_kernel
def first_to_leave(problem: Problem, rows: int, column: int) -> int:
    """Row whose variable is the first to fall to zero as that of ``column`` grows, z0 before others; -1: none does."""
    table, largest = problem.table, 0.0
    for i in range(rows):
        largest = max(largest, abs(table[i, column]))
    found, least = -1, 0.0
    for i in range(rows):
        if table[i, column] > NO_PIVOT * largest:
            ratio = max(table[i, rows + 1], 0.0) / table[i, column]
            if found < 0 or ratio < least or (ratio == least and problem.basic[i] == 2 * rows):
                found, least = i, ratio
    return found
