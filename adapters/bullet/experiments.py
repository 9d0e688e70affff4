"""Experiments on Bullet."""

from __future__ import annotations

from typing import Any

from adapters.bullet.experiments_elsewhere import ELSEWHERE
from adapters.bullet.experiments_on_blows import on_blows
from adapters.bullet.experiments_on_loads import ON_LOADS
from adapters.bullet.experiments_on_rods import ON_RODS
from adapters.bullet.experiments_out_of_plane import OUT_OF_PLANE
from adapters.experiment import Cured, Experiment

#: Iterations are left alone: they cost time, and any count is better than a lower one.
CANDIDATES: dict[str, tuple[Any, ...]] = {
    "contactBreakingThreshold": (0.001, 0.005, 0.02, 0.1),
    "contactERP": (0.0, 0.01, 0.08, 0.2),
    "contactSlop": (0.0, 1e-6, 1e-5, 1e-4),
    "warmStartingFactor": (0.1, 0.5, 0.85, 0.95),
    "restitutionVelocityThreshold": (0.0, 1e-4),
    "solverResidualThreshold": (0.0, 1e-7),
}

#: 20 boxes are more than its tuned profile holds.
CURED: tuple[Cured, ...] = (
    Cured("default", "tuned", "impact", ({}, {"e": 0.5, "v": 1.0}, {"e": 1.0, "v": 50.0})),
    Cured("default", "tuned", "bounce", ({}, {"e": 0.5}, {"e": 1.0})),
    Cured("default", "tuned", "stack", ({}, {"n": 10.0})),
    Cured("default", "tuned", "incline", ({}, {"ratio": 0.999}, {"ratio": 1.1}, {"ratio": 2.0})),
)

_NO_DRAG = {"linearDamping": 0.0, "angularDamping": 0.0}

#: A blow without anything that its law does not have.
_BARE = _NO_DRAG | {
    "contactProcessingThreshold": 0.0, "contactERP": 0.0, "contactSlop": 0.0, "restitutionVelocityThreshold": 1e-4,
    "solverResidualThreshold": 0.0,
}  # fmt: skip

#: So on the path of rigid bodies, with a slop that keeps what rests from hopping.
_RIGID = _BARE | {"useMaximalCoordinates": 1, "contactSlop": 1e-6}

EXPERIMENTS: tuple[Experiment, ...] = (
    *(
        Experiment(
            "incline-residual-creep",
            "solved to the end (no residual stop, 1000 sweeps) the box sticks; sweeps alone change nothing, for the "
            "residual stops them",
            "default",
            "incline",
            "creep",
            {"solverResidualThreshold": 0.0, "iterations": 1000},
            {"ratio": ratio} if ratio != 0.9 else {},
            dimension=dimension,
            idle=({"iterations": 1000},),
        )
        for ratio in (0.9, 0.99, 0.999)
        for dimension in (2, 3)
    ),
    *(
        Experiment(
            "incline-residual-creep",
            "near the cone's edge the residual is not all of it: without its stop fifty sweeps are still too few",
            "default",
            "incline",
            "creep",
            {"solverResidualThreshold": 0.0, "iterations": 1000},
            {"ratio": ratio},
            dimension=3,
            idle=({"solverResidualThreshold": 0.0},),
        )
        for ratio in (0.99, 0.999)
    ),
    *(
        Experiment(
            family,
            "solved to the end (no residual stop, 1000 sweeps) the column stands",
            profile,
            "stack",
            metric,
            {"solverResidualThreshold": 0.0, "iterations": 1000},
            {"n": 10.0},
            dimension=3,
            iterations=iterations,
        )
        for family, profile, metric, iterations in (
            ("stack-sweeps-default", "default", "drift", None),
            ("stack-sweeps-default", "default", "penetration", None),
            ("stack-sweeps-default", "default", "settle_time", 10),
            ("stack-sweeps-default", "default", "kinetic_energy", 10),
            ("stack-sweeps-default", "default", "impulse_scatter", 10),
            ("stack-sweeps-default", "default", "interface_impulse[5]", 1),
            ("stack-sweeps-default", "default", "load[least]", 1),
            ("stack-sweeps-default", "default", "unbalanced", 1),
            ("stack-sweeps", "one", "drift", None),
            ("stack-sweeps", "one", "penetration", None),
            ("stack-sweeps", "tuned", "drift", 10),
            ("stack-sweeps", "tuned", "penetration", 10),
            ("stack-sweeps", "tuned", "settle_time", 4),
            ("stack-sweeps", "tuned", "kinetic_energy", 4),
            ("stack-sweeps", "tuned", "impulse_scatter", 1),
            ("stack-sweeps", "tuned", "interface_impulse[5]", 1),
            ("stack-sweeps", "tuned", "load[least]", 1),
            ("stack-sweeps", "one", "load[greatest]", 1),
            ("stack-sweeps", "one", "unbalanced", 1),
        )
    ),
    *(
        Experiment(
            "incline-contact-switching",
            "without drag and with a wider margin the box slides right; without drag alone it does not, nor with the "
            "wider margin alone, which leaves the drag's law",
            "default",
            "incline",
            "acceleration",
            _NO_DRAG | {"contactBreakingThreshold": margin},
            {"ratio": 2.0},
            dimension=dimension,
            idle=(_NO_DRAG, {"contactBreakingThreshold": margin}, {**_NO_DRAG, "solverResidualThreshold": 0.0}),
        )
        for margin in (0.1, 0.001)
        for dimension in (2, 3)
    ),
    Experiment(
        "bounce-interval-blurred",
        "without speculative contacts the intervals of the apexes are right; drag does not matter to them",
        "default",
        "bounce",
        "apex_interval_ratio",
        {"contactProcessingThreshold": 0.0},
        dimension=3,
        idle=(_NO_DRAG,),
    ),
    *(
        Experiment(
            "bounce-force-ahead",
            "without speculative contacts nothing pushes in flight; without drag, or solved to the end, it does",
            "default",
            "bounce",
            "force_in_flight",
            {"contactProcessingThreshold": 0.0},
            params,
            dimension=dimension,
            idle=(_NO_DRAG, {"solverResidualThreshold": 0.0, "iterations": 1000}),
        )
        for params, dimension in (({"height": 1.03}, 2), ({"e": 1.0}, 3))
    ),
    *(
        Experiment(
            "wipe-sweeps",
            "with 1000 sweeps friction and the stop's force are right in the mean; without push-out they are not",
            profile,
            "wipe",
            metric,
            {"iterations": 1000},
            idle=({"contactERP": 0.0},),
        )
        for profile in ("tuned", "one")
        for metric in ("friction[mean]", "stop[mean]")
    ),
    *(
        Experiment(
            "bounce-interval-blurred",
            "on the path without gravity's restitution, bare of what its law does not have, the ball rests when it "
            "should; with speculative contacts alone it does not",
            "default",
            "bounce",
            "rest_time",
            _RIGID,
            {"height": 1.09},
            dimension=dimension,
            idle=({name: value for name, value in _RIGID.items() if name != "contactProcessingThreshold"},),
            dt=1.0 / 120.0,
        )
        for dimension in (2, 3)
    ),
    *(
        Experiment(
            f"{scene.replace('_', '-')}-shipped-contact",
            "without speculation, push-out, slop, drag and thresholds the blow is exact; without drag alone it is not",
            "default",
            scene,
            metric,
            _BARE,
            idle=(_NO_DRAG,),
        )
        for scene, metric in (
            ("head_on", "rebound_ratio"),
            ("off_centre", "spin"),
            ("flat_box", "rebound_ratio"),
            ("stacked_balls", "small_speed"),
            ("cradle", "speed[4]"),
            ("galperin", "large_speed"),
            *(("rod_gas", metric) for metric in ("misplaced", "wrong_speed", "energy_defect")),
        )
    ),
    *(
        Experiment(
            f"{scene.replace('_', '-')}-push-out",
            "without push-out (and slop) the blow is exact",
            "one",
            scene,
            metric,
            {"contactERP": 0.0, "contactSlop": 0.0},
            idle=({"iterations": 1000},),
        )
        for scene, metric in (
            ("head_on", "rebound_ratio"),
            ("off_centre", "spin"),
            ("flat_box", "rebound_ratio"),
            ("stacked_balls", "small_speed"),
            ("cradle", "speed[4]"),
            ("galperin", "large_speed"),
            *(("rod_gas", metric) for metric in ("wrong_speed", "energy_defect")),
        )
    ),
    *(
        Experiment(
            f"{scene.replace('_', '-')}-within-slop",
            "without slop it is exact; more sweeps change nothing",
            "tuned",
            scene,
            metric,
            {"contactSlop": 0.0},
            params,
            idle=({"iterations": 1000},),
        )
        for scene, params, metric in (
            ("stacked_balls", {"e": 0.5, "ratio": 1.0}, "small_speed"),
            ("cradle", {}, "energy_defect"),
        )
    ),
    *(
        Experiment(
            "heavy-on-light-sweeps",
            "solved to the end (no residual stop, 10000 sweeps) the pair stands",
            profile,
            "heavy_on_light",
            metric,
            {"solverResidualThreshold": 0.0, "iterations": 10000},
        )
        for profile, metric in (
            ("default", "drift"),
            ("default", "penetration"),
            ("tuned", "settle_time"),
            ("tuned", "kinetic_energy"),
            ("tuned", "impulse_scatter"),
            ("tuned", "interface_impulse[1]"),
            ("one", "drift"),
            ("one", "penetration"),
        )
    ),
    *(
        Experiment(
            "pinch-sweeps",
            "solved to the end (no residual stop, 1000 sweeps) the grip holds",
            profile,
            "pinch",
            metric,
            {"solverResidualThreshold": 0.0, "iterations": 1000},
            {"margin": margin},
            idle=({"solverResidualThreshold": 0.0},),
        )
        for profile, margin, metric in (
            ("default", 1.05, "creep"),
            ("default", 100.0, "turned"),
            ("default", 100.0, "grip"),
            ("default", 100.0, "carried"),
            ("tuned", 100.0, "creep"),
            ("tuned", 100.0, "grip"),
            *((p, 100.0, "unbalanced") for p in ("default", "tuned", "one")),
            ("default", 100.0, "carried[greatest]"),
            ("tuned", 100.0, "carried[least]"),
            ("one", 100.0, "grip[least]"),
        )
    ),
    *(
        Experiment(
            "slide-drag-and-switching",
            "without drag and with a wider margin the box stops where it should, level; without drag alone it tips",
            "default",
            "slide",
            metric,
            _NO_DRAG | {"contactBreakingThreshold": 0.1},
            idle=idle,
        )
        for metric, idle in (
            ("stopping_distance", ({"contactBreakingThreshold": 0.1},)),
            ("braking", ({"contactBreakingThreshold": 0.1},)),
            ("hop", (_NO_DRAG,)),
            ("turned", (_NO_DRAG,)),
        )
    ),
    *(
        Experiment(
            "slide-drag-and-switching",
            "with a wider margin the floor pushes steadily; without drag alone it does not",
            "default",
            "slide",
            metric,
            {"contactBreakingThreshold": 0.1},
            idle=(_NO_DRAG,),
            dt=1.0 / 60.0,
        )
        for metric in ("normal[least]", "normal[greatest]", "friction[mean]")
    ),
)

EXPERIMENTS += (
    *(
        Experiment(
            f"{scene.replace('_', '-')}-drag",
            "without drag the ball slides, rolls and spins as it should; solving further does nothing",
            "default",
            scene,
            metric,
            _NO_DRAG,
            params,
            dimension,
            idle=({"solverResidualThreshold": 0.0, "iterations": 1000},),
        )
        for scene, metric, params, dimension in (
            ("slide_to_roll", "final_speed", {}, 2),
            ("slide_to_roll", "rolling_time", {"mu": 0.1}, 3),
            ("slide_to_roll", "rolling_place", {}, 2),
            ("roll_incline", "acceleration", {"ratio": 0.99}, 2),
            ("roll_incline", "turning", {"ratio": 1.5}, 3),
            ("rolling_spin", "spin", {}, 3),
            ("rolling_spin", "speed", {}, 3),
            ("masse", "final_vy", {}, 3),
            ("masse", "turned", {}, 3),
            ("masse", "end_y", {}, 3),
        )
    ),
    *(
        Experiment(
            family,
            "without speculation, push-out, slop, drag and thresholds the bounce is exact",
            profile,
            "oblique",
            metric,
            off,
            {"mu": 0.1},
            idle=idle,
        )
        for family, profile, off, idle, metrics in (
            (
                "oblique-shipped-contact",
                "default",
                _BARE,
                (_NO_DRAG,),
                ("rebound_ratio", "forward_speed", "spin_speed"),
            ),
            (
                "oblique-push-out",
                "one",
                {"contactERP": 0.0, "contactSlop": 0.0},
                ({"iterations": 1000},),
                ("rebound_ratio", "forward_speed"),
            ),
        )
        for metric in metrics
    ),
)

EXPERIMENTS += (
    Experiment(
        "pivot-residual",
        "without the residual at which it stops the box does not twist; more sweeps alone change nothing",
        "default",
        "pivot",
        "twisted",
        {"solverResidualThreshold": 0.0},
        dimension=3,
        idle=({"iterations": 1000},),
    ),
    *(
        Experiment(
            "rocking-block-drag",
            "without drag the block rocks as high as it should; solving further does nothing",
            "default",
            "rocking_block",
            metric,
            _NO_DRAG,
            params,
            idle=({"solverResidualThreshold": 0.0}, {"contactERP": 0.0}, {"contactProcessingThreshold": 0.0}),
        )
        for metric, params in (("amplitude[1]", {"aspect": 0.5, "tilt": 0.7}), ("amplitude[3]", {}))
    ),
    *(
        Experiment(
            "tumble-drag", "without drag the box tumbles as it should", "default", "tumble", metric, _NO_DRAG, {}, 3
        )
        for metric in ("flip_time", "momentum_drift", "energy_drift")
    ),
    *(
        Experiment(
            family,
            "without speculation, push-out, slop, drag and thresholds each pair has its own e and mu",
            profile,
            "pair_matrix",
            metric,
            off,
            idle=idle,
        )
        for family, profile, off, idle, metrics in (
            ("pair-matrix-shipped-contact", "default", _BARE, (_NO_DRAG,), ("restitution[1]",)),
            ("pair-matrix-shipped-contact", "default", _BARE, (), ("friction[1]", "friction[3]")),
            (
                "pair-matrix-push-out",
                "one",
                {"contactERP": 0.0, "contactSlop": 0.0},
                ({"iterations": 1000},),
                ("restitution[1]", "restitution[4]"),
            ),
        )
        for metric in metrics
    ),
    *(
        Experiment(
            "rocker-drag",
            "without drag the board swings on; solving further does nothing",
            "default",
            "rocker",
            "amplitude",
            _NO_DRAG,
            params,
            idle=({"solverResidualThreshold": 0.0, "iterations": 1000},),
        )
        for params in (dict[str, float](), {"tilt": 5.0})
    ),
    *(
        Experiment(
            "hilltop-drag",
            "without drag the disc leaves where it should; solving further does nothing",
            "default",
            "hilltop",
            metric,
            _NO_DRAG,
            idle=({"solverResidualThreshold": 0.0, "iterations": 1000},),
        )
        for metric in ("level_speed", "leaving_angle", "leaving_time")
    ),
    Experiment(
        "thin-wall-shipped-contact",
        "without speculation, push-out, slop, drag and thresholds the rebound is exact; without drag alone it is not",
        "default",
        "thin_wall",
        "rebound_ratio",
        _BARE,
        idle=(_NO_DRAG,),
    ),
    Experiment(
        "thin-wall-push-out",
        "without push-out (and slop) the rebound is exact",
        "one",
        "thin_wall",
        "rebound_ratio",
        {"contactERP": 0.0, "contactSlop": 0.0},
        idle=({"iterations": 1000},),
    ),
)

EXPERIMENTS += tuple(
    Experiment(
        "overhang-sweeps",
        "solved to the end (no residual stop, 1000 sweeps) the stack stands",
        profile,
        "overhang",
        metric,
        {"solverResidualThreshold": 0.0, "iterations": 1000},
        params,
    )
    for profile, metric, params in (
        ("default", "settle_time", dict[str, float]()),
        ("default", "drift", {"margin": 0.02}),
        ("default", "kinetic_energy", dict[str, float]()),
        ("one", "penetration", dict[str, float]()),
        ("one", "drift", {"margin": 0.02}),
    )
)

EXPERIMENTS += ON_LOADS

EXPERIMENTS += on_blows(_BARE)

EXPERIMENTS += ON_RODS

EXPERIMENTS += ELSEWHERE

EXPERIMENTS += OUT_OF_PLANE
