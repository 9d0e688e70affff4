"""Experiments on Bullet: what stands, is pressed or pushed, slides over plates, or starts inside something."""

from __future__ import annotations

from adapters.experiment import Experiment

_NO_DRAG = {"linearDamping": 0.0, "angularDamping": 0.0}
_SOLVED = {"solverResidualThreshold": 0.0, "iterations": 1000}
#: Contact points are kept while they drift, and friction with them.
_KEPT = _NO_DRAG | {"contactBreakingThreshold": 0.1}
_PLAIN = dict[str, float]()
#: Faces of hulls and boxes are clipped: all points of two of them are found in every step, where one was.
_FACES = {"enableSAT": 1}
#: Bodies come from the same files, their faces stay unknown.
_FILES = {"enableSAT": 0}
_NO_PUSH = {"contactERP": 0.0}

ON_LOADS: tuple[Experiment, ...] = (
    *(
        Experiment(
            "pyramid-sweeps",
            "solved to the end (no residual stop, 1000 sweeps) the wall stands",
            profile,
            "pyramid",
            metric,
            _SOLVED,
            params,
            idle=(_NO_DRAG,) if profile == "default" else ({"warmStartingFactor": 0.95},),
        )
        for profile, metric, params in (
            ("default", "settle_time", _PLAIN),
            ("default", "drift", {"rows": 5.0}),
            ("tuned", "settle_time", {"rows": 5.0}),
        )
    ),
    *(
        Experiment(
            f"{scene.replace('_', '-')}-drag",
            "without drag it stops where it should; solving further does nothing",
            "default",
            scene,
            metric,
            _NO_DRAG,
            idle=(_SOLVED,),
        )
        for scene in ("seam", "far_origin")
        for metric in ("stopping_distance", "braking")
    ),
    *(
        Experiment(
            "far-origin-drag",
            "with a wider margin no contact point of the sliding face is lost; without drag alone they are",
            "default",
            "far_origin",
            metric,
            _KEPT,
            idle=(_NO_DRAG, _SOLVED),
        )
        for metric in ("hop", "turned")
    ),
    *(
        Experiment(
            "overlap-push-out",
            "without push-out nothing is thrown; drag has nothing to do with it",
            profile,
            "overlap",
            "thrown",
            {"contactERP": 0.0},
            idle=(idle,),
        )
        for profile, idle in (("default", _NO_DRAG), ("one", {"iterations": 1000}))
    ),
    Experiment(
        "position-correction-push-out",
        "without push-out nothing is thrown; drag has nothing to do with it",
        "default",
        "position_correction",
        "launched",
        {"contactERP": 0.0, "contactSlop": 0.0},
        idle=(_NO_DRAG,),
    ),
    *(
        Experiment(
            "position-correction-warm-start",
            "without push-out by speed, or without warm starting, nothing goes sideways; more sweeps do nothing",
            "tuned",
            "position_correction",
            "drift",
            off,
            idle=({"iterations": 1000},),
        )
        for off in (
            {"contactERP": 0.0},
            {"warmStartingFactor": 0.0},
            {"useSplitImpulse": 1, "splitImpulsePenetrationThreshold": 0.0},
        )
    ),
    *(
        Experiment(
            "pressed-box-drag",
            "without drag and with a wider margin the box slides right; without drag alone points of it are lost",
            "default",
            "pressed_box",
            metric,
            _KEPT,
            {"load": 0.0},
            idle=(_NO_DRAG, _SOLVED),
        )
        for metric in ("acceleration", "carried", "sheared")
    ),
    *(
        Experiment(
            "tilt-table-residual",
            "solved to the end (no residual stop, 1000 sweeps) it stays; drag has nothing to do with it",
            "default",
            "tilt_table",
            "moved",
            _SOLVED,
            params,
            dimension,
            idle=(_NO_DRAG,),
        )
        for params, dimension in (({"aspect": 1.0}, 2), (_PLAIN, 3))
    ),
    Experiment(
        "tilt-table-drag",
        "without drag the block slides right; solving further does nothing",
        "default",
        "tilt_table",
        "acceleration",
        _NO_DRAG,
        {"aspect": 1.0, "ratio": 1.1},
        idle=(_SOLVED,),
    ),
    Experiment(
        "wedge-drag",
        "without drag no momentum is lost but for 1e-10 N s; a wider margin does nothing",
        "default",
        "wedge",
        "momentum",
        _NO_DRAG,
        idle=({"contactBreakingThreshold": 0.1},),
        within=1e-8,
    ),
    *(
        Experiment(
            "wedge-hull-margin",
            "without Baumgarte nothing is lifted; solving further does nothing",
            profile,
            "wedge",
            "moved",
            {"contactERP": 0.0},
            {"mu": 0.7},
            idle=(_SOLVED,),
        )
        for profile in ("default", "one")
    ),
    *(
        Experiment(
            "wedge-hull-points",
            "where faces are clipped the block stands on four points in every step, and all is as it should be",
            profile,
            "wedge",
            metric,
            off,
            idle=idle,
        )
        for profile, metric, off, idle in (
            ("default", "off_the_face", _FACES, (_FILES, _NO_PUSH, _SOLVED)),
            ("default", "turned", _FACES, (_FILES, _NO_PUSH, _SOLVED)),
            ("default", "acceleration", _FACES | _NO_DRAG, (_FACES, _NO_DRAG)),
            ("default", "given_way", _FACES | _NO_DRAG, (_FACES, _NO_DRAG)),
            ("one", "acceleration", _FACES, (_FILES, _NO_PUSH, _SOLVED)),
            ("one", "off_the_face", _FACES, (_FILES, _NO_PUSH, _SOLVED)),
        )
    ),
    Experiment(
        "wedge-hull-grid",
        "with a slop that a step's fall is far above the block does not hop on its face; clipping has nothing to do "
        "with it",
        "tuned",
        "wedge",
        "acceleration",
        {"contactSlop": 1e-6},
        idle=(_FILES,),
        dt=1.0 / 480.0,
    ),
    *(
        Experiment(
            "arch-hull-points",
            "where faces are clipped the keystone presses both springers alike, and sinks in as it should",
            profile,
            "arch",
            metric,
            off,
            params,
            idle=idle,
        )
        for profile, metric, params, off, idle in (
            ("default", "face_load[left]", _PLAIN, _FACES, (_FILES, _SOLVED)),
            ("one", "face_load[right]", _PLAIN, _FACES, (_FILES, _NO_PUSH)),
            ("default", "sinking", {"ratio": 0.8}, _FACES | _NO_DRAG, (_FACES, _NO_DRAG)),
            ("one", "parting[left]", {"ratio": 0.8}, _FACES, (_FILES, _NO_PUSH)),
            ("one", "turned", {"ratio": 0.8}, _FACES, (_FILES, _NO_PUSH)),
        )
    ),
    *(
        Experiment(
            "arch-hull-margin",
            "without Baumgarte nothing is lifted, as shipped without drag and solved to the end; solving alone does "
            "nothing",
            profile,
            "arch",
            "moved",
            off,
            idle=(_SOLVED,),
        )
        for profile, off in (
            ("default", {"contactERP": 0.0} | _SOLVED | _NO_DRAG),
            ("one", {"contactERP": 0.0}),
        )
    ),
    *(
        Experiment(
            "conveyor-drag",
            "without drag it is pulled and slips as it should; solving to the end does nothing",
            "default",
            "conveyor",
            metric,
            _NO_DRAG,
            params,
            dimension,
            idle=(_SOLVED,),
        )
        for metric, params, dimension in (
            ("pull", {"mu": 0.1}, 2),
            ("slipped", {"mu": 0.1}, 2),
            ("pull", {"heading": 45.0}, 3),
        )
    ),
    *(
        Experiment(
            "conveyor-unfinished",
            "solved to the end it stays on the belt and does not turn; no drag does nothing",
            "default",
            "conveyor",
            metric,
            _SOLVED,
            params,
            dimension,
            idle=(_NO_DRAG,),
            dt=1.0 / 60.0,
        )
        for metric, params, dimension in (
            ("hop", {"mu": 0.1}, 2),
            ("turned", {"mu": 0.1}, 2),
            ("turned", dict[str, float](), 3),
            ("slip_speed", dict[str, float](), 3),
        )
    ),
    *(
        Experiment(
            "starved-few-sweeps",
            "with enough sweeps the row stays where it is; keeping more of earlier impulses does not do it",
            profile,
            "starved",
            metric,
            {"iterations": 1000},
            iterations=iterations,
            idle=({"warmStartingFactor": 0.95},),
        )
        for profile, iterations, metrics in (
            ("default", 1, ("displacement", "penetration", "kinetic_energy", "load_error")),
            ("tuned", 1, ("displacement", "penetration", "kinetic_energy", "load_error")),
            ("one", 4, ("displacement", "penetration", "kinetic_energy", "load_error")),
            ("one", None, ("penetration",)),
        )
        for metric in metrics
    ),
)
