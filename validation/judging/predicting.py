"""Predictions of contact laws for many failing rows, in parallel processes: most of the time of judging."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool

from adapters.engine import EngineError
from adapters.engine_folder import covering, laws_of
from adapters.isolation import end_with
from adapters.law import metric_of
from adapters.registry import load_engines_here
from adapters.scene import Scene
from adapters.trajectory import Measured, Trajectory
from validation.cells import Slot, scene_of
from validation.judging.verdicts import Prediction, predicted
from validation.posed import resolve
from validation.workers.limits import cores

#: A row for predictions: its cell, the engine's version, its metric.
Asked = tuple[Slot, str, str]
#: A prediction without its law, which cannot be pickled: index of the law, centre and band.
Said = tuple[int, float, float]
Measures = dict[str, Measured]
#: Fewest rows for which processes are started: each imports for about two seconds, a law takes some 4 ms on average.
MANY = 2000
#: Rows of one task: a row of a column takes a second, and neighbouring rows share one recurrence.
TOGETHER = 64


def predictions(slot: Slot, version: str, metric: str, scene: Scene) -> list[Prediction]:
    """Predictions of an engine's contact laws for a row.

    Raises
    ------
    EngineError
        If the engine has laws that cannot be loaded.
    """
    laws = covering(slot.engine, version, slot.profile, scene.name, metric)
    return predicted(laws, scene, slot, resolve(slot.scene).measure)


def cause_in_file(slot: Slot, version: str, metric: str, value: float, scene: Scene) -> str:
    """What a contact law of the engine says of a value of a scene file; empty if none predicts it.

    A law of a catalogue scene predicts the motion of every scene that it fits, and this value is measured of that. It
    is a cause in words: what the author of a file states is excused by no law.
    """
    measure, known = resolve(slot.scene).measure, set[str]()
    for law in laws_of(slot.engine):
        name, seen = metric_of(law.metric), list[Scene]()
        if not law.covers(slot.engine, version, slot.profile, law.scene, name) or law.because in known:
            continue

        def told(made: Scene, found: Trajectory, name: str = name, seen: list[Scene] = seen) -> Measures:
            seen.append(made)
            return {name: measure(made, found)[metric]}

        try:
            said = law.says(scene, slot.dt, told, slot.iterations)
        except (ArithmeticError, AssertionError, LookupError, ValueError):  # a law of scenes with other bodies
            continue
        if not seen or said is None:  # what it says is of a check of its own
            continue
        known.add(law.because)
        centre, band = said
        if abs(value - centre) <= band:
            return f"{law.because} (predicted {centre:.6g} +- {band:.1g})"
    return ""


def foretold(rows: Sequence[Asked], processes: int = 0) -> Mapping[Asked, list[Prediction]]:
    """Predictions of many rows, made in parallel; empty for few rows, or where processes fail.

    Parameters
    ----------
    rows
        Failing rows of catalogue scenes, ordered by cell.
    processes
        Number of processes; 0: one per core.
    """
    if len(rows) < MANY:
        return {}
    parts = [rows[first : first + TOGETHER] for first in range(0, len(rows), TOGETHER)]
    context = multiprocessing.get_context("spawn")
    found: dict[Asked, list[Prediction]] = {}
    try:
        with ProcessPoolExecutor(processes or cores(), context, _begin, (os.getpid(),)) as pool:
            for part, answers in zip(parts, pool.map(_said, parts), strict=True):
                for row, said in zip(part, answers, strict=True):
                    if said is not None:
                        laws = laws_of(row[0].engine)
                        found[row] = [(laws[place], centre, band) for place, centre, band in said]
    except BrokenProcessPool:
        pass  # missing predictions are made where they are needed
    return found


def _begin(parent: int) -> None:
    end_with(parent)
    load_engines_here()


def _said(rows: Sequence[Asked]) -> list[list[Said] | None]:
    """In a separate process: predictions for each row, None where the laws cannot be loaded."""
    return [_said_of(*row) for row in rows]


def _said_of(slot: Slot, version: str, metric: str) -> list[Said] | None:
    scene = scene_of(slot)
    try:
        found = predictions(slot, version, metric, scene)
    except EngineError:
        return None
    places = {id(law): place for place, law in enumerate(laws_of(slot.engine))}
    return [(places[id(law)], centre, band) for law, centre, band in found]
