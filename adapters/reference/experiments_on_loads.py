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

ON_LOADS += tuple(
    Experiment(
        "seam-margin",
        "without contacts at a distance it brakes right and goes straight on short plates; more sweeps do nothing",
        "classical",
        "seam",
        metric,
        {"margin": 0.0},
        params,
        dimension,
        idle=({"iterations": 1000},),
    )
    for metric, params, dimension in (
        ("braking", {"v": 10.0}, 2),
        ("braking", {"plate": 0.3}, 3),
        ("astray", {"plate": 0.3}, 3),
    )
)

ON_LOADS += tuple(
    Experiment(
        "tilt-table-starved",
        "with more sweeps the block passes in time; a margin has nothing to do with it",
        "classical",
        "tilt_table",
        "passing_time",
        {"iterations": 1000},
        {"ratio": ratio, "aspect": 0.3},
        idle=({"margin": 0.0},),
        dt=dt,
    )
    for ratio, dt in ((1.02, None), (1.1, 1.0 / 960.0))
)

ON_LOADS += tuple(
    Experiment(
        "overhang-starved",
        "with more sweeps it stands, moves nothing and carries its weight; a margin has nothing to do with it",
        "classical",
        "overhang",
        metric,
        {"iterations": 1000},
        params,
        idle=({"margin": 0.0},),
    )
    for params, metrics in (
        ({"n": 2.0, "margin": 1e-6}, ("stands", "drift", "settle_time", "interface_impulse[1]")),
        ({"margin": 0.005}, ("stands", "impulse_scatter", "kinetic_energy")),
        ({"n": 8.0, "margin": 0.2}, ("settle_time", "impulse_scatter", "interface_impulse[8]")),
    )
    for metric in metrics
)

ON_LOADS += tuple(
    Experiment(
        "pyramid-starved",
        "with 100 sweeps the wall stands still; it takes two instead of ten for five rows to sink as ten rows do",
        "classical",
        "pyramid",
        metric,
        {"iterations": 100},
        {"rows": 5.0},
        iterations=2,
        idle=({"margin": 0.0},),
    )
    for metric in ("drift", "penetration", "settle_time", "kinetic_energy", "interface_impulse[5]")
)
