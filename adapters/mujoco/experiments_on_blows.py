"""Experiments on MuJoCo: blows beside the centre, and of what is moved."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from adapters.experiment import Experiment


def on_blows(reflect: Mapping[str, Any]) -> tuple[Experiment, ...]:
    """Experiments with ``reflect``: the velocity reflected in the step after contact."""
    cells = (("closing_wall", "speed[1]", 2), ("edge_drop", "sideways", 3), ("edge_drop", "twisted", 3))
    return tuple(
        Experiment(
            f"{scene.replace('_', '-')}-soft-contact",
            "with the velocity reflected in the step after contact nothing is left of it",
            "default",
            scene,
            metric,
            reflect,
            dimension=dimension,
            idle=({"tolerance": 0.0},) if metric != "twisted" else (),
        )
        for scene, metric, dimension in cells
    )
