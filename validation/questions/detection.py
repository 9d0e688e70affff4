"""Detection power: faults of three sizes are planted in a healthy engine, and whatever sees them is written down.

    healthy engine --fault, size--> Planted --receipts--> broken?
                                       |
                                       +--the scenes' cells--> checks that pass on the healthy engine and fail now

What no check of a scene sees must be seen by a receipt: that is what receipts are for.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from adapters.engine import Engine
from adapters.needs import needs
from adapters.planted_faults import SIZED, Planted
from adapters.receipts import receipts
from adapters.stepping import run
from validation.catalogue import CATALOGUE
from validation.judging.verdicts import Physics, judge_physics
from validation.running.plan import QUICK_DT

#: Ten per cent, one, and one in a thousand.
SIZES = (0.1, 0.01, 0.001)


@dataclass(frozen=True)
class Seen:
    """A check or receipt that sees a fault, and the smallest of `SIZES` at which it does; None: it is blind to it."""

    scene: str
    watcher: str
    fault: str
    size: float | None


def detection(engine: Engine, profile: str, dimension: int, dt: float = QUICK_DT) -> list[Seen]:
    """Plant every fault in ``engine``, and say what sees it from which size on.

    Parameters
    ----------
    engine, profile
        Healthy: whatever it fails without a fault sees nothing, and is left out.

    Returns
    -------
    One entry per scene, check or receipt (``receipt mass``, of ``any`` scene), and fault.
    """
    seen: dict[tuple[str, str, str], float | None] = {}
    there = {name: canonical for name, canonical in CATALOGUE.items() if dimension in canonical.dimensions}
    cells = [(name, params) for name, canonical in there.items() for params in canonical.planted]
    for scene, params in cells:
        healthy = _watchers(engine, profile, scene, params, dimension, dt)
        for fault in SIZED:
            smallest: dict[str, float] = {}
            for size in sorted(SIZES, reverse=True):
                faulty = _watchers(Planted(engine, fault, size), profile, scene, params, dimension, dt)
                smallest |= {name: size for name, holds in healthy.items() if holds and not faulty[name]}
            for name, holds in healthy.items():
                if holds:
                    watched = "any" if name.startswith("receipt ") else scene  # probes are the same for every scene
                    key = (watched, name.partition("[")[0], fault)
                    sizes = [s for s in (seen.get(key), smallest.get(name)) if s is not None]
                    seen[key] = min(sizes, default=None)
    return [Seen(*key, size) for key, size in seen.items()]


def _watchers(
    engine: Engine, profile: str, scene: str, params: Mapping[str, float], dimension: int, dt: float
) -> dict[str, bool]:
    """Every receipt and every check of one cell, and whether it holds."""
    canonical = CATALOGUE[scene]
    made = canonical.scene(dimension, params)
    wanted = needs(made)
    settings = {setting.name: setting.value for setting in engine.settings(profile, wanted, dt)}
    holds = {f"receipt {slip.quantity}": slip.holds for slip in receipts(engine, profile, wanted, dt)}
    trajectory = run(engine, made, dt, settings, canonical.sampling(made))
    measured = canonical.measure(made, trajectory) if trajectory.finish == "completed" else {}
    for check in canonical.checks(made, dt):
        holds[check.metric] = judge_physics(measured.get(check.metric, (None, ""))[0], check) is Physics.PASS
    return holds


def lines(found: list[Seen]) -> Iterator[dict[str, str]]:
    """One line per check or receipt: its name, and for each fault the smallest size seen (empty: it is blind)."""
    for scene, watcher in sorted(dict.fromkeys((entry.scene, entry.watcher) for entry in found), key=_receipts_last):
        own = {entry.fault: entry.size for entry in found if (entry.scene, entry.watcher) == (scene, watcher)}
        shown = {fault: "" if size is None else f"{100.0 * size:g} %" for fault, size in own.items()}
        yield {"name": watcher if scene == "any" else f"{scene}/{watcher}", **shown}


def only_by_receipts(found: list[Seen]) -> dict[str, list[str]]:
    """Faults that no check of a scene sees, each with the receipts that do."""
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
