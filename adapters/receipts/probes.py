"""Probe scenes: the smallest scenes that measure the properties of an engine.

    fall      gravity, step, sampling       a ball released from rest
    load      mass, inertia, turn           bodies under a constant force and torque
    flight    dampings                      free bodies without load, for a second
    landing   size, impulse                 a ball and a box on each of its faces touch a floor
    rebound   restitution                   balls hit a floor at several phases of a step
    slide     friction, friction_impulse    a box slides on a floor; its weight is an impulse as well
    corner    turn                          boxes land on a corner

A probe has the pair values of the judged scene, its friction where friction is measured (`Probe.rubs`), and runs in the
same step loop. A reader gives samples of a quantity (one per component, body or phase); `adapters.receipts` uses the
one farthest from the declared value.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from adapters.scene import Body, Box, Disc, HalfSpace, Pair, Scene, Sphere
from adapters.scene.lift import lift, lower_pose, lower_twist
from adapters.scene.near import rotation
from adapters.trajectory import Sampling, Trajectory

Samples = dict[str, tuple[float, ...]]

#: Steps of the short probes: enough to notice one step more or less, too few for errors to accumulate.
STEPS = 8
GRAVITY = 9.81
#: Rebound: speed [m/s], radius [m] and mass [kg] of the balls, and the part of a step after which they touch. They
#: start 3 steps of motion higher than that.
REBOUND_SPEED, REBOUND_RADIUS, REBOUND_MASS = 2.0, 0.5, 1.0
REBOUND_PHASES = (0.1, 0.37, 0.6, 0.87)
REBOUND_LEAD = 3
#: Time of a rebound [s]: twice that of the softest known contact (0.1 s).
REBOUND_TIME = 0.2
#: Sliding: least speed at the start [m/s], time [s], and half width of the box [m].
SLIDE_SPEED, SLIDE_TIME, SLIDE_WIDTH = 3.0, 0.5, 0.5
#: Friction up to which it brakes by at most a weight. Larger friction is used only in probes that measure friction: its
#: effects in an engine (a box sinks, or is thrown up) must not count as a wrong size or sign.
MOST_FRICTION = 1.0
#: Speed of the landing bodies [m/s]: low, since the motion of a step limits the accuracy of their size.
LANDING_SPEED = 0.25
LANDING_LEAD = 5.5
#: Half extents of probe boxes [m], all different so that a swap is noticed.
HALF_EXTENTS = (0.3, 0.4, 0.5)
#: Acceleration under load [m/s^2] and [rad/s^2].
LOAD_ACCELERATION, LOAD_SPIN_UP = 2.0, 1.5


@dataclass(frozen=True)
class Case:
    """Conditions of probes: pair values, step, and the engine's scheme and precision."""

    dimension: int
    restitution: float
    friction: float
    dt: float
    position_offset: float
    epsilon: float = 2.0**-52


@dataclass(frozen=True)
class Probe:
    """A scene, its quantities, and their readers.

    ``only_ends``: only the first and last state are used. ``touches``: with contact. ``rubs``: with the friction of the
    judged scene, however large; others have at most `MOST_FRICTION`. ``contacts``: contact impulses of every step are
    used.
    """

    quantities: tuple[str, ...]
    make: Callable[[Case], Scene]
    read: Callable[[Case, Scene, Trajectory], Samples]
    only_ends: bool = False
    touches: bool = True
    rubs: bool = False
    contacts: bool = False

    def sampling(self, case: Case, scene: Scene) -> Sampling:
        """Every step, with or without contacts, or only the ends."""
        if self.contacts:
            return Sampling(contacts_from=0.0)
        return Sampling(max(1, round(scene.duration / case.dt))) if self.only_ends else Sampling()


def _vector(case: Case, x: float, up: float) -> tuple[float, ...]:
    return (x, up) if case.dimension == 2 else (x, 0.0, up)


def _scene(case: Case, name: str, bodies: list[Body], duration: float, gravity: tuple[float, ...] = ()) -> Scene:
    pair = Pair(restitution=case.restitution, friction=case.friction)
    falling = gravity or _vector(case, 0.0, 0.0)
    gaining = case.restitution > 1.0  # as in the judged scene
    return Scene(f"probe_{name}", 1, case.dimension, tuple(bodies), (pair,), falling, duration, gaining=gaining)


def _pose(case: Case, x: float, up: float) -> tuple[float, ...]:
    return (x, up, 0.0) if case.dimension == 2 else (x, 0.0, up, 1.0, 0.0, 0.0, 0.0)


def _ball(case: Case, name: str, mass: float, radius: float, x: float = 0.0, up: float = 0.0) -> Body:
    """Disc or solid sphere with its own inertia (m r^2/2, 2 m r^2/5)."""
    if case.dimension == 2:
        return Body(name, Disc(radius), mass, 0.5 * mass * radius**2, _pose(case, x, up))
    return Body(name, Sphere(radius), mass, (0.4 * mass * radius**2,) * 3, _pose(case, x, up))


def _box(case: Case, name: str, mass: float, half: tuple[float, ...], x: float = 0.0, up: float = 0.0) -> Body:
    """Box with its own inertia; ``half`` (x, y, z), of which a planar one uses x and z."""
    a, b, c = half
    if case.dimension == 2:
        return Body(name, Box((a, c)), mass, mass * (a * a + c * c) / 3.0, _pose(case, x, up))
    moments = (b * b + c * c, a * a + c * c, a * a + b * b)
    inertia = (mass * moments[0] / 3.0, mass * moments[1] / 3.0, mass * moments[2] / 3.0)
    return Body(name, Box(half), mass, inertia, _pose(case, x, up))


def _floor(case: Case, offset: float = 0.0) -> Body:
    return Body("floor", HalfSpace(_vector(case, 0.0, 1.0), offset), motion="fixed")


# ---- fall --------------------------------------------------------------------------------------------------------


def _fall_gravity(case: Case) -> tuple[float, ...]:
    """Oblique, with different components, so that a swapped axis or a wrong sign is noticed."""
    direction = (0.6, -0.8) if case.dimension == 2 else (0.48, 0.36, -0.8)
    return tuple(GRAVITY * c for c in direction)


def fall(case: Case) -> Scene:
    """A ball released at the origin."""
    return _scene(case, "fall", [_ball(case, "ball", 1.0, 0.5)], STEPS * case.dt, _fall_gravity(case))


def read_fall(case: Case, scene: Scene, trajectory: Trajectory) -> Samples:
    """Gravity from the growth of speed, step from path and speed, and the delay of states in steps.

    Position follows ``x = g t^2/2 + position_offset g t dt/2`` and velocity ``v = g t`` [discrete laws of free fall];
    the difference over the path of one step is the delay in steps.
    """
    d, dt, half = case.dimension, case.dt, STEPS // 2
    g, t = np.array(scene.gravity), STEPS * dt
    x, v = trajectory.pose[:, 0, :d], trajectory.twist[:, 0, :d]
    gain = (v[-1] - v[half]) / ((STEPS - half) * dt)
    new, old = (1.0 + case.position_offset) / 2.0, (1.0 - case.position_offset) / 2.0
    path = dt * (new * v[half + 1 :] + old * v[half:-1]).sum(axis=0)
    law = 0.5 * g * t * t + 0.5 * case.position_offset * g * t * dt
    delay = np.concatenate([(law - x[-1]) / (g * t * dt), (g * t - v[-1]) / (g * dt)])
    return {"gravity": tuple(gain / g), "step": tuple((x[-1] - x[half]) / path), "sampling": tuple(delay)}


# ---- load --------------------------------------------------------------------------------------------------------


def load(case: Case) -> Scene:
    """Bodies with an inertia other than their shape's, one for each axis, under force and torque."""
    return _scene(case, "load", _planar_load(case) if case.dimension == 2 else _spatial_load(case), STEPS * case.dt)


def _planar_load(case: Case) -> list[Body]:
    ball = _ball(case, "ball", 2.0, 0.5)
    box = replace(_box(case, "box", 3.0, HALF_EXTENTS), pose=(10.0, 0.0, 0.4))
    bodies = []
    for body, inertia in ((ball, 0.7), (box, 1.3)):
        push = LOAD_ACCELERATION * body.mass
        bodies.append(replace(body, inertia=inertia, force=(0.6 * push, -0.8 * push), torque=(inertia * LOAD_SPIN_UP,)))
    return bodies


def _spatial_load(case: Case) -> list[Body]:
    """Rotated boxes, each with a torque about one of its principal axes, so that none precesses."""
    turn = (0.5, 0.1, 0.7, 0.5)  # a unit quaternion with four different components
    axes, moments = rotation(np.array(turn)), (1.0, 1.2, 1.5)
    ball = replace(_ball(case, "ball", 2.0, 0.5), torque=tuple(0.2 * LOAD_SPIN_UP * c for c in (0.6, 0.0, 0.8)))
    bodies = [ball]
    for axis in range(3):
        box = _box(case, f"box {'xyz'[axis]}", 3.0, HALF_EXTENTS)
        torque = tuple(float(moments[axis] * LOAD_SPIN_UP * c) for c in axes[:, axis])
        bodies.append(replace(box, inertia=moments, pose=(10.0 * (axis + 1), 0.0, 0.0, *turn), torque=torque))
    push = (0.48, 0.36, -0.8)
    return [replace(b, force=tuple(LOAD_ACCELERATION * b.mass * c for c in push)) for b in bodies]


def read_load(case: Case, scene: Scene, trajectory: Trajectory) -> Samples:
    """``m = F t / dv`` and ``I = T t / d omega`` over the stated values; +1 where pose and spin follow the torque.

    From the second half, so that a delayed state does not look like a heavy body.
    """
    d, half = case.dimension, STEPS // 2
    t = (STEPS - half) * case.dt
    mass, inertia, turn = [], [], []
    for i, body in enumerate(scene.bodies):
        gain = trajectory.twist[-1, i] - trajectory.twist[half, i]
        torque = np.array(body.torque)
        about = float(np.linalg.norm(torque))
        spin, angle = float(gain[d:] @ torque) / about, float(_turned(case, trajectory, i) @ torque)
        with np.errstate(divide="ignore"):
            mass += list(np.array(body.force) * t / (gain[:d] * body.mass))
            inertia.append(float(np.divide(LOAD_SPIN_UP * t, spin)))
        turn += [float(np.sign(spin)), float(np.sign(angle))]
    return {"mass": tuple(mass), "inertia": tuple(inertia), "turn": tuple(turn)}


def _turned(case: Case, trajectory: Trajectory, i: int) -> np.ndarray:
    """Small turn of body ``i`` from the first to the last sample as a vector in world axes, (1,) or (3,) [rad]."""
    first, last = trajectory.pose[0, i], trajectory.pose[-1, i]
    if case.dimension == 2:
        return np.array([last[2] - first[2]])
    r = rotation(last[3:]) @ rotation(first[3:]).T
    return 0.5 * np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])


# ---- flight ------------------------------------------------------------------------------------------------------


def flight(case: Case) -> Scene:
    """A ball and a box at 1 m/s and 1 rad/s, for one second or a thousand steps; equal moments, so none precesses."""
    steps = min(max(STEPS, round(1.0 / case.dt)), 1000)
    twist = (0.6, -0.8, 1.0) if case.dimension == 2 else (0.48, 0.36, -0.8, 0.6, 0.0, 0.8)
    ball, box = _ball(case, "ball", 1.0, 0.5), _box(case, "box", 1.0, (0.5, 0.5, 0.5), 10.0)
    return _scene(case, "flight", [replace(ball, twist=twist), replace(box, twist=twist)], steps * case.dt)


def read_flight(case: Case, scene: Scene, trajectory: Trajectory) -> Samples:
    """Share of the speed lost in one second, extrapolated from a shorter flight."""
    d, t = case.dimension, trajectory.t[-1]
    linear = np.linalg.norm(trajectory.twist[:, :, :d], axis=2)
    angular = np.linalg.norm(trajectory.twist[:, :, d:], axis=2)
    loss = [tuple(1.0 - (speed[-1] / speed[0]) ** (1.0 / t)) for speed in (linear, angular)]
    return {"linear_damping": loss[0], "angular_damping": loss[1]}


# ---- landing -----------------------------------------------------------------------------------------------------


def _upright(case: Case) -> list[tuple[str, float, tuple[float, ...]]]:
    """Name, half height [m] and turn of the probe box standing on each of its faces."""
    a, b, c = HALF_EXTENTS
    s = math.sqrt(0.5)
    if case.dimension == 2:
        return [("x", a, (0.5 * math.pi,)), ("z", c, (0.0,))]
    return [("x", a, (s, 0.0, s, 0.0)), ("y", b, (s, s, 0.0, 0.0)), ("z", c, (1.0, 0.0, 0.0, 0.0))]


def landing(case: Case) -> Scene:
    """A ball and a box on each of its faces approach a floor that is not at height 0, without gravity."""
    step, floor = LANDING_SPEED * case.dt, 0.25
    down = (*_vector(case, 0.0, -LANDING_SPEED), *((0.0,) if case.dimension == 2 else (0.0, 0.0, 0.0)))
    bodies = [_floor(case, floor), _ball(case, "ball", 1.0, 0.4, 0.0, floor + 0.4 + LANDING_LEAD * step)]
    for k, (axis, height, turn) in enumerate(_upright(case)):
        box = _box(case, f"box {axis}", 1.0, HALF_EXTENTS, 5.0 * (k + 1), floor + height + LANDING_LEAD * step)
        bodies.append(replace(box, pose=(*box.pose[: case.dimension], *turn)))
    return _scene(
        case,
        "landing",
        bodies[:1] + [replace(body, twist=down) for body in bodies[1:]],
        (2.0 * LANDING_LEAD + 1.0) * case.dt,
    )


def read_landing(case: Case, scene: Scene, trajectory: Trajectory) -> Samples:
    """Height of the centre above the floor when the body is first slowed; impulses over the momentum change.

    Slowed: by more than its whole speed in a second, ten times the largest known drag and a hundredth of the softest
    contact. A body that is never slowed gets its final height, an upper bound of its size.
    """
    up, heights = case.dimension - 1, [0.4] + [height for _, height, _ in _upright(case)]
    ratios = []
    for i, height in enumerate(heights, start=1):
        v, x = trajectory.twist[:, i, up], trajectory.pose[:, i, up] - 0.25
        slowed = np.flatnonzero(np.abs(np.diff(v)) > LANDING_SPEED * case.dt)
        ratios.append(float(x[slowed[0] if len(slowed) else -1]) / height)
    return {"size": tuple(ratios), **_reported(_landing_impulses(case, scene, trajectory))}


def _landing_impulses(case: Case, scene: Scene, trajectory: Trajectory) -> list[float]:
    """Reported contact impulse over m dv, for every body; none for a body with constant speed."""
    up, ratios = case.dimension - 1, []
    for i, body in enumerate(scene.bodies[1:], start=1):
        change = body.mass * float(trajectory.twist[-1, i, up] - trajectory.twist[0, i, up])
        if abs(change) > body.mass * LANDING_SPEED * case.dt:  # slowed, as in `read_landing`
            ratios.append(_impulse_on(trajectory, i)[up] / change)
    return ratios


def _impulse_on(trajectory: Trajectory, i: int) -> np.ndarray:
    """Sum of the reported impulses of the floor (body 0) on body ``i`` (d,) [N s]; NaN if unavailable."""
    assert trajectory.contacts is not None
    return np.asarray(trajectory.contacts.impulse_between(0, i).sum(axis=0))


def _reported(ratios: list[float], quantity: str = "impulse") -> Samples:
    """Samples of reported impulses; none where the engine reports none."""
    return {} if not ratios or any(math.isnan(ratio) for ratio in ratios) else {quantity: tuple(ratios)}


# ---- rebound -----------------------------------------------------------------------------------------------------


def rebound(case: Case) -> Scene:
    """Balls that reach the floor at different phases of a step, without gravity."""
    step = REBOUND_SPEED * case.dt
    bodies = [_floor(case)]
    for k, phase in enumerate(REBOUND_PHASES):
        height = REBOUND_RADIUS + (REBOUND_LEAD + phase) * step
        ball = _ball(case, f"ball {k}", REBOUND_MASS, REBOUND_RADIUS, 5.0 * k, height)
        spin = (0.0,) * len(ball.pose[case.dimension :]) if case.dimension == 2 else (0.0, 0.0, 0.0)
        bodies.append(replace(ball, twist=(*_vector(case, 0.0, -REBOUND_SPEED), *spin)))
    return _scene(case, "rebound", bodies, (REBOUND_LEAD + 4) * case.dt + REBOUND_TIME)


def read_rebound(case: Case, scene: Scene, trajectory: Trajectory) -> Samples:
    """Speed of leaving over speed of approach, at each phase."""
    up = case.dimension - 1
    return {"restitution": tuple(trajectory.twist[-1, 1:, up] / REBOUND_SPEED)}


# ---- slide -------------------------------------------------------------------------------------------------------


def slide_load(friction: float) -> float:
    """Gravity of the slide [m/s^2]: less above `MOST_FRICTION`, so that braking is at most one weight.

    With full gravity a friction of 10 would need a box of 115 m/s, where drag and speed limits act.
    """
    return GRAVITY / max(MOST_FRICTION, friction)


def slide_speed(friction: float) -> float:
    """Speed at which twice the friction does not stop the box within the window [m/s]; 0.85 is a margin."""
    return max(SLIDE_SPEED, 2.0 * friction * slide_load(friction) * SLIDE_TIME / 0.85)


def slide_height(friction: float) -> float:
    """Half height of the sliding box [m]: flatter above mu = 0.5, so that it is far from tipping."""
    return SLIDE_WIDTH * min(1.0, 0.5 / friction) if friction > 0.0 else SLIDE_WIDTH


def slide(case: Case) -> Scene:
    """A box slides along x."""
    speed, height = slide_speed(case.friction), slide_height(case.friction)
    box = _box(case, "box", 1.0, (SLIDE_WIDTH, SLIDE_WIDTH, height), 0.0, height)
    twist = (*_vector(case, speed, 0.0), *((0.0,) if case.dimension == 2 else (0.0, 0.0, 0.0)))
    down = _vector(case, 0.0, -slide_load(case.friction))
    return _scene(case, "slide", [_floor(case), replace(box, twist=twist)], SLIDE_TIME, down)


def read_slide(case: Case, scene: Scene, trajectory: Trajectory) -> Samples:
    """Friction impulse over normal impulse, from the change of momentum (a hop does not count) and as reported.

    Reported impulses do not contain other braking; the reported weight is an impulse as well.
    """
    up, mass = case.dimension - 1, scene.bodies[1].mass
    change = mass * (trajectory.twist[-1, 1] - trajectory.twist[0, 1])
    normal = change[up] - mass * scene.gravity[up] * trajectory.t[-1]
    reported = _impulse_on(trajectory, 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        friction = float(np.divide(-change[0], normal))
        told = float(np.divide(-reported[0], reported[up]))
        weight = float(np.divide(reported[up], normal))
    silent = bool(np.isnan(reported).any())
    samples: Samples = {"friction": (friction,)}
    return samples if silent else {**samples, "friction_impulse": (told,), "impulse": (weight,)}


# ---- corner ------------------------------------------------------------------------------------------------------


def corner(case: Case) -> Scene:
    """Squares tilted either way land on their lower corner, without gravity; embedded in 3-D for a spatial case."""
    planar, half, speed = replace(case, dimension=2), 0.5, 0.5
    bodies = [_floor(planar)]
    for k, tilt in enumerate((0.3, -0.3)):
        height = half * (math.cos(tilt) + abs(math.sin(tilt))) + 2.5 * speed * case.dt
        box = _box(planar, f"box {k}", 1.0, (half, half, half))
        bodies.append(replace(box, pose=(5.0 * k, height, tilt), twist=(0.0, -speed, 0.0)))
    scene = _scene(planar, "corner", bodies, STEPS * case.dt)
    return scene if case.dimension == 2 else lift(scene)


def read_corner(case: Case, scene: Scene, trajectory: Trajectory) -> Samples:
    """+1 for each box that turns towards its face, in angle and in spin."""
    poses, twists = [trajectory.pose[0], trajectory.pose[-1]], trajectory.twist[-1]
    if case.dimension == 3:
        poses, twists = [lower_pose(pose) for pose in poses], lower_twist(twists)
    (first, last), turn = (pose[1:, 2] for pose in poses), []
    tilt = np.array([0.3, -0.3])
    turn += list(np.sign((first - last) * tilt)) + list(-np.sign(twists[1:, 2] * tilt))
    return {"turn": tuple(float(sign) for sign in turn)}


PROBES = {
    "fall": Probe(("gravity", "step", "sampling"), fall, read_fall, touches=False),
    "load": Probe(("mass", "inertia", "turn"), load, read_load, touches=False),
    "landing": Probe(("size", "impulse"), landing, read_landing, contacts=True),
    "flight": Probe(("linear_damping", "angular_damping"), flight, read_flight, only_ends=True, touches=False),
    "rebound": Probe(("restitution",), rebound, read_rebound, only_ends=True, rubs=True),
    "slide": Probe(("friction", "friction_impulse", "impulse"), slide, read_slide, rubs=True, contacts=True),
    "corner": Probe(("turn",), corner, read_corner, only_ends=True),
}
