"""What laws say about many failing rows, asked in processes side by side: most of the time that judging takes."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool

from adapters.engine import EngineError
from adapters.engine_folder import covering, laws_of
from adapters.isolation import end_with
from adapters.registry import load_engines_here
from adapters.scene import Scene
from validation.cells import Slot
from validation.judging.verdicts import Prediction, predicted
from validation.posed import resolve
from validation.workers.limits import cores

#: A row about which laws are asked: its cell, the engine's version, its metric.
Asked = tuple[Slot, str, str]
#: What a law said, without the law, which cannot leave its process: its place among its engine's, centre and band.
Said = tuple[int, float, float]
#: Rows below which no process is started: each imports for about two seconds, a law takes some 4 ms on average.
MANY = 2000
#: Rows of one task: a row of a column takes a second, and neighbouring rows share the march that they are read from.
TOGETHER = 64


def predictions(slot: Slot, version: str, metric: str, scene: Scene) -> list[Prediction]:
    """What the deviation laws of an engine say about a row.

    Raises
    ------
    EngineError
        If the engine has laws that cannot be had.
    """
    laws = covering(slot.engine, version, slot.profile, scene.name, metric)
    return predicted(laws, scene, slot, resolve(slot.scene).measure)


def foretold(rows: Sequence[Asked], processes: int = 0) -> Mapping[Asked, list[Prediction]]:
    """Predictions of rows that are too many to be asked one after the other; nothing of few, or where no process lives.

    Parameters
    ----------
    rows
        Failing rows of scenes of the catalogue, those of a cell one after the other.
    processes
        How many processes; 0: one per core.
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
        pass  # what is missing is asked where it is needed
    return found


def _begin(parent: int) -> None:
    end_with(parent)
    load_engines_here()


def _said(rows: Sequence[Asked]) -> list[list[Said] | None]:
    """In a process of its own: what the laws say about each row, None where they cannot be had."""
    return [_said_of(*row) for row in rows]


def _said_of(slot: Slot, version: str, metric: str) -> list[Said] | None:
    scene = resolve(slot.scene).scene(slot.dimension, dict(slot.params))
    try:
        found = predictions(slot, version, metric, scene)
    except EngineError:
        return None
    places = {id(law): place for place, law in enumerate(laws_of(slot.engine))}
    return [(places[id(law)], centre, band) for law, centre, band in found]
