"""Newton's step of a column of upright boxes as a compiled loop, in the numbers that its arrays are of.

Nothing turns or slips there: the four corners of a face ask for the same, and one height says where a box is.
`adapters.newton.column` says which scenes are columns and lays the arrays out; formulas are those of `recurrence`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from adapters.compiled import kernel

Numbers = np.ndarray[Any, np.dtype[Any]]


class Boxes(NamedTuple):
    """Heights and speeds of the floor (0, which nothing moves) and the boxes on it, from below."""

    place: Numbers
    speed: Numbers
    lightness: Numbers
    #: Half its height.
    half: Numbers
    #: What gravity and loads do to it [m/s^2].
    pull: Numbers
    #: What one corner feels of the face below a box: inverse masses and levers of both.
    felt: Numbers
    #: Room: faces in axes of the boxes below and above them, whether they are within reach, what is asked for.
    under: Numbers
    over: Numbers
    near: Numbers
    load: Numbers
    push: Numbers
    many: Numbers


class ColumnSettings(NamedTuple):
    """Constants in the kind of all numbers, and counts."""

    dt: Numbers
    relaxation: Numbers
    reach: Numbers
    #: Square of the speed that is stopped.
    stopped: Numbers
    #: Share of its place by which the two sides of a face are seen apart.
    blur: Numbers
    #: 0, 1/2, 1, and 4, the corners of a face.
    plain: Numbers
    iterations: int
    weighted: int


class ColumnTold(NamedTuple):
    """What is kept of each step: heights, speeds, impulses of faces and whether they were pressed."""

    place: Numbers
    speed: Numbers
    impulse: Numbers
    pressed: Numbers


@kernel
def run_column(boxes: Boxes, chosen: ColumnSettings, told: ColumnTold) -> None:
    """Make all steps that ``told`` has place for."""
    dt, share, stopped = chosen.dt[0], chosen.relaxation[0] / chosen.dt[0], chosen.stopped[0]
    zero, half, one, corners = chosen.plain[0], chosen.plain[1], chosen.plain[2], chosen.plain[3]
    x, v, most = boxes.place, boxes.speed, len(boxes.place)
    for step in range(len(told.place)):
        for i in range(1, most):
            low = x[i] - boxes.half[i]
            height = low - (x[i - 1] + boxes.half[i - 1])
            middle = low - half * height
            boxes.under[i] = middle - half * height - x[i - 1]
            boxes.over[i] = middle + half * height - x[i]
            boxes.near[i] = one if height < chosen.reach[0] else zero
        for i in range(1, most):
            v[i] += dt * boxes.pull[i]
            x[i] += dt * v[i]
        idle = 0
        for _ in range(chosen.iterations):
            boxes.push[:], boxes.many[:], found = zero, zero, 0
            for i in range(1, most):
                boxes.load[i] = zero
                if boxes.near[i] == zero:
                    continue
                up = x[i] + boxes.over[i]
                depth = up - (x[i - 1] + boxes.under[i]) + abs(up) * chosen.blur[0]
                if not depth < zero:
                    continue
                found += 1
                boxes.load[i] = -depth * share / boxes.felt[i]
                boxes.push[i] += corners * boxes.load[i]
                boxes.push[i - 1] -= corners * boxes.load[i]
                boxes.many[i] += corners
                boxes.many[i - 1] += corners
            for i in range(1, most):
                if boxes.load[i] == zero:
                    continue
                # Told is the mean over the numbers of contacts of both; of what stands on the floor, its own.
                many = boxes.many[i] if i == 1 else half * (boxes.many[i] + boxes.many[i - 1])
                told.pressed[step, i] = 1
                told.impulse[step, i] += corners * boxes.load[i] / (many if chosen.weighted else one)
            for i in range(1, most):
                many = boxes.many[i] if chosen.weighted and boxes.many[i] > one else one
                change = boxes.push[i] * boxes.lightness[i] / many
                x[i] += dt * change
                v[i] += change
                if v[i] * v[i] < stopped:
                    v[i] = zero
            idle = 0 if found else idle + 1
            if idle == 2:  # nothing that a sweep looks at has changed
                break
        for i in range(1, most):
            told.place[step, i], told.speed[step, i] = x[i], v[i]
