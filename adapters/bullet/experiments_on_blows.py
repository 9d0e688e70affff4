"""Experiments on Bullet: blows beside the centre, and of what is moved."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from adapters.experiment import Experiment

_NO_DRAG = {"linearDamping": 0.0, "angularDamping": 0.0}
_NO_PUSH = {"contactERP": 0.0, "contactSlop": 0.0}


def on_blows(bare: Mapping[str, Any]) -> tuple[Experiment, ...]:
    """Experiments with ``bare``: a blow without anything that its law does not have."""
    cells = (
        ("closing_wall", "speed[1]", 2), ("edge_drop", "rise", 3), ("edge_drop", "spin", 3),
        ("restitution_above_one", "growth", 2),
    )  # fmt: skip
    return (
        *(
            Experiment(
                f"{scene.replace('_', '-')}-shipped-contact",
                "without speculation, push-out, slop, drag and thresholds the blow is exact; without drag alone not",
                "default",
                scene,
                metric,
                bare,
                dimension=dimension,
                idle=(_NO_DRAG,),
            )
            for scene, metric, dimension in (*cells, ("restitution_above_one", "blows", 2))
        ),
        *(
            Experiment(
                f"{scene.replace('_', '-')}-push-out",
                "without push-out (and slop) the blow is exact; more sweeps do nothing",
                "one",
                scene,
                metric,
                _NO_PUSH,
                dimension=dimension,
                idle=({"iterations": 1000},),
            )
            for scene, metric, dimension in cells
        ),
    )
