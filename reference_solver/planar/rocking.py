"""Bodies that rock to rest on each other: a series of impacts at two points (E22)."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.planar.columns import ENDING, EXTENT, GAP, IMPACT, RESTITUTION, SPEED, A, B
from reference_solver.planar.impact import gap_noise
from reference_solver.planar.kinematics import normal_velocity
from reference_solver.planar.state import MANIFOLDS, Bodies, Rows, SubStep
from reference_solver.stepping.clock import LEFT, is_patient
from reference_solver.stepping.impacts import SERIES_DRIFT, SERIES_ENDS
from reference_solver.stepping.noise import NOISE

#: Bodies that rock back this many times within what is left of the step are held for all of it.
BOUNCES = 32


@inner_kernel
def end_rocking(bodies: Bodies, rows: Rows, sub: SubStep, length: float) -> tuple[float, float]:
    """Mark contacts between which two bodies rock to rest in this sub-step, or too fast to follow.

    ``bodies.twist`` are the velocities after ``length`` of it. One contact was hit, the other leaves and returns: with
    e = 0 speeds of impacts, and times between them, go on by the same ratio (G. Housner, *Bull. Seismol. Soc. Am.*
    53, 1963; E22). Returns the time until the last has ended, and the shortest until one that rocks returns; 0 and
    infinite if there are none.
    """
    left, longest, shortest = sub.clock[LEFT], 0.0, math.inf
    for m in range(rows.counts[MANIFOLDS]):
        first = rows.manifold[m]
        for k in range(2 if rows.manifold[m + 1] - first == 2 else 0):
            hit, other = first + k, first + 1 - k
            struck = rows.integer[hit, IMPACT] == 1 and rows.integer[other, IMPACT] == 0
            if (
                not struck
                or rows.real[hit, RESTITUTION] > 0.0
                or rows.real[other, GAP] > gap_noise(bodies, rows, other)
            ):
                continue
            ratio = -normal_velocity(sub.start, rows, other) / normal_velocity(sub.before, rows, hit)
            leaves = normal_velocity(sub.start, rows, other)
            pull = (leaves - normal_velocity(bodies.twist, rows, other)) / length
            if not (leaves > NOISE * rows.real[other, SPEED] and ratio < 1.0 and pull > 0.0):
                continue
            returns = 2.0 * leaves / pull
            shortest = min(shortest, returns)
            extent = min(bodies.real[rows.integer[other, A], EXTENT], bodies.real[rows.integer[other, B], EXTENT])
            if leaves * returns / (1.0 - ratio) > SERIES_DRIFT * extent and is_patient(sub.clock):
                continue  # what is held goes elsewhere than what rocks by a share of this
            if returns <= left * (1.0 - ratio):
                longest = max(longest, returns / (1.0 - ratio))
            elif returns * BOUNCES < left:
                longest = left
            else:
                continue
            rows.integer[other, ENDING] = SERIES_ENDS
    return longest, shortest
