"""The textbook's sweeps on tall stacks: what too few of them do, as a table (a picture's data, no verdict)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from reference_solver.hard_cases.parts import DOWN, FLOOR, GRAVITY, box
from reference_solver.model import Model
from reference_solver.settings import Settings
from reference_solver.simulation import Simulation

#: Boxes in the stack, and sweeps per step.
HEIGHTS = (1, 2, 5, 10, 20, 40)
SWEEPS = (1, 2, 4, 10, 20, 50, 100)


@dataclass(frozen=True)
class Starved:
    """A stack of unit boxes after some time at a number of sweeps per step.

    Parameters
    ----------
    height, sweeps
        Boxes, and sweeps per step.
    sunk
        What the top box has lost of its height [box heights].
    leaning
        Largest angle of a box [rad].
    load
        Largest error of an interface's impulse in the last step, of its exact value.
    stands
        Whether every box is still within half its width of its place.
    """

    height: int
    sweeps: int
    sunk: float
    leaning: float
    load: float
    stands: bool


def starved_stack(height: int, sweeps: int, dt: float = 1.0 / 60.0, duration: float = 4.0) -> Starved:
    """Let exactly placed boxes stand for ``duration`` [s] under `Settings.classical` with ``sweeps`` sweeps a step."""
    boxes = [box(0.0, 0.5 + i) for i in range(height)]
    simulation = Simulation(Model(2, [FLOOR, *boxes], DOWN, 0.0, 0.5), Settings.classical(dt, iterations=sweeps))
    simulation.advance(round(duration / dt))
    pose, contacts = simulation.pose[1:], simulation.contacts()
    away = np.abs(pose[:, :2] - [(0.0, 0.5 + i) for i in range(height)]).max()
    loads = np.zeros(height)
    for a, b, impulse in zip(contacts.body_a, contacts.body_b, contacts.impulse, strict=True):
        if b == a + 1:
            loads[a] += impulse[1]
    error = float(np.abs(loads / (GRAVITY * dt * (height - np.arange(height))) - 1.0).max())
    sunk = height - 0.5 - float(pose[-1, 1])
    return Starved(height, sweeps, sunk, float(np.abs(pose[:, 2]).max()), error, bool(away < 0.5))


def starved() -> Iterator[Starved]:
    """Yield one row per height and number of sweeps."""
    for height in HEIGHTS:
        for sweeps in SWEEPS:
            yield starved_stack(height, sweeps)
