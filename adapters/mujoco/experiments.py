"""Experiments on MuJoCo."""

from __future__ import annotations

from typing import Any

from adapters.experiment import Cured, Experiment
from adapters.mujoco.experiments_elsewhere import elsewhere
from adapters.mujoco.experiments_on_blows import on_blows
from adapters.mujoco.experiments_on_loads import on_loads
from adapters.mujoco.experiments_on_matched import ON_MATCHED
from adapters.mujoco.experiments_on_rods import on_rods

#: Iterations are left alone: Newton's count is a limit that is not reached.
CANDIDATES: dict[str, tuple[Any, ...]] = {
    "impratio": (1.0, 10.0, 100.0, 1000.0),
    "solreffriction": (None, (0.01, 1.0), (0.02, 1.0), (0.05, 1.0), (0.1, 1.0), (0.2, 1.0)),
    "noslip_iterations": (0, 10),
    "kappa_plastic": (0.01, 0.1, 0.5),
    "cone": ("elliptic", "pyramidal"),
    "integrator": ("Euler", "implicitfast"),
}

#: The stiffness that "reflect" makes solref from: neither of the two means anything without the other.
BELONGS: dict[str, str] = {"kappa_elastic": "solref", "kappa_plastic": "solref"}
#: Its tuned profile sticks where it should, and slides too slowly.
CURED: tuple[Cured, ...] = (
    Cured("default", "tuned", "impact", ({}, {"e": 0.0, "v": 1.0}, {"e": 1.0, "v": 50.0})),
    Cured("default", "tuned", "bounce", ({}, {"e": 0.5}, {"e": 1.0})),
    Cured("default", "tuned", "stack", ({}, {"n": 2.0}, {"n": 20.0})),
    Cured("default", "tuned", "incline", ({}, {"ratio": 0.999}), ("creep",)),
    Cured("default", "tuned", "head_on", ({}, {"e": 1.0, "ratio": 1.0})),
    Cured("default", "tuned", "pinch", ({}, {"margin": 1.05}, {"margin": 100.0})),
)

#: Restitution in the step after contact, as the tuned profile has it for blows.
_REFLECT = {
    "cone": "elliptic", "tolerance": 0.0, "smooth_condim": 1, "solref": "reflect",
    "solimp": (0.9999, 0.9999, 0.001, 0.5, 1.0), "kappa_elastic": 0.0, "kappa_plastic": 0.0,
}  # fmt: skip
#: What holds and carries, as the tuned profile has it for rest.
_HOLD = _REFLECT | {"impratio": 100.0, "kappa_plastic": 0.1, "margin": 1.703125e-07}
_SLIDE = _HOLD | {"solreffriction": (0.05, 1.0)}

EXPERIMENTS: tuple[Experiment, ...] = (
    tuple(
        Experiment(
            "stack-touching-start",
            "with a margin of 1 mm touching faces are in contact from the start, and nothing falls; stiffer contacts "
            "from a touching start fall all the same",
            "default",
            "stack",
            "penetration",
            {"margin": 1e-3},
            {"n": n},
            dimension=dimension,
            idle=({"solimp": (0.9999, 0.9999, 0.001, 0.5, 1.0)},),
        )
        for n in (2.0, 10.0)
        for dimension in (2, 3)
    )
    + tuple(
        Experiment(
            "incline-pyramid-threshold",
            "with an elliptic cone the box slides as soon as it should; solving further or a noslip pass changes "
            "nothing: it is the pyramid, whose edges share their softness between friction and the normal",
            "default",
            "incline",
            "threshold",
            {"cone": "elliptic"},
            dimension=dimension,
            idle=({"tolerance": 0.0}, {"noslip_iterations": 10}),
        )
        for dimension in (2, 3)
    )
    + (
        Experiment(
            "head-on-solver-tolerance",
            "solved to round-off, or without the friction rows of smooth pairs, they cancel",
            "default",
            "head_on",
            "momentum_defect",
            {"tolerance": 0.0},
            {"e": 0.5, "ratio": 1e6},
        ),
        Experiment(
            "rod-gas-solver-tolerance",
            "solved to round-off the rods stay in line; stiffer contacts alone do not keep them there",
            "default",
            "rod_gas",
            "astray",
            {"tolerance": 0.0},
            idle=({"solimp": (0.9999, 0.9999, 0.001, 0.5, 1.0)},),
        ),
        Experiment(
            "off-centre-soft-contact",
            "a contact of one step does not turn the bar under the ball; solving further does nothing",
            "default",
            "off_centre",
            "momentum_defect",
            _REFLECT,
            idle=({"tolerance": 0.0},),
        ),
        Experiment(
            "off-centre-soft-contact",
            "with the velocity reflected a spinning bar is struck within a step; solving further does nothing",
            "default",
            "off_centre",
            "sideways",
            _REFLECT,
            {"whirl": -2.0},
            idle=({"tolerance": 0.0},),
            dt=1.0 / 480.0,
        ),
        *(
            Experiment(
                family,
                "with the velocity reflected in the step after contact it is exact; solving further does nothing",
                "default",
                scene,
                metric,
                _REFLECT,
                params,
                idle=({"tolerance": 0.0},),
            )
            for family, scene, metric, params in (
                ("stacked-balls-soft-contact", "stacked_balls", "small_speed", {}),
                ("stacked-balls-soft-contact", "stacked_balls", "energy_lost", {}),
                ("cradle-soft-contact", "cradle", "speed[4]", {}),
                ("cradle-soft-contact", "cradle", "energy_defect", {"apart": 0.0, "n": 3.0}),
                ("galperin-soft-contact", "galperin", "large_speed", {}),
                *(
                    ("rod-gas-soft-contact", "rod_gas", metric, {})
                    for metric in ("misplaced", "wrong_speed", "energy_defect")
                ),
            )
        ),
        *(
            Experiment(
                "heavy-on-light-soft-contact",
                "with rigid contacts the pair carries; solving further does nothing",
                "default",
                "heavy_on_light",
                metric,
                _HOLD,
                {"ratio": 1e4},
                idle=({"tolerance": 0.0},),
            )
            for metric in ("kinetic_energy", "interface_impulse[1]")
        ),
        *(
            Experiment(
                "pinch-viscous-friction",
                "stiff friction (impratio 100) on an elliptic cone holds; solving further does not",
                "default",
                "pinch",
                metric,
                {"impratio": 100.0, "cone": "elliptic"},
                {"margin": margin},
                idle=({"tolerance": 0.0},),
            )
            for margin, metric in (
                (1.05, "creep"),
                (100.0, "creep"),
                *((1.05, name) for name in ("grip", "carried", "grip[greatest]", "carried[least]", "unbalanced")),
            )
        ),
        *(
            Experiment(
                "slide-pyramid",
                "an elliptic cone does not know the heading; solving the pyramid further does nothing",
                "default",
                "slide",
                metric,
                off,
                {"heading": heading},
                3,
                idle=({"tolerance": 0.0},),
            )
            for metric, heading, off in (
                ("stopping_distance", 22.5, {"cone": "elliptic"}),
                ("stopping_distance", 45.0, {"cone": "elliptic"}),
                ("end_speed", 45.0, {"cone": "elliptic"}),
                ("astray", 22.5, _SLIDE),
                ("turned", 22.5, _SLIDE),
            )
        ),
    )
)

#: Family, what is shown, profile, scene, metric, switched off, parameters.
_Row = tuple[str, str, str, str, str, dict[str, Any], dict[str, float]]
_ASKEW: dict[str, float] = {"back": 4.0, "side": 1.0}
_TURNED: dict[str, float] = {"mu": 0.1, "heading": 30.0}
_CONE = "an elliptic cone does not know the heading; solving the pyramid further does nothing"
_BALLS: tuple[_Row, ...] = (
    ("oblique-pyramid", _CONE, "default", "oblique", "sideways", {"cone": "elliptic"}, _TURNED),
    (
        "oblique-pyramid",
        "with the velocity reflected in the step after contact, and friction too slow to lift, e is exact",
        "default",
        "oblique",
        "rebound_ratio",
        _REFLECT | {"solreffriction": (0.05, 1.0)},
        _TURNED,
    ),
    *(
        ("slide-to-roll-pyramid", _CONE, "default", "slide_to_roll", metric, _SLIDE, {"heading": 30.0})
        for metric in ("rolling_time", "rolling_place", "astray")
    ),
    *(
        (
            "rolling-spin-soft-contact",
            "with rigid contacts that start with the touch the ball does not sink in",
            "default",
            "rolling_spin",
            "hop",
            _HOLD,
            params,
        )
        for params in (dict[str, float](), {"v": 0.0, "spin": 50.0})
    ),
    ("masse-pyramid", _CONE, "default", "masse", "end_x", {"cone": "elliptic"}, {}),
    ("masse-pyramid", _CONE, "default", "masse", "end_y", {"cone": "elliptic"}, {}),
    ("masse-pyramid", _CONE, "default", "masse", "end_y", {"cone": "elliptic"}, _ASKEW),
    ("masse-pyramid", _CONE, "default", "masse", "turned", {"cone": "elliptic"}, _ASKEW),
    *(
        (
            "masse-slip-lifts",
            "friction damped so slowly that it stops no slip in a step lifts nothing",
            "tuned",
            "masse",
            "hop",
            {"solreffriction": (1.0, 1.0)},
            params,
        )
        for params in (dict[str, float](), _ASKEW)
    ),
)
EXPERIMENTS += tuple(
    Experiment(family, says, profile, scene, metric, off, params, 3, idle=({"tolerance": 0.0},))
    for family, says, profile, scene, metric, off, params in _BALLS
)

EXPERIMENTS += tuple(
    Experiment(
        family,
        "with the velocity reflected in the step after contact, and friction too slow to lift, e is exact",
        profile,
        "pair_matrix",
        "restitution[1]",
        off,
        dimension=dimension,
        idle=({"tolerance": 0.0},) if profile == "default" else ({"impratio": 100.0},),
    )
    for family, profile, off in (
        ("pair-matrix-soft-contact", "default", _REFLECT | {"solreffriction": (0.05, 1.0)}),
        ("pair-matrix-slip-lifts", "tuned", {"solreffriction": (0.05, 1.0)}),
    )
    for dimension in (2, 3)
)

EXPERIMENTS += tuple(
    Experiment(
        "rocker-soft-contact",
        "with the stiffest impedance the board swings on; an elliptic cone alone, or solving further, does not do it",
        "default",
        "rocker",
        "amplitude",
        off,
        params,
        idle=({"cone": "elliptic"}, {"tolerance": 0.0}),
    )
    for params, off in ((dict[str, float](), {"solimp": (0.9999, 0.9999, 0.001, 0.5, 1.0)}), ({"tilt": 5.0}, _HOLD))
)

EXPERIMENTS += tuple(
    Experiment(
        "hilltop-soft-friction",
        "with stiffer friction, or damped as the normal, the disc rolls; the share of softness alone changes nothing",
        "tuned",
        "hilltop",
        metric,
        off,
        idle=({"impratio": 1.0}, {"margin": 0.0}),
    )
    for metric in ("level_speed", "leaving_angle")
    for off in ({"solreffriction": (0.01, 1.0)}, {"solreffriction": None})
)

EXPERIMENTS += tuple(
    Experiment(
        "hilltop-soft-contact",
        "with stiffer contacts the disc leaves where it should; solving further does nothing",
        "default",
        "hilltop",
        metric,
        off,
        {"mu": 0.1},
        idle=({"tolerance": 0.0},),
    )
    for metric in ("level_speed", "leaving_angle")
    for off in ({"solref": (0.01, 1.0)}, {"solimp": (0.9999, 0.9999, 0.001, 0.5, 1.0)})
)

EXPERIMENTS += tuple(
    Experiment(
        "thin-wall-soft-contact",
        "with the velocity reflected in the step after contact the rebound is exact; solving further does nothing",
        "default",
        "thin_wall",
        metric,
        _REFLECT,
        idle=({"tolerance": 0.0},),
    )
    for metric in ("rebound_ratio", "beyond")
)

EXPERIMENTS += tuple(
    Experiment(
        "overhang-soft-contact",
        "with rigid contacts that start with the touch nothing sinks; solving further does nothing",
        "default",
        "overhang",
        "penetration",
        _HOLD,
        params,
        idle=({"tolerance": 0.0},),
    )
    for params in (dict[str, float](), {"margin": 0.02})
)

EXPERIMENTS += on_loads(_HOLD)

EXPERIMENTS += on_blows(_REFLECT)

EXPERIMENTS += on_rods(_REFLECT, _HOLD)

EXPERIMENTS += elsewhere(_REFLECT, _HOLD, _SLIDE)

EXPERIMENTS += ON_MATCHED
