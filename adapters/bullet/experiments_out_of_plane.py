"""Experiments on Bullet: planar scenes that leave their plane in space."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from adapters.experiment import Experiment

_TO_THE_END = {"solverResidualThreshold": 0.0}
_SOLVED = _TO_THE_END | {"iterations": 1000}
_COLD = {"warmStartingFactor": 0.0}
#: Faces are clipped against each other, instead of one nearest point a step.
_CLIPPED = {"enableSAT": 1}
_PLAIN = dict[str, float]()
_COARSE, _FINE = 1.0 / 60.0, 1.0 / 960.0

#: Profile, scene, parameters, step.
_SWEPT: tuple[tuple[str, str, Mapping[str, float], float | None], ...] = (
    *((profile, "stack", {"n": 10.0}, None) for profile in ("default", "tuned", "one")),
    *((profile, "pinch", {"margin": 100.0}, None) for profile in ("default", "tuned", "one")),
    *((profile, "overhang", {"margin": 0.02}, None) for profile in ("default", "tuned", "one")),
    *((profile, "pyramid", {"rows": 5.0}, None) for profile in ("default", "tuned")),
    *((profile, "heavy_on_light", _PLAIN, None) for profile in ("default", "tuned", "one")),
    *(("default", "incline", params, None) for params in (_PLAIN, {"ratio": 0.999}, {"ratio": 2.0})),
    *(("default", "flat_box", params, None) for params in (_PLAIN, {"e": 1.0}, {"aspect": 4.0, "e": 0.8})),
    *(("default", "kane", params, None) for params in (_PLAIN, {"e": 0.5, "mu": 0.1})),
    ("default", "edge_drop", {"e": 1.0, "tilt": 30.0}, None),
    ("default", "long_rest", _PLAIN, None),
    ("default", "pressed_box", {"load": 9.0, "shear": 4.9}, None),
    ("default", "tilt_table", {"aspect": 1.0}, None),
    # Rows of the full suite, at other steps and near thresholds.
    ("default", "conveyor", _PLAIN, _COARSE),
    ("default", "domino", {"ratio": 0.9}, _FINE),
    ("default", "ladder", {"ratio": 1.02, "lean": 75.0}, None),
    *((profile, "painleve", _PLAIN, _FINE) for profile in ("default", "tuned", "one")),
    ("default", "pivot", _PLAIN, _FINE),
    ("default", "position_correction", _PLAIN, _FINE),
    ("default", "rocking_block", _PLAIN, _FINE),
    ("default", "seam", _PLAIN, _FINE),
    ("default", "slide", {"mu": 0.8}, None),
    *((profile, "kane", {"along": -0.727}, None) for profile in ("tuned", "one")),
    ("one", "pyramid", {"rows": 10.0}, None),
)


def _off(scene: str, profile: str) -> Mapping[str, Any]:
    """What solves a scene to its end: a ratio of a hundred takes three thousand sweeps as shipped."""
    return _TO_THE_END | {"iterations": 3000} if (scene, profile) == ("heavy_on_light", "default") else _SOLVED


OUT_OF_PLANE: tuple[Experiment, ...] = (
    *(
        Experiment(
            f"{scene.replace('_', '-')}-plane-sweeps",
            "solved to the end the bodies stay in their plane; clipped faces do not keep them there",
            profile,
            scene,
            "out_of_plane",
            _off(scene, profile),
            params,
            idle=(_CLIPPED,),
            dt=dt,
        )
        for profile, scene, params, dt in _SWEPT
    ),
    *(
        Experiment(
            "arch-plane-sweeps",
            "solved to the end the stones stay in their plane; a cold start does not keep them there",
            "tuned",
            "arch",
            "out_of_plane",
            _SOLVED,
            params,
            idle=(_COLD,),
            dt=dt,
        )
        for params, dt in (({"ratio": 0.95}, None), ({"ratio": 0.8}, _FINE))
    ),
    *(
        Experiment(
            "flat-box-plane-warm-start",
            "from nothing and solved to the end the box stays in its plane; sweeps alone do not keep it there",
            profile,
            "flat_box",
            "out_of_plane",
            _COLD | _SOLVED,
            params,
            idle=(_SOLVED,),
        )
        for profile in ("tuned", "one")
        for params in ({"aspect": 0.25, "e": 0.2}, {"aspect": 4.0, "e": 0.2})
    ),
    *(
        Experiment(
            f"{scene}-plane-points",
            "with faces that are clipped the stones stay in their plane; sweeps to the end do not keep them there",
            profile,
            scene,
            "out_of_plane",
            _CLIPPED,
            params,
            idle=(_SOLVED,),
        )
        for profile, scene, params in (
            *((profile, "wedge", _PLAIN) for profile in ("default", "one")),
            *((profile, "arch", params) for profile in ("default", "one") for params in (_PLAIN, {"ratio": 0.8})),
        )
    ),
    Experiment(
        "position-correction-warm-start",
        "without warm starting the box stays in its plane; clipped faces or sweeps do not keep it there",
        "tuned",
        "position_correction",
        "out_of_plane",
        {"warmStartingFactor": 0.0},
        idle=(_CLIPPED, _SOLVED),
    ),
)
