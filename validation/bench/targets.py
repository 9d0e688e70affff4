"""Lead of the textbook step over each engine: ratios of time at 10 sweeps and at equal error, with floors and targets.

    targets.toml     scenes; in engines' folders: how an engine is compared, least ratio (floor), desired ratio (target)
       |
    errors.py        errors of each opponent and of ours, in a process that may die
       |  search: our fewest sweeps whose errors are no larger than theirs
       v
    lane.py          ours at 10 sweeps, ours at those sweeps, and all opponents, interleaved in rounds
       |
    rows             one per scene, opponent and way of comparison

A ratio is their CPU time per step over ours in the same round: above 1 ours is faster.
"""

from __future__ import annotations

import math
import tomllib
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from adapters import registry
from adapters.engine import EngineError, Role
from adapters.engine_folder import inside
from adapters.stepping import step_count
from validation.bench.agreement import ratio
from validation.bench.errors import Found, errors_of
from validation.bench.lane import Lane, Limits, run_lane
from validation.bench.statistics import spread
from validation.bench.timing import Timing
from validation.bench.units import Unit, runs, scene_of
from validation.bench.work import time_at_equal_error
from validation.cells import Slot, parse_dt

if TYPE_CHECKING:
    import pandas as pd

TABLE = Path(__file__).with_name("targets.toml")
#: Nine rounds for cheap units; three where a round of one engine takes seconds.
LIMITS = Limits(width=0.03, fewest=7, most=9, unit_seconds=10.0, lane_seconds=300.0, patience=300.0, renew=3)
#: Largest number of sweeps in a search, and CPU time of the searches on one scene [s]. In that time the largest scenes
#: find all they need, in half of the command's ten minutes.
MOST_SWEEPS, SEARCH_SECONDS = 640, 40.0
AT_SWEEPS, AT_ERROR, AT_END = "10 sweeps", "equal error", "end of the run"
NOT_THERE = "not at this error"
TIMED_ONLY = "not run for its errors, which would take minutes"


@dataclass(frozen=True)
class Opponent:
    """Profile of an engine by its role, its sweeps (None: the profile's own), and the comparison with floor and target.

    ``contacts`` is whether its contacts are counted.
    """

    engine: str
    role: Role
    sweeps: int | None
    floor: str
    contacts: bool = True

    @property
    def profile(self) -> str:
        """Name of the profile."""
        return registry.profile_of(self.engine, self.role) or ""


@dataclass(frozen=True)
class Case:
    """One scene of the table; targets.toml explains its fields."""

    title: str
    scene: str
    dimension: int
    errors: str
    dt: float
    sweeps: int
    against: Mapping[str, Sequence[float]]
    params: Mapping[str, float] = field(default_factory=dict)
    seconds: float = 0.0
    clock: tuple[float, float] | None = None
    drift: float | None = None
    timed_only: Sequence[str] = ()

    def slot(self, engine: str, profile: str, sweeps: int | None) -> Slot:
        """Slot of this scene on an engine."""
        params = tuple(sorted((name, float(value)) for name, value in self.params.items()))
        return Slot(self.scene, params, self.dimension, engine, profile, self.dt, sweeps)

    def ours(self, sweeps: int) -> Slot:
        """Slot of our textbook step at ``sweeps``."""
        solver = registry.solver()
        return self.slot(solver, registry.profile_of(solver, "textbook") or "", sweeps)


@dataclass(frozen=True)
class Table:
    """Content of targets.toml; ``twice`` has floor and target of `lead`."""

    cases: tuple[Case, ...]
    opponents: Mapping[str, Opponent]
    twice: tuple[float, float]


@dataclass(frozen=True)
class Row:
    """One line of the result.

    Parameters
    ----------
    at
        ``10 sweeps`` or ``equal error``; ``end of the run`` where nothing is timed.
    measured, low, high
        Their CPU time per step over ours, median over rounds and 95 % interval; our error where nothing is timed.
        None if there is no value.
    floor, target
        Least and desired value; the largest allowed error where nothing is timed. None: shown only.
    our_error, their_error
        By name, with unit.
    sweeps
        Ours; None if no number is known to reach their error.
    counts
        Bodies, timed steps, rounds. For both sides contacts at the end of the run for errors, a hash of the state after
        the timed steps, and the median CPU time per step [s].
    reason
        Why a ratio or their error is missing; empty if neither is.
    """

    scene: str
    against: str
    at: str
    measured: float | None
    low: float | None
    high: float | None
    floor: float | None
    target: float | None
    our_error: Mapping[str, float]
    their_error: Mapping[str, float]
    sweeps: int | None
    counts: Mapping[str, Any]
    reason: str = ""

    @property
    def mark(self) -> str:
        """``target`` or ``floor`` for what is met, ``below floor``, or empty without a floor."""
        if self.floor is None:
            return ""
        if self.at == AT_END:
            return "floor" if self.measured is not None and self.measured <= self.floor else "below floor"
        if self.measured is None or self.measured < self.floor:
            return "below floor"
        return "target" if self.target is not None and self.measured >= self.target else "floor"


def table(path: Path = TABLE) -> Table:
    """Read the table of scenes, and the opponents, floors and targets that engines' folders state.

    Raises
    ------
    EngineError
        If a folder names a scene that is not in the table.
    """
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    sweeps, titles = data["sweeps"], {entry["title"] for entry in data["scenes"]}
    files = {name: file for name in sorted(registry.names(), key=_apart) if (file := inside(name, TABLE.name))}
    stated = {name: tomllib.loads(file.read_text(encoding="utf-8")) for name, file in files.items()}
    against = {name: entry.pop("against") for name, entry in stated.items()}
    timed_only = {name: entry.pop("timed_only", ()) for name, entry in stated.items()}
    for name, file in files.items():
        if unknown := {*against[name], *timed_only[name]} - titles:
            raise EngineError(f"{file}: {min(unknown)!r} is no title of {path.name}")
    opponents = {
        name: Opponent(name, **{**entry, "sweeps": sweeps if entry["sweeps"] else None})
        for name, entry in stated.items()
    }
    cases = [
        Case(
            **{"sweeps": sweeps, **entry, "dt": parse_dt(entry.get("dt", data["dt"]))},
            against={name: own[entry["title"]] for name, own in against.items() if entry["title"] in own},
            timed_only=[name for name, own in timed_only.items() if entry["title"] in own],
        )
        for entry in data["scenes"]
    ]
    return Table(tuple(cases), opponents, tuple(data["equal_error"]["twice"]))


def _apart(name: str) -> bool:
    told = registry.facts(name)
    return told is None or told.apart


def fewest_sweeps(reaches: Callable[[int], bool | None], least: int, most: int) -> int | None:
    """Fewest sweeps that reach an error: by doubling, then by bisection.

    Parameters
    ----------
    reaches
        Whether a number of sweeps reaches it; None if there is no time to try. Errors may rise and fall with the
        sweeps: the returned number reaches it, and a smaller tried one does not.

    Returns
    -------
    None if no tried number reaches it. If time ends during bisection, the fewest that is known to reach it.
    """
    low, high = least - 1, least
    while not (found := reaches(high)):
        if found is None or high >= most:
            return None
        low, high = high, min(2 * high, most)
    while high - low > 1:
        middle = (low + high) // 2
        found = reaches(middle)
        if found is None:
            break
        low, high = (low, middle) if found else (middle, high)
    return high


class Ours:
    """Our errors on one scene by number of sweeps, each computed once, while time is left."""

    def __init__(self, ask: Callable[[int], Found], seconds: float = SEARCH_SECONDS) -> None:
        self.ask, self.left, self.known = ask, seconds, dict[int, Found]()

    def at(self, sweeps: int) -> Found:
        """Errors at ``sweeps``, also if no time is left."""
        if sweeps not in self.known:
            self.known[sweeps] = self.ask(sweeps)
            self.left -= self.known[sweeps].seconds
        return self.known[sweeps]

    def against(self, theirs: Found, least: int) -> tuple[int | None, str]:
        """Fewest sweeps whose errors are within ``theirs``, and ""; else None and the reason."""
        if theirs.reason:
            return None, theirs.reason
        found = fewest_sweeps(lambda sweeps: self._reaches(sweeps, theirs), least, MOST_SWEEPS)
        tried = max(self.known)
        return found, "" if found else f"{NOT_THERE} up to {tried} sweeps{', time is up' * (tried < MOST_SWEEPS)}"

    def _reaches(self, sweeps: int, theirs: Found) -> bool | None:
        if sweeps not in self.known:
            nearest = min(self.known, key=lambda known: abs(known - sweeps), default=None)
            # A step costs at most in proportion to its sweeps, and at least what it costs at fewer of them.
            cost = self.known[nearest].seconds * max(1.0, sweeps / nearest) if nearest else 0.0
            if cost > self.left:
                return None
        return self.at(sweeps).is_within(theirs)


#: Timings of each slot, by round.
Timings = Mapping[Slot, Mapping[int, Timing]]


def measure(
    asked: Table, seed: int, tell: Callable[[str], None] = lambda text: None, limits: Limits = LIMITS
) -> Iterator[Row]:
    """Measure errors, then times, and yield the rows in the order of the table."""
    lane = Lane(limits.patience)
    lane.start()
    try:
        known = dict[Any, Found]()
        errors = [_Errors(case, asked, lane, tell, known) for case in asked.cases]
    finally:
        lane.stop()
    timings: dict[Slot, dict[int, Timing]] = defaultdict(dict)
    units = [unit for each in errors for unit in each.units()]
    for timing in run_lane(units, limits, seed):
        tell(f"clocking, round {timing.round + 1}: {timing.slot.scene} on {timing.slot.engine}")
        if not timing.void:
            timings[timing.slot][timing.round] = timing
    for each in errors:
        yield from each.rows(timings)


class _Errors:
    """Errors of one scene: theirs, ours at all tried sweeps, and our sweeps at equal error.

    Two cases can have the same runs; ``known`` keeps them.
    """

    def __init__(
        self, case: Case, asked: Table, lane: Lane, tell: Callable[[str], None], known: dict[Any, Found]
    ) -> None:
        def ask(slot: Slot, contacts: bool = True) -> Found:
            key = case.errors, slot, case.seconds, contacts
            if key not in known:
                known[key] = run(slot, contacts)
            return known[key]

        def run(slot: Slot, contacts: bool) -> Found:
            tell(f"errors: {case.title}, {slot.engine}{f' at {slot.iterations} sweeps' if slot.iterations else ''}")
            found = lane.ask(errors_of, case.errors, slot, case.seconds, contacts)
            return Found({}, {}, None, 0, 0.0, found) if isinstance(found, str) else found

        self.case, self.opponents = case, list[tuple[Opponent, Slot]]()
        for name in case.against:
            opponent = asked.opponents[name]
            slot = case.slot(name, opponent.profile, opponent.sweeps)
            if runs(slot):
                self.opponents.append((opponent, slot))
        timed = Found({}, {}, None, 0, 0.0, TIMED_ONLY)
        self.theirs = {
            slot: timed if opponent.engine in case.timed_only else ask(slot, opponent.contacts)
            for opponent, slot in self.opponents
        }
        self.ours = Ours(lambda sweeps: ask(case.ours(sweeps)))
        self.ours.at(case.sweeps)
        self.equal = {
            slot: self.ours.against(found, case.sweeps) for slot, found in self.theirs.items() if case.clock is not None
        }

    def units(self) -> list[Unit]:
        """Units to time, ours at 10 sweeps first: it is timed as long as any other."""
        case = self.case
        if case.clock is None:
            return []
        sweeps = dict.fromkeys([case.sweeps, *(found for found, _ in self.equal.values() if found)])
        begin, lasting = case.clock
        warm_up = step_count(begin, case.dt) if begin else 0
        bodies = sum(body.motion == "free" for body in scene_of(case.ours(case.sweeps)).bodies)
        slots = [case.ours(count) for count in sweeps] + [
            slot for slot, found in self.theirs.items() if found.reason in ("", TIMED_ONLY)
        ]
        steps = step_count(lasting, case.dt)
        return [Unit("work", slot, "", bodies, warm_up, steps) for slot in slots]

    def rows(self, timings: Timings) -> Iterator[Row]:
        """Rows of this scene."""
        case, sweeps = self.case, self.case.sweeps
        for opponent, slot in self.opponents:
            if case.clock is None:
                yield self._drift_row(slot)
                continue
            equal, reason = self.equal[slot]
            for at, count, why in ((AT_SWEEPS, sweeps, self.theirs[slot].reason), (AT_ERROR, equal, reason)):
                asked = case.against[opponent.engine] if at == opponent.floor else ()
                yield self._ratio_row(slot, at, count, why, asked, timings)

    def _drift_row(self, slot: Slot) -> Row:
        ours, limit = self.ours.at(self.case.sweeps), self.case.drift
        largest = max(ours.errors.values(), default=None)
        return self._row(slot, AT_END, self.case.sweeps, ours, (largest, None, None), (limit, None), {}, ours.reason)

    def _ratio_row(
        self,
        slot: Slot,
        at: str,
        count: int | None,
        why: str,
        asked: Sequence[float],
        timings: Timings,
    ) -> Row:
        case = self.case
        ours = self.ours.at(count or max(self.ours.known))
        own = timings.get(case.ours(count), {}) if count else {}
        other = timings.get(slot, {})
        # Their step over ours: above 1 ours is faster.
        found = ratio(other, own)
        interval = (found.median, found.low, found.high) if found else (None, None, None)
        counts: dict[str, Any] = {"rounds": found.n if found else 0}
        for side, rounds in (("our", own), ("their", other)):
            for timing in list(rounds.values())[-1:]:
                counts |= {"bodies": timing.bodies, "steps": timing.steps, f"{side}_state": timing.state_hash}
                counts[f"{side}_step_s"] = spread([each.seconds / each.steps for each in rounds.values()]).median
        floor, target = (asked[0], asked[1]) if asked else (None, None)
        return self._row(
            slot, at, count, ours, interval, (floor, target), counts, why or ("" if found else "not timed")
        )

    def _row(
        self,
        slot: Slot,
        at: str,
        count: int | None,
        ours: Found,
        interval: tuple[float | None, float | None, float | None],
        asked: tuple[float | None, float | None],
        counts: Mapping[str, Any],
        reason: str,
    ) -> Row:
        theirs = self.theirs[slot]
        counts = {**counts, "our_contacts": ours.contacts, "their_contacts": theirs.contacts}
        return Row(
            self.case.title,
            f"{slot.engine}/{slot.profile}",
            at,
            *interval,
            *asked,
            ours.errors,
            theirs.errors,
            count,
            counts,
            reason,
        )


def lead(points: pd.DataFrame, twice: tuple[float, float]) -> Row:
    """Share of (scene, error level) in a stored bench at which ours is at least twice as fast as the best engine.

    It counts the levels that another engine reaches. The number that only ours reaches is separate.
    """
    import pandas as pd

    levels = time_at_equal_error(points)
    levels = levels[levels["rank"].notna()]
    ours = levels["engine"] == registry.solver()
    keys = ["scene", "dimension", "level"]
    best = [levels[side].groupby(keys)["cost"].min() for side in (ours, ~ours)]
    both = pd.concat(best, axis=1, keys=["ours", "theirs"])
    reached = both[both["theirs"].notna()]
    ahead = int((2.0 * reached["ours"] <= reached["theirs"]).sum())
    share = ahead / len(reached) if len(reached) else math.nan
    counts = {"ahead": ahead, "levels": len(reached), "only_ours": int(both["theirs"].isna().sum())}
    value = share if math.isfinite(share) else None
    title = "levels of error in the stored bench where ours is twice as fast"
    return Row(title, "others", AT_ERROR, value, None, None, *twice, {}, {}, None, counts)
