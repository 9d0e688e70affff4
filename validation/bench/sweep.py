"""What is run for its error, and what is timed: every engine and profile over steps and iteration counts.

quick
    three steps from 1/60 s down; a second iteration count on the stack only.
full
    steps by halves as far as a simulated second stays affordable, and iteration counts over two decades.

A single contact is solved by one sweep, so iterations are swept there only to let each engine be as cheap as it
honestly can.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from adapters.registry import find
from validation.bench.primary import primary_of
from validation.bench.reading import POINT
from validation.bench.units import Unit, iteration_units, overhead_units, size_units, work_unit
from validation.bench.work import accuracy
from validation.cells import Observation, Slot, slot_from_dict
from validation.plan import Request, Suite, slots

#: What two cores do in half a minute: ten boxes, or sixteen long bounces, cannot go to small steps.
QUICK_STEPS = {
    "impact": (1.0 / 60.0, 1.0 / 240.0, 1.0 / 960.0),
    "bounce": (1.0 / 60.0, 1.0 / 120.0, 1.0 / 240.0),
    "stack": (1.0 / 60.0, 1.0 / 120.0, 1.0 / 240.0),
    "incline": (1.0 / 60.0, 1.0 / 240.0, 1.0 / 960.0),
}
#: Step at which cost with every step sampled is timed as well.
SAMPLED_DT = 1.0 / 240.0


def _halves(first: float, last: float) -> tuple[float, ...]:
    rates = [first]
    while rates[-1] < last:
        rates.append(2.0 * rates[-1])
    return tuple(1.0 / rate for rate in rates)


#: Finest step per scene: a ball is cheap, ten boxes at 1/1920 s take an engine some seconds per cell.
FULL_STEPS = {
    "impact": _halves(30.0, 1920.0),
    "bounce": _halves(60.0, 7680.0),
    "stack": _halves(30.0, 1920.0),
    "incline": _halves(30.0, 1920.0),
}
QUICK_ITERATIONS: dict[str, tuple[int, ...]] = {"stack": (50,)}
FULL_ITERATIONS = {"impact": (1,), "bounce": (1,), "stack": (4, 10, 30, 100), "incline": (1, 4, 30)}


@dataclass(frozen=True)
class Scaling:
    """Sizes of the piles: columns of n boxes, pyramids of r rows; iteration counts and the pyramid they run on."""

    columns: tuple[int, ...]
    rows: tuple[int, ...]
    iterations: tuple[int, ...]
    iteration_rows: int


#: 4, 7, 10, 13, 24 and 44 rows are 10, 28, 55, 91, 300 and 990 boxes.
SCALING: dict[Suite, Scaling] = {
    "quick": Scaling((1, 10, 20, 40), (1, 4, 7, 10), (1, 10, 100), 4),
    "full": Scaling((1, 3, 10, 30, 100, 300, 1000), (1, 2, 4, 7, 13, 24, 44), (1, 3, 10, 30, 100), 7),
}


@dataclass(frozen=True)
class Sweep:
    """What a user asked for; empty means the suite's own."""

    request: Request
    dts: Sequence[float] = ()
    iterations: Sequence[int] = ()
    params: Mapping[str, float] = field(default_factory=dict)

    def steps(self, scene: str) -> Sequence[float]:
        """Steps [s] of a scene."""
        return tuple(self.dts) or (QUICK_STEPS if self.request.suite == "quick" else FULL_STEPS)[scene]

    def counts(self, scene: str) -> Sequence[int]:
        """Iteration counts of a scene beside each profile's own."""
        table = QUICK_ITERATIONS if self.request.suite == "quick" else FULL_ITERATIONS
        return tuple(self.iterations) or table.get(scene, ())


def accuracy_slots(sweep: Sweep) -> list[Slot]:
    """Return all cells whose errors are needed.

    Raises
    ------
    SceneError, EngineError
        For a scene without a declared error, unknown engines, profiles or parameters.
    """
    found: dict[Slot, None] = {}
    for scene in sweep.request.scenes:
        primary = primary_of(scene)
        for dt in sweep.steps(scene):
            for variation in primary.variations(dt):
                params = {**variation, **sweep.params}
                wanted = replace(sweep.request, scenes=[scene], dts=[dt], iterations=[], params=params)
                found.update(dict.fromkeys(slots(wanted)))
                for count in sweep.counts(scene):
                    found.update(dict.fromkeys(slots(replace(wanted, iterations=[count]))))
    return list(found)


def timed_units(sweep: Sweep, observations: Sequence[Observation]) -> list[Unit]:
    """Everything to time after the errors are known; work points without a valid error are not among it."""
    suite, request = sweep.request.suite, sweep.request
    groups: dict[tuple[Any, ...], list[Observation]] = defaultdict(list)
    for observation in observations:
        groups[tuple(getattr(observation.slot, name) for name in POINT)].append(observation)
    units = [unit for members in groups.values() for unit in _work_units(members)]
    engines = [
        (name, profile)
        for name in request.engines
        for profile in (getattr(find(name).engine, "profiles", None) or ())
        if not request.profiles or profile in request.profiles
    ]
    dimensions = tuple(request.dimensions) or (2, 3)
    units += overhead_units(engines, dimensions)
    if "stack" in request.scenes:
        sizes = SCALING[suite]
        shown = dimensions[:1] if suite == "quick" else dimensions
        units += size_units(engines, shown, sizes.columns, sizes.rows)
        units += iteration_units(engines, shown, sizes.iterations, sizes.iteration_rows)
    return units


def _work_units(members: Sequence[Observation]) -> Iterator[Unit]:
    point = accuracy(members)
    if point["reason"]:
        return
    slot = slot_from_dict(point["slot"])
    cell = next(observation.cell for observation in members if observation.slot == slot)
    yield work_unit(slot, cell, point["error"])
    if slot.dt == SAMPLED_DT and slot.iterations is None:
        yield work_unit(slot, cell, point["error"], sampled=True)
