"""Experiments on Box2D 2.3."""

from __future__ import annotations

from typing import Any

from adapters.box2d.experiments_on_rods import ON_RODS
from adapters.experiment import Experiment

CANDIDATES: dict[str, tuple[Any, ...]] = {
    "iterations": (8, 100, 1000),
    "position_iterations": (3, 10),
    "skin": (0.0, 1e-4, 0.01),
    "units_per_metre": (1.0, 4.0, 16.0, 64.0),
    "continuous": (False, True),
}

_BARE: dict[str, Any] = {"skin": 0.0}
_THIN: dict[str, Any] = {"skin": 1e-4}
#: Ten roundings of a single number of order 1.
_SINGLE = 1e-6

EXPERIMENTS: tuple[Experiment, ...] = tuple(
    Experiment(
        f"{scene.replace('_', '-')}-skin",
        "without a skin the row passes; ten times the sweeps do not help",
        "default",
        scene,
        metric,
        _BARE,
        params,
        idle=({"iterations": 80},),
    )
    for scene, metric, params in (
        ("stack", "penetration", {"n": 2.0}),
        ("v_groove", "displacement", {}),
        ("bounce", "force_in_flight", {}),
        ("slide", "hop", {}),
        ("slide_to_roll", "final_speed", {}),
        ("roll_incline", "turning", {"ratio": 1.5}),
        ("pivot", "edge_moved", {}),
        ("rocking_block", "slid", {"aspect": 0.25, "height": 10.0}),
        ("rocker", "amplitude", {}),
        *(("seam", metric, {}) for metric in ("stopping_distance", "braking", "hop", "turned")),
        ("pyramid", "penetration", {}),
        *(("position_correction", "launched", params) for params in ({}, {"depth": 0.01})),
        ("tilt_table", "moved", {}),
        ("tilt_table", "moved", {"aspect": 1.0}),
        ("tilt_table", "passing_time", {"ratio": 1.1}),
        ("tilt_table", "edge_moved", {"ratio": 1.1}),
        ("tilt_table", "turned", {"aspect": 1.0, "ratio": 1.1}),
        *(("closing_wall", f"time[{k}]", {"closing": 0.1}) for k in (1, 2, 3)),
    )
)

EXPERIMENTS += tuple(
    Experiment(
        family,
        f"with a skin of a hundredth and {sweeps} sweeps it passes; either alone does not help",
        "default",
        scene,
        metric,
        {**_THIN, "iterations": sweeps},
        params,
        idle=(_THIN, {"iterations": sweeps}),
    )
    for family, scene, metric, params, sweeps in (
        ("stack-skin", "stack", "penetration", {"n": 10.0}, 100),
        ("overhang-skin", "overhang", "penetration", {"margin": 0.02}, 100),
        ("heavy-on-light-skin-and-sweeps", "heavy_on_light", "penetration", {"ratio": 100.0}, 1000),
        ("heavy-on-light-skin-and-sweeps", "heavy_on_light", "drift", {"ratio": 10000.0}, 30000),
    )
)

EXPERIMENTS += tuple(
    Experiment(
        "stack-few-sweeps",
        "with 100 sweeps the column stands",
        "tuned",
        "stack",
        "penetration",
        {"iterations": 100},
        {"n": 10.0},
        iterations=count,
        idle=({"units_per_metre": 64.0},),
    )
    for count in (1, 4)
)

EXPERIMENTS += (
    Experiment(
        "cradle-few-sweeps",
        "with 100 sweeps the touching balls keep their energy to round-off",
        "default",
        "cradle",
        "energy_defect",
        {"iterations": 100},
        {"n": 3.0, "apart": 0.0},
        idle=({"position_iterations": 30}, {"units_per_metre": 64.0}),
        within=_SINGLE,
    ),
    *(
        Experiment(
            "galperin-threshold",
            "in a finer unit the threshold is 1/64 m/s, and every blow rebounds",
            "default",
            "galperin",
            metric,
            {"units_per_metre": 64.0},
            {"ratio": 16.0},
            idle=({"iterations": 1000}, {"continuous": False}),
            within=_SINGLE,
        )
        for metric in ("small_speed", "large_speed", "energy_defect")
    ),
    *(
        Experiment(
            "rod-gas-threshold",
            "in a finer unit the threshold is 1/64 m/s, and every blow rebounds",
            "default",
            "rod_gas",
            metric,
            {"units_per_metre": 64.0},
            idle=({"iterations": 1000}, {"continuous": False}),
            within=_SINGLE,
        )
        for metric in ("misplaced", "wrong_speed", "energy_defect")
    ),
    *(
        Experiment(
            "starved-skin-and-sweeps",
            "without a skin the row stays where it is; a thousand sweeps do not help",
            "default",
            "starved",
            metric,
            _BARE,
            idle=({"iterations": 1000},),
        )
        for metric in ("displacement", "penetration")
    ),
    *(
        Experiment(
            family,
            "a hundred sweeps leave no motion; without a skin one sweep still does",
            profile,
            "starved",
            metric,
            {"iterations": 100},
            iterations=1,
            idle=(_BARE,),
        )
        for family, profile, metrics in (
            ("starved-skin-and-sweeps", "default", ("kinetic_energy",)),
            ("starved-few-sweeps", "tuned", ("displacement", "penetration", "kinetic_energy", "load_error")),
        )
        for metric in metrics
    ),
    *(
        Experiment(
            "off-centre-skin",
            "without a skin the blow is found within a step; more sweeps or none swept do not help",
            "default",
            "off_centre",
            metric,
            _BARE,
            {"whirl": -2.0},
            idle=({"iterations": 1000}, {"continuous": False}),
            dt=1.0 / 960.0,
        )
        for metric in ("ball_speed", "bar_speed", "spin", "impulse", "energy_lost", "sideways")
    ),
    *(
        Experiment(
            "starved-load-few-sweeps",
            "a hundred sweeps hand all of the press on; without a skin, or with more for positions, eight do not",
            "default",
            "starved",
            "load_error",
            {"iterations": 100},
            {"n": 30.0},
            idle=(_BARE, {"position_iterations": 30}),
            dt=dt,
        )
        for dt in (1.0 / 60.0, 1.0 / 240.0)
    ),
    *(
        Experiment(
            "bounce-gravity-in-rebound",
            "with restitution of the velocity before gravity, no sweeping and a finer unit it passes; without the "
            "first it does not",
            profile,
            "bounce",
            metric,
            {"early_restitution": True, "continuous": False, "units_per_metre": 64.0},
            params,
            idle=({"continuous": False, "units_per_metre": 64.0}, {"iterations": 1000}, {"position_iterations": 30}),
        )
        for profile in ("default", "tuned")
        for metric, params in (("rest_time", {"e": 0.95}), ("apex[5]", {"e": 1.0}))
    ),
)

EXPERIMENTS += (
    Experiment(
        "pyramid-skin",
        "without a skin the row passes; ten times the sweeps, over velocities or positions, do not help",
        "default",
        "pyramid",
        "penetration",
        _BARE,
        {"rows": 5.0},
        idle=({"iterations": 80}, {"position_iterations": 30}),
    ),
    *(
        Experiment(
            "overlap-positions-in-singles",
            "in a unit of 100 m the overlap is within the slop, no place is put right, and the centre stays to the "
            "last bit; sweeps over velocities and sweeping do nothing",
            profile,
            "overlap",
            "centre_moved",
            {"units_per_metre": 0.01},
            params,
            idle=({"iterations": 1000}, {"continuous": False}),
        )
        for profile, params in (
            ("default", dict[str, float]()),
            ("tuned", dict[str, float]()),
            ("tuned", {"depth": 0.01, "ratio": 100.0}),
        )
    ),
)

EXPERIMENTS += ON_RODS
