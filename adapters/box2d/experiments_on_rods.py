"""Experiments on Box2D 2.3: rods that land, jam or lean, dominoes, a rack, and one scene in several units."""

from __future__ import annotations

from typing import Any

from adapters.experiment import Experiment

_BARE: dict[str, Any] = {"skin": 0.0}
_FINE: dict[str, Any] = {"units_per_metre": 64.0}
_MORE: dict[str, Any] = {"iterations": 1000}
#: Roundings of singles over the blows of a rack.
_SINGLE = 1e-6
#: A blow that is found late acts halfway into the overlap: up to v dt/2 = 2.1 mm off an arm of 0.42 m, with 1 m/s.
_HALFWAY = 5e-3
_PLAIN = dict[str, float]()

ON_RODS: tuple[Experiment, ...] = (
    *(
        Experiment(
            f"{scene}-skin",
            "without a skin the row passes; ten times the sweeps do not help",
            "default",
            scene,
            metric,
            _BARE,
            params,
            idle=({"iterations": 80},),
        )
        for scene, metric, params in (
            ("domino", "edge_moved", {"ratio": 0.9}),
            ("domino", "next_moved", {"ratio": 0.9}),
            ("domino", "edge_moved", _PLAIN),
            ("painleve", "lifted", {"ratio": 0.6}),
            ("ladder", "moved", _PLAIN),
            ("ladder", "wall_load", _PLAIN),
            ("ladder", "passing_time", {"ratio": 0.8}),
            ("ladder", "let_go", {"ratio": 0.8}),
            ("shove", "down", _PLAIN),
            ("shove", "parted", _PLAIN),
            ("shove", "turned", _PLAIN),
            ("shove", "parted", {"ratio": 20.0}),
        )
    ),
    *(
        Experiment(
            "painleve-few-sweeps",
            "with 80 sweeps the end jams in time; without a skin it does not",
            "default",
            "painleve",
            metric,
            {"iterations": 80},
            idle=(_BARE, {"position_iterations": 30}),
        )
        for metric in ("passing_time", "edge_moved")
    ),
    *(
        Experiment(
            "kane-threshold",
            "in a finer unit the threshold is 1/64 m/s and the end rebounds, but for the point that the blow acts at; "
            "more sweeps and no sweeping ahead do nothing, nor does a box without a skin",
            "default",
            "kane",
            metric,
            _FINE,
            params,
            idle=(_MORE, {"continuous": False}, _BARE),
            within=_HALFWAY,
        )
        for metric in ("rise", "ahead", "spin", "gain")
        for params in (_PLAIN, {"mu": 0.1, "e": 0.5})
    ),
    Experiment(
        "rack-threshold-and-sweeps",
        "in a finer unit with 1000 sweeps energy is kept to roundings; either alone does not help",
        "default",
        "rack",
        "energy_defect",
        {**_FINE, **_MORE},
        idle=(_FINE, _MORE, {"continuous": False}),
        within=_SINGLE,
    ),
    *(
        Experiment(
            "scales-compiled-lengths",
            "in a unit of about the size of the bodies it passes, in millimetres without the skin; more sweeps or no "
            "sweeping ahead do nothing",
            profile,
            "scales",
            metric,
            off,
            {"length": length},
            idle=idle,
        )
        for profile, length, off, idle, metrics in (
            (
                "default",
                1e-3,
                {"units_per_metre": 1e3, **_BARE},
                ({"iterations": 80}, {"continuous": False}),
                ("stopping_distance", "braking", "end_speed", "hop", "turned", "apex"),
            ),
            (
                "default",
                1e3,
                {"units_per_metre": 1e-3},
                (_MORE, {"continuous": False}, _BARE),
                ("stopping_distance", "braking", "apex"),
            ),
            ("tuned", 1e-3, {"units_per_metre": 1e3}, (_MORE, {"continuous": False}), ("apex",)),
            (
                "tuned",
                1e3,
                {"units_per_metre": 1e-3},
                (_MORE, {"continuous": False}),
                ("stopping_distance", "braking", "apex"),
            ),
        )
        for metric in metrics
    ),
)
