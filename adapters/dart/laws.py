"""Designed deviations of DART from the textbook, predicted from scene and step only."""

from __future__ import annotations

from collections.abc import Mapping

from adapters.dart.landing import landing_law
from adapters.dart.meeting import meeting_law
from adapters.dart.profiles import PROFILES, PYRAMIDS, SWEEPERS, solved
from adapters.dart.pyramid import pyramid_law
from adapters.dart.rubbing import rubbing_law
from adapters.dart.shipped import MIXING, PUSH_OUT, Rebound
from adapters.dart.slipping import slipping_law
from adapters.law import Deviation, Law, Measure, Prediction, deviations, exactly
from adapters.law.single_precision import ROUNDINGS, Method, rounded_law
from adapters.law.unswept import passing_law, wall_law
from adapters.scene import Box, Scene
from adapters.scene.lift import lift

#: Metrics of blows in free space, by scene, which friction does not change.
BLOWS: Mapping[str, tuple[str, ...]] = {
    "impact": ("rebound_ratio", "rebound_speed", "velocity_change", "impulse", "momentum_defect"),
    "head_on": ("rebound_ratio", "first_speed", "second_speed", "impulse", "momentum_defect"),
    "off_centre": ("ball_speed", "bar_speed", "spin", "energy_lost", "impulse", "momentum_defect"),
    "flat_box": ("rebound_ratio", "impulse"),
    "stacked_balls": ("small_speed", "large_speed", "energy_lost"),
    "cradle": ("momentum_defect", "energy_defect", *(f"speed[{k}]" for k in range(1, 6))),
    "galperin": ("small_speed", "large_speed", "energy_defect"),
    "oblique": ("rebound_ratio",),
}


def _corners(scene: Scene) -> float:
    """Response of a corner over that of four together, if a box lands flat; 1 for balls.

    A corner yields by a share of its own response ``d = 1/m + l^2/I + ...``; four share the load, and together respond
    as ``1/m``: ``d m / 4``.
    """
    spatial = scene if scene.dimension == 3 else lift(scene)
    free = [body for body in spatial.bodies if body.motion == "free"]
    if len(free) != 1 or not isinstance(free[0].shape, Box):
        return 1.0
    (box,) = free
    assert isinstance(box.shape, Box) and isinstance(box.inertia, tuple)
    a, b, _ = box.shape.half_extents
    return (1.0 + box.mass * (b * b / box.inertia[0] + a * a / box.inertia[1])) / 4.0


_GIVES = "a contact yields by 1e-5 of its response to its load, and "
_REBOUNDS = "restitution includes gravity of the step, so a rebound is e g dt faster than that of the impact"
_AT_ONCE = _GIVES + "all blows of a step are solved together"
_PUSHED = _GIVES + "overlaps are corrected at up to 1 mm/s"
#: Bands of `meeting_law`, as a share and in the metric's unit. Of a fall: ten thousand roundings of numbers up to 10
#: (1e-11), times the growth of an error of a height in some bounces, 1/e <= 2 each. Of colliding balls: round-off of
#: some hundred steps, times the growth of an error in twenty blows across a gap of a thousandth of a radius. In a line:
#: corners with unequal loads add another compliance (measured 7e-6 at most).
_OF_A_FALL, _OF_BALLS, _IN_LINE = (0.0, 1e-9), (1e-8, 1e-8), (MIXING, 1e-9)
#: Scenes of bodies that collide, fall or lie on each other: the metrics determined by their motion, profiles, reason
#: and band. If Dantzig's pivoting finds no solution, a second solver with few sweeps replaces it, which no law here
#: predicts.
MEETING: tuple[tuple[str, tuple[str, ...], tuple[str, ...], str, tuple[float, float]], ...] = (
    ("cradle", ("energy_defect",), ("fbf",), _AT_ONCE, _OF_BALLS),
    ("rod_gas", ("energy_defect", "misplaced", "wrong_speed"), tuple(PROFILES), _AT_ONCE, _OF_BALLS),
    ("rack", ("energy_defect", "penetration"), tuple(PROFILES), _AT_ONCE, _OF_BALLS),
    (
        "bounce",
        (*(f"apex[{n}]" for n in range(1, 6)), "apex_interval_ratio", "apex_growth", "rest_time"),
        tuple(PROFILES),
        _REBOUNDS,
        _OF_A_FALL,
    ),
    ("scales", ("apex",), tuple(PROFILES), _REBOUNDS, _OF_A_FALL),
    ("cradle", ("energy_defect",), ("pgs", "nsgs"), _PUSHED, _IN_LINE),
    ("heavy_on_light", ("settle_time", "penetration", "kinetic_energy"), ("default",), _PUSHED, _IN_LINE),
    ("overlap", ("thrown",), tuple(PROFILES), _PUSHED, _IN_LINE),
)


#: Possible correction speeds of an overlap [m/s].
_PUSHES = (0.0, PUSH_OUT)


def blow_law(metric: str, profile: str) -> Law:
    """Blows in free space; without restitution an overlap is corrected, at a speed of up to 1 mm/s."""

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        rough = any(friction > 0.0 for _, friction in scene.materials())
        unit, mixing = solved(profile, rough) / ROUNDINGS, MIXING * _corners(scene)
        methods = (Method(Rebound(push, mixing), unit=unit) for push in _PUSHES)
        low, high = (rounded_law(metric, method)(scene, dt, measure) for method in methods)
        if low is None or high is None:
            return None
        return 0.5 * (low[0] + high[0]), 0.5 * abs(high[0] - low[0]) + low[1] + high[1]

    return law


DEVIATIONS: tuple[Deviation, ...] = tuple(
    Deviation(
        "dart",
        (profile,),
        scene,
        exactly(metric),
        blow_law(metric, profile),
        "a contact yields by 1e-5 of the speed that it changes; a rebound has 0.1 m/s to 100 m/s; overlaps are "
        "corrected at up to 1 mm/s",
        "ContactConstraint, constraint force mixing; motion in adapters/law/single_precision.py",
        ("6.20.",),
    )
    for profile in PROFILES
    for scene, metrics in BLOWS.items()
    # The corners of a box are several contacts, whose residual of sweeps exceeds the tolerance: `shared_law`.
    if scene != "flat_box" or profile not in SWEEPERS
    for metric in metrics
)


def shared_law(metric: str, profile: str) -> Law:
    """A blow shared by corners, solved by sweeps.

    The distribution of a load among corners depends on 1e-5 of it each, and sweeps end before resolving it: corners
    yield between 0 and twice as much, which is the band.
    """
    even = blow_law(metric, profile)
    stiff = rounded_law(metric, Method(Rebound(0.0, 0.0), unit=solved(profile, True) / ROUNDINGS))

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        found, bound = even(scene, dt, measure), stiff(scene, dt, measure)
        return None if found is None or bound is None else (found[0], found[1] + abs(found[0] - bound[0]))

    return law


DEVIATIONS += deviations(
    "dart",
    SWEEPERS,
    {"flat_box": BLOWS["flat_box"]},
    shared_law,
    "a contact yields by 1e-5 of its response, and the iterations do not determine how corners share a blow",
    "ContactConstraint, constraint force mixing; motion in adapters/law/single_precision.py",
    ("6.20.",),
)
DEVIATIONS += tuple(
    Deviation(
        "dart",
        profiles,
        scene,
        exactly(metric),
        meeting_law(metric, *band),
        because,
        "ContactConstraint, constraint force mixing, bouncing velocity, error reduction; recurrence in "
        "adapters/dart/meeting.py",
        ("6.20.",),
    )
    for scene, metrics, profiles, because, band in MEETING
    for metric in metrics
)
DEVIATIONS += deviations(
    "dart",
    PROFILES,
    {"kane": ("rise", "ahead", "spin", "gain")},
    rubbing_law,
    "the contact point lies half-way into the overlap, which makes the lever arm shorter; Dantzig's friction is "
    "limited by the load without friction",
    "FCLCollisionDetector, DantzigBoxedLcpSolver; blow in adapters/dart/rubbing.py",
    ("6.20.",),
)
DEVIATIONS += deviations(
    "dart",
    PROFILES,
    {"edge_drop": ("impulse", "rise", "spin")},
    landing_law,
    "a contact yields by 1e-5 of its response, corners that share a blow by more than a single one",
    "ContactConstraint, constraint force mixing; blow in adapters/dart/landing.py",
    ("6.20.",),
)
DEVIATIONS += deviations(
    "dart",
    PROFILES,
    {"oblique": ("forward_speed", "sideways", "spin_speed")},
    slipping_law,
    "a contact yields by 1e-5 of the speed that it changes, and so does friction; where the friction cone is a "
    "pyramid each axis of the floor has full friction",
    "ContactConstraint, constraint force mixing; blow in adapters/dart/slipping.py",
    ("6.20.",),
)
#: Scenes with slip over a floor along both of its axes, and the metrics determined by the motion.
SLIPPING: Mapping[str, tuple[str, ...]] = {
    "slide": ("astray", "braking", "stopping_distance", *(f"friction[{by}]" for by in ("mean", "least", "greatest"))),
    "slide_to_roll": ("astray", "rolling_place", "rolling_time"),
    "masse": ("end_x", "end_y", "turned"),
}
DEVIATIONS += tuple(
    Deviation(
        "dart",
        PYRAMIDS,
        scene,
        exactly(metric),
        pyramid_law(metric),
        "the friction cone is a pyramid: each axis of the floor has full friction, and slip between them is braked "
        "by up to sqrt(2) times Coulomb's friction",
        "a boxed LCP, DantzigBoxedLcpSolver and PgsBoxedLcpSolver; recurrence in adapters/dart/pyramid.py",
        ("6.20.",),
    )
    for scene, metrics in SLIPPING.items()
    for metric in metrics
)


def _wall_law(metric: str, profile: str) -> Law:
    passing = passing_law(metric)
    return wall_law(passing, blow_law(metric, profile)) if metric == "rebound_ratio" else passing


DEVIATIONS += deviations(
    "dart",
    PROFILES,
    {"thin_wall": ("rebound_ratio", "beyond")},
    _wall_law,
    "there is no swept collision detection: a body on one side of a thin body at the end of a step, and on the "
    "other at the end of the next, passes through; other blows yield by 1e-5",
    "measured with 6.20.0; motion in adapters/law/unswept.py and adapters/law/single_precision.py",
    ("6.20.",),
)
