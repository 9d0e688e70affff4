"""Experiments on Chipmunk."""

from __future__ import annotations

from typing import Any

from adapters.chipmunk.experiments_elsewhere import ELSEWHERE
from adapters.chipmunk.experiments_on_loads import ON_LOADS
from adapters.chipmunk.experiments_on_rods import ON_RODS
from adapters.experiment import Cured, Experiment

#: Iterations are left alone: they cost time, and any count is better than a lower one.
CANDIDATES: dict[str, tuple[Any, ...]] = {
    "collision_slop": (0.0, 1e-5, 1e-4, 2e-4, 1e-3, 0.10000000149011612),
    "start_overlap": (0.0, 1e-5, 5e-5, 1e-4, 5e-4),
    "collision_bias": (0.0, 0.0017970074436457143, 1.0),
    "collision_persistence": (1, 2, 3),
}

#: 20 boxes are more than its tuned profile holds.
CURED: tuple[Cured, ...] = (Cured("default", "tuned", "stack", ({}, {"n": 10.0})),)

#: A start inside the band that is never corrected, and well below the g dt^2 = 1.7e-4 m of the check.
_INSIDE = {"start_overlap": 5e-5}

EXPERIMENTS: tuple[Experiment, ...] = (
    Experiment(
        "stack-touching-start",
        "1000 sweeps keep the touching pair from lifting off; a slop of 1e-5 m instead of 0.1 m changes nothing",
        "default",
        "stack",
        "penetration",
        {"iterations": 1000},
        {"n": 2.0},
        idle=({"collision_slop": 1e-5},),
    ),
    *(
        Experiment(
            "stack-touching-start",
            "taller columns need both: a start inside the slop, so that no contact flickers, and enough sweeps; a "
            "smaller slop changes nothing",
            "default",
            "stack",
            "penetration",
            {"iterations": 1000, **_INSIDE},
            {"n": 10.0},
            iterations=iterations,
            idle=({"collision_slop": 1e-5},),
        )
        for iterations in (None, 1, 4, 30)
    ),
    *(
        Experiment(
            "stack-fixed-sweeps",
            "with 1000 sweeps from a start inside the slop the column stands; a smaller slop does not make it stand",
            profile,
            "stack",
            metric,
            {"iterations": 1000, **_INSIDE},
            {"n": 10.0},
            iterations=iterations,
            idle=({"collision_slop": 1e-5},) if profile == "default" else (),
        )
        for profile, metric, iterations in (
            ("default", "settle_time", None),
            ("default", "kinetic_energy", None),
            ("default", "drift", None),
            ("default", "interface_impulse[5]", 1),
            ("default", "impulse_scatter", 1),
            ("default", "load[least]", 1),
            ("default", "unbalanced", 1),
            ("tuned", "settle_time", 4),
            ("tuned", "kinetic_energy", 4),
            ("tuned", "drift", 4),
            ("tuned", "interface_impulse[5]", 1),
            ("tuned", "impulse_scatter", 1),
            ("tuned", "load[greatest]", 1),
            ("tuned", "unbalanced", 1),
        )
    ),
    *(
        Experiment(
            "starved-fixed-sweeps",
            "with 1000 sweeps the row stays where it is; a smaller slop, or another start, does not hold it",
            profile,
            "starved",
            metric,
            {"iterations": 1000},
            iterations=iterations,
            idle=({"collision_slop": 1e-5},) if profile == "default" else ({"start_overlap": 0.0},),
        )
        for profile, metric, iterations in (
            ("default", "displacement", None),
            ("default", "penetration", None),
            ("default", "kinetic_energy", 1),
            ("tuned", "displacement", 1),
            ("tuned", "penetration", 1),
            ("tuned", "kinetic_energy", 1),
        )
    ),
    *(
        Experiment(
            "flat-box-fixed-sweeps",
            "with 100 sweeps the corners are solved",
            profile,
            "flat_box",
            metric,
            {"iterations": 100},
        )
        for profile in ("default", "tuned")
        for metric in ("rebound_ratio", "edge_speed", "sideways", "impulse")
    ),
    *(
        Experiment(
            "heavy-on-light-fixed-sweeps",
            "with 100000 sweeps from a start inside the slop the pair stands; such a start alone does not help",
            profile,
            "heavy_on_light",
            metric,
            {"iterations": 100000, **_INSIDE},
            params,
            idle=(_INSIDE,),
        )
        for profile, params, metric in (
            ("default", {}, "settle_time"),
            ("default", {}, "kinetic_energy"),
            ("default", {"ratio": 1e4}, "drift"),
            ("default", {"ratio": 1e4}, "interface_impulse[1]"),
            ("tuned", {}, "penetration"),
            ("tuned", {"ratio": 1e4}, "drift"),
        )
    ),
    *(
        Experiment(
            f"{scene}-touching-start",
            "with more sweeps, or from a start inside the slop, nothing lifts off; a smaller slop changes nothing",
            "default",
            scene,
            "hop",
            off,
            idle=({"collision_slop": 1e-5},),
        )
        for scene in ("slide", "conveyor")
        for off in ({"iterations": 1000}, _INSIDE)
    ),
    *(
        Experiment(
            "wedge-touching-start",
            "with more sweeps, a start inside the slop, or a slop that leaves no overlap, the block slides right; "
            "pushing out faster does nothing",
            "default",
            "wedge",
            "acceleration",
            off,
            idle=({"collision_bias": 0.5},),
        )
        for off in ({"iterations": 100}, _INSIDE, {"collision_slop": 1e-5})
    ),
)

EXPERIMENTS += tuple(
    Experiment(
        "overhang-touching-start",
        "with 1000 sweeps from a start inside the slop nothing lifts off; such a start or a smaller slop alone do not",
        "default",
        "overhang",
        "penetration",
        {"iterations": 1000, **_INSIDE},
        params,
        idle=(_INSIDE, {"collision_slop": 1e-5}),
    )
    for params in (dict[str, float](), {"margin": 0.02})
)

EXPERIMENTS += ON_LOADS

EXPERIMENTS += ON_RODS

EXPERIMENTS += ELSEWHERE
