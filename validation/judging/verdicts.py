"""Verdicts: pure functions of measurements. Physics and standing are never mixed.

physics
    PASS or FAIL against the truth, with the same tolerance for all engines, whatever is known of an engine.
standing
    of a failing row: *explained* by a contact law, *known* (a finding lists it, and its value lies within the finding's
    band), *new*, or *drifted*: outside the band of its law or finding, on either side.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum

from adapters.law import Deviation, Measure
from adapters.scene import Scene
from validation.canonical import Check
from validation.cells import Slot
from validation.findings import Finding, Known

#: Begin of the reason of a check that has a tolerance and no verdict.
NOT_JUDGED = "not judged"
#: A law, its predicted value and its band.
Prediction = tuple[Deviation, float, float]


class Physics(Enum):
    """Against the truth."""

    PASS = "pass"
    FAIL = "fail"


class Standing(Enum):
    """Against laws and findings."""

    EXPLAINED = "explained"
    KNOWN = "known"
    NEW = "new"
    DRIFTED = "drifted"


@dataclass(frozen=True)
class Verdict:
    """Physics, standing and, in one line, why."""

    physics: Physics | None
    standing: Standing | None
    reason: str = ""


def judge_physics(value: float | None, check: Check) -> Physics | None:
    """PASS if |value - truth| <= bound; None where nothing was measured, or there is no truth, or no finite bound."""
    if value is None or check.truth is None or check.bound is None or not math.isfinite(check.bound):
        return None
    error = abs(value - check.truth)
    return Physics.PASS if math.isfinite(error) and error <= check.bound else Physics.FAIL


def is_marginal(value: float, check: Check) -> bool:
    """Within a factor of two of the tolerance, on either side."""
    if check.truth is None or check.bound is None:
        return False
    return 0.5 * check.bound <= abs(value - check.truth) <= 2.0 * check.bound


def predicted(laws: Iterable[Deviation], scene: Scene, slot: Slot, measure: Measure) -> list[Prediction]:
    """Laws with a prediction for this scene and step, with value and band.

    ``measure`` is the scene's: a law predicts a motion, from which the row's value is measured.
    """
    said = ((law, law.says(scene, slot.dt, measure, slot.iterations)) for law in laws)
    return [(law, *prediction) for law, prediction in said if prediction is not None]


def judge(value: float | None, check: Check, predictions: Iterable[Prediction], known: Known, why: str = "") -> Verdict:
    """Judge one measured value.

    Parameters
    ----------
    predictions
        Predictions of the engine's contact laws.
    known
        The findings about its row.
    why
        Why there is no value, if there is none.
    """
    if check.truth is None or check.bound is None:
        return Verdict(None, None)
    if not math.isfinite(check.bound):
        return Verdict(None, None, f"{NOT_JUDGED}: the tolerance is {check.bound}")
    if value is None:
        return _without_value(known, why)
    physics = judge_physics(value, check)
    predictions = list(predictions) if physics is Physics.FAIL else []
    for law, centre, band in predictions:
        if abs(value - centre) <= band:
            return Verdict(physics, Standing.EXPLAINED, f"{law.because} (predicted {centre:.6g} +- {band:.1g})")
    if predictions:  # a row with a law is judged by the law: no list excuses it
        law, centre, band = predictions[0]
        return Verdict(
            physics, Standing.DRIFTED, f"outside the band of its contact law, {centre:.6g} +- {band:.1g}: {law.because}"
        )
    if known.finding is not None:
        return _against_finding(physics, value, known.finding)
    if physics is Physics.PASS:
        return Verdict(physics, None)
    return _unlisted(physics, known, "not on record, and no contact law predicts it")


def _without_value(known: Known, why: str) -> Verdict:
    """A judged check must have a value, unless it is listed with the reason why there is none."""
    finding = known.finding
    if finding is None:
        return _unlisted(None, known, "; ".join(filter(None, ("has no value; not on record", why))))
    if finding.value is None and not finding.diverged:
        return Verdict(None, Standing.KNOWN, finding.family.reason)
    return Verdict(None, Standing.DRIFTED, f"has no value now; {_listed_as(finding)}")


def _against_finding(physics: Physics | None, value: float, finding: Finding) -> Verdict:
    if not finding.holds(value):
        passes = "passes, but " if physics is Physics.PASS else ""
        return Verdict(physics, Standing.DRIFTED, f"{passes}{_listed_as(finding)}")
    marginal = "passes within the band of the known failure: " if physics is Physics.PASS else ""
    return Verdict(physics, Standing.KNOWN, f"{marginal}{finding.family.reason}")


def _listed_as(finding: Finding) -> str:
    if finding.value is None:
        return f"on record as {'diverging' if finding.diverged else 'having no value'}: {finding.family.reason}"
    return f"on record with {finding.band_text}: {finding.family.reason}"


def _unlisted(physics: Physics | None, known: Known, why: str) -> Verdict:
    said = "; ".join(filter(None, (why if known.expected else "", known.remark)))
    return Verdict(physics, Standing.NEW if known.expected else None, said)


def judge_divergence(known: Known, why: str) -> Verdict:
    """A cell that ended with numbers that are not finite fails every check; *known* if listed as diverging."""
    if known.finding is None:
        said = "; ".join(filter(None, (why, known.remark)))
        return Verdict(Physics.FAIL, Standing.NEW if known.expected else None, said)
    if known.finding.diverged:
        return Verdict(Physics.FAIL, Standing.KNOWN, f"{why}; {known.finding.family.reason}")
    return Verdict(Physics.FAIL, Standing.DRIFTED, f"{why}; {_listed_as(known.finding)}")
