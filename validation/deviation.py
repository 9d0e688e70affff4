"""Deviation laws: what an engine does by design instead of the textbook, predicted without running it.

A law is computable from the scene and the step alone. It explains a FAIL (its standing becomes *explained*) if the
measured value lies within the law's derived band of the predicted one. It never changes PASS or FAIL.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fnmatch import fnmatchcase

from adapters.scene import Scene

#: ``law(scene, dt) -> (value, band)`` or None where the law says nothing about this scene.
Law = Callable[[Scene, float], tuple[float, float] | None]


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
    """

    engine: str
    profiles: tuple[str, ...]
    scene: str
    metric: str
    law: Law
    because: str
    source: str
    versions: tuple[str, ...] = ()

    def covers(self, engine: str, version: str, profile: str, scene: str, metric: str) -> bool:
        """Whether the law speaks about this row."""
        return (
            engine == self.engine
            and profile in self.profiles
            and scene == self.scene
            and fnmatchcase(metric, self.metric)
            and (not self.versions or version.startswith(self.versions))
        )
