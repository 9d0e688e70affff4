"""Gates of detection: seams of flush faces, first impacts of what turns fast, slender bodies."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from reference_solver.model import Array, Body, Box, Capsule, HalfSpace, Model, Polygon, Shape
from reference_solver.settings import Settings
from reference_solver.simulation import Simulation
from tests.verification import runge_kutta
from tests.verification.gate import Gate
from tests.verification.space import GRAVITY, SPACES, Space, made_by

#: Random slides over a seam, and random impacts of turning boxes.
SLIDES, IMPACTS = 60, 200
#: Numbers of the bodies: the box that slides last, first, and between.
ORDERS = ((0, 1, 2), (2, 1, 0), (1, 2, 0))


def gates() -> Iterator[Gate]:
    """Yield every row of detection."""
    for space in SPACES:
        yield from seams(space, "box")
        yield from first_impacts(space)
    yield from seams(SPACES[0], "polygon")
    yield from slender_rod()


def seams(space: Space, shape: str) -> Iterator[Gate]:
    """A box that slides over two flush fixed boxes keeps its velocity but for friction, in any order of the bodies."""
    for profile in ("reference", "fixed_step"):
        trips = sum(
            slide_over_seam(space, shape, profile, seed, order) > 1e-10 for seed in range(SLIDES) for order in ORDERS
        )
        case = f"{shape}, {SLIDES} sizes, {len(ORDERS)} orders"
        yield Gate.exactly("seams: trips", case, trips, 0, f"{space.name} {profile}")


def slide_over_seam(
    space: Space, shape: str, profile: str, seed: int, order: tuple[int, ...], dt: float = 1 / 240, steps: int = 8
) -> float:
    """Return the error of the twist, over the speed, after ``steps`` in which the front passes the seam."""
    random = np.random.default_rng(seed)
    d = space.dimension
    grounds, half = random.uniform(0.3, 1.5, (2, d)), random.uniform(0.05, 0.3, d)
    grounds[:, 0] = np.maximum(grounds[:, 0], 1.2 * math.hypot(half[0], half[1]))
    speed, seam, friction = random.uniform(0.5, 3.0), random.uniform(-5.0, 5.0), random.choice([0.0, 0.2])
    turn = random.uniform(-1.0, 1.0) if d == 3 else 0.0
    front = half[0] * math.cos(turn) + (half[1] * abs(math.sin(turn)) if d == 3 else 0.0)
    place = list(space.pose(seam - front - speed * dt * random.uniform(0.0, 3.0), half[-1]))
    if d == 3:
        place[3:] = math.cos(0.5 * turn), 0.0, 0.0, math.sin(0.5 * turn)
    square = float(half @ half)
    moments = square / 3.0 if d == 2 else tuple((square - half**2) / 3.0)
    bodies = [
        Body(block(shape, ground), motion="fixed", pose=space.pose(seam + side * ground[0], -ground[-1]))
        for side, ground in zip((-1.0, 1.0), grounds, strict=True)
    ]
    bodies.append(Body(block(shape, half), 1.0, moments, tuple(place), space.twist(speed)))
    model = Model(d, [bodies[i] for i in order], space.vector(0.0, -GRAVITY), 0.0, friction)
    simulation = Simulation(model, getattr(Settings, profile)(dt))
    simulation.advance(steps)
    expected = np.array(space.twist(speed - friction * GRAVITY * steps * dt))
    return float(np.abs(simulation.twist[order.index(2)] - expected).max()) / speed


def block(shape: str, half: Array) -> Shape:
    """Return a box, or a polygon of the same outline."""
    if shape == "box":
        return Box(tuple(half))
    x, y = half
    return Polygon(((x, -y), (x, y), (-x, y), (-x, -y)))


def first_impacts(space: Space, dt: float = 1 / 60) -> Iterator[Gate]:
    """A smooth box (e = 1) that turns 4 to 30 rad a step rebounds from the first contact of its corners with a floor.

    The truth is sampled densely, and the first fall halved; impacts that a second one follows in the step are left out.
    """
    missed, judged = 0, 0
    for seed in range(IMPACTS):
        error = impact_error(space, seed, dt)
        judged += not math.isnan(error)
        missed += error > 1e-8
    name = made_by(space, "reference")
    yield Gate.exactly("first impacts missed", f"{IMPACTS} boxes, 4..30 rad a step", missed, 0, name)
    yield Gate.at_least("first impacts judged", f"{IMPACTS} boxes, 4..30 rad a step", judged, IMPACTS // 2, name)


def impact_error(space: Space, seed: int, dt: float, samples: int = 6001) -> float:
    """Relative error of the twist after one step; nan where a second impact follows."""
    random = np.random.default_rng(seed)
    d = space.dimension
    half = random.uniform(0.1, 1.0, 3)
    if d == 2:
        half[1] = 0.0  # in the plane x, z of `Space`
    reach = float(np.linalg.norm(half))
    inertia = reach**2 / 3.0
    axis = np.array([0.0, -1.0, 0.0]) if d == 2 else random.normal(size=3)
    axis *= random.choice([-1.0, 1.0]) / np.linalg.norm(axis)
    spin, fall = random.uniform(4.0, 30.0) / dt, random.uniform(0.2, 1.2) * reach / dt
    height, angle = reach * random.uniform(1.0, 1.3), random.uniform(-3.0, 3.0)
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
    corners = corners @ turns(np.array([0.0, -1.0, 0.0]), np.array([angle]))[0].T
    shape = Box(tuple(half)) if d == 3 else Box((half[0], half[2]))
    twist = (0.0, -fall, -spin * axis[1]) if d == 2 else (0.0, 0.0, -fall, *(spin * axis))
    box = Body(shape, 1.0, inertia if d == 2 else (inertia,) * 3, space.pose(0.0, height, angle), twist)
    simulation = space.simulation([space.floor(), box], Settings.reference(dt), 0.0, 1.0)
    simulation.advance(1)

    def low(t: Array) -> Array:
        levers: Array = np.einsum("sij,kj->ski", turns(axis, spin * t), corners)
        return height - fall * t + levers[..., 2].min(axis=1)

    expected = np.array(twist)
    times = np.linspace(0.0, dt, samples)
    through = np.nonzero(low(times) < 0.0)[0]
    if len(through):
        early, late = times[through[0] - 1], times[through[0]]
        for _ in range(60):
            middle = 0.5 * (early + late)
            early, late = (middle, late) if low(np.array([middle]))[0] > 0.0 else (early, middle)
        levers = corners @ turns(axis, np.array([spin * early]))[0].T
        lever = levers[levers[:, 2].argmin()]
        moment = np.cross(lever, (0.0, 0.0, 1.0))
        impulse = 2.0 * (fall - spin * axis @ moment) / (1.0 + moment @ moment / inertia)
        after = spin * axis + impulse * moment / inertia
        expected = np.array((0.0, impulse - fall, -after[1]) if d == 2 else (0.0, 0.0, impulse - fall, *after))
        rest = np.linspace(0.0, dt - early, samples)[1:]
        size = float(np.linalg.norm(after))
        heights = (
            np.einsum("sij,kj->ski", turns(after / size, size * rest), levers)[..., 2].min(axis=1) - levers[:, 2].min()
        )
        if (heights + (impulse - fall) * rest < 0.0).any():
            return math.nan
    return float(np.abs(simulation.twist[1] - expected).max()) / spin


def turns(axis: Array, angle: Array) -> Array:
    """Rotation matrices (s, 3, 3) about a unit axis by angles (s,) (Rodrigues' formula)."""
    x, y, z = axis
    k = np.array([(0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)])
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    matrices: Array = np.eye(3) + s * k + (1.0 - c) * (k @ k)
    return matrices


def slender_rod(dt: float = 1 / 240, steps: int = 40) -> Iterator[Gate]:
    """A rod that slides down a smooth wall moves by the same equation, and as exactly, however thin it is.

    ``(m l^2 + I) theta'' = m g l sin(theta)``, theta from the vertical (Lagrange), integrated in steps of dt / 64 by
    the classical fourth-order Runge-Kutta method.
    """
    inertia, state = 1.0 / 3.0, (0.3, 0.0)
    pull = GRAVITY / (1.0 + inertia)
    for _ in range(64 * steps):
        state = runge_kutta.move(lambda angle, _: pull * math.sin(angle), state, dt / 64.0)
    for radius in (0.1, 2e-3):
        start = (math.sin(0.3) + radius, math.cos(0.3) + radius, 0.5 * math.pi + 0.3)
        planes = [Body(HalfSpace(normal), motion="fixed") for normal in ((1.0, 0.0), (0.0, 1.0))]
        bodies = [*planes, Body(Capsule(1.0, radius), 1.0, inertia, start)]
        simulation = Simulation(Model(2, bodies, (0.0, -GRAVITY), 0.0, 0.0), Settings.reference(dt))
        simulation.advance(steps)
        error = float(simulation.pose[2, 2]) - 0.5 * math.pi - state[0]
        case = f"radius {radius:g} of half the length, {steps} steps"
        yield Gate.at_most("rod on a smooth wall: angle [rad]", case, error, 1e-10, "planar reference")
