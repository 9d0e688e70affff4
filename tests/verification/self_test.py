"""Does the certificate certify? Corruptions, planted one at a time, and which of them it sees.

Each is planted where its cause would stand: in the model that the solver is given (laws, inputs, detection, events),
in its settings, or in what it hands out (motion, bookkeeping). The certificate is given the true model. Sizes are
shares: of the value that is corrupted, of a radian, of a body's half width, of a step, as the name says.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from reference_solver.certificate.audit import audit, audited
from reference_solver.certificate.truth import distance
from reference_solver.exact import Refused
from reference_solver.model import Array, Body, Model
from reference_solver.pieces import CHAIN, FORCES, IMPACT, Pieces
from reference_solver.records import Record
from reference_solver.settings import Settings
from reference_solver.shapes import Box, Disc, HalfSpace, Sphere
from reference_solver.simulation import Simulation
from tests.verification.gate import Gate

SIZES = (1e-9, 1e-8, 1e-7, 1e-5, 1e-3)
#: What stands in place of checks where X contains what a corruption moves.
IN_X = ("X",)
#: Size at which the share of what is caught, or in X, is promised, and that share.
JUDGED, PROMISED = 1e-7, 1.0
DT, G = 1.0 / 240.0, 9.81
UPRIGHT = (1.0, 0.0, 0.0, 0.0)
REFERENCE = Settings.reference(DT)


@dataclass(frozen=True)
class Scene:
    """A model and how many steps it is run for."""

    model: Model
    steps: int
    settings: Settings


def _planar(bodies: list[Body], restitution: Any = 0.0, friction: Any = 0.5, steps: int = 60) -> Scene:
    floor = Body(HalfSpace((0.0, 1.0)), motion="fixed")
    return Scene(Model(2, [floor, *bodies], (0.0, -G), restitution, friction), steps, REFERENCE)


def _spatial(bodies: list[Body], restitution: float = 0.0, friction: float = 0.5, steps: int = 60) -> Scene:
    floor = Body(HalfSpace((0.0, 0.0, 1.0)), pose=(0.0, 0.0, 0.0, *UPRIGHT), motion="fixed")
    return Scene(Model(3, [floor, *bodies], (0.0, 0.0, -G), restitution, friction), steps, REFERENCE)


def _hill(friction: float, speed: float = 1.0) -> Scene:
    """A disc on a fixed one, .3 rad beyond its top, that goes downhill and does not spin."""
    c, s = math.cos(0.3), math.sin(0.3)
    ball = Body(Disc(0.25), 1.0, 0.03125, (1.25 * s, 1.25 * c, 0.0), (speed * c, -speed * s, 0.0))
    return Scene(Model(2, [Body(Disc(1.0), motion="fixed"), ball], (0.0, -G), 0.0, friction), 40, REFERENCE)


def _edge(shape: Disc | Sphere, half: tuple[float, ...], inertia: Any, speed: float = 1.0) -> Scene:
    """A ball that rolls off the end of a fixed box, .1 m ahead, and about its edge until it leaves it."""
    d, r, aside = len(half), shape.radius, (0.0,) * (len(half) - 2)
    pose = (0.4, *aside, half[-1] + r, *(UPRIGHT if aside else (0.0,)))
    twist = (speed, 0.0, -speed / r) if d == 2 else (speed, 0.0, 0.0, 0.0, speed / r, 0.0)
    box = Body(Box(half), pose=(0.0, 0.0, 0.0, *UPRIGHT)[: len(pose)], motion="fixed")
    return Scene(Model(d, [box, Body(shape, 1.0, inertia, pose, twist)], (*aside, 0.0, -G), 0.0, 0.8), 50, REFERENCE)


def _caught(light: float, restitution: float) -> Scene:
    """A light disc that is between a wall and one of a kilogram, touches both, and goes to the wall the faster."""
    wall = Body(HalfSpace((1.0, 0.0)), motion="fixed")
    bodies = [_disc(0.5, 0.0, -1.0, 0, 0, mass=light, inertia=0.125 * light), _disc(1.5, 0.0, -0.5, 0, 0)]
    return Scene(Model(2, [wall, *bodies], (0.0, 0.0), restitution, 0.0), 20, REFERENCE)


def _disc(x: float, y: float, *twist: float, **fields: Any) -> Body:
    own: dict[str, Any] = {"mass": 1.0, "inertia": 0.125, "pose": (x, y, 0.0), "twist": twist or None}
    return Body(Disc(0.5), **(own | fields))


def _box(x: float, y: float, *twist: float) -> Body:
    return Body(Box((0.5, 0.5)), 1.0, 1 / 6, (x, y, 0.0), twist or None)


#: What is corrupted: simple scenes, whose uncorrupted runs must all be certified.
SCENES = {
    "disc that bounces": _planar([_disc(0.0, 0.7, 1.0, -1.0, 3.0)], 0.8, 0.1),
    "discs that collide": _planar([_disc(0.0, 0.5, 2.0, 0, 0), _disc(1.2, 0.5, mass=2.0, inertia=0.25)], 0.5, 0.0),
    "discs in a row": _planar(
        [_disc(-1.2, 0.5, 2.0, 0.0, 0.0), *(_disc(1.0 * i, 0.5, mass=1.0 + i) for i in range(3))], 0.5, 0.0, steps=40
    ),
    "light disc caught": _caught(0.05, 0.15),
    "light disc that gets away": _caught(0.05, 0.9),
    "disc as heavy": _caught(1.0, 0.15),
    "box that slides": _planar([_box(0.0, 0.5, 2.0, 0.0, 0.0)], steps=40),
    "box that stops": _planar([_box(0.0, 0.5, 0.5, 0.0, 0.0)], steps=40),
    "box that lands": _planar([_box(0.0, 0.6)], steps=60),
    "disc that stays down": _planar([_disc(0.0, 1.0, 0.0, -50.0, 0.0)], steps=20),
    "stack": _planar([_box(0.0, 0.5 + i) for i in range(4)], steps=20),
    "disc that spins up": _planar([_disc(0.0, 0.5, 0.0, 0.0, 0.0, torque=0.4, force=(0.3, 0.0))], steps=40),
    "disc in flight": _planar([_disc(0.0, 5.0, 1.0, 2.0, 3.0)], 0.5, steps=60),
    "sphere that slides": _spatial(
        [Body(Sphere(0.5), 1.0, (0.1,) * 3, (0, 0, 0.5, *UPRIGHT), (2.0, 1.0, 0.0, 0.0, 0.0, 1.0))], steps=20
    ),
    "sphere that bounces": _spatial(
        [Body(Sphere(0.5), 1.0, (0.1,) * 3, (0, 0, 0.7, *UPRIGHT), (1.0, 0.5, -1.0, 1.0, 0.0, 0.0))], 0.8, 0.1
    ),
    "disc that slides off a disc": _hill(0.2),
    "disc that slides off a disc without friction": _hill(0.0),
    "disc that rolls off a disc": _hill(1.0, 0.2),
    "disc that rolls off a box": _edge(Disc(0.25), (0.5, 0.5), 0.03125),
    "sphere that rolls off a box": _edge(Sphere(0.25), (0.5, 0.5, 0.5), (0.025,) * 3),
    "cube in flight": _spatial(
        [Body(Box((0.5,) * 3), 1.0, (1 / 6,) * 3, (0, 0, 5.0, *UPRIGHT), (1.0, 0, 2.0, 1.0, 2.0, 3.0))], steps=40
    ),
    "box on a belt": Scene(
        Model(
            2,
            [Body(HalfSpace((0.0, 1.0)), motion="prescribed", twist=(1.0, 0.0, 0.0)), _box(0.0, 0.5)],
            (0.0, -G),
            0.0,
            0.3,
        ),
        40,
        REFERENCE,
    ),
}


@dataclass(frozen=True)
class Corruption:
    """One thing that is wrong, and what it does to a run.

    Parameters
    ----------
    family
        ``law``, ``input``, ``detection``, ``events``, ``motion`` or ``bookkeeping``.
    name
        What is corrupted, and of what the size is a share.
    scene
        Name in `SCENES`.
    plant
        From the scene and the size to the true model and the record of the corrupted run.
    missed
        Why small sizes are no corruption that the certificate could see, where that is so.
    """

    family: str
    name: str
    scene: str
    plant: Callable[[Scene, float], tuple[Model, Record]]
    missed: str = ""


@dataclass(frozen=True)
class Trial:
    """A corruption at one size, and the checks that saw it, or `IN_X`; none: it was missed."""

    corruption: Corruption
    size: float
    seen: tuple[str, ...]


def run(scene: Scene) -> tuple[Model, Record]:
    """Run a scene as it is."""
    return scene.model, Simulation(scene.model, scene.settings).record(scene.steps, pieces=True)


def seen_by(model: Model, record: Record) -> tuple[str, ...]:
    """Names of the checks that refuse a run."""
    return tuple(finding.name for finding in audit(model, record, DT) if not finding.holds)


def in_error(scene: Scene, model: Model, record: Record) -> tuple[str, ...]:
    """`IN_X` where X contains what a corruption moves: twice what the audit leaves unexplained."""
    _, moved = audited(model, record, DT)
    return IN_X if (distance(model, record.pose, run(scene)[1].pose) <= 2.0 * moved).all() else ()


def trials(sizes: tuple[float, ...] = SIZES, first: int = 0, every: int = 1) -> Iterator[Trial]:
    """Plant the corruptions one at a time, at all sizes: from the ``first`` on every n-th."""
    for corruption in CORRUPTIONS[first::every]:
        scene = SCENES[corruption.scene]
        for size in sizes:
            try:
                model, record = corruption.plant(scene, size)
            except Refused:  # the loop notices it by itself
                yield Trial(corruption, size, ("refused",))
                continue
            yield Trial(corruption, size, seen_by(model, record) or in_error(scene, model, record))


def gates() -> Iterator[Gate]:
    """Yield that every scene is certified as it is, and the share of corruptions that is caught."""
    for name, scene in SCENES.items():
        yield Gate.exactly("checks that refuse a run that is right", name, len(seen_by(*run(scene))), 0, "reference")
    made = list(trials((JUDGED,)))
    share = sum(bool(trial.seen) for trial in made) / len(made)
    case = f"size {JUDGED:g}, {len(made)} corruptions"
    yield Gate.at_least("share of planted corruptions that is caught", case, share, PROMISED, "audit")


# Corruptions of what the solver is given.

Edit = Callable[[Model, float], Model]


def given(edit: Edit) -> Callable[[Scene, float], tuple[Model, Record]]:
    """Let the solver run another model than the certificate is given."""

    def plant(scene: Scene, size: float) -> tuple[Model, Record]:
        return scene.model, run(replace(scene, model=edit(scene.model, size)))[1]

    return plant


def with_body(i: int, edit: Callable[[Body, float], Body]) -> Edit:
    """Edit body i of a model."""

    def edited(model: Model, size: float) -> Model:
        bodies = [edit(body, size) if k == i else body for k, body in enumerate(model.bodies)]
        return replace(model, bodies=bodies)

    return edited


def scaled(i: int, name: str) -> Edit:
    """Scale a field of body i, or of its shape, by 1 + size."""

    def edit(body: Body, size: float) -> Body:
        target: Any = body if hasattr(body, name) else body.shape
        value = getattr(target, name)
        value = tuple(x * (1.0 + size) for x in value) if isinstance(value, tuple) else value * (1.0 + size)
        changed: Any = replace(target, **{name: value})
        return changed if target is body else replace(body, shape=changed)

    return with_body(i, edit)


def moved(i: int, name: str, k: int, by: float = 1.0) -> Edit:
    """Add ``by`` times the size to component k of a field of body i."""

    def edit(body: Body, size: float) -> Body:
        value = list(getattr(body, name))
        value[k] += by * size
        changed: dict[str, Any] = {name: tuple(value)}
        return replace(body, **changed)

    return with_body(i, edit)


def _gravity(turn: bool) -> Edit:
    def edit(model: Model, size: float) -> Model:
        g = np.array(model.gravity)
        return replace(model, gravity=tuple(g + size * G * np.eye(len(g))[0] if turn else g * (1.0 + size)))

    return edit


def _tilted(body: Body, size: float) -> Body:
    normal = np.array(body.shape.normal)  # type: ignore[union-attr]
    normal[0] += size
    return replace(body, shape=HalfSpace(tuple(normal / np.linalg.norm(normal))))


def _floor_by(by: float) -> Edit:
    """Move the floor up by ``by`` times the size [m]."""

    def edit(body: Body, size: float) -> Body:
        shape: Any = body.shape
        return replace(body, shape=replace(shape, offset=by * size))

    return with_body(0, edit)


def obstacle(
    deep: Callable[[float], tuple[float, float]],
) -> Callable[[Scene, float], tuple[Model, Record]]:
    """Give the certificate a fixed disc at the place ``deep(size)`` that the solver does not look at.

    To the solver it is a hundred kilometres away.
    """

    def plant(scene: Scene, size: float) -> tuple[Model, Record]:
        x, y = deep(size)
        post = Body(Disc(0.5), pose=(x, y, 0.0), motion="fixed")
        restitution, friction = scene.model.restitution[0, 1], scene.model.friction[0, 1]
        model = replace(scene.model, bodies=[*scene.model.bodies, post], restitution=restitution, friction=friction)
        away = replace(model, bodies=[*scene.model.bodies, replace(post, pose=(1e5, y, 0.0))])
        _, record = run(replace(scene, model=away))
        pose = record.pose.copy()
        pose[:, -1] = post.pose
        pieces = record.pieces
        assert pieces is not None
        rows = pieces.body == len(model.bodies) - 1
        before, after = pieces.pose_before.copy(), pieces.pose_after.copy()
        before[rows], after[rows] = post.pose, post.pose
        pieces = replace(pieces, pose_before=before, pose_after=after)
        return model, replace(record, pose=pose, pieces=pieces)

    return plant


def in_the_way(size: float) -> tuple[float, float]:
    """Where the flying disc ends up to be ``size`` of a half width deep in the obstacle."""
    t = SCENES["disc in flight"].steps * DT
    return 1.0 * t + 1.0 - 0.5 * size, 5.0 + 2.0 * t - 0.5 * G * t * t


def grazed(size: float) -> tuple[float, float]:
    """Where the flying disc touches from above in passing, in the middle of a step: at the top of its path."""
    top = 2.0 / G
    return 1.0 * top, 5.0 + 2.0 * 2.0 / G - 0.5 * G * top * top + 1.0 - 0.5 * size


# Corruptions of its settings.


def another_step(scene: Scene, size: float) -> tuple[Model, Record]:
    """Look at other times than those that are claimed."""
    return run(replace(scene, settings=Settings.reference(DT * (1.0 + size))))


# Corruptions of what it hands out.


def handed(edit: Callable[[Pieces, float], Pieces]) -> Callable[[Scene, float], tuple[Model, Record]]:
    """Change the pieces; the samples are made to fit them."""

    def plant(scene: Scene, size: float) -> tuple[Model, Record]:
        model, record = run(scene)
        assert record.pieces is not None
        copy = replace(record.pieces, **{n: v.copy() for n, v in vars(record.pieces).items()})
        pieces = edit(copy, size)
        pose, twist = record.pose.copy(), record.twist.copy()
        step = np.repeat(pieces.step, np.diff(pieces.first_body))
        for i in range(len(model.bodies)):
            rows = np.flatnonzero(pieces.body == i)
            last = np.searchsorted(step[rows], np.arange(len(pose))) - 1
            known = last >= 0
            pose[known, i], twist[known, i] = (
                pieces.pose_after[rows[last[known]]],
                pieces.twist_after[rows[last[known]]],
            )
        return model, replace(record, pieces=pieces, pose=pose, twist=twist)

    return plant


def field(name: str, change: Callable[[Array, float], Array], at: str = "last") -> Callable[[Pieces, float], Pieces]:
    """Change one row of a field of the contacts: that of the last piece that has one, or of the first impact."""

    def edit(pieces: Pieces, size: float) -> Pieces:
        values = getattr(pieces, name)
        values[_contact(pieces, at)] = change(values[_contact(pieces, at)], size)
        return pieces

    return edit


def _contact(pieces: Pieces, at: str) -> int:
    carrying = np.abs(pieces.impulse).sum(axis=1) > 0.0
    owner = np.repeat(np.arange(len(pieces)), np.diff(pieces.first_contact))
    if at == "impact":
        return int(np.flatnonzero(carrying & (pieces.kind[owner] == IMPACT))[0])
    return int(np.flatnonzero(carrying & (pieces.kind[owner] == FORCES))[-1])


def _pushed(pieces: Pieces, contact: int, mass: float, inertia: float, change: Array) -> Pieces:
    """Add ``change`` to the impulse of a contact of body 1 on a fixed body; its motion from there on is made to fit.

    Its momentum then balances, and its way: only the law of contact is broken.
    """
    piece = int(np.searchsorted(pieces.first_contact, contact, "right")) - 1
    rows = np.flatnonzero(pieces.body == 1)
    owner = np.repeat(np.arange(len(pieces)), np.diff(pieces.first_body))[rows]
    d = change.shape[0]
    arm = pieces.point[contact] - pieces.pose_before[rows[owner == piece][0], :d]
    if d == 2:
        spin = np.array([arm[0] * change[1] - arm[1] * change[0]])
        moment = np.array([pieces.point[contact, 0] * change[1] - pieces.point[contact, 1] * change[0]])
    else:
        spin, moment = np.cross(arm, change), np.cross(pieces.point[contact], change)
    sign = 1.0 if pieces.body_b[contact] == 1 else -1.0
    gained = sign * np.concatenate([change / mass, spin / inertia])
    pieces.impulse[contact] += change
    pieces.moment[contact] += moment
    way = np.zeros(d)
    for row, k in zip(rows, owner, strict=True):
        if k < piece:
            continue
        pieces.pose_before[row, :d] += way
        if k > piece:
            pieces.twist_before[row] += gained
        pieces.twist_after[row] += gained
        way = way + pieces.length[k] * gained[:d] * (0.5 if k == piece else 1.0)
        pieces.pose_after[row, :d] += way
    return pieces


def answered(at: str, inertia: float, direction: Callable[[Pieces, int], Array]) -> Callable[[Pieces, float], Pieces]:
    """Push body 1 at a contact by a share of its impulse, in a direction; its momentum and motion are made to fit."""

    def edit(pieces: Pieces, size: float) -> Pieces:
        contact = _contact(pieces, at)
        whole = float(np.linalg.norm(pieces.impulse[contact]))
        return _pushed(pieces, contact, 1.0, inertia, size * whole * direction(pieces, contact))

    return edit


def _normal(pieces: Pieces, contact: int) -> Array:
    found: Array = pieces.normal[contact]
    return found


def _tangent(pieces: Pieces, contact: int) -> Array:
    along = pieces.impulse[contact] - (pieces.impulse[contact] @ pieces.normal[contact]) * pieces.normal[contact]
    found: Array = along / np.linalg.norm(along)
    return found


def _across(pieces: Pieces, contact: int) -> Array:
    return np.cross(pieces.normal[contact], _tangent(pieces, contact))


def jumped(name: str, k: int, by: float = 0.5, body: int = 1) -> Callable[[Pieces, float], Pieces]:
    """Shift component k of all states of a body from the middle of its run on, as if one piece had moved it."""

    def edit(pieces: Pieces, size: float) -> Pieces:
        rows = np.flatnonzero(pieces.body == body)
        middle = len(rows) // 2
        getattr(pieces, f"{name}_after")[rows[middle], k] += by * size
        getattr(pieces, f"{name}_before")[rows[middle + 1 :], k] += by * size
        getattr(pieces, f"{name}_after")[rows[middle + 1 :], k] += by * size
        return pieces

    return edit


def _turned(pieces: Pieces, size: float) -> Pieces:
    """Turn the orientations of body 1 about z by the size [rad], from the middle on."""
    rows = np.flatnonzero(pieces.body == 1)
    middle = len(rows) // 2
    for states, start in ((pieces.pose_after, middle), (pieces.pose_before, middle + 1)):
        for row in rows[start:]:
            w, x, y, z = states[row, 3:]
            c, s = np.cos(0.5 * size), np.sin(0.5 * size)
            states[row, 3:] = c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w
    return pieces


def _without_contact(pieces: Pieces, size: float) -> Pieces:
    """Give ``size`` of a contact's impulse to nobody."""
    contact = _contact(pieces, "last")
    pieces.impulse[contact] *= 1.0 - size
    pieces.moment[contact] *= 1.0 - size
    return pieces


def _swapped(pieces: Pieces, size: float) -> Pieces:
    """Move a share of the impulse between the two bodies above onto the two below."""
    owner = np.repeat(np.arange(len(pieces)), np.diff(pieces.first_contact))
    last = np.flatnonzero(owner == owner.max())
    for name in ("impulse", "moment"):
        values = getattr(pieces, name)
        values[last[0]] += size * values[last[-1]]
        values[last[-1]] *= 1.0 - size
    return pieces


def _two_points(pieces: Pieces, size: float) -> Pieces:
    """Move a share of the impulse of one point of a box to its other point."""
    contact = _contact(pieces, "last")
    for name in ("impulse", "moment"):
        values = getattr(pieces, name)
        share = size * values[contact]
        values[contact] -= share
        values[contact - 1] += share
    return pieces


def _late(pieces: Pieces, size: float) -> Pieces:
    pieces.begin[len(pieces) // 2 :] += size * DT
    return pieces


def _longer(pieces: Pieces, size: float) -> Pieces:
    pieces.length[len(pieces) // 2] *= 1.0 + size
    return pieces


def _sampled(scene: Scene, size: float) -> tuple[Model, Record]:
    """Hand out a last sample that is not where the pieces end."""
    model, record = run(scene)
    pose = record.pose.copy()
    pose[-1, 1, 0] += 0.5 * size
    return model, replace(record, pose=pose)


def _sampled_between(name: str) -> Callable[[Scene, float], tuple[Model, Record]]:
    """Hand out a sample in the middle of the run that is not what the pieces have there."""

    def plant(scene: Scene, size: float) -> tuple[Model, Record]:
        model, record = run(scene)
        values = getattr(record, name).copy()
        values[len(values) // 2, 1, 0] += 0.5 * size
        changed: dict[str, Any] = {name: values}
        return model, replace(record, **changed)

    return plant


def _leaning(pieces: Pieces, size: float) -> Pieces:
    """Turn the normal of the first impact by the size [rad]."""
    contact = _contact(pieces, "impact")
    n = pieces.normal[contact].copy()
    turned = np.cos(size) * n + np.sin(size) * np.array([-n[1], n[0]])
    pieces.normal[contact] = turned
    return pieces


def _spun(pieces: Pieces, size: float) -> Pieces:
    """Let friction turn body 1 by more than its lever gives, by a share; its spin and angle are made to fit."""
    contact = _contact(pieces, "last") - 5
    piece = int(np.searchsorted(pieces.first_contact, contact, "right")) - 1
    rows = np.flatnonzero(pieces.body == 1)
    owner = np.repeat(np.arange(len(pieces)), np.diff(pieces.first_body))[rows]
    more = size * 0.25 * float(np.linalg.norm(pieces.impulse[contact]))
    pieces.moment[contact, 0] += more
    gained, angle = more / 0.03125, 0.0
    for row, k in zip(rows, owner, strict=True):
        if k < piece:
            continue
        pieces.pose_before[row, 2] += angle
        pieces.twist_before[row, 2] += gained * (k > piece)
        pieces.twist_after[row, 2] += gained
        angle += pieces.length[k] * gained * (0.5 if k == piece else 1.0)
        pieces.pose_after[row, 2] += angle
    return pieces


def _called_endless(scene: Scene, size: float) -> tuple[Model, Record]:
    """Make impacts without a rebound, and say of each that it is a chain without end."""
    _, record = run(replace(scene, model=replace(scene.model, restitution=0.0)))
    assert record.pieces is not None
    pieces = replace(record.pieces, scheme=np.where(record.pieces.kind == IMPACT, CHAIN, record.pieces.scheme))
    return scene.model, replace(record, pieces=pieces)


def _pair_after_pair(pieces: Pieces, size: float) -> Pieces:
    """Leave the second pair out of an impact on two bodies that touch: what is hit moves on into the other."""
    contact = _contact(pieces, "impact")
    piece = int(np.searchsorted(pieces.first_contact, contact, "right")) - 1
    away = [c for c in range(*pieces.first_contact[piece : piece + 2]) if pieces.body_a[c] > pieces.body_a[contact]]
    contacts = ("body_a", "body_b", "feature", "point", "normal", "impulse", "moment")
    fields: dict[str, Any] = {name: np.delete(getattr(pieces, name), away, axis=0) for name in contacts}
    first = pieces.first_contact.copy()
    first[piece + 1 :] -= len(away)
    for row in range(*pieces.first_body[piece : piece + 2]):
        if pieces.body[row] == pieces.body_b[contact]:
            pieces.twist_after[row, 0] += 1.0
    return replace(pieces, **fields, first_contact=first)


def _left_out(scene: Scene, size: float) -> tuple[Model, Record]:
    """Tamper with the state between two steps: a velocity changes that no piece tells of."""
    half = scene.steps // 2
    first = Simulation(scene.model, scene.settings).record(half, pieces=True)
    return scene.model, _joined(first, _onward(scene.model, first, 1.0 + size).record(half, pieces=True))


def _beyond_the_end(scene: Scene, size: float) -> tuple[Model, Record]:
    """Let a ball roll on a face that ends too late by the size; half of that beyond the true end that is found."""
    (box, ball), steps = scene.model.bodies, 10
    half, speed = box.shape.half_extents, ball.twist[0]  # type: ignore[union-attr, index]
    ball = replace(ball, pose=(half[0] * (1.0 + 0.5 * size) - speed * steps * DT, *ball.pose[1:]))
    longer = replace(box, shape=Box((half[0] * (1.0 + size), *half[1:])))
    first = Simulation(replace(scene.model, bodies=[longer, ball]), REFERENCE).record(steps, pieces=True)
    true = replace(scene.model, bodies=[box, ball])
    return true, _joined(first, _onward(true, first).record(scene.steps - steps, pieces=True))


def _onward(model: Model, record: Record, faster: float = 1.0) -> Simulation:
    """Return a run that begins where a record ends, body 1 so many times as fast."""
    one = replace(
        model.bodies[1], pose=tuple(record.pose[-1, 1]), twist=tuple(np.multiply(faster, record.twist[-1, 1]))
    )
    return Simulation(replace(model, bodies=[model.bodies[0], one]), REFERENCE)


def _joined(first: Record, then: Record) -> Record:
    """Two records as one, of which the second begins where the first ends."""
    one, two = first.pieces, then.pieces
    assert one is not None and two is not None
    then = replace(then, t=then.t + first.t[-1])
    two = replace(two, step=two.step + len(first.t) - 1, begin=two.begin + first.t[-1])
    fields = {n: np.concatenate([getattr(one, n), getattr(two, n)]) for n in vars(one) if not n.startswith("first_")}
    starts = {
        n: np.append(getattr(one, n)[:-1], getattr(one, n)[-1] + getattr(two, n))
        for n in vars(one)
        if n[:6] == "first_"
    }
    samples: dict[str, Any] = {
        name: np.concatenate([getattr(first, name), getattr(then, name)[1:]]) for name in ("t", "pose", "twist")
    }
    return replace(then, pieces=Pieces(**fields, **starts), **samples)


def _restitution(model: Model, size: float) -> Model:
    return replace(model, restitution=model.restitution * (1.0 - size))


def _bouncy(model: Model, size: float) -> Model:
    return replace(model, restitution=model.restitution + size)


def _friction(model: Model, size: float) -> Model:
    return replace(model, friction=model.friction * (1.0 + size))


def _sticky(model: Model, size: float) -> Model:
    return replace(model, friction=model.friction + size)


ENDED = "all rebounds end within the step: where bodies are afterwards is the same"
CORRUPTIONS = (
    Corruption("law", "restitution", "disc that bounces", given(_restitution)),
    Corruption("law", "restitution between two bodies", "discs that collide", given(_restitution)),
    Corruption("law", "restitution in space", "sphere that bounces", given(_restitution)),
    Corruption("law", "restitution where there is none", "disc that stays down", given(_bouncy), ENDED),
    Corruption("law", "friction of an impact", "disc that bounces", given(_friction)),
    Corruption("law", "friction of a slide", "box that slides", given(_friction)),
    Corruption("law", "friction of a slide in space", "sphere that slides", given(_friction)),
    Corruption("law", "friction where there is none", "discs that collide", given(_sticky)),
    Corruption("law", "friction of a belt", "box on a belt", given(_friction)),
    Corruption("law", "normal impulse of an impact", "disc that bounces", handed(answered("impact", 0.125, _normal))),
    Corruption(
        "law", "friction impulse of an impact", "disc that bounces", handed(answered("impact", 0.125, _tangent))
    ),
    Corruption("law", "friction across the slip [rad]", "sphere that slides", handed(answered("last", 0.1, _across))),
    Corruption("law", "normal impulse of a slide", "sphere that slides", handed(answered("last", 0.1, _normal))),
    Corruption("law", "friction impulse of a slide", "sphere that slides", handed(answered("last", 0.1, _tangent))),
    Corruption("law", "friction of a slide over a hill", "disc that slides off a disc", given(_friction)),
    Corruption(
        "law",
        "friction where there is none, over a hill",
        "disc that slides off a disc without friction",
        given(_sticky),
    ),
    Corruption("law", "pairs are hit one after the other (any size)", "discs in a row", handed(_pair_after_pair)),
    Corruption("law", "one impact is called a chain without end (any size)", "disc that bounces", _called_endless),
    Corruption(
        "law",
        "a chain that ends is called endless (any size)",
        "light disc that gets away",
        given(lambda model, _: replace(model, restitution=0.15)),
    ),
    Corruption("law", "a chain that does not contract is called endless (any size)", "disc as heavy", _called_endless),
    Corruption("input", "inertia of what rolls over a hill", "disc that rolls off a disc", given(scaled(1, "inertia"))),
    Corruption("input", "gravity", "disc in flight", given(_gravity(turn=False))),
    Corruption("input", "direction of gravity [rad]", "box that slides", given(_gravity(turn=True))),
    Corruption("input", "mass", "discs that collide", given(scaled(2, "mass"))),
    Corruption("input", "mass of what slides", "box that slides", given(scaled(1, "mass"))),
    Corruption("input", "inertia", "disc that bounces", given(scaled(1, "inertia"))),
    Corruption("input", "inertia in space", "sphere that slides", given(scaled(1, "inertia"))),
    Corruption("input", "constant force", "disc that spins up", given(scaled(1, "force"))),
    Corruption("input", "constant torque", "disc that spins up", given(scaled(1, "torque"))),
    Corruption("input", "start place", "disc in flight", given(moved(1, "pose", 0, 0.5))),
    Corruption("input", "start angle [rad]", "disc in flight", given(moved(1, "pose", 2))),
    Corruption("input", "start velocity", "disc in flight", given(scaled(1, "twist"))),
    Corruption("input", "velocity of a belt", "box on a belt", given(scaled(0, "twist"))),
    Corruption("detection", "radius", "disc that bounces", given(scaled(1, "radius"))),
    Corruption("detection", "radius in space", "sphere that bounces", given(scaled(1, "radius"))),
    Corruption("detection", "half extents of a stack", "stack", given(scaled(2, "half_extents"))),
    Corruption("detection", "half extents", "box that lands", given(scaled(1, "half_extents"))),
    Corruption("detection", "a face is held beyond its end", "disc that rolls off a box", _beyond_the_end),
    Corruption("detection", "a face is held beyond its end, in space", "sphere that rolls off a box", _beyond_the_end),
    Corruption("detection", "tilt of the floor [rad]", "disc that bounces", given(with_body(0, _tilted))),
    Corruption(
        "detection", "normal [rad]", "sphere that slides", handed(field("normal", lambda n, s: n + s * n[[2, 0, 1]]))
    ),
    Corruption("detection", "normal of discs [rad]", "discs that collide", handed(_leaning)),
    Corruption("detection", "point", "disc that bounces", handed(field("point", lambda x, s: x + 0.5 * s, "impact"))),
    Corruption("detection", "a body is not looked at, depth", "disc in flight", obstacle(in_the_way)),
    Corruption("detection", "a body is grazed within a step, depth", "disc in flight", obstacle(grazed)),
    Corruption("events", "impact too late, of a step", "disc that bounces", given(_floor_by(-2.0 * DT))),
    Corruption("events", "impact too early, of a step", "disc that bounces", given(_floor_by(2.0 * DT))),
    Corruption("events", "impact of a box too late, of a step", "box that lands", given(_floor_by(-1.4 * DT))),
    Corruption("events", "step", "disc in flight", another_step),
    Corruption("motion", "place in flight", "disc in flight", handed(jumped("pose", 0))),
    Corruption("motion", "angle in flight [rad]", "disc in flight", handed(jumped("pose", 2, 1.0))),
    Corruption("motion", "velocity in flight [m/s]", "disc in flight", handed(jumped("twist", 0, 1.0))),
    Corruption("motion", "spin in flight [rad/s]", "disc in flight", handed(jumped("twist", 2, 1.0))),
    Corruption("motion", "place in a slide", "box that slides", handed(jumped("pose", 0))),
    Corruption("motion", "angle of what touches [rad]", "disc that spins up", handed(jumped("pose", 2, 1.0))),
    Corruption("motion", "place in space", "cube in flight", handed(jumped("pose", 1))),
    Corruption("motion", "orientation in space [rad]", "cube in flight", handed(_turned)),
    Corruption("motion", "length of a quaternion", "cube in flight", handed(jumped("pose", 3, 1.0))),
    Corruption("motion", "spin in space [rad/s]", "cube in flight", handed(jumped("twist", 4, 1.0))),
    Corruption("motion", "place of a belt", "box on a belt", handed(jumped("pose", 1, 0.5, 0))),
    Corruption(
        "bookkeeping", "size of an impulse", "box that slides", handed(field("impulse", lambda p, s: p * (1.0 + s)))
    ),
    Corruption(
        "bookkeeping", "moment of an impulse", "box that slides", handed(field("moment", lambda m, s: m * (1.0 + s)))
    ),
    Corruption("bookkeeping", "moment and spin over a hill", "disc that slides off a disc", handed(_spun)),
    Corruption("bookkeeping", "a share of an impulse is lost", "stack", handed(_without_contact)),
    Corruption("bookkeeping", "a share goes to other bodies", "stack", handed(_swapped)),
    Corruption("bookkeeping", "a share goes to another point", "stack", handed(_two_points)),
    Corruption("bookkeeping", "time of a piece, of a step", "disc in flight", handed(_late)),
    Corruption("bookkeeping", "length of a piece", "disc in flight", handed(_longer)),
    Corruption("bookkeeping", "last sample", "disc in flight", _sampled),
    Corruption("bookkeeping", "a sample in between", "disc in flight", _sampled_between("pose")),
    Corruption("bookkeeping", "velocity of a sample", "disc in flight", _sampled_between("twist")),
    Corruption("bookkeeping", "velocity changed between pieces", "box that slides", _left_out),
)
