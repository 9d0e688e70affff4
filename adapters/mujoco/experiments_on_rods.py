"""Experiments on MuJoCo: rods that land, jam or lean, dominoes, a box that shoves another, and a rack."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from adapters.experiment import Experiment

_FURTHER = {"tolerance": 0.0}
#: Friction damped so slowly that it stops no slip in a step.
_GENTLE: dict[str, Any] = {"solreffriction": (1.0, 1.0)}


def on_rods(reflect: Mapping[str, Any], hold: Mapping[str, Any]) -> tuple[Experiment, ...]:
    """Experiments with ``reflect``: the velocity reflected in the step after contact, and ``hold``: rigid contacts."""
    stops = {**reflect, "solreffriction": "stick"}
    return (
        *(
            Experiment(
                "kane-soft-contact",
                "with velocities reflected and slip stopped in the step after contact the blow is right to 4e-3; "
                "reflected alone it is not, and solving further does nothing",
                "default",
                "kane",
                metric,
                stops,
                idle=(reflect, _FURTHER),
                within=4e-3,
            )
            for metric in ("rise", "ahead", "spin", "gain")
        ),
        *(
            Experiment(
                "domino-soft-contact",
                "with the velocity reflected in the step after contact the next domino is struck; solving does nothing",
                "default",
                "domino",
                metric,
                reflect,
                idle=(_FURTHER,),
            )
            for metric in ("struck_time", "struck_spin")
        ),
        *(
            Experiment(
                "painleve-soft-contact",
                "with rigid contacts the end jams at once; a round cone or solving further does not do it",
                "default",
                "painleve",
                metric,
                hold,
                idle=({"cone": "elliptic"}, _FURTHER),
            )
            for metric in ("passing_time", "edge_moved")
        ),
        *(
            Experiment(
                "painleve-soft-friction",
                "with friction that is damped as the normal the end jams at once; less softness or no margin does not",
                "tuned",
                "painleve",
                metric,
                {"solreffriction": None},
                idle=({"impratio": 1e4}, {"margin": 0.0}),
            )
            for metric in ("passing_time", "passing_spin", "edge_moved")
        ),
        *(
            Experiment(
                "painleve-slip-lifts",
                "friction damped so slowly that it stops no slip in a step lifts nothing",
                profile,
                "painleve",
                "lifted",
                off,
                {"ratio": 0.6},
                idle=(idle,),
            )
            for profile, off, idle in (
                ("default", {**hold, **_GENTLE}, _FURTHER),
                ("tuned", _GENTLE, {"margin": 0.0}),
            )
        ),
        Experiment(
            "ladder-soft-contact",
            "with rigid contacts that start with the touch it stays; a round cone or solving further does not do it",
            "default",
            "ladder",
            "moved",
            hold,
            idle=({"cone": "elliptic"}, _FURTHER),
        ),
        Experiment(
            "ladder-soft-contact",
            "with rigid contacts that start with the touch the load is right",
            "default",
            "ladder",
            "wall_load",
            hold,
            idle=({"cone": "elliptic"}, _FURTHER),
        ),
        Experiment(
            "ladder-unfinished",
            "solved to round-off the floor carries the weight",
            "default",
            "ladder",
            "floor_load",
            _FURTHER,
        ),
        Experiment(
            "ladder-margin",
            "without a margin it is as near as it should be; less softness of friction does nothing",
            "tuned",
            "ladder",
            "passing_spin",
            {"margin": 0.0},
            {"ratio": 0.8},
            idle=({"impratio": 1e4},),
        ),
        *(
            Experiment(
                "card-tent-slow-slippage",
                "with friction stiffer than its normal the tent stands; a round cone or solving further does not do it",
                "default",
                "card_tent",
                metric,
                {"impratio": 1e4},
                idle=({"cone": "elliptic"}, _FURTHER),
            )
            for metric in ("moved", "head_load")
        ),
        *(
            Experiment(
                "card-tent-slip-lifts",
                "friction damped so slowly that it stops no slip in a step lifts nothing but what a soft rest sinks",
                profile,
                "card_tent",
                metric,
                {**hold, **_GENTLE},
                {"ratio": 0.8},
                idle=({"tolerance": 0.0, "impratio": 1e4},),
                within=within,
            )
            for profile, metric, within in (
                ("default", "let_go", 5.1e-4),
                ("tuned", "let_go", 5.1e-4),
                ("tuned", "passing_spin[left]", 0.0),
                ("tuned", "passing_spin[right]", 0.0),
            )
        ),
        *(
            Experiment(
                "shove-smooth-pyramid",
                "without friction rows for what is smooth both boxes move as they should; a margin does nothing",
                "default",
                "shove",
                metric,
                {"smooth_condim": 1},
                params,
                idle=({"margin": 1e-3},),
            )
            for params, metrics in (
                (dict[str, float](), ("down", "ahead", "force", "parted")),
                ({"ratio": 20.0}, ("down", "ahead", "force")),
            )
            for metric in metrics
        ),
        *(
            Experiment(
                "rack-unfinished",
                "solved to round-off momentum and mirror are kept",
                "default",
                "rack",
                metric,
                _FURTHER,
            )
            for metric in ("momentum_defect", "asymmetry")
        ),
        *(
            Experiment(
                "scales-soft-contact",
                "with the velocity reflected in the step after contact the ball rises right; solving does nothing",
                "default",
                "scales",
                "apex",
                {**reflect, "kappa_plastic": 0.1, "solreffriction": (0.05, 1.0)},
                dimension=dimension,
                idle=(_FURTHER,),
            )
            for dimension in (2, 3)
        ),
        *(
            Experiment(
                "scales-soft-contact",
                "with rigid contacts the box does not lean; solving does nothing",
                "default",
                "scales",
                "turned",
                {**reflect, "kappa_plastic": 0.1, "solreffriction": (0.05, 1.0)},
                dimension=dimension,
                idle=(_FURTHER,),
            )
            for dimension in (2, 3)
        ),
        *(
            Experiment(
                "scales-slip-lifts",
                "friction damped so slowly that it stops no slip in a step lifts nothing but the first step's fall",
                "tuned",
                "scales",
                "hop",
                _GENTLE,
                params,
                dimension,
                idle=({"impratio": 100.0},),
                within=1.71e-4,
            )
            for params, dimension in ((dict[str, float](), 2), ({"length": 1e3}, 2), (dict[str, float](), 3))
        ),
        Experiment(
            "rack-soft-contact",
            "with the velocity reflected in the step after contact 1e-4 of the energy is lost; solving does nothing",
            "default",
            "rack",
            "energy_defect",
            reflect,
            idle=(_FURTHER,),
            within=2e-4,
        ),
    )
