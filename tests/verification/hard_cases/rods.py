"""A rod that rocks across another without slip."""

from __future__ import annotations

import math

import numpy as np

from reference_solver.model import Body, Capsule, Model
from reference_solver.settings import Settings
from tests.verification.hard_cases.case import HardCase, Run, Verdict, within
from tests.verification.hard_cases.parts import DT, GRAVITY

#: Radius of the fixed capsule, radius and half length of the one across it [m].
LOG, ROD, REACH = 0.5, 0.1, 1.0
#: Spin at the start [rad/s].
ROCK = 1.0
#: Error of the fifth-order scheme over the run, and a hundredfold of it for other machines: metres, share of energy.
CROSSED = 1e-9


def crossed_capsules(dt: float = DT) -> HardCase:
    """A capsule rocks across a fixed one without slip: its line of contact rolls, and the normal turns with both.

    Turned by q it touches where the fixed one looks at q, and its own middle is LOG q from there: where it is follows
    from its angle alone, and its energy stays what it was.
    """
    inertia = (REACH**2 + ROD**2) / 3.0

    def model() -> Model:
        upright = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
        log = Body(Capsule(REACH, LOG), motion="fixed", pose=(0.0, 0.0, 0.0, *upright))
        start = (0.0, 0.0, LOG + ROD, 1.0, 0.0, 0.0, 0.0)
        # turned from x towards z is turned about -y; the point that touches is at rest
        twist = (-ROD * ROCK, 0.0, 0.0, 0.0, -ROCK, 0.0)
        rod = Body(Capsule(REACH, ROD), 1.0, (0.5 * ROD**2, inertia, inertia), start, twist)
        return Model(3, [log, rod], (0.0, 0.0, -GRAVITY), 0.0, 5.0)

    def judge(run: Run) -> Verdict:
        pose, twist = run.record.pose[:, 1], run.record.twist[:, 1]
        angle = -2.0 * np.arctan2(pose[:, 5], pose[:, 3])
        along, above = LOG * angle, LOG + ROD
        x = along * np.cos(angle) - above * np.sin(angle)
        z = along * np.sin(angle) + above * np.cos(angle)
        off = np.hypot(pose[:, 0] - x, pose[:, 2] - z)
        energy = 0.5 * (twist[:, :3] ** 2).sum(axis=1) + 0.5 * inertia * twist[:, 4] ** 2
        energy += GRAVITY * (pose[:, 2] - above)
        given = 0.5 * (ROD**2 + inertia) * ROCK**2
        answer = {
            "off its path [m]": float(off.max()),
            "energy, share of the start's": float(np.abs(energy / given - 1.0).max()),
            "swings": float(np.count_nonzero(np.diff(np.sign(angle[1:])))),
        }
        return within(dict.fromkeys(list(answer)[:2], CROSSED), answer, "where it is follows from its angle; energy")

    return HardCase(
        "capsule rocking across a capsule",
        "Lines that cross touch in a point that moves on both: rows frozen over a step gain energy without end",
        model,
        Settings.reference(dt),
        2.0,
        judge,
        excused=("gain",),  # the judge measures energy itself, with the moments of space
    )
