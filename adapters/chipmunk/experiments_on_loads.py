"""Experiments on Chipmunk: what slides over plates."""

from __future__ import annotations

from adapters.experiment import Experiment

ON_LOADS: tuple[Experiment, ...] = tuple(
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
)
