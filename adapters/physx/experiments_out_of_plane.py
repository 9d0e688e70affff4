"""Experiments on PhysX: planar scenes that leave their plane in space."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from adapters.experiment import Experiment

_Settings = Mapping[str, Any]
_PLAIN = dict[str, float]()
#: As many sweeps as the engine can count, and as many as that over velocities alone besides.
_SWEPT: _Settings = {"iterations": 255}
_BOTH: _Settings = {"iterations": 255, "velocity_iterations": 200}
#: One step instead of small ones, and small ones instead of one.
_WHOLE: _Settings = {"solver": "pgs"}
_SMALL: _Settings = {"solver": "tgs"}
_WHOLE_SWEPT: _Settings = {**_WHOLE, **_SWEPT}
_SMALL_SWEPT: _Settings = {**_SMALL, **_SWEPT}
#: Points of contact are found anew in every step; contacts are made when bodies touch; friction across every gap.
_ANEW: _Settings = {"persistent_manifolds": False}
_UNSEEN: _Settings = {"contact_offset": 1e-4}
_RUBS: _Settings = {"tolerance_length": 100.0}

#: What singles make of speeds of some metres per second: 48 roundings of 2^-24; and of a rod of 1 m that flies for
#: 1 s: 5000 roundings, as `adapters.single_precision.plane_law` has them.
_SINGLES, _FLOWN = 1e-6, 2.9e-4
_SLIM: dict[str, float] = {"aspect": 0.5, "tilt": 0.7}
_SLOW: dict[str, float] = {"e": 0.5, "mu": 0.1}
_SHEARED: dict[str, float] = {"load": 9.0, "shear": 4.9}

#: Scene, profile, parameters and sweeps of a row; what keeps it in its plane, what does not, and how near counts.
_ROWS: tuple[tuple[str, str, dict[str, float], int | None, _Settings, tuple[_Settings, ...], float], ...] = (
    ("edge_drop", "default", {"e": 1.0, "tilt": 30.0}, None, _SWEPT, (_ANEW, _UNSEEN), _SINGLES),
    ("heavy_on_light", "default", {"ratio": 1e4}, None, _SWEPT, (_WHOLE, _ANEW), 0.0),
    ("heavy_on_light", "pgs", _PLAIN, None, _SWEPT, (_ANEW, _UNSEEN), 0.0),
    ("heavy_on_light", "pgs", {"ratio": 1e4}, None, _SMALL_SWEPT, (_SMALL, _SWEPT), 0.0),
    ("heavy_on_light", "tuned", _PLAIN, None, _WHOLE_SWEPT, (_WHOLE, _SWEPT), 0.0),
    ("heavy_on_light", "tuned", {"ratio": 1e4}, None, _SWEPT, (_WHOLE, _ANEW), 0.0),
    *(("incline", "pgs", params, None, _SWEPT, (_UNSEEN, _RUBS), 0.0)
      for params in (_PLAIN, {"ratio": 0.99}, {"ratio": 0.999}, {"ratio": 2.0})),
    ("kane", "default", _PLAIN, None, _SWEPT, (_ANEW, _RUBS), _FLOWN),
    ("kane", "default", _SLOW, None, _SWEPT, (_ANEW, _UNSEEN), _SINGLES),
    ("kane", "pgs", _SLOW, None, _SWEPT, (_ANEW, _UNSEEN), _SINGLES),
    ("kane", "pgs", _PLAIN, None, _BOTH, (_ANEW, _UNSEEN), _SINGLES),
    *(("kane", "tuned", params, None, _WHOLE, (_ANEW, _UNSEEN), _SINGLES) for params in (_PLAIN, _SLOW)),
    ("painleve", "default", _PLAIN, None, _SWEPT, (_ANEW, _UNSEEN), 0.0),
    *(("position_correction", profile, _PLAIN, None, _SWEPT, (_ANEW, _WHOLE), 0.0) for profile in ("default", "tuned")),
    *(("position_correction", "pgs", params, None, _BOTH, (_ANEW, _SWEPT), 0.0)
      for params in (_PLAIN, {"depth": 0.01})),
    ("pressed_box", "default", _SHEARED, None, _SWEPT, (_WHOLE, _ANEW), 0.0),
    ("pressed_box", "pgs", _SHEARED, None, _SWEPT, (_SMALL, _ANEW), 0.0),
    ("pressed_box", "pgs", {"load": 0.0}, None, _SWEPT, (_UNSEEN, _ANEW), 0.0),
    ("rocking_block", "default", _SLIM, None, _WHOLE_SWEPT, (_SWEPT, _ANEW), 0.0),
    ("rocking_block", "tuned", _PLAIN, None, {**_WHOLE, **_BOTH}, (_ANEW,), 0.0),
    ("rocking_block", "tuned", _SLIM, None, {**_WHOLE, **_BOTH}, (_WHOLE, _ANEW, _UNSEEN), 0.0),
    ("stack", "default", {"n": 10.0}, None, _SWEPT, (_WHOLE, _ANEW), 0.0),
    ("stack", "default", {"n": 10.0}, 1, _SWEPT, (_WHOLE, _ANEW), 0.0),
    *(("stack", profile, {"n": 10.0}, count, _SWEPT, (_ANEW,), 0.0)
      for profile in ("default", "pgs", "tuned") for count in (4, 10)),
    ("stack", "pgs", {"n": 10.0}, None, _SWEPT, (_ANEW, _UNSEEN), 0.0),
    ("stack", "tuned", {"n": 10.0}, None, _SWEPT, (_ANEW,), 0.0),
    ("tilt_table", "pgs", {"aspect": 1.0}, None, _SWEPT, (_ANEW, _UNSEEN), 0.0),
)  # fmt: skip

OUT_OF_PLANE: tuple[Experiment, ...] = (
    *(
        Experiment(
            f"{scene.replace('_', '-')}-plane-sweeps",
            "swept on, in one step or in small ones, bodies stay in their plane; what else is blamed does not help",
            profile,
            scene,
            "out_of_plane",
            off,
            params,
            iterations=iterations,
            idle=idle,
            within=within,
        )
        for scene, profile, params, iterations, off, idle, within in _ROWS
    ),
    *(
        Experiment(
            "flat-box-small-steps",
            "in one step the box stays in its plane within singles; other manifolds do not keep it there",
            profile,
            "flat_box",
            "out_of_plane",
            _WHOLE,
            params,
            idle=(_ANEW,),
            within=_SINGLES,
        )
        for profile in ("default", "tuned")
        for params in (_PLAIN, {"e": 1.0}, {"e": 0.8, "aspect": 4.0})
    ),
    *(
        Experiment(
            "seam-seen-ahead",
            "where contacts are made when bodies touch the box slides straight over the seam; friction does not matter",
            profile,
            "seam",
            "out_of_plane",
            _UNSEEN,
            idle=(_RUBS,),
        )
        for profile in ("default", "pgs", "tuned")
    ),
    Experiment(
        "ladder-plane-one-step",
        "in small steps the ladder passes in its plane; more sweeps, or points found anew, do not keep it there",
        "pgs",
        "ladder",
        "out_of_plane",
        _SMALL,
        {"ratio": 0.8},
        idle=(_SWEPT, _ANEW),
    ),
)
