"""The spatial contact problem handed to the direct solver, and its answer taken back (E40)."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.direct.problem import CONTACTS, Problem
from reference_solver.direct.rounds import solve_problem
from reference_solver.textbook.motion import FREE
from reference_solver.textbook.noise import MENDED
from reference_solver.textbook.options import Options
from reference_solver.textbook3.kinematics import add_pressure, apply_wrench
from reference_solver.textbook3.state import Bodies, Manifolds
from reference_solver.textbook3.vector import ZERO, add, cross, row, scale, sub, times


@inner_kernel
def solve_directly(
    bodies: Bodies, manifolds: Manifolds, options: Options, problem: Problem, budget: int, fresh: bool
) -> float:
    """Set the impulses that the direct solver finds within `budget` factorisations; returns their residual."""
    load_bodies(bodies, problem)
    load_contacts(bodies, manifolds, options, problem)
    residual = solve_problem(problem, options.residual, budget, fresh)
    c = 0
    for m in range(len(manifolds)):
        force, moment = ZERO, ZERO
        for p in range(manifolds.points[m]):
            best = row(problem.contact.best, c, 0)
            change = sub((best[1], best[2], best[0]), row(manifolds.impulse[m], p, 0))
            for d in range(3):
                manifolds.impulse[m, p, d] = best[(d + 1) % 3]
            force = add(force, change)
            moment = add(moment, cross(row(manifolds.offset[m], p, 0), change))
            c += 1
        apply_wrench(bodies, bodies.twist, manifolds, m, options.rotation, force, moment)
    mend_velocities(bodies, manifolds, options)
    return residual


@inner_kernel
def mend_velocities(bodies: Bodies, manifolds: Manifolds, options: Options) -> None:
    """Build velocities anew from v*, kept in ``start``, and the impulses, should they differ by more than round-off.

    The direct solver may move very large loads along redundant contacts on its way, and of what came and went the
    round-off stays. Else the velocities that the changes led to are the more accurate ones. Uses up ``pseudo``.
    """
    for i in range(len(bodies)):
        bodies.pressed[i, 0] = bodies.pressed[i, 1] = 0.0
        for d in range(6):
            bodies.pseudo[i, d] = bodies.start[i, d]
    for m in range(len(manifolds)):
        force, moment = ZERO, ZERO
        for p in range(manifolds.points[m]):
            impulse = row(manifolds.impulse[m], p, 0)
            force = add(force, impulse)
            moment = add(moment, cross(row(manifolds.offset[m], p, 0), impulse))
            add_pressure(bodies, manifolds, m, p)
        apply_wrench(bodies, bodies.pseudo, manifolds, m, options.rotation, force, moment)
    for i in range(len(bodies)):
        for d in range(6):
            if abs(bodies.twist[i, d] - bodies.pseudo[i, d]) > MENDED * bodies.pressed[i, d // 3]:
                rebuild(bodies)
                return


@inner_kernel
def rebuild(bodies: Bodies) -> None:
    """Take the velocities in ``pseudo``."""
    for i in range(len(bodies)):
        for d in range(6):
            bodies.twist[i, d] = bodies.pseudo[i, d]


@inner_kernel
def load_bodies(bodies: Bodies, problem: Problem) -> None:
    """Twists, and what each counts with: its mass and the harmonic mean of its moments."""
    body = problem.body
    for i in range(len(bodies)):
        trace = 0.0
        for d in range(3):
            trace += bodies.inverse_inertia[i, d, d]
        for d in range(3):
            body.twist[i, d], body.twist[i, 3 + d] = bodies.twist[i, d], bodies.twist[i, 3 + d]
            body.weight[i, d] = 1.0 / bodies.inverse_mass[i] if bodies.motion[i] == FREE else 0.0
            body.weight[i, 3 + d] = 3.0 / trace if trace > 0.0 else 0.0


@inner_kernel
def load_contacts(bodies: Bodies, manifolds: Manifolds, options: Options, problem: Problem) -> None:
    """Contact points in the direct solver's form: the normal first, then both tangents."""
    contact, c = problem.contact, 0
    for m in range(len(manifolds)):
        for p in range(manifolds.points[m]):
            k = manifolds.matrix[m, p]
            contact.friction[c] = manifolds.friction[m]
            contact.target[c], contact.speed[c] = manifolds.target[m, p], manifolds.speed[m, p]
            contact.admittance[c, 0], contact.admittance[c, 1] = k[5], 0.5 * (k[0] + k[3])
            contact.body[c, 0], contact.body[c, 1] = manifolds.body_a[m], manifolds.body_b[m]
            for r in range(3):
                contact.impulse[c, r] = manifolds.impulse[m, p, (r + 2) % 3]
                load_row(bodies, manifolds, options, problem, m, p, c, r)
            c += 1
    problem.size[CONTACTS] = c


@inner_kernel
def load_row(
    bodies: Bodies, manifolds: Manifolds, options: Options, problem: Problem, m: int, p: int, c: int, r: int
) -> None:
    """Jacobian and response of one row, on both bodies (E2, E4)."""
    for side in range(2):
        i = problem.contact.body[c, side]
        arm = row(manifolds.arm_b[m], p, 0) if side else row(manifolds.arm_a[m], p, 0)
        along = scale(2.0 * side - 1.0, row(manifolds.frame[m], (r + 2) % 3, 0))
        turning = cross(arm, along) if options.rotation else ZERO
        spin = times(bodies.inverse_inertia, i, turning)
        jacobian, response = problem.contact.jacobian[c, side, r], problem.contact.response[c, side, r]
        for d in range(3):
            jacobian[d], jacobian[3 + d] = along[d], turning[d]
            response[d], response[3 + d] = bodies.inverse_mass[i] * along[d], spin[d]
