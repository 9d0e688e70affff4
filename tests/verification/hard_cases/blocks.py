"""A box that is dropped on its corner while it spins."""

from __future__ import annotations

import math

import numpy as np

from reference_solver.model import Model
from reference_solver.settings import Settings
from tests.verification.event_driven.oracle import EventDriven
from tests.verification.hard_cases.case import HardCase, Run, Verdict, diverged, energy, within
from tests.verification.hard_cases.parts import DOWN, FLOOR, box


def edge_drop(spin: float = 100.0, dt: float = 1.0 / 240.0, height: float = 1.0) -> HardCase:
    """Box dropped on its corner, turning with ``spin`` [rad/s]; e = 0.5, mu = 0.3."""

    def model() -> Model:
        start = box(0.0, height + math.hypot(0.5, 0.5), angle=0.25 * math.pi, twist=(0.0, 0.0, spin))
        return Model(2, [FLOOR, start], DOWN, 0.5, 0.3)

    def judge(run: Run) -> Verdict:
        oracle = EventDriven(run.model)
        while not oracle.events:
            oracle.advance(oracle.next_event())
        first = oracle.events[0].t
        # the last sample before the box meets the floor again tells whether it met it at the right place and time
        after = math.floor(first / run.settings.dt) + 1
        oracle.advance(run.record.t[after])
        if len(oracle.events) > 1:
            return diverged("a second impact falls into the step of the first")
        reach = math.hypot(0.5, 0.5)
        off = np.abs(run.record.twist[after, 1] - oracle.twist[1]) * [1.0, 1.0, reach]
        speed = float(np.abs(oracle.twist[1] * [1.0, 1.0, reach]).max())
        total = energy(run.model, run.record.pose, run.record.twist)
        answer = {
            "velocity after the first impact, relative error": float(off.max()) / speed,
            "energy at the end over that at the start": float(total[-1] / total[0]),
        }
        limits = {"velocity after the first impact, relative error": 1e-9}
        return within(limits, answer, "event-driven oracle up to the second impact")

    return HardCase(
        f"box dropped on its edge at {spin:g} rad/s",
        "It turns by a quarter of a radian per step: which corner hits, when and how fast is decided inside a step",
        model,
        Settings.reference(dt),
        2.0,
        judge,
    )
