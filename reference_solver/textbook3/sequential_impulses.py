"""Sequential impulses point by point: a normal row, then the friction disc, totals clamped (E10, E11).

The rows of a manifold are solved in terms of the relative twist of its two bodies at its centre: it is read once, each
impulse changes it, and the bodies get the sum of the impulses at the end.

In the second half of the sweeps the points of a manifold are taken backwards. In one order throughout, what the last
sweep leaves unsolved is always at the same corner, and a column creeps to one side.
"""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.coulomb import into_disc
from reference_solver.textbook.options import Options
from reference_solver.textbook3.kinematics import apply_wrench, relative_twist, velocity_at
from reference_solver.textbook3.one_contact import disc_friction
from reference_solver.textbook3.state import Bodies, Manifolds
from reference_solver.textbook3.vector import ZERO, Vector, add, add_scaled, cross, row


@inner_kernel
def sweep_points(
    bodies: Bodies, manifolds: Manifolds, options: Options, relaxation: float, backwards: int, push: int
) -> None:
    """One sweep over all manifolds in canonical order, at each point the normal row and then the friction rows.

    ``backwards``: whether points are taken from the last to the first. ``push``: whether the pseudo-velocity rows (E16)
    are solved along with them.
    """
    for m in range(len(manifolds)):
        v, w = relative_twist(bodies.twist, manifolds, m, options.rotation)
        if manifolds.points[m] == 1:
            # The point is the centre of the manifold: it has no lever, and its matrix is all there is.
            change = press(manifolds, m, 0, v, relaxation)
            if manifolds.friction[m] > 0.0:
                k = manifolds.matrix[m, 0]
                u = (v[0] + k[2] * change[2], v[1] + k[4] * change[2], 0.0)
                change = add(change, drag(manifolds, m, 0, u, relaxation))
            apply_wrench(bodies, bodies.twist, manifolds, m, options.rotation, change, ZERO)
        else:
            force, moment = ZERO, ZERO
            last = manifolds.points[m] - 1
            for k in range(last + 1):
                p = last - k if backwards else k
                change = press(manifolds, m, p, velocity_at(v, w, manifolds, m, p), relaxation)
                v, w = respond_to_normal(v, w, manifolds, m, p, change[2])
                if manifolds.friction[m] > 0.0:
                    drags = drag(manifolds, m, p, velocity_at(v, w, manifolds, m, p), relaxation)
                    v, w = respond_to_friction(v, w, manifolds, m, p, drags)
                    change = add(change, drags)
                force = add(force, change)
                moment = add(moment, cross(row(manifolds.offset[m], p, 0), change))
            apply_wrench(bodies, bodies.twist, manifolds, m, options.rotation, force, moment)
        if push:
            push_manifold(bodies, manifolds, m, options, relaxation, backwards)


@inner_kernel
def respond_to_normal(v: Vector, w: Vector, manifolds: Manifolds, m: int, p: int, n: float) -> tuple[Vector, Vector]:
    """(V, W) after a normal impulse at point p."""
    r = manifolds.response[m, p]
    return add_scaled(v, n, (r[0, 2], r[1, 2], r[2, 2])), add_scaled(w, n, (r[3, 2], r[4, 2], r[5, 2]))


@inner_kernel
def respond_to_friction(
    v: Vector, w: Vector, manifolds: Manifolds, m: int, p: int, change: Vector
) -> tuple[Vector, Vector]:
    """(V, W) after a tangential impulse at point p."""
    r = manifolds.response[m, p]
    for k in range(2):
        v = add_scaled(v, change[k], (r[0, k], r[1, k], r[2, k]))
        w = add_scaled(w, change[k], (r[3, k], r[4, k], r[5, k]))
    return v, w


@inner_kernel
def press(manifolds: Manifolds, m: int, p: int, u: Vector, relaxation: float) -> Vector:
    """Normal row: bring u_n to its target, the total never pulling; returns the change of impulse."""
    old = manifolds.impulse[m, p, 2]
    new = max(old - (relaxation / manifolds.matrix[m, p, 5]) * (u[2] - manifolds.target[m, p]), 0.0)
    manifolds.impulse[m, p, 2] = new
    return (0.0, 0.0, new - old)


@inner_kernel
def drag(manifolds: Manifolds, m: int, p: int, u: Vector, relaxation: float) -> Vector:
    """Friction rows together: the total that stops the slip, or all that the disc allows against it."""
    old1, old2 = manifolds.impulse[m, p, 0], manifolds.impulse[m, p, 1]
    k = manifolds.matrix[m, p]
    bound = manifolds.friction[m] * manifolds.impulse[m, p, 2]
    # The inverse does not wait for the velocity, and most contacts stick.
    share = 1.0 / (k[0] * k[3] - k[1] * k[1])
    new1 = old1 - ((k[3] * share) * u[0] - (k[1] * share) * u[1])
    new2 = old2 - ((k[0] * share) * u[1] - (k[1] * share) * u[0])
    if new1 * new1 + new2 * new2 > bound * bound:
        q1 = u[0] - k[0] * old1 - k[1] * old2
        q2 = u[1] - k[1] * old1 - k[3] * old2
        new1, new2 = disc_friction(k[0], k[1], k[3], q1, q2, bound)
    if relaxation != 1.0:
        new1, new2 = into_disc(old1 + relaxation * (new1 - old1), old2 + relaxation * (new2 - old2), bound)
    manifolds.impulse[m, p, 0], manifolds.impulse[m, p, 1] = new1, new2
    return (new1 - old1, new2 - old2, 0.0)


@inner_kernel
def push_manifold(
    bodies: Bodies, manifolds: Manifolds, m: int, options: Options, relaxation: float, backwards: int
) -> None:
    """Pseudo-velocity rows of manifold m (E16)."""
    v, w = relative_twist(bodies.pseudo, manifolds, m, options.rotation)
    total, moment = 0.0, ZERO
    last = manifolds.points[m] - 1
    for k in range(last + 1):
        p = last - k if backwards else k
        u = velocity_at(v, w, manifolds, m, p)
        old = manifolds.push[m, p]
        new = max(old - (relaxation / manifolds.matrix[m, p, 5]) * (u[2] - manifolds.push_target[m, p]), 0.0)
        manifolds.push[m, p] = new
        if last > 0:
            v, w = respond_to_normal(v, w, manifolds, m, p, new - old)
        total += new - old
        moment = add(moment, cross(row(manifolds.offset[m], p, 0), (0.0, 0.0, new - old)))
    apply_wrench(bodies, bodies.pseudo, manifolds, m, options.rotation, (0.0, 0.0, total), moment)


@inner_kernel
def sweep_pushes(bodies: Bodies, manifolds: Manifolds, options: Options, relaxation: float) -> None:
    """One sweep over the pseudo-velocity rows alone."""
    for m in range(len(manifolds)):
        push_manifold(bodies, manifolds, m, options, relaxation, 0)
