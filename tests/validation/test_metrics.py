"""Metrics are exact on trajectories with a closed form."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adapters.engine import Contacts
from adapters.scene import Body, Box, Disc, HalfSpace, Pair, Scene, Sphere
from adapters.trajectory import ContactRecord, Trajectory
from validation import metrics
from validation.geometry import separation

G = 9.81


def planar(t, y, v):
    pose, twist = np.zeros((len(t), 2, 3)), np.zeros((len(t), 2, 3))
    pose[:, 1, 1], twist[:, 1, 1] = y, v
    return Trajectory(t, pose, twist, None, t[1] - t[0], "completed")


@given(st.floats(0.2, 5.0), st.floats(0.0, 1.0), st.sampled_from([1 / 60, 1 / 240, 1 / 977]))
def test_the_apex_of_a_sampled_parabola_is_exact_at_any_phase(v0, phase, dt):
    t = (np.arange(int(2 * v0 / G / dt) + 4) + phase) * dt
    y, v = v0 * t - 0.5 * G * t * t, v0 - G * t
    times, tops = metrics.apexes(t, y, v)
    if v[0] <= 0.0 or len(t) < 4 or not len(tops):
        return
    assert tops[0] == pytest.approx(0.5 * v0 * v0 / G, abs=1e-12)
    assert times[0] == pytest.approx(v0 / G, abs=1e-9)


def test_a_release_from_rest_is_not_an_apex():
    t = np.arange(50) / 240
    assert len(metrics.apexes(t, 1.0 - 0.5 * G * t * t, -G * t)[0]) == 0


def test_last_motion_says_when_it_never_stops():
    t = np.linspace(0.0, 1.0, 11)
    assert metrics.last_motion(t, np.zeros(11), 0.1) == (0.0, "")
    value, why = metrics.last_motion(t, np.ones(11), 0.1)
    assert value == 1.0 and "still moving" in why
    speed = np.where(t < 0.45, 1.0, 0.0)
    assert metrics.last_motion(t, speed, 0.1)[0] == pytest.approx(0.5)


def test_mean_rate_of_a_parabola_is_its_slope_in_the_middle_of_the_window():
    t = np.linspace(0.0, 2.0, 481)
    assert metrics.mean_rate(t, 0.5 * 3.0 * t * t)[0] == pytest.approx(3.0 * 1.5, rel=1e-12)


def test_kinetic_energy_uses_the_stated_inertia_in_body_axes():
    box = Body("box", Box((0.5, 0.5, 0.5)), 2.0, (1.0, 2.0, 3.0), (0, 0, 0, math.cos(0.3), math.sin(0.3), 0, 0))
    scene = Scene("s", 1, 3, (box,), (), (0.0, 0.0, 0.0), 1.0)
    # Turned by 0.6 rad about x: a world spin about x is a body spin about x.
    twist = np.zeros((2, 1, 6))
    twist[:, 0] = (1.0, 2.0, 3.0, 4.0, 0.0, 0.0)
    pose = np.repeat(np.array(box.pose)[None, None], 2, axis=0)
    trajectory = Trajectory(np.array([0.0, 1.0]), pose, twist, None, 1.0, "completed")
    assert metrics.kinetic_energy(scene, trajectory) == pytest.approx(0.5 * 2 * 14 + 0.5 * 1 * 16)


def test_interface_load_is_signed_and_relative_to_the_weight():
    t = np.arange(11) * 0.1
    rows = Contacts.from_rows([(1, 0, (0, 0), (0, -1), (0, -0.25), 0.0)] * 20, 2)
    record = ContactRecord(np.arange(1, 11), np.arange(0, 22, 2), rows)
    trajectory = planar(t, np.zeros(11), np.zeros(11))
    trajectory = Trajectory(t, trajectory.pose, trajectory.twist, record, 0.1, "completed")
    (mean, why), deviation = metrics.interface_load(trajectory, 0, 1, 0.5, 1.0)
    assert (mean, why, deviation) == (pytest.approx(1.0), "", pytest.approx(0.0))


def test_unavailable_impulses_are_no_zero():
    rows = Contacts.from_rows([(0, 1, (0, 0), (0, 1), (math.nan, math.nan), 0.0)], 2)
    t = np.array([0.0, 0.1])
    blank = planar(t, np.zeros(2), np.zeros(2))
    record = ContactRecord(np.array([1]), np.array([0, 1]), rows)
    trajectory = Trajectory(t, blank.pose, blank.twist, record, 0.1, "completed")
    assert metrics.total_impulse(trajectory, 0, 1) == (None, metrics.UNAVAILABLE)


def corners(box, pose):
    c, s = math.cos(pose[2]), math.sin(pose[2])
    hx, hy = box.half_extents
    local = np.array([(x * hx, y * hy) for x in (-1, 1) for y in (-1, 1)])
    return local @ np.array([[c, s], [-s, c]]) + pose[:2]


angles = st.floats(-math.pi, math.pi)
coordinates = st.floats(-2.0, 2.0)


@given(coordinates, coordinates, st.floats(0.1, 1.0))
def test_round_shapes_and_half_spaces_are_exact(x, y, r):
    disc, floor = Disc(r), HalfSpace((0.6, 0.8), 0.25)
    pose = np.array([[x, y, 0.3]])
    assert separation(floor, np.zeros((1, 3)), disc, pose)[0] == pytest.approx(0.6 * x + 0.8 * y - 0.25 - r, abs=1e-14)
    other = separation(disc, np.zeros((1, 3)), Disc(0.5), pose)[0]
    assert other == pytest.approx(math.hypot(x, y) - r - 0.5, abs=1e-14)


def test_a_spatial_box_on_a_turned_box_keeps_its_gap():
    turn = np.array([math.cos(0.4), 0.0, 0.0, math.sin(0.4)])
    below = np.array([[0.0, 0.0, 0.5, *turn]])
    above = np.array([[0.1, 0.0, 1.52, 1.0, 0.0, 0.0, 0.0]])
    cube = Box((0.5, 0.5, 0.5))
    assert separation(cube, below, cube, above)[0] == pytest.approx(0.02, abs=1e-14)
    assert separation(Sphere(0.5), above, Sphere(0.5), below)[0] == pytest.approx(math.hypot(0.1, 1.02) - 1.0)


def test_deepest_overlap_is_never_negative():
    bodies = (Body("floor", HalfSpace((0.0, 1.0)), motion="fixed"), Body("ball", Disc(0.5), pose=(0.0, 3.0, 0.0)))
    scene = Scene("s", 1, 2, bodies, (Pair(),), (0.0, 0.0), 1.0)
    t = np.array([0.0, 1.0])
    assert metrics.deepest_overlap(scene, planar(t, np.full(2, 3.0), np.zeros(2))) == 0.0
    assert metrics.deepest_overlap(scene, planar(t, np.full(2, 0.4), np.zeros(2))) == pytest.approx(0.1)


def test_chatter_of_a_resting_ball_is_no_arc():
    t = np.arange(200) / 240
    chatter = 1e-13 * np.sin(40.0 * t)
    assert len(metrics.apexes(t, chatter, chatter, 2 * G / 240)[0]) == 0
