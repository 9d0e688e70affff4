"""Experiments on MuJoCo: what stands, is pressed or pushed, slides over plates, or starts inside something."""

from __future__ import annotations

from typing import Any

from adapters.experiment import Experiment
from adapters.mujoco.profiles import RIGID

#: Rigid contacts that reflect velocities and do not push out.
_NO_SPRING = {"solref": "reflect", "solimp": RIGID, "kappa_elastic": 0.0, "kappa_plastic": 0.0}
#: Friction damped so slowly that it stops no slip in a step, and so slowly that it hardly acts.
_GENTLE: dict[str, Any] = {"solreffriction": (1.0, 1.0)}
_NONE: dict[str, Any] = {"solreffriction": (1000.0, 1.0)}
#: And in between: a load that gives way hops with the first and slips with the second.
_SLOW: dict[str, Any] = {"solreffriction": (2.0, 1.0)}
_ROUND: dict[str, Any] = {"cone": "elliptic"}
#: Rigid contacts whose references are nothing but damped, as the loop of the exact laws has them, and that loop, which
#: takes the coupling of slip and normal away.
_DAMPED: dict[str, Any] = {
    "cone": "elliptic", "smooth_condim": 1, "solref": (0.0, -240.0 * RIGID[0]), "solimp": RIGID, "tolerance": 1e-15,
    "margin": 1.703125e-07,
}  # fmt: skip
_LOOP: dict[str, Any] = {"rounds": 100, "agreed": 1e-13, "push_out": 0.1, "push_out_speed": 0.040875}


def on_loads(hold: dict[str, Any]) -> tuple[Experiment, ...]:
    """Experiments with ``hold``: settings of rigid contacts that start with the touch."""
    return (
        *(
            Experiment(
                "pyramid-touching-start",
                "with rigid contacts that start with the touch nothing sinks; solving further does nothing",
                "default",
                "pyramid",
                "penetration",
                hold,
                params,
                idle=({"tolerance": 0.0},),
            )
            for params in (dict[str, float](), {"rows": 5.0})
        ),
        *(
            Experiment(
                "seam-slip-lifts",
                "friction damped so slowly that it stops no slip in a step lifts nothing; solving further does nothing",
                profile,
                "seam",
                "hop",
                off,
                idle=(idle,),
            )
            for profile, off, idle in (
                ("default", hold | _GENTLE, {"tolerance": 0.0}),
                ("tuned", _GENTLE, {"margin": 0.0}),
            )
        ),
        *(
            Experiment(
                "slide-slip-lifts",
                "friction damped so slowly that it does not act lifts nothing; a round cone or solving further does "
                "not prevent it",
                profile,
                "slide",
                f"normal[{by}]",
                _ROUND | _NONE,
                params,
                dimension,
                idle=(_ROUND, {"tolerance": 0.0}),
            )
            for profile, params, dimension in (
                ("default", dict[str, float](), 2),
                ("default", {"heading": 45.0}, 3),
                ("tuned", dict[str, float](), 2),
            )
            for by in ("mean", "least", "greatest")
        ),
        *(
            Experiment(
                "slide-slip-lifts",
                "a loop that takes the coupling of slip and normal away makes friction right; the contacts that it "
                "works with do not, nor a round cone or solving further",
                "default",
                "slide",
                f"friction[{by}]",
                _DAMPED | _LOOP,
                params,
                dimension,
                idle=(_DAMPED, _ROUND, {"tolerance": 0.0}),
            )
            for params, dimension in ((dict[str, float](), 2), ({"heading": 22.5}, 3))
            for by in ("mean", "least", "greatest")
        ),
        *(
            Experiment(
                "wipe-slip-lifts",
                "friction damped so slowly that it stops no slip in a step lifts nothing; a round cone or solving "
                "further does not prevent it",
                profile,
                "wipe",
                metric,
                off,
                idle=(_ROUND, {"tolerance": 0.0}),
            )
            for profile, off, metrics in (
                ("default", _ROUND | _GENTLE, ("moved",)),
                ("tuned", _NONE, ()),
            )
            for metric in (
                *(f"{force}[{by}]" for force in ("normal", "friction", "stop") for by in ("least", "greatest")),
                *metrics,
            )
        ),
        Experiment(
            "wipe-slip-lifts",
            "the faster the table the higher the hop",
            "tuned",
            "wipe",
            "moved",
            _GENTLE,
            {"v": 1.0},
            idle=({"tolerance": 0.0},),
        ),
        Experiment(
            "wipe-slip-lifts",
            "solved to round-off the stop tells what acts, in the mean; a round cone does not do it",
            "default",
            "wipe",
            "stop[mean]",
            {"tolerance": 0.0},
            {"v": 1.0},
            idle=(_ROUND,),
        ),
        Experiment(
            "overlap-soft-contact",
            "a contact that reflects velocities and has no spring throws nothing; solving further does nothing",
            "default",
            "overlap",
            "thrown",
            _NO_SPRING,
            idle=({"tolerance": 0.0},),
        ),
        Experiment(
            "overlap-soft-contact",
            "solved to round-off the two forces cancel",
            "default",
            "overlap",
            "centre_moved",
            {"tolerance": 0.0},
            {"depth": 0.01, "ratio": 100.0},
        ),
        Experiment(
            "position-correction-spring",
            "overdamped, the shipped spring throws nothing; solving further does nothing",
            "default",
            "position_correction",
            "launched",
            {"solref": (0.02, 5.0)},
            idle=({"tolerance": 0.0},),
        ),
        Experiment(
            "position-correction-spring",
            "without the spring that carries loads nothing is thrown; without a margin it is",
            "tuned",
            "position_correction",
            "launched",
            {"kappa_plastic": 0.0},
            idle=({"margin": 0.0},),
        ),
        *(
            Experiment(
                "pressed-box-slip-lifts",
                "friction damped so slowly that it stops no slip in a step takes nothing off the load",
                profile,
                "pressed_box",
                "carried",
                off,
                {"load": 0.0},
                idle=({"tolerance": 0.0},) if profile == "default" else ({"impratio": 1.0},),
            )
            for profile, off in (("default", hold | _NONE), ("tuned", _NONE))
        ),
        *(
            Experiment(
                "tilt-table-soft-contact",
                "with rigid contacts and stiff friction it stays; a round cone or solving further does not do it",
                "default",
                "tilt_table",
                metric,
                hold,
                params,
                idle=({"cone": "elliptic"}, {"tolerance": 0.0}),
            )
            for metric, params in (
                ("moved", dict[str, float]()),
                ("moved", {"aspect": 1.0}),
                ("edge_moved", {"ratio": 1.1}),
            )
        ),
        Experiment(
            "tilt-table-soft-friction",
            "with friction that is damped as the normal the edge stays; a smaller share of softness does nothing",
            "tuned",
            "tilt_table",
            "edge_moved",
            {"solreffriction": None},
            {"ratio": 1.1},
            idle=({"impratio": 1e4}, {"margin": 0.0}),
        ),
        *(
            Experiment(
                "wedge-slip-lifts",
                "friction damped so slowly that it stops no slip in a step lifts nothing; solving further does nothing",
                "tuned",
                "wedge",
                metric,
                _SLOW,
                idle=({"tolerance": 0.0, "iterations": 1000},),
            )
            for metric in ("given_way", "acceleration", "off_the_face")
        ),
        Experiment(
            "wedge-viscous-friction",
            "stiff friction (impratio 100) on an elliptic cone holds; solving further does not",
            "default",
            "wedge",
            "moved",
            {"impratio": 100.0, "cone": "elliptic"},
            {"mu": 0.7},
            idle=({"tolerance": 0.0},),
        ),
        *(
            Experiment(
                "wedge-soft-contact",
                "with rigid contacts, and friction that lifts nothing, both go as they should; a round cone or solving "
                "further does not do it",
                "default",
                "wedge",
                metric,
                hold | _SLOW,
                idle=({"cone": "elliptic"}, {"tolerance": 0.0}),
            )
            for metric in ("given_way", "acceleration", "momentum", "off_the_face", "turned")
        ),
        *(
            Experiment(
                "arch-viscous-friction",
                "with friction ten thousand times stiffer than its normal the springers hold; solving further does "
                "nothing",
                profile,
                "arch",
                "moved",
                off,
                idle=({"tolerance": 0.0, "iterations": 1000},),
            )
            for profile, off in (("default", hold | {"impratio": 1e4}), ("tuned", {"impratio": 1e4}))
        ),
        *(
            Experiment(
                "arch-smooth-pyramid",
                "on a round cone the loads are right; a single row for smooth contacts does not do it",
                "default",
                "arch",
                metric,
                {"cone": "elliptic"},
                idle=({"smooth_condim": 1},),
            )
            for metric in ("face_load[left]", "face_load[right]", "floor_load[left]", "floor_load[right]")
        ),
        *(
            Experiment(
                "arch-smooth-pyramid",
                "on a rigid round cone, with friction that lifts nothing, it gives way as it should; solving further "
                "or a single row for smooth contacts does not do it",
                "default",
                "arch",
                metric,
                hold | _SLOW,
                {"ratio": 0.8},
                idle=({"tolerance": 0.0}, {"smooth_condim": 1}),
            )
            for metric in ("parting[left]", "parting[right]", "sinking", "face_load[left]", "face_load[right]")
        ),
        *(
            Experiment(
                "arch-slip-lifts",
                "friction damped so slowly that it stops no slip in a step lifts nothing; solving further does nothing",
                "tuned",
                "arch",
                metric,
                _SLOW,
                {"ratio": 0.8},
                idle=({"tolerance": 0.0, "iterations": 1000},),
            )
            for metric in ("parting[left]", "parting[right]", "sinking", "face_load[left]", "face_load[right]")
        ),
        *(
            Experiment(
                "conveyor-slow-friction",
                "with friction damped as the normal it sticks; stiffer friction does not do it",
                "tuned",
                "conveyor",
                "slip_speed",
                {"solreffriction": None},
                {"v": 0.5},
                dimension,
                idle=({"impratio": 1e4},),
            )
            for dimension in (2, 3)
        ),
        *(
            Experiment(
                "conveyor-soft-contact",
                "with rigid contacts, whose friction lifts nothing where it hops, it rides; solving does nothing",
                "default",
                "conveyor",
                metric,
                off,
                params,
                dimension,
                idle=({"tolerance": 0.0},),
            )
            for metric, off, params, dimension in (
                ("slip_speed", hold, {"heading": 45.0}, 3),
                ("turned", hold, {"heading": 45.0}, 3),
                ("hop", hold | _SLOW, {"heading": 45.0}, 3),
            )
        ),
        *(
            Experiment(
                "conveyor-pyramid",
                "on a round cone it is pulled along the belt, but for what a slip lifts; solving further does nothing",
                "default",
                "conveyor",
                metric,
                {"cone": "elliptic"},
                {"heading": heading},
                3,
                idle=({"tolerance": 0.0},),
                within=within,
            )
            for metric, heading, within in (("slipped", 45.0, 0.0), ("pull", 45.0, 0.06), ("astray", 22.5, 4e-3))
        ),
        *(
            Experiment(
                "starved-soft-contact",
                "with rigid contacts that carry from the start the row stays where it is; solving further does nothing",
                "default",
                "starved",
                metric,
                hold,
                idle=({"tolerance": 0.0},),
            )
            for metric in ("displacement", "penetration")
        ),
        *(
            Experiment(
                f"{scene.replace('_', '-')}-plane-tolerance",
                "solved on to round-off the bodies stay in their plane; stiffer friction does not do it",
                "default",
                scene,
                "out_of_plane",
                {"tolerance": 0.0, "iterations": 1000},
                params,
                idle=idle,
            )
            for scene, params, idle in (
                ("arch", dict[str, float](), ({"impratio": 1e4},)),
                ("edge_drop", {"e": 1.0, "tilt": 30.0}, ({"impratio": 1e4},)),
            )
        ),
        Experiment(
            "arch-plane-margin",
            "without a margin the stones stay in their plane; more steps of Newton or stiffer friction do not keep "
            "them there",
            "tuned",
            "arch",
            "out_of_plane",
            {"margin": 0.0},
            idle=({"tolerance": 0.0, "iterations": 1000}, {"impratio": 1e4}),
        ),
        *(
            Experiment(
                "starved-first-newton-step",
                "with a hundred iterations the row rests and carries; contacts seen from 1 mm do not make it",
                "default",
                "starved",
                metric,
                {"iterations": 100},
                iterations=1,
                idle=({"margin": 1e-3},),
            )
            for metric in ("kinetic_energy", "load_error")
        ),
    )
