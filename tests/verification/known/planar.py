"""Known motions in the plane; those that a space can be handed hold in both dimensions."""

from __future__ import annotations

import math

import numpy as np

from reference_solver.model import Array, Body, Model
from reference_solver.shapes import Box, Capsule, Disc, HalfSpace, Polygon, Shape, Sphere
from tests.verification.known.motion import Motion, integrated
from tests.verification.space import GRAVITY, ROUNDNESS, Space

Rng = np.random.Generator

#: Friction that lets nothing slip.
STICKS = 5.0


def _world(space: Space, bodies: list[Body], friction: float, tilt: float = 0.0) -> Model:
    """Return a model with e = 0 and gravity turned by ``tilt`` [rad] towards the horizontal axis."""
    pull = space.vector(GRAVITY * math.sin(tilt), -GRAVITY * math.cos(tilt))
    return Model(space.dimension, bodies, pull, 0.0, friction)


def rollers(space: Space, rng: Rng) -> Motion:
    """Return a board on two rollers that turn inwards, and slip: it swings to and fro for ever.

    Rollers at -d and d carry N_1 and N_2. About the centre of a board of half thickness h at x,
    ``N_1 (D + x) = N_2 (D - x)``, ``D = d - mu h``, so that ``x'' = mu (N_1 - N_2)/m = -(mu g/D) x``. In space the
    roller at d is a ball: on two rods the board has four contacts, and whether it yaws is not determined.
    """
    d, h, mu, radius = rng.uniform(0.6, 1.0), rng.uniform(0.03, 0.1), rng.uniform(0.2, 0.6), 0.2
    x, v, spin, time = rng.uniform(-0.3, 0.3), rng.uniform(-0.5, 0.5), rng.uniform(12.0, 20.0), rng.uniform(0.4, 0.8)
    rate = math.sqrt(mu * GRAVITY / (d - mu * h))
    bodies = []
    for side in (-1.0, 1.0):
        pose, twist = space.pose(side * d, 0.0), space.twist(spin=side * spin)
        shape: Shape = Disc(radius) if space.dimension == 2 else Sphere(radius)
        if space.dimension == 3 and side < 0.0:  # the axis of a capsule across
            half = math.sqrt(0.5)
            shape, pose = Capsule(1.0, radius), (*pose[:3], half, 0.0, 0.0, half)
        bodies.append(Body(shape, pose=pose, twist=twist, motion="prescribed"))
    bodies.append(
        space.box(x, radius + h, space.twist(v), (2.5, h)) if space.dimension == 2 else _board(x, radius + h, v, h)
    )
    swung = x * math.cos(rate * time) + v / rate * math.sin(rate * time)
    return Motion(_world(space, bodies, mu), time, np.array(space.pose(swung, radius + h)))


def _board(x: float, z: float, v: float, h: float) -> Body:
    half = (2.5, 0.3, h)
    moments = tuple(sum(s * s for s in half) / 3.0 - s * s / 3.0 for s in half)
    return Body(Box(half), 1.0, moments, (x, 0.0, z, 1.0, 0.0, 0.0, 0.0), (v, 0.0, 0.0, 0.0, 0.0, 0.0))


def wedge(space: Space, rng: Rng) -> Motion:
    """Return a ball that spins between two slopes until friction of both has stopped it.

    Loads from ``N_1 (n_1 + mu t_1) + N_2 (n_2 + mu t_2) = m g up`` with t against the slip; then
    ``w' = -mu r (N_1 + N_2)/I`` until w is zero, and rest.
    """
    while True:
        slopes, mu = rng.uniform(0.3, 0.9, 2), rng.uniform(0.05, 0.5)
        radius, mass, spin = rng.uniform(0.2, 0.5), 10.0 ** rng.uniform(-1.0, 1.0), rng.uniform(4.0, 20.0)
        normals = np.array([(math.sin(slopes[0]), math.cos(slopes[0])), (-math.sin(slopes[1]), math.cos(slopes[1]))])
        against = np.column_stack([-normals[:, 1], normals[:, 0]])
        loads = np.linalg.solve((normals + mu * against).T, np.array([0.0, mass * GRAVITY]))
        if loads.min() > 0.05 * mass * GRAVITY:
            break
    slows = mu * radius * loads.sum() / (ROUNDNESS[space.dimension] * mass * radius**2)
    time = float(rng.uniform(0.4, 1.4) * spin / slows)
    moved = min(time, spin / slows)
    angle = spin * moved - 0.5 * slows * moved**2
    x, y = np.linalg.solve(normals, np.full(2, radius))
    bodies = [plane(space, normal) for normal in normals]
    bodies.append(space.ball(float(x), float(y), space.twist(spin=spin), radius, mass))
    return Motion(_world(space, bodies, mu), time, np.array(space.pose(float(x), float(y), angle)))


def plane(space: Space, normal: Array) -> Body:
    """Return a fixed half-space through the origin."""
    return Body(HalfSpace(space.vector(float(normal[0]), float(normal[1]))), pose=space.pose(0.0, 0.0), motion="fixed")


def sliding_fall(space: Space, rng: Rng) -> Motion:
    """Return a box that falls over while the corner (in space the edge) it stands on slides.

    With s from the corner to the centre, ``s_y'' = s_x q'' - s_y q'^2``, the load ``N = m (g + s_y'')`` and the slip to
    the right, ``I q'' = N (-s_x - mu s_y)`` and ``x'' = -mu N/m``.
    """
    half = (rng.uniform(0.15, 0.4), rng.uniform(0.3, 0.6))
    mu, lean, time = rng.uniform(0.05, 0.3), rng.uniform(0.1, 0.4), rng.uniform(0.1, 0.3)
    inertia = (half[0] ** 2 + half[1] ** 2) / 3.0
    start, slip = -math.atan2(half[0], half[1]) - lean, rng.uniform(2.0, 3.0)

    def lever(q: float) -> tuple[float, float]:
        return -half[0] * math.cos(q) - half[1] * math.sin(q), -half[0] * math.sin(q) + half[1] * math.cos(q)

    def rate(state: Array) -> Array:
        q, w, _, v = state
        x, y = lever(q)
        turns = -x - mu * y
        bent = (GRAVITY - y * w * w) * turns / (inertia - x * turns)
        return np.array([w, bent, v, -mu * (GRAVITY + x * bent - y * w * w)])

    spin = rng.uniform(-0.5, 0.0)
    x, y = lever(start)
    # The corner goes with the slip: its velocity is v + w s_y.
    first = np.array([start, spin, x, slip - spin * y])
    # Until it lies, or the slip ends.
    state, left = integrated(rate, first, time, lambda s: min(s[0] + 0.5 * math.pi, s[3] + s[1] * lever(s[0])[1]))
    if left > 0.0:
        time = 0.9 * (time - left)
        state, _ = integrated(rate, first, time)
    angle, _, along, _ = state
    box = space.box(x, y, space.twist(slip - spin * y, spin * x, spin), half, 1.0, start)
    truth = np.array(space.pose(float(along), lever(angle)[1], float(angle)))
    return Motion(_world(space, [space.floor(), box], mu), time, truth)


def off_the_edge(space: Space, rng: Rng) -> Motion:
    """Return a ball that comes to the edge of a fixed box, goes over it, slips and leaves (E75, an edge for hill).

    Smooth, or rolling: then ``theta'' = g sin(theta)/((1 + k) r)`` while ``mu N > m g sin(theta) k/(1 + k)``, then
    ``theta'' = (g sin(theta) - mu N/m)/r`` while ``N = m (g cos(theta) - r theta'^2) > 0``.
    """
    radius, k = rng.uniform(0.2, 0.4), ROUNDNESS[space.dimension]
    mu = float(rng.choice([0.0, rng.uniform(0.2, 0.6)]))
    speed, before, left = rng.uniform(0.3, 0.9) * math.sqrt(GRAVITY * radius), rng.uniform(0.02, 0.2), 0.0
    time = before / speed + rng.uniform(0.25, 0.4)
    left = time - before / speed

    def load(state: Array) -> float:
        return float(GRAVITY * math.cos(state[0]) - radius * state[1] ** 2)

    def grip(state: Array) -> float:
        return mu * load(state) - GRAVITY * math.sin(state[0]) * k / (1.0 + k)

    state = np.array([0.0, speed / radius])
    if mu > 0.0:
        state, left = integrated(
            lambda s: np.array([s[1], GRAVITY * math.sin(s[0]) / ((1.0 + k) * radius)]), state, left, grip
        )
    state, left = integrated(
        lambda s: np.array([s[1], (GRAVITY * math.sin(s[0]) - mu * load(s)) / radius]), state, left, load
    )
    angle, spin = state
    x, y = radius * math.sin(angle), radius * math.cos(angle)
    x, y = x + y * spin * left, y - x * spin * left - 0.5 * GRAVITY * left**2
    table = space.box(-1.0, -0.5, half=(1.0, 0.5), mass=0.0, motion="fixed")
    roll = -speed / radius if mu > 0.0 else 0.0
    ball = space.ball(-before, radius, space.twist(speed, 0.0, roll), radius)
    truth = np.full(3 if space.dimension == 2 else 7, math.nan)
    truth[: space.dimension] = space.vector(float(x), float(y))
    return Motion(_world(space, [table, ball], mu), time, truth)


def rimless_wheel(space: Space, rng: Rng) -> Motion:
    """Return a regular polygon that rolls over its corners, e = 0, down a slope; in space a square one: a box.

    About the corner that it stands on ``(I + m R^2) q'' = m g R sin(q)``; where the next corner comes down, angular
    momentum about it is kept: ``w+/w- = (I + m R^2 cos(2 pi/n))/(I + m R^2)``.
    """
    while True:
        count = int(rng.integers(3, 8)) if space.dimension == 2 else 4
        size, slope, spin, time = (
            rng.uniform(0.2, 0.4),
            rng.uniform(0.0, 0.5),
            rng.uniform(1.0, 7.0),
            rng.uniform(0.3, 0.9),
        )
        part = math.pi / count
        inertia = size**2 * (0.5 * (1.0 - 2.0 / 3.0 * math.sin(part) ** 2))  # of a regular polygon, a mass of one
        about = inertia + size**2
        found = _rolled(size, part, inertia, about, slope, spin, time)
        if found is not None:
            break
    x, y, turned = found
    flat = size * math.cos(part)
    shape: Polygon | Box = Box((flat,) * 3)
    if space.dimension == 2:
        angles = [-0.5 * math.pi + part * (2 * i + 1) for i in range(count)]
        shape = Polygon(tuple((size * math.cos(a), size * math.sin(a)) for a in angles))
    # It turns clockwise about the front corner, which is below the centre by `flat` and in front by the other leg.
    twist = space.twist(spin * flat, spin * size * math.sin(part), -spin)
    moments = inertia if space.dimension == 2 else (inertia,) * 3
    wheel = Body(shape, 1.0, moments, space.pose(0.0, flat), twist)
    truth = np.array(space.pose(x, y, -turned))
    return Motion(_world(space, [space.floor(), wheel], STICKS, slope), time, truth)


def _rolled(
    size: float, part: float, inertia: float, about: float, slope: float, spin: float, time: float
) -> tuple[float, float, float] | None:
    """Return place and clockwise turn of a wheel that starts flat.

    None where it leaves the floor, slips, falls back or ends within .02 s of a blow.
    """
    state, left, corners = np.array([-part, spin]), time, 0
    corner = size * math.sin(part)

    def rate(s: Array) -> Array:
        return np.array([s[1], GRAVITY * size * math.sin(s[0] + slope) / about])

    def pressed(s: Array) -> float:
        """Load and grip, and that it goes on."""
        bent = rate(s)[1]
        normal = GRAVITY * math.cos(slope) - size * (bent * math.sin(s[0]) + s[1] ** 2 * math.cos(s[0]))
        along = size * (bent * math.cos(s[0]) - s[1] ** 2 * math.sin(s[0])) - GRAVITY * math.sin(slope)
        return float(min(normal - 0.2, 0.8 * STICKS * normal - abs(along), s[1] - 0.1))

    while True:
        tested, checked = state, 0.0
        state, rest = integrated(rate, state, left, lambda s: part - s[0])
        while checked < left - rest:  # along the way, from its start
            if pressed(tested) < 0.0:
                return None
            tested, _ = integrated(rate, tested, 0.01)
            checked += 0.01
        if pressed(state) < 0.0 or (rest == 0.0 and part - state[0] < 0.02 * state[1]):
            return None
        if rest == 0.0:
            break
        kept = (inertia + size**2 * math.cos(2.0 * part)) / about
        before, after = state[1], kept * state[1]
        # The blow must hold: impulse along and normal, of velocities about the old and the new corner.
        normal = size * math.sin(part) * (after + before)
        along = abs(size * math.cos(part) * (after - before))
        state, left, corners = np.array([-part, after]), rest, corners + 1
        if along > 0.8 * STICKS * normal or after < 0.1 or left < 0.02 or corners > 4:
            return None
    place = corner * (2 * corners + 1)
    x, y = place + size * math.sin(state[0]), size * math.cos(state[0])
    return float(x), float(y), float(state[0] + part + 2.0 * part * corners)
