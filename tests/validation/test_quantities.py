"""Quantities that a scene file may state: units, signs, windows and turns, on trajectories worked out by hand."""

import math
import time
from dataclasses import replace

import numpy as np
import pytest

from adapters.engine import Contacts
from adapters.scene import Body, Box, Disc, HalfSpace, Pair, Scene, Sphere
from adapters.trajectory import ContactRecord, Trajectory
from validation.files.quantities import force_window, parts_of, quantity, unit
from validation.files.stated import Stated, canonical_of
from validation.metrics import UNAVAILABLE


def scene_of(dimension, duration=4.0):
    flat = (0.0,) * (dimension - 1)
    pose = (0.0, 0.0, 0.0) if dimension == 2 else (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    inertia = 1.0 if dimension == 2 else (1.0, 1.0, 1.0)
    shape = Disc(0.5) if dimension == 2 else Sphere(0.5)
    bodies = (
        Body("floor", HalfSpace((*flat, 1.0)), motion="fixed"),
        Body("ball", shape, 1.0, inertia, pose),
        Body("top", shape, 1.0, inertia, pose),
    )
    return Scene("s", 1, dimension, bodies, (Pair(),), (0.0,) * dimension, duration)


def moving(dimension, samples=5, dt=1.0):
    """Every coordinate of every body is a number of its own: 100 body + 10 coordinate + sample."""
    size = (3, 3) if dimension == 2 else (7, 6)
    grid = np.arange(samples)[:, None, None] + 100.0 * np.arange(3)[None, :, None]
    pose, twist = (grid + 10.0 * np.arange(n)[None, None, :] for n in size)
    return Trajectory(np.arange(samples) * dt, pose, -twist, None, dt, "completed")


@pytest.mark.parametrize(
    ("names", "expected"),
    [("x y z", "m"), ("angle", "rad"), ("omega wx wy wz", "rad/s"), ("vx vy vz", "m/s"), ("fx fy fz", "N")],
)
def test_units(names, expected):
    assert {unit(f"ball.{name}") for name in names.split()} == {expected}
    assert {unit(f"floor/ball.{name}") for name in names.split()} == {expected}


@pytest.mark.parametrize(("duration", "window"), [(4.0, 1.0), (2.0, 1.0), (1.0, 0.5)])
def test_time_over_which_forces_are_means(duration, window):
    assert force_window(scene_of(2, duration)) == window


@pytest.mark.parametrize(
    ("dimension", "name", "column"),
    [(2, "x", 0), (2, "y", 1), (2, "vx", 0), (2, "vy", 1), (2, "omega", 2),
     (3, "x", 0), (3, "y", 1), (3, "z", 2), (3, "vx", 0), (3, "vy", 1), (3, "vz", 2),
     (3, "wx", 3), (3, "wy", 4), (3, "wz", 5)],
)  # fmt: skip
def test_coordinates_at_the_end_and_between_samples(dimension, name, column):
    sign = 1.0 if name in "xyz" else -1.0
    scene, trajectory = scene_of(dimension), moving(dimension)
    assert quantity(scene, trajectory, f"ball.{name}") == (sign * (104.0 + 10.0 * column), "")
    assert quantity(scene, trajectory, f"top.{name}", 1.25) == (sign * (201.25 + 10.0 * column), "")
    assert quantity(scene, trajectory, f"top.{name}", 0.0) == (sign * (200.0 + 10.0 * column), "")


@pytest.mark.parametrize("name", ["ball.z", "ball.vz"])
def test_no_third_axis_in_the_plane(name):
    with pytest.raises(AssertionError):
        quantity(scene_of(2), moving(2), name)


def test_turns_of_an_angle_in_the_plane():
    """Three turns and a half, sampled as angles between -pi and pi, from 1 rad."""
    angle = 1.0 + np.linspace(0.0, 7.0 * math.pi, 200)
    pose = np.zeros((200, 3, 3))
    pose[:, 1, 2] = np.arctan2(np.sin(angle), np.cos(angle))
    trajectory = Trajectory(np.linspace(0.0, 1.0, 200), pose, np.zeros_like(pose), None, 1 / 199, "completed")
    assert quantity(scene_of(2), trajectory, "ball.angle") == (pytest.approx(7.0 * math.pi), "")
    assert quantity(scene_of(2), trajectory, "ball.angle", 0.0) == (pytest.approx(0.0), "")


@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.48, 0.6, 0.64)])
@pytest.mark.parametrize("turn", [0.0, 0.4, 1.7, 3.0])
def test_rotation_angle_in_space_at_any_axis_and_start(axis, turn):
    def quaternion(about, by):
        return np.array([math.cos(by / 2), *(math.sin(by / 2) * np.array(about))])

    def product(p, q):
        (a, *u), (b, *v) = p, q
        u, v = np.array(u), np.array(v)
        return np.array([a * b - u @ v, *(a * v + b * u + np.cross(u, v))])

    start = quaternion((0.6, 0.0, 0.8), 0.9)
    pose = np.zeros((2, 3, 7))
    pose[:, :, 3] = 1.0
    pose[0, 1, 3:], pose[1, 1, 3:] = start, product(quaternion(axis, turn), start)
    trajectory = Trajectory(np.array([0.0, 1.0]), pose, np.zeros((2, 3, 6)), None, 1.0, "completed")
    value, why = quantity(scene_of(3), trajectory, "ball.angle")
    assert (value, why) == (pytest.approx(turn, abs=1e-12), "")
    assert quantity(scene_of(3), trajectory, "ball.angle", 0.0)[0] == pytest.approx(0.0, abs=1e-12)


def test_body_name_with_a_slash_in_a_quantity():
    scene = scene_of(2)
    named = Scene("s", 1, 2, (*scene.bodies[:2], Body("a/b", Disc(0.5))), (Pair(),), (0.0, 0.0), 4.0)
    assert quantity(named, moving(2), "a/b.y") == (214.0, "")


def pushed(dimension, rows_per_sample, dt=0.25, samples=17):
    """Contacts (a, b, impulse on b) at every sample from the first step on."""
    still = moving(dimension, samples, dt)
    flat = [(a, b, (0.0,) * dimension, (0.0,) * dimension, f, 0.0) for rows in rows_per_sample for a, b, f in rows]
    offset = np.cumsum([0, *(len(rows) for rows in rows_per_sample)])
    step = np.arange(1, 1 + len(rows_per_sample))
    record = ContactRecord(step, offset, Contacts.from_rows(flat, dimension))
    return Trajectory(still.t, still.pose, still.twist, record, dt, "completed")


#: 16 steps of 1/4 s: absurd impulses but for the last four, which are the last second.
LAST_SECOND = [[(0, 1, (900.0, 900.0))]] * 12 + [[(0, 1, (0.5, f)), (1, 2, (0.0, 1.0))] for f in (1.0, 2.0, 3.0, 4.0)]


@pytest.mark.parametrize(
    ("name", "force"),
    [
        ("ball.fy", (10.0 - 4.0) / 1.0),  # the floor pushes up, the body above pushes down
        ("ball.fx", 2.0),
        ("floor/ball.fy", 10.0),
        ("ball/floor.fy", -10.0),
        ("top.fy", 4.0),
        ("ball/top.fy", 4.0),
        ("top/ball.fy", -4.0),
        ("floor.fy", -10.0),
        ("floor/top.fy", 0.0),
    ],
)
def test_force_sign_and_mean_over_the_last_second(name, force):
    assert quantity(scene_of(2), pushed(2, LAST_SECOND), name) == (pytest.approx(force), "")


def test_forces_in_space_have_three_components():
    trajectory = pushed(3, [[(0, 1, (1.0, 2.0, 3.0))]] * 16)
    forces = [quantity(scene_of(3), trajectory, f"ball.{name}")[0] for name in ("fx", "fy", "fz")]
    assert forces == pytest.approx([4.0, 8.0, 12.0])


def test_missing_force_with_its_reason():
    assert quantity(scene_of(2), moving(2), "ball.fy") == (None, "contacts were not recorded")
    assert quantity(scene_of(2), pushed(2, []), "ball.fy") == (None, "contacts were not recorded")
    blank = pushed(2, [[(0, 1, (math.nan, math.nan))]] * 16)
    assert quantity(scene_of(2), blank, "ball.fy") == (None, UNAVAILABLE)
    assert quantity(scene_of(2), blank, "top.fy") == (0.0, "")


def test_names_of_bodies_may_hold_dots_and_slashes():
    """The quantity stands after the last dot; a slash parts two bodies where both sides are the name of one."""
    assert parts_of("box.1.y") == (None, "box.1", "y")
    names = {"a", "a/b", "c"}
    assert parts_of("a/b/c.fy", names) == ("a/b", "c", "fy")  # there is no body b/c
    assert parts_of("a/b/c.fy", {"a", "b/c", "c"}) == ("a", "b/c", "fy")


# ---- what measuring costs ------------------------------------------------------------------------------------------


def hall(count, samples=24):
    """Boxes in columns of five on a floor, at rest, each carried by what is below it: scene and trajectory."""
    side = math.ceil(math.sqrt(count / 5))
    bodies = [Body("floor", HalfSpace((0.0, 0.0, 1.0)), motion="fixed")]
    rows = []
    for k in range(count):
        column, height = divmod(k, 5)
        pose = (0.5 * (column % side), 0.5 * (column // side), 0.1 + 0.2 * height, 1.0, 0.0, 0.0, 0.0)
        bodies.append(Body(f"b{k}", Box((0.1, 0.1, 0.1)), 1.0, (0.01, 0.01, 0.01), pose))
        rows.append((k if height else 0, k + 1, pose[:3], (0.0, 0.0, 1.0), (0.0, 0.0, (5 - height) * 0.04), 0.0))
    scene = Scene("hall", 1, 3, tuple(bodies), (Pair(friction=0.5),), (0.0, 0.0, -9.81), samples / 240)
    pose = np.tile(np.array([body.pose for body in scene.bodies])[None], (samples + 1, 1, 1))
    steps = np.arange(1, samples + 1)
    contacts = ContactRecord(steps, np.arange(samples + 1) * len(rows), Contacts.from_rows(rows * samples, 3))
    t = np.arange(samples + 1) / 240
    return scene, Trajectory(t, pose, np.zeros((samples + 1, count + 1, 6)), contacts, 1 / 240, "completed")


def test_measuring_many_bodies_costs_as_many_times_one():
    """Least CPU time of three, from 80 to 640 bodies: n^1.2 is a factor of 12; n^2 would be 64."""
    times = []
    for count in (80, 640):
        scene, trajectory = hall(count, samples=4)
        canonical = canonical_of(Stated(scene, (), ()), "hall")
        taken = []
        for _ in range(3):
            begun = time.process_time()
            found = canonical.measure(scene, replace(trajectory, contacts=replace(trajectory.contacts)))
            taken.append(time.process_time() - begun)
        times.append(min(taken))
        assert found["final[b0.fz]"][0] == pytest.approx(0.04 * 240) and found["penetration"] == (0.0, "")
        assert found["final[b4.fz]"][0] == pytest.approx(0.04 * 240)
    assert times[1] / times[0] < 2.0 * 8.0**1.2  # twice it: room for a busy machine
