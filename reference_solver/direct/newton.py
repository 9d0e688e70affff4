"""Semismooth Newton method for the function F of the velocities of all bodies (E41).

    F(y) = y - M^-1 G' (Pi(z) - p),   z = p - rho (u - b + G y),   dF/dy = 1 + M^-1 G' DPi rho G

y is the change of the velocities from those that go with p, DPi the derivative of Pi. Whatever the number of contact
points, there are as many unknowns as velocities, so that redundant points make nothing singular (P. Alart, A. Curnier,
Comput. Methods Appl. Mech. Eng. 92, 1991). Everything is written as a change: near the solution it is small, and so is
its round-off.
"""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.direct.envelope import add, clear, factorise, substitute
from reference_solver.direct.problem import (
    CONTACTS,
    FACTORISATIONS,
    NODES,
    ROW_COUNT,
    VELOCITY_COUNT,
    Problem,
)

#: Newton steps of one round.
NEWTON_STEPS = 40
#: Halvings of a step that does not reduce F ...
HALVINGS = 5
#: ... by this share of what it would if F were linear.
DESCENT = 0.1
#: Where no part of a step reduces F, this share of the first F is good enough: the round has done its work.
ENOUGH = 1e-3
#: F is round-off when it is this small, for each body, relative to the terms it sums.
ROUND_OFF = 2e-16
#: The same in units of what the residual is measured against: together 1e-15 of it, a hundredth of the usual tolerance.
#: Contacts that are redundant have no answer to what is below.
FINE = 5.0


@inner_kernel
def newton(problem: Problem, stiffness: float) -> bool:
    """Find the root of F from y = 0; leaves Pi(z) - p in `change`. False: none found."""
    body = problem.body
    width = problem.size[VELOCITY_COUNT]
    for i in range(len(body)):
        for k in range(width):
            body.delta[i, k], body.step[i, k] = 0.0, 0.0
    miss, solved = evaluate(problem, stiffness, 0.0)
    first = miss
    for _ in range(NEWTON_STEPS):
        if solved:
            return True
        if not set_step(problem):
            return False
        before, best, part = miss, math.inf, 1.0
        for h in range(HALVINGS + 1):
            length = 0.5**h
            miss, solved = evaluate(problem, stiffness, length)
            if miss < best:
                best, part = miss, length
            if solved or miss <= (1.0 - DESCENT * length) ** 2 * before:
                break
        if best >= before:
            evaluate(problem, stiffness, 0.0)
            return before <= ENOUGH**2 * first
        if part != length:
            miss, solved = evaluate(problem, stiffness, part)
        for i in range(len(body)):
            for k in range(width):
                body.delta[i, k] = body.trial[i, k]
    return solved


@inner_kernel
def evaluate(problem: Problem, stiffness: float, length: float) -> tuple[float, bool]:
    """F at `delta` + length `step`, with impulses and slopes there; returns its square and whether it is round-off."""
    body, contact = problem.body, problem.contact
    rows, width = problem.size[ROW_COUNT], problem.size[VELOCITY_COUNT]
    for i in range(len(body)):
        for k in range(width):
            value = body.delta[i, k] + length * body.step[i, k]
            body.trial[i, k], body.miss[i, k], body.noise[i, k] = value, value, abs(value)
    for c in range(problem.size[CONTACTS]):
        project(problem, c, stiffness)
        for side in range(2):
            i = contact.body[c, side]
            for r in range(rows):
                for k in range(width):
                    body.miss[i, k] -= contact.response[c, side, r, k] * contact.change[c, r]
                    body.noise[i, k] += abs(contact.response[c, side, r, k]) * contact.terms[c, r]
    total, solved = 0.0, True
    for i in range(len(body)):
        miss, noise = 0.0, 0.0
        for k in range(width):
            miss += body.weight[i, k] * body.miss[i, k] ** 2
            noise += body.weight[i, k] * body.noise[i, k] ** 2
        total += miss
        solved = solved and miss <= ROUND_OFF * ROUND_OFF * noise
    return total, solved


@inner_kernel
def project(problem: Problem, c: int, stiffness: float) -> None:
    """Pi(z) - p of one contact at the velocities tried, the size of its terms, and the slope Pi' rho."""
    contact = problem.contact
    rows, width = problem.size[ROW_COUNT], problem.size[VELOCITY_COUNT]
    change, slope, terms, p = contact.change[c], contact.slope[c], contact.terms[c], contact.impulse[c]
    for r in range(rows):
        rho = stiffness / contact.admittance[c, min(r, 1)]
        excess, largest = contact.excess[c, r], abs(contact.excess[c, r])
        for side in range(2):
            i = contact.body[c, side]
            for k in range(width):
                part = contact.jacobian[c, side, r, k] * problem.body.trial[i, k]
                excess += part
                largest = max(largest, abs(part))
        change[r], terms[r] = (
            -rho * excess,
            rho * largest + abs(p[r]) + FINE * contact.speed[c] / contact.admittance[c, min(r, 1)],
        )
        for j in range(rows):
            slope[r, j] = 0.0
    pressed = p[0] + change[0]
    if pressed <= 0.0:
        for r in range(rows):
            change[r], terms[r] = -p[r], abs(p[r])
        return
    slope[0, 0] = stiffness / contact.admittance[c, 0]
    bound, length = contact.friction[c] * pressed, 0.0
    for r in range(1, rows):
        length += (p[r] + change[r]) ** 2
    length = math.sqrt(length)
    rho = stiffness / contact.admittance[c, 1]
    if length < bound:
        for r in range(1, rows):
            slope[r, r] = rho
        return
    part = bound / length if length > 0.0 else 0.0
    for r in range(1, rows):
        along = (p[r] + change[r]) / length if length > 0.0 else 0.0
        slope[r, 0] = contact.friction[c] * along * slope[0, 0]
        for j in range(1, rows):
            other = (p[j] + change[j]) / length if length > 0.0 else 0.0
            slope[r, j] = part * rho * ((1.0 if r == j else 0.0) - along * other)
    for r in range(1, rows):
        change[r] = part * (p[r] + change[r]) - p[r]


@inner_kernel
def set_step(problem: Problem) -> bool:
    """Newton's step from the point last evaluated; False if its matrix is singular."""
    body, width = problem.body, problem.size[VELOCITY_COUNT]
    clear(problem)
    for c in range(problem.size[CONTACTS]):
        if problem.contact.slope[c, 0, 0] > 0.0:
            add_contact(problem, c)
    for node in range(problem.size[NODES]):
        for k in range(width):
            problem.right[node * width + k] = -body.miss[body.queue[node], k]
    problem.size[FACTORISATIONS] += 1
    if not factorise(problem):
        return False
    substitute(problem)
    for node in range(problem.size[NODES]):
        for k in range(width):
            body.step[body.queue[node], k] = problem.right[node * width + k]
    return True


@inner_kernel
def add_contact(problem: Problem, c: int) -> None:
    """Add M^-1 G' DPi rho G of one contact to the matrix."""
    contact, slope = problem.contact, problem.contact.slope[c]
    rows, width = problem.size[ROW_COUNT], problem.size[VELOCITY_COUNT]
    for column in range(2):
        to = problem.body.node[contact.body[c, column]]
        if to < 0:
            continue
        for k in range(width):
            for r in range(rows):
                force = 0.0
                for j in range(rows):
                    force += slope[r, j] * contact.jacobian[c, column, j, k]
                if force == 0.0:
                    continue
                for line in range(2):
                    node = problem.body.node[contact.body[c, line]]
                    if node < 0:
                        continue
                    for i in range(width):
                        add(problem, node * width + i, to * width + k, contact.response[c, line, r, i] * force)
