"""Experiments on MuJoCo's profile of exact laws: where its loop ends, what it pushes out, what its margin lets go."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from adapters.experiment import Experiment

_Changes = Mapping[str, Any]
_ROUNDS: _Changes = {"rounds": 1000}
_FURTHER: _Changes = {"tolerance": 0.0}
#: What rests is not pushed out of what it overlaps; it is pushed out however fast.
_LEFT: _Changes = {"push_out": 0.0}
_FAST: _Changes = {"push_out_speed": 1.0}
#: Some thirty times the fall of a step at 1/960 s, ten times the margin that the profile has at 1/60 s.
_WIDE: _Changes = {"margin": 3e-5}
_FINE = 1.0 / 960.0

ON_MATCHED: tuple[Experiment, ...] = (
    *(
        Experiment(
            "pair-matrix-agreed",
            "with shifts that agree to a tenth the rebound is known ten times better; more rounds, or Newton's method "
            "to its end, do nothing",
            "matched",
            "pair_matrix",
            "restitution[1]",
            {"agreed": 1e-14},
            {"cross": cross, "fall": 0.5},
            idle=(_ROUNDS, _FURTHER),
        )
        for cross in (0.5, 1.0, 1.5)
    ),
    *(
        Experiment(
            f"{scene.replace('_', '-')}-push-out",
            "where an overlap is left alone it is as it should be; more rounds, or a faster push, do nothing",
            "matched",
            scene,
            metric,
            _LEFT,
            params,
            dimension=dimension,
            idle=(_ROUNDS, _FAST),
            dt=dt,
        )
        for scene, metric, params, dimension, dt in (
            ("tilt_table", "edge_moved", {"ratio": 1.1}, 2, 1.0 / 480.0),
            ("tilt_table", "edge_moved", {"ratio": 1.1}, 2, _FINE),
            ("tilt_table", "edge_moved", {"ratio": 1.1}, 3, 1.0 / 480.0),
            ("tilt_table", "edge_moved", {"ratio": 1.1}, 3, _FINE),
            ("ladder", "passing_spin", {"ratio": 0.8}, 2, _FINE),
            ("domino", "struck_spin", dict[str, float](), 2, _FINE),
        )
    ),
    *(
        Experiment(
            "head-on-unfinished",
            "with Newton's method to its end what lasts carries nothing; more rounds, or shifts that agree to less, do "
            "nothing",
            "matched",
            "head_on",
            "impulse",
            _FURTHER,
            {"e": 0.0, "ratio": 1e5},
            dimension=dimension,
            idle=(_ROUNDS, {"agreed": 1e-15}),
        )
        for dimension in (2, 3)
    ),
    Experiment(
        "card-tent-let-go",
        "with a margin ten times as wide feet and heads stay in contact; push-out or more rounds do nothing",
        "matched",
        "card_tent",
        "let_go",
        _WIDE,
        {"ratio": 0.8},
        idle=(_LEFT, _ROUNDS),
        dt=1.0 / 60.0,
    ),
)
