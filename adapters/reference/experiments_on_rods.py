"""Experiments on the textbook profile of our own solver: rods that land, and a rack that is broken."""

from __future__ import annotations

from adapters.experiment import Experiment

ON_RODS: tuple[Experiment, ...] = tuple(
    Experiment(
        family,
        "with more sweeps nothing is left to be seen",
        "classical",
        scene,
        metric,
        {"iterations": 1000},
    )
    for family, scene, metrics in (
        ("kane-starved", "kane", ("rise", "ahead", "spin", "gain")),
        ("rack-starved", "rack", ("energy_defect", "asymmetry")),
    )
    for metric in metrics
)
