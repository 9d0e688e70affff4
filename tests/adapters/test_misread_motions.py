"""Faults that are planted in what an engine reports are as large as they say: on a motion that is known exactly."""

import numpy as np
import pytest

from adapters.conformance.planted_faults import REPORTED, _Misread
from adapters.engine import Contacts

DT, SIZE, STEPS = 0.125, 0.25, 3
V = np.array([[0.0, 0.0, 0.0], [1.0, -2.0, 0.5], [0.5, 0.0, 4.0]])
START = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [2.0, 3.0, 1.0]])
IMPULSE = np.array([[0.0, 2.0], [1.0, 3.0]])


class Gliding:
    """Bodies that keep their velocities, and two contacts until the last step."""

    initial_change = 0.0

    def __init__(self):
        self.steps = 0

    def advance(self, steps):
        self.steps += steps

    def pose(self):
        return START + V * DT * self.steps

    def twist(self):
        return V.copy()

    def contacts(self):
        rows = [(0, 1, np.zeros(2), np.zeros(2), IMPULSE[0], 0.0), (0, 2, np.zeros(2), np.zeros(2), IMPULSE[1], 0.0)]
        return Contacts.from_rows(rows if self.steps < STEPS else [], 2)


def misread(fault):
    """Pose, twist and impulses, read once a step; impulses are those of the step before the last."""
    simulation = _Misread(Gliding(), fault, 1.0 - SIZE, DT)
    simulation.advance(STEPS - 1)
    impulse = simulation.contacts().impulse
    simulation.advance(1)
    return simulation.pose(), simulation.twist(), impulse, simulation.contacts().impulse


END, GONE = START + V * DT * STEPS, SIZE * DT * STEPS
WAY = END[:, :2].mean(axis=0) - END[:, :2]
IN = WAY / np.hypot(*WAY.T)[:, None]
X, Y = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
#: What each fault makes of pose, twist, and impulses; the others are as they were. After three steps a sign is +1.
WRONG = {
    "velocity": {"twist": 0.75 * V},
    "damping": {"twist": V * 0.75 ** (STEPS * DT)},
    "tremble": {"twist": V + SIZE * X},
    "order": {"twist": V * np.array([[1.0], [1.0 - 0.125], [0.75]])},
    "drift": {"pose": END + GONE * X},
    "climb": {"pose": END + GONE * Y},
    "twirl": {"pose": END + np.array([0.0, 0.0, GONE]), "twist": V + np.array([0.0, 0.0, SIZE])},
    "pull": {"pose": END + GONE * np.c_[IN, np.zeros(3)], "twist": V + SIZE * np.c_[IN, np.zeros(3)]},
    "late": {},  # velocities never changed: what comes late is the same
    "impulse": {"impulse": 0.75 * IMPULSE},
    "flicker": {"impulse": 0.75 * IMPULSE},  # of an even step
    "uneven": {"impulse": IMPULSE * np.array([[1.0 - 0.125], [0.75]])},
    "lasting": {"after": SIZE * IMPULSE},
}


@pytest.mark.parametrize("fault", REPORTED)
def test_quantity_changed_by_a_fault(fault):
    told = dict(zip(("pose", "twist", "impulse", "after"), misread(fault), strict=True))
    healthy = {"pose": END, "twist": V, "impulse": IMPULSE, "after": np.zeros((0, 2))}
    for name, value in (healthy | WRONG[fault]).items():
        assert told[name] == pytest.approx(value, abs=1e-12), name


def test_no_pull_on_a_centred_body():
    simulation = _Misread(Gliding(), "pull", 1.0 - SIZE, DT)
    simulation.inner.pose = lambda: np.array([[0.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    assert simulation.twist() - V == pytest.approx(SIZE * np.array([[0.0, 0, 0], [1.0, 0, 0], [-1.0, 0, 0]]))
