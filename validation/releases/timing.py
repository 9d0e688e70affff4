"""Times of releases: cost of a scene on each, relative to a yardstick on the same machine.

    each round:  yardstick, timed call, yardstick, timed call, yardstick, ...     in the release's environment
    ratio        a call's time over the mean of the yardsticks on both of its sides; a busy machine slows all three

Seconds on two machines, or at two times on one, cannot be compared; ratios to a constant yardstick can. It is a loop of
plain Python, as all environments have the same interpreter but different versions of numpy. One cell of each scene,
dimension and profile is timed, as in the benchmark (`validation.bench.units`).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from validation.bench.lane import Lane
from validation.bench.timing import Timing
from validation.bench.units import work_unit
from validation.canonical import Suite
from validation.cells import Observation, Outcome, Slot, slot_from_dict
from validation.posed import is_file, resolve
from validation.running.plan import QUICK_DT

#: Rounds, each in a separate process: two disturbed ones do not change the median of five.
ROUNDS = 5
#: Iterations of the yardstick's loop: some 5 ms, a thousand times the cost of reading the clock.
TURNS = 50_000
#: Name of the yardstick in the place of an engine, and its description.
YARDSTICK, CALLED = "python", "a loop of Python"
#: Seconds without an answer after which a timing counts as hanging.
PATIENCE = 120.0


def yardstick() -> float:
    """CPU time of the loop [s]."""
    begun, x = time.process_time(), 0.0
    for k in range(TURNS):
        x += (k * 0.5) % 3.0
    return time.process_time() - begun


def timed_cells(observations: Iterable[Observation], suite: Suite = "quick") -> list[Slot]:
    """One cell of each scene, dimension and profile: the first with the profile's own settings.

    It must have a result: cells that crash or are invalid are not timed.
    """
    first: dict[tuple[str, int, str], Observation] = {}
    for observation in observations:
        slot = observation.slot
        own = slot.iterations is None and not slot.ulp and not slot.switched and slot.dt == QUICK_DT
        if own and not is_file(slot.scene) and resolve(slot.scene).primary is not None:
            first.setdefault((slot.scene, slot.dimension, slot.profile), observation)
    return [observation.slot for observation in first.values() if observation.outcome is Outcome.OK]


def laps(slots: Sequence[Slot], rounds: int = ROUNDS) -> Iterator[dict[str, Any]]:
    """Time ``slots`` in rounds, here; plain data of each lap as `timings_of` reads it."""
    lane, void = Lane(PATIENCE), set[Slot]()
    try:
        for round_ in range(rounds):
            lane.start()
            before = yardstick()
            for order, slot in enumerate([slot for slot in slots if slot not in void]):
                unit = work_unit(slot, "", None)
                found, after = lane.time(unit), yardstick()
                beside, before = 0.5 * (before + after), after
                if found.void:
                    void.add(slot)
                yield {"timed": slot.as_dict(), "round": round_, "order": order, "yardstick": beside,
                       "void": found.void, "seconds": found.seconds, "wall_seconds": found.wall_seconds,
                       "steps": unit.steps, "bodies": unit.bodies, "state_hash": found.state_hash}  # fmt: skip
    finally:
        lane.stop()


def timings_of(answer: Mapping[str, Any], version: str) -> tuple[Timing, Timing]:
    """Laps of an engine's release and of the yardstick, as stored."""
    slot = slot_from_dict(answer["timed"])
    opponent = f"{YARDSTICK}/{slot.profile}"  # one beside each lap, under the same load of the machine
    own = Timing(
        "work", slot, "", version, int(answer["bodies"]), opponent, int(answer["round"]), int(answer["order"]),
        int(answer["round"]), False, int(answer["steps"]), float(answer["seconds"]), float(answer["wall_seconds"]),
        str(answer["state_hash"]), None, str(answer["void"]),
    )  # fmt: skip
    beside = replace(slot, engine=YARDSTICK)
    seconds = float(answer["yardstick"])
    measure = replace(
        own, slot=beside, engine_version="", bodies=0, seconds=seconds, wall_seconds=seconds, state_hash="", void=""
    )
    return own, measure


def kept(answers: Iterable[Mapping[str, Any]], version: str, keep: Callable[[list[Timing]], None]) -> dict[str, str]:
    """Pass all timings of a release to ``keep``, a round at a time; returns failures with reasons."""
    void: dict[str, str] = {}
    pending: list[Timing] = []
    for answer in answers:
        own, measure = timings_of(answer, version)
        if pending and pending[-1].round != own.round:
            keep(pending)
            pending = []
        pending += [own, measure]
        if own.void:
            void[own.slot.key()] = f"{own.slot.profile} {own.slot.scene} {own.slot.dimension}-D: {own.void}"
    if pending:
        keep(pending)
    return void
