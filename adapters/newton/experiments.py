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

#: Contacts are made as far ahead as a step's sinking.
_NEAR: _Settings = {"gap": 1e-4}
#: As `_WHOLE`, by so little at a time that four contacts of a face do not take back more than there is.
_WHOLE_GENTLY: _Settings = {"weighted": False, "relaxation": 0.2}
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
_SWEPT_OUT = "where a hundred sweeps leave little of an overlap it passes"
EXPERIMENTS += tuple(
    Experiment(family, _SWEPT_OUT, "default", scene, metric, _SWEPT, params, idle=(_SLIPS_ALONE, *more))
    for family, scene, metric, params, more in (
        ("rocking-block-few-sweeps", "rocking_block", "amplitude[1]", {}, (_AHEAD,)),
        ("rocking-block-few-sweeps", "rocking_block", "landing[2]", {}, ()),
        ("rocking-block-few-sweeps", "rocking_block", "amplitude[2]", {}, ()),
        ("rocking-block-few-sweeps", "rocking_block", "amplitude[3]", {}, ()),
        ("rocking-block-few-sweeps", "rocking_block", "amplitude[1]", {"aspect": 0.5, "tilt": 0.7}, ()),
        ("rocking-block-few-sweeps", "rocking_block", "landing[3]", {"aspect": 0.5, "tilt": 0.7}, ()),
        ("rocking-block-few-sweeps", "rocking_block", "slid", {"aspect": 0.5, "tilt": 0.7}, (_WHOLE,)),
        ("conveyor-few-sweeps", "conveyor", "hop", {}, (_AHEAD,)),
        ("conveyor-few-sweeps", "conveyor", "turned", {}, ()),
    )
)
_SWEPT_TWENTY = "where twenty sweeps leave little of an overlap it passes; a hundred leave it trembling in singles"
EXPERIMENTS += tuple(
    Experiment(
        "starved-few-sweeps", _SWEPT_TWENTY, profile, "starved", metric, {"iterations": 20}, {}, iterations=sweeps,
        idle=(_SLIPS_ALONE, _AHEAD),
    )
    for profile, metric, sweeps in (
        ("default", "penetration", None), ("default", "kinetic_energy", None), ("default", "penetration", 1),
        ("default", "kinetic_energy", 1), ("default", "penetration", 4), ("tuned", "penetration", 1),
        ("tuned", "kinetic_energy", 1), ("tuned", "penetration", 4),
    )
)  # fmt: skip
_GENTLY = "where each contact gives a body all that it asks for, gently and in many sweeps, it passes"
EXPERIMENTS += tuple(
    Experiment(
        "pyramid-mean-of-contacts", _GENTLY, "default", "pyramid", metric, {"iterations": 50, **_WHOLE_GENTLY}, params,
        idle=(_SLIPS_ALONE, _AHEAD),
    )
    for metric, params in (
        ("interface_impulse[1]", {"rows": 5.0}), ("interface_impulse[5]", {"rows": 5.0}), ("drift", {}),
        ("penetration", {"rows": 5.0}), ("impulse_scatter", {"rows": 5.0}),
    )
)  # fmt: skip
EXPERIMENTS += (
    Experiment(
        "pyramid-mean-of-contacts", _GENTLY, "tuned", "pyramid", "drift", _WHOLE_GENTLY, idle=(_AHEAD,),
    ),
)  # fmt: skip
EXPERIMENTS += tuple(
    Experiment(
        "overhang-mean-of-contacts", _GENTLY, "default", "overhang", metric, {"iterations": sweeps, **_WHOLE_GENTLY},
        params, idle=(_SLIPS_ALONE, _AHEAD),
    )
    for metric, params, sweeps in (
        ("interface_impulse[1]", {}, 100), ("interface_impulse[3]", {}, 100), ("impulse_scatter", {}, 100),
        ("penetration", {}, 100), ("stands", {"margin": 0.02}, 200), ("kinetic_energy", {"margin": 0.02}, 200),
    )
)  # fmt: skip
EXPERIMENTS += (
    Experiment(
        "overhang-mean-of-contacts", _GENTLY, "tuned", "overhang", "kinetic_energy", _WHOLE_GENTLY, {"margin": 0.02},
        idle=(_AHEAD,),
    ),
)  # fmt: skip
_NO_SIDES = "where contacts are made 0.1 mm ahead it passes"
EXPERIMENTS += (
    Experiment(
        "seam-contacts-made-ahead", _NO_SIDES, "default", "seam", "stopping_distance", _NEAR,
        idle=(_WHOLE, _SLIPS_ALONE, _SWEPT),
    ),
)  # fmt: skip
EXPERIMENTS += tuple(
    Experiment(
        "seam-contacts-made-ahead", f"{_NO_SIDES}, with fifty sweeps", "default", "seam", metric,
        {"iterations": 50, **_NEAR}, dimension=dimension, idle=({"iterations": 50},),
    )
    for metric, dimension in (("hop", 2), ("turned", 2), ("braking", 3), ("stopping_distance", 3))
)  # fmt: skip
EXPERIMENTS += tuple(
    Experiment("seam-contacts-made-ahead", _NO_SIDES, "tuned", "seam", metric, _NEAR, idle=(_WHOLE,))
    for metric in ("stopping_distance", "braking", "hop", "turned")
)
EXPERIMENTS += (
    Experiment(
        "card-tent-few-sweeps", _SWEPT_OUT, "default", "card_tent", "let_go", _SWEPT, {"ratio": 0.8},
        idle=(_SLIPS_ALONE, _AHEAD),
    ),
)  # fmt: skip
