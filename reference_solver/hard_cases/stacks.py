"""Stacks: heavy on light, and an overhang at its limit."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from reference_solver.hard_cases.case import HardCase, Run, Verdict, diverged, within
from reference_solver.hard_cases.parts import DOWN, DT, FLOOR, GRAVITY, box
from reference_solver.model import Body, Box, Model
from reference_solver.settings import Settings


def heavy_on_light(ratio: float, limit: float) -> HardCase:
    """A box of ``ratio`` kg on one of 1 kg: the floor carries (1 + ratio) g, the boxes' contact ratio g.

    ``limit`` is the largest relative error: the problem's condition is the ratio.
    """

    def model() -> Model:
        return Model(2, [FLOOR, box(0.0, 0.5), box(0.0, 1.5, mass=ratio)], DOWN, 0.0, 0.5)

    def judge(run: Run) -> Verdict:
        last = len(run.record.t) - 1
        floor = run.impulse(last, 0, 1)[1] / ((1.0 + ratio) * GRAVITY * run.settings.dt) - 1.0
        between = run.impulse(last, 1, 2)[1] / (ratio * GRAVITY * run.settings.dt) - 1.0
        error = max(abs(floor), abs(between))
        return within({"impulses, relative error": limit}, {"impulses, relative error": error}, "weights carried")

    return HardCase(
        f"heavy on light, {ratio:g}",
        "Sweeps need as many rounds as the masses' ratio; the light box between is crushed or shot out",
        model,
        Settings.reference(DT),
        10 * DT,
        judge,
    )


#: Blocks of the overhang, and their length and height [m].
BLOCKS, LENGTH, HEIGHT = 4, 1.0, 0.1


def overhang_blocks(shift: float) -> list[Body]:
    """Table and blocks whose overhangs are L/2k - 1e-7 L, k from the top; the lowest one L/2n + shift L (E53)."""
    table = Body(Box((1.0, 0.5)), pose=(-1.0, -0.5, 0.0), motion="fixed")
    right, blocks = 0.0, []
    for k in range(BLOCKS, 0, -1):
        right += LENGTH / (2 * k) + LENGTH * (shift if k == BLOCKS else -1e-7)
        place = (right - 0.5 * LENGTH, (BLOCKS - k + 0.5) * HEIGHT)
        blocks.append(box(*place, (0.5 * LENGTH, 0.5 * HEIGHT)))
    return [table, *blocks]


def overhang(shift: float) -> HardCase:
    """Harmonic stack at the edge of a table, ``shift`` lengths beyond its limit."""

    def model() -> Model:
        return Model(2, overhang_blocks(shift), DOWN, 0.0, 0.8)

    return HardCase(
        f"overhang, limit {shift:+.0e} L",
        "A few millionths of a length decide between standing and falling; slop and unfinished solves decide wrongly",
        model,
        Settings.reference(DT),
        1.0,
        stands_or_falls(lambda run: float(np.abs(run.record.pose[-1, 1:, 2]).max()), 1e-9, 1e-5, "largest tilt [rad]"),
        {"falls": float(shift > 0.0)},
        stride=24,
    )


def stands_or_falls(
    measure: Callable[[Run], float], standing: float, falling: float, quantity: str
) -> Callable[[Run], Verdict]:
    """Return a judge: stands at most ``standing``, falls from ``falling``, anything between is no answer."""

    def judge(run: Run) -> Verdict:
        moved = measure(run)
        if standing < moved < falling:
            return diverged(f"creeps: {quantity} {moved:.2g} is neither rest nor fall")
        falls = moved >= falling
        return Verdict(True, {"falls": float(falls), quantity: moved}, "falls" if falls else "stands")

    return judge
