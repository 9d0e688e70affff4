"""Experiments on Chipmunk: rows of the full suite, at other steps and near thresholds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

from adapters.experiment import Experiment

_MORE = {"iterations": 1000}
_SLOP = {"collision_slop": 1e-5}
#: A start inside the band that is never corrected, and well below the g dt^2 = 1.7e-4 m of the checks.
_INSIDE = {"start_overlap": 5e-5}
_COARSE = 1.0 / 60.0

Changes = Mapping[str, Any]


def _touching(
    scene: str,
    metric: str,
    says: str,
    off: Changes,
    idle: Sequence[Changes],
    params: Mapping[str, float] = MappingProxyType({}),
    dt: float | None = None,
    profile: str = "default",
) -> Experiment:
    return Experiment(f"{scene.replace('_', '-')}-touching-start", says, profile, scene, metric, off, params,
                      idle=idle, dt=dt)  # fmt: skip


_OVERHANG = (
    *(
        Experiment(
            "overhang-fixed-sweeps",
            "with 10000 sweeps from a start inside the slop the blocks stand; such a start alone does not hold them",
            "default",
            "overhang",
            metric,
            {"iterations": 10000, **_INSIDE},
            {"margin": 1e-6},
            idle=(_INSIDE, _SLOP),
        )
        for metric in ("stands", "settle_time", "drift", "kinetic_energy", "impulse_scatter", "interface_impulse[4]")
    ),
    *(
        Experiment(
            "overhang-fixed-sweeps",
            "with 1000 sweeps the blocks stand; a start that touches does not hold them",
            "tuned",
            "overhang",
            metric,
            _MORE,
            {"margin": 1e-6},
            idle=({"start_overlap": 0.0},),
        )
        for metric in ("stands", "settle_time", "drift", "penetration", "kinetic_energy", "interface_impulse[4]")
    ),
    *(
        Experiment(
            "overhang-fixed-sweeps",
            "eight blocks at their limit: 10000 sweeps hold them, 1000 do not",
            profile,
            "overhang",
            "drift",
            {"iterations": 10000, **_INSIDE},
            {"margin": 1e-6, "n": 8.0},
            idle=({**_MORE, **_INSIDE},),
        )
        for profile in ("default", "tuned")
    ),
)

ELSEWHERE: tuple[Experiment, ...] = (
    *_OVERHANG,
    *(
        _touching(
            "v_groove",
            "displacement",
            "from a start inside the slop it stays in the groove; a smaller slop changes nothing",
            _INSIDE,
            (_SLOP,),
            sides,
        )
        for sides in ({"right": 80.0}, {"left": 80.0, "right": 80.0})
    ),
    *(
        _touching(
            "hilltop",
            metric,
            "from a start inside the slop it rolls off where it should; more sweeps or a smaller slop do not help",
            _INSIDE,
            (_MORE, {"collision_slop": 1e-3}),
            {"mu": 2.0, "v": 2.0},
        )
        for metric in ("level_speed", "leaving_angle")
    ),
    _touching(
        "ladder",
        "wall_load",
        "from a start inside the slop the loads are right; more sweeps or a smaller slop do not help",
        _INSIDE,
        (_MORE, _SLOP),
        dt=_COARSE,
    ),
    *(
        _touching(
            "arch",
            metric,
            "with more sweeps, a start inside the slop, or a slop that leaves no overlap, the stones stand, or slip, "
            "right; pushing out faster does nothing",
            off,
            ({"collision_bias": 0.5},),
            params,
            _COARSE,
        )
        for metric, params in (("sinking", {"ratio": 0.8}), ("face_load[right]", dict[str, float]()))
        for off in (_MORE, _INSIDE, _SLOP)
    ),
    _touching(
        "pyramid",
        "penetration",
        "with 1000 sweeps from a start inside the slop nothing lifts off; neither alone prevents it",
        {**_MORE, **_INSIDE},
        (_MORE, _INSIDE, _SLOP),
        {"rows": 10.0},
    ),
    *(
        _touching(
            "far_origin",
            "hop",
            "with more sweeps, or from a start inside the slop, nothing lifts off; a smaller slop changes nothing",
            off,
            (_SLOP,),
            place,
        )
        for off in (_MORE, _INSIDE)
        for place in ({"far": 0.0}, {"far": 1024.0})
    ),
    _touching(
        "domino",
        "struck_spin",
        "from a start inside the slop the foot holds in the blow; more sweeps do not help, nor does keeping impulses",
        {"start_overlap": 1e-5},
        (_MORE, {"collision_persistence": 3}),
        dt=1.0 / 960.0,
        profile="tuned",
    ),
    *(
        _touching(
            "seam",
            metric,
            "with more sweeps, or from a start inside the slop, it slides on straight; pushing out faster does nothing",
            off,
            ({"collision_bias": 0.5},),
            dt=_COARSE,
        )
        for metric in ("braking", "turned")
        for off in (_MORE, _INSIDE)
    ),
    Experiment(
        "pinch-fixed-sweeps",
        "with 1000 sweeps all of it is passed; another start does not help, nor does pushing nothing out",
        "default",
        "pinch",
        "grip",
        _MORE,
        {"margin": 100.0},
        idle=(_INSIDE, {"collision_bias": 1.0}),
        dt=_COARSE,
    ),
    Experiment(
        "scales-fixed-sweeps",
        "with 1000 sweeps nothing lifts off; a smaller slop changes nothing",
        "default",
        "scales",
        "hop",
        _MORE,
        idle=(_SLOP,),
        dt=_COARSE,
    ),
    Experiment(
        "painleve-fixed-sweeps",
        "near the threshold 30 sweeps are not enough: with 1000 the end jams in the first step",
        "tuned",
        "painleve",
        "edge_moved",
        _MORE,
        {"ratio": 1.05},
        idle=({"collision_slop": 0.1}, {"collision_persistence": 3}),
    ),
)
