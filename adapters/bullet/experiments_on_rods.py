"""Experiments on Bullet: rods that land or jam, dominoes, a box that shoves another, and a rack that is broken."""

from __future__ import annotations

from typing import Any

from adapters.experiment import Experiment

_NO_DRAG = {"linearDamping": 0.0, "angularDamping": 0.0}
_NO_PUSH = {"contactERP": 0.0, "contactSlop": 0.0}
_MORE = {"iterations": 1000}
_SOLVED = {"solverResidualThreshold": 0.0, "iterations": 1000}
#: A blow between rigid bodies, without anything that its law does not have.
_BARE: dict[str, Any] = _NO_DRAG | {
    "useMaximalCoordinates": 1, "solverResidualThreshold": 0.0, "restitutionVelocityThreshold": 1e-4,
    "contactProcessingThreshold": 0.0, "useSplitImpulse": 1, "splitImpulsePenetrationThreshold": 0.0,
    "contactERP": 0.0, "contactSlop": 1e-6,
}  # fmt: skip
_SLIPS = {"mu": 0.1, "e": 0.5}
_PLAIN = dict[str, float]()

ON_RODS: tuple[Experiment, ...] = (
    *(
        Experiment(
            "kane-shipped-contact",
            "without speculation, push-out, slop, drag and thresholds, solved to the end, the blow is exact; without "
            "drag alone it is not",
            "default",
            "kane",
            metric,
            _BARE | _MORE,
            params,
            idle=(_NO_DRAG,),
        )
        for metric in ("rise", "ahead", "spin", "gain")
        for params in (_PLAIN, _SLIPS)
    ),
    *(
        Experiment(
            "kane-push-out",
            "without push-out (and slop), solved to the end, the blow is exact; solving alone does nothing",
            "one",
            "kane",
            metric,
            _NO_PUSH | _MORE,
            params,
            idle=(_MORE,),
        )
        for metric in ("rise", "ahead", "spin", "gain")
        for params in (_PLAIN, _SLIPS)
    ),
    *(
        Experiment(
            "kane-fixed-sweeps",
            "with 1000 sweeps nothing is left to be seen; warm starting and slop have nothing to do with it",
            "tuned",
            "kane",
            metric,
            _MORE,
            idle=({"warmStartingFactor": 0.0}, {"contactSlop": 0.0}),
        )
        for metric in ("rise", "ahead", "spin", "gain")
    ),
    *(
        Experiment(
            "domino-drag",
            "without drag the domino turns as it should; solving further does nothing",
            "default",
            "domino",
            metric,
            _NO_DRAG,
            params,
            idle=(_SOLVED,),
        )
        for metric, params in (("passing_time", _PLAIN), ("passing_spin", _PLAIN), ("highest", {"ratio": 0.9}))
    ),
    *(
        Experiment(
            "painleve-drag",
            "without drag the rod turns and slows down as it should; solving further does nothing",
            "default",
            "painleve",
            metric,
            _NO_DRAG,
            params,
            idle=(_SOLVED,),
        )
        for metric, params in (("passing_spin", _PLAIN), ("slowed", {"ratio": 0.6}))
    ),
    *(
        Experiment(
            "shove-drag",
            "without drag both accelerations and the force are right; solving further does nothing",
            "default",
            "shove",
            metric,
            _NO_DRAG,
            idle=(_SOLVED,),
        )
        for metric in ("down", "ahead", "force")
    ),
    *(
        Experiment(
            "scales-clamped-speed",
            "on the path of rigid bodies, which has no such limit, it is right; without drag it is not",
            "default",
            "scales",
            metric,
            {"useMaximalCoordinates": 1},
            {"length": 1e3},
            idle=(_NO_DRAG,),
        )
        for metric in ("stopping_distance", "braking", "apex")
    ),
    Experiment(
        "rack-drag",
        "without drag momentum is kept",
        "default",
        "rack",
        "momentum_defect",
        _NO_DRAG,
        idle=(_SOLVED,),
    ),
    *(
        Experiment(
            "rack-shipped-contact",
            "without speculation, push-out, slop and thresholds energy and mirror are kept; without drag alone not",
            "default",
            "rack",
            metric,
            _BARE,
            idle=(_NO_DRAG,),
        )
        for metric in ("energy_defect", "asymmetry")
    ),
    Experiment(
        "rack-push-out",
        "without push-out (and slop) energy is kept; more sweeps do nothing",
        "one",
        "rack",
        "energy_defect",
        _NO_PUSH,
        idle=(_MORE,),
    ),
)
