"""Experiments on Chipmunk: what slides over plates, or rides on a belt."""

from __future__ import annotations

from adapters.experiment import Experiment

ON_LOADS: tuple[Experiment, ...] = (
    *(
        Experiment(
            "seam-touching-start",
            "with more sweeps, or from a start inside the slop, nothing lifts off; a smaller slop changes nothing",
            "default",
            "seam",
            "hop",
            off,
            idle=({"collision_slop": 1e-5},),
        )
        for off in ({"iterations": 1000}, {"start_overlap": 5e-5})
    ),
    Experiment(
        "conveyor-few-sweeps",
        "with 1000 sweeps it goes with the belt; a smaller slop does nothing",
        "default",
        "conveyor",
        "slip_speed",
        {"iterations": 1000},
        {"mu": 0.8, "v": 0.5},
        idle=({"collision_slop": 1e-5},),
        dt=1.0 / 60.0,
    ),
)
