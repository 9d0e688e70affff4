"""Deviation laws: what an engine does by design instead of the textbook, predicted without running it.

A law stands in its engine's folder and knows the scene, the step and the engine's own numbers. What it predicts is a
motion; the numbers that a row shows are read from it by the scene's own measure, which is handed in, so that a
prediction and a measurement differ by physics only.

A law explains a FAIL (its standing becomes *explained*) if the measured value lies within the law's derived band of
the predicted one. It never changes PASS or FAIL.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fnmatch import fnmatchcase

from adapters.scene import Scene
from adapters.trajectory import Measured, Trajectory

#: ``measure(scene, trajectory)`` -> every metric of the scene, as it is measured of an engine's run.
Measure = Callable[[Scene, Trajectory], dict[str, Measured]]
#: Predicted value and the band around it, in the metric's unit.
Prediction = tuple[float, float]
#: ``law(scene, dt, measure)`` or None where the law says nothing about this scene.
Law = Callable[[Scene, float, Measure], Prediction | None]
#: ``law(scene, dt, measure, iterations)``: the same where a slot asks for another count than its profile's own.
AskedLaw = Callable[[Scene, float, Measure, int], Prediction | None]


@dataclass(frozen=True)
class Deviation:
    """One law of one engine.

    Parameters
    ----------
    engine, profiles
        Whom it describes.
    scene, metric
        Name of the scene and pattern of the metric (``apex[[]*``: `fnmatch` rules).
    law
        See `Law`; the band is derived (round-off, sampling), not fitted.
    because, source
        The mechanism in one sentence, and where it is documented or read.
    versions
        Prefixes of engine versions it was checked on; an empty tuple means all.
    asked
        What the law says at iterations that are asked for; nothing, unless it follows the engine's sweeps.
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
        """What is predicted at the profile's own iterations, or at those that are asked for."""
        if iterations is None:
            return self.law(scene, dt, measure)
        return self.asked(scene, dt, measure, iterations) if self.asked else None

    def covers(self, engine: str, version: str, profile: str, scene: str, metric: str) -> bool:
        """Whether the law speaks about this row."""
        return (
            engine == self.engine
            and profile in self.profiles
            and scene == self.scene
            and fnmatchcase(metric, self.metric)
            and (not self.versions or version.startswith(self.versions))
        )


def exactly(metric: str) -> str:
    """Pattern of a metric with an index: `fnmatch` reads a bare bracket as a set of characters."""
    return metric.replace("[", "[[]")
