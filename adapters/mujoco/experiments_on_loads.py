"""Experiments on MuJoCo: what stands, is pressed or pushed, slides over plates, or starts inside something."""

from __future__ import annotations

from typing import Any

from adapters.experiment import Experiment
from adapters.mujoco.profiles import RIGID

#: Rigid contacts that reflect velocities and do not push out.
_NO_SPRING = {"solref": "reflect", "solimp": RIGID, "kappa_elastic": 0.0, "kappa_plastic": 0.0}
#: Friction damped so slowly that it stops no slip in a step.
_SLOW: dict[str, Any] = {"solreffriction": (1000.0, 1.0)}


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
                ("default", hold | _SLOW, {"tolerance": 0.0}),
                ("tuned", _SLOW, {"margin": 0.0}),
            )
        ),
        *(
            Experiment(
                "overlap-soft-contact",
                "a contact that reflects velocities and has no spring throws nothing; solving further does nothing",
                "default",
                "overlap",
                metric,
                _NO_SPRING,
                params,
                idle=({"tolerance": 0.0},),
            )
            for metric, params in (
                ("thrown", dict[str, float]()),
                ("centre_moved", {"depth": 0.01, "ratio": 100.0}),
            )
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
            for profile, off in (("default", hold | _SLOW), ("tuned", _SLOW))
        ),
    )
