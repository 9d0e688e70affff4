"""Stacks: heavy on light, and an overhang at its limit."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from reference_solver.model import Body, Box, Model
from reference_solver.settings import Settings
from reference_solver.verification.hard_cases.case import HardCase, Run, Verdict, diverged, within
from reference_solver.verification.hard_cases.parts import DOWN, DT, FLOOR, GRAVITY, box


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


def overhang_tilt(shift: float, t: float) -> float:
    """Tilt [rad] after t [s] of a stack whose centre of mass is beyond the edge: (x/y)(cosh(lambda t) - 1) (E53)."""
    blocks = overhang_blocks(shift)[1:]
    x, y = (float(np.mean([block.pose[k] for block in blocks])) for k in range(2))
    each = HEIGHT**2 / 12.0 + LENGTH**2 / 12.0
    inertia = sum(each + block.pose[0] ** 2 + block.pose[1] ** 2 for block in blocks)  # of 1 kg each
    rate = math.sqrt(len(blocks) * GRAVITY * y / inertia)
    return x / y * (math.cosh(rate * t) - 1.0)


def overhang(shift: float) -> HardCase:
    """Harmonic stack at the edge of a table, ``shift`` lengths beyond its limit: if it falls, as one rigid body."""

    def model() -> Model:
        return Model(2, overhang_blocks(shift), DOWN, 0.0, 0.8)

    def judge(run: Run) -> Verdict:
        tilts = -run.record.pose[-1, 1:, 2]
        verdict = stands_or_falls(lambda run: float(np.abs(tilts).max()), 1e-9, 1e-5, "largest tilt [rad]")(run)
        if not verdict.answer.get("falls"):
            return verdict
        error = float(np.abs(tilts / overhang_tilt(shift, float(run.record.t[-1])) - 1.0).max())
        # semi-implicit turning about the edge is first order: lambda dt, 0.02 here
        return within({"tilt, relative error": 0.02}, verdict.answer | {"tilt, relative error": error}, "falls")

    return HardCase(
        f"overhang, limit {shift:+.0e} L",
        "A few millionths of a length decide between standing and falling; slop and unfinished solves decide wrongly",
        model,
        Settings.reference(DT),
        1.0,
        judge,
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
