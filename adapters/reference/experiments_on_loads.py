"""Experiments on the textbook profile of our own solver: what slides over plates."""

from __future__ import annotations

from adapters.experiment import Experiment

ON_LOADS: tuple[Experiment, ...] = tuple(
    Experiment(
        "seam-margin",
        "without contacts at a distance the plate ahead is not met before the box is on it; more sweeps change nothing",
        "classical",
        "seam",
        metric,
        {"margin": 0.0},
        dimension=dimension,
        idle=({"iterations": 1000},),
    )
    for metric in ("stopping_distance", "hop", "turned")
    for dimension in (2, 3)
)
