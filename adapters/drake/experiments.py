"""Experiments on Drake."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from adapters.experiment import Experiment

CANDIDATES: dict[str, tuple[Any, ...]] = {
    "approximation": ("lagged", "sap", "tamsi", "similar"),
    "boxes": ("hydroelastic", "point"),
    "point_stiffness": (1e4, 1e8),
    "modulus": (1e5, 1e6, 1e8),
    "dissipation": (0.0, 1.0, 10.0),
    "relaxation_time": (0.0, 0.01),
    "stiction_tolerance": (1e-6, 1e-5),
}

_Settings = Mapping[str, Any]
#: Friction by the load of the step itself, solved with it.
_IMPLICIT: _Settings = {"approximation": "tamsi"}
#: Slips are viscous below a micrometre per second alone.
_STICKS: _Settings = {"stiction_tolerance": 1e-6}
#: Softer boxes.
_SOFT: _Settings = {"modulus": 1e6}

_SAYS = {
    "glides": "where friction goes by the load of the step it passes",
    "friction-by-an-earlier-load": "where friction goes by the load of the step it passes",
    "viscous-friction": "where only slower slips are viscous it stays",
}
#: Family, profile, dimension, metric and parameters of a row; the settings that cure it, and those that must not.
_ROWS: tuple[tuple[str, str, int, str, dict[str, float], _Settings, tuple[_Settings, ...]], ...] = (
    ("far-origin-glides", "sap", 2, "braking", {}, _IMPLICIT, (_SOFT,)),
    ("far-origin-glides", "sap", 2, "hop", {}, _IMPLICIT, (_SOFT,)),
    ("far-origin-glides", "sap", 2, "turned", {}, _IMPLICIT, (_SOFT,)),
    ("far-origin-glides", "similar", 2, "braking", {}, _IMPLICIT, (_SOFT,)),
    ("far-origin-glides", "similar", 2, "end_speed", {}, _IMPLICIT, ()),
    ("far-origin-glides", "similar", 2, "hop", {}, _IMPLICIT, (_SOFT,)),
    ("far-origin-glides", "similar", 2, "turned", {}, _IMPLICIT, (_SOFT,)),
    ("hilltop-friction-by-an-earlier-load", "default", 2, "level_speed", {"mu": 0.1}, _IMPLICIT, (_STICKS,)),
    ("hilltop-friction-by-an-earlier-load", "default", 2, "leaving_angle", {"mu": 0.1}, _IMPLICIT, (_STICKS,)),
    ("hilltop-friction-by-an-earlier-load", "default", 2, "leaving_time", {"mu": 0.1}, _IMPLICIT, (_STICKS,)),
    ("hilltop-glides", "similar", 2, "level_speed", {"mu": 0.1}, _IMPLICIT, (_SOFT,)),
    ("hilltop-glides", "similar", 2, "leaving_angle", {"mu": 0.1}, _IMPLICIT, (_SOFT,)),
    ("incline-friction-by-an-earlier-load", "default", 2, "acceleration", {"ratio": 1.1}, _IMPLICIT, (_STICKS,)),
    ("incline-glides", "sap", 2, "acceleration", {"ratio": 1.001}, _IMPLICIT, (_SOFT,)),
    ("incline-glides", "similar", 2, "creep", {}, _IMPLICIT, (_SOFT,)),
    ("incline-viscous-friction", "tamsi", 2, "creep", {"ratio": 0.99}, _STICKS, (_SOFT,)),
    ("ladder-friction-by-an-earlier-load", "default", 2, "wall_load", {}, _IMPLICIT, (_STICKS,)),
    ("ladder-glides", "similar", 2, "passing_time", {"ratio": 0.8}, _IMPLICIT, ()),
    ("ladder-glides", "similar", 2, "passing_spin", {"ratio": 0.8}, _IMPLICIT, (_SOFT,)),
    ("ladder-glides", "similar", 2, "let_go", {"ratio": 0.8}, _IMPLICIT, (_SOFT,)),
    ("masse-glides", "sap", 3, "final_vx", {}, _IMPLICIT, (_SOFT,)),
    ("masse-glides", "sap", 3, "final_vy", {}, _IMPLICIT, (_SOFT,)),
    ("masse-glides", "sap", 3, "hop", {}, _IMPLICIT, (_SOFT,)),
    ("painleve-friction-by-an-earlier-load", "default", 2, "turning_time", {"ratio": 0.6}, _IMPLICIT, (_STICKS,)),
    ("painleve-friction-by-an-earlier-load", "default", 2, "turning_spin", {"ratio": 0.6}, _IMPLICIT, (_STICKS,)),
    ("painleve-friction-by-an-earlier-load", "default", 2, "slowed", {"ratio": 0.6}, _IMPLICIT, (_STICKS,)),
    ("painleve-glides", "sap", 2, "turning_time", {"ratio": 0.6}, _IMPLICIT, (_SOFT,)),
    ("painleve-glides", "sap", 2, "turning_spin", {"ratio": 0.6}, _IMPLICIT, (_SOFT,)),
    ("painleve-glides", "sap", 2, "slowed", {"ratio": 0.6}, _IMPLICIT, (_SOFT,)),
    ("painleve-glides", "sap", 2, "lifted", {"ratio": 0.6}, _IMPLICIT, (_SOFT,)),
    ("pinch-friction-by-an-earlier-load", "default", 2, "creep", {}, _IMPLICIT, (_STICKS,)),
    ("pressed-box-glides", "sap", 2, "acceleration", {"load": 0.0}, _IMPLICIT, (_SOFT,)),
    ("pressed-box-glides", "sap", 2, "carried", {"load": 0.0}, _IMPLICIT, (_SOFT,)),
    ("pressed-box-glides", "sap", 2, "sheared", {"load": 0.0}, _IMPLICIT, (_SOFT,)),
    ("pressed-box-glides", "similar", 2, "creep", {"load": 9.0, "shear": 4.9}, _IMPLICIT, ()),
    ("roll-incline-glides", "sap", 2, "acceleration", {"ratio": 1.5}, _IMPLICIT, (_SOFT,)),
    ("roll-incline-glides", "sap", 2, "turning", {"ratio": 1.5}, _IMPLICIT, (_SOFT,)),
    ("roll-incline-glides", "sap", 2, "hop", {"ratio": 1.5}, _IMPLICIT, (_SOFT,)),
    ("rolling-spin-glides", "sap", 3, "hop", {}, _IMPLICIT, (_SOFT,)),
    ("seam-glides", "sap", 3, "stopping_distance", {}, _IMPLICIT, ()),
    ("seam-glides", "sap", 3, "braking", {}, _IMPLICIT, (_SOFT,)),
    ("seam-glides", "sap", 3, "hop", {}, _IMPLICIT, (_SOFT,)),
    ("seam-glides", "sap", 3, "turned", {}, _IMPLICIT, (_SOFT,)),
    ("seam-glides", "sap", 3, "astray", {}, _IMPLICIT, (_SOFT,)),
    ("seam-glides", "similar", 3, "braking", {}, _IMPLICIT, (_SOFT,)),
    ("seam-glides", "similar", 3, "hop", {}, _IMPLICIT, (_SOFT,)),
    ("seam-glides", "similar", 3, "turned", {}, _IMPLICIT, (_SOFT,)),
    ("seam-glides", "similar", 3, "astray", {}, _IMPLICIT, ()),
    ("slide-glides", "sap", 3, "braking", {}, _IMPLICIT, (_SOFT,)),
    ("slide-glides", "sap", 3, "hop", {}, _IMPLICIT, (_SOFT,)),
    ("slide-glides", "sap", 3, "turned", {}, _IMPLICIT, (_SOFT,)),
    ("slide-glides", "sap", 3, "astray", {}, _IMPLICIT, (_SOFT,)),
    ("slide-glides", "similar", 3, "braking", {}, _IMPLICIT, (_SOFT,)),
    ("slide-glides", "similar", 3, "end_speed", {}, _IMPLICIT, ()),
    ("slide-glides", "similar", 3, "hop", {}, _IMPLICIT, (_SOFT,)),
    ("slide-glides", "similar", 3, "turned", {}, _IMPLICIT, (_SOFT,)),
    ("slide-glides", "similar", 3, "astray", {}, _IMPLICIT, (_SOFT,)),
    ("slide-to-roll-glides", "similar", 2, "final_speed", {}, _IMPLICIT, (_SOFT,)),
    ("slide-to-roll-glides", "similar", 2, "hop", {}, _IMPLICIT, (_SOFT,)),
    ("far-origin-glides", "sap", 3, "braking", {}, _IMPLICIT, (_SOFT,)),
    ("far-origin-glides", "sap", 3, "hop", {}, _IMPLICIT, (_SOFT,)),
    ("far-origin-glides", "sap", 3, "turned", {}, _IMPLICIT, (_SOFT,)),
    ("far-origin-glides", "sap", 3, "astray", {}, _IMPLICIT, (_SOFT,)),
    ("far-origin-glides", "similar", 3, "braking", {}, _IMPLICIT, (_SOFT,)),
    ("far-origin-glides", "similar", 3, "end_speed", {}, _IMPLICIT, ()),
    ("far-origin-glides", "similar", 3, "hop", {}, _IMPLICIT, (_SOFT,)),
    ("far-origin-glides", "similar", 3, "turned", {}, _IMPLICIT, (_SOFT,)),
    ("far-origin-glides", "similar", 3, "astray", {}, _IMPLICIT, (_SOFT,)),
    ("hilltop-glides", "sap", 2, "level_speed", {"mu": 0.1}, _IMPLICIT, (_SOFT,)),
    ("hilltop-glides", "sap", 2, "leaving_angle", {"mu": 0.1}, _IMPLICIT, (_SOFT,)),
    ("incline-friction-by-an-earlier-load", "default", 2, "creep", {}, _IMPLICIT, (_STICKS,)),
    ("incline-glides", "similar", 2, "acceleration", {"ratio": 1.001}, _IMPLICIT, (_SOFT,)),
    ("ladder-friction-by-an-earlier-load", "default", 2, "passing_spin", {"ratio": 0.8}, _IMPLICIT, (_STICKS,)),
    ("ladder-glides", "sap", 2, "passing_time", {"ratio": 0.8}, _IMPLICIT, (_SOFT,)),
    ("ladder-glides", "sap", 2, "passing_spin", {"ratio": 0.8}, _IMPLICIT, ()),
    ("ladder-glides", "sap", 2, "let_go", {"ratio": 0.8}, _IMPLICIT, (_SOFT,)),
    ("ladder-glides", "similar", 2, "wall_load", {}, _IMPLICIT, (_SOFT,)),
    ("masse-glides", "similar", 3, "final_vx", {}, _IMPLICIT, (_SOFT,)),
    ("masse-glides", "similar", 3, "final_vy", {}, _IMPLICIT, (_SOFT,)),
    ("masse-glides", "similar", 3, "turned", {}, _IMPLICIT, (_SOFT,)),
    ("masse-glides", "similar", 3, "hop", {}, _IMPLICIT, (_SOFT,)),
    ("painleve-friction-by-an-earlier-load", "default", 2, "passing_time", {}, _IMPLICIT, (_STICKS,)),
    ("painleve-friction-by-an-earlier-load", "default", 2, "edge_moved", {}, _IMPLICIT, (_STICKS,)),
    ("painleve-glides", "similar", 2, "turning_time", {"ratio": 0.6}, _IMPLICIT, (_SOFT,)),
    ("painleve-glides", "similar", 2, "turning_spin", {"ratio": 0.6}, _IMPLICIT, (_SOFT,)),
    ("painleve-glides", "similar", 2, "slowed", {"ratio": 0.6}, _IMPLICIT, (_SOFT,)),
    ("painleve-glides", "similar", 2, "lifted", {"ratio": 0.6}, _IMPLICIT, (_SOFT,)),
    ("pinch-viscous-friction", "tamsi", 2, "creep", {"margin": 1.05}, _STICKS, (_SOFT,)),
    ("pressed-box-friction-by-an-earlier-load", "default", 2, "acceleration", {"load": 0.0}, _IMPLICIT, (_STICKS,)),
    ("pressed-box-friction-by-an-earlier-load", "default", 2, "carried", {"load": 0.0}, _IMPLICIT, (_STICKS,)),
    ("pressed-box-friction-by-an-earlier-load", "default", 2, "sheared", {"load": 0.0}, _IMPLICIT, (_STICKS,)),
    ("pressed-box-glides", "similar", 2, "acceleration", {"load": 0.0}, _IMPLICIT, (_SOFT,)),
    ("pressed-box-glides", "similar", 2, "carried", {"load": 0.0}, _IMPLICIT, (_SOFT,)),
    ("pressed-box-glides", "similar", 2, "sheared", {"load": 0.0}, _IMPLICIT, (_SOFT,)),
    ("rocker-friction-by-an-earlier-load", "default", 2, "amplitude", {"tilt": 5.0}, _IMPLICIT, (_STICKS,)),
    ("roll-incline-glides", "similar", 2, "acceleration", {"ratio": 1.5}, _IMPLICIT, (_SOFT,)),
    ("roll-incline-glides", "similar", 2, "turning", {"ratio": 1.5}, _IMPLICIT, (_SOFT,)),
    ("roll-incline-glides", "similar", 2, "hop", {"ratio": 1.5}, _IMPLICIT, (_SOFT,)),
    ("seam-glides", "sap", 2, "stopping_distance", {}, _IMPLICIT, ()),
    ("seam-glides", "sap", 2, "braking", {}, _IMPLICIT, (_SOFT,)),
    ("seam-glides", "sap", 2, "hop", {}, _IMPLICIT, (_SOFT,)),
    ("seam-glides", "sap", 2, "turned", {}, _IMPLICIT, (_SOFT,)),
    ("seam-glides", "similar", 2, "braking", {}, _IMPLICIT, (_SOFT,)),
    ("seam-glides", "similar", 2, "hop", {}, _IMPLICIT, (_SOFT,)),
    ("seam-glides", "similar", 2, "turned", {}, _IMPLICIT, (_SOFT,)),
    ("slide-glides", "sap", 2, "braking", {}, _IMPLICIT, (_SOFT,)),
    ("slide-glides", "sap", 2, "hop", {}, _IMPLICIT, (_SOFT,)),
    ("slide-glides", "sap", 2, "turned", {}, _IMPLICIT, (_SOFT,)),
    ("slide-glides", "similar", 2, "braking", {}, _IMPLICIT, (_SOFT,)),
    ("slide-glides", "similar", 2, "hop", {}, _IMPLICIT, (_SOFT,)),
    ("slide-glides", "similar", 2, "turned", {}, _IMPLICIT, (_SOFT,)),
    ("slide-to-roll-glides", "sap", 2, "final_speed", {}, _IMPLICIT, (_SOFT,)),
    ("slide-to-roll-glides", "sap", 2, "hop", {}, _IMPLICIT, (_SOFT,)),
)


def _experiment(
    family: str, profile: str, dimension: int, metric: str, params: dict[str, float], off: _Settings,
    idle: tuple[_Settings, ...],
) -> Experiment:  # fmt: skip
    kind = next(kind for kind in _SAYS if family.endswith(kind))
    scene = family.removesuffix(f"-{kind}").replace("-", "_")
    return Experiment(family, _SAYS[kind], profile, scene, metric, off, params, dimension, None, idle)


EXPERIMENTS: tuple[Experiment, ...] = tuple(_experiment(*row) for row in _ROWS)
