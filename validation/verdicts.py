"""Verdicts: pure functions of what was measured. Physics and standing are never mixed.

physics
    PASS or FAIL against the truth under the engine-blind tolerance. Nothing an engine is known for changes it.
standing
    of a FAIL: *explained* by a deviation law, *known* (listed with a reason), *new*, or *drifted* (it left the band
    of its law, or passes where a FAIL is listed).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum

from adapters.scene import Scene
from validation.canonical import Check
from validation.cells import Slot
from validation.deviation import Deviation
from validation.findings import Finding

#: A law, the value it predicts, and the band it allows.
Prediction = tuple[Deviation, float, float]


class Physics(Enum):
    """Against the truth."""

    PASS = "pass"
    FAIL = "fail"


class Standing(Enum):
    """Against what is known."""

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
    """PASS if |value - truth| <= bound; None where nothing was measured or there is no truth."""
    if value is None or check.truth is None or check.bound is None:
        return None
    error = abs(value - check.truth)
    return Physics.PASS if math.isfinite(error) and error <= check.bound else Physics.FAIL


def is_marginal(value: float, check: Check) -> bool:
    """Within a factor of two of the tolerance, on either side."""
    if check.truth is None or check.bound is None:
        return False
    return 0.5 * check.bound <= abs(value - check.truth) <= 2.0 * check.bound


def predicted(laws: Iterable[Deviation], scene: Scene, slot: Slot) -> list[Prediction]:
    """Laws that say something about this scene and step, with value and band."""
    said = ((law, law.law(scene, slot.dt)) for law in laws)
    return [(law, *prediction) for law, prediction in said if prediction is not None]


def judge(
    value: float | None,
    check: Check,
    predictions: Iterable[Prediction],
    finding: Finding | None,
    has_list: bool,
) -> Verdict:
    """Judge one measured value.

    Parameters
    ----------
    predictions
        What the engine's deviation laws predict for it.
    finding
        Its entry in the engine's list, or None.
    has_list
        Whether the engine has a list at all.
    """
    physics = judge_physics(value, check)
    if physics is None or value is None:
        return Verdict(None, None)
    if finding is not None and finding.status == "marginal":
        return Verdict(physics, Standing.KNOWN, f"marginal: {finding.reason.text}")
    if physics is Physics.PASS:
        if finding is not None and finding.status == "known":
            return Verdict(physics, Standing.DRIFTED, f"passes, but is listed: {finding.reason.text}")
        return Verdict(physics, None)
    predictions = list(predictions)
    for law, centre, band in predictions:
        if abs(value - centre) <= band:
            return Verdict(physics, Standing.EXPLAINED, f"{law.because} (predicted {centre:.6g} +- {band:.1g})")
    if finding is not None:
        return Verdict(physics, Standing.KNOWN, finding.reason.text)
    if predictions:
        law, centre, band = predictions[0]
        return Verdict(
            physics, Standing.DRIFTED, f"left the band of its law, {centre:.6g} +- {band:.1g}: {law.because}"
        )
    if has_list:
        return Verdict(physics, Standing.NEW, "neither listed nor explained by a law")
    return Verdict(physics, None, "the engine has no list of findings")
