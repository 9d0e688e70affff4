"""Experiments on Rapier."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from adapters.experiment import Experiment

CANDIDATES: dict[str, tuple[Any, ...]] = {
    "iterations": (1, 4, 30),
    "substeps": (1, 4, 8, 64),
    "relaxations": (1, 4, 30),
    "frequency": (30.0, 240.0, 1920.0),
    "static_frequency": (60.0, 240.0, 1920.0),
    "damping_ratio": (1.0, 10.0, 200.0, 2000.0),
    "allowed_error": (0.0, 1e-5, 0.005),
    "prediction": (1e-5, 0.02),
    "fastest": (400.0, 1e9),
    "push_out": (0.3, 3.0),
    "recycling": (False, True),
}

_Settings = Mapping[str, Any]
#: Springs at the rate of a step of 1/240 s, and all overlap worth a push.
_STIFF: _Settings = {"frequency": 240.0, "static_frequency": 240.0, "allowed_error": 1e-5}
#: Springs as stiff as 64 small steps resolve, so damped that single roundings are not thrown back.
_HARD: _Settings = {**_STIFF, "frequency": 1920.0, "static_frequency": 1920.0, "substeps": 64, "damping_ratio": 2000.0}
#: Contacts are seen when they touch.
_UNSEEN: _Settings = {"prediction": 1e-5}
#: Sweeps until nothing is left to correct, with the springs and without.
_SWEPT: _Settings = {"iterations": 30, "relaxations": 30}
_ONE_STEP: _Settings = {"substeps": 1}
_MORE_STEPS: _Settings = {"substeps": 64}


def _each(
    family: str, says: str, off: _Settings, idle: tuple[_Settings, ...], *rows: tuple[str, int, str, dict[str, float]],
    within: float = 0.0,
) -> tuple[Experiment, ...]:  # fmt: skip
    """Experiments that differ in their rows only: profile, dimension, metric, parameters."""
    scene = next(name for name in _SCENES if family.startswith(name.replace("_", "-")))
    return tuple(
        Experiment(family, says, profile, scene, metric, off, params, dimension, idle=idle, within=within)
        for profile, dimension, metric, params in rows
    )


_SCENES = (
    "bounce", "domino", "far_origin", "flat_box", "heavy_on_light", "long_rest", "masse", "off_centre", "overhang",
    "overlap", "painleve", "pinch", "pivot", "position_correction", "pyramid", "rocker", "rocking_block",
    "roll_incline", "rolling_spin", "scales", "seam", "stack", "starved", "tilt_table",
)  # fmt: skip

EXPERIMENTS: tuple[Experiment, ...] = (
    *_each(
        "bounce-rest-of-a-step",
        "seen when it touches, with small steps of 1/64, it passes; small steps or stiffer contacts alone do not help",
        {**_UNSEEN, **_MORE_STEPS},
        (_MORE_STEPS, _STIFF),
        ("default", 2, "rest_time", {}),
        ("tuned", 2, "rest_time", {}),
    ),
    *_each(
        "far-origin-soft-contact",
        "stiff contacts and 30 sweeps together pass; either alone does not",
        {**_STIFF, "iterations": 30},
        (_STIFF, {"iterations": 30}),
        ("default", 2, "turned", {}),
    ),
    *_each(
        "flat-box-rebound-by-points",
        "where the sweeps are finished the box no longer leaves sideways; seen later it still does",
        _SWEPT,
        (_UNSEEN, _MORE_STEPS),
        ("default", 2, "sideways", {}),
        within=1e-6,
    ),
    *_each(
        "heavy-on-light-soft-contact",
        "with contacts as stiff as 64 small steps resolve it passes; small steps or sweeps alone do not help",
        _HARD,
        (_MORE_STEPS, {"iterations": 30}),
        ("default", 2, "penetration", {}),
        ("default", 2, "drift", {}),
        ("default", 2, "settle_time", {}),
    ),
    *_each(
        "masse-turning-point",
        "with one small step a step, which finds its contact anew, it passes; seen later it does not",
        _ONE_STEP,
        (_UNSEEN,),
        ("default", 3, "hop", {}),
        ("tuned", 3, "final_vy", {"back": 4.0, "side": 1.0}),
    ),
    *_each(
        "off-centre-turning-point",
        "with one small step it comes within 2e-5; seen later it does not",
        _ONE_STEP,
        (_UNSEEN,),
        ("default", 2, "energy_lost", {}),
        ("default", 2, "spin", {}),
        within=2e-5,
    ),
    *_each(
        "overhang-soft-contact",
        "with stiff contacts the row passes; small steps and no tolerated overlap do not help",
        _STIFF,
        (_MORE_STEPS, {"allowed_error": 0.0}),
        ("default", 2, "penetration", {}),
        ("default", 2, "drift", {}),
    ),
    *_each(
        "overlap-pushed-in-singles",
        "where nothing is pushed out, nothing moves; other steps do not help",
        {"push_out": 0.0},
        (_ONE_STEP,),
        ("default", 2, "centre_moved", {}),
        ("default", 2, "thrown", {"depth": 0.01, "ratio": 100.0}),
    ),
    *_each(
        "painleve-few-sweeps",
        "with 30 sweeps in each of 64 small steps it passes; stiffer contacts and seeing later do not help",
        {**_SWEPT, **_MORE_STEPS},
        (_UNSEEN, _STIFF),
        ("default", 2, "edge_moved", {}),
        ("default", 2, "passing_time", {}),
    ),
    *_each(
        "pivot-few-sweeps",
        "with 30 sweeps it turns straight; stiffer contacts and seeing later do not help",
        _SWEPT,
        (_STIFF, _UNSEEN),
        ("default", 3, "twisted", {}),
    ),
    *_each(
        "position-correction-few-sweeps",
        "with 30 sweeps without springs it comes straight up; 30 with them, or a slower push, do not help",
        {"relaxations": 30},
        ({"iterations": 30}, {"push_out": 0.3}),
        ("default", 2, "drift", {}),
        ("tuned", 2, "drift", {}),
    ),
    *_each(
        "pyramid-soft-contact",
        "with stiff contacts the row passes; more sweeps do not help",
        _STIFF,
        ({"iterations": 30},),
        ("default", 2, "penetration", {"rows": 5.0}),
        ("default", 2, "drift", {"rows": 5.0}),
    ),
    *_each(
        "pyramid-singles-in-stiff-contact",
        "damped 200 times as much it rests; more small steps do not help",
        {"damping_ratio": 2000.0},
        (_MORE_STEPS,),
        ("tuned", 2, "settle_time", {"rows": 5.0}),
        ("tuned", 2, "drift", {"rows": 5.0}),
    ),
    *_each(
        "rocker-turning-point",
        "with one small step a step, and contacts found anew in it, it passes; either alone does not help",
        {**_ONE_STEP, "recycling": False},
        (_ONE_STEP, {"recycling": False}),
        ("default", 2, "amplitude", {}),
        ("default", 2, "amplitude", {"tilt": 5.0}),
    ),
    *_each(
        "roll-incline-turning-point",
        "with one small step a step, which finds its contact anew, it passes; stiffer contacts do not help",
        _ONE_STEP,
        (_STIFF, _UNSEEN),
        ("default", 2, "acceleration", {}),
        ("default", 2, "turning", {}),
    ),
    *_each(
        "roll-incline-turning-point",
        "a ball that slips, or is about to, is held by a stiffer spring; seen later it does not pass",
        {"frequency": 1e4, "static_frequency": 1e4},
        (_UNSEEN, {"relaxations": 30}),
        ("default", 2, "turning", {"ratio": 1.5}),
    ),
    *_each(
        "rolling-spin-turning-point",
        "with one small step it comes within 2e-4, a rounding of each step; stiffer contacts and seeing later do not",
        _ONE_STEP,
        (_STIFF, _UNSEEN),
        ("default", 3, "spin", {}),
        within=2e-4,
    ),
    *_each(
        "scales-fastest",
        "without a limit of speed all is as in metres; stiffer contacts do nothing",
        {"fastest": 1e9},
        (_STIFF,),
        ("default", 2, "apex", {"length": 1000.0}),
        ("default", 2, "stopping_distance", {"length": 1000.0}),
    ),
    *_each(
        "seam-seen-ahead",
        "seen when they touch, and stiff enough not to sink in, the box slides over the seam; stiff alone it stops",
        {**_UNSEEN, **_STIFF},
        (_STIFF, {"clustering": False}),
        ("default", 2, "stopping_distance", {}),
        ("default", 3, "astray", {}),
    ),
    *_each(
        "seam-seen-ahead",
        "seen when they touch the box slides over the seam; one small step does not help",
        _UNSEEN,
        (_ONE_STEP,),
        ("tuned", 2, "hop", {}),
    ),
    *_each(
        "stack-soft-contact",
        "with stiff contacts the row passes; more sweeps do not help",
        _STIFF,
        ({"iterations": 30}, {"allowed_error": 0.0}),
        ("default", 2, "penetration", {"n": 10.0}),
        ("default", 2, "settle_time", {"n": 10.0}),
        ("default", 2, "penetration", {"n": 2.0}),
    ),
    *_each(
        "stack-singles-in-stiff-contact",
        "damped 200 times as much this column rests; more small steps do not help",
        {"damping_ratio": 2000.0},
        (_MORE_STEPS,),
        ("tuned", 2, "settle_time", {"n": 10.0}),
        ("tuned", 2, "kinetic_energy", {"n": 10.0}),
    ),
    *_each(
        "starved-soft-contact",
        "with stiff contacts the row stays where it is; more sweeps or no tolerated overlap do not help",
        _STIFF,
        ({"iterations": 30}, {"allowed_error": 0.0}),
        ("default", 2, "displacement", {}),
        ("default", 2, "penetration", {}),
    ),
    *(
        Experiment(
            "off-centre-seen-ahead",
            "seen when they touch the blow is found within a step; small steps or contacts found anew do not help",
            "default",
            "off_centre",
            metric,
            _UNSEEN,
            {"whirl": -2.0},
            idle=(_MORE_STEPS, {"recycling": False}),
            dt=1.0 / 480.0,
        )
        for metric in ("ball_speed", "bar_speed", "impulse", "sideways")
    ),
    Experiment(
        "off-centre-seen-ahead",
        "seen when they touch, and in one small step, angular momentum is kept; neither alone does it",
        "default",
        "off_centre",
        "angular_defect",
        {**_UNSEEN, **_ONE_STEP},
        {"whirl": -2.0},
        3,
        idle=(_UNSEEN, _ONE_STEP),
        dt=1.0 / 960.0,
    ),
    *(
        Experiment(
            "starved-soft-contact",
            "stiff and damped 200 times as much the row rests; stiff alone, or with more small steps or sweeps, not",
            "default",
            "starved",
            "kinetic_energy",
            {**_STIFF, "damping_ratio": 2000.0},
            params,
            idle=(_STIFF, _MORE_STEPS, {"iterations": 30}),
            dt=1.0 / 480.0,
        )
        for params in ({}, {"n": 30.0})
    ),
    *_each(
        "starved-singles-in-stiff-contact",
        "damped 200 times as much the row rests; more small steps do not help",
        {"damping_ratio": 2000.0},
        (_MORE_STEPS,),
        ("tuned", 2, "kinetic_energy", {}),
    ),
    *_each(
        "tilt-table-soft-contact",
        "with stiff contacts and twice the small steps it passes; contacts found anew, or seen later, do not help",
        {**_STIFF, "substeps": 8},
        ({"recycling": False}, _UNSEEN),
        ("default", 2, "moved", {}),
        ("default", 2, "passing_time", {"ratio": 1.1}),
    ),
    # What leaves its plane.
    *_each(
        "domino-few-sweeps",
        "with 30 sweeps in each of 64 small steps they stay; stiffer contacts, or seeing later, do not help",
        {**_SWEPT, **_MORE_STEPS},
        (_STIFF, _UNSEEN),
        ("default", 2, "out_of_plane", {}),
        ("tuned", 2, "out_of_plane", {}),
    ),
    *_each(
        "heavy-on-light-soft-contact",
        "stiffer and with 30 sweeps the boxes stay in their plane; neither alone keeps them there",
        {**_STIFF, **_SWEPT},
        (_STIFF, _SWEPT),
        ("default", 2, "out_of_plane", {}),
    ),
    *_each(
        "heavy-on-light-soft-contact",
        "as stiff as 64 small steps resolve, and damped, it stays, to what singles leave of a plane; either alone not",
        _HARD,
        (_MORE_STEPS, _STIFF, _SWEPT),
        ("default", 2, "out_of_plane", {"ratio": 1e4}),
        ("tuned", 2, "out_of_plane", {"ratio": 1e4}),
        within=6e-4,
    ),
    *_each(
        "pinch-soft-contact",
        "stiffer and with 30 sweeps the block stays in its plane; neither alone keeps it there",
        {**_STIFF, **_SWEPT},
        (_STIFF, _SWEPT),
        ("default", 2, "out_of_plane", {"margin": 100.0}),
    ),
    *_each(
        "long-rest-soft-contact",
        "with stiff contacts the boxes stay in their plane; seen later, or swept on, they do not",
        _STIFF,
        (_UNSEEN, {"relaxations": 30}),
        ("default", 2, "out_of_plane", {}),
    ),
    *_each(
        "painleve-few-sweeps",
        "with 30 sweeps the rod stays in its plane; stiffer contacts and seeing later do not keep it there",
        _SWEPT,
        (_UNSEEN, _STIFF),
        ("default", 2, "out_of_plane", {}),
        ("tuned", 2, "out_of_plane", {}),
    ),
    *_each(
        "position-correction-few-sweeps",
        "with 30 sweeps the box stays in its plane; stiffer contacts and small steps do not keep it there",
        _SWEPT,
        (_STIFF, _ONE_STEP),
        *((profile, 2, "out_of_plane", params) for profile in ("default", "tuned") for params in ({}, {"depth": 0.01})),
    ),
    *_each(
        "pyramid-soft-contact",
        "with stiff contacts the boxes stay in their plane; seen later, or in more small steps, they do not",
        _STIFF,
        (_UNSEEN, _ONE_STEP),
        ("default", 2, "out_of_plane", {"rows": 5.0}),
    ),
    *_each(
        "stack-soft-contact",
        "with stiff contacts, found anew, and more small steps and sweeps the boxes stay; sweeps alone do not help",
        {**_STIFF, "substeps": 8, "iterations": 4, "recycling": False},
        (_SWEPT, _UNSEEN),
        ("default", 2, "out_of_plane", {"n": 10.0}),
        ("default", 2, "out_of_plane", {"n": 20.0}),
    ),
    *_each(
        "rocking-block-few-sweeps",
        "with 30 sweeps the block stays in its plane; stiffer contacts, or seeing later, do not keep it there",
        _SWEPT,
        (_STIFF, _UNSEEN),
        *(
            (profile, 2, "out_of_plane", params)
            for profile in ("default", "tuned")
            for params in ({}, {"aspect": 0.5, "tilt": 0.7})
        ),
    ),
    *_each(
        "seam-seen-ahead",
        "seen when they touch the box slides straight over the seam; stiffer, or swept on, it does not",
        _UNSEEN,
        (_STIFF, _SWEPT),
        ("default", 2, "out_of_plane", {}),
        ("tuned", 2, "out_of_plane", {}),
    ),
)
