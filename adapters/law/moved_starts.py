"""Laws of motions from several starts, which differ by round-off: how far, and when nothing is predicted.

A contact found a step later or earlier is a jump, so that round-off of a gap decides on a motion. Where the motions
from starts moved by it differ, the band is as wide as they do, or there is no prediction.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

from adapters.law import Law, Measure, Prediction
from adapters.law.single_precision import ROUNDINGS, UNIT, Held
from adapters.scene import Scene
from adapters.trajectory import Measured, Trajectory

#: Round-off of a gap [m]: of heights of some metres, each rounded to 2e-15 m, added up over a thousand steps.
GAP_ROUND_OFF = 1e-14
#: Multiples of that by which starts are moved: up and down, since a motion may jump in one direction only.
PERTURBATIONS = (-3.0, -1.0, 1.0, 3.0)
#: Factor on the differences of moved runs, as the engine's own error may be larger.
SPREAD_FACTOR = 10.0
#: A metric that changes by more than this share of its scale is not predicted.
BLURRED = 1e-4
#: The same share where places are in single precision.
EITHER = 1e-2
#: Round-off of up to a thousand additions, relative to the scale of a metric.
SUM_ROUND_OFF = 1e-12


def scale_of(scene: Scene, metric: str) -> float:
    """Size of a metric's values: speeds and impulses by the approach, heights by the drop, times in seconds."""
    if metric.startswith("apex["):
        return scene.params["height"]
    speed = scene.params.get("v", 1.0)
    return {"rebound_speed": speed, "velocity_change": speed, "impulse": scene.bodies[1].mass * speed}.get(metric, 1.0)


def law_of_motions(motions: Callable[[Scene, float, str], list[Trajectory]]) -> Callable[[str, str], Law]:
    """Laws by metric and profile, of motions in single precision from all starts, the unmoved one first.

    They predict what the first measures, and how far the others are from it, up to the share `EITHER` of its value.
    """

    @lru_cache(maxsize=4)
    def measured(key: Held, dt: float, profile: str, measure: Measure) -> list[dict[str, Measured]]:
        return [measure(key.scene, motion) for motion in motions(key.scene, dt, profile)]

    def law_of(metric: str, profile: str) -> Law:
        def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
            found = [told.get(metric, (None, ""))[0] for told in measured(Held(scene), dt, profile, measure)]
            known = [value for value in found if value is not None]
            if not known or len(known) < len(found):
                return None
            spread, scale = max(abs(value - known[0]) for value in known), max(1.0, abs(known[0]))
            return (known[0], 2.0 * spread + ROUNDINGS * UNIT * scale) if spread <= EITHER * scale else None

        return law

    return law_of
