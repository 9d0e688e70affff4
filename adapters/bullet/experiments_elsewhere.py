"""Experiments on Bullet: rows of the full suite, at other steps and near thresholds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from adapters.experiment import Experiment

_NO_DRAG = {"linearDamping": 0.0, "angularDamping": 0.0}
_MORE = {"iterations": 1000}
_TO_THE_END = {"solverResidualThreshold": 0.0}
_SOLVED = _TO_THE_END | _MORE
_NO_SLOP = {"contactSlop": 0.0}
_NO_PUSH = {"contactERP": 0.0}
_COLD = {"warmStartingFactor": 0.0}
_KEPT = {"contactBreakingThreshold": 0.1}
_COARSE, _FINE = 1.0 / 60.0, 1.0 / 960.0

Changes = Mapping[str, Any]
#: Family, profile, scene, metric, parameters, dimension, step.
_Row = tuple[str, str, str, str, Mapping[str, float], int, float | None]
_PLAIN = dict[str, float]()

_DRAGGED: tuple[_Row, ...] = (
    ("pivot-drag", "default", "pivot", "passing_time", _PLAIN, 2, _FINE),
    ("pivot-drag", "default", "pivot", "passing_spin", _PLAIN, 2, _FINE),
    ("rocking-block-drag", "default", "rocking_block", "slid", _PLAIN, 2, _FINE),
    ("ladder-drag", "default", "ladder", "passing_time", {"ratio": 0.8}, 2, _FINE),
    ("ladder-drag", "default", "ladder", "passing_spin", {"ratio": 0.8}, 2, _FINE),
    ("card-tent-drag", "default", "card_tent", "passing_spin[left]", {"ratio": 0.8}, 2, _FINE),
    ("tilt-table-drag", "default", "tilt_table", "passing_time", {"ratio": 1.1}, 2, _FINE),
)
_STOPPED: tuple[_Row, ...] = (
    ("ladder-residual", "default", "ladder", "moved", {"ratio": 1.02}, 2, None),
    ("ladder-residual", "default", "ladder", "wall_load", {"ratio": 1.02, "lean": 45.0}, 2, None),
    ("ladder-residual", "default", "ladder", "wall_load", {"lean": 75.0}, 2, None),
    ("pressed-box-residual", "default", "pressed_box", "creep", {"load": 0.0, "shear": 0.49}, 2, None),
    ("pressed-box-residual", "default", "pressed_box", "creep", {"load": 9.0, "shear": 4.9}, 2, _FINE),
    ("long-rest-residual", "default", "long_rest", "drift_per_hour", _PLAIN, 2, 1.0 / 480.0),
    ("seam-residual", "default", "seam", "astray", _PLAIN, 3, _FINE),
    ("position-correction-residual", "default", "position_correction", "drift", _PLAIN, 2, _FINE),
    ("tilt-table-residual", "default", "tilt_table", "turned", {"ratio": 1.1, "aspect": 1.0}, 3, _FINE),
    ("overhang-sweeps", "default", "overhang", "stands", {"margin": 1e-6, "n": 2.0}, 2, None),
    ("overhang-sweeps", "default", "overhang", "interface_impulse[2]", {"margin": 1e-6, "n": 2.0}, 2, None),
    ("pyramid-sweeps", "default", "pyramid", "penetration", {"rows": 6.0}, 2, None),
    ("pyramid-sweeps", "default", "pyramid", "kinetic_energy", {"rows": 6.0}, 2, None),
)
_SWEPT: tuple[_Row, ...] = (
    *(
        ("overhang-sweeps", profile, "overhang", metric, {"margin": 1e-6, "n": 2.0}, 2, None)
        for profile in ("tuned", "one")
        for metric in ("stands", "impulse_scatter", "interface_impulse[2]")
    ),
    *(
        ("pivot-sweeps", profile, "pivot", "twisted", params, 3, None)
        for profile in ("tuned", "one")
        for params in ({"aspect": 0.2}, {"from": 25.0})
    ),
    ("seam-points-held", "one", "seam", "braking", {"plate": 0.3}, 2, None),
    ("flat-box-sweeps-and-warm-start", "tuned", "flat_box", "rebound_ratio", {"aspect": 0.25}, 2, None),
    ("flat-box-sweeps-and-warm-start", "tuned", "flat_box", "impulse", {"aspect": 0.25}, 2, None),
)
_WITHIN_SLOP: tuple[_Row, ...] = (
    ("restitution-above-one-within-slop", "tuned", "restitution_above_one", "growth", _PLAIN, 2, _COARSE),
    ("galperin-within-slop", "tuned", "galperin", "small_speed", {"ratio": 3.0, "gap": 2.0}, 2, None),
    ("galperin-within-slop", "tuned", "galperin", "energy_defect", {"ratio": 3.0, "gap": 2.0}, 2, None),
    ("closing-wall-within-slop", "tuned", "closing_wall", "speed[1]", _PLAIN, 2, 1.0 / 120.0),
    ("pair-matrix-within-slop", "tuned", "pair_matrix", "restitution[2]", _PLAIN, 2, _FINE),
    ("v-groove-slop", "default", "v_groove", "displacement", _PLAIN, 2, _FINE),
)
_PUSHED: tuple[_Row, ...] = (
    ("bounce-push-out", "one", "bounce", "rest_time", {"e": 0.95}, 2, 1.0 / 480.0),
    ("bounce-push-out", "one", "bounce", "rest_time", {"e": 0.95, "height": 1.11}, 2, None),
    ("rocker-push-out", "tuned", "rocker", "amplitude", {"tilt": 2.0}, 2, None),
    ("position-correction-speed", "tuned", "position_correction", "launched", _PLAIN, 2, _FINE),
    ("position-correction-speed", "tuned", "position_correction", "launched", {"depth": 0.01}, 2, _FINE),
)
_DROPPED: tuple[_Row, ...] = (
    ("slide-drag-and-switching", "default", "slide", "end_speed", _PLAIN, 2, _COARSE),
    ("far-origin-drag", "default", "far_origin", "end_speed", _PLAIN, 2, _COARSE),
)
#: What is shown, the mechanism off, what else might be blamed, and the rows.
_SHOWN: tuple[tuple[str, Changes, tuple[Changes, ...], tuple[_Row, ...]], ...] = (
    ("without drag it gets there as it should; solved to the end it does not", _NO_DRAG, (_TO_THE_END,), _DRAGGED),
    ("solved to the end it is as it should be; without drag it is not", _SOLVED, (_NO_DRAG,), _STOPPED),
    ("with 1000 sweeps it is as it should be; without slop it is not", _MORE, (_NO_SLOP,), _SWEPT),
    ("without slop nothing is lost; more sweeps do nothing", _NO_SLOP, (_MORE,), _WITHIN_SLOP),
    ("without push-out it is as it should be; more sweeps do nothing", _NO_PUSH, (_MORE,), _PUSHED),
    ("with points that are kept while they drift it stops; without drag alone it does not", _KEPT, (_NO_DRAG,),
     _DROPPED),
    (
        "with points that are kept while they drift it slides right; more sweeps do nothing",
        {"contactBreakingThreshold": 0.3},
        (_MORE,),
        tuple(
            ("incline-points-dropped", profile, "incline", "acceleration", {"ratio": 2.0}, 2, _COARSE)
            for profile in ("tuned", "one")
        ),
    ),
    (
        "with points that are dropped after less drift none is left without a load; more sweeps do nothing",
        {"contactBreakingThreshold": 0.02},
        (_MORE,),
        (
            ("seam-points-held", "tuned", "seam", "braking", {"plate": 0.3}, 2, None),
        ),
    ),
    (
        "with nothing put in as a start it leaves straight; neither more sweeps nor less slop do it",
        _COLD,
        (_MORE, _NO_SLOP),
        (
            ("flat-box-sweeps-and-warm-start", "tuned", "flat_box", "edge_speed", {"e": 0.2}, 2, None),
            ("flat-box-sweeps-and-warm-start", "tuned", "flat_box", "sideways", {"e": 0.2, "aspect": 4.0}, 2, None),
            ("flat-box-sweeps-and-warm-start", "tuned", "flat_box", "sideways", {"e": 0.8, "aspect": 4.0}, 2,
             _COARSE),
        ),
    ),
    (
        "a tall box that stays takes both: nothing put in as a start, and 1000 sweeps; neither alone does it",
        _COLD | _MORE,
        (_MORE, _COLD),
        (("flat-box-sweeps-and-warm-start", "tuned", "flat_box", "rebound_ratio", {"e": 0.0, "aspect": 0.25}, 2,
          None),),
    ),
)  # fmt: skip

ELSEWHERE: tuple[Experiment, ...] = tuple(
    Experiment(family, says, profile, scene, metric, off, params, dimension, idle=idle, dt=dt)
    for says, off, idle, rows in _SHOWN
    for family, profile, scene, metric, params, dimension, dt in rows
)
