"""Proofs of causes: the row fails, passes with the mechanism switched off, and other explanations do not help.

A reason that passes its experiments is the cause on those rows; one that fails them is wrong, however plausible.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from adapters.engine_folder import experiments_of
from adapters.experiment import Experiment
from validation.cells import Observation, Slot
from validation.findings.files import findings_of
from validation.judging.studies import results_of, study_of
from validation.posed import resolve
from validation.running.plan import QUICK_DT
from validation.settings.switching import Reading, observe, reading, readings, switched


@dataclass(frozen=True)
class Proof:
    """Result of one experiment.

    Parameters
    ----------
    before, after
        The row without changes and with the mechanism off.
    idle
        The row with each setting of other explanations.
    """

    engine: str
    experiment: Experiment
    before: Reading
    after: Reading
    idle: tuple[Reading, ...]

    @property
    def holds(self) -> bool:
        """Whether the experiment confirms the cause."""
        within = self.experiment.within
        return (
            fails(self.before, within) and passes(self.after, within) and all(fails(each, within) for each in self.idle)
        )

    @property
    def why_not(self) -> str:
        """What failed; empty if it holds."""
        within = self.experiment.within
        said = [] if fails(self.before, within) else ["the check does not fail without the change"]
        said += [] if passes(self.after, within) else ["it does not pass with the mechanism switched off"]
        said += [f"it passes with {dict(each.slot.switched)}" for each in self.idle if not fails(each, within)]
        return "; ".join(said)


def passes(found: Reading, within: float = 0.0) -> bool:
    """Measured, and within the tolerance, or within the round-off that an experiment allows."""
    return found.value is not None and (found.badness <= 1.0 or _off(found) <= within)


def fails(found: Reading, within: float = 0.0) -> bool:
    """Measured, and outside of both: a cell without a result proves nothing."""
    return found.value is not None and found.badness > 1.0 and _off(found) > within


def _off(found: Reading) -> float:
    """Distance from the truth; infinite where there is none."""
    truth = found.check.truth
    return math.inf if truth is None or found.value is None else abs(found.value - truth)


def prove(engine: str, experiments: Iterable[Experiment], jobs: int = 1) -> list[Proof]:
    """Run experiments; cells that several share run once."""
    experiments = list(experiments)
    wanted: list[Slot] = []
    for experiment in experiments:
        for slot in _versions(engine, experiment):
            wanted += _cells(slot, experiment.metric)
    seen = observe(wanted, jobs)
    return [_proof(engine, experiment, seen) for experiment in experiments]


def experiments_on(engine: str) -> list[Experiment]:
    """All experiments on ``engine``: proofs of its families, and those that its package states in Python.

    Raises
    ------
    FindingsError
        If its files of findings are wrong.
    """
    known = findings_of(engine)
    proofs = [proof for family in known.families.values() for proof in family.proofs] if known else []
    return [*proofs, *experiments_of(engine)]


def slot_of(engine: str, experiment: Experiment) -> Slot:
    """The cell of an experiment's row, with the profile's settings."""
    e = experiment
    return Slot(
        e.scene, tuple(sorted(e.params.items())), e.dimension, engine, e.profile, e.dt or QUICK_DT, e.iterations
    )


def _versions(engine: str, experiment: Experiment) -> list[Slot]:
    """The row's slot unchanged, with the mechanism off, and with each idle change."""
    slot = slot_of(engine, experiment)
    return [slot, switched(slot, experiment.off), *(switched(slot, change) for change in experiment.idle)]


def _cells(slot: Slot, metric: str) -> list[Slot]:
    """Cells of a metric: the slot itself, or all cells of a study."""
    if study_of(slot.scene, metric) is None:
        return [slot]
    return [slot.with_params(variation.params) for variation in resolve(slot.scene).variations("standard")]


def _proof(engine: str, experiment: Experiment, seen: dict[Slot, Observation]) -> Proof:
    before, after, *idle = (_read(slot, experiment.metric, seen) for slot in _versions(engine, experiment))
    return Proof(engine, experiment, before, after, tuple(idle))


def _read(slot: Slot, metric: str, seen: dict[Slot, Observation]) -> Reading:
    cells = _cells(slot, metric)
    if cells == [slot]:
        return reading(seen[slot], metric)
    study = study_of(slot.scene, metric)
    assert study is not None
    found = list(results_of(study, resolve(slot.scene), [seen[cell] for cell in cells]))
    if not found:
        return Reading(slot, readings(seen[cells[0]])[0].check, None, "the cases of the study have no result")
    return Reading(slot, found[0].check, found[0].value, found[0].reason)
