"""Experiments on DART."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from adapters.experiment import Experiment

CANDIDATES: dict[str, tuple[Any, ...]] = {
    "solver": ("dantzig", "pgs", "nsgs", "fbf"),
    "detector": ("fcl", "dart", "ode", "bullet"),
    "iterations": (30, 2000, 50000),
    "second_sweeps": (200, 5000),
    "second_tolerance": (1e-12, 1e-9),
}

_Settings = Mapping[str, Any]
#: The second choice sweeps until nothing changes.
_TO_THE_END: _Settings = {"second_sweeps": 5000, "second_tolerance": 1e-12}
#: The same pyramid, whose friction follows the loads from sweep to sweep; and an exact cone.
_FOLLOWS: _Settings = {"solver": "pgs"}
_CONE: _Settings = {"solver": "fbf"}
#: Other points of contact, and a tolerance that stops no sweep.
_OTHERS: _Settings = {"detector": "ode"}
_FINE: _Settings = {"tolerance": 1e-14}


def _each(
    family: str,
    says: str,
    off: _Settings,
    idle: tuple[_Settings, ...],
    *rows: tuple[str, str, int, str, dict[str, float]],
    within: float = 0.0,
) -> tuple[Experiment, ...]:
    """Experiments that differ in their rows only: profile, scene, dimension, metric, parameters."""
    return tuple(
        Experiment(family, says, profile, scene, metric, off, params, dimension, None, idle, within)
        for profile, scene, dimension, metric, params in rows
    )


def _swept(
    family: str, times: int, *rows: tuple[str, str, int, str, dict[str, float]], within: float = 0.0
) -> tuple[Experiment, ...]:
    says = f"with {times} sweeps it passes; a finer tolerance does not help"
    return _each(family, says, {"iterations": times}, (_FINE,), *rows, within=within)


#: What compliance makes of the energy of three balls, 1e-5 of each blow's speed twice: an experiment is that near.
_COMPLIANCE = 1e-4

EXPERIMENTS: tuple[Experiment, ...] = (
    *_each(
        "cradle-second-choice",
        "where the second choice sweeps to the end only compliance is left; other points of contact do not help",
        _TO_THE_END,
        (_OTHERS,),
        ("default", "cradle", 2, "energy_defect", {"n": 3.0, "apart": 0.0}),
        ("default", "cradle", 3, "energy_defect", {"n": 3.0, "apart": 0.0}),
        within=_COMPLIANCE,
    ),
    *_each(
        "overhang-second-choice",
        "where the second choice sweeps to the end it passes; other points of contact do not help",
        _TO_THE_END,
        (_OTHERS,),
        ("default", "overhang", 2, "penetration", {}),
        ("default", "overhang", 2, "penetration", {"margin": 0.02}),
    ),
    *_each(
        "pyramid-second-choice",
        "where the second choice sweeps to the end it passes; another tolerance alone does not help",
        _TO_THE_END,
        ({"second_tolerance": 1e-4},),
        ("default", "pyramid", 3, "penetration", {}),
    ),
    *_each(
        "ladder-friction-limited-once",
        "where friction follows the loads, under the same pyramid, it passes; other points of contact and a second "
        "choice that sweeps to the end do not help",
        _FOLLOWS,
        (_OTHERS, _TO_THE_END),
        ("default", "ladder", 2, "moved", {}),
        ("default", "ladder", 2, "wall_load", {}),
        ("default", "ladder", 2, "passing_time", {"ratio": 0.8}),
    ),
    *_each(
        "ladder-friction-limited-once",
        "with an exact cone it passes as well",
        _CONE,
        (),
        ("default", "ladder", 2, "passing_spin", {"ratio": 0.8}),
        ("default", "ladder", 2, "floor_load", {}),
    ),
    *_each(
        "painleve-friction-limited-once",
        "where friction follows the loads, under the same pyramid, the end stops; other points of contact and a second "
        "choice that sweeps to the end do not help",
        _FOLLOWS,
        (_OTHERS, _TO_THE_END),
        ("default", "painleve", 2, "edge_moved", {}),
    ),
    *_swept(
        "flat-box-few-sweeps",
        10**6,
        ("pgs", "flat_box", 2, "edge_speed", {}),
        ("pgs", "flat_box", 2, "sideways", {}),
        ("pgs", "flat_box", 3, "edge_speed", {"e": 0.8, "aspect": 4.0}),
        within=1e-9,
    ),
    *_swept(
        "heavy-on-light-few-sweeps",
        2000,
        ("pgs", "heavy_on_light", 2, "penetration", {"ratio": 100.0}),
        ("pgs", "heavy_on_light", 2, "settle_time", {"ratio": 100.0}),
    ),
    *_swept(
        "overhang-few-sweeps",
        1000,
        ("pgs", "overhang", 2, "settle_time", {}),
        ("pgs", "overhang", 2, "penetration", {}),
    ),
    *_swept(
        "pinch-few-sweeps",
        1000,
        ("pgs", "pinch", 2, "creep", {"margin": 100.0, "pad": 4.0}),
        ("pgs", "pinch", 2, "unbalanced", {}),
        ("pgs", "pinch", 2, "grip[greatest]", {}),
        ("pgs", "pinch", 3, "grip[least]", {"margin": 100.0}),
        ("pgs", "pinch", 2, "carried[least]", {"margin": 1.05}),
        ("pgs", "pinch", 3, "carried[greatest]", {"margin": 1.05}),
    ),
    *_each(
        "edge-drop-few-sweeps",
        "with a finer tolerance both corners get the same to the last digits; other points of contact do not help",
        _FINE,
        (_OTHERS,),
        ("nsgs", "edge_drop", 3, "twisted", {"e": 1.0, "tilt": 30.0}),
        ("fbf", "edge_drop", 3, "twisted", {}),
    ),
    *_swept("pivot-few-sweeps", 50000, ("pgs", "pivot", 3, "twisted", {})),
    *_swept("pyramid-few-sweeps", 600, ("pgs", "pyramid", 2, "settle_time", {"rows": 5.0})),
    *_swept("tilt-table-few-sweeps", 50000, ("pgs", "tilt_table", 3, "edge_moved", {"ratio": 1.1, "aspect": 0.3})),
    Experiment(
        "starved-few-sweeps",
        "with as many sweeps as the profile has it carries; a finer tolerance does not help",
        "pgs",
        "starved",
        "displacement",
        {"iterations": 200},
        iterations=4,
        idle=(_FINE,),
    ),
    *(
        Experiment(
            "starved-few-sweeps",
            "with enough sweeps it carries; a finer tolerance does not help",
            profile,
            "starved",
            metric,
            {"iterations": 10000},
            iterations=sweeps,
            idle=(_FINE,),
        )
        for profile, metric, sweeps in (("nsgs", "displacement", 4), ("fbf", "load_error", 1))
    ),
    *_each(
        "rack-sweeps-end-early",
        "with a finer tolerance both sides get the same to the last digits; other points of contact do not help",
        _FINE,
        (_OTHERS,),
        ("nsgs", "rack", 2, "asymmetry", {}),
        ("fbf", "rack", 2, "asymmetry", {}),
    ),
    *_swept(
        "stack-few-sweeps",
        2000,
        *(
            ("pgs", "stack", 2, metric, {"n": 5.0})
            for metric in ("kinetic_energy", "load[least]", "load[greatest]", "unbalanced")
        ),
    ),
    # What leaves its plane.
    *(
        experiment
        for scene, rows in (("ladder", ({},)), ("pinch", ({}, {"margin": 100.0})))
        for params in rows
        for experiment in _each(
            f"{scene}-second-choice",
            "where the second choice sweeps to the end it stays in its plane; another tolerance alone does not help",
            _TO_THE_END,
            ({"second_tolerance": 1e-4},),
            ("default", scene, 2, "out_of_plane", params),
        )
    ),
    *_swept(
        "flat-box-few-sweeps",
        10**6,
        ("pgs", "flat_box", 2, "out_of_plane", {}),
        ("pgs", "flat_box", 2, "out_of_plane", {"e": 1.0}),
    ),
    *_swept("kane-few-sweeps", 10**6, ("pgs", "kane", 2, "out_of_plane", {})),
    *(
        experiment
        for scene in ("flat_box", "kane")
        for experiment in _each(
            f"{scene.replace('_', '-')}-few-sweeps",
            "by splitting, which sees all points at once, it stays in its plane; a finer tolerance does not help",
            _CONE,
            (_FINE, _OTHERS),
            ("nsgs", scene, 2, "out_of_plane", {}),
        )
    ),
    *_swept("heavy-on-light-few-sweeps", 4000, ("pgs", "heavy_on_light", 2, "out_of_plane", {"duration": 2.0})),
    *_swept(
        "overhang-few-sweeps",
        1000,
        ("pgs", "overhang", 2, "out_of_plane", {}),
        ("pgs", "overhang", 2, "out_of_plane", {"margin": 0.02}),
    ),
    *_each(
        "painleve-few-sweeps",
        "with 100 000 sweeps, to the last digit, the rod stays in its plane; a tenth, or digits alone, do not do",
        {"iterations": 10**5, **_FINE},
        ({"iterations": 10**4}, _FINE, {"detector": "bullet"}),
        ("pgs", "painleve", 2, "out_of_plane", {"ratio": 0.6}),
    ),
    *_swept(
        "pinch-few-sweeps",
        1000,
        ("pgs", "pinch", 2, "out_of_plane", {}),
        ("pgs", "pinch", 2, "out_of_plane", {"margin": 100.0}),
    ),
    *_swept("pyramid-few-sweeps", 600, ("pgs", "pyramid", 2, "out_of_plane", {"rows": 5.0})),
    *_swept("stack-few-sweeps", 4000, ("pgs", "stack", 2, "out_of_plane", {"n": 10.0, "duration": 2.0})),
)
