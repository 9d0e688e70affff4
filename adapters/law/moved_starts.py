"""Laws of balls that run from several starts, which differ by round-off: how far, and when nothing is predicted.

A contact found a step later or earlier is a jump, so that round-off of a gap decides on a motion. Where the motions
from starts moved by it differ, the band is as wide as they do, or there is no prediction.
"""

from __future__ import annotations

from adapters.scene import Scene

#: Round-off of a gap [m]: of heights of some metres, each rounded to 2e-15 m, added up over a thousand steps.
GAP_ROUND_OFF = 1e-14
#: Multiples of that by which starts are moved: up and down, since a motion may jump in one direction only.
PERTURBATIONS = (-3.0, -1.0, 1.0, 3.0)
#: Factor on the differences of moved runs, as the engine's own error may be larger.
SPREAD_FACTOR = 10.0
#: A metric that changes by more than this share of its scale is not predicted.
BLURRED = 1e-4
#: Round-off of up to a thousand additions, relative to the scale of a metric.
SUM_ROUND_OFF = 1e-12


def scale_of(scene: Scene, metric: str) -> float:
    """Size of a metric's values: speeds and impulses by the approach, heights by the drop, times in seconds."""
    if metric.startswith("apex["):
        return scene.params["height"]
    speed = scene.params.get("v", 1.0)
    return {"rebound_speed": speed, "velocity_change": speed, "impulse": scene.bodies[1].mass * speed}.get(metric, 1.0)
