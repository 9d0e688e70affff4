"""Which contacts hold, stick and slip: by complementary pivots for few planar contacts, else by the direct solver.

What that does not find is found by sweeps in space, as where bodies approach ever so slowly and slip fast.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference_solver.compilation import kernel
from reference_solver.direct import problem as direct
from reference_solver.direct.rounds import solve_problem
from reference_solver.exact.kernels.sweeps import sweep
from reference_solver.exact.refusals import NoSolution, Unconverged
from reference_solver.exact.rows import Contacts
from reference_solver.model import Array

#: Planar contacts up to which pivots are faster than Newton's rounds.
FEW = 16
#: Residual (E14) at which rounds end, one at which they have found the modes, and factorisations that they may take.
RESIDUAL, FOUND, BUDGET = 1e-14, 1e-8, 300
#: How much softer contacts are taken than bodies yield, in turn: rounds go in circles with one and not with another.
SOFTER = (1.0, 10.0, 0.1, 100.0, 0.01)
#: Products that sweeps may take, half a second of CPU.
PRODUCTS = 500_000_000


def within_cones(contacts: Contacts, free: Array, slips: Array) -> Array:
    """Return forces p (m d,) that obey the laws of contact, to about 1e-9 of the largest.

    Parameters
    ----------
    contacts
        m of them, with their rows at the instant.
    free
        (m d,): what contacts would do without forces.
    slips
        (m, d - 1) directions of contacts that slip already, zeros elsewhere.

    Raises
    ------
    NoSolution, Unconverged
        If there are no such forces, or if none are found.
    """
    planar = contacts.world.dimension == 2
    if not planar or len(contacts) > FEW:
        forces, residual = _by_rounds(contacts, free, slips)
        if residual <= FOUND:
            return forces
    if not planar:
        return _by_sweeps(contacts, free, slips)
    rows, yields = contacts.matrices
    return _by_pivots(rows @ yields, free, contacts.friction, slips)


def loads_with_friction(yields: Array, friction: Array, slips: Array) -> Array:
    """Return how loads (m,) move bodies, that of a slip together with its friction (N, m).

    Parameters
    ----------
    yields
        (N, m, d): how forces along the frames do.
    friction, slips
        (m,) and (m, d - 1) directions of slips, zeros elsewhere.
    """
    return np.asarray(yields[:, :, 0] - friction * (yields[:, :, 1:] * slips).sum(axis=2))


def add_friction(forces: Array, friction: Array, slips: Array, slides: NDArray[Any]) -> None:
    """Write into forces (m, d) the friction that loads of contacts bring which slip (m,), against (m, d - 1)."""
    forces[slides, 1:] = -(friction * forces[:, 0])[slides, None] * slips[slides]


@kernel
def solve(problem: direct.Problem, tolerance: float, budget: int) -> float:
    """Solve a problem from no forces on; return its residual."""
    return solve_problem(problem, tolerance, budget, True)


def _by_rounds(contacts: Contacts, free: Array, slips: Array) -> tuple[Array, float]:
    """Return forces and their residual by Newton's method for all contacts at once (E40 to E45).

    What slips already is a normal that pushes where its friction leads as well.

    Raises
    ------
    NoSolution
        If friction presses a contact more than its load takes off.
    """
    world, rows, d = contacts.world, contacts.rows, contacts.world.dimension
    n, q = world.shape
    slides = np.asarray(slips.any(axis=1))
    push = rows.yields.copy()
    push[:, 0] -= contacts.friction[:, None, None] * np.einsum("mk,mksq->msq", slips, push[:, 1:])
    own = np.einsum("mksq,mksq->mk", rows.row, push)
    if own[:, 0].min() <= 0.0:
        raise NoSolution
    problem = direct.allocate_problem(d, n, len(contacts), used=True)
    problem.size[direct.CONTACTS] = len(contacts)
    contact, body = problem.contact, problem.body
    size = max(float(np.abs(free).max()), 1e-300)
    # The direct solver reads velocities of bodies: those that do along tangents what ``free`` does, and targets.
    tangents = np.repeat(~slides, d)
    tangents[::d] = False
    matrix = contacts.matrices[0]
    each = np.tile(world.per_length, n)
    twist = each * np.linalg.lstsq(matrix[tangents] * each, free[tangents] / size)[0]
    body.twist[:, :q] = twist.reshape(n, q)
    contact.target[:] = matrix[::d] @ twist - free[::d] / size
    mass, moment = world.bodies.inverse_mass, world.bodies.moment
    body.weight[:, :d] = np.divide(1.0, mass, out=np.zeros(n), where=mass > 0.0)[:, None]
    body.weight[:, d:q] = np.where(np.isfinite(moment), moment, 0.0).mean(axis=1, keepdims=True)
    contact.body[:] = contacts.features[:, :2]
    contact.friction[:] = np.where(slides, 0.0, contacts.friction)
    contact.speed[:] = 1.0
    contact.jacobian[:, :, :d, :q], contact.response[:, :, :d, :q] = rows.row.swapaxes(1, 2), push.swapaxes(1, 2)
    for softer in SOFTER:
        contact.admittance[:, 0], contact.admittance[:, 1] = softer * own[:, 0], softer * own[:, 1:].mean(axis=1)
        residual = solve(problem, RESIDUAL, BUDGET)
        if residual <= FOUND:
            break
    forces = contact.best[:, :d].copy()
    add_friction(forces, contacts.friction, slips, slides)
    return size * forces.ravel(), float(residual)


def _by_sweeps(contacts: Contacts, free: Array, slips: Array) -> Array:
    """Return forces (m d,) in space by sweeps.

    Raises
    ------
    Unconverged
        If they do not settle.
    """
    rows, yields = contacts.matrices
    slides = np.asarray(slips.any(axis=1))
    blocks = yields.reshape(len(yields), -1, 3).copy()
    blocks[:, :, 0] = loads_with_friction(blocks, contacts.friction, slips)
    friction = np.where(slides, 0.0, contacts.friction)
    forces, settled = sweep(rows @ blocks.reshape(yields.shape), free, friction, PRODUCTS // free.size**2)
    if not settled:
        raise Unconverged(count=len(contacts))
    add_friction(forces, contacts.friction, slips, slides)
    return np.asarray(forces.ravel())


def _by_pivots(yields: Array, free: Array, friction: Array, slips: Array) -> Array:
    """Return forces (m d,) of planar contacts: a linear complementarity problem (Stewart and Trinkle, E45).

    Friction has two directions, onward and backward.

    Raises
    ------
    NoSolution
        If pivots end on a ray, by whatever way.
    """
    m, slip = len(friction), slips[:, 0]
    # Every contact as stiff as any: ties of pivots are then told from round-off.
    stiff = np.maximum(np.diag(yields)[::2], np.diag(yields)[1::2])
    scale = np.repeat(1.0 / np.sqrt(stiff), 2)
    matrix, wanted = scale[:, None] * yields * scale, scale * free
    size = max(float(np.abs(wanted).max()), 1e-300)
    rubs = np.flatnonzero((slip == 0.0) & (friction > 0.0))
    n, k = 2 * np.arange(m), len(rubs)
    # Forces by unknowns: loads, with the friction of slips; friction onward and backward of what may stick.
    by = np.zeros((2 * m, m + 2 * k))
    by[n, np.arange(m)] = 1.0
    by[n + 1, np.arange(m)] = -friction * slip
    by[2 * rubs + 1, m + np.arange(k)], by[2 * rubs + 1, m + k + np.arange(k)] = 1.0, -1.0
    speeds = np.concatenate([n, 2 * rubs + 1])
    rates = matrix[speeds] @ by
    total = m + 3 * k
    table, right = np.zeros((total, total)), np.zeros(total)
    # Unknown: loads, friction onward and backward, the speed |u_t| of the slip. Each has a row that is zero where it is
    # not: u_n, u_t + |u_t|, |u_t| - u_t, and mu p_n less all friction.
    onward, backward, speed = (m + turn * k + np.arange(k) for turn in range(3))
    table[: m + k, : m + 2 * k], right[: m + k] = rates, wanted[speeds] / size
    table[backward, : m + 2 * k], right[backward] = -rates[m:], -wanted[2 * rubs + 1] / size
    table[onward, speed] = table[backward, speed] = 1.0
    table[speed, rubs] = friction[rubs]
    table[speed, onward] = table[speed, backward] = -1.0
    for attempt in range(6):  # pivots that round-off spoils: by another way
        cover = np.asarray(1.0 + attempt * (0.37 + 0.61 * np.arange(total)) % 1.7, np.float64)
        found = complementary(table, right, cover)
        if found is not None and _solves(table, right, found):
            return np.asarray(scale * (by @ found[: m + 2 * k]) * size)
    raise NoSolution


def _solves(table: Array, right: Array, found: Array) -> bool:
    slack = table @ found + right
    least = min(found.min(), slack.min())
    return bool(least > -1e-9 and np.abs(found * slack).max() < 1e-9 * max(1.0, found.max() ** 2))


def complementary(table: Array, right: Array, cover: Array) -> Array | None:
    """Return z >= 0 (n,) with ``w = table @ z + right >= 0`` and ``z . w = 0``; None where a ray is found.

    C. Lemke, *Management Science* 11, 1965, with the artificial column ``cover``; ties are broken in lexicographic
    order (B. Eaves, *Management Science* 17, 1971), so that no basis comes again.
    """
    n = len(right)
    if right.min() >= 0.0:
        return np.zeros(n)
    tableau = np.column_stack([np.eye(n), -table, -cover, right])
    basis = np.arange(n)
    row, enters = int(np.argmin(right / cover)), 2 * n
    for _ in range(50 * n + 50):
        leaves = int(basis[row])
        tableau[row] /= tableau[row, enters]
        others = tableau[:, enters].copy()
        others[row] = 0.0
        tableau -= np.outer(others, tableau[row])
        basis[row] = enters
        if leaves == 2 * n:
            found = np.zeros(2 * n)
            found[basis] = tableau[:, -1]
            return found[n:]
        enters = leaves + n if leaves < n else leaves - n
        column = tableau[:, enters]
        may = np.flatnonzero(column > 1e-11 * np.abs(column).max())
        if not len(may):
            return None
        ratios = tableau[may, -1] / column[may]
        tied = may[ratios <= ratios.min() + 1e-13]
        artificial = tied[basis[tied] == 2 * n]
        if len(artificial):
            row = int(artificial[0])
            continue
        rows = tableau[tied, :n] / column[tied, None]
        k = 0
        while len(tied) > 1 and k < n:
            least = rows[:, k] <= rows[:, k].min() + 1e-13
            tied, rows, k = tied[least], rows[least], k + 1
        row = int(tied[0])
    return None
