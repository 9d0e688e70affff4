"""The timing process: it times one unit at a time, and its parent drives it in rounds.

    parent --(call)--> timing process: stopwatch --(lap)--> parent
       each round: groups in random order; in a group, every open unit once, in random order
       a unit closes when the interval of its median is narrow enough, or its rounds or its time are used up

If the process dies or hangs, the timed unit is void and a new process continues with the others. It is also replaced
every few rounds: the layout of memory differs between processes, and the interval has to include that.
"""

from __future__ import annotations

import os
import random
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from adapters.registry import is_introduced
from validation.bench.statistics import spread
from validation.bench.stopwatch import Lap, lap
from validation.bench.timing import Timing
from validation.bench.units import Unit
from validation.running.apart import Apart

#: Number of threads of libraries. CPU time of helper threads would count for some engines only.
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


@dataclass(frozen=True)
class Limits:
    """When to stop.

    Parameters
    ----------
    width
        Sufficient width of the median's bootstrap interval, relative to the median.
    fewest, most
        Rounds. An interval of fewer than five values means nothing; after forty it hardly narrows.
    unit_seconds
        CPU time for one unit, building included. After it, three rounds suffice.
    size_seconds
        A pile whose round takes more CPU time ends its series: larger ones are left out, with that reason.
    lane_seconds
        Wall time for all units. After it, open units keep the rounds they have.
    patience
        Seconds without an answer after which the timing process counts as hanging.
    renew
        Rounds after which the process is replaced.
    """

    width: float = 0.05
    fewest: int = 5
    most: int = 40
    unit_seconds: float = 20.0
    size_seconds: float = 30.0
    lane_seconds: float = 5400.0
    patience: float = 600.0
    renew: int = 5


QUICK = Limits(unit_seconds=0.5, size_seconds=0.4, lane_seconds=25.0, patience=30.0)
FULL = Limits()


@dataclass
class _Entry:
    unit: Unit
    seconds: list[float] = field(default_factory=list)
    spent: float = 0.0
    closed: bool = False
    void: str = ""

    def add(self, found: Lap, limits: Limits) -> None:
        self.spent += found.whole_seconds
        self.seconds.append(found.seconds)
        self.void = found.void
        n = len(self.seconds)
        narrow = n >= limits.fewest and spread(self.seconds).width < limits.width
        self.closed = bool(found.void) or narrow or n >= limits.most or (n >= 3 and self.spent > limits.unit_seconds)


class Lane(Apart):
    """The timing process, which is replaced when it dies; ``count`` is the number of the present one."""

    count = -1

    def start(self) -> None:
        """See `Apart.start`."""
        with _one_thread():
            super().start()
        self.count += 1

    def time(self, unit: Unit) -> Lap:
        """Time ``unit`` once; the lap is void if the process died or hung."""
        found = self.ask(lap, unit)
        return Lap("", 0.0, 0.0, self.patience, "", None, void=found) if isinstance(found, str) else found


@contextmanager
def _one_thread() -> Iterator[None]:
    saved = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))
    try:
        yield
    finally:
        for name, value in saved.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def run_lane(units: Sequence[Unit], limits: Limits, seed: int) -> Iterator[Timing]:
    """Time all units in rounds and yield every raw timing when it is taken.

    The first unit of a group is the opponent of the group: it is timed as long as any other is open.
    """
    shuffle = random.Random(seed).shuffle
    groups: dict[tuple[Any, ...], list[_Entry]] = {}
    for unit in units:
        groups.setdefault(unit.group, []).append(_Entry(unit))
    ends, lane = time.monotonic() + limits.lane_seconds, Lane(limits.patience)
    try:
        for round_ in range(limits.most):
            if round_ % limits.renew == 0:
                lane.start()
            todo = [members for members in groups.values() if not all(entry.closed for entry in members)]
            shuffle(todo)
            if round_ == 0:  # small piles first, so that a series ends before it gets too expensive
                todo.sort(key=lambda members: members[0].unit.bodies)
            if not todo:
                return
            for members in todo:
                # Every unit gets three rounds, even after the time limit: with fewer there is no interval.
                if round_ >= 3 and time.monotonic() > ends:
                    return
                yield from _round(members, lane, limits, round_, shuffle)
                if round_ == 0:
                    yield from _end_series(members, groups, limits)
    finally:
        lane.stop()


def _round(members: list[_Entry], lane: Lane, limits: Limits, round_: int, shuffle: Any) -> Iterator[Timing]:
    opponent = members[0]
    taking = [entry for entry in members if not entry.closed]
    if opponent not in taking and not opponent.void:
        taking.append(opponent)
    shuffle(taking)
    for order, entry in enumerate(taking):
        alone = is_introduced(entry.unit.slot.engine)  # the timing process cannot load it
        found = lap(entry.unit) if alone else lane.time(entry.unit)
        entry.add(found, limits)
        yield _timing(entry.unit, opponent.unit, round_, order, lane.count, found)


def _timing(unit: Unit, opponent: Unit, round_: int, order: int, process: int, found: Lap) -> Timing:
    return Timing(
        unit.purpose,
        unit.slot,
        unit.cell,
        found.engine_version,
        unit.bodies,
        f"{opponent.slot.engine}/{opponent.slot.profile}",
        round_,
        order,
        process,
        unit.sampled,
        unit.steps,
        found.seconds,
        found.wall_seconds,
        found.state_hash,
        found.error,
        found.void,
    )


def _end_series(members: list[_Entry], groups: dict[Any, list[_Entry]], limits: Limits) -> Iterator[Timing]:
    """Close the units that are larger than a pile which already takes too long, with that reason."""
    slow = {e.unit.series: e for e in members if e.unit.purpose == "bodies" and e.spent > limits.size_seconds}
    for others in groups.values():
        for entry in others:
            small = slow.get(entry.unit.series)
            if small and not entry.closed and entry.unit.bodies > small.unit.bodies:
                reason = f"left out: a round of {small.unit.bodies} bodies took {small.spent:.2g} s"
                entry.closed, entry.void = True, reason
                lost = Lap("", 0.0, 0.0, 0.0, "", None, void=reason)
                yield _timing(entry.unit, others[0].unit, 0, 0, 0, lost)
