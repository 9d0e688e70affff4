"""Experiments on PhysX."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from adapters.experiment import Experiment
from adapters.physx.experiments_out_of_plane import OUT_OF_PLANE

CANDIDATES: dict[str, tuple[Any, ...]] = {
    "solver": ("tgs", "pgs"),
    "iterations": (4, 50, 255),
    "velocity_iterations": (0, 1, 200),
    "bounce_threshold": (1e-4, 0.1, 2.0),
    "contact_offset": (1e-4, 0.01, 0.1),
    "tolerance_length": (0.1, 10.0),
    "push_out": (1e-3, 1.0, 1e32),
    "angular_damping": (0.0, 0.05),
    "persistent_manifolds": (False, True),
    "friction_every_iteration": (False, True),
}

_Settings = Mapping[str, Any]
#: Spins are kept.
_KEPT: _Settings = {"angular_damping": 0.0}
#: Whatever approaches rebounds.
_REBOUNDS: _Settings = {"bounce_threshold": 1e-4}
#: Friction across every gap that a step closes.
_RUBS: _Settings = {"tolerance_length": 100.0}
#: Contacts are made when bodies touch.
_UNSEEN: _Settings = {"contact_offset": 1e-4}
#: One step instead of small ones, and small ones instead of one.
_WHOLE: _Settings = {"solver": "pgs"}
_SMALL: _Settings = {"solver": "tgs"}
#: As many sweeps as the engine can count, and so many over velocities alone.
_SWEPT: _Settings = {"iterations": 255}
_AFTER: _Settings = {"velocity_iterations": 200}
#: Overlaps are left where they are.
_LEFT: _Settings = {"push_out": 1e-3}
#: Points of contact are found anew in every step.
_ANEW: _Settings = {"persistent_manifolds": False}

#: What singles make of speeds of some metres per second: 48 roundings of 2^-24, and of spins times a lever.
_SINGLES, _SPINS = 1e-6, 1e-5

_SCENES = (
    "bounce", "closing_wall", "cradle", "edge_drop", "flat_box", "galperin", "heavy_on_light", "impact", "incline",
    "kane", "masse", "oblique", "off_centre", "overhang", "overlap", "painleve", "pivot", "position_correction",
    "pressed_box", "pyramid", "rack", "rocker", "rocking_block", "rod_gas", "roll_incline", "rolling_spin", "seam",
    "shove", "slide", "slide_to_roll", "stack", "stacked_balls", "starved", "thin_wall", "tilt_table", "tumble",
)  # fmt: skip


def _each(
    family: str, says: str, off: _Settings, idle: tuple[_Settings, ...], *rows: tuple[str, int, str, dict[str, float]],
    within: float = 0.0, iterations: int | None = None, dt: float | None = None,
) -> tuple[Experiment, ...]:  # fmt: skip
    """Experiments that differ in their rows only: profile, dimension, metric, parameters."""
    scene = max((name for name in _SCENES if family.startswith(name.replace("_", "-"))), key=len)
    return tuple(
        Experiment(family, says, profile, scene, metric, off, params, dimension, iterations, idle, within, dt)
        for profile, dimension, metric, params in rows
    )


#: What stands still, slides or rolls where spins are damped, and the rows that show it.
_DAMPED: dict[str, tuple[tuple[str, int, str, dict[str, float]], ...]] = {
    "masse-spins-damped": (
        ("default", 3, "final_vx", {}),
        ("pgs", 3, "final_vy", {"back": 4.0, "side": 1.0}),
    ),
    "masse-spins-damped-on-the-way": (("default", 3, "end_y", {}), ("default", 3, "turned", {})),
    "rocker-spins-damped": (("default", 2, "amplitude", {}), ("pgs", 3, "amplitude", {"tilt": 5.0})),
    "rocking-block-spins-damped": (("pgs", 2, "amplitude[1]", {}),),
    "roll-incline-spins-damped": (
        ("default", 2, "acceleration", {}),
        ("default", 2, "turning", {"ratio": 0.99}),
        ("pgs", 2, "turning", {}),
    ),
    "rolling-spin-spins-damped": (("default", 3, "speed", {}), ("pgs", 3, "speed", {})),
    "slide-to-roll-spins-damped": (
        ("default", 2, "final_speed", {"mu": 0.1}),
        ("default", 2, "rolling_time", {"mu": 0.1}),
        ("pgs", 2, "rolling_place", {"mu": 0.1}),
    ),
    "tumble-spins-damped": (
        ("default", 3, "energy_drift", {}),
        ("default", 3, "flip_time", {}),
        ("pgs", 3, "momentum_drift", {}),
    ),
}

EXPERIMENTS: tuple[Experiment, ...] = tuple(
    experiment
    for family, rows in _DAMPED.items()
    for experiment in _each(
        family, "where spins are kept the row passes; more sweeps do not help", _KEPT, (_ANEW,), *rows
    )
)

EXPERIMENTS += (
    *_each(
        "rolling-spin-spins-damped",
        "where spins are kept nine tenths of what is lost are there; other manifolds do not help",
        _KEPT,
        (_ANEW,),
        ("default", 3, "spin", {}),
        ("pgs", 3, "spin", {}),
        within=0.11,
    ),
    *_each(
        "off-centre-spins-damped",
        "where spins are kept, and the blow is in one step, it comes within singles; one step alone does not help",
        {**_KEPT, **_WHOLE},
        (_REBOUNDS, _RUBS, _SWEPT),
        ("default", 3, "spin", {}),
        ("default", 2, "energy_lost", {"e": 1.0, "offset": 0.3}),
        ("pgs", 3, "spin", {}),
        within=_SPINS,
    ),
    *_each(
        "off-centre-spins-damped",
        "where spins are kept the spinning bar passes; one step does not help",
        _KEPT,
        (_WHOLE,),
        *(("default", 2, metric, {"whirl": -2.0}) for metric in ("spin", "energy_lost", "angular_defect")),
        ("pgs", 3, "angular_defect", {"whirl": -2.0}),
    ),
    *_each(
        "off-centre-gap-in-rebound",
        "seen when they touch, and spins kept, it passes; kept spins or more sweeps alone do not help",
        {**_UNSEEN, **_KEPT},
        (_KEPT, _SWEPT),
        *(("pgs", 2, metric, {"whirl": -2.0}) for metric in ("ball_speed", "bar_speed", "impulse")),
        dt=1.0 / 480.0,
    ),
    # ---- slow approaches do not rebound
    *_each(
        "bounce-no-slow-rebound",
        "where whatever approaches rebounds it passes; more sweeps and other manifolds do not help",
        _REBOUNDS,
        (_SWEPT, _ANEW),
        ("default", 2, "apex[5]", {}),
        ("default", 2, "rest_time", {}),
    ),
    *_each(
        "bounce-slow-or-seen-ahead",
        "where whatever approaches rebounds, in small steps, it passes; either alone does not help",
        {**_REBOUNDS, **_SMALL},
        (_REBOUNDS, _SMALL),
        ("pgs", 2, "rest_time", {}),
    ),
    *_each(
        "closing-wall-no-slow-rebound",
        "where whatever approaches rebounds it comes near, but for places in singles; small steps alone do not help",
        {**_REBOUNDS, **_SMALL},
        (_SWEPT, _SMALL),
        ("default", 2, "speed[1]", {}),
        ("pgs", 2, "speed[1]", {}),
        within=1e-4,
    ),
    *_each(
        "cradle-no-slow-rebound",
        "where whatever approaches rebounds it passes; in one step instead of small ones it does not",
        _REBOUNDS,
        (_WHOLE, _UNSEEN),
        ("default", 2, "speed[4]", {}),
        ("default", 2, "energy_defect", {}),
    ),
    *_each(
        "cradle-no-slow-rebound",
        "where whatever approaches rebounds, and is not seen ahead, it passes; either alone does not help",
        {**_REBOUNDS, **_UNSEEN},
        (_REBOUNDS, _UNSEEN),
        ("pgs", 2, "energy_defect", {}),
    ),
    *_each(
        "edge-drop-no-slow-rebound",
        "where whatever approaches rebounds, in one step, and spins are kept, it comes within singles; all but the "
        "first do not help",
        {**_REBOUNDS, **_KEPT, **_WHOLE},
        ({**_KEPT, **_WHOLE}, _SWEPT),
        ("default", 3, "impulse", {}),
        ("default", 3, "rise", {"e": 1.0, "tilt": 30.0}),
        ("pgs", 3, "spin", {}),
        within=_SPINS,
    ),
    *_each(
        "galperin-no-slow-rebound",
        "where whatever approaches rebounds it comes near; more sweeps do not help",
        _REBOUNDS,
        (_SWEPT, _WHOLE),
        ("default", 2, "large_speed", {}),
        ("default", 2, "energy_defect", {}),
        within=1e-5,
    ),
    *_each(
        "galperin-no-slow-rebound",
        "where whatever approaches rebounds, not seen ahead, it comes within singles; either alone does not help",
        {**_REBOUNDS, **_UNSEEN},
        (_REBOUNDS, _UNSEEN),
        ("pgs", 2, "large_speed", {}),
        ("pgs", 2, "small_speed", {"gap": 2.0, "ratio": 100.0}),
        within=_SINGLES,
    ),
    *_each(
        "kane-no-slow-rebound",
        "where whatever approaches rebounds, in one step, with friction across every gap, it comes near; friction and "
        "one step alone do not help",
        {**_REBOUNDS, **_RUBS, **_KEPT, **_WHOLE},
        ({**_RUBS, **_KEPT, **_WHOLE}, _SWEPT),
        ("default", 2, "rise", {"e": 0.5, "mu": 0.1}),
        ("default", 2, "ahead", {}),
        ("pgs", 2, "spin", {"e": 0.5, "mu": 0.1}),
        within=3e-3,
    ),
    *_each(
        "rack-no-slow-rebound",
        "where whatever approaches rebounds, not seen ahead and in one step, it comes within singles; the last two "
        "alone do not help",
        {**_REBOUNDS, **_UNSEEN, **_WHOLE},
        ({**_UNSEEN, **_WHOLE}, _SWEPT),
        ("default", 2, "energy_defect", {}),
        ("pgs", 2, "energy_defect", {}),
        within=_SINGLES,
    ),
    *_each(
        "rod-gas-no-slow-rebound",
        "where whatever approaches rebounds it comes near; more sweeps, one step and late contacts do not help",
        _REBOUNDS,
        (_SWEPT, _WHOLE, _UNSEEN),
        ("default", 2, "misplaced", {}),
        ("default", 2, "wrong_speed", {}),
        ("default", 2, "energy_defect", {}),
        within=1e-5,
    ),
    *_each(
        "rod-gas-no-slow-rebound",
        "where whatever approaches rebounds rods are where they should be; more sweeps and late contacts do not help",
        _REBOUNDS,
        (_SWEPT, _UNSEEN),
        ("pgs", 2, "misplaced", {}),
    ),
    *_each(
        "rod-gas-no-slow-rebound",
        "where whatever approaches rebounds, not seen ahead, it comes within singles; either alone does not help",
        {**_REBOUNDS, **_UNSEEN},
        (_REBOUNDS, _UNSEEN),
        ("pgs", 2, "wrong_speed", {}),
        ("pgs", 2, "energy_defect", {}),
        within=_SINGLES,
    ),
    *_each(
        "stacked-balls-no-slow-rebound",
        "where whatever approaches rebounds it comes within singles; in one step it does not",
        _REBOUNDS,
        (_WHOLE, _SWEPT),
        ("default", 2, "small_speed", {"e": 1.0, "ratio": 1000.0}),
        ("default", 2, "energy_lost", {"e": 1.0, "ratio": 1000.0}),
        within=_SINGLES,
    ),
    *_each(
        "stacked-balls-no-slow-rebound",
        "where whatever approaches rebounds, and is not seen ahead, it passes; either alone does not help",
        {**_REBOUNDS, **_UNSEEN},
        (_REBOUNDS, _UNSEEN),
        ("pgs", 2, "large_speed", {"e": 0.5, "ratio": 1.0}),
    ),
    # ---- friction, and what is seen ahead
    *_each(
        "oblique-friction-within-4-mm",
        "with friction across every gap it passes; more sweeps and rebounds do not help",
        {**_RUBS, **_KEPT},
        (_KEPT, _SWEPT, _REBOUNDS),
        ("default", 2, "forward_speed", {}),
        ("default", 2, "spin_speed", {}),
        ("pgs", 3, "forward_speed", {}),
        ("pgs", 3, "spin_speed", {}),
    ),
    *_each(
        "masse-pyramid-along-the-way",
        "in small steps, whose friction is a cone, it passes; where spins are kept alone it does not",
        {**_SMALL, **_KEPT},
        (_KEPT, _SWEPT, {"friction_every_iteration": False}),
        ("pgs", 3, "end_x", {}),
        ("pgs", 3, "end_y", {"back": 4.0, "side": 1.0}),
        ("pgs", 3, "turned", {}),
    ),
    *_each(
        "bounce-seen-ahead",
        "where contacts are made when bodies touch it passes; rebounds of what is slow do not help",
        _UNSEEN,
        (_REBOUNDS, _SWEPT),
        ("pgs", 2, "apex[1]", {"height": 1.04}),
        ("pgs", 2, "apex_interval_ratio", {"e": 0.95}),
    ),
    *_each(
        "bounce-seen-ahead",
        "in small steps it comes within a rounding of its bound",
        _SMALL,
        (_REBOUNDS, _SWEPT),
        ("pgs", 2, "apex_growth", {"e": 1.0}),
        within=2.2e-5,
    ),
    *_each(
        "bounce-bound-met-in-singles",
        "with other roundings, as contacts are seen farther ahead, it passes; rebounds of what is slow do not help",
        {"contact_offset": 0.1},
        (_REBOUNDS, _KEPT),
        ("default", 2, "apex_growth", {"e": 1.0}),
    ),
    *_each(
        "seam-seen-ahead",
        "where contacts are made when bodies touch the box slides over the seam; more sweeps do not help",
        _UNSEEN,
        (_SWEPT, _RUBS),
        ("default", 2, "stopping_distance", {}),
        ("default", 3, "hop", {}),
        ("pgs", 2, "braking", {}),
        ("tuned", 2, "turned", {}),
    ),
    # ---- small steps
    *_each(
        "impact-blow-in-an-overlap",
        "in one step it passes; other manifolds and rebounds of what is slow do not help",
        _WHOLE,
        (_ANEW, _REBOUNDS),
        ("default", 2, "rebound_ratio", {"e": 1.0, "v": 50.0}),
        ("default", 2, "impulse", {"e": 0.5, "v": 50.0}),
        ("tuned", 3, "velocity_change", {"e": 1.0, "v": 50.0}),
    ),
    *_each(
        "thin-wall-blow-in-an-overlap",
        "in one step it passes; other manifolds and rebounds of what is slow do not help",
        _WHOLE,
        (_ANEW, _REBOUNDS),
        ("default", 2, "rebound_ratio", {}),
        ("tuned", 2, "rebound_ratio", {}),
    ),
    *_each(
        "bounce-thrown-back-ahead",
        "in one step nothing pushes in flight; other manifolds and rebounds of what is slow do not help",
        _WHOLE,
        (_ANEW, _REBOUNDS),
        ("default", 2, "force_in_flight", {"height": 1.04}),
        ("default", 3, "force_in_flight", {"e": 0.95}),
        ("tuned", 2, "force_in_flight", {"height": 1.04}),
    ),
    *_each(
        "bounce-thrown-back-ahead",
        "with as many small steps as there are nothing pushes in flight; with a single one, or seen earlier, it does",
        _SWEPT,
        ({"iterations": 1}, {"contact_offset": 0.1}),
        ("default", 2, "force_in_flight", {"height": 1.11}),
    ),
    *_each(
        "cradle-small-steps",
        "in one step it comes within singles; other manifolds do not help",
        _WHOLE,
        (_ANEW,),
        ("tuned", 2, "energy_defect", {"apart": 0.0, "n": 3.0}),
        within=_SINGLES,
    ),
    *_each(
        "edge-drop-small-steps",
        "in one step it comes within singles; other manifolds do not help",
        _WHOLE,
        (_ANEW,),
        ("tuned", 3, "spin", {}),
        within=_SPINS,
    ),
    *_each(
        "edge-drop-ends-in-singles",
        "with points that are found anew in each step, what is left is a quarter of 2^-24 and less",
        _ANEW,
        (_SWEPT,),
        ("pgs", 3, "twisted", {}),
        within=1e-7,
    ),
    *_each(
        "flat-box-small-steps",
        "in one step it comes within singles; other manifolds and rebounds of what is slow do not help",
        _WHOLE,
        (_ANEW, _REBOUNDS),
        ("default", 2, "edge_speed", {"aspect": 4.0, "e": 0.8}),
        ("default", 3, "rebound_ratio", {"e": 1.0}),
        ("tuned", 2, "sideways", {"aspect": 4.0, "e": 0.8}),
        ("tuned", 3, "edge_speed", {}),
        within=_SINGLES,
    ),
    *_each(
        "galperin-small-steps",
        "in five times as many small steps it comes within singles; other manifolds do not help",
        _SWEPT,
        (_ANEW,),
        ("tuned", 2, "energy_defect", {"gap": 2.0, "ratio": 100.0}),
        ("tuned", 2, "large_speed", {"gap": 2.0, "ratio": 100.0}),
        within=5e-6,
    ),
    *_each(
        "heavy-on-light-small-steps",
        "in one step it passes; other manifolds do not help",
        _WHOLE,
        (_ANEW,),
        ("tuned", 2, "drift", {}),
        ("tuned", 2, "impulse_scatter", {}),
    ),
    *_each(
        "incline-small-steps",
        "in one step it passes; other manifolds do not help",
        _WHOLE,
        (_ANEW,),
        ("tuned", 3, "creep", {"ratio": 0.99}),
    ),
    *_each(
        "kane-small-steps",
        "in one step it comes near; other manifolds do not help",
        _WHOLE,
        (_ANEW,),
        ("tuned", 2, "rise", {"e": 0.5, "mu": 0.1}),
        ("tuned", 2, "ahead", {}),
        within=3e-3,
    ),
    *_each(
        "oblique-small-steps",
        "in one step it passes; other manifolds do not help",
        _WHOLE,
        (_ANEW,),
        ("tuned", 3, "forward_speed", {}),
        ("tuned", 2, "spin_speed", {}),
    ),
    *_each(
        "off-centre-small-steps",
        "in one step it comes within singles; other manifolds do not help",
        _WHOLE,
        (_ANEW,),
        ("tuned", 3, "spin", {}),
        ("tuned", 2, "energy_lost", {"e": 1.0, "offset": 0.3}),
        within=_SPINS,
    ),
    *_each(
        "off-centre-small-steps",
        "in one step what the bar and the ball have of angular momentum is kept; other manifolds do not help",
        _WHOLE,
        (_ANEW,),
        ("tuned", 2, "angular_defect", {"whirl": -2.0}),
        dt=1.0 / 960.0,
    ),
    *_each(
        "overhang-small-steps",
        "in one step, with sweeps until little is left, the pile rests; other manifolds do not help",
        {**_WHOLE, **_SWEPT},
        (_ANEW, _REBOUNDS),
        ("default", 2, "kinetic_energy", {}),
        ("default", 2, "settle_time", {}),
        ("tuned", 2, "interface_impulse[2]", {}),
    ),
    *_each(
        "overlap-small-steps",
        "in one step it passes; other manifolds do not help",
        _WHOLE,
        (_ANEW, _KEPT),
        ("default", 2, "thrown", {"depth": 0.01, "ratio": 100.0}),
        ("tuned", 2, "thrown", {"depth": 0.01, "ratio": 100.0}),
    ),
    *_each(
        "pyramid-small-steps",
        "in one step, with sweeps until little is left, it rests; other manifolds do not help",
        {**_WHOLE, **_SWEPT},
        (_ANEW, _REBOUNDS),
        ("default", 2, "settle_time", {}),
        ("default", 2, "kinetic_energy", {"rows": 5.0}),
        ("tuned", 2, "settle_time", {"rows": 5.0}),
    ),
    *_each(
        "rolling-spin-small-steps",
        "in one step it rolls straight; other manifolds do not help",
        _WHOLE,
        (_ANEW,),
        ("default", 3, "astray", {}),
        ("tuned", 3, "astray", {}),
    ),
    *_each(
        "rod-gas-small-steps",
        "in a single small step it comes within singles; five times as many, later contacts and rebounds do not help",
        {"iterations": 1},
        (_SWEPT, _UNSEEN, _REBOUNDS),
        ("tuned", 2, "wrong_speed", {}),
        ("tuned", 2, "energy_defect", {}),
        within=_SINGLES,
    ),
    *_each(
        "rod-gas-small-steps",
        "in a single small step rods are where they should be; five times as many, and later contacts, do not help",
        {"iterations": 1},
        (_SWEPT, _UNSEEN),
        ("tuned", 2, "misplaced", {"n": 16.0, "room": 20.0, "duration": 2.75}),
        dt=1.0 / 960.0,
    ),
    *_each(
        "rack-small-steps",
        "in one step it comes within singles; other manifolds do not help",
        _WHOLE,
        (_ANEW,),
        ("tuned", 2, "asymmetry", {}),
        within=_SINGLES,
    ),
    *_each(
        "shove-small-steps",
        "in one step it passes; other manifolds do not help",
        _WHOLE,
        (_ANEW, _REBOUNDS),
        ("default", 2, "down", {"ratio": 20.0}),
    ),
    *_each(
        "slide-small-steps",
        "in one step the floor pushes steadily; other manifolds and later contacts do not help",
        _WHOLE,
        (_ANEW, _UNSEEN),
        ("default", 2, "normal[least]", {}),
        ("default", 2, "normal[greatest]", {}),
    ),
    *_each(
        "stack-small-steps",
        "in one step, with sweeps until little is left, the column rests; other manifolds do not help",
        {**_WHOLE, **_SWEPT},
        (_ANEW, _REBOUNDS),
        ("default", 2, "kinetic_energy", {"n": 10.0}),
        ("default", 2, "impulse_scatter", {"n": 2.0}),
        ("default", 2, "settle_time", {"n": 10.0}),
        ("tuned", 2, "kinetic_energy", {"n": 10.0}),
        *(
            (profile, 2, metric, {"n": n})
            for profile, n in (("default", 2.0), ("tuned", 10.0))
            for metric in ("load[least]", "load[greatest]", "unbalanced")
        ),
    ),
    *_each(
        "starved-small-steps",
        "in one step, with no more sweeps, the row rests; other manifolds and later contacts do not help",
        _WHOLE,
        (_ANEW, _UNSEEN),
        ("default", 2, "kinetic_energy", {}),
    ),
    *_each(
        "starved-small-steps",
        "in one step, with no more sweeps, the row rests; twice as many small steps, or sweeps after them, do not help",
        _WHOLE,
        ({"iterations": 100}, _AFTER),
        ("tuned", 2, "kinetic_energy", {}),
        ("tuned", 2, "load_error", {}),
    ),
    *_each(
        "starved-small-steps",
        "in one step, with no more sweeps, the row rests; other manifolds and later contacts do not help",
        _WHOLE,
        (_ANEW, _UNSEEN),
        ("default", 2, "kinetic_energy", {}),
        ("tuned", 2, "kinetic_energy", {}),
        iterations=4,
    ),
    # ---- sweeps
    *_each(
        "starved-few-sweeps",
        "with as many sweeps as there are the row stays; in one step, or over velocities alone, it does not",
        _SWEPT,
        (_WHOLE, _AFTER),
        ("default", 2, "displacement", {}),
        ("default", 2, "penetration", {}),
        ("tuned", 2, "displacement", {}),
        ("tuned", 2, "penetration", {}),
        iterations=1,
    ),
    *_each(
        "starved-few-sweeps",
        "with as many sweeps as there are the row stays; in small steps, or over velocities alone, it does not",
        _SWEPT,
        (_SMALL, _AFTER),
        ("pgs", 2, "displacement", {}),
        ("pgs", 2, "penetration", {}),
        iterations=1,
    ),
    *_each(
        "starved-few-sweeps-pgs",
        "with as many sweeps as there are the row stays; in small steps, or seen later, it does not",
        _SWEPT,
        (_SMALL, _UNSEEN),
        ("pgs", 2, "kinetic_energy", {"n": 30.0}),
        dt=1.0 / 60.0,
    ),
    *_each(
        "starved-few-sweeps-pgs",
        "with as many sweeps as there are the row stays; in small steps, or seen later, it does not",
        _SWEPT,
        (_SMALL, _UNSEEN),
        ("pgs", 2, "kinetic_energy", {}),
        ("pgs", 2, "load_error", {}),
        iterations=1,
        dt=1.0 / 60.0,
    ),
    *_each(
        "starved-few-sweeps-pgs",
        "with as many sweeps as there are the row rests; with overlaps left, or seen later, it does not",
        _SWEPT,
        (_LEFT, _UNSEEN),
        ("pgs", 2, "kinetic_energy", {}),
        iterations=20,
        dt=1.0 / 960.0,
    ),
    *_each(
        "starved-small-steps",
        "with as many sweeps as there are the row stays; in one step it still gives way",
        _SWEPT,
        (_WHOLE, _UNSEEN),
        ("default", 2, "kinetic_energy", {}),
        ("tuned", 2, "load_error", {}),
        iterations=1,
        dt=1.0 / 60.0,
    ),
    *_each(
        "heavy-on-light-few-sweeps",
        "with as many sweeps as there are it passes; other manifolds and kept spins do not help",
        _SWEPT,
        (_ANEW, _KEPT),
        ("default", 2, "drift", {"ratio": 1e4}),
        ("pgs", 2, "penetration", {}),
        ("pgs", 2, "interface_impulse[2]", {"ratio": 1e4}),
    ),
    *_each(
        "heavy-on-light-few-sweeps-tuned",
        "with as many sweeps as there are, of both kinds, loads come out; what is seen ahead does not matter",
        {**_SWEPT, **_AFTER},
        (_UNSEEN,),
        ("tuned", 2, "interface_impulse[2]", {"ratio": 1e4}),
    ),
    *_each(
        "incline-few-sweeps",
        "with as many sweeps as there are it stays; other manifolds do not help",
        _SWEPT,
        (_ANEW, _KEPT),
        ("default", 3, "creep", {"ratio": 0.999}),
        ("pgs", 2, "creep", {}),
    ),
    *_each(
        "overhang-few-sweeps",
        "with as many sweeps as there are it passes; other manifolds do not help",
        _SWEPT,
        (_ANEW, _KEPT),
        ("pgs", 2, "penetration", {}),
        ("pgs", 2, "settle_time", {}),
    ),
    *_each(
        "painleve-few-sweeps",
        "with as many sweeps as there are it passes; other manifolds do not help",
        _SWEPT,
        (_ANEW, _KEPT),
        ("default", 2, "edge_moved", {}),
        ("default", 2, "passing_time", {}),
    ),
    *_each(
        "pivot-few-sweeps",
        "with as many sweeps as there are, of both kinds, it turns straight; other manifolds do not help",
        {**_SWEPT, **_AFTER},
        (_KEPT, _UNSEEN),
        ("default", 3, "twisted", {"from": 1.0, "to": 30.0}),
        ("pgs", 3, "twisted", {}),
    ),
    *_each(
        "position-correction-few-sweeps",
        "with as many sweeps as there are it comes straight up; kept spins and what is seen ahead do not matter",
        _SWEPT,
        (_KEPT, _UNSEEN),
        ("default", 2, "drift", {}),
        ("default", 2, "launched", {}),
        ("tuned", 2, "drift", {}),
    ),
    *_each(
        "position-correction-thrown-out",
        "where overlaps are left it is not thrown; kept spins do not help",
        _LEFT,
        (_KEPT, _REBOUNDS),
        ("pgs", 2, "drift", {}),
        ("pgs", 2, "launched", {}),
    ),
    *_each(
        "pressed-box-few-sweeps",
        "with as many sweeps as there are it holds; other manifolds do not help",
        _SWEPT,
        (_ANEW, _KEPT),
        ("default", 2, "creep", {"load": 9.0, "shear": 4.9}),
        ("pgs", 2, "creep", {"load": 9.0, "shear": 4.9}),
        ("tuned", 2, "creep", {"load": 9.0, "shear": 4.9}),
    ),
    *_each(
        "pyramid-few-sweeps",
        "with as many sweeps as there are it rests; other manifolds do not help",
        _SWEPT,
        (_ANEW, _KEPT),
        ("pgs", 2, "settle_time", {}),
        ("pgs", 2, "kinetic_energy", {"rows": 5.0}),
    ),
    *_each(
        "rack-few-sweeps",
        "in one step, with as many sweeps as there are, left and right are alike within singles; other manifolds do "
        "not help",
        {**_SWEPT, **_WHOLE},
        (_ANEW, _KEPT),
        ("default", 2, "asymmetry", {}),
        ("pgs", 2, "asymmetry", {}),
        within=_SINGLES,
    ),
    *_each(
        "rocking-block-few-sweeps",
        "with as many sweeps as there are it passes; in one step it does not",
        _SWEPT,
        (_WHOLE, _ANEW),
        ("tuned", 2, "slid", {"aspect": 0.5, "tilt": 0.7}),
    ),
    *_each(
        "stack-few-sweeps",
        "with as many sweeps as there are it passes; other manifolds do not help",
        _SWEPT,
        (_ANEW, _REBOUNDS),
        ("default", 2, "penetration", {"n": 20.0}),
    ),
    *_each(
        "stack-few-sweeps-pgs",
        "with as many sweeps as there are it passes; other manifolds do not help",
        _SWEPT,
        (_ANEW, _REBOUNDS),
        ("pgs", 2, "drift", {"n": 10.0}),
        ("pgs", 2, "settle_time", {"n": 2.0}),
    ),
    *_each(
        "tilt-table-few-sweeps",
        "with as many sweeps as there are it stays; other manifolds do not help",
        _SWEPT,
        (_ANEW,),
        ("pgs", 2, "moved", {"aspect": 1.0}),
        ("tuned", 2, "moved", {"aspect": 1.0}),
    ),
)

EXPERIMENTS += OUT_OF_PLANE
