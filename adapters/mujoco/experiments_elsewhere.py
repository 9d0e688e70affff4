"""Experiments on MuJoCo: rows of the full suite, at other steps, starved, and near thresholds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from adapters.experiment import Experiment

_FURTHER = {"tolerance": 0.0}
_MUCH_FURTHER = {"tolerance": 0.0, "iterations": 1000}
_ROUND = {"cone": "elliptic"}
_STIFF = {"impratio": 1e4}
_NO_MARGIN = {"margin": 0.0}
_RIGID = {"solimp": (0.9999, 0.9999, 0.001, 0.5, 1.0)}
#: Friction damped as the normal, and so slowly that it stops no slip in a step.
_AS_NORMAL: dict[str, Any] = {"solreffriction": None}
_SLOW: dict[str, Any] = {"solreffriction": (2.0, 1.0)}
_GENTLE: dict[str, Any] = {"solreffriction": (1.0, 1.0)}
_SIXTY, _FINE = 1.0 / 60.0, 1.0 / 960.0

Changes = Mapping[str, Any]
#: Scene, metric, switched off, parameters, step.
_Row = tuple[str, str, Changes, Mapping[str, float], float | None]


def elsewhere(reflect: Changes, hold: Changes, slide: Changes) -> tuple[Experiment, ...]:
    """Experiments with contacts that ``reflect`` velocities in a step, ``hold`` rigidly, or let a box ``slide``."""
    return (
        *_of_the_first_step(),
        *_soft(reflect, hold, slide),
        *_of_friction(),
        *_out_of_plane(),
    )


def _of_the_first_step() -> tuple[Experiment, ...]:
    rows: tuple[tuple[str, str, float, float | None], ...] = (
        ("default", "settle_time", 20.0, None),
        ("default", "kinetic_energy", 20.0, None),
        ("default", "impulse_scatter", 20.0, None),
        ("default", "interface_impulse[1]", 20.0, None),
        ("default", "drift", 10.0, _SIXTY),
        ("default", "load[greatest]", 10.0, _SIXTY),
        ("default", "unbalanced", 10.0, _SIXTY),
        ("tuned", "settle_time", 20.0, None),
        ("tuned", "penetration", 20.0, None),
        ("tuned", "kinetic_energy", 20.0, None),
        ("tuned", "interface_impulse[1]", 20.0, None),
    )
    return tuple(
        Experiment(
            "stack-first-newton-step",
            "with four iterations the column rests and carries; stiff friction does not make it",
            profile,
            "stack",
            metric,
            {"iterations": 4},
            {"n": n},
            iterations=1,
            idle=({"impratio": 10.0},),
            dt=dt,
        )
        for profile, metric, n, dt in rows
    )


def _soft(reflect: Changes, hold: Changes, slide: Changes) -> tuple[Experiment, ...]:
    rows: tuple[_Row, ...] = (
        ("restitution_above_one", "growth", reflect, {"e": 1.0}, None),
        ("restitution_above_one", "blows", reflect, {"e": 1.0}, None),
        ("heavy_on_light", "penetration", hold, {}, None),
        ("heavy_on_light", "impulse_scatter", hold, {"ratio": 1e4}, _SIXTY),
        ("v_groove", "displacement", hold, {"right": 80.0}, None),
        ("v_groove", "displacement", hold, {"left": 60.0, "right": 80.0}, None),
        ("pivot", "edge_moved", hold, {}, _FINE),
        ("rocking_block", "slid", hold, {}, _FINE),
        ("rocker", "slip", hold, {"tilt": 5.0}, _FINE),
        ("rocker", "swing_time", hold, {}, _FINE),
        ("rocker", "swing_time", _RIGID, {"thickness": 0.4}, None),
        ("tilt_table", "passing_time", hold, {"ratio": 1.02}, None),
        ("tilt_table", "passing_time", hold, {"ratio": 1.1}, _FINE),
        ("rack", "penetration", reflect, {}, _FINE),
        ("domino", "edge_moved", hold, {"ratio": 0.5}, None),
        ("domino", "edge_moved", hold, {}, _FINE),
        ("domino", "edge_moved", hold, {"ratio": 2.0}, None),
        ("overhang", "stands", hold, {"margin": 0.005, "n": 8.0}, None),
        ("overhang", "kinetic_energy", hold, {"margin": 0.005, "n": 8.0}, None),
        ("overhang", "impulse_scatter", hold, {"margin": 1e-6, "n": 2.0}, None),
        ("overhang", "interface_impulse[2]", hold, {"margin": 1e-6, "n": 2.0}, None),
    )
    return (
        *(
            Experiment(
                f"{scene.replace('_', '-')}-soft-contact",
                "with rigid contacts it is as it should be; solving further does nothing",
                "default",
                scene,
                metric,
                off,
                params,
                idle=(_FURTHER,),
                dt=dt,
            )
            for scene, metric, off, params, dt in rows
        ),
        Experiment(
            "heavy-on-light-soft-contact",
            "with rigid contacts the light box stays below; solving further does nothing",
            "default",
            "heavy_on_light",
            "drift",
            hold,
            {"ratio": 1e5},
            3,
            idle=(_FURTHER,),
        ),
        Experiment(
            "heavy-on-light-soft-contact",
            "a spring that is five times as stiff lets it sink a fifth; a margin or stiff friction does nothing",
            "tuned",
            "heavy_on_light",
            "penetration",
            {"kappa_plastic": 0.5},
            {"ratio": 1e4},
            iterations=1,
            idle=(_NO_MARGIN, _STIFF),
        ),
        Experiment(
            "slide-to-roll-pyramid",
            "rigid contacts on a round cone let it roll without slip; solving the pyramid further does nothing",
            "default",
            "slide_to_roll",
            "slip",
            slide,
            {"heading": 30.0},
            3,
            idle=(_FURTHER,),
            dt=_FINE,
        ),
    )


def _of_friction() -> tuple[Experiment, ...]:
    return (
        *(
            Experiment(
                "pinch-viscous-friction",
                "on a round cone it does not turn; solving further does not prevent it",
                "default",
                "pinch",
                "turned",
                _ROUND,
                {"margin": 1.05},
                idle=(_FURTHER,),
                dt=dt,
            )
            for dt in (_SIXTY, 1.0 / 480.0)
        ),
        *(
            Experiment(
                family,
                "friction damped so slowly that it stops no slip in a step lifts nothing; a margin or solving further "
                "has no part in it",
                "tuned",
                scene,
                metric,
                _SLOW,
                params,
                idle=(_NO_MARGIN, _MUCH_FURTHER),
                dt=dt,
            )
            for family, scene, metric, params, dt in (
                ("wedge-slip-lifts", "wedge", "turned", dict[str, float](), _FINE),
                ("ladder-slip-lifts", "ladder", "let_go", {"ratio": 0.8}, _SIXTY),
                ("ladder-slip-lifts", "ladder", "let_go", {"ratio": 0.8, "lean": 45.0}, None),
                ("arch-slip-lifts", "arch", "off_the_faces", {"ratio": 0.5, "beta": 25.0}, None),
                ("arch-slip-lifts", "arch", "off_the_faces", {"ratio": 0.8, "beta": 25.0}, None),
            )
        ),
        *(
            Experiment(
                "scales-slip-lifts",
                "friction damped so slowly that it stops no slip in a step turns nothing; a margin has no part in it",
                "tuned",
                "scales",
                "turned",
                _GENTLE,
                dimension=dimension,
                idle=(_NO_MARGIN,),
                dt=_FINE,
            )
            for dimension in (2, 3)
        ),
        *(
            Experiment(
                f"{scene.replace('_', '-')}-soft-friction",
                "with friction that is damped as the normal it gets there in time; a smaller share of softness does "
                "nothing",
                "tuned",
                scene,
                metric,
                _AS_NORMAL,
                params,
                idle=(_STIFF,),
                dt=dt,
            )
            for scene, metric, params, dt in (
                ("tilt_table", "passing_time", {"ratio": 1.1}, _FINE),
                ("hilltop", "leaving_time", dict[str, float](), _FINE),
                ("hilltop", "leaving_time", {"mu": 2.0, "v": 2.0}, None),
            )
        ),
        *(
            Experiment(
                "card-tent-gives-way",
                "with stiff friction, or on a round cone, the floor carries all of it; solving further does nothing",
                "default",
                "card_tent",
                "floor_load",
                off,
                {"lean": 45.0, "ratio": 1.02},
                idle=(_FURTHER,),
            )
            for off in (_STIFF, _ROUND)
        ),
        *(
            Experiment(
                "arch-margin",
                "without a margin the arch stands and the floor carries it; stiffer friction or solving further does "
                "nothing",
                "tuned",
                "arch",
                "floor_load[left]",
                _NO_MARGIN,
                idle=(_STIFF, _MUCH_FURTHER),
                dt=dt,
            )
            for dt in (1.0 / 480.0, _FINE)
        ),
    )


def _out_of_plane() -> tuple[Experiment, ...]:
    tolerance: tuple[tuple[str, Mapping[str, float], float], ...] = (
        ("shove", {}, 1.0 / 500.0),
        ("shove", {"ratio": 20.0}, _FINE),
        ("wedge", {"mu": 0.0}, 1.0 / 240.0),
        ("wedge", {"mu": 0.7}, 1.0 / 500.0),
    )
    return (
        *(
            Experiment(
                f"{scene}-plane-tolerance",
                "solved on to round-off the bodies stay in their plane",
                "default",
                scene,
                "out_of_plane",
                _MUCH_FURTHER,
                params,
                dt=dt,
            )
            for scene, params, dt in tolerance
        ),
        Experiment(
            "heavy-on-light-plane-pyramid",
            "on a round cone the boxes stay in their plane; solving further does not keep them there",
            "default",
            "heavy_on_light",
            "out_of_plane",
            _ROUND,
            {"ratio": 1e5},
            idle=(_MUCH_FURTHER,),
        ),
        *(
            Experiment(
                "stack-plane-pyramid",
                "on a round cone the boxes stay in their plane; a single row for smooth contacts does not do it",
                "default",
                "stack",
                "out_of_plane",
                _ROUND,
                {"n": 10.0},
                iterations=1,
                idle=({"smooth_condim": 1},),
                dt=dt,
            )
            for dt in (_SIXTY, 1.0 / 120.0)
        ),
    )
