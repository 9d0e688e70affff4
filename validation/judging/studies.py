"""Studies: results of several cells of a scene together (thresholds, suprema), judged like an observation.

A scene declares its studies (`CanonicalScene.studies`); they run here.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from validation.canonical import CanonicalScene, Check, Member, Study
from validation.catalogue import CATALOGUE
from validation.cells import Observation, Outcome, Slot


@dataclass(frozen=True)
class StudyResult:
    """One judged number of one study for one engine, profile, dimension and step."""

    slot: Slot
    observation: Observation
    check: Check
    value: float | None
    reason: str
    cells: tuple[str, ...]


def study_of(scene: str, metric: str) -> Study | None:
    """The study of a scene that has this metric; None if it is one of its checks."""
    studies = CATALOGUE[scene].studies if scene in CATALOGUE else ()
    return next((study for study in studies if study.name == metric), None)


def results(observations: Iterable[Observation]) -> Iterator[StudyResult]:
    """All studies of all scenes among the observations, in the order of the catalogue."""
    by_scene: dict[str, list[Observation]] = defaultdict(list)
    for observation in observations:
        by_scene[observation.slot.scene].append(observation)
    for name, canonical in CATALOGUE.items():
        for study in canonical.studies if name in by_scene else ():
            yield from results_of(study, canonical, by_scene[name])


def results_of(study: Study, canonical: CanonicalScene, observations: Iterable[Observation]) -> Iterator[StudyResult]:
    """Reduce every group of cells of a scene that differ in parameters only."""
    groups: dict[Slot, list[Observation]] = defaultdict(list)
    for observation in observations:
        if observation.slot.scene == canonical.name and not observation.slot.ulp:
            groups[observation.slot.with_params({})].append(observation)
    for slot, group in groups.items():
        good = [observation for observation in group if observation.outcome is Outcome.OK]
        reduced = study.reduce(_members(canonical, good)) if good else None
        if reduced is not None:
            value, reason, check = reduced
            cells = tuple(observation.cell for observation in good)
            yield StudyResult(slot, good[0], check, value, reason, cells)


def _members(canonical: CanonicalScene, observations: Sequence[Observation]) -> list[Member]:
    return [
        Member(o.slot.dimension, o.slot.dt, canonical.complete(dict(o.slot.params)), o.metrics) for o in observations
    ]
