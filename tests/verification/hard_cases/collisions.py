"""Impacts of several bodies at once under both laws, and a pile that loses no energy."""

from __future__ import annotations

import math

import numpy as np

from reference_solver.model import Body, HalfSpace, Model
from reference_solver.settings import Settings
from tests.verification.event_driven.oracle import EventDriven, Law
from tests.verification.hard_cases.case import HardCase, Run, Verdict, energy, within
from tests.verification.hard_cases.parts import DOWN, DT, FLOOR, disc

#: Where three equal discs of radius 1/2 stand that touch, the first about to hit the others at (1, 0) m/s, e = 1.
PLACES = {
    "row": ((-1.0, 0.0), (0.0, 0.0), (1.0, 0.0)),
    "wedge": ((0.0, 0.0), (math.sqrt(0.75), 0.5), (math.sqrt(0.75), -0.5)),
}
#: Their speeds afterwards (E58) [m/s].
SPEEDS = {
    ("row", "N-SIM"): (1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0),
    ("row", "N-SEQ"): (0.0, 0.0, 1.0),
    ("wedge", "N-SIM"): (0.2, math.sqrt(0.48), math.sqrt(0.48)),
    ("wedge", "N-SEQ"): (0.25, math.sqrt(0.75), math.sqrt(0.1875)),
}


def simultaneous(places: str, law: Law) -> HardCase:
    """Return impacts at one instant, by the stepper (N-SIM) or by the event-driven oracle (N-SEQ)."""

    def model() -> Model:
        first, *others = PLACES[places]
        discs = [disc(*first, twist=(1.0, 0.0, 0.0)), *(disc(*place) for place in others)]
        return Model(2, discs, (0.0, 0.0), 1.0, 0.0)

    def judge(run: Run) -> Verdict:
        twist = run.record.twist[-1]
        if law == "N-SEQ":
            oracle = EventDriven(run.model, law)
            oracle.advance(until=float(run.record.t[-1]))
            twist = oracle.twist
        speeds = np.hypot(twist[:, 0], twist[:, 1])
        error = float(np.abs(speeds - SPEEDS[places, law]).max())
        names = ("first", "second", "third")
        answer = {f"{name} [m/s]": float(v) for name, v in zip(names, speeds, strict=True)}
        return within({"error [m/s]": 1e-12}, answer | {"error [m/s]": error}, f"law {law}")

    return HardCase(
        f"three discs, {places}, {law}",
        "Impacts at one instant have no truth but that of a declared law: all at once, or one after the other",
        model,
        Settings.reference(DT),
        DT,
        judge,
    )


def elastic_pile(count: int = 12) -> HardCase:
    """Discs of e = 1 let fall onto each other without friction: energy stays, places become chaotic."""

    def model() -> Model:
        walls = [wall(-0.7, 1.0), wall(3.5, -1.0)]
        discs = [disc((i % 3) * 1.1 + 0.07 * (i // 3), 0.6 + 1.2 * (i // 3)) for i in range(count)]
        return Model(2, [FLOOR, *walls, *discs], DOWN, 1.0, 0.0)

    def judge(run: Run) -> Verdict:
        total = energy(run.model, run.record.pose, run.record.twist)
        drift = float(np.abs(total - total[0]).max() / abs(total[0]))
        reason = "energy only: places are chaotic after some impacts and not certified"
        return within({"energy, relative drift": 1e-9}, {"energy, relative drift": drift}, reason)

    return HardCase(
        "pile with e = 1",
        "Simultaneous impacts and contacts at rest among them must neither gain nor lose energy",
        model,
        Settings.reference(DT),
        2.0,
        judge,
        stride=4,
    )


def wall(x: float, side: float) -> Body:
    """Return a fixed vertical wall at ``x`` [m], its free side to ``side`` = +-1."""
    return Body(HalfSpace((side, 0.0), side * x), motion="fixed")
