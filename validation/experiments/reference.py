"""Experiments on the textbook profile of our own solver."""

from __future__ import annotations

from typing import Any

from validation.experiments import Experiment

#: Profile `classical` is the textbook's and `reference` solves to the end: neither is tuned.
CANDIDATES: dict[str, tuple[Any, ...]] = {}

EXPERIMENTS: tuple[Experiment, ...] = tuple(
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
    )
)
