"""Many bodies and many impacts: order, symmetry, reversal, laws."""

import math

import numpy as np
import pytest

from reference_solver import Body, Disc, HalfSpace, Model, Sphere
from tests.verification.event_driven.errors import LeavesClosedForm, TooManyEvents
from tests.verification.event_driven.oracle import EventDriven


def disc(x, y=0.0, vx=0.0, vy=0.0, mass=1.0, radius=0.5):
    inertia = 0.5 * mass * radius**2
    return Body(Disc(radius), mass=mass, inertia=inertia, pose=(x, y, 0.0), twist=(vx, vy, 0.0))


def walls(width, height):
    sides = [((1.0, 0.0), 0.0), ((-1.0, 0.0), -width), ((0.0, 1.0), 0.0), ((0.0, -1.0), -height)]
    return [Body(HalfSpace(normal, offset), motion="fixed") for normal, offset in sides]


def oracle(bodies, restitution=1.0, gravity=(0.0, 0.0), law="N-SEQ", friction=0.0):
    return EventDriven(Model(2, bodies, gravity, np.float64(restitution), np.float64(friction)), law)


def crowd(seed, count=12):
    rng = np.random.default_rng(seed)
    places = [(1.5 + 1.6 * (k % 4), 1.5 + 1.6 * (k // 4)) for k in range(count)]
    return [disc(x, y, *rng.standard_normal(2), radius=0.3 + 0.05 * (k % 3)) for k, (x, y) in enumerate(places)]


def test_nothing_ever_overlaps_and_nothing_leaves():
    run = oracle([*walls(8.0, 6.5), *crowd(1)])
    for _ in range(300):
        run.advance(run.next_event())
        x = run.pose[4:, :2]
        radius = run.bodies.radius[4:]
        distance = np.hypot(*(x[:, None] - x).transpose(2, 0, 1)) - radius[:, None] - radius
        np.fill_diagonal(distance, 1.0)
        inside = np.concatenate([x - radius[:, None], [8.0, 6.5] - x - radius[:, None]])
        assert min(distance.min(), inside.min()) >= -1e-13  # sixteen units in the last place of 8 m, 300 events


def test_momentum_and_energy_of_a_gas():
    run = oracle([*walls(8.0, 6.5), *crowd(2)])
    start = run.energy()
    run.advance(20.0)
    assert len(run.events) > 100
    assert run.energy() == pytest.approx(start, rel=1e-13)  # a few units in the last place per event


def test_free_discs_keep_momentum_and_centre():
    bodies = crowd(3)
    run = oracle(bodies, restitution=0.9)
    mass = np.array([b.mass for b in bodies])
    start, centre = mass @ run.twist[:, :2], mass @ run.pose[:, :2]
    run.advance(5.0)
    assert len(run.events) >= 5
    assert mass @ run.twist[:, :2] == pytest.approx(start, abs=1e-13)
    assert mass @ run.pose[:, :2] == pytest.approx(centre + 5.0 * start, abs=1e-12)


def test_reversed_run():
    bodies = [*walls(8.0, 6.5), *crowd(4)]
    run = oracle(bodies)
    run.advance(4.0)
    back = [
        *bodies[:4],
        *(
            Body(b.shape, mass=b.mass, inertia=b.inertia, pose=tuple(x), twist=tuple(-v))
            for b, x, v in zip(bodies[4:], run.pose[4:], run.twist[4:], strict=True)
        ),
    ]
    reverse = oracle(back)
    reverse.advance(4.0)
    assert len(reverse.events) == len(run.events) > 20
    # round-off grows by about 1 + 2 path/radius = 5 per hit of one disc; four hits each on average
    assert np.abs(reverse.pose[4:, :2] - np.array([b.pose[:2] for b in bodies[4:]])).max() <= 1e-16 * 5.0**12


def test_bits_of_mirrored_discs():
    bodies = crowd(5)
    mirrored = [
        Body(b.shape, mass=b.mass, inertia=b.inertia, pose=(-b.pose[0], b.pose[1], 0.0),
             twist=(-b.twist[0], b.twist[1], 0.0))
        for b in bodies
    ]  # fmt: skip
    one, other = oracle(bodies), oracle(mirrored)
    one.advance(4.0)
    other.advance(4.0)
    assert one.events
    assert np.array_equal(one.pose * [-1, 1, 1], other.pose)


def test_bits_in_doubled_units():
    bodies = [*walls(8.0, 6.5), *crowd(6)]
    scaled = [
        Body(HalfSpace(b.shape.normal, 4.0 * b.shape.offset), motion="fixed")
        if isinstance(b.shape, HalfSpace)
        else Body(Disc(4.0 * b.shape.radius), mass=2.0 * b.mass, inertia=32.0 * b.inertia,
                  pose=(4.0 * b.pose[0], 4.0 * b.pose[1], 0.0), twist=(4.0 * b.twist[0], 4.0 * b.twist[1], 0.0))
        for b in bodies
    ]  # fmt: skip
    one, other = oracle(bodies), oracle(scaled)
    one.advance(4.0)
    other.advance(4.0)
    assert np.array_equal(4.0 * one.pose[4:, :2], other.pose[4:, :2])


def test_run_with_samples():
    bodies = [*walls(8.0, 6.5), *crowd(7)]
    plain, sampled = oracle(bodies), oracle(bodies)
    plain.advance(4.0)
    sampled.record(np.linspace(0.0, 4.0, 97))
    assert np.array_equal(plain.pose, sampled.pose)


@pytest.mark.parametrize("law", ["N-SEQ", "N-SIM"])
def test_mirror_symmetry_of_a_rack_break(law):
    rack = [disc(math.sqrt(3.0) / 2.0 * row, place - row / 2.0) for row in range(3) for place in range(row + 1)]
    run = oracle([disc(-3.0, vx=1.0), *rack], law=law)
    run.advance(5.0)
    x = run.pose[:, :2]
    if law == "N-SIM":  # one pair at a time breaks the symmetry of a touching rack, by declaration
        partner = [0, 1, 3, 2, 6, 5, 4]
        assert x[partner] * [1.0, -1.0] == pytest.approx(x, abs=1e-12)
    assert run.twist[:, 0].sum() == pytest.approx(1.0, abs=1e-14)
    assert run.energy() == pytest.approx(0.5, abs=1e-14)


def test_near_miss_and_near_hit():
    for offset, hits in ((1.0 + 1e-12, 0), (1.0 - 1e-12, 1)):
        run = oracle([disc(0.0, vx=1.0), disc(5.0, offset)])
        run.run()
        assert len(run.events) == hits


def test_hit_from_both_sides_at_once():
    bodies = [disc(-2.0, vx=1.0), disc(0.0), disc(2.0, vx=-1.0)]
    together = oracle(bodies, 0.5, law="N-SIM")
    together.run()
    assert together.twist[:, 0] == pytest.approx([-0.5, 0.0, 0.5], abs=1e-15)
    one_by_one = oracle(bodies, 0.5)
    one_by_one.advance(1.5)
    assert [(e.a, e.b) for e in one_by_one.events[:2]] == [(0, 1), (1, 2)]


def test_balls_dropped_on_balls_by_the_quartic():
    # a falling ball and a fixed one differ in acceleration: the time against bisection of the closed form
    fixed = Body(Disc(0.5), motion="fixed", pose=(0.0, 0.0, 0.0))
    run = oracle([fixed, disc(0.3, 3.0, vx=-0.05)], gravity=(0.0, -9.81))
    t = run.next_event()
    low, high = 0.0, 1.0
    for _ in range(200):
        middle = 0.5 * (low + high)
        apart = math.hypot(0.3 - 0.05 * middle, 3.0 - 0.5 * 9.81 * middle**2) > 1.0
        low, high = (middle, high) if apart else (low, middle)
    assert t == pytest.approx(high, rel=1e-15)


def test_spheres_collide_as_discs_do():
    def sphere(x, y, vx, vy):
        return Body(Sphere(0.5), mass=1.0, inertia=(0.1, 0.1, 0.1), pose=(x, 0.0, y, 1.0, 0.0, 0.0, 0.0),
                    twist=(vx, 0.0, vy, 0.0, 0.0, 0.0))  # fmt: skip

    states = [(0.0, 0.0, 1.0, 0.2), (3.0, 0.4, -0.5, 0.0), (5.0, 1.0, -1.0, 0.1)]
    space = EventDriven(Model(3, [sphere(*s) for s in states], (0.0, 0.0, -9.81), np.float64(0.9), np.float64(0.0)))
    plane = oracle([disc(*s) for s in states], 0.9, gravity=(0.0, -9.81))
    space.advance(4.0)
    plane.advance(4.0)
    assert len(space.events) == len(plane.events) >= 2
    assert space.pose[:, [0, 2]] == pytest.approx(plane.pose[:, :2], abs=1e-12)


@pytest.mark.long
def test_run_with_too_many_contacts_at_once():
    row = [disc(float(k), vx=0.0 if k else 1.0) for k in range(14)]
    with pytest.raises(LeavesClosedForm, match="13 contacts at once, enumeration ends at 12"):
        oracle(row, law="N-SIM").run()
    oracle(row).run()  # one after the other they are no trouble


def test_run_beyond_its_bound_on_events():
    with pytest.raises(TooManyEvents, match="5 events"):
        EventDriven(
            Model(2, [*walls(2.0, 2.0), disc(1.0, 1.0, 1.0)], (0.0, 0.0), np.float64(1.0), np.float64(0.0)),
            most_events=5,
        ).run()
