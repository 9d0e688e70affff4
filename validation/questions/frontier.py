"""Breaking points by bisection: largest step, stack, mass ratio, spin, speed; fewest iterations.

    easy ----------- survives | fails --------------- hard
                       the bracket; each end is a cell that anyone can run

Scenes declare the driven parameter and the criterion of survival (`validation.canonical.Frontier`): whether the scene
still works, not whether it is exact. Between the two ends of a bracket an engine may fail and survive again: the result
is one pair of neighbours, one of which survives, found by halving on a logarithmic scale. All searches run in parallel:
each round runs one cell of each.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field, replace
from types import TracebackType

from adapters.isolation.foreign import checked_refusal, said_by
from adapters.registry import find, load
from adapters.stepping import posed_for, run
from validation.canonical import Frontier
from validation.catalogue import CATALOGUE
from validation.cells import Observation, Outcome, Slot, format_dt, settings_of
from validation.posed import resolve
from validation.running.apart import Apart
from validation.running.plan import QUICK_DT, has_iterations
from validation.workers import TIMEOUT

#: Ratio of the two ends of a bracket at which a search stops, quick and full.
QUICK_RATIO, FULL_RATIO = 1.3, 1.03
#: Words for outcomes without a result.
FATES = {
    Outcome.DIVERGED: "NaN or exploded",
    Outcome.CRASHED: "crashed",
    Outcome.TIMED_OUT: "no answer in time",
    Outcome.REFUSED: "not certified",
    Outcome.INVALID: "contradicts itself",
    Outcome.MISSING: "no answer",
}

Observe = Callable[[Sequence[Slot]], Mapping[Slot, Observation]]


@dataclass(frozen=True)
class End:
    """One end of a bracket: value, cell, and how it failed (empty: it survived)."""

    value: float
    slot: Slot
    fate: str


@dataclass
class Bracket:
    """One search: an engine's profile on one axis of one scene.

    ``survives`` and ``fails`` approach each other; one of them stays None where all values survived, or none did.
    ``refused`` is the reason where there is no result.
    """

    base: Slot
    frontier: Frontier
    survives: End | None = None
    fails: End | None = None
    refused: str = ""
    cells: int = 0
    _hard: float = field(default=0.0, repr=False)

    @property
    def text(self) -> str:
        """``40 boxes survive, 48: toppled``."""
        if self.refused:
            return self.refused
        low = "" if self.survives is None else value_text(self.frontier, self.survives.value)
        if self.fails is None:
            return f"{low} works, the hardest value that was tried"
        failed = f"{value_text(self.frontier, self.fails.value)} {self.fails.fate}"
        return f"{low} survives, {failed}" if low else f"already {failed}"


def value_text(frontier: Frontier, value: float) -> str:
    """A value of an axis with its unit."""
    text = format_dt(value) if frontier.axis == "dt" else f"{value:.4g}"
    return f"{text} {frontier.unit}".strip()


def axes(scenes: Sequence[str] = ()) -> list[tuple[str, Frontier]]:
    """Driven parameters, scene by scene; of all scenes if none is named."""
    return [(name, each) for name in scenes or CATALOGUE for each in resolve(name).frontiers]


def brackets(
    scenes: Sequence[str], engines: Sequence[str], profiles: Sequence[str], dimensions: Sequence[int], quick: bool
) -> list[Bracket]:
    """Searches to run. A quick one runs each axis in one dimension, 2-D if the scene has it."""
    found = []
    for name, frontier in axes(scenes):
        own = [d for d in resolve(name).dimensions if not dimensions or d in dimensions]
        for dimension in own[:1] if quick and not dimensions else own:
            for engine in engines:
                loaded = find(engine).engine
                for profile in loaded.profiles if loaded else ():
                    if profiles and profile not in profiles:
                        continue
                    slot = Slot(name, resolve(name).minimal(frontier.params), dimension, engine, profile, QUICK_DT)
                    if frontier.axis != "iterations" or (loaded and has_iterations(loaded, slot)):
                        found.append(Bracket(slot, frontier, _hard=frontier.hard if quick else frontier.hardest))
    return found


def slot_at(bracket: Bracket, value: float) -> Slot:
    """Cell of a bracket's axis at ``value``."""
    base, axis = bracket.base, bracket.frontier.axis
    if axis == "dt":
        return replace(base, dt=value)
    if axis == "iterations":
        return replace(base, iterations=int(value))
    canonical = resolve(base.scene)
    return base.with_params(dict(canonical.minimal({**bracket.frontier.params, axis: value})))


def search(
    found: Sequence[Bracket], ratio: float, jobs: int = 1, look: Observe | None = None
) -> Iterator[tuple[int, Sequence[Bracket]]]:
    """Narrow all brackets; yields after each round the number of open ones, and all of them."""
    if look is None:
        with Looking(jobs) as looking:
            yield from search(found, ratio, jobs, looking.look)
        return
    while True:
        asked = [(bracket, value) for bracket in found if (value := following(bracket, ratio)) is not None]
        yield len(asked), found
        if not asked:
            return
        slots = {id(bracket): slot_at(bracket, value) for bracket, value in asked}
        answers = look(list(slots.values()))
        for bracket, value in asked:
            tell(bracket, value, answers[slots[id(bracket)]])


class Looking:
    """Runs cells without property checks and certificates: only survival matters here.

    Each of ``jobs`` processes runs one cell at a time; one that hangs or dies loses its cell.
    """

    def __init__(self, jobs: int) -> None:
        self._aparts = [Apart(TIMEOUT) for _ in range(jobs)]

    def __enter__(self) -> Looking:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        for apart in self._aparts:
            apart.stop()

    def look(self, slots: Sequence[Slot]) -> dict[Slot, Observation]:
        """Observations of cells, each once."""
        waiting, found = deque(dict.fromkeys(slots)), {}

        def work(apart: Apart) -> None:
            while waiting:
                with suppress(IndexError):  # another process was faster
                    slot = waiting.popleft()
                    found[slot] = _looked(slot, apart)

        with ThreadPoolExecutor(len(self._aparts)) as threads:
            list(threads.map(work, self._aparts))
        return found


def _looked(slot: Slot, apart: Apart) -> Observation:
    answer = apart.ask(run_only, slot)
    if isinstance(answer, str):
        lost = Outcome.TIMED_OUT if answer.startswith("no answer") else Outcome.CRASHED
        return Observation(slot, "", 0, "", lost, answer)
    return answer


def run_only(slot: Slot) -> Observation:
    """Only run and measure a cell, in this process."""
    canonical = resolve(slot.scene)
    scene = canonical.scene(slot.dimension, dict(slot.params))
    blank = Observation(slot, "", canonical.version, find(slot.engine).version, Outcome.CRASHED)
    try:
        engine = load(slot.engine)
        refusal = checked_refusal(engine.refusal(posed_for(engine, scene), slot.base, slot.dt))
        if refusal:
            return replace(blank, outcome=Outcome.UNSUPPORTED, reason=refusal)
        settings = {setting.name: setting.value for setting in settings_of(engine, slot, scene)}
        found = run(engine, scene, slot.dt, settings, canonical.sampling(scene))
        if found.finish == "diverged":
            return replace(blank, outcome=Outcome.DIVERGED, reason=found.reason)
        return replace(blank, outcome=Outcome.OK, metrics=dict(canonical.measure(scene, found)))
    except BaseException as error:  # an engine may raise anything; only this cell is lost
        return replace(blank, reason=said_by(error))


def following(bracket: Bracket, ratio: float) -> float | None:
    """The next value; None when the bracket is closed."""
    if bracket.refused:
        return None
    if bracket.survives is None:
        return bracket.frontier.easy if bracket.fails is None else None
    if bracket.fails is None:
        return bracket._hard if bracket.survives.value != bracket._hard else None
    good, bad = bracket.survives.value, bracket.fails.value
    if max(good / bad, bad / good) <= ratio and not bracket.frontier.whole:
        return None
    middle = math.sqrt(good * bad)
    if bracket.frontier.axis == "dt":
        middle = 1.0 / round(1.0 / middle) if middle < 0.5 else middle  # a step that can be written
    if bracket.frontier.whole:
        middle = float(round(middle))
        if middle in (good, bad):
            middle = good + math.copysign(1.0, bad - good)
    return None if middle in (good, bad) else middle


def tell(bracket: Bracket, value: float, observation: Observation) -> None:
    """Enter a result."""
    bracket.cells += 1
    if observation.outcome in (Outcome.UNSUPPORTED, Outcome.NOT_INSTALLED):
        bracket.refused = observation.reason
        return
    fate = fate_of(bracket.frontier, observation)
    end = End(value, observation.slot, fate)
    if fate:
        bracket.fails = end
    else:
        bracket.survives = end


def fate_of(frontier: Frontier, observation: Observation) -> str:
    """How a cell ended, as one word; empty if it survived."""
    if observation.outcome is not Outcome.OK:
        return FATES[observation.outcome]
    slot = observation.slot
    scene = resolve(slot.scene).scene(slot.dimension, dict(slot.params))
    return frontier.fate(scene, observation.metrics)
