"""What runs for its error, and what is timed: every engine and profile over steps and iteration counts.

Each scene declares its steps and iteration counts (`validation.canonical.Steps`) for the quick and the full suite. The
sizes of piles are in this module.

One sweep solves a single contact. Iterations are swept there only so that each engine runs at its lowest real cost.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from adapters.registry import find, is_ranked
from validation.bench.reading import POINT
from validation.bench.units import Unit, iteration_units, overhead_units, size_units, work_unit
from validation.bench.work import accuracy, certified_of, measured
from validation.canonical import Suite
from validation.catalogue import CATALOGUE
from validation.cells import Observation, Outcome, Slot, prepare, slot_from_dict
from validation.files.distance import CertifiedRuns, certified_slot, primary_of
from validation.identity import machine
from validation.posed import is_file, resolve
from validation.records.store import RELEASE_TITLE, SCATTER_TITLE, Store
from validation.running.plan import Request, slots

#: Outcomes that repeat if the same case runs again.
REPEATS = (Outcome.OK, Outcome.DIVERGED, Outcome.UNSUPPORTED, Outcome.REFUSED, Outcome.INVALID)
#: Step at which a full benchmark also times the cost with every step sampled [s].
SAMPLED_DT = 1.0 / 240.0


@dataclass(frozen=True)
class Scaling:
    """Sizes of piles: n bodies, r rows of pyramids; iteration counts, and the rows of their pyramid."""

    counts: tuple[int, ...]
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
    """The request of a user; empty fields are those of the suite."""

    request: Request
    dts: Sequence[float] = ()
    iterations: Sequence[int] = ()
    params: Mapping[str, float] = field(default_factory=dict)

    def steps(self, scene: str) -> Sequence[float]:
        """Steps [s] of a scene."""
        return tuple(self.dts) or resolve(scene).steps.dts(self.request.suite)

    def counts(self, scene: str) -> Sequence[int]:
        """Iteration counts of a scene beside each profile's own; none if the count is one of the user's settings."""
        if any(name == "iterations" for name, _ in self.request.sets):
            return ()
        return tuple(self.iterations) or resolve(scene).steps.counts(self.request.suite)


def benched(suite: Suite) -> list[str]:
    """Scenes in a bench of a suite without named scenes: those with a headline error, and with steps for the suite."""
    ours = [(name, scene.steps) for name, scene in CATALOGUE.items() if scene.primary]
    return [name for name, steps in ours if steps.quick or suite == "full"]


def accuracy_slots(sweep: Sweep) -> list[Slot]:
    """All cases whose errors are needed; for scenes from files also their certified runs.

    Raises
    ------
    SceneError, EngineError
        For a scene without a headline error, or for unknown engines, profiles or parameters.
    """
    found: dict[Slot, None] = {}
    apart: dict[Slot, None] = {}
    for scene in sweep.request.scenes:
        primary, canonical, before = primary_of(scene), resolve(scene), len(found)
        dimensions = _shown(sweep.request, canonical.dimensions)
        for dt in sweep.steps(scene):
            for variation in primary.variations(dt):
                params = canonical.complete({**variation, **sweep.params})  # none would be those of the suite
                wanted = replace(
                    sweep.request, scenes=[scene], dimensions=dimensions, dts=[dt], iterations=[], params=params
                )
                found.update(dict.fromkeys(slots(wanted)))
                for count in sweep.counts(scene):
                    found.update(dict.fromkeys(slots(replace(wanted, iterations=[count]))))
        if is_file(scene):
            finest = min(sweep.steps(scene))
            apart.update(dict.fromkeys(certified_slot(slot, 0.5 * finest) for slot in list(found)[before:]))
    return [*(slot for slot in found if _is_benched(sweep.request, slot.engine, slot.base)), *apart]


def _shown(request: Request, dimensions: Sequence[int]) -> Sequence[int]:
    """The dimensions that a request names; else all, or in the quick suite the first one."""
    return tuple(request.dimensions) or (dimensions[:1] if request.suite == "quick" else dimensions)


def _is_benched(request: Request, engine: str, profile: str) -> bool:
    """Whether a profile is run and timed; an unranked one only if the request names it."""
    return profile in request.profiles or (not request.profiles and is_ranked(engine, profile))


def answered(store: Store, slots: Sequence[Slot]) -> tuple[str, list[Observation]]:
    """Id and observations of the newest run without timings on this machine, for the very same cases.

    Cases are the same if scene, code, engine, adapter, settings and interpreter are equal (`Cell.key`). Crashes and
    time-outs are not reused, and times never are.
    """
    runs = store.runs()
    apart, timed = (SCATTER_TITLE, RELEASE_TITLE), {run.id for run in store.timed_runs()}
    judged = [run for run in runs if run.finished and run.id not in timed and not run.title.startswith(apart)]
    if not judged or judged[-1].machine != machine():
        return "", []
    wanted = set(slots)
    found = [o for o in store.observations(judged[-1]) if o.slot in wanted and o.outcome in REPEATS]
    return judged[-1].id, [o for o in found if o.cell and o.cell == prepare(o.slot).cell.key()]


def timed_units(sweep: Sweep, observations: Sequence[Observation]) -> list[Unit]:
    """All units to time, after the errors are known; work points without a valid error are left out."""
    suite, request = sweep.request.suite, sweep.request
    groups: dict[tuple[Any, ...], list[Observation]] = defaultdict(list)
    certified = certified_of(observations)
    observations = list(measured(observations, certified))
    for observation in observations:
        groups[tuple(getattr(observation.slot, name) for name in POINT)].append(observation)
    units = [unit for members in groups.values() for unit in _work_units(members, certified, suite)]
    engines = [
        (name, profile)
        for name in request.engines
        for profile in (getattr(find(name).engine, "profiles", None) or ())
        if _is_benched(request, name, profile)
    ]
    own = {(o.slot.engine, o.slot.base): o.slot.switched for o in observations}
    if request.sets:
        engines = list(own)
    dimensions = tuple(request.dimensions) or (2, 3)
    piles = list(overhead_units(engines, dimensions))
    scaled = [(scene, size) for scene in request.scenes if (size := resolve(scene).size)]
    if scaled:
        sizes = SCALING[suite]
        shown = _shown(request, dimensions)
        piles += size_units(engines, shown, scaled, sizes.counts, sizes.rows)
        if not any(name == "iterations" for name, _ in request.sets):
            piles += iteration_units(engines, shown, sizes.iterations, sizes.iteration_rows)
    if request.sets:
        piles = [replace(each, slot=each.slot.with_own(own[each.slot.engine, each.slot.profile])) for each in piles]
    return units + piles


def _work_units(members: Sequence[Observation], certified: CertifiedRuns, suite: Suite) -> Iterator[Unit]:
    point = accuracy(members, certified)
    if point["reason"]:
        return
    slot = slot_from_dict(point["slot"])
    cell = next(observation.cell for observation in members if observation.slot == slot)
    yield work_unit(slot, cell, point["error"])
    if suite == "full" and slot.dt == SAMPLED_DT and slot.iterations is None:
        yield work_unit(slot, cell, point["error"], sampled=True)
