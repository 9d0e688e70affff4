"""The planar contact problem handed to the direct solver, and its answer taken back (E40)."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel, spliced_kernel
from reference_solver.direct.problem import CONTACTS, Problem
from reference_solver.direct.rounds import solve_problem
from reference_solver.textbook.noise import MENDED
from reference_solver.textbook.options import Options
from reference_solver.textbook.vectors import copy_vectors
from reference_solver.textbook2.columns import (
    AN,
    AT,
    BN,
    BT,
    FRICTION,
    INVERSE_INERTIA,
    INVERSE_MASS,
    NORMAL_MASS,
    NX,
    NY,
    PN,
    PT,
    SPEED,
    TANGENT_MASS,
    TARGET,
    A,
    B,
)
from reference_solver.textbook2.kinematics import add_pressure, apply_normal, apply_tangent
from reference_solver.textbook2.state import CONTACTS as ROW_COUNT
from reference_solver.textbook2.state import Bodies, Rows


@inner_kernel
def solve_directly(bodies: Bodies, rows: Rows, options: Options, problem: Problem, budget: int, fresh: bool) -> float:
    """Set the impulses that the direct solver finds within `budget` factorisations; returns their residual."""
    load(bodies, rows, options, problem)
    residual = solve_problem(problem, options.residual, budget, fresh)
    for c in range(rows.counts[ROW_COUNT]):
        normal, tangent = problem.contact.best[c, 0], problem.contact.best[c, 1]
        apply_normal(bodies, bodies.twist, rows, c, normal - rows.real[c, PN])
        rows.real[c, PN] = normal
        if options.friction:
            apply_tangent(bodies, bodies.twist, rows, c, tangent - rows.real[c, PT])
            rows.real[c, PT] = tangent
    mend_velocities(bodies, rows, options)
    return residual


@inner_kernel
def mend_velocities(bodies: Bodies, rows: Rows, options: Options) -> None:
    """Build velocities anew from v*, kept in ``start``, and the impulses, should they differ by more than round-off.

    The direct solver may move very large loads along redundant contacts on its way, and of what came and went the
    round-off stays. Else the velocities that the changes led to are the more accurate ones. Uses up ``pseudo``.
    """
    copy_vectors(bodies.start, bodies.pseudo)
    for i in range(len(bodies.kind)):
        bodies.pressed[i, 0] = bodies.pressed[i, 1] = 0.0
    for c in range(rows.counts[ROW_COUNT]):
        apply_normal(bodies, bodies.pseudo, rows, c, rows.real[c, PN])
        if options.friction:
            apply_tangent(bodies, bodies.pseudo, rows, c, rows.real[c, PT])
        add_pressure(bodies, rows, c)
    for i in range(len(bodies.kind)):
        for k in range(3):
            if abs(bodies.twist[i, k] - bodies.pseudo[i, k]) > MENDED * bodies.pressed[i, k // 2]:
                copy_vectors(bodies.pseudo, bodies.twist)
                return


@spliced_kernel
def load(bodies: Bodies, rows: Rows, options: Options, problem: Problem) -> None:
    """Bodies and rows in the direct solver's form."""
    contact, body = problem.contact, problem.body
    problem.size[CONTACTS] = rows.counts[ROW_COUNT]
    for i in range(len(bodies.kind)):
        for k in range(3):
            inverse = bodies.real[i, INVERSE_MASS] if k < 2 else bodies.real[i, INVERSE_INERTIA]
            body.twist[i, k] = bodies.twist[i, k]
            body.weight[i, k] = 1.0 / inverse if inverse > 0.0 else 0.0
    for c in range(rows.counts[ROW_COUNT]):
        contact.friction[c] = rows.real[c, FRICTION] if options.friction else 0.0
        contact.target[c], contact.speed[c] = rows.real[c, TARGET], rows.real[c, SPEED]
        contact.admittance[c, 0] = 1.0 / rows.real[c, NORMAL_MASS]
        contact.admittance[c, 1] = 1.0 / rows.real[c, TANGENT_MASS]
        contact.impulse[c, 0] = rows.real[c, PN]
        contact.impulse[c, 1] = rows.real[c, PT] if options.friction else 0.0
        nx, ny = rows.real[c, NX], rows.real[c, NY]
        for side in range(2):
            i, sign = rows.integer[c, A if side == 0 else B], 2.0 * side - 1.0
            contact.body[c, side] = i
            normal, tangent = contact.jacobian[c, side, 0], contact.jacobian[c, side, 1]
            normal[0], normal[1], normal[2] = sign * nx, sign * ny, sign * rows.real[c, BN if side else AN]
            tangent[0], tangent[1], tangent[2] = -sign * ny, sign * nx, sign * rows.real[c, BT if side else AT]
            for r in range(2):
                for k in range(3):
                    inverse = bodies.real[i, INVERSE_MASS] if k < 2 else bodies.real[i, INVERSE_INERTIA]
                    contact.response[c, side, r, k] = inverse * contact.jacobian[c, side, r, k]
