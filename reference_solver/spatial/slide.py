"""The force phase of a sub-step, and the instant inside it at which a slide ends (E19, E20, E34)."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel, spliced_kernel
from reference_solver.direct.problem import Problem
from reference_solver.model import Array
from reference_solver.spatial.certificate import certify, open_solve
from reference_solver.spatial.impact import clear_point, doubt, gap_noise, set_reference_speed
from reference_solver.spatial.kinematics import load_speed, relative_twist, velocity_at
from reference_solver.spatial.motion import accelerate
from reference_solver.spatial.phase import is_exact
from reference_solver.spatial.prepare import still_speed, warm_start
from reference_solver.spatial.state import Bodies, Manifolds, SubStep
from reference_solver.spatial.vector import Vector
from reference_solver.stepping.clock import BRIEF
from reference_solver.stepping.iteration import solve_velocities
from reference_solver.stepping.noise import NOISE
from reference_solver.stepping.options import Options
from reference_solver.stepping.slides import CLOSE, SAME_TIME, SHORTER, STICK_SOLVES, STUCK, closing_speed
from reference_solver.stepping.vectors import copy_vectors
from reference_solver.tally import RESIDUAL, UNCONVERGED

#: Slip below this share of a contact's reference speed is none: the residual leaves as much.
AT_END = 1e-13


@spliced_kernel
def press(
    bodies: Bodies,
    manifolds: Manifolds,
    problem: Problem,
    options: Options,
    tally: Array,
    length: float,
    left: float,
    struck: bool,
) -> None:
    """Velocities at the end of a sub-step of ``length``, out of ``left``: from ``first`` to ``twist`` (E20).

    v* is kept for the certificate.
    """
    begin_press(bodies, manifolds, options, length, left, struck)
    accelerate(bodies, length)
    copy_vectors(bodies.twist, bodies.start)
    warm_start(bodies, manifolds, options)
    solve_velocities(bodies, manifolds, problem, options, tally)


@inner_kernel
def begin_press(
    bodies: Bodies, manifolds: Manifolds, options: Options, length: float, left: float, struck: bool
) -> None:
    """Which points part, and targets and first impulses of all others; ``twist`` is ``first``.

    ``struck``: impacts came first, so that lasting contacts may part as well.
    """
    copy_vectors(bodies.first, bodies.twist)
    for m in range(len(manifolds)):
        v, w = relative_twist(bodies.twist, manifolds, m, options.rotation)
        for p in range(manifolds.points[m]):
            u = velocity_at(v, w, manifolds, m, p)
            set_reference_speed(bodies, manifolds, m, p, u, options.dt)
            clear_point(manifolds, m, p)
            manifolds.slip[m, p, 0], manifolds.slip[m, p, 1] = u[0], u[1]
            least = max(NOISE * manifolds.speed[m, p], still_speed(bodies, manifolds, m, options.dt))
            leaves = u[2] > least and (struck or manifolds.lasts[m, p] == 0)
            if leaves and flies(bodies, manifolds, m, p, u[2], length):
                manifolds.open[m, p] = 1
                continue
            for k in range(3):
                manifolds.impulse[m, p, k] = length * manifolds.force[m, p, k] if options.warm_starting else 0.0
            gap = manifolds.gap[m, p] if manifolds.gap[m, p] > gap_noise(bodies, manifolds, m, p) else 0.0
            last = manifolds.lasts[m, p] == 1
            manifolds.target[m, p] = closing_speed(gap, u[2] if last else 0.0, length, left if last else length)


@inner_kernel
def flies(bodies: Bodies, manifolds: Manifolds, m: int, p: int, u: float, length: float) -> bool:
    """Whether a point that parts with u leaves, and loads do not bring it back within ``length`` from mere noise.

    A rebound with e > 0 always does, however low: its series ends when it ends (E22).
    """
    if manifolds.impact[m, p] and manifolds.restitution[m] > 0.0:
        return True
    pull = load_speed(bodies, manifolds, m, p, 1.0)
    return u * u > 2.0 * pull * gap_noise(bodies, manifolds, m, p) or 2.0 * u > pull * length


@inner_kernel
def certify_press(bodies: Bodies, manifolds: Manifolds, options: Options, tally: Array, length: float) -> None:
    """Certify the force phase that is used, among those that were tried."""
    copy_vectors(bodies.twist, bodies.last)
    copy_vectors(bodies.start, bodies.twist)
    open_solve(bodies, length, tally)
    copy_vectors(bodies.last, bodies.twist)
    if len(manifolds) > 0:
        certify(bodies, manifolds, options, tally)
        doubt(bodies, manifolds, options, tally)


@inner_kernel
def slip_left(manifolds: Manifolds, m: int, p: int, u: Vector) -> float:
    """Slip that point p would have left at the end with its whole friction, < 0 if it came to its end before (E34).

    A point that still slips goes on linearly. One that stuck, or turned, would with its whole friction have gone on
    past zero; how far, is told by its own collision matrix.
    """
    k = manifolds.matrix[m, p]
    s1, s2 = manifolds.slip[m, p, 0], manifolds.slip[m, p, 1]
    size = math.sqrt(s1 * s1 + s2 * s2)
    d1, d2 = s1 / size, s2 / size
    softness = k[0] * d1 * d1 + 2.0 * k[1] * d1 * d2 + k[3] * d2 * d2
    t1, t2 = manifolds.impulse[m, p, 0], manifolds.impulse[m, p, 1]
    whole = manifolds.friction[m] * manifolds.impulse[m, p, 2]
    along = u[0] * d1 + u[1] * d2
    if along <= AT_END * manifolds.speed[m, p]:  # it stuck or turned: in the old direction it would have gone on
        return along - (whole + t1 * d1 + t2 * d2) * softness
    return math.sqrt(u[0] * u[0] + u[1] * u[1]) - (whole - math.sqrt(t1 * t1 + t2 * t2)) * softness


@inner_kernel
def stuck(manifolds: Manifolds, m: int, p: int) -> bool:
    """Whether point p stuck in the sub-step before: it slips because its levers have turned, and ends no slide."""
    f1, f2, pressed = manifolds.force[m, p, 0], manifolds.force[m, p, 1], manifolds.force[m, p, 2]
    limit = STUCK * manifolds.friction[m] * pressed
    return bool(manifolds.lasts[m, p] and f1 * f1 + f2 * f2 < limit * limit)


@inner_kernel
def slip_end(bodies: Bodies, manifolds: Manifolds, options: Options, length: float) -> float:
    """First time at which a slide of the solved sub-step comes to its end, inf if none does (E34)."""
    first = math.inf
    for m in range(len(manifolds)):
        if manifolds.friction[m] == 0.0:
            continue
        v, w = relative_twist(bodies.twist, manifolds, m, options.rotation)
        for p in range(manifolds.points[m]):
            slip = math.sqrt(manifolds.slip[m, p, 0] ** 2 + manifolds.slip[m, p, 1] ** 2)
            if manifolds.impulse[m, p, 2] <= 0.0 or slip <= NOISE * manifolds.speed[m, p] or stuck(manifolds, m, p):
                continue
            rest = slip_left(manifolds, m, p, velocity_at(v, w, manifolds, m, p))
            lost = slip - rest
            if abs(rest) <= AT_END * manifolds.speed[m, p]:
                first = min(first, length)
            elif lost > 0.0:
                end = length * (slip / lost)
                if slip * end > gap_noise(bodies, manifolds, m, p):  # else it ends at once: what stuck has turned
                    first = min(first, end)
    return first


@spliced_kernel
def press_until_stick(
    bodies: Bodies,
    manifolds: Manifolds,
    problem: Problem,
    sub_step: SubStep,
    options: Options,
    tally: Array,
    left: float,
    struck: bool,
) -> float:
    """Solve the sub-step up to the first end of a slide, or the whole of what is left; return its length.

    Where rows turn the frozen solve is not what counts, and the first one is enough; where they do at the velocities of
    the start alone there is none, but for rebounds whose series may end.
    """
    if len(manifolds) == 0:
        copy_vectors(bodies.first, bodies.twist)
        accelerate(bodies, left)
        copy_vectors(bodies.twist, bodies.start)
        return left
    if not (struck and options.restitution) and sub_step.clock[BRIEF] == 0.0:
        begin_press(bodies, manifolds, options, left, left, struck)
        copy_vectors(bodies.first, bodies.last)
        if not is_exact(bodies, manifolds, sub_step, left):
            copy_vectors(bodies.twist, bodies.start)
            return left
    residual, unconverged = tally[RESIDUAL], tally[UNCONVERGED]
    press(bodies, manifolds, problem, options, tally, left, left, struck)
    length, slipped = left, 0.0
    for k in range(STICK_SOLVES if options.friction and sub_step.clock[BRIEF] == 0.0 else 0):
        end = slip_end(bodies, manifolds, options, length)
        if end >= left * (1.0 - SAME_TIME) or abs(end - length) <= SAME_TIME * length:
            break
        if k == 0:
            copy_vectors(bodies.twist, bodies.last)
            if sub_step.clock[BRIEF] == 0.0 and not is_exact(bodies, manifolds, sub_step, length):
                break
        if end < length and length - slipped <= CLOSE * length:
            break
        slipped = max(slipped, length) if end > length else slipped
        # What a point that stuck tells of its end ignores its neighbours; what one that slips tells is exact.
        length = end if end > length else SHORTER * end
        tally[RESIDUAL], tally[UNCONVERGED] = residual, unconverged  # of the solve that is used, as in the plane
        press(bodies, manifolds, problem, options, tally, length, left, struck)
    return length
