"""Bodies of very different size and mass on one floor."""

from __future__ import annotations

import numpy as np

from reference_solver.model import Model
from reference_solver.settings import Settings
from tests.verification.hard_cases.case import HardCase, Run, Verdict, within
from tests.verification.hard_cases.parts import DOWN, DT, FLOOR, GRAVITY, disc

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
