"""Detection power: faults of three sizes are planted in a correct engine, and the checks that notice them are listed.

    healthy engine --fault, size--> Planted --receipts--> broken?
                                       |
                                       +--the scenes' cells--> checks that pass on the healthy engine and fail now

A fault that no check of a scene notices must be noticed by a property check. A scene's primary quantity that does not
notice one per cent of a parameter on which it depends is a `BlindSpot`, with the effect of the fault and the tolerance.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from adapters.conformance.planted_faults import SIZED, Planted
from adapters.engine import Engine, EngineError
from adapters.needs import needs
from adapters.receipts import receipts
from adapters.scene import Scene
from adapters.stepping import posed_for, run
from adapters.trajectory import Measured
from validation.canonical import Params
from validation.catalogue import CATALOGUE
from validation.judging.verdicts import Physics, judge_physics
from validation.running.plan import QUICK_DT

#: Ten per cent, one, and one in a thousand.
SIZES = (0.1, 0.01, 0.001)
#: Parameters of contacts and bodies: a primary quantity that does not notice one per cent of them must have a reason.
ASKED = ("restitution", "friction", "gravity", "mass", "inertia")
ONE_PER_CENT = 0.01
#: A quantity depends on a parameter if one per cent changes it by this share of its tolerance: with less, only an error
#: beyond 100 % would be noticed.
HANGS_ON = 0.01
#: Shortest step of a rerun of a blind spot, as a share of its step. An effect of a hundredth of the tolerance
#: (`HANGS_ON`) is noticed at a hundredth of the step; 1/128 is the next power of two.
FINEST = 1.0 / 128.0


@dataclass(frozen=True)
class Seen:
    """A check or property check and the smallest of `SIZES` of a fault that it notices; None: it does not."""

    scene: str
    watcher: str
    fault: str
    size: float | None


@dataclass(frozen=True)
class BlindSpot:
    """A primary quantity that does not notice one per cent of a parameter: the fault changes it by ``moved``.

    ``allowed`` is its tolerance in the same unit, for one step of ``dt``. ``seen_by`` are checks of the same scene that
    notice the fault. ``seen_at`` is the longest step [s], by halves of ``dt``, at which the same check notices it,
    planted and run there; None if no step down to `FINEST` of ``dt`` does. It proves that the error of the step hides
    the fault, not a tolerance beyond that.
    """

    scene: str
    metric: str
    fault: str
    moved: float
    allowed: float
    seen_by: tuple[str, ...]
    seen_at: float | None = None

    @property
    def seen_from(self) -> float:
        """Size of the fault [%] that would change the quantity by its tolerance, if both are proportional."""
        return 100.0 * ONE_PER_CENT * self.allowed / self.moved


@dataclass(frozen=True)
class Detected:
    """Which checks notice which faults, and blind spots."""

    seen: list[Seen]
    blind: list[BlindSpot]


@dataclass(frozen=True)
class Watched:
    """Whether a property check or check holds; for a check also its value and tolerance."""

    holds: bool
    value: float | None = None
    allowed: float | None = None


#: Property checks and checks of one cell, by name.
Watchers = dict[str, Watched]


def detection(
    engine: Engine,
    profile: str,
    dimension: int,
    dt: float = QUICK_DT,
    others: Iterable[tuple[Engine, str]] = (),
    scenes: Collection[str] | None = None,
) -> Detected:
    """Plant every fault in ``engine``; for each the checks that notice it, and from which size on.

    Parameters
    ----------
    engine, profile
        A correct engine: checks that fail without a fault are left out.
    others
        Engines with profiles: the first that supports a scene replaces ``engine`` where that does not. Scenes that none
        supports are left out.
    scenes
        Names of canonical scenes; None: all.

    Returns
    -------
    One entry per scene, check or property check (``receipt mass``, of ``any`` scene), and fault; and the blind spots.
    """
    seen: dict[tuple[str, str, str], float | None] = {}
    missed: dict[tuple[str, str, str], _Missed] = {}
    candidates = [(engine, profile), *others]
    asked = CATALOGUE if scenes is None else {name: CATALOGUE[name] for name in scenes}
    there = {name: canonical for name, canonical in asked.items() if dimension in canonical.dimensions}
    cells = [(name, params) for name, canonical in there.items() for params in canonical.planted]
    for scene, params in cells:
        made = CATALOGUE[scene].scene(dimension, params)
        able = [pair for pair in candidates if _can_pose(pair[0], made)]
        if not able:
            continue
        taken, own_profile = able[0]
        healthy = _watchers(taken, own_profile, scene, params, dimension, dt)
        primary = _primary(scene, params, dimension, dt, healthy)
        for fault in SIZED:
            smallest: dict[str, float] = {}
            for size in sorted(SIZES, reverse=True):
                faulty = _watchers(Planted(taken, fault, size), own_profile, scene, params, dimension, dt)
                smallest |= {name: size for name, own in healthy.items() if own.holds and not faulty[name].holds}
                if size == ONE_PER_CENT and fault in ASKED:
                    for name, moved, allowed in _missed(primary, healthy, faulty):
                        key = (scene, name.partition("[")[0], fault)
                        found = _Missed(moved, allowed, name, params, taken, own_profile)
                        missed[key] = max(missed.get(key, found), found, key=lambda each: each.share)
            for name, own in healthy.items():
                if own.holds:
                    watched = "any" if name.startswith("receipt ") else scene  # probes are the same for every scene
                    key = (watched, name.partition("[")[0], fault)
                    sizes = [s for s in (seen.get(key), smallest.get(name)) if s is not None]
                    seen[key] = min(sizes, default=None)
    return Detected([Seen(*key, size) for key, size in seen.items()], list(_blind(seen, missed, dimension, dt)))


@dataclass(frozen=True)
class _Missed:
    """A primary quantity that holds with one per cent of a fault and without it, in one cell, and by how much."""

    moved: float
    allowed: float
    name: str
    params: Params
    engine: Engine
    profile: str

    @property
    def share(self) -> float:
        """Effect of the fault over the tolerance."""
        return self.moved / self.allowed


def _can_pose(engine: Engine, scene: Scene) -> bool:
    """Whether the engine supports the scene."""
    try:
        posed_for(engine, scene)
    except EngineError:
        return False
    return True


def _missed(primary: Iterable[str], healthy: Watchers, faulty: Watchers) -> Iterator[tuple[str, float, float]]:
    """Primary quantities that pass with and without the fault although it changes them: by how much, and the bound."""
    for name in primary:
        own, other = healthy[name], faulty[name]
        if own.holds and other.holds and own.value is not None and other.value is not None and own.allowed:
            moved = abs(other.value - own.value)
            if moved > HANGS_ON * own.allowed:
                yield name, moved, own.allowed


def _blind(
    seen: Mapping[tuple[str, str, str], float | None],
    missed: Mapping[tuple[str, str, str], _Missed],
    dimension: int,
    dt: float,
) -> Iterator[BlindSpot]:
    """Quantities that notice one per cent in no cell of their scene, each with the checks that do."""
    sharp = {key for key, size in seen.items() if size is not None and size <= ONE_PER_CENT}
    for (scene, metric, fault), found in missed.items():
        if (scene, metric, fault) not in sharp:
            by = tuple(
                name for where, name, what in seen if (where, what) == (scene, fault) and (where, name, what) in sharp
            )
            at = _seen_at(found, scene, fault, dimension, dt)
            yield BlindSpot(scene, metric, fault, found.moved, found.allowed, by, at)


def _seen_at(found: _Missed, scene: str, fault: str, dimension: int, dt: float) -> float | None:
    """Longest half, quarter, ... of ``dt`` at which the check notices one per cent of the fault; None: none of them.

    The effect of the fault follows from the law; only steps with a smaller tolerance than that are run.
    """
    canonical = CATALOGUE[scene]
    made, shorter = canonical.scene(dimension, found.params), 0.5 * dt
    planted = Planted(found.engine, fault, ONE_PER_CENT)
    while shorter >= FINEST * dt:
        (allowed,) = (check.bound for check in canonical.checks(made, shorter) if check.metric == found.name)
        if allowed is not None and allowed < 2.0 * found.moved:
            asked = (found.profile, scene, found.params, dimension, shorter)
            if _checks(found.engine, *asked)[found.name].holds and not _checks(planted, *asked)[found.name].holds:
                return shorter
        shorter *= 0.5
    return None


def _primary(scene: str, params: Params, dimension: int, dt: float, healthy: Watchers) -> list[str]:
    """Judged quantities that the scene's primary error uses."""
    canonical = CATALOGUE[scene]
    if canonical.primary is None:
        return []
    asked = _Asked({name: (own.value, "") for name, own in healthy.items()})
    canonical.primary.error(canonical.scene(dimension, params), dt, asked)
    return [name for name in dict.fromkeys(asked.names) if name in healthy]


class _Asked(dict[str, Measured]):
    """Metrics that record which of them were read."""

    def __init__(self, metrics: Mapping[str, Measured]) -> None:
        super().__init__(metrics)
        self.names: list[str] = []

    def __getitem__(self, name: str) -> Measured:
        self.names.append(name)
        return super().__getitem__(name)

    def get(self, name: str, default: Any = None) -> Any:
        self.names.append(name)
        return super().get(name, default)


def _watchers(engine: Engine, profile: str, scene: str, params: Params, dimension: int, dt: float) -> Watchers:
    """All property checks and checks of one cell."""
    wanted = needs(CATALOGUE[scene].scene(dimension, params))
    found = {f"receipt {slip.quantity}": Watched(slip.holds) for slip in receipts(engine, profile, wanted, dt)}
    return found | _checks(engine, profile, scene, params, dimension, dt)


def _checks(engine: Engine, profile: str, scene: str, params: Params, dimension: int, dt: float) -> Watchers:
    """Every check of one cell."""
    canonical = CATALOGUE[scene]
    made = canonical.scene(dimension, params)
    settings = {setting.name: setting.value for setting in engine.settings(profile, needs(made), dt)}
    trajectory = run(engine, made, dt, settings, canonical.sampling(made))
    measured = canonical.measure(made, trajectory) if trajectory.finish == "completed" else {}
    found = {}
    for check in canonical.checks(made, dt):
        value = measured.get(check.metric, (None, ""))[0]
        found[check.metric] = Watched(judge_physics(value, check) is Physics.PASS, value, check.bound)
    return found


def lines(found: list[Seen]) -> Iterator[dict[str, str]]:
    """One line per check or property check: its name, and for each fault the smallest size noticed (empty: none)."""
    for scene, watcher in sorted(dict.fromkeys((entry.scene, entry.watcher) for entry in found), key=_receipts_last):
        own = {entry.fault: entry.size for entry in found if (entry.scene, entry.watcher) == (scene, watcher)}
        shown = {fault: "" if size is None else f"{100.0 * size:g} %" for fault, size in own.items()}
        yield {"name": watcher if scene == "any" else f"{scene}/{watcher}", **shown}


def only_by_receipts(found: list[Seen]) -> dict[str, list[str]]:
    """Faults that no check of a scene notices, each with the property checks that do."""
    faults: dict[str, list[Seen]] = {}
    for entry in found:
        if entry.size is not None:
            faults.setdefault(entry.fault, []).append(entry)
    return {
        fault: sorted(entry.watcher.removeprefix("receipt ") for entry in by)
        for fault, by in faults.items()
        if all(entry.scene == "any" for entry in by)
    }


def _receipts_last(entry: tuple[str, str]) -> bool:
    return entry[0] == "any"
