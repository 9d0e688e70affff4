"""Straight flight and blows, without an engine: every sample, and every contact at the step it falls into.

Numbers are powers of two, so that a blow lies exactly on a sample and all is exact.
"""

import numpy as np
import pytest

from adapters.law import single_precision
from adapters.law.single_precision import Held, Method, _Flight, _motion
from adapters.scene import Body, Pair, Scene, Sphere

DT = 1 / 64
EXACT = Method(lambda e, speed: e, 200)


def ball(name, x, speed=0.0, mass=1.0):
    place, twist = (x, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0), (speed, 0.0, 0.0, 0.0, 0.0, 0.0)
    return Body(name, Sphere(0.25), mass, (mass / 64,) * 3, place, twist)


def scene(*balls, e=0.5):
    return Scene("balls", 1, 3, balls, (Pair(restitution=e),), (0.0, 0.0, 0.0), 0.5, {})


def test_step_of_a_blow_on_a_sample():
    motion, blows = _motion(Held(scene(ball("left", 0.0, 2.0), ball("right", 1.0, 0.0, 3.0))), DT, EXACT)
    t = motion.t
    assert blows == 1 and motion.finish == "completed" and motion.dt == DT
    assert t.tolist() == [k / 64 for k in range(33)]
    left = np.where(t <= 0.25, 2.0 * t, 0.5 - 0.25 * (t - 0.25))
    right = np.where(t <= 0.25, 1.0, 1.0 + 0.75 * (t - 0.25))
    assert motion.pose[:, 0, 0] == pytest.approx(left, abs=1e-15)
    assert motion.pose[:, 1, 0] == pytest.approx(right, abs=1e-15)
    assert np.all(motion.pose[:, :, 1] == 0.0) and np.all(motion.pose[:, :, 2] == 0.5)
    assert np.all(motion.pose[:, :, 3:] == (1.0, 0.0, 0.0, 0.0))
    assert motion.twist[:16, 0, 0] == pytest.approx(2.0) and np.all(motion.twist[:16, 1] == 0.0)
    assert motion.twist[16:, 0, 0] == pytest.approx(-0.25) and motion.twist[16:, 1, 0] == pytest.approx(0.75)
    assert np.all(motion.twist[:, :, 1:] == 0.0)
    rows, counts = motion.contacts.rows, np.diff(motion.contacts.offset)
    assert motion.contacts.step.tolist() == list(range(1, 33))
    assert np.flatnonzero(counts).tolist() == [16] and counts.sum() == 1, "of the step from sample 16 to 17"
    assert (rows.a.tolist(), rows.b.tolist(), rows.gap.tolist()) == ([0], [1], [0.0])
    assert rows.normal.tolist() == [[1.0, 0.0, 0.0]] and rows.impulse == pytest.approx(np.array([[2.25, 0.0, 0.0]]))


def test_no_motion_told_without_a_meeting():
    assert _motion(Held(scene(ball("left", 0.0, 1.0), ball("right", 1.0))), DT, EXACT) is None  # at the end itself
    assert _motion(Held(scene(ball("left", 0.0, -1.0), ball("right", 1.0))), DT, EXACT) is None
    assert _motion(Held(scene(ball("left", 0.0, 1.0625), ball("right", 1.0))), DT, EXACT) is not None


@pytest.mark.parametrize(("gap", "touches"), [(0.0, True), (1.0, True), (1.0 + 2.0**-20, False), (2.0, False)])
def test_touch_within_the_least_gap(monkeypatch, gap, touches):
    monkeypatch.setattr(single_precision, "TOUCHING", 2.0**-30)
    flight = _Flight(scene(ball("left", 0.0), ball("right", 0.5 + gap * 2.0**-30)), EXACT)
    met = flight._meeting(0, 1)
    assert (met is not None) is touches
    if met:
        wait, contact = met
        assert (wait, contact.a, contact.b, contact.e, contact.mu) == (0.0, 0, 1, 0.5, 0.0)
        assert contact.normal.tolist() == [1.0, 0.0, 0.0]
        assert [arm.tolist() for arm in contact.arms] == [[0.25, 0.0, 0.0], [-0.25, 0.0, 0.0]]


def test_no_contact_for_a_missing_or_leaving_ball():
    passing = scene(ball("left", 0.0, 2.0), ball("right", 1.0))
    flight = _Flight(passing, EXACT)
    assert flight._meeting(0, 1)[0] == pytest.approx(0.25)
    flight.x[1, 1] = 0.5 - 2.0**-10
    assert flight._meeting(0, 1)[0] == pytest.approx(0.5 - np.sqrt(0.25 - (0.5 - 2.0**-10) ** 2) / 2.0)
    flight.x[1, 1] = 0.5 + 2.0**-10
    assert flight._meeting(0, 1) is None, "it passes by"
    flight.x[1, 1] = 0.0
    flight.v[0, 0] = -2.0
    assert flight._meeting(0, 1) is None, "it leaves"
