"""Known motions that only space has."""

from __future__ import annotations

import math
from itertools import product

import numpy as np

from reference_solver.model import Array, Body, Model
from reference_solver.shapes import Box, Capsule, HalfSpace, Sphere
from tests.verification.known.motion import Motion, complementary, integrated, spun
from tests.verification.known.planar import STICKS
from tests.verification.rotation import rotation_matrix
from tests.verification.space import GRAVITY

Rng = np.random.Generator

UP = np.array([0.0, 0.0, 1.0])
UPRIGHT = (1.0, 0.0, 0.0, 0.0)
#: I / (m r^2) of a uniform sphere.
ROUND = 0.4


def _model(bodies: list[Body], friction: float, restitution: float = 0.0, gravity: float = GRAVITY) -> Model:
    return Model(3, bodies, (0.0, 0.0, -gravity), restitution, friction)


def _plane(normal: Array, **fields: object) -> Body:
    motion = "prescribed" if fields else "fixed"
    # normal (3,) is a tuple of three numbers, of which a type checker knows only that there are some
    return Body(HalfSpace(tuple(normal)), pose=(0.0, 0.0, 0.0, *UPRIGHT), motion=motion, **fields)  # type: ignore[arg-type]


def _ball(radius: float, mass: float, place: Array, v: Array, w: Array, q: tuple[float, ...] = UPRIGHT) -> Body:
    return Body(Sphere(radius), mass, (ROUND * mass * radius**2,) * 3, (*place, *q), (*v, *w))


def _orientation(rng: Rng) -> Array:
    q = rng.normal(size=4)
    return np.asarray(q / np.linalg.norm(q))


def turntable(rng: Rng) -> Motion:
    """Return a ball that rolls on a turntable: it goes in circles, slower than the table.

    From ``m v' = F``, ``I w' = -r up x F`` and ``v - r w x up = W up x x``: ``v' = k/(1 + k) W up x v``.
    """
    radius, turning, time = rng.uniform(0.1, 0.4), rng.uniform(-6.0, 6.0), rng.uniform(0.4, 0.9)
    place = np.array([*rng.uniform(-0.5, 0.5, 2), radius])
    v = np.array([*rng.uniform(-1.0, 1.0, 2), 0.0])
    w = np.array([(turning * place[0] - v[1]) / radius, (v[0] + turning * place[1]) / radius, rng.uniform(-3.0, 3.0)])
    slow = ROUND / (1.0 + ROUND) * turning
    c, s = math.cos(slow * time), math.sin(slow * time)
    way = np.array([v[0] * s - v[1] * (1.0 - c), v[0] * (1.0 - c) + v[1] * s, 0.0]) / slow
    table = _plane(UP, twist=(0.0, 0.0, 0.0, 0.0, 0.0, turning))
    truth = np.array([*(place + way), *[math.nan] * 4])
    return Motion(_model([table, _ball(radius, 1.0, place, v, w)], STICKS), time, truth)


def lopsided_ball(pushed: bool, rng: Rng) -> Motion:
    """Return a ball of unequal moments that rolls without slip, and wobbles: a nonholonomic motion.

    With ``v = r w x up`` and moments about the point of contact, ``(I + m r^2 (1 - up up^T)) w' = T - w x I w``; the
    torque T is none unless it is ``pushed``.
    """
    radius, time = rng.uniform(0.2, 0.4), rng.uniform(0.3, 0.7)
    moments = radius**2 * rng.uniform(0.25, 0.45, 3)
    q, w = _orientation(rng), rng.uniform(-3.0, 3.0, 3)
    torque = moments * rng.uniform(-8.0, 8.0, 3) if pushed else np.zeros(3)

    def rate(state: Array) -> Array:
        turn = rotation_matrix(state[:4] / np.linalg.norm(state[:4]))
        inertia, w = turn @ np.diag(moments) @ turn.T, state[4:7]
        bent = np.linalg.solve(inertia + radius**2 * (np.eye(3) - np.outer(UP, UP)), torque - np.cross(w, inertia @ w))
        return np.concatenate([spun(state[:4], w), bent, radius * np.cross(w, UP)])

    state, _ = integrated(rate, np.concatenate([q, w, [0.0, 0.0, radius]]), time)
    place, twist = (0.0, 0.0, radius, *q), (*(radius * np.cross(w, UP)), *w)
    ball = Body(Sphere(radius), 1.0, tuple(moments), place, twist, torque=tuple(torque))
    truth = np.concatenate([state[7:], state[:4] / np.linalg.norm(state[:4])])
    return Motion(_model([_plane(UP), ball], STICKS), time, truth)


def rod_spun_up(rng: Rng) -> Motion:
    """Return a thin rod that falls while a torque spins it up about its own axis, where it has hardly any inertia.

    Its angular momentum grows by ``L' = T`` in the world, and ``q' = w q/2`` with ``w = I^-1 L`` of where it lies.
    """
    half, radius, time = rng.uniform(0.2, 0.5), rng.uniform(0.02, 0.05), rng.uniform(0.3, 0.6)
    across = 0.25 * radius**2 + (half + radius) ** 2 / 3.0
    moments, q, v = np.array([0.5 * radius**2, across, across]), _orientation(rng), rng.uniform(-2.0, 2.0, 3)
    axes = rotation_matrix(q)
    spin, torque = (axes @ (moments * rng.uniform(-1.0, 1.0, 3) * most) for most in ([9.0, 3.0, 3.0], [50.0, 5.0, 5.0]))

    def rate(state: Array) -> Array:
        turn = rotation_matrix(state[:4] / np.linalg.norm(state[:4]))
        return np.concatenate([spun(state[:4], turn @ ((turn.T @ state[4:]) / moments)), torque])

    # Four times as long, at a quarter of the speed: a step turns it by no more than .003 rad then.
    state, _ = integrated(lambda state: 0.25 * rate(state), np.concatenate([q, spin]), 4.0 * time)
    twist = (*v, *(axes @ ((axes.T @ spin) / moments)))
    rod = Body(Capsule(half, radius), 1.0, tuple(moments), (0.0, 0.0, 0.0, *q), twist, torque=tuple(torque))
    way = v * time - 0.5 * GRAVITY * time**2 * UP
    return Motion(_model([rod], 0.0), time, np.concatenate([way, state[:4] / np.linalg.norm(state[:4])]))


def _between(normals: Array, rng: Rng, moves: Array) -> Motion | None:
    """Return a ball that touches planes through the origin, spins and slips on all of them; None if it does not last.

    It may move along the directions ``moves`` (k, 3) that all planes leave free. Loads N from the balance of forces
    along the normals, with friction against each slip ``u = v - r w x n``; ends before any slip does.
    """
    mu, radius, mass = rng.uniform(0.05, 0.4), rng.uniform(0.2, 0.4), 10.0 ** rng.uniform(-1.0, 1.0)
    place = np.linalg.lstsq(normals, np.full(len(normals), radius), rcond=None)[0]
    v = moves.T @ rng.uniform(-2.0, 2.0, len(moves))
    w, inertia = rng.uniform(-12.0, 12.0, 3), ROUND * mass * radius**2
    weight = np.array([0.0, 0.0, -mass * GRAVITY])

    def forces(state: Array) -> tuple[Array, Array, Array]:
        """Loads (k,), directions of friction (k, 3), speeds of slip (k,)."""
        slip = state[7:10] - radius * np.cross(state[4:7], normals)
        speed = np.linalg.norm(slip, axis=1)
        against = -slip / speed[:, None]
        balance = (normals + mu * against) @ normals.T
        return np.linalg.solve(balance.T, -(normals @ weight)), against, speed

    def rate(state: Array) -> Array:
        loads, against, _ = forces(state)
        pushes = loads[:, None] * (normals + mu * against)
        torque = np.cross(-radius * normals, pushes).sum(axis=0)
        return np.concatenate(
            [spun(state[:4], state[4:7]), torque / inertia, (pushes.sum(axis=0) + weight) / mass, state[7:10]]
        )

    def lasts(state: Array) -> float:
        loads, _, speed = forces(state)
        return float(min(loads.min() - 0.02 * mass * GRAVITY, speed.min() - 0.05))

    state = np.concatenate([UPRIGHT, w, v, place])
    if lasts(state) <= 0.0:
        return None
    time = float(rng.uniform(0.2, 0.6))
    end, left = integrated(rate, state, time, lasts)
    if time - left < 0.05:
        return None
    if left > 0.0:
        time = 0.95 * (time - left)
        end, _ = integrated(rate, state, time)
    bodies = [*(_plane(normal) for normal in normals), _ball(radius, mass, place, v, w)]
    truth = np.concatenate([end[10:], end[:4] / np.linalg.norm(end[:4])])
    return Motion(_model(bodies, mu), time, truth)


def groove(rng: Rng) -> Motion:
    """Return a ball that slips along a groove while it spins: two contacts whose slips turn."""
    while True:
        a, b = rng.uniform(0.3, 0.9, 2)
        normals = np.array([(0.0, math.sin(a), math.cos(a)), (0.0, -math.sin(b), math.cos(b))])
        found = _between(normals, rng, np.array([[1.0, 0.0, 0.0]]))
        if found is not None:
            return found


def corner(rng: Rng) -> Motion:
    """Return a ball that spins in the corner of three planes: three contacts whose slips turn, and no freedom."""
    while True:
        lean, turn = rng.uniform(0.5, 1.1, 3), np.array([0.0, 2.0, 4.0]) + rng.uniform(-0.4, 0.4, 3)
        normals = np.column_stack([np.sin(lean) * np.cos(turn), np.sin(lean) * np.sin(turn), np.cos(lean)])
        found = _between(normals, rng, np.zeros((0, 3)))
        if found is not None:
            return found


def three_corners(rng: Rng) -> Motion:
    """Return a smooth box that meets three planes with three of its corners at once, and flies on.

    ``u+ = W p + u-``, ``0 <= p`` against ``u+ + e u- >= 0`` by trying all eight sets of corners that are pressed; W is
    definite, so that one of them fits.
    """
    half, mass, e, time = rng.uniform(0.2, 0.5, 3), 10.0 ** rng.uniform(-0.5, 0.5), rng.uniform(0.0, 0.9), 0.1
    all_signs = np.array(list(product((-1.0, 1.0), repeat=3)))
    moments = mass * (half @ half - half**2) / 3.0
    while True:
        q, v, w = _orientation(rng), rng.uniform(-2.0, 2.0, 3), rng.uniform(-2.0, 2.0, 3)
        turn = rotation_matrix(q)
        signs = rng.permutation(all_signs)[:3]
        arms = (signs * half) @ turn.T
        # Planes that these corners touch, and no other corner within .05 m: their normals look inwards.
        normals = -arms / np.linalg.norm(arms, axis=1)[:, None] + 0.3 * rng.normal(size=(3, 3))
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        corners = (all_signs * half) @ turn.T
        heights = corners @ normals.T - (arms * normals).sum(axis=1)
        if (np.sort(heights, axis=0)[1] < 0.05).any() or np.abs(np.linalg.det(normals)) < 0.1:
            continue
        rows = np.hstack([normals, np.cross(arms, normals)])
        inverse = np.zeros((6, 6))
        inverse[:3, :3], inverse[3:, 3:] = np.eye(3) / mass, turn @ np.diag(1.0 / moments) @ turn.T
        w_, u = rows @ inverse @ rows.T, rows @ np.concatenate([v, w])
        if u.max() > -0.05:  # all approach
            continue
        found = complementary(w_, (1.0 + e) * u)
        after = np.concatenate([v, w]) + inverse @ rows.T @ found
        # No corner comes down on any plane again while it flies.
        flown = [(after[:3] * t, _flown(q, after[3:], moments, t)) for t in np.linspace(0.0, time, 11)[1:]]
        turns = [(place, rotation_matrix(end)) for place, end in flown]
        above = [(place + (all_signs * half) @ r.T) @ normals.T for place, r in turns]
        if (rows @ after).min() > 0.01 and min((x - (arms * normals).sum(axis=1)).min() for x in above) > 0.0:
            break
    end = flown[-1][1]
    planes = [
        Body(HalfSpace(tuple(n), float(n @ arm)), pose=(0.0, 0.0, 0.0, *UPRIGHT), motion="fixed")
        for n, arm in zip(normals, arms, strict=True)
    ]
    box = Body(Box(tuple(half)), mass, tuple(moments), (0.0, 0.0, 0.0, *q), (*v, *w))
    truth = np.concatenate([after[:3] * time, end])
    return Motion(_model([*planes, box], 0.0, e, 0.0), time, truth)


def _flown(q: Array, w: Array, moments: Array, time: float) -> Array:
    """Orientation (4,) of a body that turns freely, its angular momentum kept, after ``time`` [s]."""
    turn = rotation_matrix(q)
    spin = turn @ np.diag(moments) @ turn.T @ w

    def rate(state: Array) -> Array:
        turned = rotation_matrix(state / np.linalg.norm(state))
        return spun(state, turned @ np.diag(1.0 / moments) @ turned.T @ spin)

    end, _ = integrated(rate, q, time)
    return np.asarray(end / np.linalg.norm(end))
