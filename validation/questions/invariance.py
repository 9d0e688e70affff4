"""Metamorphic tests: order, place, heading and distant bodies must not change a result. For every scene and engine.

    scene --map--> the same physics, posed otherwise --run--> trajectory --back--> measured like the scene itself

Bodies renumbered, world turned about the vertical or mirrored, moved far away or in uniform motion, a distant body
added, the same again in the same process and in a new one. The largest change of each metric is compared with ten times
the largest change from starts moved and turned by 1 to 16 units in the last place, and with a thousandth of the check's
tolerance: the growth of round-off in a chaotic scene is no fault of the engine, and smaller changes do not matter.
Where the map itself rounds more (far away), the moved starts are rounded in the same way.

A map that only swaps numbers and signs does not round: an engine that does not depend on it scatters equally in both
poses, and a larger scatter in the other pose is itself a break. Where the map or each step rounds differently (a
rotation, whose 3-D attitudes are no swaps even at a right angle; a velocity; a place far away), the scatter of the
other pose counts too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from adapters.engine import Array, Contacts
from adapters.isolation.foreign import checked_refusal, said_by
from adapters.registry import load
from adapters.scene import Body, HalfSpace, Hull, Pair, Polygon, Scene, Shape
from adapters.scene.drives import turns
from adapters.scene.shapes import reach
from adapters.stepping import posed_for, run
from adapters.trajectory import ContactRecord, Measured, Trajectory
from validation.canonical import CanonicalScene
from validation.cells import Slot, numbers_of, settings_of
from validation.metrics import UNTOLD
from validation.posed import resolve
from validation.running.apart import Apart

#: Units in the last place by which starts are moved, up and down.
MOVES = (1, 2, 4, 8, 16)
#: Allowed change by a map, in units of the largest change from moved starts.
FACTOR = 10.0
#: Allowed change where moved starts change nothing: last digits of the value, or of the numbers of which it is a small
#: difference (`scales`), in units of the engine's precision.
LAST_DIGITS = 64.0
#: Share of a check's tolerance below which a change does not count: a defect of exactly 0 has no last digits.
INVISIBLE = 1e-3
#: Distance by which a scene is moved, in its sizes.
FAR = 1e3

Metrics = Mapping[str, Measured]


class Refusal(str):
    """Why an engine refuses a scene, which is no failure."""


@dataclass(frozen=True)
class Posed:
    """A mapped scene, and the inverse map of results; ``shift`` is the largest coordinate that the map added [m]."""

    scene: Scene
    back: Callable[[Trajectory], Trajectory]
    shift: float = 0.0


@dataclass(frozen=True)
class Relation:
    """One metamorphic relation; ``pose`` gives the mapped scene, or why there is none.

    ``rounds``: the map, or each step of the mapped scene, rounds differently from the scene itself.
    """

    name: str
    says: str
    pose: Callable[[Scene], Posed | str]
    fresh: bool = False
    rounds: bool = False


@dataclass(frozen=True)
class Change:
    """Effect of a relation in one cell.

    Parameters
    ----------
    metric, change, allowed
        The metric with the largest change over its allowed one; empty where nothing could be compared.
    refused
        Why the relation does not apply, or the engine's reason for having no result.
    lost
        Whether the engine runs the scene but fails on the mapped one, which is a change too. A refusal, or a force that
        it does not report there, is none.
    """

    relation: str
    metric: str = ""
    change: float = 0.0
    allowed: float = 0.0
    refused: str = ""
    lost: bool = False

    @property
    def holds(self) -> bool:
        """Whether no change exceeds the allowed one."""
        return not self.lost and self.change <= self.allowed


# ---- maps ------------------------------------------------------------------------------------------------------------


def size_of(scene: Scene) -> float:
    """Largest extent of moving bodies, places and sizes [m]."""
    free = [body for body in scene.bodies if body.motion == "free"]
    d = scene.dimension
    places = np.array([body.pose[:d] for body in free])
    return float(np.ptp(places, axis=0).max() + 2.0 * max(reach(body.shape) for body in free))


def itself(scene: Scene) -> Posed | str:
    """The unchanged scene: a difference shows state kept by the engine or its process."""
    return Posed(scene, lambda found: found)


def renumbered(scene: Scene) -> Posed | str:
    """The bodies in the opposite order."""
    last = len(scene.bodies) - 1

    def back(found: Trajectory) -> Trajectory:
        def contacts(rows: Contacts) -> Contacts:
            # A contact acts on the body with the higher index: it is the other one now.
            return Contacts(last - rows.b, last - rows.a, rows.point, -rows.normal, -rows.impulse, rows.gap)

        return _mapped(found, lambda pose: pose[:, ::-1], lambda twist: twist[:, ::-1], contacts)

    return Posed(replace(scene, bodies=scene.bodies[::-1]), back)


def turned(degrees: float) -> Callable[[Scene], Posed | str]:
    """The world turned about the vertical."""

    def pose(scene: Scene) -> Posed | str:
        if scene.dimension == 2:
            return "a 2-D scene has no vertical axis to turn about"
        matrix, half = _about_z(math.radians(degrees)), math.radians(0.5 * degrees)
        spin = np.array([math.cos(half), 0.0, 0.0, math.sin(half)])
        moved = _posed(scene, lambda x: matrix @ x, lambda q: _product(spin, q), lambda w: matrix @ w)
        if np.abs(matrix @ np.array(scene.gravity) - np.array(scene.gravity)).max() > 0.0:
            moved = replace(moved, gravity=_plain(matrix @ np.array(scene.gravity)))
        away = spin * np.array([1.0, -1.0, -1.0, -1.0])
        return Posed(moved, lambda found: _returned(found, matrix.T, lambda q: _product(away, q), matrix.T))

    return pose


def mirrored(scene: Scene) -> Posed | str:
    """Left and right swapped."""
    d = scene.dimension
    flip = np.diag([-1.0, *[1.0] * (d - 1)])
    # Spins are axial vectors: a mirror in x keeps the component about x.
    spins = -np.ones(1) if d == 2 else np.array([1.0, -1.0, -1.0])
    quaternion = np.array([1.0, 1.0, -1.0, -1.0])

    def attitude(q: Array) -> Array:
        return np.asarray(q * (spins if d == 2 else quaternion))

    moved = _posed(scene, lambda x: flip @ x, attitude, lambda w: spins * w)
    moved = replace(moved, bodies=tuple(replace(body, shape=_mirrored(body.shape)) for body in moved.bodies))
    moved = replace(moved, gravity=_plain(flip @ np.array(scene.gravity)))
    return Posed(moved, lambda found: _returned(found, flip, attitude, np.diag(spins)))


def _mirrored(shape: Shape) -> Shape:
    """The shape with left and right of its body swapped; corners stay counter-clockwise."""
    if isinstance(shape, Polygon):
        return Polygon(tuple((-x, y) for x, y in reversed(shape.vertices)))
    return Hull(tuple((-x, y, z) for x, y, z in shape.vertices)) if isinstance(shape, Hull) else shape


def moved_away(scene: Scene) -> Posed | str:
    """A thousand of its sizes to the side."""
    if any(map(turns, scene.bodies)):
        return "a half-space that turns about the origin cannot be moved"
    shift = np.zeros(scene.dimension)
    shift[0] = FAR * size_of(scene)

    def back(found: Trajectory) -> Trajectory:
        def pose(values: Array) -> Array:
            values = values.copy()
            values[..., : scene.dimension] -= shift
            return values

        def contacts(rows: Contacts) -> Contacts:
            return replace(rows, point=rows.point - shift)

        return _mapped(found, pose, lambda twist: twist, contacts)

    bodies = []
    for body in scene.bodies:
        if isinstance(body.shape, HalfSpace):
            offset = body.shape.offset + float(np.dot(body.shape.normal, shift))
            bodies.append(replace(body, shape=HalfSpace(body.shape.normal, offset)))
        else:
            place = np.array(body.pose[: scene.dimension]) + shift
            bodies.append(replace(body, pose=(*_plain(place), *body.pose[scene.dimension :])))
    return Posed(replace(scene, bodies=tuple(bodies)), back, float(shift[0]))


def boosted(scene: Scene) -> Posed | str:
    """In uniform motion: one of its sizes a second."""
    if any(body.motion != "free" for body in scene.bodies):
        return "it has fixed or driven bodies, which would be left behind"
    d = scene.dimension
    speed = np.zeros(d)
    speed[0] = size_of(scene)
    bodies = tuple(
        replace(body, twist=(*_plain(np.array(body.twist[:d]) + speed), *body.twist[d:])) for body in scene.bodies
    )

    def back(found: Trajectory) -> Trajectory:
        pose, twist = found.pose.copy(), found.twist.copy()
        pose[..., :d] -= found.t[:, None, None] * speed
        twist[..., :d] -= speed
        contacts = found.contacts
        if contacts is not None:
            times = np.repeat(found.t[contacts.step], np.diff(contacts.offset))
            contacts = replace(
                contacts, rows=replace(contacts.rows, point=contacts.rows.point - times[:, None] * speed)
            )
        return replace(found, pose=pose, twist=twist, contacts=contacts)

    return Posed(replace(scene, bodies=bodies), back, float(speed[0]) * scene.duration)


def with_a_bystander(scene: Scene) -> Posed | str:
    """One more body, like the first free one, so far away that it never touches anything."""
    free = next(body for body in scene.bodies if body.motion == "free")
    d, name = scene.dimension, "bystander"
    # As high as it falls in twice the time, and beyond all half-spaces: it only flies.
    fall = 2.0 * math.hypot(*scene.gravity) * scene.duration**2
    up = -np.array(scene.gravity) / (math.hypot(*scene.gravity) or 1.0)
    normals = [np.array(body.shape.normal) for body in scene.bodies if isinstance(body.shape, HalfSpace)]
    away = _away(normals, d)
    if away is None:
        return "its walls leave no place out of reach"
    place = np.array(free.pose[:d]) + up * fall + 50.0 * size_of(scene) * away
    far = Body(name, free.shape, free.mass, free.inertia, (*_plain(place), *free.pose[d:]))
    pairs = (*scene.pairs, Pair(name, "*", 0.0, 0.0))

    def back(found: Trajectory) -> Trajectory:
        return _mapped(found, lambda pose: pose[:, :-1], lambda twist: twist[:, :-1], lambda rows: rows)

    return Posed(replace(scene, bodies=(*scene.bodies, far), pairs=pairs), back)


def _away(normals: Sequence[Array], dimension: int) -> Array | None:
    """A direction that leads into no half-space, (d,): away from all, or along those that face each other."""
    upright = np.eye(dimension)[-1]
    away: Array = np.sum(normals, axis=0) if normals else upright
    if np.linalg.norm(away) < 1e-9:
        away = max((axis - (axis @ normals[0]) * normals[0] for axis in np.eye(dimension)), key=np.linalg.norm)
        away = away / np.linalg.norm(away)
    return away if all(normal @ away > -1e-9 for normal in normals) else None


RELATIONS = (
    Relation("again", "run again in the same process", itself),
    Relation("fresh process", "run in a new process", itself, fresh=True),
    Relation("renumbered", "bodies in the opposite order", renumbered),
    Relation("turned 33", "world turned by 33 degrees about the vertical", turned(33.0), rounds=True),
    Relation("turned 90", "world turned by 90 degrees about the vertical", turned(90.0), rounds=True),
    Relation("mirrored", "left and right swapped", mirrored),
    Relation("boosted", "everything in a frame that moves by one size a second", boosted, rounds=True),
    Relation("moved", "a thousand of its sizes to the side", moved_away, rounds=True),
    Relation("bystander", "one more body, out of reach", with_a_bystander),
)


def _plain(values: Array) -> tuple[float, ...]:
    return tuple(float(value) + 0.0 for value in values)


def _about_z(angle: float) -> Array:
    quarter = round(angle / (0.5 * math.pi))
    if math.isclose(angle, quarter * 0.5 * math.pi):  # a quarter turn does not round
        c, s = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[quarter % 4]
    else:
        c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _product(p: Array, q: Array) -> Array:
    """Product of quaternions w, x, y, z: the rotation of the second, then of the first."""
    w, v, u, r = p[..., :1], p[..., 1:], q[..., :1], q[..., 1:]
    return np.concatenate([w * u - (v * r).sum(-1, keepdims=True), w * r + u * v + np.cross(v, r)], axis=-1)


def _posed(
    scene: Scene, place: Callable[[Array], Array], attitude: Callable[[Array], Array], spin: Callable[[Array], Array]
) -> Scene:
    """The scene with vectors, attitudes and spins mapped."""
    d, bodies = scene.dimension, []
    for body in scene.bodies:
        pose, twist, shape = np.array(body.pose), np.array(body.twist), body.shape
        if isinstance(shape, HalfSpace):
            face = HalfSpace(_plain(place(np.array(shape.normal))), shape.offset)
            twist = np.concatenate([place(twist[:d]), spin(twist[d:])])
            bodies.append(replace(_driven(body, place), shape=face, twist=_plain(twist)))
            continue
        bodies.append(
            replace(
                _driven(body, place),
                pose=(*_plain(place(pose[:d])), *_plain(attitude(pose[d:]))),
                twist=(*_plain(place(twist[:d])), *_plain(spin(twist[d:]))),
                force=_plain(place(np.array(body.force))),
                torque=_plain(spin(np.array(body.torque))),
            )
        )
    return replace(scene, bodies=tuple(bodies))


def _driven(body: Body, place: Callable[[Array], Array]) -> Body:
    """The body with its surface's velocity and its course mapped."""
    course = body.course and replace(body.course, amplitude=_plain(place(np.array(body.course.amplitude))))
    return replace(body, surface_velocity=_plain(place(np.array(body.surface_velocity))), course=course)


def _returned(found: Trajectory, matrix: Array, attitude: Callable[[Array], Array], spins: Array) -> Trajectory:
    """A trajectory with vectors, attitudes and spins mapped back."""
    d = found.dimension

    def pose(values: Array) -> Array:
        return np.concatenate([values[..., :d] @ matrix.T, attitude(values[..., d:])], axis=-1)

    def twist(values: Array) -> Array:
        return np.concatenate([values[..., :d] @ matrix.T, values[..., d:] @ spins.T], axis=-1)

    def contacts(rows: Contacts) -> Contacts:
        vectors = {name: getattr(rows, name) @ matrix.T for name in ("point", "normal", "impulse")}
        return replace(rows, **vectors)

    return _mapped(found, pose, twist, contacts)


def _mapped(
    found: Trajectory,
    pose: Callable[[Array], Array],
    twist: Callable[[Array], Array],
    rows: Callable[[Contacts], Contacts],
) -> Trajectory:
    contacts = found.contacts
    if contacts is not None:
        contacts = ContactRecord(contacts.step, contacts.offset, rows(contacts.rows))
    return replace(found, pose=pose(found.pose), twist=twist(found.twist), contacts=contacts)


# ---- runs ------------------------------------------------------------------------------------------------------------


def measured(slot: Slot, relation: str, moves: float = 0.0, turns: float = 0.0) -> Metrics | str:
    """Metrics of a cell mapped by ``relation``, or why there are none; runs in this process.

    Free bodies are moved by ``moves`` [m] along all axes, alternately up and down, and turned by ``turns`` [rad] about
    all axes.
    """
    canonical = resolve(slot.scene)
    scene = canonical.scene(slot.dimension, dict(slot.params))
    (asked,) = [each for each in RELATIONS if each.name == relation]
    posed = asked.pose(scene)
    if isinstance(posed, str):
        return posed
    try:
        engine = load(slot.engine)
        refusal = checked_refusal(engine.refusal(posed_for(engine, posed.scene), slot.base, slot.dt))
        if refusal:
            return Refusal(refusal)
        # The settings are those of the unmapped scene: the test is of the engine, not of the profile's choice of
        # settings.
        settings = {setting.name: setting.value for setting in settings_of(engine, slot, scene)}
        found = run(engine, _nudged(posed.scene, moves, turns), slot.dt, settings, canonical.sampling(scene))
        if found.finish == "diverged":
            return found.reason
        return dict(canonical.measure(scene, posed.back(found)))
    except BaseException as error:  # whatever an engine raises costs this question only
        return said_by(error)


def _nudged(scene: Scene, by: float, turn: float = 0.0) -> Scene:
    """Every free body moved along and turned about all axes, in the direction opposite to the one before.

    That changes all distances, and which corner of a body is the lowest.
    """
    if by == 0.0 and turn == 0.0:
        return scene
    d, bodies, sign = scene.dimension, [], 1.0
    for body in scene.bodies:
        if body.motion == "free":
            place, attitude = np.array(body.pose[:d]) + sign * by, np.array(body.pose[d:])
            if d == 2:
                attitude = attitude + sign * turn
            elif turn:
                attitude = _product(np.array([1.0, *[0.5 * sign * turn] * 3]), attitude)
            body, sign = replace(body, pose=(*_plain(place), *_plain(attitude))), -sign
        bodies.append(body)
    return replace(scene, bodies=tuple(bodies))


def unit_of(scene: Scene, shift: float, numbers: type[np.floating[Any]] = np.float64) -> float:
    """Unit in the last place of the scene's largest coordinate, also after a map [m].

    ``numbers`` is the engine's precision: smaller moves would not change the start of a single-precision engine.
    """
    places = [abs(x) for body in scene.bodies for x in body.pose[: scene.dimension]]
    return float(np.spacing(numbers(max([shift, size_of(scene), *places]))))


def compare(slot: Slot, relations: Sequence[str] = ()) -> list[Change]:
    """All relations of one cell, in separate processes: an engine that aborts loses one result."""
    wanted = [each for each in RELATIONS if not relations or each.name in relations]
    with Apart() as apart:
        return _changes(slot, wanted, apart)


def _changes(slot: Slot, wanted: Sequence[Relation], apart: Apart) -> list[Change]:
    canonical = resolve(slot.scene)
    scene = canonical.scene(slot.dimension, dict(slot.params))
    tolerances = {check.metric: check.bound for check in canonical.checks(scene, slot.dt) if check.bound}
    sizes, numbers = scales(canonical, scene, slot.dt), numbers_of(slot.engine)
    base = apart.ask(measured, slot, "again")
    if isinstance(base, str):
        return [Change(each.name, refused=base) for each in wanted]

    def scatter(start: Metrics, relation: str, unit: float, turn: float = 0.0) -> Mapping[str, float]:
        steps = [sign * k for k in MOVES for sign in (1, -1)]
        return floor(start, [apart.ask(measured, slot, relation, k * unit, k * turn) for k in steps])

    moved: dict[float, Mapping[str, float]] = {}
    turned: dict[float, Mapping[str, float]] = {}
    found = []
    for relation in wanted:
        posed = relation.pose(scene)
        if isinstance(posed, str):
            found.append(Change(relation.name, refused=posed))
            continue
        unit, finest = unit_of(scene, posed.shift, numbers), unit_of(scene, 0.0, numbers)
        if unit not in moved:
            moved[unit] = scatter(base, "again", unit)
        answer = apart.ask(measured, slot, relation.name, fresh=relation.fresh)
        allowances = Allowances(moved[unit], tolerances, sizes, unit / finest, float(np.finfo(numbers).eps))
        change = judged(relation.name, base, answer, allowances)
        # Moved starts run first; a few are enough where more scatter cannot change the verdict.
        if not change.holds and not isinstance(answer, str):
            if unit not in turned:
                turned[unit] = scatter(base, "again", 0.0, unit / size_of(scene))
            allowances = allowances.wider(turned[unit])
            change = judged(relation.name, base, answer, allowances)
            if relation.rounds and not change.holds:
                change = judged(relation.name, base, answer, allowances.wider(scatter(answer, relation.name, unit)))
        found.append(change)
    return found


def scales(canonical: CanonicalScene, scene: Scene, dt: float) -> dict[str, float]:
    """Sizes of the numbers of which each metric is a small difference, in its unit: from the scene's size and speeds.

    A defect of 0, or a position at the origin, has no last digits itself, but the lengths, speeds and times from which
    it is computed have. Units are those of the scene's checks in any cell.
    """
    d = scene.dimension
    free = [body for body in scene.bodies if body.motion == "free"]
    length, gravity = size_of(scene), math.hypot(*scene.gravity)
    # Where nothing moves, the speed of a fall through the scene's size.
    speed = max(math.sqrt(gravity * length), *(math.hypot(*body.twist[:d]) for body in scene.bodies), 0.0)
    mass = max(body.mass for body in free)
    by_unit = {
        "1": 1.0, "weights": 1.0, "rad": 1.0, "m": length, "m/s": speed, "m/s^2": max(gravity, speed**2 / length),
        "rad/s": speed / length, "s": scene.duration, "N s": mass * speed, "J": mass * speed**2,
    }  # fmt: skip
    cells = [dict(each.params) for each in (*canonical.variations("standard"), *canonical.full)]
    found: dict[str, float] = {}
    for params in (dict(scene.params), *cells):
        for check in canonical.checks(canonical.scene(d, params), dt):
            found.setdefault(check.metric, by_unit.get(check.unit, 0.0))
    return found


def floor(base: Metrics, moved: Sequence[Metrics | str]) -> dict[str, float]:
    """Largest change of each metric from moved starts; infinite where a moved start has no value."""
    changes = dict.fromkeys(base, 0.0)
    for found in moved:
        for name, (value, _) in base.items():
            other = None if isinstance(found, str) else found.get(name, (None, ""))[0]
            if value is not None:
                changes[name] = max(changes[name], math.inf if other is None else abs(other - value))
    return changes


@dataclass(frozen=True)
class Allowances:
    """Allowed changes of metrics.

    Parameters
    ----------
    floors
        Largest change of each metric from moved starts.
    tolerances
        Tolerances of the checks, where there are any.
    sizes
        Sizes of the numbers behind each metric (`scales`).
    coarser
        Factor by which the map rounds positions more: a lever arm is a difference of positions and has fewer digits
        where they are large, which moved starts do not show.
    last
        Unit in the last place of one, in the engine's numbers.
    """

    floors: Mapping[str, float]
    tolerances: Mapping[str, float] = field(default_factory=dict)
    sizes: Mapping[str, float] = field(default_factory=dict)
    coarser: float = 1.0
    last: float = float(np.finfo(float).eps)

    def wider(self, floors: Mapping[str, float]) -> Allowances:
        """The same with the larger of these floors and those."""
        return replace(self, floors={name: max(by, floors.get(name, 0.0)) for name, by in self.floors.items()})

    def of(self, name: str, value: float) -> float:
        """Allowed change of a metric with this value."""
        digits = LAST_DIGITS * self.last * self.coarser * max(abs(value), self.sizes.get(name, 0.0))
        return FACTOR * self.floors[name] + digits + INVISIBLE * self.tolerances.get(name, 0.0)


def judged(relation: str, base: Metrics, answer: Metrics | str, allowances: Allowances) -> Change:
    """The metric with the largest change over its allowed one."""
    if isinstance(answer, str):
        return Change(relation, refused=answer, lost=not isinstance(answer, Refusal))
    worst = Change(relation)
    for name, (value, _) in base.items():
        other, why = answer.get(name, (None, ""))
        if value is None or (other is None and why in UNTOLD):
            continue
        allowed = allowances.of(name, value)
        change = math.inf if other is None else abs(other - value)
        if not worst.metric or _share(change, allowed) > _share(worst.change, worst.allowed):
            # Python numbers: metrics and bounds may be numpy numbers, whose comparisons are not JSON.
            worst = Change(relation, name, float(change), float(allowed))
    return worst


def _share(change: float, allowed: float) -> float:
    if change == 0.0 or math.isinf(allowed):
        return 0.0
    return change / allowed if allowed else math.inf
