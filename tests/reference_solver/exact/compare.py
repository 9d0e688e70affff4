"""Compare the event loop with the stored answers of the earlier solver.

    python tests/reference_solver/exact/compare.py [FILE] [--only TEXT] [--limit SECONDS]

prints one line for each world that is not the same, and the counts. *Same* is within X of both, as far as the stored
certificate holds; *refused* is one sentence of the loop; all else is *different*. Worlds whose certificate does not
hold are counted apart, since nobody knows them.
"""

from __future__ import annotations

import argparse
import signal
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from oracle import KEPT, Answer, World, stored, world_of

from reference_solver import Settings, Simulation
from reference_solver.certificate.relations import Change
from reference_solver.certificate.truth import distance
from reference_solver.exact import Refused
from reference_solver.settings import TOLERANCE

#: Coarser tolerance with which the loop is run again: twice the difference bounds the error of the finer run if that
#: of the coarser one is half as large again.
COARSER = 10.0
#: What both may differ by where X of the oracle is smaller: its X knows places to some last places only [m].
LEAST = 1e-11


class Late(Exception):
    """A world that takes longer than it may."""


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Raise `Late` in what takes more CPU."""

    def late(*_: object) -> None:
        raise Late

    before = signal.signal(signal.SIGPROF, late)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


@dataclass(frozen=True)
class Verdict:
    """What became of a world: a word, how far apart both are [m], what is allowed, seconds of CPU."""

    key: str
    word: str
    apart: float
    allowed: float
    cpu: float
    said: str


def poses(world: World, tolerance: float | None = None) -> tuple[np.ndarray, str]:
    """Return poses (s, n, 3 | 7) as far as the loop has them, and why it has no more."""
    settings = Settings.reference(world.dt) if tolerance is None else Settings.reference(world.dt, tolerance)
    simulation = Simulation(world.model, settings)
    found, why = [simulation.pose], ""
    try:
        for _ in range(world.samples):
            simulation.advance(world.stride)
            found.append(simulation.pose)
    except Refused as refused:
        why = str(refused)
    return np.array(found), why


def compared(known: Answer, limit: float, change: Change | None = None) -> Verdict:
    """Return the verdict of a world, or of the same as another observer sees it."""
    world, truth = world_of(known.key), np.array(known.pose)
    if change is not None:
        world = replace(world, model=change.model(world.model))
        truth = change.pose(truth, np.array(known.t))
    begin = time.process_time()
    try:
        with limited(limit):
            found, why = poses(world)
            cpu = time.process_time() - begin
            coarser, _ = poses(world, COARSER * TOLERANCE)
    except Late:
        return Verdict(known.key, "late", np.nan, np.nan, limit, f"after {limit:g} s")
    except Exception as error:  # what is no refusal is a fault of the loop
        return Verdict(
            known.key, "fault", np.nan, np.nan, time.process_time() - begin, f"{type(error).__name__}: {error}"
        )
    if not known.t:
        return Verdict(known.key, "unknown", np.nan, np.nan, cpu, known.reasons[0])
    count = min(len(found), len(coarser), len(known.t))
    t, horizon = np.array(known.t[:count]), np.inf if known.horizon is None else known.horizon
    end = min(horizon, np.inf if known.determined is None else known.determined)
    error = np.array([np.inf if x is None else x for x in known.error[:count]])
    own = 2.0 * distance(world.model, found[:count], coarser[:count])
    apart = distance(world.model, found[:count], truth[:count])
    allowed = error + own + LEAST
    told = t < end
    worst = int(np.argmax(np.where(told, apart / allowed, 0.0))) if told.any() else 0
    values = float(apart[worst]), float(allowed[worst]), cpu
    if not known.holds:
        word = "refused by both" if why else "unknown"
        return Verdict(known.key, word, *values, why or known.reasons[0])
    if why and count - 1 < np.count_nonzero(np.array(known.t) < end):
        return Verdict(known.key, "refused", *values, why)
    if (apart <= allowed)[told].all():
        return Verdict(known.key, "same", *values, "")
    return Verdict(known.key, "different", *values, f"at {t[worst]:.4g} s; certificate: {known.reasons[:1]}")


def main() -> None:
    """Print what became of every stored world."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path, nargs="?", default=KEPT)
    parser.add_argument("--only", default="", help="worlds whose key begins so")
    parser.add_argument("--limit", type=float, default=20.0, help="CPU of a world")
    asked = parser.parse_args()
    for key in ("standard pyramid 2-D", "standard pyramid 3-D", "standard masse 3-D"):
        poses(world_of(key))  # compiles what there is, before a limit counts
    counts: dict[str, Counter[str]] = {}
    cpu: Counter[str] = Counter()
    for known in stored(asked.file):
        if not known.key.startswith(asked.only):
            continue
        verdict = compared(known, asked.limit)
        kind = known.key.partition(" ")[0]
        counts.setdefault(kind, Counter())[verdict.word] += 1
        cpu[kind] += verdict.cpu
        if verdict.word != "same":
            said = f"{verdict.apart:.1e} of {verdict.allowed:.1e} m" if np.isfinite(verdict.apart) else ""
            print(f"{verdict.key}: {verdict.word} {said} ({verdict.cpu:.1f} s) {verdict.said[:150]}", flush=True)
    for kind, found in counts.items():
        print(f"{kind}: {dict(found)}, {cpu[kind]:.1f} s of CPU")


if __name__ == "__main__":
    main()
