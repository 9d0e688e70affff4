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
#: Softer boxes, and boxes that sink in by a tenth.
_SOFT: _Settings = {"modulus": 1e6}
_HARD: _Settings = {"modulus": 1e8}
_HARDEST: _Settings = {"modulus": 1e10}
_HARD_AND_IMPLICIT: _Settings = {**_HARDEST, **_IMPLICIT}
#: SAP's contacts dissipate nothing beyond what a step does.
_AT_ONCE: _Settings = {"relaxation_time": 0.0}
#: What overlaps is pushed out at a micrometre per second at most.
_SLOWLY: _Settings = {"dissipation": 1e6}
#: Hunt's and Crossley's dissipation in SAP's convex step.
_BOUNDED: _Settings = {"approximation": "similar"}
_HARD_AND_BOUNDED: _Settings = {**_BOUNDED, **_HARDEST}
#: What sinks and relaxes: neither of the two does it alone, nor does what mends relaxing elsewhere.
_EACH_ALONE: tuple[_Settings, ...] = (_BOUNDED, _HARDEST, _AT_ONCE)
#: Friction by the load of the step, and a slower push.
_SLOWLY_BY_LOAD: _Settings = {**_IMPLICIT, **_SLOWLY}
#: Friction by the load of the step, and slower slips that are viscous.
_STICKS_BY_LOAD: _Settings = {**_IMPLICIT, **_STICKS}

_SAYS = {
    "relaxes-and-sinks": "where Hunt and Crossley bound what parts, and a heavy box finds harder ones, it passes",
    "glides-and-creeps": "where friction goes by the load of the step, and only slower slips are viscous, it stays",
    "lands-on-a-face": "where boxes are harder, and friction goes by the load of the step, it passes",
    "throws-and-glides": "where friction goes by the load of the step, and what overlaps parts more slowly, it stays",
    "glides": "where friction goes by the load of the step it passes",
    "friction-by-an-earlier-load": "where friction goes by the load of the step it passes",
    "viscous-friction": "where only slower slips are viscous it stays",
    "relaxes": "where contacts have no relaxation time it passes",
    "throws": "where Hunt and Crossley bound the speed of parting, or bound it lower, it passes",
    "sinks": "where boxes are harder it passes",
}
#: A slim block that is let go from far out.
_SLIM: dict[str, float] = {"aspect": 0.5, "tilt": 0.7}
#: A cube on a table that is tilted beyond the angle at which it slides.
_CUBE: dict[str, float] = {"aspect": 1.0, "ratio": 1.1}
#: Family, profile, dimension, metric and parameters of a row; the settings that cure it, and those that must not.
_ROWS: tuple[tuple[str, str, int, str, dict[str, float], _Settings, tuple[_Settings, ...]], ...] = (
    ("far-origin-glides", "sap", 2, "braking", {}, _IMPLICIT, (_SOFT,)),
    ("far-origin-glides", "similar", 2, "braking", {}, _IMPLICIT, (_SOFT,)),
    ("heavy-on-light-sinks", "default", 2, "penetration", {"ratio": 1e4}, _HARDEST, (_STICKS,)),
    ("heavy-on-light-sinks", "default", 2, "drift", {"ratio": 1e4}, _HARDEST, (_STICKS,)),
    ("heavy-on-light-sinks", "default", 2, "kinetic_energy", {"ratio": 1e4}, _HARDEST, (_STICKS,)),
    ("heavy-on-light-sinks", "default", 2, "settle_time", {"ratio": 1e4}, _HARDEST, (_STICKS,)),
    ("heavy-on-light-sinks", "tamsi", 2, "penetration", {"ratio": 1e4}, _HARDEST, (_STICKS,)),
    ("heavy-on-light-sinks", "similar", 2, "penetration", {"ratio": 1e4}, _HARDEST, (_STICKS,)),
    ("heavy-on-light-relaxes", "sap", 2, "drift", {}, _AT_ONCE, (_STICKS, _HARD)),
    ("heavy-on-light-relaxes", "sap", 2, "kinetic_energy", {}, _AT_ONCE, (_STICKS, _HARD)),
    ("heavy-on-light-relaxes", "sap", 2, "settle_time", {}, _AT_ONCE, (_STICKS, _HARD)),
    ("hilltop-friction-by-an-earlier-load", "default", 2, "level_speed", {"mu": 0.1}, _IMPLICIT, (_STICKS,)),
    ("hilltop-glides", "sap", 2, "level_speed", {"mu": 0.1}, _IMPLICIT, (_SOFT,)),
    ("hilltop-glides", "similar", 2, "level_speed", {"mu": 0.1}, _IMPLICIT, (_SOFT,)),
    ("heavy-on-light-relaxes-and-sinks", "sap", 2, "penetration", {}, _BOUNDED, (_AT_ONCE, _HARDEST)),
    ("heavy-on-light-relaxes-and-sinks", "sap", 2, "penetration", {"ratio": 1e4}, _HARD_AND_BOUNDED, _EACH_ALONE),
    ("heavy-on-light-relaxes-and-sinks", "sap", 2, "interface_impulse[1]", {"ratio": 1e4}, _BOUNDED, (_HARDEST,)),
    ("incline-glides", "sap", 2, "threshold", {}, _IMPLICIT, (_SOFT,)),
    ("overhang-throws", "default", 2, "kinetic_energy", {}, _SLOWLY, (_STICKS, _HARD)),
    ("overhang-throws", "default", 2, "drift", {}, _SLOWLY, (_STICKS, _HARD)),
    ("overhang-throws", "default", 2, "stands", {"margin": 0.02}, _SLOWLY, ()),
    ("overhang-throws", "tamsi", 2, "penetration", {}, _SLOWLY, ()),
    ("overhang-throws", "similar", 2, "impulse_scatter", {}, _SLOWLY, ()),
    ("overhang-throws", "sap", 2, "penetration", {}, {**_BOUNDED, **_SLOWLY}, (_BOUNDED, _AT_ONCE)),
    ("pinch-glides-and-creeps", "similar", 2, "creep", {}, _STICKS, (_SOFT, _HARD)),
    ("pinch-glides-and-creeps", "similar", 2, "creep", {"margin": 1.05}, _STICKS_BY_LOAD, (_IMPLICIT, _STICKS)),
    ("rocking-block-lands-on-a-face", "tamsi", 2, "amplitude[1]", _SLIM, _HARDEST, (_STICKS,)),
    ("rocking-block-lands-on-a-face", "default", 2, "amplitude[2]", _SLIM, _HARD_AND_IMPLICIT, (_HARDEST, _IMPLICIT)),
    ("rocking-block-lands-on-a-face", "default", 2, "slid", _SLIM, _HARD_AND_IMPLICIT, (_HARDEST,)),
    ("rocking-block-lands-on-a-face", "sap", 2, "landing[2]", _SLIM, _HARD_AND_IMPLICIT, (_HARDEST, _IMPLICIT)),
    ("rocking-block-lands-on-a-face", "similar", 2, "amplitude[1]", _SLIM, _HARD_AND_IMPLICIT, (_HARDEST, _IMPLICIT)),
    ("stack-relaxes", "sap", 2, "settle_time", {"n": 20.0}, _AT_ONCE, (_HARD,)),
    ("tilt-table-sinks", "tamsi", 3, "edge_moved", {"ratio": 1.1}, _HARD, (_STICKS,)),
    ("tilt-table-sinks", "default", 2, "moved", {"aspect": 1.0}, _IMPLICIT, (_STICKS, _HARD)),
    ("tilt-table-sinks", "similar", 2, "moved", {"aspect": 1.0}, _IMPLICIT, (_STICKS, _HARD)),
    ("incline-friction-by-an-earlier-load", "default", 2, "acceleration", {"ratio": 1.1}, _IMPLICIT, (_STICKS,)),
    ("incline-glides", "sap", 2, "acceleration", {"ratio": 1.001}, _IMPLICIT, (_SOFT,)),
    ("incline-glides", "similar", 2, "creep", {}, _IMPLICIT, (_SOFT,)),
    ("incline-viscous-friction", "tamsi", 2, "creep", {"ratio": 0.99}, _STICKS, (_SOFT,)),
    ("ladder-friction-by-an-earlier-load", "default", 2, "passing_spin", {"ratio": 0.8}, _IMPLICIT, (_STICKS,)),
    ("ladder-viscous-friction", "default", 2, "wall_load", {}, _STICKS, (_SOFT,)),
    ("ladder-glides", "sap", 2, "passing_time", {"ratio": 0.8}, _IMPLICIT, (_SOFT,)),
    ("ladder-glides", "similar", 2, "passing_spin", {"ratio": 0.8}, _IMPLICIT, (_SOFT,)),
    ("masse-glides", "sap", 3, "final_vx", {}, _IMPLICIT, (_SOFT,)),
    ("masse-glides", "similar", 3, "final_vx", {}, _IMPLICIT, (_SOFT,)),
    ("painleve-friction-by-an-earlier-load", "default", 2, "turning_time", {"ratio": 0.6}, _IMPLICIT, (_STICKS,)),
    ("painleve-glides", "sap", 2, "turning_time", {"ratio": 0.6}, _IMPLICIT, (_SOFT,)),
    ("painleve-glides", "similar", 2, "turning_time", {"ratio": 0.6}, _IMPLICIT, (_SOFT,)),
    ("pinch-viscous-friction", "default", 2, "creep", {}, _STICKS, (_SOFT,)),
    ("incline-viscous-friction", "default", 2, "creep", {"ratio": 0.9}, _STICKS, (_SOFT,)),
    ("pinch-viscous-friction", "tamsi", 2, "creep", {"margin": 1.05}, _STICKS, (_SOFT,)),
    ("pinch-glides", "similar", 2, "turned", {"margin": 1.05}, _IMPLICIT, (_STICKS,)),
    *(
        ("pinch-glides", "similar", 2, metric, {"margin": 1.05}, _IMPLICIT, (_STICKS,))
        for metric in ("carried", "carried[least]", "carried[greatest]", "grip[least]", "grip[greatest]", "unbalanced")
    ),
    ("pinch-relaxes", "sap", 2, "turned", {"margin": 100.0}, _AT_ONCE, (_STICKS,)),
    *(
        ("pinch-relaxes", "sap", 2, metric, {"margin": 100.0}, _AT_ONCE, (_STICKS,))
        for metric in ("carried", "carried[least]", "carried[greatest]")
    ),
    ("position-correction-throws", "sap", 2, "launched", {"depth": 0.01}, _IMPLICIT, (_STICKS, _AT_ONCE)),
    ("position-correction-throws", "sap", 2, "drift", {"depth": 0.01}, _IMPLICIT, (_STICKS, _AT_ONCE)),
    ("v-groove-relaxes", "sap", 3, "displacement", {}, _AT_ONCE, (_SOFT, _STICKS)),
    ("stack-relaxes", "sap", 2, "penetration", {}, _AT_ONCE, (_STICKS, _HARD)),
    ("starved-relaxes", "sap", 2, "displacement", {}, _AT_ONCE, (_SOFT, _STICKS)),
    ("starved-relaxes", "sap", 2, "penetration", {}, _AT_ONCE, (_SOFT, _STICKS)),
    ("pivot-sinks", "default", 2, "passing_time", {"from": 1.0, "to": 30.0}, _HARD, (_IMPLICIT, _STICKS)),
    ("pivot-sinks", "tamsi", 3, "edge_moved", {"from": 1.0, "to": 30.0}, _HARD, (_STICKS, _SOFT)),
    ("pressed-box-friction-by-an-earlier-load", "default", 2, "acceleration", {"load": 0.0}, _IMPLICIT, (_STICKS,)),
    ("pressed-box-glides", "sap", 2, "acceleration", {"load": 0.0}, _IMPLICIT, (_SOFT,)),
    ("pressed-box-glides", "similar", 2, "acceleration", {"load": 0.0}, _IMPLICIT, (_SOFT,)),
    ("rocker-friction-by-an-earlier-load", "default", 2, "amplitude", {"tilt": 5.0}, _IMPLICIT, (_STICKS,)),
    ("roll-incline-glides", "sap", 2, "acceleration", {"ratio": 1.5}, _IMPLICIT, (_SOFT,)),
    ("roll-incline-glides", "similar", 2, "acceleration", {"ratio": 1.5}, _IMPLICIT, (_SOFT,)),
    ("rolling-spin-glides", "sap", 3, "hop", {}, _IMPLICIT, (_SOFT,)),
    ("seam-glides", "sap", 3, "braking", {}, _IMPLICIT, (_SOFT,)),
    ("seam-glides", "similar", 3, "braking", {}, _IMPLICIT, (_SOFT,)),
    ("slide-glides", "sap", 3, "braking", {}, _IMPLICIT, (_SOFT,)),
    ("slide-glides", "similar", 3, "braking", {}, _IMPLICIT, (_SOFT,)),
    *(
        ("slide-glides", profile, dimension, f"{force}[{by}]", {}, _IMPLICIT, (_SOFT,))
        for profile, dimension in (("sap", 2), ("similar", 3))
        for force in ("normal", "friction")
        for by in ("mean", "least", "greatest")
    ),
    ("slide-to-roll-glides", "sap", 2, "final_speed", {}, _IMPLICIT, (_SOFT,)),
    ("slide-to-roll-glides", "similar", 2, "final_speed", {}, _IMPLICIT, (_SOFT,)),
    ("tilt-table-friction-by-an-earlier-load", "default", 2, "acceleration", _CUBE, _IMPLICIT, (_STICKS,)),
    ("tilt-table-glides", "sap", 2, "acceleration", _CUBE, _IMPLICIT, (_SOFT,)),
    ("tilt-table-glides", "sap", 2, "turned", _CUBE, _IMPLICIT, (_SOFT,)),
    ("tilt-table-glides", "similar", 2, "acceleration", _CUBE, _IMPLICIT, (_STICKS,)),
    # What leaves its plane.
    *(
        (f"{scene}-glides", profile, 2, "out_of_plane", params, _IMPLICIT, (_SLOWLY, _HARDEST))
        for scene, params in (
            ("seam", {}),
            ("slide", {}),
            ("incline", {"ratio": 1.01}),
            ("incline", {"ratio": 1.1}),
            ("incline", {"ratio": 2.0}),
            ("ladder", {"ratio": 0.8}),
            ("pressed-box", {"load": 0.0}),
            ("tilt-table", {}),
            ("tilt-table", _CUBE),
        )
        for profile in ("sap", "similar")
    ),
    ("far-origin-glides", "sap", 2, "out_of_plane", {}, _IMPLICIT, (_SLOWLY, _HARDEST)),
    ("far-origin-glides", "similar", 2, "out_of_plane", {}, _IMPLICIT, (_STICKS, _HARDEST)),
    ("incline-glides", "sap", 2, "out_of_plane", {"ratio": 0.999}, _IMPLICIT, (_SLOWLY, _SOFT)),
    ("incline-glides", "sap", 2, "out_of_plane", {"ratio": 1.001}, _IMPLICIT, (_SLOWLY, _SOFT)),
    ("painleve-glides", "sap", 2, "out_of_plane", {"ratio": 0.6}, _IMPLICIT, (_SLOWLY, _HARDEST)),
    ("pinch-glides", "similar", 2, "out_of_plane", {"margin": 1.05}, _IMPLICIT, (_STICKS, _HARDEST)),
    ("position-correction-throws", "sap", 2, "out_of_plane", {"depth": 0.01}, _IMPLICIT, (_STICKS, _AT_ONCE, _SOFT)),
    ("heavy-on-light-sinks", "default", 2, "out_of_plane", {"ratio": 1e4}, _HARDEST, (_STICKS,)),
    ("heavy-on-light-sinks", "similar", 2, "out_of_plane", {"ratio": 1e4}, _HARDEST, (_STICKS,)),
    ("heavy-on-light-relaxes-and-sinks", "sap", 2, "out_of_plane", {}, _BOUNDED, (_HARDEST, _STICKS)),
    ("heavy-on-light-relaxes-and-sinks", "sap", 2, "out_of_plane", {"ratio": 1e4}, _HARD_AND_BOUNDED, _EACH_ALONE),
    ("overhang-throws", "similar", 2, "out_of_plane", {}, _SLOWLY, (_STICKS,)),
    ("overhang-throws", "similar", 2, "out_of_plane", {"margin": 0.02}, _SLOWLY, (_STICKS,)),
    ("overhang-throws", "sap", 2, "out_of_plane", {}, {**_BOUNDED, **_SLOWLY}, (_BOUNDED, _STICKS)),
    ("overhang-throws", "sap", 2, "out_of_plane", {"margin": 0.02}, {**_BOUNDED, **_SLOWLY}, (_BOUNDED, _STICKS)),
    ("rocking-block-throws-and-glides", "tamsi", 2, "out_of_plane", {}, _SLOWLY, (_HARDEST,)),
    ("rocking-block-throws-and-glides", "sap", 2, "out_of_plane", {}, _SLOWLY_BY_LOAD, (_IMPLICIT, _SLOWLY)),
    ("rocking-block-throws-and-glides", "similar", 2, "out_of_plane", {}, _SLOWLY_BY_LOAD, (_IMPLICIT, _SLOWLY)),
    ("rocking-block-throws-and-glides", "sap", 2, "out_of_plane", _SLIM, _IMPLICIT, (_SOFT, _SLOWLY)),
    ("rocking-block-throws-and-glides", "similar", 2, "out_of_plane", _SLIM, _IMPLICIT, (_SOFT, _SLOWLY)),
    ("shove-relaxes", "sap", 2, "out_of_plane", {}, _AT_ONCE, (_STICKS, _HARDEST)),
)


def _experiment(
    family: str, profile: str, dimension: int, metric: str, params: dict[str, float], off: _Settings,
    idle: tuple[_Settings, ...],
) -> Experiment:  # fmt: skip
    kind = next(kind for kind in _SAYS if family.endswith(kind))
    scene = family.removesuffix(f"-{kind}").replace("-", "_")
    return Experiment(family, _SAYS[kind], profile, scene, metric, off, params, dimension, None, idle)


EXPERIMENTS: tuple[Experiment, ...] = tuple(_experiment(*row) for row in _ROWS)
