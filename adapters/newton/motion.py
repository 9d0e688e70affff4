"""Bodies among fixed planes, step by step as in Newton's XPBD: the recurrence of its laws.

    v += dt g,  x += dt v;  then iterations, in each of which every contact with gap d < 0 has the corrections

        along the normal    l = r (-d)/(dt K)                     r the relaxation, K the inverse mass at the contact
        across it           min(r |slip|/(dt K'), mu l)           slip of its two points since the step began
        about the normal    min(r |w_n|/K'', mu_t l),  and against rolling  min(r |w_t|/K''', mu_r l)

    and a body gets their mean, in velocity and place; bodies slower than 0.1 mm/s are stopped.

Restitution comes last, for contacts found with an overlap: those with an approach speed above 2 g dt get e times that
speed, in 8 iterations over the contacts of a pair, twice, and a body gets the mean over its pairs. Contacts are found
at the start of the step, between corners and planes, two balls, or a ball and a box, if nearer than twice the gap, and
keep their normals.
[xpbd/kernels.py and restitution_kernels.py of newton 1.8.0]

None of this is Newton's own code: it evaluates its formulas for a scene, in double and single precision. The steps are
compiled loops (`recurrence`).

A law predicts the result in double precision plus the mean effect of round-off. Its band covers round-off, which is
sampled. A resting or sliding body moves by a fixed distance per step, which is rounded at its place: each step loses
the same fraction of a last digit, and a depth of 0.1 mm has three digits. Therefore the recurrence runs in double and
single precision with steps longer by some ten-thousandths, which lose another fraction; the difference of both at one
step length is one sample. The engine does the same operations in another order, which is one more sample of the same
kind. The mean of the samples is not 0 if round-off sustains a motion: a column that comes to rest in double precision
trembles in single precision, in every sample, and its loads are shifted to the same side. The distance of one more
sample from the mean of n, over their standard deviation and the root of 1 + 1/n, has a Student's t distribution with
n - 1 degrees of freedom, if samples are normal. A count of steps or output samples may be off by one in all of a few
samples and not in the next: a band is never less than their mean. The last operation of a step is no such sum: its
round-off is a unit in the last place, or none. Each number of a sample is therefore changed by a unit up or down, or
not at all, at random.

An effect of the engine's order of operations that is the same in every step is not sampled. The band contains a bound
of it: the change of the double-precision result if the two points of each contact are shifted apart by a share of their
place, along one axis after the other.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from adapters.law import AskedLaw, Law, Measure, Prediction
from adapters.law.single_precision import UNIT
from adapters.needs import needs
from adapters.newton.column import column_moved, column_of
from adapters.newton.profiles import PROFILES
from adapters.newton.roundings import LIMITS, ROUNDINGS, Roundings, roundings_of
from adapters.newton.shipped import INNER, LEAST_APPROACH, STOPPED
from adapters.newton.telling import told_contacts, told_trajectory
from adapters.scene import Body, Box, HalfSpace, Scene, Sphere
from adapters.scene.lift import lift
from adapters.scene.means import means
from adapters.stepping import step_count
from adapters.trajectory import Measured, Trajectory

#: Number of samples of round-off, and the band in units of their standard deviation: Student's t of 7 degrees of
#: freedom is beyond 7.88 once in 10 000 times, on either side; an eighth of the variance more for the mean, which is
#: sampled as well.
DRAWS, QUANTILE = 8, 7.88
#: Relative difference of the step lengths of two samples: a motion of 0.2 mm per step (g dt^2 at 1/240 s) at
#: a place of half a metre loses another fraction of 2^-24 m, by the golden ratio, for a uniform distribution.
LONGER = 1.618e-4
#: Width of a band, as a share of the value, above which there is no prediction.
VAGUE = 0.02
#: Largest number of bodies.
MOST_BODIES = 12

Numbers = np.ndarray[Any, np.dtype[Any]]


class _Layout:
    """Arrays of free balls and boxes among fixed ones and half-spaces, for `recurrence`, in one precision."""

    def __init__(
        self,
        scene: Scene,
        dt: float,
        chosen: Mapping[str, Any],
        kind: type[np.floating[Any]],
        blur: tuple[float, float, float],
    ) -> None:
        from adapters.newton.recurrence import Bodies, Candidates, Chosen, Touching

        self.kind, self.scene = kind, scene
        self.free = [k for k, body in enumerate(scene.bodies) if body.motion == "free"]
        rest = [k for k, body in enumerate(scene.bodies) if body.motion != "free"]
        self.planes = [k for k in rest if isinstance(scene.bodies[k].shape, HalfSpace)]
        #: Indices in the scene of all bodies but planes, free ones first.
        self.solid = self.free + [k for k in rest if k not in self.planes]

        def rows(of: Callable[[Body], Any], last: Any) -> Numbers:
            """One row for each free body, ``last`` for fixed ones."""
            free = [of(scene.bodies[k]) for k in self.free]
            return np.array([*free, *(last for _ in self.solid[len(free) :]), last], kind)

        still, many = (0.0,) * 3, len(self.solid) + 1
        blank = [np.zeros(shape, kind) for shape in ((many, 5), (many, 5), *((many, 3),) * 4, (many,))]
        self.bodies = Bodies(
            np.array([*(scene.bodies[k].pose[:3] for k in self.solid), still], kind),
            np.array([*(scene.bodies[k].pose[3:] for k in self.solid), (1.0, 0.0, 0.0, 0.0)], kind),
            rows(lambda body: body.twist[:3], still),
            rows(lambda body: body.twist[3:], still),
            rows(lambda body: 1.0 / body.mass, 0.0),
            rows(lambda body: tuple(np.broadcast_to(body.inertia, 3)), (1.0,) * 3),
            rows(lambda body: tuple(1.0 / np.broadcast_to(body.inertia, 3)), still),
            rows(lambda body: body.force, still),
            rows(lambda body: body.torque, still),
            *blank,
        )
        may = list(self._candidates())
        #: The two bodies of each pair with recorded impulses, as indices in the scene.
        self.pairs = sorted({between for between, *_ in may})
        first_fixed = len(self.free)
        bodies = sorted({(min(a, first_fixed), min(b, first_fixed)) for _, a, b, *_ in may})
        parts = list(zip(*may, strict=True)) if may else [()] * 9
        shapes = ((0, 2), (0,), (0,), (0, 3), (0, 3), (0,), (0, 2), (0,), (0,))
        _, first, second, *given = [
            np.array(part) if may else np.zeros(shape) for part, shape in zip(parts, shapes, strict=True)
        ]
        which = np.array([bodies.index((min(a, first_fixed), min(b, first_fixed))) for _, a, b, *_ in may], np.int64)
        told = np.array([self.pairs.index(between) for between, *_ in may], np.int64)
        self.may = Candidates(
            first.astype(np.int64), second.astype(np.int64), which, told, *(part.astype(kind) for part in given)
        )
        most = max(len(may), 1)
        self.touching = Touching(
            np.zeros(most, np.int64), np.zeros((most, 3), kind), np.zeros((most, 2, 3), kind),
            np.zeros((most, 2, 3), kind), np.zeros(most, np.int64), np.zeros((most, 3), kind), np.zeros(most, kind),
            np.zeros(most, kind), np.zeros(most, kind),
        )  # fmt: skip
        self.room = (
            np.zeros((most, 2, 3), kind), np.zeros((most, 2, 3), kind), np.zeros(most, kind), np.zeros((2, 2, 3), kind),
            np.zeros((many, 2, 3), kind), np.zeros(many, kind),
        )  # fmt: skip
        pull = kind(np.linalg.norm(scene.gravity))

        def numbers(*values: float) -> Numbers:
            return np.array(values, kind)

        self.chosen = Chosen(
            numbers(dt), numbers(*scene.gravity), numbers(chosen["relaxation"]),
            numbers(chosen["torsional"], chosen["rolling"]), numbers(2.0 * chosen["gap"]), numbers(STOPPED * STOPPED),
            numbers(float(kind(LEAST_APPROACH) * pull * kind(dt))), numbers(*blur), numbers(0.0, 0.5, 1.0, 2.0),
            chosen["iterations"], int(chosen["weighted"]), int(chosen["rebounds"]), chosen["rebound_iterations"], INNER,
            len(self.free),
        )  # fmt: skip

    def _candidates(self) -> Any:
        """Rows of `recurrence.Candidates`, with the two bodies in place of the indices of pairs."""
        world, still = len(self.solid), (0.0,) * 3
        for i, k in enumerate(self.free):
            body = self.scene.bodies[k]
            radius = body.shape.radius if isinstance(body.shape, Sphere) else 0.0
            for j in self.planes:
                plane = self.scene.bodies[j]
                assert isinstance(plane.shape, HalfSpace)
                pair = self.scene.material(body.name, plane.name)
                normal, offset = held_plane(plane.shape)
                for corner in _corners(body):
                    yield (j, k), world, i, corner, normal, offset, (0.0, radius), pair.friction, pair.restitution
        for i, k in enumerate(self.solid):
            body = self.scene.bodies[k]
            for i2, k2 in enumerate(self.solid):
                other = self.scene.bodies[k2]
                # Each pair once, and a ball second; fixed bodies touch free ones only.
                if not isinstance(body.shape, Sphere) or min(i, i2) >= len(self.free) or i == i2:
                    continue
                size, thick = still, 0.0
                if isinstance(other.shape, Box):
                    x, y, z = other.shape.half_extents
                    size = (x, y, z)
                elif isinstance(other.shape, Sphere) and i2 < i:
                    thick = other.shape.radius
                else:
                    continue
                pair, radii = self.scene.material(body.name, other.name), (thick, body.shape.radius)
                yield (k2, k), i2, i, size, still, 0.0, radii, pair.friction, pair.restitution


def held_plane(plane: HalfSpace) -> tuple[tuple[float, ...], float]:
    """Normal and offset [m] of a 3-D half-space in Newton.

    It stores a plane as a rotation of the z axis, the quaternion (z x n, 1 + z . n) normalised in single precision, and
    rotates that axis by it again: a wall along x is tilted by one rounding, 2^-24 rad. Balls that collide in a line
    leave the line by that. [ModelBuilder.add_shape_plane; warp, quat_between_vectors and quat_rotate]
    """
    given = np.array(plane.normal, float) / np.linalg.norm(plane.normal)
    x, y, z = given.astype(np.float32)
    size = np.sqrt(x * x + y * y + z * z)
    a, b, w = -y / size, x / size, np.float32(1.0) + z / size
    inverse = np.float32(1.0) / np.sqrt(a * a + b * b + w * w)
    a, b, w = a * inverse, b * inverse, w * inverse
    normal = tuple(float(each) for each in (b * (w + w), -a * (w + w), w * (w + w) - np.float32(1.0)))
    return normal, float(np.float32(plane.offset * given) @ np.array(normal))


def _corners(body: Body) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Corners of a box in its axes [m]; a ball's centre."""
    if isinstance(body.shape, Box):
        return np.array(list(product(*((-half, half) for half in body.shape.half_extents))))
    return np.zeros((1, 3))


def followed(scene: Scene) -> bool:
    """Whether the recurrence covers a 3-D scene: free balls, at most one free box, and fixed half-spaces.

    Balls may be fixed as well; so may boxes, if no box is free.
    """
    free = [body for body in scene.bodies if body.motion == "free"]
    rest = [body for body in scene.bodies if body.motion != "free"]
    boxes = sum(isinstance(body.shape, Box) for body in free)
    known = boxes <= 1 and all(isinstance(body.shape, Sphere | Box) for body in free)
    allowed = HalfSpace | Sphere if boxes else HalfSpace | Sphere | Box
    still = all(
        body.motion == "fixed" and isinstance(body.shape, allowed) and not any(body.surface_velocity)
        for body in rest
    )  # fmt: skip
    told = means(scene, "restitution") is not None and means(scene, "friction") is not None
    return 0 < len(free) <= MOST_BODIES and known and still and told


def _moved(
    scene: Scene,
    dt: float,
    chosen: Mapping[str, Any],
    single: bool,
    longer: float,
    blur: tuple[float, float, float],
) -> Trajectory:
    """The motion of a scene that is `followed`."""
    from adapters.newton.recurrence import Told, run

    spatial = scene if scene.dimension == 3 else lift(scene)
    kind = np.float32 if single else np.float64
    steps, layout = step_count(scene.duration, dt), _Layout(spatial, dt * (1.0 + longer), chosen, kind, blur)
    many, pairs = len(layout.free), len(layout.pairs)
    told = Told(
        np.zeros((steps, many, 7), kind), np.zeros((steps, many, 6), kind), np.zeros((steps, pairs, 3), kind),
        np.zeros((steps, pairs), np.int8),
    )  # fmt: skip
    run(layout.bodies, layout.may, layout.touching, layout.chosen, told, *layout.room)
    flat = scene.dimension == 2
    # Unknown with restitution.
    impulse = told.impulse * (np.nan if chosen["rebounds"] else 1.0)
    record = told_contacts(told.pressed, np.array(layout.pairs, np.int64), impulse, flat)
    return told_trajectory(spatial, layout.free, told.pose, told.twist, record, dt, flat)


def moved(
    scene: Scene,
    dt: float,
    profile: str,
    single: bool = False,
    longer: float = 0.0,
    blur: tuple[float, float, float] = (0.0, 0.0, 0.0),
    iterations: int | None = None,
) -> Trajectory | None:
    """The motion of a scene, every step, in doubles or singles; None if it is neither `followed` nor a column.

    ``longer``: relative change of the step length, with the same settings; reported times do not contain it.
    ``blur``: shift between the two points of a contact as a share of their place, along three axes.
    ``iterations``: iterations, in place of the profile's.
    """
    spatial = scene if scene.dimension == 3 else lift(scene)
    chosen = settings_of(scene, dt, profile, iterations)
    if followed(spatial):
        return _moved(scene, dt, chosen, single, longer, blur)
    column = column_of(spatial)
    if column is None:
        return None
    steps, flat = step_count(scene.duration, dt), scene.dimension == 2
    return column_moved(spatial, column, steps, dt, longer, chosen, single, blur, flat)


def settings_of(scene: Scene, dt: float, profile: str, iterations: int | None) -> dict[str, Any]:
    """Settings of a profile, with the given iterations."""
    chosen = {setting.name: setting.value for setting in PROFILES[profile](needs(scene), dt)}
    return chosen if iterations is None else chosen | {"iterations": iterations}


class _Asked:
    """A scene and its metrics, as an argument of a cached function: scenes contain a table and have no hash."""

    def __init__(self, scene: Scene, measure: Measure) -> None:
        self.scene, self.measure, self.told = scene, measure, (repr(scene), measure)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Asked) and self.told == other.told

    def __hash__(self) -> int:
        return hash(self.told)


class _Said(NamedTuple):
    """Value of each metric, its band from round-off, and the number of roundings."""

    table: Mapping[str, tuple[float, float]]
    counted: Roundings | None


@lru_cache(maxsize=4096)  # tables of some twenty numbers: more cells than any suite has for one engine
def _readings(asked: _Asked, dt: float, profile: str, iterations: int | None = None) -> _Said:
    """Each metric of a scene by the recurrence."""
    scene = asked.scene
    values: Mapping[str, Measured] = {}
    counted: Roundings | None = None
    missed: dict[str, list[float]] = {}
    chance = np.random.default_rng(0)
    for draw in range(DRAWS):
        exact, rounded = (
            moved(scene, dt, profile, single, draw * LONGER, iterations=iterations) for single in (False, True)
        )
        if exact is None or rounded is None:
            return _Said({}, None)
        if not draw:
            spatial = scene if scene.dimension == 3 else lift(scene)
            counted = roundings_of(spatial, exact, dt, settings_of(scene, dt, profile, iterations))
        found, other = asked.measure(scene, exact), asked.measure(scene, _told_otherwise(rounded, scene, chance))
        values = values or found
        for metric, (value, _) in found.items():
            told = other[metric][0]
            missed.setdefault(metric, []).append(math.inf if value is None or told is None else told - value)
    mean = {metric: float(np.mean(each)) for metric, each in missed.items()}
    bands = {metric: _band(each) for metric, each in missed.items()}
    share = ROUNDINGS * UNIT
    for blur in ((share, 0.0, 0.0), (0.0, share, 0.0), (0.0, 0.0, share)):
        blurred = moved(scene, dt, profile, blur=blur, iterations=iterations)
        found = asked.measure(scene, blurred) if blurred else {}
        for metric, (value, _) in values.items():
            told = found[metric][0] if metric in found else None
            bands[metric] += math.inf if value is None or told is None else abs(value - told)
    table = {
        metric: (value + mean[metric], bands[metric]) for metric, (value, _) in values.items() if value is not None
    }
    return _Said(table, counted)


def _band(missed: list[float]) -> float:
    """Band about the mean of samples: for one more of them, and for a counted unit."""
    if not np.isfinite(missed).all():
        return math.inf
    scatter = float(np.std(missed, ddof=1)) * math.sqrt(1.0 + 1.0 / len(missed))
    return max(QUANTILE * scatter, abs(float(np.mean(missed))))


def _told_otherwise(motion: Trajectory, scene: Scene, chance: np.random.Generator) -> Trajectory:
    """A motion in single precision with each number changed by a unit in the last place up or down, or not at all."""
    free = np.array([body.motion == "free" for body in scene.bodies])[None, :, None]

    def other(numbers: Numbers) -> Numbers:
        return numbers + chance.integers(-1, 2, numbers.shape) * np.spacing(np.abs(numbers).astype(np.float32))

    record = motion.contacts and replace(
        motion.contacts, rows=replace(motion.contacts.rows, impulse=other(motion.contacts.rows.impulse))
    )
    pose, twist = (np.where(free, other(part), part) for part in (motion.pose, motion.twist))
    # The start is the scene's.
    pose[0], twist[0] = motion.pose[0], motion.twist[0]
    return replace(motion, pose=pose, twist=twist, contacts=record)


def _predicted(
    scene: Scene, dt: float, measure: Measure, metric: str, profile: str, iterations: int | None, balance: bool
) -> Prediction | None:
    table, counted = _readings(_Asked(scene, measure), dt, profile, iterations)
    value, band = table.get(metric, (0.0, math.inf))
    band = max(band, QUANTILE * UNIT * abs(value))  # each reported number is rounded at least once
    most = max(VAGUE * abs(value), LIMITS[metric](counted) if balance and counted else 0.0)
    return (value, band) if 0.0 < band <= most else None


def motion_law(metric: str, profile: str, balance: bool = False) -> Law:
    """``metric`` by the recurrence; no prediction if single precision has too large an effect.

    ``balance``: the whole value may be round-off, up to the bound of `roundings`.
    """

    def law(scene: Scene, dt: float, measure: Measure) -> Prediction | None:
        return _predicted(scene, dt, measure, metric, profile, None, balance)

    return law


def swept_law(metric: str, profile: str, balance: bool = False) -> AskedLaw:
    """As `motion_law`, with another number of iterations."""

    def law(scene: Scene, dt: float, measure: Measure, iterations: int) -> Prediction | None:
        return _predicted(scene, dt, measure, metric, profile, iterations, balance)

    return law
