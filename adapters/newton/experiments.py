"""Experiments on Newton's XPBD."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from adapters.experiment import Experiment

CANDIDATES: dict[str, tuple[Any, ...]] = {
    "iterations": (2, 10, 50, 500),
    "relaxation": (0.4, 0.8, 1.0),
    "weighted": (False, True),
    "rebounds": (False, True),
    "torsional": (0.0, 0.005),
    "rolling": (0.0, 0.0001),
    "gap": (0.01, 0.1, 1.0),
}

_Settings = Mapping[str, Any]
#: Each contact gives a body all that it asks for.
_WHOLE: _Settings = {"weighted": False}
#: No friction but that of slips.
_SLIPS_ALONE: _Settings = {"torsional": 0.0, "rolling": 0.0}
#: Contacts are made ten times as far ahead.
_AHEAD: _Settings = {"gap": 1.0}

#: Sweeps until little is left of an overlap.
_SWEPT: _Settings = {"iterations": 100}

_IDLE = (_SLIPS_ALONE, _AHEAD)
_MEANS = "where each contact gives a body all that it asks for it passes"
EXPERIMENTS: tuple[Experiment, ...] = tuple(
    Experiment("shove-mean-of-contacts", _MEANS, profile, "shove", metric, _WHOLE, params, 2, idle=_IDLE)
    for profile, metric, params in (
        ("default", "down", {}),
        ("default", "force", {"ratio": 20.0}),
        ("default", "parted", {}),
        ("tuned", "down", {}),
    )
)
EXPERIMENTS += tuple(
    Experiment(
        "rocker-rolling-friction", "where nothing resists rolling it passes", "default", "rocker", "amplitude",
        {"rolling": 0.0}, params, idle=(_WHOLE, _AHEAD),
    )
    for params in ({}, {"tilt": 5.0})
)  # fmt: skip
_SWEPT_OUT = "where a hundred sweeps leave little of an overlap it passes"
_SMOOTH = "where what rubs resists neither rolling nor spinning it passes"
EXPERIMENTS += tuple(
    Experiment(family, _SWEPT_OUT, "default", scene, metric, _SWEPT, params, idle=(_SLIPS_ALONE, *more))
    for family, scene, metric, params, more in (
        ("rocking-block-few-sweeps", "rocking_block", "amplitude[1]", {}, (_AHEAD,)),
        ("rocking-block-few-sweeps", "rocking_block", "landing[2]", {}, ()),
        ("rocking-block-few-sweeps", "rocking_block", "slid", {"aspect": 0.5, "tilt": 0.7}, (_WHOLE,)),
        ("conveyor-few-sweeps", "conveyor", "hop", {}, (_AHEAD,)),
        ("conveyor-few-sweeps", "conveyor", "turned", {}, ()),
    )
)
EXPERIMENTS += (
    Experiment(
        "roll-incline-friction-about-the-normal", _SMOOTH, "default", "roll_incline", "turning", _SLIPS_ALONE,
        {"ratio": 1.5}, idle=(_WHOLE, _SWEPT),
    ),
)  # fmt: skip
