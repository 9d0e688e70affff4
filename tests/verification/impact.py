"""Gates of impacts of the time-stepping profiles: rebound, bounces, overlap, walls that move or are thin."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np

from reference_solver.model import Array, Body
from reference_solver.settings import Settings
from tests.verification.gate import Gate
from tests.verification.space import GRAVITY, SPACES, Space, made_by

STEPS = (1 / 60, 1 / 240, 1 / 960)
SPEEDS = (1e-3, 1e-2, 0.1, 1.0, 10.0, 1e2, 1e3)
PHASES = tuple(k / 8 for k in range(8))
RESTITUTIONS = (0.0, 0.2, 0.5, 0.8, 0.95, 1.0)


def gates() -> Iterator[Gate]:
    """Yield every row of impacts."""
    for space in SPACES:
        for profile in ("classical", "reference"):
            yield from single_rebound(space, profile)
        yield from flat_rebound(space)
        yield from apexes(space)
        yield from rest_time(space)
        yield from elastic_bounces(space)
        yield from closing_wall(space)
        yield from deep_overlap(space)
        yield from turning_box(space)
        yield from thin_wall(space)


def settings_of(profile: str, dt: float) -> Settings:
    """Return the settings of a profile named."""
    made: Settings = getattr(Settings, profile)(dt)
    return made


def single_rebound(space: Space, profile: str) -> Iterator[Gate]:
    """A ball that meets the floor anywhere within a step leaves with e times its speed (E7)."""
    name = made_by(space, profile)
    for case, measure in (("no gravity, any phase", rebound_free), ("gravity, from touch", rebound_from_touch)):
        yield Gate.at_most("rebound, of max(v-, g dt)", case, measure(space, profile), 1e-14, name)
    if profile == "reference":
        error = rebound_falling(space)
        yield Gate.at_most("rebound, of max(v-, g dt)", "gravity, any phase, v >= 1 m/s", error, 1e-14, name)


def rebound_free(space: Space, profile: str) -> float:
    """Without gravity the speed at the impact is the one before it, at any phase of the step."""
    worst = 0.0
    for e, v, dt, phase in itertools.product(RESTITUTIONS, SPEEDS, STEPS, PHASES):
        ball = space.ball(0.0, 0.5 + phase * v * dt, space.twist(0.0, -v))
        simulation = space.simulation([space.floor(), ball], settings_of(profile, dt), 0.0, e)
        simulation.advance(3)
        worst = max(worst, abs(simulation.twist[1, space.up] - e * v) / v)
    return worst


def rebound_from_touch(space: Space, profile: str) -> float:
    """With gravity the ball starts in touch: by the loop of events it then has a step to slow down in, else none.

    A second impact within the step is another quantity, so that only 2 e u / g >= dt is measured.
    """
    worst = 0.0
    for e, v, dt in itertools.product(RESTITUTIONS, SPEEDS, STEPS):
        if 2.0 * e * v < GRAVITY * dt:
            continue
        ball = space.ball(0.0, 0.5, space.twist(0.0, -v))
        simulation = space.simulation([space.floor(), ball], settings_of(profile, dt), GRAVITY, e)
        simulation.advance(1)
        slowed = GRAVITY * dt if profile == "reference" else 0.0
        worst = max(worst, abs(simulation.twist[1, space.up] + slowed - e * v) / max(v, GRAVITY * dt))
    return worst


def rebound_falling(space: Space) -> float:
    """With gravity the ball falls a part of the step: it arrives with w = sqrt(v^2 + 2 g gap) after 2 gap / (v + w).

    Below 1 m/s the last place of the height coordinate, over v, is more than the gate.
    """
    worst = 0.0
    for e, v, dt, phase in itertools.product(RESTITUTIONS[1:], (1.0, 10.0, 1e2, 1e3), STEPS, PHASES[1:]):
        height = 0.5 + phase * v * dt
        gap = height - 0.5
        arrives = math.sqrt(v * v + 2.0 * GRAVITY * gap)
        left = dt - 2.0 * gap / (v + arrives)
        if 2.0 * e * arrives < GRAVITY * left:
            continue
        ball = space.ball(0.0, height, space.twist(0.0, -v))
        simulation = space.simulation([space.floor(), ball], Settings.reference(dt), GRAVITY, e)
        simulation.advance(1)
        error = simulation.twist[1, space.up] - (e * arrives - GRAVITY * left)
        worst = max(worst, abs(error) / max(v, GRAVITY * dt))
    return worst


def flat_rebound(space: Space) -> Iterator[Gate]:
    """A box that lands flat on all its corners leaves with e times its speed and no spin, whatever its friction."""
    ratio = spin = 0.0
    for e, v, dt, mu in itertools.product((0.2, 0.5, 0.8, 1.0), (1e-2, 1.0, 1e2), STEPS, (0.0, 0.5)):
        for phase in (0.0, 0.375):
            half = (0.5, 0.3)
            box = space.box(0.0, 0.3 + phase * v * dt, space.twist(0.0, -v), half)
            simulation = space.simulation([space.floor(), box], Settings.reference(dt), 0.0, e, mu)
            simulation.advance(3)
            twist = simulation.twist[1]
            ratio = max(ratio, abs(twist[space.up] / v - e))
            spin = max(spin, float(np.abs(twist[space.dimension :]).max(initial=0.0)) * half[0] / v)
    points = f"{2 ** (space.dimension - 1)} points"
    yield Gate.at_most("flat box: ratio of speeds - e", points, ratio, 1e-12, made_by(space, "reference"))
    yield Gate.at_most("flat box: spin, of v- / half width", points, spin, 1e-12, made_by(space, "reference"))


def apexes(space: Space, restitution: float = 0.8, height: float = 1.0, dt: float = 1 / 240) -> Iterator[Gate]:
    """Apexes of a bouncing ball, e^2n h (O16): in flight, height + v^2 / 2g is the apex of that flight."""
    simulation = space.simulation(
        [space.floor(), space.ball(0.0, 0.5 + height)], Settings.reference(dt), GRAVITY, restitution
    )
    fall = math.sqrt(2.0 * height / GRAVITY)
    lands = fall * np.cumsum([1.0, *(2.0 * restitution**n for n in range(1, 21))])
    record = simulation.record(math.ceil(lands[-1] / dt))
    reached = record.pose[:, 1, space.up] - 0.5 + record.twist[:, 1, space.up] ** 2 / (2.0 * GRAVITY)
    flight = np.searchsorted(lands, record.t)
    worst = 0.0
    for n in range(1, 21):
        found = reached[flight == n]  # more than two samples in each: the twentieth lasts 2.5 steps
        worst = max(worst, float(np.abs(found - restitution ** (2 * n) * height).max(initial=0.0)) / height)
        worst = worst if len(found) else math.inf
    case = f"e = {restitution:g}, dt = 1/{1 / dt:.0f}"
    yield Gate.at_most("20 apexes, of h0", case, worst, 1e-12, made_by(space, "reference"))


def rest_time(space: Space, restitution: float = 0.8, height: float = 1.0) -> Iterator[Gate]:
    """End of all bounces, (1 + e) / (1 - e) sqrt(2h/g) (O16), as steps can show it.

    With a step of that time over N, longer or shorter by a share s, the ball rests after N steps, or still moves. The
    measured value is the largest share at which it does not.
    """
    end = math.sqrt(2.0 * height / GRAVITY) * (1.0 + restitution) / (1.0 - restitution)
    worst = 0.0
    for steps in (1000, 1001):
        for share in 10.0 ** np.arange(-15.0, 0.0):
            for sign in (1.0, -1.0):
                settings = Settings.reference(end / steps * (1.0 + sign * share))
                bodies = [space.floor(), space.ball(0.0, 0.5 + height)]
                simulation = space.simulation(bodies, settings, GRAVITY, restitution)
                simulation.advance(steps)
                # what one step's weight leaves after a solve to 1e-13 is rest
                rests = abs(simulation.twist[1, space.up]) <= 1e-13 * GRAVITY * settings.dt
                worst = worst if rests == (sign > 0.0) else max(worst, float(share))
    yield Gate.at_most("rest time, relative", f"e = {restitution:g}", worst, 1e-12, made_by(space, "reference"))


def elastic_bounces(space: Space, count: int = 10_000, dt: float = 1 / 240) -> Iterator[Gate]:
    """Energy after many elastic bounces of the scheme that locates impacts."""
    simulation = space.simulation([space.floor(), space.ball(0.0, 1.5)], Settings.reference(dt), GRAVITY, 1.0)
    simulation.advance(math.ceil(2.0 * count * math.sqrt(2.0 / GRAVITY) / dt))
    height, speed = simulation.pose[1, space.up] - 0.5, simulation.twist[1, space.up]
    energy = (height + speed**2 / (2.0 * GRAVITY)) / 1.0
    case = f"e = 1, {count} bounces, dt = 1/{1 / dt:.0f}"
    yield Gate.at_most("energy, relative", case, energy - 1.0, 1e-9, made_by(space, "reference"))


def closing_wall(space: Space, speed: float = 1 / 128, hits: int = 200, dt: float = 1 / 256) -> Iterator[Gate]:
    """(v - V) L is constant where a wall closes in with speed V on an elastic ball (O18).

    The first sample after a hit of the moving wall tells how long ago ball and wall were in one place, and how far from
    the fixed wall that was. V dt is a power of two, so that the steps of the wall round nothing: with V = .01 and
    dt = 1/240 their sum is off by 1e-12, and the product by as much.
    """
    radius = 0.25
    bodies = [space.wall(1.0, 0.0), space.ball(1.0, 0.0, space.twist(1.0), radius), space.wall(-1.0, -4.0, -speed)]
    simulation = space.simulation(bodies, Settings.reference(dt), 0.0, 1.0)
    record = simulation.record(100_000)
    velocity, place = record.twist[:, 1, 0], record.pose[:, 1, 0]
    constants: list[float] = []
    for k in np.flatnonzero((velocity[:-1] > 0.0) & (velocity[1:] < 0.0))[:hits] + 1:
        after, surface = -float(velocity[k]), 4.0 + float(record.pose[k, 2, 0])
        since = (surface - float(place[k]) - radius) / (after - speed)
        room = surface + speed * since - 2.0 * radius
        constants.append((after - speed) * room)
    spread = (max(constants) - min(constants)) / constants[0] if len(constants) == hits else math.inf
    case = f"{len(constants)} hits, dt = 1/{1 / dt:.0f}"
    yield Gate.at_most("(v - V) L, relative spread", case, spread, 1e-12, made_by(space, "reference"))


def deep_overlap(space: Space, dt: float = 1 / 240) -> Iterator[Gate]:
    """Kinetic energy that overlap injects, over m_eff (delta / dt)^2 / 2: what removing it by velocity would cost."""
    worst = {"ball in ball": 0.0, "ball in floor": 0.0, "box in floor": 0.0}
    for share in (0.1, 0.3, 0.5, 0.7, 0.9):
        cases = {
            "ball in ball": ([space.ball(0.0, 0.0), space.ball(1.0 - share, 0.0)], 0.5),
            "ball in floor": ([space.floor(), space.ball(0.0, 0.5 - share)], 1.0),
            "box in floor": ([space.floor(), space.box(0.0, 0.5 - share)], 1.0),
        }
        for case, (bodies, effective) in cases.items():
            simulation = space.simulation(bodies, Settings.fixed_step(dt), 0.0, 0.0, 0.5)
            energy = 0.0
            for _ in range(10):
                simulation.advance(1)
                energy = max(energy, kinetic_energy(simulation.twist, bodies, space))
            worst[case] = max(worst[case], energy / (0.5 * effective * (share / dt) ** 2))
    for case, energy in worst.items():
        name = made_by(space, "fixed_step")
        yield Gate.at_most("overlap: energy, of m_eff (delta/dt)^2/2", f"{case}, 10..90 %", energy, 1e-15, name)


def kinetic_energy(twist: Array, bodies: Sequence[Body], space: Space) -> float:
    """Kinetic energy of bodies that turn about their principal axes only [J]."""
    total = 0.0
    for body, motion in zip(bodies, twist, strict=True):
        if body.motion == "free":
            linear, spin = motion[: space.dimension], motion[space.dimension :]
            total += 0.5 * body.mass * float(linear @ linear) + 0.5 * float(np.sum(np.array(body.inertia) * spin**2))
    return total


def turning_box(space: Space, dt: float = 1 / 240) -> Iterator[Gate]:
    """Overlap of a box that stands on the floor and is given a spin: it lifts one edge, lands on it, and stands.

    From the least spin that is more than round-off to one that lifts the edge for several steps.
    """
    half, worst = (0.5, 0.25), 0.0
    for exponent in range(-12, 1):
        box = space.box(0.0, half[1], space.twist(spin=10.0**exponent), half)
        simulation = space.simulation([space.floor(), box], Settings.reference(dt), GRAVITY, 0.0, 0.3)
        record = simulation.record(60)
        pose = record.pose[:, 1]
        lean = np.abs(pose[:, 2]) if space.dimension == 2 else 2.0 * np.arcsin(np.abs(pose[:, 5]))
        low = pose[:, space.up] - half[0] * np.sin(lean) - half[1] * np.cos(lean)
        worst = max(worst, -float(low.min()) / half[1])
    case = "spin 1e-12..1 rad/s"
    yield Gate.at_most("turning box: overlap, of half height", case, worst, 1e-12, made_by(space, "reference"))


def thin_wall(space: Space, dt: float = 1 / 60) -> Iterator[Gate]:
    """A ball thrown at a wall a hundredth of its size stays on its side, and returns with e times its speed.

    The loop looks for meetings in pieces of the wall's own size: what flies faster is refused for too many of them.
    """
    passed, worst = 0, 0.0
    for lengths, e, phase in itertools.product((1.0, 10.0, 100.0), (0.0, 0.5, 1.0), (0.0, 0.3, 0.9)):
        speed = lengths * 1.0  # body length: 1 m
        wall = space.box(0.0, 0.0, half=(0.005, 2.0), motion="fixed")
        ball = space.ball(-0.505 - (0.1 + phase) * speed * dt, 0.0, space.twist(speed))
        simulation = space.simulation([wall, ball], Settings.reference(dt), 0.0, e)
        record = simulation.record(4)
        passed += int((record.pose[:, 1, 0] > 0.0).any())
        worst = max(worst, abs(record.twist[-1, 1, 0] / speed + e))
    name = made_by(space, "reference")
    yield Gate.exactly("thin wall: passages", "1..100 lengths per second", passed, 0, name)
    yield Gate.at_most("thin wall: speed after, of v-", "1..100 lengths per second", worst, 0.0, name)
