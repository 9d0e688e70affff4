"""Many models of one kind, stepped side by side: `Simulation.many`.

    models -> those whose bodies are alike -> groups of `LANES` -> threads

Planar models under a fixed number of row-by-row sweeps are stepped eight in one (`many.planar`), all others each by
itself. Each world has, to the bit, the states that `Simulation` gives it alone, with any number of threads.
"""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from typing import Any, NamedTuple, Protocol

import numpy as np

from reference_solver.checks import require_count
from reference_solver.compilation import config
from reference_solver.lanes import LANES
from reference_solver.model import Array, Model
from reference_solver.needs import needs
from reference_solver.settings import Settings
from reference_solver.simulation import Simulation


class Motions(NamedTuple):
    """Recorded states of W worlds, the first sample is the state before.

    Parameters
    ----------
    t
        (s,) times [s].
    pose, twist
        (W, s, n, 3 | 7) and (W, s, n, 3 | 6).
    """

    t: Array
    pose: Array
    twist: Array


class Members(Protocol):
    """Worlds that one thread steps: W arrays (n, 3 | 7) and (n, 3 | 6) of each."""

    def states(self) -> tuple[Array, Array]:
        """Poses (W, n, 3 | 7) and twists (W, n, 3 | 6)."""

    def run(self, steps: int, stride: int) -> tuple[Array, Array]:
        """Make ``steps`` steps; poses and twists (W, s, n, ...) after every ``stride`` of them (0: none)."""


class Alone:
    """A world that is stepped by itself."""

    def __init__(self, model: Model, settings: Settings) -> None:
        self.simulation = Simulation(model, settings, certified=False)

    def states(self) -> tuple[Array, Array]:
        """See `Members.states`."""
        return self.simulation.pose[None], self.simulation.twist[None]

    def run(self, steps: int, stride: int) -> tuple[Array, Array]:
        """See `Members.run`."""
        if stride == 0:
            self.simulation.advance(steps)
            return tuple(state[:, None][:, :0] for state in self.states())  # type: ignore[return-value]
        found = self.simulation.record(steps, stride)
        return found.pose[None, 1:], found.twist[None, 1:]


class Worlds:
    """Worlds that are stepped side by side; see `Simulation.many`."""

    def __init__(self, models: list[Model], settings: Settings, threads: int) -> None:
        self.settings, self.threads, self._steps = settings, threads, 0
        self._members: list[tuple[list[int], Members]] = []
        alike = defaultdict[Any, list[int]](list)
        for w, model in enumerate(models):
            alike[_kind(model) if _in_lanes(model, settings) else w].append(w)
        for kind, found in alike.items():
            if isinstance(kind, int):
                self._members.append((found, Alone(models[kind], settings)))
                continue
            groups = import_module("reference_solver.many.groups")  # its kernels are loaded where they are needed
            for first in range(0, len(found), LANES):
                chosen = found[first : first + LANES]
                self._members.append((chosen, groups.Together([models[w] for w in chosen], settings)))

    def __len__(self) -> int:
        return sum(len(chosen) for chosen, _ in self._members)

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._steps * self.settings.dt

    @property
    def pose(self) -> Array:
        """Poses (W, n, 3 | 7), a copy."""
        return self._together(0, [(chosen, members.states()) for chosen, members in self._members])

    @property
    def twist(self) -> Array:
        """Twists (W, n, 3 | 6), a copy."""
        return self._together(1, [(chosen, members.states()) for chosen, members in self._members])

    def advance(self, steps: int) -> None:
        """Make ``steps`` steps of every world.

        Raises
        ------
        ValueError
            If ``steps`` is negative.
        """
        require_count("steps", steps, 0)
        self._run(steps, 0)

    def record(self, steps: int, stride: int = 1) -> Motions:
        """Make ``steps`` steps of every world and return the states at the start and after every ``stride`` steps.

        Raises
        ------
        ValueError
            If ``steps`` is negative or ``stride`` below 1.
        """
        require_count("steps", steps, 0)
        require_count("stride", stride, 1)
        first, start = self._steps, (self.pose[:, None], self.twist[:, None])
        found = self._run(steps, stride)
        pose, twist = (np.concatenate([start[k], self._together(k, found)], axis=1) for k in range(2))
        t = np.multiply(first + stride * np.arange(pose.shape[1]), self.settings.dt, dtype=np.float64)
        return Motions(t, pose, twist)

    def _run(self, steps: int, stride: int) -> list[tuple[list[int], tuple[Array, Array]]]:
        """Run all members, each in the thread that is free first."""
        self._steps += steps
        with ThreadPoolExecutor(self.threads) as pool:
            found = pool.map(lambda each: each[1].run(steps, stride), self._members)
            return [(chosen, states) for (chosen, _), states in zip(self._members, found, strict=True)]

    def _together(self, which: int, found: list[tuple[list[int], tuple[Array, Array]]]) -> Array:
        """Poses (0) or twists (1) of all worlds in the order of the parameters."""
        result = np.empty((len(self), *found[0][1][which].shape[1:]))
        for chosen, states in found:
            result[chosen] = states[which]
        return result


def worlds(
    model: Callable[..., Model], parameters: Iterable[Mapping[str, Any]], settings: Settings, threads: int | None
) -> Worlds:
    """See `Simulation.many`."""
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if threads is not None:
        require_count("threads", threads, 1)
        count = threads
    models = list[Model]()
    for k, told in enumerate(parameters):
        found = model(**told)
        if models and (found.dimension, len(found.bodies)) != (models[0].dimension, len(models[0].bodies)):
            raise ValueError(f"parameters[{k}]: {_size(found)}, but parameters[0] gives {_size(models[0])}")
        models.append(found)
    if not models:
        raise ValueError("parameters: there must be at least one set")
    return Worlds(models, settings, count)


def _size(model: Model) -> str:
    return f"{len(model.bodies)} bodies in {model.dimension} dimensions"


def _in_lanes(model: Model, settings: Settings) -> bool:
    """Whether a model can be stepped with others in one."""
    return model.dimension == 2 and settings.is_textbook and not config.DISABLE_JIT


def _kind(model: Model) -> Any:
    """What models have in common that are stepped in one: kinds and motions of the bodies, and what they need."""
    bodies = ((type(each.shape), each.motion, len(getattr(each.shape, "vertices", ()))) for each in model.bodies)
    return tuple(bodies), needs(model)
