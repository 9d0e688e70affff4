"""One block: rocking from corner to corner, and dropped on its edge while it spins."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from reference_solver.model import Array, Model
from reference_solver.settings import Settings
from reference_solver.verification.event_driven import EventDriven
from reference_solver.verification.hard_cases.case import HardCase, Run, Verdict, diverged, energy, within
from reference_solver.verification.hard_cases.parts import DOWN, FLOOR, box

#: Half width and half height of the rocking block [m], and the share of its slenderness that it starts from.
ROCKING, SHARE = (0.2, 1.0), 0.5

#: What a turning contact, first order in the step, may miss at 0.1 ms: ratio at a change of corner, amplitudes after.
RATIO, AMPLITUDE = 1e-3, 1e-2


def slenderness() -> float:
    """Angle between the diagonal and the vertical, alpha [rad]: beyond it the block overturns."""
    return math.atan2(*ROCKING)


def housner_ratio() -> float:
    """Angular velocity after over before the block changes corners, 1 - 3/2 sin^2 alpha (E56)."""
    return 1.0 - 1.5 * math.sin(slenderness()) ** 2


def rocking(dt: float = 1e-4) -> HardCase:
    """Block released from a tilt, that neither slides nor bounces: each change of corner costs a fixed share."""
    alpha, reach = slenderness(), math.hypot(*ROCKING)

    def model() -> Model:
        lean = SHARE * alpha
        # rotated clockwise about its lower right corner, which stays at the origin
        centre = (-reach * math.sin(alpha - lean), reach * math.cos(alpha - lean))
        return Model(2, [FLOOR, box(*centre, ROCKING, angle=-lean)], DOWN, 0.0, 2.0)

    def judge(run: Run) -> Verdict:
        angle = run.record.pose[:, 1, 2]
        changes = np.flatnonzero(np.sign(angle[1:]) * np.sign(angle[:-1]) < 0)
        if len(changes) < 4:
            return diverged(f"{len(changes)} changes of corner where at least 4 were expected")
        # clear of the change by a step on either side: which step it falls into is the scheme's affair
        after = np.array([_speed_at_zero(angle[k + 2 : k + 6]) for k in changes])
        before = np.array([_speed_at_zero(angle[k - 4 : k]) for k in changes])
        ratios = after / before
        peaks = [float(np.abs(angle[a:b]).max()) for a, b in pairwise(changes)]
        expected = math.cos(alpha - SHARE * alpha) - math.cos(alpha)
        worst = 0.0
        for peak in peaks:
            expected *= housner_ratio() ** 2
            worst = max(worst, abs(peak / (alpha - math.acos(math.cos(alpha) + expected)) - 1.0))
        answer = {
            "ratio of angular velocities, error": float(np.abs(ratios - housner_ratio()).max()),
            "amplitudes, relative error": worst,
            "changes of corner": float(len(changes)),
        }
        limits = {"ratio of angular velocities, error": RATIO, "amplitudes, relative error": AMPLITUDE}
        return within(limits, answer, "Housner's ratio and the recursion of amplitudes")

    return HardCase(
        "rocking block",
        "The corner that lets go must not pull, the other must stop dead: any other impulse changes the decay",
        model,
        Settings.reference(dt),
        3.0,
        judge,
    )


def _speed_at_zero(angles: Array) -> float:
    """Angular velocity [rad/step] with which four successive angles, continued by their cubic, pass zero.

    Angles only: the velocities of a semi-implicit scheme belong to half a step earlier.
    """
    cubic = np.polynomial.Polynomial.fit(np.arange(4), angles, 3)
    # the change is two steps before or behind the samples
    near = min(np.real(cubic.roots()), key=lambda root: abs(root - 1.5))
    return float(cubic.deriv()(near))


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
