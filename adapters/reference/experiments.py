"""Experiments on the textbook profile of our own solver."""

from __future__ import annotations

from typing import Any

from adapters.experiment import Experiment
from adapters.reference.experiments_on_loads import ON_LOADS
from adapters.reference.experiments_on_rods import ON_RODS

#: Profile `classical` is the textbook's and `reference` solves to the end: neither is tuned.
CANDIDATES: dict[str, tuple[Any, ...]] = {}

EXPERIMENTS: tuple[Experiment, ...] = tuple(
    Experiment(
        "starved-few-sweeps",
        "with 1000 sweeps the row stays where it is",
        "classical",
        "starved",
        metric,
        {"iterations": 1000},
        iterations=iterations,
    )
    for metric, iterations in (
        ("displacement", None),
        ("penetration", None),
        ("kinetic_energy", None),
        ("displacement", 1),
    )
)
EXPERIMENTS += tuple(
    Experiment(
        "stack-starved",
        "with 1000 sweeps the column stands",
        "classical",
        "stack",
        metric,
        {"iterations": 1000},
        {"n": 10.0},
        iterations=iterations,
    )
    for metric, iterations in (
        ("settle_time", None),
        ("kinetic_energy", None),
        ("drift", 4),
        ("penetration", 1),
        ("interface_impulse[5]", 1),
        ("impulse_scatter", 1),
        ("load[least]", 1),
        ("load[greatest]", 1),
        ("unbalanced", 1),
    )
) + tuple(
    Experiment(
        family,
        "with more sweeps nothing is left to be seen",
        "classical",
        scene,
        metric,
        {"iterations": sweeps},
        params,
        dimension,
    )
    for family, scene, params, dimension, sweeps, metrics in (
        ("flat-box-starved", "flat_box", {}, 3, 100, ("rebound_ratio", "edge_speed", "sideways", "impulse")),
        ("cradle-starved", "cradle", {"apart": 0.0, "n": 3.0}, 2, 100, ("energy_defect",)),
        (
            "heavy-on-light-starved",
            "heavy_on_light",
            {},
            2,
            1000,
            ("settle_time", "drift", "penetration", "kinetic_energy", "interface_impulse[1]"),
        ),
        ("pinch-starved", "pinch", {"margin": 100.0}, 3, 1000, ("creep", "turned", "grip", "carried", "unbalanced")),
    )
    for metric in metrics
)

EXPERIMENTS += (
    Experiment(
        "pivot-starved",
        "with more sweeps nothing is left to be seen",
        "classical",
        "pivot",
        "twisted",
        {"iterations": 1000},
        dimension=3,
    ),
)

EXPERIMENTS += tuple(
    Experiment(
        "overhang-starved",
        "with more sweeps nothing is left to be seen",
        "classical",
        "overhang",
        "penetration",
        {"iterations": 1000},
        params,
    )
    for params in (dict[str, float](), {"margin": 0.02})
)

EXPERIMENTS += ON_LOADS

EXPERIMENTS += ON_RODS
