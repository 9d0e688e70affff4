"""Newton's step of a column of upright boxes as a compiled loop, in the precision of its arrays.

There is no rotation or slip: the four corners of a face have equal corrections, and a box has one coordinate.
`adapters.newton.column` selects the scenes and prepares the arrays; formulas are those of `recurrence`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from adapters.law.compiled import kernel

Numbers = np.ndarray[Any, np.dtype[Any]]


class Boxes(NamedTuple):
    """Heights and speeds of the floor (index 0, fixed) and the boxes on it, from below."""

    place: Numbers
    speed: Numbers
    lightness: Numbers
    #: Half its height.
    half: Numbers
    #: Acceleration by gravity and loads [m/s^2].
    pull: Numbers
    #: Inverse mass at a corner of the face below a box: from inverse masses and lever arms of both.
    felt: Numbers
    #: Work arrays: faces in axes of the boxes below and above them, whether they are in range, corrections.
    under: Numbers
    over: Numbers
    near: Numbers
    load: Numbers
    push: Numbers
    many: Numbers


class ColumnSettings(NamedTuple):
    """Constants in the precision of all numbers, and counts."""

    dt: Numbers
    relaxation: Numbers
    reach: Numbers
    #: Square of the speed below which bodies stop.
    stopped: Numbers
    #: Perturbation of the gap of a face, as a share of its place.
    blur: Numbers
    #: 0, 1/2, 1, and 4, the corners of a face.
    plain: Numbers
    iterations: int
    weighted: int


class ColumnTold(NamedTuple):
    """Records of each step: heights, speeds, impulses of faces and whether they pressed."""

    place: Numbers
    speed: Numbers
    impulse: Numbers
    pressed: Numbers


@kernel
def run_column(boxes: Boxes, chosen: ColumnSettings, told: ColumnTold) -> None:
    """Make all steps that ``told`` can record."""
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
                # Recorded is the mean over the contact counts of both bodies; at the floor, the box's own.
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
            if idle == 2:  # no input of an iteration has changed
                break
        for i in range(1, most):
            told.place[step, i], told.speed[step, i] = x[i], v[i]
