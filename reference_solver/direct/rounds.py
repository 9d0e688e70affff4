"""Proximal rounds around Newton's method, with a stiffness that adapts (E42)."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.direct.newton import newton
from reference_solver.direct.ordering import order_bodies
from reference_solver.direct.pivoting import COVERINGS, find_by_pivots
from reference_solver.direct.problem import (
    CONTACTS,
    FACTORISATIONS,
    IMPULSE_SHARE,
    ROW_COUNT,
    VELOCITY_COUNT,
    Problem,
)

#: rho in units of 1 / k at first: each row is then a hundred times stiffer than the bodies are heavy.
FIRST_STIFFNESS = 100.0
#: Bounds of it. A round reduces the error by about stiffness times the smallest eigenvalue of W / k, which is the
#: inverse of the mass ratio in a column. The bound is for redundant contacts that round-off keeps from sticking all at
#: once: at a residual e they part with their share of the load within 1 / (e stiffness) rounds.
LEAST_STIFFNESS, LARGEST_STIFFNESS = 1.0, 1e14
#: The first stiffness is this over the residual where that is more: with a small one hardly a contact will change.
#: It is at most the second. Round-off of velocities (1e-16 of what they are measured against, 1e-15 in a sum) times 1e9
#: moves an impulse by a millionth of itself. Times 1e14 it opens and slides contacts at rest in each Newton step.
SETTLED, LARGEST_FIRST = 1.0, 1e9
#: Rounds go on below the tolerance while each leaves less than this of the residual: they cost one factorisation
#: each, and a mass ratio multiplies what a residual means for the impulses.
POLISH = 0.3
#: A round of one factorisation that leaves this much of the residual, or that much over it, has only moved load along
#: redundant contacts, at a pace the next rounds would keep: the next goes all the way to where a contact gives in.
STANDING = 0.9
#: One that multiplies the residual by this has brought its own round-off, which goes with the stiffness.
NOISY = 2.0
#: Where more than this times the tolerance is left of the residual, rounds have found no answer: what they end at is
#: below the tolerance. Planar problems are then solved by pivots (E45).
UNFOUND = 2.0
#: Friction within this share of its limit slides, or is about to: it does not end that way.
AT_LIMIT = 1e-9
#: What the stiffness grows by after a round, and falls by where Newton's method fails. After each failure it grows by
#: the root of what it did, so that it settles where rounds succeed.
GROWTH, LEAST_GROWTH, RETREAT = 10.0, 1.5, 0.1


@inner_kernel
def solve_problem(problem: Problem, tolerance: float, budget: int, fresh: bool) -> float:
    """Improve impulses and twists until the residual (E14) is at most `tolerance`; returns the best residual.

    `best` then holds the impulses that have it, those given if there are none better. At most `budget` factorisations,
    and a few more to finish a round. `fresh`: rounds start from zero impulses.
    """
    problem.size[FACTORISATIONS] = 0
    set_excess(problem)
    residual = best = scaled_map(problem)
    keep(problem)
    if not order_bodies(problem):
        return best
    if fresh:
        withdraw(problem)
        residual = scaled_map(problem)
    stiffness = max(FIRST_STIFFNESS, SETTLED / max(residual, SETTLED / LARGEST_FIRST))
    growth, standing = GROWTH, False
    while problem.size[FACTORISATIONS] < budget:
        spent = problem.size[FACTORISATIONS]
        if newton(problem, stiffness):
            before, settled = residual, problem.size[FACTORISATIONS] <= spent + 1
            times = reach(problem) if standing and settled else 1.0
            commit(problem, times)
            residual = scaled_map(problem)
            standing = settled and STANDING * before < residual < before / STANDING
            if settled and times == 1.0 and residual > NOISY * before:
                stiffness = max(RETREAT * stiffness, LEAST_STIFFNESS)
                growth = max(math.sqrt(growth), LEAST_GROWTH)
            else:
                stiffness = min(growth * stiffness, LARGEST_STIFFNESS)
        else:
            stiffness = max(RETREAT * stiffness, LEAST_STIFFNESS)
            growth = max(math.sqrt(growth), LEAST_GROWTH)
        if problem.size[FACTORISATIONS] == spent:
            problem.size[FACTORISATIONS] += 1
        finished = best <= tolerance and residual >= POLISH * best
        if residual < best:
            best = residual
            keep(problem)
        if finished:
            break
    for attempt in range(COVERINGS):
        if best <= UNFOUND * tolerance or problem.size[FACTORISATIONS] == 0:
            break
        withdraw(problem)
        if not find_by_pivots(problem, attempt):
            break
        commit(problem, 1.0)
        residual = scaled_map(problem)
        if residual < best:
            best = residual
            keep(problem)
    return best


@inner_kernel
def set_excess(problem: Problem) -> None:
    """Set u - b of all rows from the twists."""
    contact = problem.contact
    for c in range(problem.size[CONTACTS]):
        for r in range(problem.size[ROW_COUNT]):
            excess = -contact.target[c] if r == 0 else 0.0
            for k in range(problem.size[VELOCITY_COUNT]):
                at_a = contact.jacobian[c, 0, r, k] * problem.body.twist[contact.body[c, 0], k]
                excess += at_a + contact.jacobian[c, 1, r, k] * problem.body.twist[contact.body[c, 1], k]
            contact.excess[c, r] = excess


@inner_kernel
def withdraw(problem: Problem) -> None:
    """Take all impulses back."""
    contact = problem.contact
    for c in range(problem.size[CONTACTS]):
        for r in range(problem.size[ROW_COUNT]):
            contact.change[c, r] = -contact.impulse[c, r]
    commit(problem, 1.0)


@inner_kernel
def reach(problem: Problem) -> float:
    """How often the changes of the round can be added before a contact opens or begins to slide; at least once."""
    contact, least = problem.contact, math.inf
    for c in range(problem.size[CONTACTS]):
        p, change = contact.impulse[c], contact.change[c]
        if p[0] <= 0.0:
            continue
        if change[0] < 0.0:
            least = min(least, -p[0] / change[0])
        # |p_t + s c_t| = mu (p_n + s c_n): a s^2 + 2 b s + d = 0 with d < 0 inside the cone.
        mu = contact.friction[c]
        a, b, d = -((mu * change[0]) ** 2), -mu * mu * p[0] * change[0], -((mu * p[0]) ** 2)
        inside = (1.0 - AT_LIMIT) * d
        for r in range(1, problem.size[ROW_COUNT]):
            a += change[r] ** 2
            b += p[r] * change[r]
            d += p[r] ** 2
            inside += p[r] ** 2
        root = b * b - a * d
        if inside < 0.0 and root >= 0.0 and b + math.sqrt(root) > 0.0:
            least = min(least, -d / (b + math.sqrt(root)))
    return max(least, 1.0) if least < math.inf else 1.0


@inner_kernel
def commit(problem: Problem, times: float) -> None:
    """Add the changes of the round so often to the impulses, inside the cone to the last place, and to the twists."""
    contact = problem.contact
    rows = problem.size[ROW_COUNT]
    for c in range(problem.size[CONTACTS]):
        change, p = contact.change[c], contact.impulse[c]
        pressed, length = max(p[0] + times * change[0], 0.0), 0.0
        for r in range(1, rows):
            length += (p[r] + times * change[r]) ** 2
        length, bound = math.sqrt(length), contact.friction[c] * pressed
        for r in range(rows):
            new = p[r] + times * change[r] if r > 0 else pressed
            if r > 0 and length > bound:
                new *= bound / length
            for side in range(2):
                i = contact.body[c, side]
                for k in range(problem.size[VELOCITY_COUNT]):
                    problem.body.twist[i, k] += contact.response[c, side, r, k] * (new - p[r])
            p[r] = new
    set_excess(problem)


@inner_kernel
def keep(problem: Problem) -> None:
    """Note the present impulses as the best."""
    for c in range(problem.size[CONTACTS]):
        for r in range(problem.size[ROW_COUNT]):
            problem.contact.best[c, r] = problem.contact.impulse[c, r]


@inner_kernel
def scaled_map(problem: Problem) -> float:
    """The residual E14 of the problem's impulses."""
    contact, worst = problem.contact, 0.0
    for c in range(problem.size[CONTACTS]):
        pressed, kn, kt = contact.impulse[c, 0], contact.admittance[c, 0], contact.admittance[c, 1]
        defect = abs(pressed - max(pressed - contact.excess[c, 0] / kn, 0.0))
        floor = IMPULSE_SHARE * pressed
        worst = max(worst, ratio(defect, max(contact.speed[c] / kn, floor)))
        length, miss = 0.0, 0.0
        for r in range(1, problem.size[ROW_COUNT]):
            length += (contact.impulse[c, r] - contact.excess[c, r] / kt) ** 2
        length, bound = math.sqrt(length), contact.friction[c] * pressed
        part = bound / length if length > bound else 1.0
        for r in range(1, problem.size[ROW_COUNT]):
            moved = part * (contact.impulse[c, r] - contact.excess[c, r] / kt)
            miss += (contact.impulse[c, r] - moved) ** 2
        worst = max(worst, ratio(math.sqrt(miss), max(contact.speed[c] / kt, floor)))
    return worst


@inner_kernel
def ratio(defect: float, scale: float) -> float:
    """Defect over scale; where nothing acts any defect is a whole one."""
    if defect == 0.0:
        return 0.0
    return defect / scale if scale > 0.0 else 1.0
