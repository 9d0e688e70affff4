"""The public face of the solver: build, advance, read.

The two dimensions are two packages behind one interface, chosen from one table. Each exposes a class ``World``:

    World(model, settings, needs)
        Allocates all arrays. `needs` says what to model; what it lacks is left out.
    world.pose, world.twist     (n, 3 | 7), (n, 3 | 6) float64, current state (simulation hands out copies)
    world.run(steps, stride, contacts) -> Frames
        Make `steps` steps in one compiled call (a call may be split where a buffer must grow), sampling the state
        after every `stride` steps (stride 0: no samples; `contacts`: also the contacts of the step before each
        sample).
    world.contacts() -> Contacts     of the last step made
    world.tally                      float64 array over the whole run, indexed by the constants in tally.py
"""

from __future__ import annotations

from importlib import import_module
from typing import Any, Protocol

import numpy as np

from reference_solver.model import Array, Model
from reference_solver.needs import EVERYTHING, Needs, needs
from reference_solver.records import Contacts, Frames, Record
from reference_solver.settings import Settings
from reference_solver.tally import summary


class World(Protocol):
    """What `Simulation` asks of the planar and the spatial package."""

    pose: Array
    twist: Array
    tally: Array

    def run(self, steps: int, stride: int, contacts: bool) -> Frames:
        """Make ``steps`` steps."""

    def contacts(self) -> Contacts:
        """Contacts of the last step."""


#: Package of each dimension, imported when first used: loading kernels costs time.
WORLDS = {2: "reference_solver.planar", 3: "reference_solver.spatial"}


class Simulation:
    """A model being stepped.

    Parameters
    ----------
    model, settings
        Both already validated by their own constructors.
    model_everything
        Leave nothing out, whatever the model needs; the answer must be the same (for tests).
    """

    def __init__(self, model: Model, settings: Settings, *, model_everything: bool = False) -> None:
        self.model = model
        self.settings = settings
        self.needs: Needs = EVERYTHING if model_everything else needs(model)
        package = import_module(WORLDS[model.dimension])
        self._world: World = package.World(model, settings, self.needs)
        self._steps = 0

    def advance(self, steps: int) -> None:
        """Make ``steps`` steps; afterwards positions and velocities belong to the same instant.

        Raises
        ------
        ValueError
            If ``steps`` is negative.
        """
        _require_count("steps", steps, 0)
        self._world.run(steps, 0, False)
        self._steps += steps

    def record(self, steps: int, stride: int = 1, contacts: bool = False) -> Record:
        """Make ``steps`` steps and return the samples at the start and after every ``stride`` steps.

        Raises
        ------
        ValueError
            If ``steps`` is negative or ``stride`` below 1.
        """
        _require_count("steps", steps, 0)
        _require_count("stride", stride, 1)
        first, start_pose, start_twist = self._steps, self.pose, self.twist
        frames = self._world.run(steps, stride, contacts)
        self._steps += steps
        count = len(frames.pose)
        return Record(
            t=np.multiply(first + stride * np.arange(count + 1), self.settings.dt, dtype=np.float64),
            pose=np.concatenate([start_pose[None], frames.pose]),
            twist=np.concatenate([start_twist[None], frames.twist]),
            offset=np.concatenate([[0], frames.offset]),
            contacts=frames.contacts,
        )

    @property
    def pose(self) -> Array:
        """Poses (n, 3 | 7), a copy."""
        return self._world.pose.copy()

    @property
    def twist(self) -> Array:
        """Twists (n, 3 | 6), a copy."""
        return self._world.twist.copy()

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._steps * self.settings.dt

    def contacts(self) -> Contacts:
        """Contacts of the last step with the impulses it applied."""
        return self._world.contacts()

    @property
    def certificate(self) -> dict[str, Any]:
        """How well the answers solve their own equations, over the whole run.

        ``residual``: worst scaled natural map of a step (E14); ``sweeps``: total; ``worst_sweeps``: of one step;
        ``converged``: every step reached `Settings.residual` (always true without a residual stop);
        ``projected``: worst position correction of a step [m].
        """
        return summary(self._world.tally)

    @property
    def left_out(self) -> tuple[str, ...]:
        """What the scene did not need and was therefore not modelled."""
        return self.needs.left_out()


def _require_count(name: str, value: int, least: int) -> None:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
        raise ValueError(f"{name}: {value!r} must be a whole number of at least {least}")
