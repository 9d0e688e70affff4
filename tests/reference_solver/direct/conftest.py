"""Contact problems built from matrices, for the direct solver alone."""

import numpy as np
import pytest

from reference_solver.compilation import kernel
from reference_solver.direct.envelope import add, clear, factorise, substitute
from reference_solver.direct.ordering import order_bodies
from reference_solver.direct.pivoting import find_by_pivots
from reference_solver.direct.problem import CONTACTS, allocate_problem
from reference_solver.direct.rounds import commit, scaled_map, set_excess, solve_problem, withdraw


@kernel
def run_solver(problem, tolerance, budget, fresh=False):
    return solve_problem(problem, tolerance, budget, fresh)


@kernel
def run_pivots(problem, attempt):
    set_excess(problem)
    withdraw(problem)
    if not find_by_pivots(problem, attempt):
        return np.inf
    commit(problem, 1.0)
    return scaled_map(problem)


@kernel
def run_order(problem):
    return order_bodies(problem)


@kernel
def run_factors(problem, rows, columns, values):
    clear(problem)
    for k in range(len(values)):
        add(problem, rows[k], columns[k], values[k])
    if not factorise(problem):
        return False
    substitute(problem)
    return True


class Direct:
    """Calls into the direct solver, and problems for it."""

    solve = staticmethod(run_solver)
    pivots = staticmethod(run_pivots)
    order = staticmethod(run_order)
    factors = staticmethod(run_factors)

    @staticmethod
    def touching(pairs, bodies, dimension=2):
        """A problem that has nothing but its graph: one contact per pair of free bodies."""
        problem = allocate_problem(dimension, bodies, max(len(pairs), 1), True)
        problem.size[CONTACTS] = len(pairs)
        problem.contact.body[: len(pairs)] = np.reshape(pairs, (-1, 2))
        problem.body.weight[:] = 1.0
        return problem

    @staticmethod
    def problem(dimension, pairs, jacobians, masses, twists, friction, targets):
        """Contacts between bodies of diagonal mass matrices, body 0 fixed; impulses start from zero.

        `jacobians` (c, 2, rows, velocities), `masses` and `twists` (n, velocities).
        """
        contacts, bodies = len(pairs), len(masses)
        problem = allocate_problem(dimension, bodies, contacts, True)
        c, b = problem.contact, problem.body
        rows, width = jacobians.shape[2:]
        inverse = np.where(np.arange(bodies)[:, None] > 0, 1.0 / masses, 0.0)
        problem.size[CONTACTS] = contacts
        c.body[:] = pairs
        c.jacobian[:, :, :rows, :width] = jacobians
        c.response[:, :, :rows, :width] = jacobians * inverse[np.asarray(pairs)][:, :, None, :]
        w = (c.jacobian * c.response).sum(axis=(1, 3))
        c.admittance[:, 0], c.admittance[:, 1] = w[:, 0], w[:, 1:rows].mean(axis=1)
        c.friction[:], c.target[:], c.speed[:] = friction, targets, 1.0
        b.twist[:, :width] = twists
        b.weight[:, :width] = np.where(inverse > 0.0, masses, 0.0)
        return problem

    @staticmethod
    def random(seed, contacts, dimension=2, mu=0.5):
        """Bodies of masses 0.1 to 10 with random contacts; the first contacts reach every body from the fixed one."""
        rng = np.random.default_rng(seed)
        rows, width = (2, 3) if dimension == 2 else (3, 6)
        bodies = 1 + max(1, contacts // 2)
        pairs = [(min(k, bodies - 2), min(k, bodies - 2) + 1) for k in range(contacts)]
        normals = rng.normal(size=(contacts, rows, rows))
        frames = np.linalg.qr(normals)[0]
        jacobians = np.zeros((contacts, 2, rows, width))
        jacobians[:, 1, :, :rows], jacobians[:, 0, :, :rows] = frames, -frames
        jacobians[:, :, :, rows:] = rng.normal(size=(contacts, 2, rows, width - rows))
        masses = 10.0 ** rng.uniform(-1.0, 1.0, (bodies, width))
        twists = rng.normal(size=(bodies, width)) * (np.arange(bodies) > 0)[:, None]
        return Direct.problem(dimension, sorted(pairs), jacobians, masses, twists, mu, 0.0)

    @staticmethod
    def pressed_block(points, mass=1.0):
        """A block pressed on the floor at several points of one line: redundant beyond two."""
        place = np.linspace(-1.0, 1.0, points)
        jacobians = np.zeros((points, 2, 2, 3))
        jacobians[:, 1, 0, 1], jacobians[:, 1, 0, 2] = 1.0, place
        jacobians[:, 1, 1, 0], jacobians[:, 1, 1, 2] = -1.0, 0.5
        jacobians[:, 0] = -jacobians[:, 1]
        masses = np.array([[1.0] * 3, [mass, mass, mass / 3.0]])
        twists = np.array([[0.0] * 3, [0.2, -1.0, 0.0]])
        return Direct.problem(2, [(0, 1)] * points, jacobians, masses, twists, 0.5, 0.0)

    @staticmethod
    def delassus(problem):
        """W (rows of all contacts) and u - b at the twists that the problem now has."""
        contacts, rows, width = int(problem.size[CONTACTS]), int(problem.size[2]), int(problem.size[3])
        c, bodies = problem.contact, len(problem.body)
        j, r = np.zeros((2, contacts * rows, bodies * width))
        for k in range(contacts):
            for side in range(2):
                i = c.body[k, side] * width
                lines = slice(k * rows, (k + 1) * rows)
                j[lines, i : i + width] += c.jacobian[k, side, :rows, :width]
                r[lines, i : i + width] += c.response[k, side, :rows, :width]
        u = j @ problem.body.twist[:, :width].ravel()
        u[::rows] -= c.target
        return r @ j.T, u


@pytest.fixture
def direct():
    return Direct()
