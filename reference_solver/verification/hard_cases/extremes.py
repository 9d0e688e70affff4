"""Extremes: bodies that start inside each other, thin walls, far from the origin, very small beside very large."""

from __future__ import annotations

import math

import numpy as np

from reference_solver.model import Body, Box, Model
from reference_solver.settings import Settings
from reference_solver.verification.hard_cases.case import HardCase, Run, Verdict, diverged, energy, within
from reference_solver.verification.hard_cases.parts import DOWN, DT, FLOOR, GRAVITY, box, disc


def deep_overlap(share: float) -> HardCase:
    """Two boxes at rest, ``share`` of a box's height inside each other, no gravity."""

    def model() -> Model:
        return Model(2, [box(0.0, 0.0), box(0.0, 1.0 - share)], (0.0, 0.0), 0.0, 0.5)

    def judge(run: Run) -> Verdict:
        kinetic = float(energy(run.model, run.record.pose, run.record.twist).max())
        # what an overlap turned into speed within one step would give: m_eff (delta / dt)^2 / 2
        yielded = kinetic / (0.5 * 0.5 * (share / run.settings.dt) ** 2)
        left = 1.0 - float(run.record.pose[-1, 1, 1] - run.record.pose[-1, 0, 1])
        answer = {"kinetic energy, of m_eff (delta/dt)^2/2": yielded, "overlap left [m]": max(left, 0.0)}
        limits = {"kinetic energy, of m_eff (delta/dt)^2/2": 1e-15, "overlap left [m]": 1e-12}
        return within(limits, answer, "no speed from overlap; apart by position alone")

    return HardCase(
        f"deep overlap, {100.0 * share:.0f} %",
        "Overlap that is corrected through velocities flies apart as from an explosion",
        model,
        Settings.reference(DT),
        20 * DT,
        judge,
        excused=("penetration", "start_overlap"),
    )


#: Thickness of the thin wall [m], half width of what is shot at it [m], restitution.
WALL, SHOT, REBOUND = 1e-3, 0.5, 0.5


def thin_wall(lengths: float) -> HardCase:
    """Disc shot at a wall of a thousandth of its size with ``lengths`` of its own diameters per second."""
    speed = 2.0 * SHOT * lengths

    def model() -> Model:
        wall = Body(Box((0.5 * WALL, 10.0)), motion="fixed")
        # in front of the wall by a third of what it flies in a step: neither end of a step is near it
        x = -0.5 * WALL - SHOT - speed * DT / 3.0
        return Model(2, [wall, disc(x, 0.25, SHOT, twist=(speed, 0.0, 0.0))], (0.0, 0.0), REBOUND, 0.0)

    def judge(run: Run) -> Verdict:
        if run.record.pose[-1, 1, 0] > 0.0:
            return diverged(f"passed the wall and left it with {run.record.twist[-1, 1, 0]:.6g} m/s")
        off = float(run.record.twist[-1, 1, 0]) / (-REBOUND * speed) - 1.0
        answer = {"speed of rebound, relative error": abs(off)}
        return within({"speed of rebound, relative error": 1e-14}, answer, "never passed; v = -e v0")

    return HardCase(
        f"thin wall, {lengths:g} lengths/s",
        "Between two steps a fast body is first before the wall and then behind it",
        model,
        Settings.reference(DT),
        3 * DT,
        judge,
    )


def far_origin(distance: float) -> HardCase:
    """Column of five boxes and a ball that lands, ``distance`` away from the origin."""

    def model() -> Model:
        column = [box(distance, 0.5 + i) for i in range(5)]
        return Model(2, [FLOOR, *column, disc(distance + 4.0, 0.5, twist=(0.0, -1.0, 0.0))], DOWN, 0.0, 0.5)

    def judge(run: Run) -> Verdict:
        moved = np.abs(run.record.pose[-1, 1:6] - run.record.pose[0, 1:6])
        loads = [run.impulse(-1, i, i + 1)[1] / ((5 - i) * GRAVITY * run.settings.dt) for i in range(5)]
        answer = {
            "drift [m]": float(moved.max()),
            "impulses, relative error": max(abs(load - 1.0) for load in loads),
        }
        limits = {"drift [m]": math.ulp(distance), "impulses, relative error": 1e-10}
        return within(limits, answer, f"coordinates are known to {math.ulp(distance):.1e} m there")

    return HardCase(
        f"{distance:g} m from the origin",
        "Differences of large coordinates lose the digits that contacts are made of",
        model,
        Settings.reference(DT),
        1.0,
        judge,
        stride=240,
    )


#: Radii [m] and masses [kg] that share a scene, smallest to largest.
SIZES = (1e-4, 1e-2, 1.0, 1e2, 1e4)
MASSES = (1e-9, 1e-4, 1.0, 1e4, 1e9)


def many_sizes() -> HardCase:
    """Discs of very different size and mass side by side on one floor; each carries only itself."""

    def model() -> Model:
        # so far apart that a neighbour's flank is higher than the smaller disc
        places = [0.0, 10.0, 30.0, 300.0, 30_000.0]
        discs = [disc(x, r, r, m) for x, r, m in zip(places, SIZES, MASSES, strict=True)]
        return Model(2, [FLOOR, *discs], DOWN, 0.0, 0.5)

    def judge(run: Run) -> Verdict:
        weights = [mass * GRAVITY * run.settings.dt for mass in MASSES]
        loads = [run.impulse(-1, 0, i + 1)[1] / weight - 1.0 for i, weight in enumerate(weights)]
        moved = np.abs(run.record.pose[-1, 1:, :2] - run.record.pose[0, 1:, :2]).max(axis=1) / SIZES
        answer = {"impulses, relative error": float(np.abs(loads).max()), "drift, of the radius": float(moved.max())}
        limits = {"impulses, relative error": 1e-12, "drift, of the radius": 1e-12}
        return within(limits, answer, "every disc against its own weight and size")

    return HardCase(
        "sizes 1e-4 to 1e4 m, masses 1e-9 to 1e9 kg",
        "A tolerance common to all bodies lets the small ones sink, and the large ones never converge",
        model,
        Settings.reference(DT),
        1.0,
        judge,
        stride=240,
    )
