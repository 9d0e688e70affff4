"""Gates of the event-driven oracle and of exact enumeration, each against a closed form that neither knows."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np

from reference_solver.exact_contact import coulomb_solutions
from reference_solver.model import Array, Body, Box, Disc, HalfSpace, Model
from tests.verification.event_driven.oracle import Event, EventDriven, Law
from tests.verification.gate import Gate

#: Standard test value [m/s^2]; the gates are ratios, so that any other would do.
GRAVITY = 9.81


def gates() -> Iterator[Gate]:
    """Yield every row that the oracle answers for; the rod gas takes most of the time."""
    yield from bounce()
    yield from elastic_bounces()
    yield from galperin()
    yield from closing_wall()
    yield from billiard()
    yield from two_bodies()
    yield from ball_on_ball()
    yield from chain()
    yield from cradle()
    yield from collapse()
    yield from painleve()
    yield from kane()
    yield from slide_to_roll()
    yield from rod_gas()


def disc(mass: float, x: float, y: float = 0.0, vx: float = 0.0, vy: float = 0.0, radius: float = 0.5) -> Body:
    """Return a uniform disc [kg, m, m/s] that does not spin."""
    inertia = 0.5 * mass * radius**2
    return Body(Disc(radius), mass=mass, inertia=inertia, pose=(x, y, 0.0), twist=(vx, vy, 0.0))


def wall(nx: float, ny: float, offset: float = 0.0, velocity: tuple[float, float] | None = None) -> Body:
    """Return a half-space that stands still, or moves with a constant velocity [m/s]."""
    shape = HalfSpace((nx, ny), offset)
    if velocity is None:
        return Body(shape, motion="fixed")
    return Body(shape, motion="prescribed", twist=(*velocity, 0.0))


def flying(bodies: Sequence[Body], restitution: float, law: Law = "N-SEQ", friction: float = 0.0) -> EventDriven:
    """Return an oracle without gravity."""
    return EventDriven(Model(2, bodies, (0.0, 0.0), np.float64(restitution), np.float64(friction)), law)


def bounce(restitution: float = 0.8, height: float = 1.0) -> Iterator[Gate]:
    """Apexes, their times, and the end of all bounces: h_n = e^2n h, t_inf = sqrt(2h/g) (1+e)/(1-e) (O16)."""
    bodies = [wall(0.0, 1.0), disc(1.0, 0.0, 0.5 + height)]
    oracle = EventDriven(Model(2, bodies, (0.0, -GRAVITY), np.float64(restitution), np.float64(0.0)))
    fall = math.sqrt(2.0 * height / GRAVITY)
    worst = 0.0
    for n in range(1, 21):
        apex = fall * (1.0 + 2.0 * sum(restitution**k for k in range(1, n)) + restitution**n)
        reached = oracle.record([apex]).pose[0, 1, 1] - 0.5
        worst = max(worst, abs(reached - restitution ** (2 * n) * height) / height)
    oracle.run()
    end = fall * (1.0 + restitution) / (1.0 - restitution)
    case = f"e = {restitution:g}"
    yield Gate.at_most("20 apexes, of h0", case, worst, 1e-12, "event-driven")
    yield Gate.at_most("rest time, relative", case, oracle.events[-1].t / end - 1.0, 1e-12, "event-driven")
    yield Gate.at_most("height at rest [m]", case, oracle.pose[1, 1] - 0.5, 1e-15, "event-driven")


def elastic_bounces(count: int = 10_000) -> Iterator[Gate]:
    """Energy after many elastic bounces."""
    bodies = [wall(0.0, 1.0), disc(1.0, 0.0, 1.5)]
    oracle = EventDriven(Model(2, bodies, (0.0, -GRAVITY), np.float64(1.0), np.float64(0.0)))
    start = oracle.energy()
    oracle.advance(2.0 * count * math.sqrt(2.0 / GRAVITY))
    case = f"e = 1, {len(oracle.events)} bounces"
    yield Gate.at_most("energy, relative", case, oracle.energy() / start - 1.0, 1e-14, "event-driven")


def galperin(decades: Sequence[int] = (0, 1, 2, 3, 4)) -> Iterator[Gate]:
    """Count the collisions of a heavy and a light ball with a wall: digits of pi (O17)."""
    for k in decades:
        oracle = flying([wall(1.0, 0.0), disc(1.0, 1.0), disc(100.0**k, 3.0, vx=-1.0)], 1.0)
        oracle.run()
        truth = math.ceil(math.pi / math.atan(10.0**-k)) - 1
        yield Gate.exactly("Galperin's collisions", f"mass ratio 100^{k}", len(oracle.events), truth, "event-driven")


def closing_wall(speed: float = 0.01, hits: int = 200) -> Iterator[Gate]:
    """(v - V) L is constant where a wall closes in with speed V on an elastic ball (O18)."""
    bodies = [wall(1.0, 0.0), disc(1.0, 1.0, vx=1.0, radius=0.25), wall(-1.0, 0.0, -4.0, (-speed, 0.0))]
    oracle = flying(bodies, 1.0)
    constants: list[float] = []
    while len(constants) < hits:
        known = len(oracle.events)
        oracle.advance(oracle.next_event())
        if oracle.events[known:] and oracle.events[-1].b == 2:
            room = 4.0 - speed * oracle.time - 0.5  # between the walls, less the ball's diameter
            constants.append((-float(oracle.twist[1, 0]) - speed) * room)
    spread = (max(constants) - min(constants)) / constants[0]
    yield Gate.at_most("(v - V) L, relative spread", f"{hits} hits", spread, 1e-12, "event-driven")


def billiard(time: float = 1000.0) -> Iterator[Gate]:
    """Elastic disc in a rectangle, against the unfolded straight line (O19)."""
    a, b, r, start, velocity = 3.0, 2.0, 0.25, (1.0, 0.7), (1.0, 0.6180339887498949)
    walls = [wall(1.0, 0.0), wall(-1.0, 0.0, -a), wall(0.0, 1.0), wall(0.0, -1.0, -b)]
    oracle = flying([*walls, disc(1.0, *start, *velocity, radius=r)], 1.0)
    oracle.advance(time)
    truth = [
        r + abs((x - r + v * time + w) % (2.0 * w) - w)
        for x, v, w in zip(start, velocity, (a - 2.0 * r, b - 2.0 * r), strict=True)
    ]
    error = float(np.abs(oracle.pose[4, :2] - truth).max())
    yield Gate.at_most("billiard, position [m]", f"{len(oracle.events)} hits", error, 1e-12, "event-driven")


def two_bodies() -> Iterator[Gate]:
    """Central impact of two bodies with mass ratios to 1e6, and what energy it costs (S-A2)."""
    for ratio in (1.0, 1e2, 1e4, 1e6):
        e, v1, v2 = 0.7, 1.0, -2.0
        oracle = flying([disc(1.0, 0.0, vx=v1), disc(ratio, 2.0, vx=v2)], e)
        before = oracle.energy()
        oracle.run()
        after = ((1 - e * ratio) * v1 + (1 + e) * ratio * v2) / (1 + ratio)
        other = ((ratio - e) * v2 + (1 + e) * v1) / (1 + ratio)
        loss = 0.5 * (1 - e * e) * ratio / (1 + ratio) * (v1 - v2) ** 2
        worst = max(abs(oracle.twist[0, 0] - after), abs(oracle.twist[1, 0] - other))
        worst = max(worst, abs(before - oracle.energy() - loss) / before)
        yield Gate.at_most("two bodies: speeds, energy", f"mass ratio {ratio:g}", worst, 1e-14, "event-driven")


def ball_on_ball(floor: float = 0.9, pair: float = 0.8) -> Iterator[Gate]:
    """Ball on ball dropped together: the answer belongs to the law (S-A3)."""
    heavy, light, height = 100.0, 1.0, 1.0
    table = np.array([[0.0, floor, floor], [floor, 0.0, pair], [floor, pair, 0.0]])
    v = math.sqrt(2.0 * GRAVITY * height)
    truth = {
        "N-SEQ": v * (heavy * floor + heavy * pair * (1.0 + floor) - light) / (heavy + light),
        "N-SIM": floor * v,
    }
    for law in ("N-SEQ", "N-SIM"):
        bodies = [wall(0.0, 1.0), disc(heavy, 0.0, height + 0.5), disc(light, 0.0, height + 1.25, radius=0.25)]
        oracle = EventDriven(Model(2, bodies, (0.0, -GRAVITY), table, np.float64(0.0)), law)
        oracle.advance(oracle.next_event())
        error = oracle.twist[2, 1] / truth[law] - 1.0
        yield Gate.at_most("ball on ball: speed, relative", law, error, 1e-14, "event-driven")


def chain(restitution: float = 0.9) -> Iterator[Gate]:
    """The last speed of a touching chain of unequal masses, one pair after the other (S-B2)."""
    masses, speed = (8.0, 4.0, 2.0, 1.0, 0.5), 1.0
    oracle = flying([disc(m, float(k), vx=0.0 if k else speed) for k, m in enumerate(masses)], restitution)
    oracle.run()
    truth = speed * math.prod((1.0 + restitution) * a / (a + b) for a, b in itertools.pairwise(masses))
    yield Gate.at_most("chain: last speed, relative", "N-SEQ", oracle.twist[-1, 0] / truth - 1.0, 1e-14, "event-driven")


def cradle() -> Iterator[Gate]:
    """Newton's cradle of touching equal balls under both laws (S-B1)."""
    for count in (3, 5):
        for law in ("N-SEQ", "N-SIM"):
            oracle = flying([disc(1.0, float(k), vx=0.0 if k else 1.0) for k in range(count)], 1.0, law)
            oracle.run()
            truth = np.zeros(count)
            truth[-1] = 1.0
            if law == "N-SIM":
                truth[:] = 2.0 / count
                truth[0] -= 1.0
            error = float(np.abs(oracle.twist[:, 0] - truth).max())
            yield Gate.at_most("cradle: speeds [m/s]", f"{law}, {count} balls", error, 1e-14, "event-driven")


def three_balls(restitution: float) -> list[Event]:
    """Return the events of three equal balls whose middle one is hit from both sides in turn (S-B9).

    The gaps and speeds are the ones that stay in collapse longest: relative velocities along the contracting
    eigenvector of one pair of collisions.
    """
    q = 0.5 * (1.0 + restitution)
    pair = np.array([[1.0 - q, q, 0.0], [q, 1.0 - q, 0.0], [0.0, 0.0, 1.0]])
    other = pair[::-1, ::-1]
    values, vectors = np.linalg.eig(other @ pair)
    moving = [k for k in range(3) if abs(values[k] - 1.0) > 1e-6]
    best = min(moving, key=lambda k: abs(values[k]))
    v = vectors[:, best].real
    v = v * (1.0 if v[0] > v[1] else -1.0) / np.abs(v).max()
    bodies = [disc(1.0, x, vx=float(speed)) for x, speed in zip((0.0, 1.5, 2.6), v, strict=True)]
    oracle = flying(bodies, restitution)
    oracle.run()
    return oracle.events


def collapse() -> Iterator[Gate]:
    """Whether three balls collapse: they can if and only if e < 7 - 4 sqrt 3 (O20)."""
    threshold = 7.0 - 4.0 * math.sqrt(3.0)
    for factor, collapses in ((0.9, 1), (0.99, 1), (1.1, 0), (1.5, 0)):
        events = three_balls(factor * threshold)
        measured = int(any(event.kind == "rest" for event in events))
        case = f"e = {factor:g} (7 - 4 sqrt 3), {len(events)} collisions"
        yield Gate.exactly("three balls collapse (1: yes)", case, measured, collapses, "event-driven")


def rod_tip(angle: float) -> Array:
    """W (2, 2) [1/kg] at the lower right end of a thin rod of mass 1 and half-length 1, leaning by ``angle`` (O21)."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[1.0 + 3.0 * c * c, -3.0 * s * c], [-3.0 * s * c, 1.0 + 3.0 * s * s]])


def painleve(angle: float = math.atan(2.0)) -> Iterator[Gate]:
    """Count the solutions of a rod sliding on its tip: forces around the threshold, impulses beyond it (S-C12)."""
    c, s = math.cos(angle), math.sin(angle)
    threshold = (1.0 + 3.0 * c * c) / (3.0 * s * c)
    tip = rod_tip(angle)
    yield Gate.at_most("Painleve threshold, mu - 4/3", "tan = 2", threshold - 4.0 / 3.0, 1e-15, "enumeration")
    for factor, pressed, lifted in ((1.0 - 1e-9, 1, 1), (1.0 + 1e-9, 0, 2)):
        for pull, truth in ((-1.0, pressed), (1.0, lifted)):
            # slip-, to the right: friction against it turns the rod so that its end is driven into the floor
            count = len(coulomb_solutions(tip, np.array([pull, 0.0]), [factor * threshold], [-1.0]))
            case = f"mu = {factor:.9f} mu_P, {'pressed' if pull < 0.0 else 'lifted'}"
            yield Gate.exactly("sliding rod: solutions", case, count, truth, "enumeration")
    jam = coulomb_solutions(tip, np.array([-1e-3, -1.0]), [1.2 * threshold])
    rest = min((float(np.abs(s.velocity).max()) for s in jam), default=math.inf)
    yield Gate.at_most("sliding rod: speed after the jam", "mu = 1.2 mu_P, impulses", rest, 1e-15, "enumeration")


def kane() -> Iterator[Gate]:
    """Newton's restitution with friction can create energy: the run must say when it did (S-A12)."""
    angle, mu, e, slide = math.radians(56.4), 0.883, 0.9988, 0.727
    for name, sign in (("towards its lean", 1.0), ("away from it", -1.0)):
        # a box so thin that its width does not reach the gate; it leans so that its right end is the lower one
        twist = (sign * slide, -1.0, 0.0)
        rod = Body(Box((1.0, 1e-12)), mass=1.0, inertia=1.0 / 3.0, pose=(0.0, 1.5, -angle), twist=twist)
        model = Model(2, [wall(0.0, 1.0), rod], (0.0, 0.0), np.float64(e), np.float64(mu))
        oracle = EventDriven(model)
        oracle.advance(oracle.next_event())
        gain = _kane_gain(angle, mu, e, sign * slide)
        error = sum(event.work for event in oracle.events) - gain
        case = f"slides {name}"
        yield Gate.at_most("rod hits floor: work, of m v_n^2", case, error, 1e-11, "event-driven")
        flag = int(oracle.certificate["kane"])
        yield Gate.exactly(
            "Kane: energy created is flagged", f"{case}, {gain:+.4f}", flag, int(gain > 0.0), "event-driven"
        )


def _kane_gain(angle: float, mu: float, e: float, slide: float) -> float:
    """Energy that Newton's law gives to a rod hitting with its right end [m v_n^2]: stick, else slip (O21)."""
    tip = rod_tip(angle)
    u = np.array([-1.0, -slide])  # the tangent is the normal turned by +90 degrees: to the left
    p = np.linalg.solve(tip, np.array([e, 0.0]) - u)
    if abs(p[1]) > mu * p[0]:
        along = math.copysign(mu, p[1])
        p = (1.0 + e) / (tip[0, 0] + along * tip[0, 1]) * np.array([1.0, along])
    return float(p @ (u + 0.5 * tip @ p))


def slide_to_roll(speed: float = 2.0, friction: float = 0.3) -> Iterator[Gate]:
    """A disc set down sliding rolls after v k / ((1 + k) mu g) with v / (1 + k) (S-C4)."""
    k = 0.5
    bodies = [wall(0.0, 1.0), disc(1.0, 0.0, 0.5, vx=speed)]
    oracle = EventDriven(Model(2, bodies, (0.0, -GRAVITY), np.float64(0.0), np.float64(friction)))
    oracle.run()
    event = oracle.events[-1]
    time = speed * k / ((1.0 + k) * friction * GRAVITY)
    way = speed**2 * k * (2.0 + k) / (2.0 * friction * GRAVITY * (1.0 + k) ** 2)
    errors = (event.t / time - 1.0, oracle.twist[1, 0] * (1.0 + k) / speed - 1.0, oracle.pose[1, 0] / way - 1.0)
    worst = max(abs(error) for error in errors)
    yield Gate.at_most("slide to roll: time, speed, way", f"mu = {friction:g}", worst, 1e-14, "event-driven")


def rod_gas(count: int = 1000, events: int = 100_000) -> Iterator[Gate]:
    """Elastic rods on a line, against sorted free flights of points (O22)."""
    rng = np.random.default_rng(20)
    rod, length = 0.5, float(count)
    room = length - count * rod
    point, speed = np.sort(rng.random(count)) * room, rng.standard_normal(count)
    rank = (np.arange(count) + 0.5) * rod
    rods = [disc(1.0, x, vx=v, radius=0.5 * rod) for x, v in zip(point + rank, speed, strict=True)]
    oracle = flying([wall(1.0, 0.0), wall(-1.0, 0.0, -length), *rods], 1.0)
    # unfolded, two points cross at the rate (|v - w| + |v + w|) / (2 room), and one meets a wall at |v| / room
    pairs = np.abs(speed[:, None] - speed) + np.abs(speed[:, None] + speed)
    time = 4.0 * room * events / float(pairs.sum())
    oracle.advance(time)
    folded = (point + speed * time) % (2.0 * room)
    truth = np.sort(np.minimum(folded, 2.0 * room - folded)) + rank
    error = float(np.abs(oracle.pose[2:, 0] - truth).max())
    yield Gate.at_most(
        "rod gas, position [m]", f"N = {count}, {len(oracle.events)} events", error, 1e-10, "event-driven"
    )
