"""The horizon: where a known growth reaches its limit, and where gaps within round-off decide an order of impacts."""

import math
from dataclasses import replace

import numpy as np
import pytest

from reference_solver import Body, Capsule, Disc, HalfSpace, Model, Settings, Simulation, Sphere
from reference_solver.certificate import truth
from reference_solver.certificate.audit import order
from reference_solver.certificate.audit.run import Run
from reference_solver.certificate.truth import certify
from validation.bounds import GROWTH

DT = 1.0 / 240.0
UPRIGHT = (1.0, 0.0, 0.0, 0.0)
#: A ball bounces between two fixed discs along their common axis: radii, length of flight [m], speed [m/s].
RADIUS, BALL, FLIGHT, SPEED = 0.3, 0.1, 0.4, 1.0


def between_two_discs(angle=0.0):
    """The axis is turned by an angle [rad]."""
    away, x, y = RADIUS + BALL + 0.5 * FLIGHT, math.cos(angle), math.sin(angle)
    discs = [Body(Disc(RADIUS), pose=(s * away * x, s * away * y, 0.0), motion="fixed") for s in (-1.0, 1.0)]
    ball = Body(Disc(BALL), 1.0, 0.005, (0.0, 0.0, 0.0), (SPEED * x, SPEED * y, 0.0))
    return Model(2, [*discs, ball], (0.0, 0.0), 1.0, 0.0)


def way_aside(t):
    """How far aside (s,) the ball is that starts aside at 1 m/s; each disc adds 2 y v/(R + r) to that speed."""
    y, v, now, until, ways = 0.0, 1.0, 0.0, 0.5 * FLIGHT / SPEED, []
    for time in t:
        while time > until:
            y, now, until = y + v * (until - now), until, until + FLIGHT / SPEED
            v += 2.0 * y * SPEED / (RADIUS + BALL)
        ways.append(y + v * (time - now))
    return np.array(ways)


@pytest.mark.parametrize("angle", [0.0, 0.3, *(math.pi * k / 4.0 for k in (1, 2, 3))])
def test_horizon_by_a_known_growth(angle, monkeypatch):
    """Over the way of free flight in all of the run, of the disturbance that is more across the axis."""
    steps = 1200
    model, t = between_two_discs(angle), np.arange(steps + 1) * DT
    early, late = (
        float(t[np.flatnonzero(np.hypot(share * way_aside(t), t) / (math.sqrt(2.0) * t[-1]) >= 1e3)[0]])
        for share in (math.sqrt(2.0), 1.0)
    )
    found = certify(model, Settings.reference(DT), steps, 5).horizon
    assert early - 5 * DT <= found <= late + 6 * DT
    monkeypatch.setattr(truth, "GROWTH", 1e6)  # planted
    assert certify(model, Settings.reference(DT), steps, 5).horizon > late + 0.5


@pytest.mark.parametrize(("steps", "stride"), [(960, 5), (960, 960), (1, 1)])
def test_horizon_of_motions_that_part_and_meet(steps, stride):
    """A ball slides from the top of a disc into a corner and lies there, from wherever it left the disc."""
    corner = [Body(HalfSpace((s * math.sqrt(0.5), math.sqrt(0.5))), motion="fixed") for s in (-1.0, 1.0)]
    top = Body(Disc(RADIUS), pose=(-0.5, 2.0, 0.0), motion="fixed")
    ball = Body(Disc(BALL), 1.0, 0.005, (-0.5 + 1e-6, 2.0 + RADIUS + BALL, 0.0))
    model = Model(2, [*corner, top, ball], (0.0, -10.0), 0.0, 0.0)
    found = certify(model, Settings.reference(4.0 / steps), steps, stride)
    assert found.holds
    assert np.hypot(*found.pose[-1, 3, :2]) == pytest.approx(math.sqrt(2.0) * BALL, abs=1e-9)
    assert found.horizon <= found.t[-1]
    assert found.error_until(found.t[-1]) == np.inf


def test_the_bench_knows_the_same_growth():
    assert truth.GROWTH == GROWTH == 1e3


def beside_the_axis(offset, dimension, way):
    """A ball before two that touch, which it strikes at once, or one before the other."""
    r = 0.1
    places = ((-math.sqrt(3.0) * r - way, offset), (0.0, r), (0.0, -r))
    bodies = []
    for i, (x, y) in enumerate(places):
        v = float(i == 0)
        if dimension == 2:
            bodies.append(Body(Disc(r), 1.0, 0.005, (x, y, 0.0), (v, 0.0, 0.0)))
        else:
            bodies.append(Body(Sphere(r), 1.0, (0.004,) * 3, (x, y, 0.0, *UPRIGHT), (v, 0.0, 0.0, 0.0, 0.0, 0.0)))
    return Model(dimension, bodies, (0.0,) * dimension, 1.0, 0.0)


@pytest.mark.parametrize("way", [0.02, 0.5])
@pytest.mark.parametrize("dimension", [2, 3])
def test_horizon_at_blows_within_round_off(dimension, way):
    for offset in (0.0, 1e-15, 1e-14, 1e-13, 1e-10):
        model = beside_the_axis(offset, dimension, way)
        found = certify(model, Settings.reference(DT), round((way + 0.1) / DT))
        assert found.holds, found.reasons
        decided = offset < 1e-12
        assert (way < found.horizon <= way + 1.01 * DT) if decided else found.horizon > way + 0.05
        assert any("struck together or one after the other" in reason for reason in found.reasons) is decided


def row(gap, e):
    """A ball runs into three in a row; the second of them has a gap to the first."""
    places = (-0.25, 0.2, 0.4 + gap, 0.6 + gap)
    bodies = [Body(Disc(0.1), 1.0, 0.005, (x, 0.0, 0.0), (float(i == 0), 0, 0)) for i, x in enumerate(places)]
    return Model(2, bodies, (0.0, 0.0), e, 0.0)


def decided(model, time):
    record = Simulation(model, Settings.reference(DT)).record(round(time / DT), pieces=True)
    first = order.first_without_order(Run(model, record.pieces, DT), np.zeros(0, np.int64))
    return None if first is None else record.pieces.begin[first]


@pytest.mark.parametrize("e", [0.5, 1.0])
def test_horizon_of_a_row_with_a_negligible_gap(e):
    """It is given the velocities of a row that touches; with a gap of 1e-9 m, those of impacts in turn."""
    for gap in (1e-15, 1e-14, 1e-13):
        assert decided(row(gap, e), 0.4) == pytest.approx(0.25)
    for gap in (0.0, 1e-9):
        assert decided(row(gap, e), 0.4) is None


def test_gap_of_a_row_pressed_together():
    """A wall stands behind it, and a force presses it there."""
    model = row(1e-13, 0.0)
    wall = Body(HalfSpace((-1.0, 0.0)), pose=(0.7 + 1e-13, 0.0, 0.0), motion="fixed")
    pressed = [replace(body, force=(1.0, 0.0)) if i else body for i, body in enumerate(model.bodies)]
    assert decided(Model(2, [*pressed, wall], (0.0, 0.0), 0.0, 0.0), 0.4) is None


def test_order_of_independent_impacts():
    """Two balls come down on a floor at once, each on its own."""
    floor = Body(HalfSpace((0.0, 1.0)), motion="fixed")
    balls = [Body(Disc(0.1), 1.0, 0.005, (x, 0.2, 0.0)) for x in (0.0, 1.0)]
    assert decided(Model(2, [floor, *balls], (0.0, -9.81), 0.5, 0.3), 0.3) is None


@pytest.mark.parametrize(("e", "lean"), [(0.001, 1e-4), (0.001, 1e-3), (0.003, 1e-3)])
def test_ends_of_a_rod_that_strike_in_turn_ever_sooner(e, lean):
    """Each blow drives the other end down, until both lie: not so if both are struck together, be it 1e-13 m early."""
    floor, half, radius = Body(HalfSpace((0.0, 1.0)), motion="fixed"), 0.5, 0.1
    start = (0.0, 0.0123 + half * math.sin(lean) + radius, lean)
    rod = Body(Capsule(half, radius), 1.0, half**2 / 3.0, start, (0.0, -1.0, 0.0))
    model = Model(2, [floor, rod], (0.0, 0.0), e, 0.0)
    found = certify(model, Settings.reference(0.005), 10)
    lies = np.broadcast_to([[0.0, 0.0, 0.0], [0.0, radius, 0.0]], found.pose.shape)
    known = (found.t > 0.02) & (found.t < found.horizon)
    assert found.holds
    assert (truth.distance(model, found.pose, lies) <= found.error)[known].all()
