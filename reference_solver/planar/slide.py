"""The instant inside a force phase at which a slide ends (E23)."""

from __future__ import annotations

import math

from reference_solver.compilation import inner_kernel
from reference_solver.direct.problem import Problem
from reference_solver.model import Array
from reference_solver.planar.columns import FRICTION, PN, PT, SLIP, SPEED, TANGENT_MASS
from reference_solver.planar.curve import turns
from reference_solver.planar.flight import begin_flight
from reference_solver.planar.impact import gap_noise
from reference_solver.planar.kinematics import tangent_velocity
from reference_solver.planar.press import press
from reference_solver.planar.state import CONTACTS, Bodies, Rows, SubStep
from reference_solver.stepping.accounting import go_back
from reference_solver.stepping.clock import BRIEF, HELD
from reference_solver.stepping.noise import NOISE
from reference_solver.stepping.options import Options
from reference_solver.stepping.slides import CLOSE, SAME_TIME, SHORTER, STICK_SOLVES


@inner_kernel
def slip_end(bodies: Bodies, rows: Rows, length: float) -> float:
    """First time at which a slide of the solved sub-step comes to its end, inf if none does (E23).

    A row that still slips the same way goes on linearly. One that stuck or turned would, with its whole friction,
    have gone on past zero; how far, is told by its own effective mass.
    """
    first = math.inf
    for c in range(rows.counts[CONTACTS]):
        slip, pressed = rows.real[c, SLIP], rows.real[c, PN]
        if pressed <= 0.0 or rows.real[c, FRICTION] == 0.0 or abs(slip) <= NOISE * rows.real[c, SPEED]:
            continue
        whole = -math.copysign(rows.real[c, FRICTION] * pressed, slip)
        after = tangent_velocity(bodies.twist, rows, c) + (whole - rows.real[c, PT]) / rows.real[c, TANGENT_MASS]
        lost = slip - after
        if abs(after) <= NOISE * rows.real[c, SPEED]:
            first = min(first, length)
        elif lost * slip > 0.0:
            end = length * (slip / lost)
            if abs(slip) * end > gap_noise(bodies, rows, c):  # else it ends at once: a sticking contact that turned
                first = min(first, end)
    return first


@inner_kernel
def press_until_stick(
    bodies: Bodies,
    rows: Rows,
    problem: Problem,
    sub: SubStep,
    options: Options,
    tally: Array,
    left: float,
) -> float:
    """Solve the sub-step up to the first end of a slide, or the whole of what is left; return its length.

    Where rows turn the frozen solve is not what counts, and the first one is enough.
    """
    press(bodies, rows, problem, sub, options, tally, left)
    if not options.friction or sub.clock[HELD] > 0.0 or sub.clock[BRIEF] > 0.0:
        return left
    length, slipped = left, 0.0
    for k in range(STICK_SOLVES):
        end = slip_end(bodies, rows, length)
        if end >= left * (1.0 - SAME_TIME) or abs(end - length) <= SAME_TIME * length:
            break
        if k == 0:
            begin_flight(bodies, rows, sub, length)
            if turns(bodies, rows, sub, length, options.dt):
                break
        if end < length and length - slipped <= CLOSE * length:
            break
        slipped = max(slipped, length) if end > length else slipped
        # What a row that stuck tells of its end ignores its neighbours; what one that slips tells is exact.
        length = end if end > length else SHORTER * end
        go_back(tally, sub.struck)
        press(bodies, rows, problem, sub, options, tally, length)
    return length
