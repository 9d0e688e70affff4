"""The planar box: flat drops, tilted rods, strikes off centre, tips that turn into a wall."""

import math

import numpy as np
import pytest

from reference_solver import Body, Box, Disc, HalfSpace, Model
from tests.verification.event_driven.errors import LeavesClosedForm
from tests.verification.event_driven.oracle import EventDriven

G = 9.81
FLOOR = Body(HalfSpace((0.0, 1.0)), motion="fixed")
THIN = 1e-12


def rod(x=0.0, y=0.0, angle=0.0, vx=0.0, vy=0.0, spin=0.0, half=1.0, mass=1.0):
    """Box so thin that its width shows in no digit that is compared."""
    shape = Box((half, THIN))
    return Body(shape, mass=mass, inertia=mass * half**2 / 3.0, pose=(x, y, angle), twist=(vx, vy, spin))


def oracle(*bodies, e=1.0, mu=0.0, gravity=0.0, law="N-SEQ"):
    return EventDriven(Model(2, bodies, (0.0, -gravity), np.float64(e), np.float64(mu)), law)


@pytest.mark.parametrize("e", [0.0, 0.5, 0.8, 1.0])
@pytest.mark.parametrize("mu", [0.0, 0.6])
def test_box_dropped_flat_with_corners_together(e, mu):
    square = Body(Box((0.5, 0.5)), mass=2.0, inertia=1.0 / 3.0, pose=(0.0, 2.0, 0.0), twist=(0.0, -3.0, 0.0))
    run = oracle(FLOOR, square, e=e, mu=mu, law="N-SIM")
    run.advance(run.next_event())
    assert run.twist[1] == pytest.approx([0.0, 3.0 * e, 0.0], abs=1e-14)
    assert len(run.events) == 2


def test_order_of_corner_impacts():
    square = Body(Box((0.5, 0.5)), mass=2.0, inertia=1.0 / 3.0, pose=(0.0, 2.0, 0.0), twist=(0.0, -3.0, 0.0))
    run = oracle(FLOOR, square, e=0.5)
    run.advance(1.01 * run.next_event())
    assert len(run.events) >= 2
    assert abs(run.twist[1, 2]) > 0.1


def test_time_and_rest_of_a_bouncing_flat_box():
    e, height = 0.5, 1.0
    square = Body(Box((0.5, 0.25)), mass=2.0, inertia=1.0, pose=(0.0, 0.25 + height, 0.0))
    run = oracle(FLOOR, square, e=e, mu=0.4, gravity=G, law="N-SIM")
    run.run()
    assert run.events[-1].t == pytest.approx(math.sqrt(2 * height / G) * (1 + e) / (1 - e), rel=1e-14)
    run.advance(100.0)
    assert run.pose[1] == pytest.approx([0.0, 0.25, 0.0], abs=1e-15)


@pytest.mark.parametrize("angle", [0.2, 0.7, 1.2])
@pytest.mark.parametrize("e", [0.3, 1.0])
def test_spin_of_a_tilted_rod_by_its_lever(angle, e):
    v, mass, half = 2.0, 1.5, 1.0
    run = oracle(FLOOR, rod(y=3.0, angle=-angle, vy=-v, mass=mass), e=e)
    run.advance(run.next_event())
    impulse = mass * (1 + e) * v / (1 + 3 * math.cos(angle) ** 2)
    assert run.events[0].impulse[1] == pytest.approx(impulse, rel=1e-11)  # the width shows at 1e-12
    assert run.twist[1, 1] == pytest.approx(impulse / mass - v, abs=1e-11)
    assert run.twist[1, 2] == pytest.approx(3 * impulse * math.cos(angle) / (mass * half), rel=1e-11)
    if e == 1.0:
        assert run.energy() == pytest.approx(0.5 * mass * v * v, rel=1e-14)


def test_centre_of_percussion_of_a_rod():
    mass, length, d, m, v, e = 2.0, 2.0, 0.6, 0.5, 3.0, 0.7
    particle = Body(Disc(0.1), mass=m, inertia=0.5 * m * 0.01, pose=(d, 2.0, 0.0), twist=(0.0, -v, 0.0))
    run = oracle(rod(mass=mass), particle, e=e)
    run.run()
    impulse = (1 + e) * v / (1 / m + 1 / mass + 12 * d**2 / (mass * length**2))
    assert run.twist[0] == pytest.approx([0.0, -impulse / mass, -12 * impulse * d / (mass * length**2)], abs=1e-11)
    x = -(length**2) / (12 * d)
    assert run.twist[0, 1] + run.twist[0, 2] * x == pytest.approx(0.0, abs=1e-11)


@pytest.mark.parametrize("spin", [0.3, 3.0, 100.0])
def test_time_of_a_turning_rod_s_tip_by_bisection(spin):
    run = oracle(FLOOR, rod(y=4.0, vy=1.0, spin=spin), gravity=G)

    def lowest(t):
        return 4.0 + t - 0.5 * G * t * t - abs(math.sin(spin * t)) - THIN * abs(math.cos(spin * t))

    # the first sign change on a grid finer than a hundredth of a turn, halved
    grid = np.linspace(0.0, 2.0, 200_001)
    high = next(t for t in grid if lowest(t) < 0.0)
    low = high - 2e-5
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if lowest(middle) > 0.0 else (low, middle)
    # 1e-15 of round-off in the gap, over its rate of at least 1 m/s
    assert run.next_event() == pytest.approx(high, abs=5e-15)


def test_turning_box_past_a_disc_or_against_it():
    # a square of half-width .5 turns in place: its corner reaches out to .7071
    for distance, hits in ((0.7071, True), (0.7072, False)):
        square = Body(Box((0.5, 0.5)), mass=1.0, inertia=1 / 6, twist=(0.0, 0.0, 2.0))
        still = Body(Disc(0.25), mass=1.0, inertia=0.03, pose=(distance + 0.25, 0.0, 0.0))
        run = oracle(square, still)
        t = run.next_event()
        assert (t < math.pi / 4) == hits


@pytest.mark.parametrize(
    ("distance", "angle"),
    [
        (0.9, math.acos(0.75 / 0.9)),  # its side meets the disc: .9 cos(angle) = .5 + .25
        # its corner does: law of cosines between the centre, the corner (.5, .5) and the disc's centre
        (0.95, math.pi / 4 - math.acos((0.95**2 + 0.5 - 0.0625) / (2 * 0.95 * math.sqrt(0.5)))),
    ],
)
def test_angle_of_a_turning_box_that_meets_a_disc(distance, angle):
    near = Body(Disc(0.25), mass=1.0, inertia=0.03, pose=(distance, 0.0, 0.0))
    run = oracle(Body(Box((0.5, 0.5)), mass=1.0, inertia=1 / 6, twist=(0.0, 0.0, 2.0)), near)
    assert run.next_event() == pytest.approx(angle / 2.0, abs=1e-14)
    start = run.energy()
    run.advance(5.0)
    assert run.energy() == pytest.approx(start, rel=1e-14)


def test_refusal_of_a_tip_that_digs_in():
    with pytest.raises(LeavesClosedForm, match="box turns"):
        oracle(FLOOR, rod(y=3.0, angle=0.5), e=0.0, mu=2.0, gravity=G).advance(2.0)
