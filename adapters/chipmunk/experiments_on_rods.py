"""Experiments on Chipmunk: rods that land or jam, a rack, and one scene in several units."""

from __future__ import annotations

from adapters.experiment import Experiment

_MORE = {"iterations": 1000}

ON_RODS: tuple[Experiment, ...] = (
    *(
        Experiment(
            "kane-fixed-sweeps",
            "with 1000 sweeps nothing is left to be seen; a smaller slop or no push-out changes nothing",
            profile,
            "kane",
            metric,
            _MORE,
            idle=({"collision_slop": 1e-4}, {"collision_bias": 1.0}) if profile == "default" else (),
        )
        for profile in ("default", "tuned")
        for metric in ("rise", "ahead", "spin", "gain")
    ),
    *(
        Experiment(
            "painleve-fixed-sweeps",
            "with 1000 sweeps the end jams in the first step; a smaller slop changes nothing",
            "default",
            "painleve",
            metric,
            _MORE,
            idle=({"collision_slop": 1e-4},),
        )
        for metric in ("passing_time", "edge_moved")
    ),
    *(
        Experiment(
            "scales-fixed-sweeps",
            "with 1000 sweeps nothing lifts off, in millimetres and in kilometres",
            "tuned",
            "scales",
            "hop",
            _MORE,
            params,
        )
        for params in (dict[str, float](), {"length": 1e3})
    ),
    *(
        Experiment(
            "rack-fixed-sweeps",
            "with 1000 sweeps energy and mirror are kept; push-out has nothing to do with it",
            "default",
            "rack",
            metric,
            _MORE,
            idle=({"collision_bias": 1.0},),
        )
        for metric in ("energy_defect", "asymmetry")
    ),
)
