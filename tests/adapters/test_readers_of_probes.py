"""Readers of probes say NaN of a motion that tells them nothing, and warn of none: a user sees a receipt alone."""

import math
from itertools import product

import numpy as np
import pytest

from adapters.engine import Contacts
from adapters.receipts.probes import HALF_EXTENTS, LANDING_LEAD, LANDING_SPEED, PROBES, Case
from adapters.trajectory import ContactRecord, Trajectory
from validation.geometry import separation

STEPS = 24


def resting(scene, told, moved):
    """All stay where they start, with the twist that they have there or none; contacts of no impulse, or none told."""
    pose = np.array([[body.pose for body in scene.bodies]] * (STEPS + 1))
    twist = np.array([[body.twist for body in scene.bodies]] * (STEPS + 1)) * moved
    d, n = scene.dimension, len(scene.bodies) - 1
    rows = [(0, k, np.zeros(d), np.eye(d)[-1], np.full(d, told), 0.0) for k in range(1, n + 1)] * STEPS if n else []
    counts = np.arange(STEPS + 1) * n
    record = ContactRecord(np.arange(1, STEPS + 1), counts, Contacts.from_rows(rows, d))
    return Trajectory(np.arange(STEPS + 1) / 240, pose, twist, record, 1 / 240, "completed")


#: Without gravity, or the speed they start with, what falls and flies is another experiment.
TOUCHING = ("load", "landing", "rebound", "slide", "corner")


@pytest.mark.parametrize(("name", "dimension", "told"), list(product(TOUCHING, (2, 3), (0.0, math.nan))))
def test_motion_without_values_read_without_a_warning(name, dimension, told):
    case = Case(dimension, 0.5, 0.5, 1 / 240, 0.5)
    scene = PROBES[name].make(case)
    for moved in (0.0, 1.0):
        with np.errstate(all="raise"):
            found = PROBES[name].read(case, scene, resting(scene, told, moved))
        assert set(found) <= set(PROBES[name].quantities)
        assert all(isinstance(number, float) for numbers in found.values() for number in numbers)


@pytest.mark.parametrize(("dimension", "faces"), [(2, "xz"), (3, "xyz")])
def test_landings_at_one_height_on_different_faces(dimension, faces):
    case = Case(dimension, 0.5, 0.5, 1 / 240, 0.5)
    floor, ball, *boxes = PROBES["landing"].make(case).bodies
    for body in (ball, *boxes):
        poses = [np.array([each.pose]) for each in (floor, body)]
        gap = separation(floor.shape, poses[0], body.shape, poses[1])[0]
        assert float(gap) == pytest.approx(LANDING_LEAD * LANDING_SPEED / 240, abs=1e-12)
        turn = body.pose[2:] if dimension == 2 else (2.0 * math.acos(body.pose[3]),)
        assert abs(turn[0]) <= 0.5 * math.pi + 1e-12
    heights = [box.pose[dimension - 1] for box in boxes]
    halves = dict(zip("xyz", HALF_EXTENTS, strict=True))
    assert np.diff(heights) == pytest.approx(np.diff([halves[axis] for axis in faces]), abs=1e-12)
    assert [box.name for box in boxes] == [f"box {axis}" for axis in faces]
