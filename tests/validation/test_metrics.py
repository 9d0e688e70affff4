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
def test_apex_of_a_sampled_parabola(v0, phase, dt):
    t = (np.arange(int(2 * v0 / G / dt) + 4) + phase) * dt
    y, v = v0 * t - 0.5 * G * t * t, v0 - G * t
    assert v[0] > 0.0 > v[-1]  # at least 0.2 m/s at the start, at most a sixtieth of a second of gravity later
    times, tops = metrics.apexes(t, y, v)
    assert len(times) == len(tops) == 1
    assert tops[0] == pytest.approx(0.5 * v0 * v0 / G, abs=1e-12)
    assert times[0] == pytest.approx(v0 / G, abs=1e-9)


def test_a_release_from_rest_is_not_an_apex():
    t = np.arange(50) / 240
    assert len(metrics.apexes(t, 1.0 - 0.5 * G * t * t, -G * t)[0]) == 0


def test_last_motion_of_a_run_that_never_stops():
    t = np.linspace(0.0, 1.0, 11)
    assert metrics.last_motion(t, np.zeros(11), 0.1) == (0.0, "")
    value, why = metrics.last_motion(t, np.ones(11), 0.1)
    assert value == 1.0 and "still moving" in why
    speed = np.where(t < 0.45, 1.0, 0.0)
    assert metrics.last_motion(t, speed, 0.1)[0] == pytest.approx(0.5)


def test_mean_rate_of_a_parabola_as_its_middle_slope():
    t = np.linspace(0.0, 2.0, 481)
    assert metrics.mean_rate(t, 0.5 * 3.0 * t * t)[0] == pytest.approx(3.0 * 1.5, rel=1e-12)


def test_kinetic_energy_with_inertia_in_body_axes():
    box = Body("box", Box((0.5, 0.5, 0.5)), 2.0, (1.0, 2.0, 3.0), (0, 0, 0, math.cos(0.3), math.sin(0.3), 0, 0))
    scene = Scene("s", 1, 3, (box,), (), (0.0, 0.0, 0.0), 1.0)
    # Turned by 0.6 rad about x: a world spin about x is a body spin about x.
    twist = np.zeros((2, 1, 6))
    twist[:, 0] = (1.0, 2.0, 3.0, 4.0, 0.0, 0.0)
    pose = np.repeat(np.array(box.pose)[None, None], 2, axis=0)
    trajectory = Trajectory(np.array([0.0, 1.0]), pose, twist, None, 1.0, "completed")
    assert metrics.kinetic_energy(scene, trajectory) == pytest.approx(0.5 * 2 * 14 + 0.5 * 1 * 16)


def test_sign_and_scale_of_interface_loads():
    t = np.arange(11) * 0.1
    rows = Contacts.from_rows([(1, 0, (0, 0), (0, -1), (0, -0.25), 0.0)] * 20, 2)
    record = ContactRecord(np.arange(1, 11), np.arange(0, 22, 2), rows)
    trajectory = planar(t, np.zeros(11), np.zeros(11))
    trajectory = Trajectory(t, trajectory.pose, trajectory.twist, record, 0.1, "completed")
    (mean, why), deviation = metrics.interface_load(trajectory, [(0, 1)], 0.5, 1.0)
    assert (mean, why, deviation) == (pytest.approx(1.0), "", pytest.approx(0.0))


def test_unavailable_impulses_not_taken_for_zero():
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


def test_gap_of_a_spatial_box_on_a_turned_box():
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


def test_chatter_of_a_resting_ball():
    t = np.arange(200) / 240
    chatter = 1e-13 * np.sin(40.0 * t)
    assert len(metrics.apexes(t, chatter, chatter, 2 * G / 240)[0]) == 0


# ---- every metric on numbers that are worked out by hand -----------------------------------------------------------


def spatial(t, **columns):
    """A floor and one body that moves as ``columns`` say: x, z and speeds vx, vz."""
    pose, twist = np.zeros((len(t), 2, 7)), np.zeros((len(t), 2, 6))
    pose[:, :, 3] = 1.0
    for name, values in columns.items():
        where, axis = (twist, "xyz".index(name[1])) if name[0] == "v" else (pose, "xyz".index(name))
        where[:, 1, axis] = values
    return Trajectory(t, pose, twist, None, t[1] - t[0], "completed")


def recorded(trajectory, rows_per_sample, first=1):
    """The trajectory with contacts: a list of rows (a, b, impulse) for every sample from ``first`` on."""
    d = trajectory.dimension
    flat = [(a, b, (0.0,) * d, (0.0,) * d, impulse, 0.0) for rows in rows_per_sample for a, b, impulse in rows]
    offset = np.cumsum([0, *(len(rows) for rows in rows_per_sample)])
    step = np.arange(first, first + len(rows_per_sample))
    record = ContactRecord(step, offset, Contacts.from_rows(flat, d))
    return Trajectory(trajectory.t, trajectory.pose, trajectory.twist, record, trajectory.dt, "completed")


def resting(samples, dt=0.1):
    return planar(np.arange(samples) * dt, np.zeros(samples), np.zeros(samples))


def test_total_impulse_over_samples_and_contacts():
    rows = [[(0, 1, (1.0, 2.0)), (0, 1, (0.5, 0.25))], [], [(1, 0, (-1.0, -4.0)), (0, 2, (64.0, 64.0))]]
    total, why = metrics.total_impulse(recorded(resting(4), rows), 0, 1)
    assert (list(total), why) == ([2.5, 6.25], "")


def test_unrecorded_impulses_have_no_value():
    assert metrics.total_impulse(resting(2), 0, 1) == (None, "contacts were not recorded")
    assert metrics.interface_load(resting(2), [(0, 1)], 1.0, 1.0) == ((None, "contacts were not recorded"), None)


def test_impulse_without_one_component():
    trajectory = recorded(resting(2), [[(0, 1, (1.0, math.nan))]])
    assert metrics.total_impulse(trajectory, 0, 1) == (None, metrics.UNAVAILABLE)


def test_tops_of_two_arcs_that_lie_between_samples():
    """Two parabolas under 8 m/s^2 with tops at (0.28125, 1.5) and (0.84375, 0.75), sampled every 1/16 s."""
    t = np.arange(20) / 16
    tops = [(0.28125, 1.5), (0.84375, 0.75)]
    arc = np.where(t < 0.5625, 0, 1)
    from_top = t - np.array([tops[k][0] for k in arc])
    y, v = np.array([tops[k][1] for k in arc]) - 4.0 * from_top**2, -8.0 * from_top
    times, heights = metrics.apexes(t, y, v)
    assert list(times) == pytest.approx([0.28125, 0.84375], abs=1e-14)
    assert list(heights) == pytest.approx([1.5, 0.75], abs=1e-14)


@pytest.mark.parametrize(("least", "found"), [(1.0, 0), (0.999, 1), (0.5, 1)])
def test_arcs_above_the_least_speed(least, found):
    """Its fastest sample is 1 m/s; that an earlier arc was faster does not make this one count."""
    v = np.array([5.0, 2.0, -3.0, 1.0, 0.5, 0.0, -0.5])
    times, _ = metrics.apexes(np.arange(7) / 8, np.array([0.0, 0.5, 0.25, 0.0, 0.25, 0.375, 0.25]), v, least)
    assert len(times) == 1 + found


def test_end_of_an_arc_at_rest_and_cut_off():
    t = np.arange(4) / 8
    y = np.array([0.0, 0.5, 0.75, 0.75])
    assert len(metrics.apexes(t, y, np.array([2.0, 1.0, 0.5, 0.0]))[0]) == 1
    assert len(metrics.apexes(t, y, np.array([2.0, 1.0, 0.5, 0.25]))[0]) == 0


def test_top_without_curvature():
    t = np.arange(6) / 8
    times, tops = metrics.apexes(t, np.full(6, 0.5), np.array([1.0, 1.0, 1.0, -1.0, -1.0, -1.0]))
    assert (list(times), list(tops)) == ([0.125], [0.5])


def test_ratio_of_intervals():
    assert metrics.interval_ratio(np.array([1.0, 3.0, 4.0, 9.0])) == (0.5, "")
    assert metrics.interval_ratio(np.array([1.0, 3.0, 4.0])) == (0.5, "")
    assert metrics.interval_ratio(np.array([1.0, 3.0])) == (0.0, "there are only 2 apexes, three are needed")


def test_last_motion_by_the_speed_threshold():
    t = np.arange(5) / 4
    assert metrics.last_motion(t, np.array([1.0, -1.0, 0.0, 0.0, 0.0]), 0.5) == (0.5, "")
    assert metrics.last_motion(t, np.array([1.0, 0.5, -0.5, 0.5, 0.0]), 0.5) == (0.25, "")
    assert metrics.last_motion(t, np.array([0.0, 0.0, 0.0, 1.0, 0.0]), 0.5) == (1.0, "")
    assert metrics.last_motion(t, np.array([0.0, 0.0, 0.0, 0.0, -1.0]), 0.5) == (
        1.0, "never settled: still moving at the end of the run")  # fmt: skip


@pytest.mark.parametrize("samples", [5, 6])
def test_mean_rate_of_the_second_half(samples):
    t = np.arange(samples) / 4
    value = np.where(np.arange(samples) < samples // 2, 100.0, 3.0 * t)
    assert metrics.mean_rate(t, value) == (pytest.approx(3.0), "")


@pytest.mark.parametrize(
    ("shape", "reach"),
    [(Disc(0.25), 0.25), (Sphere(0.75), 0.75), (Box((3.0, 4.0)), 5.0), (Box((1.0, 2.0, 2.0)), 3.0),
     (HalfSpace((0.0, 1.0)), 0.0)],
)  # fmt: skip
def test_reach_of_a_shape(shape, reach):
    assert metrics.reach(shape) == pytest.approx(reach)


def pile(dimension, *shapes):
    floor = Body("floor", HalfSpace((*(0.0,) * (dimension - 1), 1.0)), motion="fixed")
    pose = (0.0, 0.0, 0.0) if dimension == 2 else (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    inertia = 0.5 if dimension == 2 else (0.5, 0.5, 0.5)
    free = [Body(f"b{k}", shape, 2.0, inertia, pose) for k, shape in enumerate(shapes)]
    return Scene("s", 1, dimension, (floor, *free), (Pair(),), (0.0,) * dimension, 1.0)


def test_speed_of_bodies_with_spin():
    scene = pile(2, Disc(0.5), Box((3.0, 4.0)))
    assert metrics.free_bodies(scene) == [1, 2]
    twist = np.array([[[9.0, 9.0, 9.0], [3.0, 4.0, -2.0], [0.0, 0.0, 1.0]]])
    trajectory = Trajectory(np.zeros(1), np.zeros((1, 3, 3)), twist, None, 0.1, "completed")
    assert metrics.body_speeds(scene, trajectory).tolist() == [[6.0, 5.0]]
    assert metrics.kinetic_energy(scene, trajectory) == pytest.approx([0.5 * 2 * 25 + 0.5 * 0.5 * 4 + 0.5 * 0.5])


def test_speeds_in_space_take_all_components():
    scene = pile(3, Sphere(0.5))
    twist = np.array([[[9.0] * 6, [2.0, 3.0, 6.0, 1.0, 2.0, 2.0]]])
    trajectory = Trajectory(np.zeros(1), np.zeros((1, 2, 7)), twist, None, 0.1, "completed")
    assert metrics.body_speeds(scene, trajectory).tolist() == [[8.5]]


def test_drift_is_horizontal_and_from_start_to_end():
    t = np.array([0.0, 1.0, 2.0])
    flat = planar(t, np.array([0.0, 0.0, 7.0]), np.zeros(3))
    flat.pose[:, 1, 0] = [1.0, 9.0, 0.5]
    assert metrics.lateral_drift(flat) == 0.5
    solid = spatial(t, x=np.array([1.0, 9.0, 4.0]), y=np.array([2.0, 9.0, 6.0]), z=np.array([0.0, 0.0, 7.0]))
    assert metrics.lateral_drift(solid) == 5.0


def test_deepest_overlap_of_neighbours():
    scene = pile(2, Disc(0.5), Disc(0.5), Disc(0.5))
    pose = np.zeros((2, 4, 3))
    pose[:, 1:, 1] = [[0.5, 1.5, 2.5], [0.5, 1.25, 2.25]]
    trajectory = Trajectory(np.arange(2.0), pose, np.zeros_like(pose), None, 1.0, "completed")
    assert metrics.deepest_overlap(scene, trajectory) == pytest.approx(0.25)
    alone = Scene("s", 1, 2, (scene.bodies[0],), (), (0.0, 0.0), 1.0)
    assert metrics.deepest_overlap(alone, trajectory) == 0.0


def test_overlaps_of_all_pairs_that_meet():
    scene = pile(2, Disc(0.5), Disc(0.5), Disc(0.5))
    pose = np.zeros((2, 4, 3))
    pose[:, 1:, 1] = [[0.5, 1.5, 9.0], [0.375, 1.5, 9.0]]
    pose[1, 3, 1] = 0.625
    trajectory = Trajectory(np.arange(2.0), pose, np.zeros_like(pose), None, 1.0, "completed")
    found = {pair: depth.tolist() for pair, depth in metrics.overlaps(scene, trajectory).items()}
    assert found == {(0, 1): [0.0, 0.125], (1, 3): [0.0, 0.75], (2, 3): [0.0, 0.125]}


def test_interface_load_of_the_last_window():
    """Samples at .1 to 1 s, the first half of them absurd; windows begin after their first instant."""
    impulses = [(0.0, 100.0)] * 5 + [(5.0, f) for f in (1.0, 2.0, 3.0, 2.0, 2.0)]
    trajectory = recorded(resting(11), [[(0, 1, impulse)] for impulse in impulses])
    (mean, why), deviation = metrics.interface_load(trajectory, [(0, 1)], 0.5, 0.45)
    assert (mean, why) == (pytest.approx(4.0), "")
    assert deviation == pytest.approx(2.0 * math.sqrt(0.4))
    with_a_gap = recorded(resting(11), [[(0, 1, (0.0, math.nan))] for _ in impulses])
    assert metrics.interface_load(with_a_gap, [(0, 1)], 0.5, 0.45) == ((None, metrics.UNAVAILABLE), None)
    too_early = recorded(resting(11), [[(0, 1, (0.0, 1.0))]])
    assert metrics.interface_load(too_early, [(0, 1)], 0.5, 0.45) == ((None, metrics.UNAVAILABLE), None)


@pytest.mark.parametrize(
    ("velocity", "arcs"),
    [
        ([0.5, -1.0, 3.0, 1.0, -1.0, -1.0], 1),  # chatter does not hide the arc after it
        ([5.0, 2.0, 0.0, 0.5, -1.0, -1.0], 1),  # a sample at rest ends an arc: the chatter after it is its own
        ([5.0, -3.0, 0.5, -1.0, -1.0, -1.0], 1),  # and so does one sample that falls
        ([5.0, 0.5, 0.0, -1.0, -1.0, -1.0], 1),  # the fastest sample may be the first of all
    ],
)
def test_which_arcs_start_faster_than_the_least_speed(velocity, arcs):
    heights = np.array([0.0, 0.5, 0.75, 1.0, 0.5, 0.0])
    assert len(metrics.apexes(np.arange(6) / 8, heights, np.array(velocity), 1.0)[0]) == arcs


@pytest.mark.parametrize(
    ("height", "velocity", "time"),
    [([1.0, 0.9, 0.7, 0.4, 0.0, 0.0], [1.0, 1.0, 1.0, -1.0, -1.0, -1.0], 0.0),
     ([0.0, 0.7, 0.9, 1.0, 1.0, 1.0], [1.0, -1.0, -1.0, -1.0, -1.0, -1.0], 0.375)],
)  # fmt: skip
def test_top_within_a_step_of_its_sample(height, velocity, time):
    times, tops = metrics.apexes(np.arange(6) / 8, np.array(height), np.array(velocity))
    assert list(times) == pytest.approx([time]) and list(tops) == pytest.approx([0.975])


def test_drift_of_one_body():
    pose = np.zeros((2, 3, 3))
    pose[1, :, 0] = [0.0, 3.0, -4.0]
    assert metrics.lateral_drift(Trajectory(np.arange(2.0), pose, np.zeros_like(pose), None, 1.0, "completed")) == 4.0


def test_load_in_space_and_first_instant_of_a_window():
    t = np.arange(9) / 8
    still = spatial(t)
    trajectory = recorded(still, [[(0, 1, (7.0, 9.0, 64.0))]] * 4 + [[(0, 1, (7.0, 9.0, 3.0))]] * 4)
    (mean, _), deviation = metrics.interface_load(trajectory, [(0, 1)], 1.0, 0.5)
    assert (mean, deviation) == (3.0, 0.0)


def moved(pose, twist=None, dimension=2):
    """A trajectory of one body, number 1, beside one that never moves."""
    pose = np.asarray(pose, dtype=float)
    width = 3 if dimension == 2 else 6
    whole = np.zeros((len(pose), 2, pose.shape[1]))
    whole[:, 1] = pose
    rates = np.zeros((len(pose), 2, width))
    if twist is not None:
        rates[:, 1] = twist
    return Trajectory(np.arange(len(pose)) * 0.1, whole, rates, None, 0.1, "completed")


def turned(axis, angles):
    """Unit quaternions about an axis."""
    return [[math.cos(0.5 * a), *(math.sin(0.5 * a) * np.array(axis))] for a in angles]


def test_hop_up_or_down():
    for heights, size in (([1.0, 1.2, 0.9], 0.2), ([1.0, 1.2, 0.5], 0.5)):
        assert metrics.hop(moved([(9.0 * k, y, 7.0 * k) for k, y in enumerate(heights)])) == pytest.approx(size)
        space = [(3.0 * k, 4.0 * k, y, 1.0, 0.0, 0.0, 0.0) for k, y in enumerate(heights)]
        assert metrics.hop(moved(space, dimension=3)) == pytest.approx(size)


def test_astray_as_level_distance_from_a_line():
    line = np.array([0.6, 0.8])
    places = [(1.0, 2.0), (1.0 + 0.6 * 5.0, 2.0 + 0.8 * 5.0), (1.0 + 0.6 - 0.8 * 0.25, 2.0 + 0.8 + 0.6 * 0.25)]
    space = [(*p, 3.0 * k, 1.0, 0.0, 0.0, 0.0) for k, p in enumerate(places)]
    assert metrics.astray(moved(space, dimension=3), line) == pytest.approx(0.25, rel=1e-12)
    assert metrics.astray(moved([(1.0, 2.0, 0.0), (4.0, 7.0, 1.0)]), np.array([1.0])) == 0.0


def test_tilt_in_whole_turns_and_its_rate():
    angles = np.linspace(0.0, 9.0, 19)
    plane = moved([(0.0, 0.0, a) for a in angles], np.full((19, 3), (1.0, 2.0, 5.0)))
    assert metrics.tilt(plane) == pytest.approx(angles)
    assert metrics.tilt_rate(plane) == pytest.approx(np.full(19, 5.0))
    # Counter-clockwise seen with the first axis to the right and the third one up is about minus the second.
    pose = [(0.0, 0.0, 0.0, *q) for q in turned((0.0, -1.0, 0.0), angles)]
    space = moved(pose, np.full((19, 6), (1.0, 2.0, 3.0, 4.0, -5.0, 6.0)), 3)
    assert metrics.tilt(space) == pytest.approx(angles)
    assert metrics.tilt_rate(space) == pytest.approx(np.full(19, 5.0))


def test_a_point_of_a_body_goes_with_it():
    angles = [0.0, 0.5 * math.pi, math.pi]
    plane = moved([(1.0, 2.0, a) for a in angles])
    assert metrics.point(plane, 1, (0.3, 0.1)) == pytest.approx(np.array([(1.3, 2.1), (0.9, 2.3), (0.7, 1.9)]))
    space = moved([(1.0, 2.0, 3.0, *q) for q in turned((0.0, 0.0, 1.0), angles)], dimension=3)
    there = np.array([(1.3, 2.1, 3.5), (0.9, 2.3, 3.5), (0.7, 1.9, 3.5)])
    assert metrics.point(space, 1, (0.3, 0.1, 0.5)) == pytest.approx(there)


@pytest.mark.parametrize("level", [-0.8, -0.3, 0.0, 0.4, 1.3, 5.0])
def test_crossing_of_a_cubic(level):
    """Value t^3 / 2 + t - 1, sampled at uneven times that begin late; the root is found by itself."""
    t = np.array([0.1, 0.35, 0.8, 1.7, 2.5])
    value, rate = 0.5 * t**3 + t - 1.0, 1.5 * t**2 + 1.0
    (time, why), (speed, why_too) = metrics.crossing(t, value, rate, level)
    low, high = 0.1, 2.5
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if 0.5 * middle**3 + middle - 1.0 < level else (low, middle)
    assert (why, why_too) == ("", "")
    assert time == pytest.approx(low, rel=1e-12)
    assert speed == pytest.approx(1.5 * low**2 + 1.0, rel=1e-11)


def test_first_upward_crossing_or_none():
    t = np.linspace(0.0, 10.0, 401)
    (time, _), (speed, _) = metrics.crossing(t, np.sin(t), np.cos(t), 0.5)
    assert time == pytest.approx(math.asin(0.5), abs=1e-8)
    assert speed == pytest.approx(math.cos(math.asin(0.5)), abs=1e-5)
    late = slice(40, None)  # from 1 s on it is above, goes down and comes up again
    (time, _), _ = metrics.crossing(t[late], np.sin(t)[late], np.cos(t)[late], 0.5)
    assert time == pytest.approx(2.0 * math.pi + math.asin(0.5), abs=1e-8)
    nothing = (None, metrics.NOT_PASSED)
    assert metrics.crossing(t, np.sin(t), np.cos(t), 1.5) == (nothing, nothing)
    assert metrics.NOT_PASSED == "it never arrives there"


def test_a_crossing_at_a_sample_is_that_sample():
    t, value = np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 2.0])
    assert metrics.crossing(t, value, np.ones(3), 1.0)[0][0] == pytest.approx(1.0, abs=1e-12)
    assert metrics.crossing(t, value, np.ones(3), 2.0)[0][0] == pytest.approx(2.0, abs=1e-12)
    # Three roots between two samples: the first is meant.
    rate = np.array([30.0, 30.0])
    time = metrics.crossing(np.array([0.0, 1.0]), np.array([-1.0, 1.0]), rate, 0.0)[0][0]
    roots = np.roots([56.0, -84.0, 30.0, -1.0])
    assert time == pytest.approx(roots.real.min(), abs=1e-9)


def test_crossing_from_below_its_level():
    t, value = np.arange(5.0), np.array([0.0, 1.0, 0.0, -1.0, 1.0])
    assert metrics.crossing(t, value, np.zeros(5), 0.0)[0][0] == pytest.approx(3.5)


def test_crossing_between_its_samples():
    """(s - 0.4)^2 meets 0.2 at 0.4 -+ 0.447; (s - 0.8)((s - 0.2)^2 + 0.25) has the one real root 0.8."""
    t = np.array([0.0, 1.0])
    (time, _), (speed, _) = metrics.crossing(t, (t - 0.4) ** 2, 2.0 * (t - 0.4), 0.2)
    assert (time, speed) == (pytest.approx(0.4 + math.sqrt(0.2)), pytest.approx(2.0 * math.sqrt(0.2)))
    cubic = np.array([1.0, -1.2, 0.61, -0.232])
    value, rate = np.polyval(cubic, t), np.polyval(np.polyder(cubic), t)
    assert metrics.crossing(t, value, rate, 0.0)[0][0] == pytest.approx(0.8, rel=1e-12)


@pytest.mark.parametrize("rate", [1.0, 1.3, 1.9, 3.0])
@pytest.mark.parametrize("level", [0.0, 2.0])
def test_crossing_at_exactly_its_level(rate, level):
    """A double root, which round-off makes complex or moves beyond the sample."""
    (time, _), (speed, _) = metrics.crossing(
        np.array([3.0, 5.0]), level + np.array([-4.0, 0.0]), np.array([2.0 * rate, 0.0]), level
    )
    assert (time, speed) == (pytest.approx(5.0, abs=1e-4), pytest.approx(0.0, abs=1e-4))


def test_top_of_two_samples_and_of_a_turn():
    assert len(metrics.apexes(np.arange(2) / 8, np.array([0.0, 1.0]), np.array([1.0, -1.0]))[0]) == 0
    # The last sample is the highest and has no neighbour: the top is the nearest that has two.
    times, _ = metrics.apexes(np.arange(4) / 8, np.array([0.0, 0.2, 0.8, 1.0]), np.array([1.0, 1.0, 1.0, -1.0]))
    assert list(times) == pytest.approx([3 / 8])
    velocity = np.array([1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0])
    times, _ = metrics.apexes(np.arange(7.0), np.array([0.0, 9.0, 0.4, 0.5, 0.5, 0.4, 0.0]), velocity)
    assert list(times) == pytest.approx([3.5])  # and not the earlier one, which belongs to nothing


def test_late_impulses_of_the_pair_after_the_first_instant():
    t = np.arange(9) / 8
    rows = [[(0, 1, (64.0, 64.0))]] * 4 + [[(0, 1, (1.0, 2.0)), (1, 0, (-0.5, -0.25))], [], [(0, 2, (9.0, 9.0))], []]
    trajectory = recorded(planar(t, np.zeros(9), np.zeros(9)), rows)
    found = metrics.late_impulses(trajectory, 0, 1, 0.5)
    assert found is not None and found.tolist() == [[1.5, 2.25], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]]
    last = metrics.late_impulses(trajectory, 0, 1, 0.125)
    assert last is not None and last.tolist() == [[0.0, 0.0]]


def test_unreported_late_impulses_have_no_value():
    assert metrics.late_impulses(resting(3), 0, 1, 1.0) is None
    assert metrics.late_impulses(recorded(resting(9), [[(0, 1, (1.0, 1.0))]]), 0, 1, 0.2) is None  # all too early
    assert metrics.late_impulses(recorded(resting(2), [[(0, 1, (1.0, math.nan))]]), 0, 1, 1.0) is None


def test_deepest_overlap_of_stated_pairs():
    scene = pile(2, Disc(0.5), Disc(0.5))
    pose = np.zeros((1, 3, 3))
    pose[:, 1:, 1] = [0.25, 0.125]  # 0.25 deep in the floor and 0.375; 0.875 in each other
    trajectory = Trajectory(np.zeros(1), pose, np.zeros_like(pose), None, 1.0, "completed")
    assert metrics.deepest_overlap(scene, trajectory, [(0, 1)]) == 0.25
    assert metrics.deepest_overlap(scene, trajectory, [(0, 1), (0, 2)]) == 0.375
    assert metrics.deepest_overlap(scene, trajectory, []) == 0.0


def test_largest_distance_from_the_first_sample():
    line = np.array([1.0, 0.0])
    places = [(1.0, 2.0), (3.0, 2.5), (4.0, 1.25), (5.0, 2.5)]
    space = [(*p, 0.0, 1.0, 0.0, 0.0, 0.0) for p in places]
    assert metrics.astray(moved(space, dimension=3), line) == 0.75


@pytest.mark.parametrize("angles", [(0.3, 0.5, -0.4), (0.3, 1.0, 0.4), (-2.0, 1.0, 0.0)])
def test_largest_turn_from_the_first_pose(angles):
    largest = max(abs(a - angles[0]) for a in angles)
    assert metrics.turned(np.array([(7.0, 8.0 * k, a) for k, a in enumerate(angles)])) == pytest.approx(largest)
    for axis in ((0.0, 0.0, 1.0), (0.0, -1.0, 0.0), (2 / 3, 1 / 3, -2 / 3)):
        pose = np.array([(7.0, 8.0 * k, 9.0, *q) for k, q in enumerate(turned(axis, angles))])
        assert metrics.turned(pose) == pytest.approx(largest, abs=1e-7)


def test_rotation_angle_of_half_and_whole_turns():
    assert metrics.turned(np.array([(0.0, 0.0, 0.5), (0.0, 0.0, 10.5)])) == 10.0
    pose = np.array([(0.0, 0.0, 0.0, *q) for q in turned((0.6, 0.0, 0.8), (0.0, math.pi, 5.0))])
    assert metrics.turned(pose) == pytest.approx(math.pi)


def test_largest_relative_error_and_a_missing_value():
    found = {"a": (2.2, ""), "b": (-3.6, "read late"), "lost": (None, "it never touched"), "later": (None, "gone")}
    truth = {"a": 2.0, "b": -3.0, "lost": 1.0, "later": 1.0}
    assert metrics.relative_error(found, truth, ["a", "b"]) == (pytest.approx(0.2, rel=1e-12), "")
    assert metrics.relative_error(found, truth, ["a"]) == (pytest.approx(0.1, rel=1e-12), "")
    assert metrics.relative_error(found, truth, ["a", "lost", "later"]) == (None, "it never touched")


# ---- what is no number ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("place", range(3))
def test_largest_of_values_with_a_nan(place):
    values = [1.0, 3.0, 2.0]
    assert metrics.largest(iter(values)) == 3.0
    values[place] = math.nan
    assert math.isnan(metrics.largest(values))


@pytest.mark.parametrize("lost", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", range(3))
def test_search_for_events_with_a_nan_sample(lost, place):
    t, fine, broken = np.arange(3.0), np.array([-1.0, 0.5, 1.0]), np.array([-1.0, 0.5, 1.0])
    broken[place] = lost
    metrics.numbers()
    metrics.numbers(fine, fine)
    asked = (metrics.numbers, lambda a, b: metrics.apexes(t, a, b), lambda a, b: metrics.crossing(t, a, b, 0.0))
    for ask in asked:
        for series in ((broken, fine), (fine, broken)):
            with pytest.raises(ArithmeticError, match=r"^a sample is not a finite number$"):
                ask(*series)


@pytest.mark.parametrize("place", range(3))
def test_last_motion_with_a_nan_speed(place):
    speed = np.array([3.0, 0.0, 0.0])
    assert metrics.last_motion(np.arange(3.0), speed, 1.0) == (1.0, "")
    speed[place] = math.nan
    assert metrics.last_motion(np.arange(3.0), speed, 1.0) == (None, "a speed is not a number")


@pytest.mark.parametrize("pair", range(2))
def test_overlap_of_a_pair_with_a_nan_pose(pair):
    """Whichever pair comes first: the other one overlaps by .5 m."""
    bodies = tuple(Body(name, Disc(0.5), 1.0, 0.125) for name in "abcd")
    pose = np.zeros((1, 4, 3))
    pose[0, :, 0] = 0.0, 0.5, 10.0, 10.5
    found = Trajectory(np.zeros(1), pose, np.zeros_like(pose), None, 1.0, "completed")
    scene = Scene("s", 1, 2, bodies, (), (0.0, 0.0), 1.0)
    assert metrics.deepest_overlap(scene, found, [(0, 1), (2, 3)]) == 0.5
    pose[0, 2 * pair, 0] = math.nan
    assert math.isnan(metrics.deepest_overlap(scene, found, [(0, 1), (2, 3)]))


def test_largest_relative_error_with_a_missing_value():
    truth = {"a": 2.0, "b": 4.0}
    for found in ({"a": (math.nan, ""), "b": (5.0, "")}, {"a": (1.0, ""), "b": (math.nan, "")}):
        value, why = metrics.relative_error(found, truth, ["a", "b"])
        assert math.isnan(value) and why == ""
