"""One step of sequential impulses as `Settings.classical` makes it, in its plainest form, to be read.

Contacts are handed to it, sorted by (A, B, feature). Vectors are planar: a twist is (vx, vy, omega), and the cross
product of two vectors is a number.
"""

from dataclasses import dataclass, field
from itertools import groupby

import numpy as np


@dataclass
class World:
    pose: np.ndarray  # (n, 3): x, y [m], angle [rad]
    twist: np.ndarray  # (n, 3): vx, vy [m/s], omega [rad/s]
    acceleration: np.ndarray  # (n, 3), by loads; zero unless free
    inverse_mass: np.ndarray  # (n, 3): 1/m, 1/m, 1/I; zero unless free
    remembered: dict = field(default_factory=dict)  # of the step before


@dataclass
class Contact:
    a: int  # numbers of the bodies
    b: int
    feature: int
    normal: np.ndarray  # from A to B
    lever_a: np.ndarray  # place of contact minus centre of mass
    lever_b: np.ndarray
    gap: float
    restitution: float
    friction: float
    target: float = 0.0  # of u_n [m/s]
    push_target: float = 0.0  # of the pseudo-velocity [m/s]
    is_impact: bool = False
    p_n: float = 0.0  # impulses of this step [N s]
    p_t: float = 0.0
    p_push: float = 0.0

    def __post_init__(self):
        self.tangent = np.array([-self.normal[1], self.normal[0]])
        self.sides = (self.a, self.lever_a), (self.b, self.lever_b)
        self.name = self.a, self.b, self.feature


def step(world, contacts, dt, slop, beta=0.2, sweeps=10):
    for c in contacts:
        prepare(world, c, dt, slop, beta)
    world.twist += dt * world.acceleration  # E5
    for c in contacts:
        warm_start(world, c)
    push = np.zeros_like(world.twist)  # forgotten after the step
    for k in range(sweeps):
        sweep(world, push, contacts, backwards=k >= sweeps / 2)
    world.pose += dt * (world.twist + push)  # E17
    repeats = [c for c in contacts if not c.is_impact]
    world.remembered = {c.name: (c.p_n, c.p_t) for c in repeats}


def prepare(world, c, dt, slop, beta):
    u_n = c.normal @ relative_velocity(world.twist, c)  # before loads (E6)
    c.target = -max(c.gap - slop, 0.0) / dt  # may close, but no more (E8)
    if u_n < 0.0 < c.restitution:
        c.target = max(c.target, -c.restitution * u_n)  # E7
    excess = -c.gap - dt * max(c.target, 0.0) - slop  # overlap left (E16)
    c.push_target = (beta if excess > 0.0 else 1.0) * excess / dt
    c.p_push = 0.0
    of_a, of_b = (velocity(world.acceleration[i], r) for i, r in c.sides)
    by_loads = dt * (np.linalg.norm(of_a) + np.linalg.norm(of_b))
    c.is_impact = abs(u_n) > by_loads
    c.p_n, c.p_t = world.remembered.get(c.name, (0.0, 0.0))  # E9
    if u_n > by_loads:
        c.p_n = c.p_t = 0.0


def warm_start(world, c):
    c.p_t = np.clip(c.p_t, -c.friction * c.p_n, c.friction * c.p_n)
    apply(world, world.twist, c, c.p_n * c.normal + c.p_t * c.tangent)


def sweep(world, push, contacts, backwards):
    twist = world.twist
    for _, points in groupby(contacts, lambda c: (c.a, c.b)):
        for c in list(points)[:: -1 if backwards else 1]:
            c.p_n = solve(world, twist, c, c.normal, c.target, c.p_n)
            most = c.friction * c.p_n  # Coulomb
            c.p_t = solve(world, twist, c, c.tangent, 0.0, c.p_t, -most, most)
            c.p_push = solve(world, push, c, c.normal, c.push_target, c.p_push)


def solve(world, twist, c, direction, target, p, least=0.0, most=np.inf):
    """Relative velocity, impulse, clamp, apply; p is the sum of all sweeps."""
    u = direction @ relative_velocity(twist, c)
    k = inverse_effective_mass(world, c, direction)
    new = min(max(p - (u - target) / k, least), most)  # E10, E11
    apply(world, twist, c, (new - p) * direction)
    return new


def velocity(twist, r):
    """v + omega x r."""
    return twist[:2] + twist[2] * np.array([-r[1], r[0]])


def relative_velocity(twist, c):
    """Of B's point to A's (E1)."""
    return velocity(twist[c.b], c.lever_b) - velocity(twist[c.a], c.lever_a)


def wrench(r, p):
    """An impulse p and its moment r x p."""
    return np.array([p[0], p[1], r[0] * p[1] - r[1] * p[0]])


def apply(world, twist, c, p):
    """Add the impulse p to B and its opposite to A (E4)."""
    twist[c.b] += world.inverse_mass[c.b] * wrench(c.lever_b, p)
    twist[c.a] -= world.inverse_mass[c.a] * wrench(c.lever_a, p)


def inverse_effective_mass(world, c, direction):
    """What an impulse of 1 N s does to u along a direction (E3)."""
    k = 0.0
    for i, r in c.sides:
        k += world.inverse_mass[i] @ wrench(r, direction) ** 2
    return k
