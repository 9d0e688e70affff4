"""Impacts that accumulate: certified answers against the law, pair after pair, in numbers of 50 digits (E21, E22)."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from decimal import Decimal, localcontext

import numpy as np
import pytest

from reference_solver import Body, Box, Capsule, Disc, HalfSpace, Model, Settings, Simulation, Sphere
from reference_solver.certificate.audit import chains
from reference_solver.certificate.truth import certify

DIGITS, MOST = 50, 30_000
#: Rebounds are spent below the first [m/s]; what is slower than the second across a gap below the third lies as well.
SPENT, MUCH_LESS, NOTHING = Decimal("1e-24"), Decimal("1e-17"), Decimal("1e-17")
ZERO, ONE, ENDLESS = Decimal(0), Decimal(1), Decimal("Infinity")


@dataclass(frozen=True)
class Row:
    """Balls in a row, the first before a wall if there is one, the last before another; along one axis.

    Contact c is between ball c - 1 and ball c: 0 and the last are those with walls.
    """

    gaps: tuple[float | None, ...]  # (n + 1,): None where there is no wall [m]
    masses: tuple[float, ...]  # (n,) [kg]
    speeds: tuple[float, ...]  # (n,) [m/s]
    restitution: tuple[float, ...]  # (n + 1,)
    gravity: float = 0.0  # against the axis [m/s^2]

    @property
    def contacts(self):
        return sum(gap is not None for gap in self.gaps)

    def truth(self, times):
        """Ways (s, n) of all balls at ``times`` by Newton's law for whoever meets [m]; None: too many impacts.

        What lies on each other takes part. An impact slower than `SPENT` leaves no rebound: all that is left of a
        series, or of a chain, is nothing.
        """
        with localcontext() as context:
            context.prec = DIGITS
            law = Law(self)
            ways = []
            for t in times:
                if not law.go_to(Decimal(t)):
                    return None
                ways.append([float(x) for x in law.way])
            return np.array(ways)


class Law:
    """Exact motion of a row of balls: gaps and relative velocities are kept as such, so that none is a difference."""

    def __init__(self, row):
        n = len(row.masses)
        self.t, self.made = ZERO, 0
        self.inverse = [ZERO, *(ONE / Decimal(m) for m in row.masses), ZERO]
        self.gap = [ENDLESS if gap is None else Decimal(gap) for gap in row.gaps]
        self.v = [Decimal(v) for v in row.speeds]
        self.e = [Decimal(e) for e in row.restitution]
        self.free = [-Decimal(row.gravity)] * n
        self.way = [ZERO] * n
        self.u = [b - a for a, b in itertools.pairwise([ZERO, *self.v, ZERO])]
        self.lies = [False] * (n + 1)

    def push(self, values, relative, c, p):
        """Give the impulse p of contact c to both its bodies, whose velocities or accelerations are ``values``."""
        if c > 0:
            values[c - 1] -= p * self.inverse[c]
            relative[c - 1] -= p * self.inverse[c]
        if c < len(values):
            values[c] += p * self.inverse[c + 1]
            relative[c + 1] -= p * self.inverse[c + 1]
        relative[c] += p * (self.inverse[c] + self.inverse[c + 1])

    def solve(self, contacts, values, relative, wanted):
        """Least impulses with which all ``contacts`` go apart at least as fast as ``wanted``: one of 2^c cases."""
        for pressed in itertools.product((False, True), repeat=len(contacts)):
            active = [c for c, on in zip(contacts, pressed, strict=True) if on]
            impulse = self.tridiagonal(active, [wanted[c] - relative[c] for c in active])
            trial = [list(values), list(relative)]
            for c, p in zip(active, impulse, strict=True):
                self.push(*trial, c, p)
            least = Decimal("1e-40") * max([ONE, *map(abs, relative)])
            if all(p >= 0 for p in impulse) and all(trial[1][c] >= wanted[c] - least for c in contacts):
                return trial
        raise AssertionError("no impulses")

    def tridiagonal(self, active, right):
        """Solve for the impulses of contacts in ascending order: only neighbours share a ball."""
        diagonal = [self.inverse[c] + self.inverse[c + 1] for c in active]
        right = list(right)
        above = [-self.inverse[c + 1] if d == c + 1 else ZERO for c, d in itertools.pairwise(active)]
        for i in range(1, len(active)):
            factor = above[i - 1] / diagonal[i - 1]
            diagonal[i] -= factor * above[i - 1]
            right[i] -= factor * right[i - 1]
        for i in reversed(range(len(active))):
            right[i] = (right[i] - (above[i] * right[i + 1] if i + 1 < len(active) else ZERO)) / diagonal[i]
        return right

    def accelerations(self):
        a = list(self.free)
        relative = [y - x for x, y in itertools.pairwise([ZERO, *a, ZERO])]
        lying = [c for c in range(len(self.gap)) if self.lies[c]]
        if lying:
            a, relative = self.solve(lying, a, relative, [ZERO] * len(relative))
            for c in lying:
                self.lies[c] = abs(relative[c]) < Decimal("1e-40")
                relative[c] = ZERO if self.lies[c] else relative[c]
        return a, relative

    def go_to(self, until):
        while True:
            a, relative = self.accelerations()
            nearest, which = until - self.t, -1
            for c, gap in enumerate(self.gap):
                if gap != ENDLESS and not self.lies[c]:
                    t = time_to_close(gap, self.u[c], relative[c])
                    if t < nearest:
                        nearest, which = t, c
            half = nearest * nearest / 2
            for i in range(len(self.v)):
                self.way[i] += self.v[i] * nearest + a[i] * half
                self.v[i] += a[i] * nearest
            for c in range(len(self.gap)):
                self.gap[c] += self.u[c] * nearest + relative[c] * half
                self.u[c] += relative[c] * nearest
            self.t += nearest
            if which < 0:
                return True
            self.made += 1
            if self.made > MOST:
                return False
            self.strike(which)

    def strike(self, which):
        self.gap[which] = ZERO
        slow = -self.u[which] * self.e[which] < SPENT
        wanted = [ZERO] * len(self.gap)
        wanted[which] = ZERO if slow else -self.e[which] * self.u[which]
        struck = sorted({which, *(c for c in range(len(self.gap)) if self.lies[c])})
        self.v, self.u = self.solve(struck, self.v, self.u, wanted)
        for c in range(len(self.gap)):
            # What was struck in turn with what is spent is spent as well: speeds of a chain fall together.
            near = slow and self.gap[c] < NOTHING and abs(self.u[c]) < MUCH_LESS
            self.lies[c] = near or (c in struck and abs(self.u[c]) < SPENT)
            self.u[c], self.gap[c] = (ZERO, ZERO) if self.lies[c] else (self.u[c], self.gap[c])


def time_to_close(gap, u, a):
    """First time at which ``gap + u t + a t^2/2`` falls through zero."""
    if a == 0:
        return gap / -u if u < 0 else ENDLESS
    inside = u * u - 2 * a * gap
    if inside < 0 or (a > 0 and u >= 0):
        return ENDLESS
    root = inside.sqrt()
    if a > 0:
        return 2 * gap / (-u + root)
    return (u + root) / -a if u >= 0 else 2 * gap / (-u + root)


SHAPES = {
    2: {"ball": (Disc(0.1), 0.005), "box": (Box((0.1, 0.1)), 0.02 / 3), "rod": (Capsule(0.05, 0.05), 0.003)},
    3: {
        "ball": (Sphere(0.1), (0.004,) * 3),
        "box": (Box((0.1, 0.1, 0.1)), (0.02 / 3,) * 3),
        "rod": (Capsule(0.05, 0.05), (0.001, 0.003, 0.003)),
    },
}


def world(row, d, turn=0.0, place=0.0, kind="ball", friction=0.0, floor=False):
    """The row along an axis turned by ``turn`` [rad], its first wall ``place`` metres out in all directions."""
    along = np.zeros(d)
    along[0], along[1] = math.cos(turn), math.sin(turn)
    shape, moment = SHAPES[d][kind]
    pose = (turn,) if d == 2 else (math.cos(0.5 * turn), 0.0, 0.0, math.sin(0.5 * turn))
    flat = (0.0,) if d == 2 else (1.0, 0.0, 0.0, 0.0)
    start, bodies, at = np.full(d, place), [], 0.0
    for i, (m, v) in enumerate(zip(row.masses, row.speeds, strict=True)):
        at += (row.gaps[i] or 0.0) + 0.1
        twist = (*(v * along), *np.zeros(1 if d == 2 else 3))
        inertia = m * moment if d == 2 else tuple(m * x for x in moment)
        bodies.append(Body(shape, m, inertia, (*(start + at * along), *pose), twist))
        at += 0.1
    n = len(bodies)
    restitution = np.zeros((n + 2 + floor,) * 2)
    for i in range(1, n):
        restitution[i - 1, i] = restitution[i, i - 1] = row.restitution[i]
    walls = ((0, along, start, 0), (n, -along, start + (at + (row.gaps[-1] or 0.0)) * along, n - 1))
    for c, normal, where, ball in walls:
        if row.gaps[c] is not None:
            k = len(bodies)
            bodies.append(Body(HalfSpace(tuple(normal)), pose=(*where, *flat), motion="fixed"))
            restitution[k, ball] = restitution[ball, k] = row.restitution[c]
    gravity = -row.gravity * along
    if floor:
        up = np.eye(d)[-1]
        bodies.append(Body(HalfSpace(tuple(up)), pose=(*(start - 0.1 * up), *flat), motion="fixed"))
        gravity = gravity - 9.81 * up
    k = len(bodies)
    return Model(d, bodies, tuple(gravity), restitution[:k, :k], friction), along


def judged(row, d, steps=60, **how):
    """Certificate of a row, and how much farther it is off the truth than it says at most [m]; 0 where the truth is
    not known."""
    model, along = world(row, d, **how)
    found = certify(model, Settings.reference(1.0 / 240.0), steps, 6)
    ways = row.truth(found.t)
    if ways is None:
        return found, 0.0
    n = len(row.masses)
    off = np.abs((found.pose[:, :n, :d] - found.pose[:1, :n, :d]) @ along - ways).max(axis=1)
    place = float(np.abs(found.pose[:, :n, :d]).max())
    within = found.t < found.horizon
    return found, float((off - found.error - found.rounding(place))[within].max())


COLLAPSE = Row((0.01, 0.01, None), (0.01, 1.0), (0.0, -1.0), (0.4, 0.4, 0.0))
VARIATIONS = {
    "as it is": {},
    "oblique": {"turn": 0.7},
    "far away": {"place": 1000.0},
    "very far away": {"place": 30_000.0},
    "boxes": {"kind": "box"},
    "rods end to end": {"kind": "rod"},
    "on a smooth floor": {"floor": True},
}
#: Masses, e and gaps: less light, hardly bouncing, gaps that one impact makes round-off, heavy and light the other way.
ROWS = {
    "light ball caught": COLLAPSE,
    "not so light": replace(COLLAPSE, masses=(0.05, 1.0), restitution=(0.15, 0.15, 0.0)),
    "gaps of round-off after two impacts": replace(COLLAPSE, restitution=(1e-5, 1e-5, 0.0)),
    "unlike e": replace(COLLAPSE, restitution=(0.1, 0.5, 0.0)),
    "heavy ball caught": replace(COLLAPSE, masses=(1.0, 0.01), gaps=(0.01, 0.01, None)),
    "elastic": replace(COLLAPSE, restitution=(1.0, 1.0, 0.0)),
    "falls": replace(COLLAPSE, gravity=9.81),
    "three balls": Row((None, 0.02, 0.01, None), (1.0, 0.01, 2.0), (1.0, 0.0, -1.0), (0.0, 0.4, 0.3, 0.0)),
}


@pytest.mark.few(6)
@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("name", VARIATIONS)
def test_light_ball_caught_between_a_wall_and_a_heavy_one(name, d):
    """Newton's law has infinitely many impacts in a finite time; both are at rest at the wall then."""
    found, beyond = judged(COLLAPSE, d, **VARIATIONS[name])
    assert found.holds, found.reasons
    assert beyond <= 0.0


@pytest.mark.few(6)
@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("name", ROWS)
def test_certified_rows_with_two_contacts(name, d):
    found, beyond = judged(ROWS[name], d)
    assert found.holds, found.reasons
    assert beyond <= 0.0


@pytest.mark.parametrize("d", [2, 3])
def test_friction_of_rows_without_slip(d):
    """What is left of the impacts is summed up, which the audit proves without friction alone."""
    found, beyond = judged(COLLAPSE, d, friction=0.3)
    assert [reason for reason in found.reasons if "summed up" in reason] == list(found.reasons)
    assert beyond <= 0.0


def drawn(rng):
    """Two to five balls, their masses over two and a half decades, walls or none, gravity in one of four."""
    n = int(rng.integers(2, 6))
    walls = ((True, False), (True, True), (False, False))[int(rng.choice(3, p=(0.6, 0.2, 0.2)))]
    gaps = [float(10.0 ** rng.uniform(-3.0, -1.0)) for _ in range(n + 1)]
    same = rng.uniform() < 0.5
    e = [float(rng.uniform(0.0, 0.9))] * (n + 1) if same else [float(x) for x in rng.uniform(0.0, 0.9, n + 1)]
    return Row(
        (gaps[0] if walls[0] else None, *gaps[1:-1], gaps[-1] if walls[1] else None),
        tuple(float(10.0 ** rng.uniform(-1.5, 1.0)) for _ in range(n)),
        tuple(sorted((float(x) for x in rng.uniform(-1.5, 0.5, n)), reverse=True)),
        tuple(e),
        9.81 if walls[0] and rng.uniform() < 0.3 else 0.0,
    )


def judged_by_seed(seed, d):
    """`judged` of a row that is drawn, in one of two along a direction that is drawn as well; and its contacts."""
    rng = np.random.default_rng(seed)
    row = drawn(rng)
    return *judged(row, d, turn=float(rng.choice([0.0, rng.uniform(-3.0, 3.0)]))), row.contacts


def certified_and_wrong(d, seeds):
    """Whether rows with two contacts at most are certified, and seeds of what is certified and off by more than X."""
    short, wrong = [], []
    for seed in seeds:
        found, beyond, contacts = judged_by_seed(seed, d)
        if found.holds and beyond > 0.0:
            wrong.append((seed, beyond))
        if contacts <= 2:
            short.append(found.holds)
    return short, wrong


@pytest.mark.parametrize(("d", "seeds"), [(2, range(6)), (3, range(120, 122))])
def test_certified_rows_of_balls_against_the_law(d, seeds):
    """What is refused says why."""
    assert not certified_and_wrong(d, seeds)[1]


@pytest.mark.long
@pytest.mark.parametrize(("d", "seeds"), [(2, range(120)), (3, range(120, 200))])
def test_share_of_rows_with_two_contacts_certified(d, seeds):
    short, wrong = certified_and_wrong(d, seeds)
    assert not wrong
    assert sum(short) >= 0.8 * len(short) and len(short) > 10


def test_hundreds_of_rebounds_in_a_step():
    floor = Body(HalfSpace((0.0, 1.0)), motion="fixed")
    ball = Body(Disc(0.1), 1.0, 0.005, (0.0, 0.1001, 0.0))
    simulation = Simulation(Model(2, [floor, ball], (0.0, -9.81), 0.97, 0.0), Settings.reference(1.0 / 30.0))
    simulation.advance(60)
    assert simulation.pose[1, 1] == pytest.approx(0.1, abs=1e-12)


@pytest.mark.parametrize("e", [0.0725, 0.073, 0.0734])
def test_horizon_of_a_later_blow_on_the_rest_of_a_chain(e):
    """Of three equal balls with e just above 7 - 4 sqrt 3 impacts end, and leave them parting at less than 1e-11 m/s.

    A fourth that comes later strikes them in turn; at round-off they lie, and are struck at once.
    """
    place, speeds = (0.0, 0.5625, 1.25, 2.8), (0.0, 0.0, -1.0, -1.5)
    restitution = np.full((4, 4), 0.5)
    for i in range(2):
        restitution[i, i + 1] = restitution[i + 1, i] = e
    bodies = [Body(Disc(0.25), 1.0, 0.03, (x, 0.0, 0.0), (v, 0.0, 0.0)) for x, v in zip(place, speeds, strict=True)]
    found = certify(Model(2, bodies, (0.0, 0.0), restitution, 0.0), Settings.reference(1.0 / 240.0), 300)
    assert found.holds, found.reasons
    struck = 1.025  # [s] by the law of each pair in 60 digits, whatever e of these is
    assert struck - 1e-9 <= found.horizon <= struck + 1.0 / 240.0 + 1e-9


def test_cycle_in_which_a_pair_would_pull_at_a_point():
    """Two points of one pair and one of another; the first impact would take -.064 kg m/s at the first point."""
    yields = np.array([[6.06, 1.312, -10.501], [1.312, 0.913, -3.342], [-10.501, -3.342, 20.035]])
    e, pairs = np.array([0.071, 0.071, 0.0475]), np.array([[0, 1], [0, 1], [1, 2]])
    pulls, presses = np.array([-0.5123, -0.5304, 0.1666]), np.array([-0.8132, -0.2327, 0.0734])
    assert np.linalg.solve(yields[:2, :2], -pulls[:2]).min() < 0.0 < np.linalg.solve(yields[:2, :2], -presses[:2]).min()
    assert chains._cycle(pulls, yields, e, pairs)[0] == []
    assert [group.tolist() for group in chains._cycle(presses, yields, e, pairs)[0]] == [[2], [0, 1]]
