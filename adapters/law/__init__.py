"""Contact laws of engines: designed deviations from the textbook, predicted without running the engine.

A law is in its engine's folder and uses the scene, the step and the engine's numbers. It predicts a motion, from which
the scene's own measure computes the value of a row, so that a prediction and a measurement differ by physics only.

A law explains a FAIL (its standing becomes *explained*) if the measured value lies within the law's derived band of
the predicted one. It never changes PASS or FAIL.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any

from adapters.engine import ProfileRule
from adapters.needs import needs
from adapters.scene import Scene
from adapters.trajectory import Measured, Trajectory

#: ``measure(scene, trajectory)`` -> every metric of the scene, as for an engine's run.
Measure = Callable[[Scene, Trajectory], dict[str, Measured]]
#: Predicted value and the band around it, in the metric's unit.
Prediction = tuple[float, float]
#: ``law(scene, dt, measure)`` or None without a prediction for this scene.
Law = Callable[[Scene, float, Measure], Prediction | None]
#: ``law(scene, dt, measure, iterations)``: the same for another iteration count than the profile's own.
AskedLaw = Callable[[Scene, float, Measure, int], Prediction | None]


@dataclass(frozen=True)
class Deviation:
    """One law of one engine.

    Parameters
    ----------
    engine, profiles
        The engine and profiles that it describes.
    scene, metric
        Name of the scene and pattern of the metric (``apex[[]*``: `fnmatch` rules).
    law
        See `Law`; the band is derived (round-off, sampling), not fitted.
    because, source
        The mechanism, and where it is documented or read.
    versions
        Prefixes of engine versions on which it was checked; an empty tuple means all.
    asked
        Prediction at an iteration count set by the user; None unless it models the engine's iterations.
    """

    engine: str
    profiles: tuple[str, ...]
    scene: str
    metric: str
    law: Law
    because: str
    source: str
    versions: tuple[str, ...] = ()
    asked: AskedLaw | None = None

    def says(self, scene: Scene, dt: float, measure: Measure, iterations: int | None = None) -> Prediction | None:
        """Prediction at the profile's own iterations, or at those set by the user."""
        if iterations is None:
            return self.law(scene, dt, measure)
        return self.asked(scene, dt, measure, iterations) if self.asked else None

    def covers(self, engine: str, version: str, profile: str, scene: str, metric: str) -> bool:
        """Whether the law covers this row."""
        return (
            engine == self.engine
            and profile in self.profiles
            and scene == self.scene
            and fnmatchcase(metric, self.metric)
            and (not self.versions or version.startswith(self.versions))
        )


def deviations(
    engine: str,
    profiles: Iterable[str],
    rows: Mapping[str, Iterable[str]],
    law: Callable[[str, str], Law],
    because: str,
    source: str,
    versions: tuple[str, ...],
) -> tuple[Deviation, ...]:
    """One law for each profile and each row: see `Deviation`.

    Parameters
    ----------
    rows
        Metrics, not patterns, by scene.
    law
        ``law(metric, profile)``.
    """
    return tuple(
        Deviation(engine, (profile,), scene, exactly(metric), law(metric, profile), because, source, versions)
        for profile in profiles
        for scene, metrics in rows.items()
        for metric in metrics
    )


def settings_of(rule: ProfileRule, scene: Scene, dt: float) -> dict[str, Any]:
    """Settings of a profile for a scene, by name."""
    return {setting.name: setting.value for setting in rule(needs(scene), dt)}


def exactly(metric: str) -> str:
    """Pattern of a metric with an index: `fnmatch` reads a bare bracket as a set of characters."""
    return metric.replace("[", "[[]")


def metric_of(pattern: str) -> str:
    """The metric that `exactly` made a pattern of."""
    return pattern.replace("[[]", "[")
