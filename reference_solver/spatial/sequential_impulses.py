"""Sequential impulses point by point: a normal row, then the friction disc, totals clamped (E10, E11)."""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.coulomb import into_disc
from reference_solver.spatial.kinematics import apply_wrench, relative_twist, respond, velocity_at
from reference_solver.spatial.one_contact import disc_friction
from reference_solver.spatial.state import Bodies, Manifolds
from reference_solver.spatial.vector import Vector, add, cross, row
from reference_solver.stepping.options import Options


@inner_kernel
def sweep_points(bodies: Bodies, manifolds: Manifolds, options: Options, relaxation: float) -> None:
    """One sweep over all points in canonical order, at each the normal row and then the friction rows."""
    for m in range(len(manifolds)):
        v, w = relative_twist(bodies.twist, manifolds, m, options.rotation)
        force, moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        for p in range(manifolds.points[m]):
            for part in range(2 if manifolds.friction[m] > 0.0 else 1):
                if part == 0:
                    change = press(manifolds, m, p, velocity_at(v, w, manifolds, m, p), relaxation)
                else:
                    change = drag(manifolds, m, p, velocity_at(v, w, manifolds, m, p), relaxation)
                v, w = respond(v, w, manifolds, m, p, change)
                force = add(force, change)
                moment = add(moment, cross(row(manifolds.offset[m], p, 0), change))
        apply_wrench(bodies, bodies.twist, manifolds, m, options.rotation, force, moment)


@inner_kernel
def press(manifolds: Manifolds, m: int, p: int, u: Vector, relaxation: float) -> Vector:
    """Normal row: bring u_n to its target, the total never pulling; returns the change of impulse."""
    if manifolds.open[m, p]:
        return (0.0, 0.0, 0.0)
    old = manifolds.impulse[m, p, 2]
    new = max(old - relaxation * (u[2] - manifolds.target[m, p]) / manifolds.matrix[m, p, 5], 0.0)
    manifolds.impulse[m, p, 2] = new
    return (0.0, 0.0, new - old)


@inner_kernel
def drag(manifolds: Manifolds, m: int, p: int, u: Vector, relaxation: float) -> Vector:
    """Friction rows together: the total that stops the slip, or all that the disc allows against it."""
    old1, old2 = manifolds.impulse[m, p, 0], manifolds.impulse[m, p, 1]
    k = manifolds.matrix[m, p]
    bound = manifolds.friction[m] * manifolds.impulse[m, p, 2]
    q1 = u[0] - k[0] * old1 - k[1] * old2
    q2 = u[1] - k[1] * old1 - k[3] * old2
    new1, new2 = disc_friction(k[0], k[1], k[3], q1, q2, bound)
    if relaxation != 1.0:
        new1, new2 = into_disc(old1 + relaxation * (new1 - old1), old2 + relaxation * (new2 - old2), bound)
    manifolds.impulse[m, p, 0], manifolds.impulse[m, p, 1] = new1, new2
    return (new1 - old1, new2 - old2, 0.0)


@inner_kernel
def sweep_pushes(bodies: Bodies, manifolds: Manifolds, options: Options, relaxation: float) -> None:
    """One sweep over the pseudo-velocity rows of position correction (E16)."""
    for m in range(len(manifolds)):
        v, w = relative_twist(bodies.pseudo, manifolds, m, options.rotation)
        force, moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        for p in range(manifolds.points[m]):
            u = velocity_at(v, w, manifolds, m, p)
            old = manifolds.push[m, p]
            new = max(old - relaxation * (u[2] - manifolds.push_target[m, p]) / manifolds.matrix[m, p, 5], 0.0)
            manifolds.push[m, p] = new
            change = (0.0, 0.0, new - old)
            v, w = respond(v, w, manifolds, m, p, change)
            force = add(force, change)
            moment = add(moment, cross(row(manifolds.offset[m], p, 0), change))
        apply_wrench(bodies, bodies.pseudo, manifolds, m, options.rotation, force, moment)
