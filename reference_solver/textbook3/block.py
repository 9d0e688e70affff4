"""Block solve: all points of one manifold together, then over-relaxed (E12, E13).

Most blocks of three and more points stick: `stick` solves them at once. Others go to `solve_by_newton`; where that
finds nothing (friction so large that there may be nothing to find), the points are solved one after the other, each
exactly with its friction (`coulomb_impulse`). Three and more points of one plane are redundant: their impulses are not
unique, but the wrench on the bodies, and with it every velocity, is.
"""

from __future__ import annotations

from reference_solver.compilation import inner_kernel
from reference_solver.coulomb import into_disc
from reference_solver.textbook.options import Options
from reference_solver.textbook3.block_newton import solve_by_newton
from reference_solver.textbook3.kinematics import apply_wrench, relative_twist, respond, velocity_at
from reference_solver.textbook3.one_contact import coulomb_impulse
from reference_solver.textbook3.state import Bodies, Manifolds
from reference_solver.textbook3.sticking import stick
from reference_solver.textbook3.vector import Vector, add, cross, length, row, sub

#: Failures of Newton's method after which a block is left to `solve_in_turn` for the rest of the step: each failure
#: costs as much as a hundred inner sweeps.
MOST_FAILURES = 5
#: Inner sweeps of one block at most; later outer sweeps go on where this ends.
INNER_SWEEPS = 40
#: A block is solved when an inner sweep changes it by less than this part of its first change; deeper accuracy
#: is lost again as soon as a neighbour moves ...
INNER_GAIN = 1e-3
#: ... or by less than this part of its impulses, two units in the last place.
INNER_FLOOR = 4e-16


@inner_kernel
def sweep_blocks(bodies: Bodies, manifolds: Manifolds, options: Options, relaxation: float) -> None:
    """One sweep over all manifolds in canonical order."""
    for m in range(len(manifolds)):
        v, w = relative_twist(bodies.twist, manifolds, m, options.rotation)
        for p in range(manifolds.points[m]):
            for k in range(3):
                manifolds.before[m, p, k] = manifolds.impulse[m, p, k]
        solve_block(manifolds, m, v, w)
        apply_block(bodies, manifolds, m, options, relaxation)


@inner_kernel
def solve_block(manifolds: Manifolds, m: int, v: Vector, w: Vector) -> None:
    """Impulses of manifold m that solve its points together, the rest of the world held."""
    if manifolds.points[m] == 1:
        solve_point(manifolds, m, 0, velocity_at(v, w, manifolds, m, 0))
    elif manifolds.rigid[m] and stick(manifolds, m, v, w):
        return
    elif manifolds.failures[m] >= MOST_FAILURES:
        solve_in_turn(manifolds, m, v, w)
    elif not solve_by_newton(manifolds, m, v, w):
        manifolds.failures[m] += 1
        for p in range(manifolds.points[m]):
            for k in range(3):
                manifolds.impulse[m, p, k] = manifolds.before[m, p, k]
        solve_in_turn(manifolds, m, v, w)


@inner_kernel
def solve_in_turn(manifolds: Manifolds, m: int, v: Vector, w: Vector) -> None:
    """Points one after the other, each exactly, until they agree or `INNER_SWEEPS` are made."""
    first_change = 0.0
    for sweep in range(INNER_SWEEPS):
        largest_change, largest = 0.0, 0.0
        for p in range(manifolds.points[m]):
            change = solve_point(manifolds, m, p, velocity_at(v, w, manifolds, m, p))
            v, w = respond(v, w, manifolds, m, p, change)
            largest_change = max(largest_change, length(change))
            largest = max(largest, manifolds.impulse[m, p, 2])
        if sweep == 0:
            first_change = largest_change
        if largest_change <= max(INNER_GAIN * first_change, INNER_FLOOR * largest):
            return


@inner_kernel
def solve_point(manifolds: Manifolds, m: int, p: int, u: Vector) -> Vector:
    """Exact solution of one point, all others held; returns the change of its impulse."""
    k = manifolds.matrix[m, p]
    old = row(manifolds.impulse[m], p, 0)
    q = (
        u[0] - (k[0] * old[0] + k[1] * old[1] + k[2] * old[2]),
        u[1] - (k[1] * old[0] + k[3] * old[1] + k[4] * old[2]),
        u[2] - (k[2] * old[0] + k[4] * old[1] + k[5] * old[2]) - manifolds.target[m, p],
    )
    new = coulomb_impulse((k[0], k[1], k[2], k[3], k[4], k[5]), q, manifolds.friction[m])
    for d in range(3):
        manifolds.impulse[m, p, d] = new[d]
    return sub(new, old)


@inner_kernel
def apply_block(bodies: Bodies, manifolds: Manifolds, m: int, options: Options, relaxation: float) -> None:
    """Go from the old impulses through the block's solution by the factor, stay in the cone, apply the change."""
    force, moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for p in range(manifolds.points[m]):
        old, new = row(manifolds.before[m], p, 0), row(manifolds.impulse[m], p, 0)
        if relaxation != 1.0:
            pressed = max(old[2] + relaxation * (new[2] - old[2]), 0.0)
            t1, t2 = into_disc(
                old[0] + relaxation * (new[0] - old[0]),
                old[1] + relaxation * (new[1] - old[1]),
                manifolds.friction[m] * pressed,
            )
            new = (t1, t2, pressed)
            for d in range(3):
                manifolds.impulse[m, p, d] = new[d]
        change = sub(new, old)
        force = add(force, change)
        moment = add(moment, cross(row(manifolds.offset[m], p, 0), change))
    apply_wrench(bodies, bodies.twist, manifolds, m, options.rotation, force, moment)
