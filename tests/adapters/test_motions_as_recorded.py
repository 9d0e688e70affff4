"""What MuJoCo's law makes of bodies, number by number as the step loop records it; what an engine says of itself."""

from dataclasses import replace

import numpy as np
import pytest

from adapters.mujoco.contact_law import ContactLaw, Impedance
from adapters.mujoco.motions import along_a_heading, as_trajectory, column, fall, is_vertical
from adapters.scene import Body, Box, Disc, HalfSpace, Scene, Sphere

DT = 1 / 64


def scene(dimension, count=2):
    up = (0.0, 1.0) if dimension == 2 else (0.0, 0.0, 1.0)
    shape = Disc(0.5) if dimension == 2 else Sphere(0.5)
    moment, rest = (0.1, (0.0,)) if dimension == 2 else ((0.1,) * 3, (1.0, 0.0, 0.0, 0.0))
    bodies = [Body("floor", HalfSpace(up), motion="fixed")]
    for k in range(count):
        place = (*(0.0,) * (dimension - 1), 0.5 + k)
        bodies.append(Body(f"ball{k}", shape, 1.0, moment, (*place, *rest)))
    return Scene("column", 1, dimension, tuple(bodies), (), tuple(-x for x in up), 1.0)


@pytest.mark.parametrize("dimension", [2, 3])
def test_vertical_quantities_at_the_right_bodies(dimension):
    rows = np.arange(3 * 3 * 2, dtype=float).reshape(3, 3, 2)
    given = scene(dimension)
    told = as_trajectory(given, DT, rows)
    assert told.t.tolist() == [0.0, DT, 2 * DT] and told.dt == DT and told.finish == "completed"
    start = np.array([body.pose for body in given.bodies])
    for k in range(3):
        pose, twist = start.copy(), np.zeros((3, 3 if dimension == 2 else 6))
        pose[1:, dimension - 1], twist[1:, dimension - 1] = rows[k, 0], rows[k, 1]
        assert told.pose[k].tolist() == pose.tolist() and told.twist[k].tolist() == twist.tolist()
    assert told.contacts.step.tolist() == [0, 1, 2] and told.contacts.offset.tolist() == [0, 2, 4, 6]
    held = told.contacts.rows
    assert held.a.tolist() == [0, 1] * 3 and held.b.tolist() == [1, 2] * 3
    assert held.impulse.tolist() == [[*(0.0,) * (dimension - 1), x] for x in rows[:, 2].ravel()]
    for unknown, shape in ((held.point, (6, dimension)), (held.normal, (6, dimension)), (held.gap, (6,))):
        assert unknown.shape == shape and np.isnan(unknown).all()


def test_planar_motion_turn_from_heading_to_vertical():
    motion = np.array([[[1.0, 2.0, 0.5], [3.0, 4.0, 5.0]], [[-1.0, 0.25, -0.5], [0.5, -2.0, 1.0]]])
    flat = along_a_heading(scene(2, 1), DT, np.array([-1.0]), motion)
    assert flat.t.tolist() == [0.0, DT] and flat.dt == DT and flat.finish == "completed" and flat.contacts is None
    assert flat.pose[:, 1].tolist() == [[-1.0, 2.0, 0.5], [1.0, 0.25, -0.5]]
    assert flat.twist[:, 1].tolist() == [[-3.0, 4.0, 5.0], [-0.5, -2.0, 1.0]]
    assert not flat.pose[:, 0].any() and not flat.twist[:, 0].any()
    c, s = 0.6, 0.8
    solid = along_a_heading(scene(3, 1), DT, np.array([c, s]), motion)
    assert solid.t.tolist() == [0.0, DT] and solid.finish == "completed" and solid.contacts is None
    assert solid.pose[:, 1, :3] == pytest.approx(np.array([[c, s, 2.0], [-c, -s, 0.25]]))
    assert solid.twist[:, 1, :3] == pytest.approx(np.array([[3.0 * c, 3.0 * s, 4.0], [0.5 * c, 0.5 * s, -2.0]]))
    assert solid.twist[:, 1, 3:] == pytest.approx(np.array([[5.0 * s, -5.0 * c, 0.0], [s, -c, 0.0]]))
    assert not solid.twist[:, 0].any() and solid.pose[:, 0, :4].tolist() == [[0.0, 0.0, 0.0, 1.0]] * 2
    w, x, y, z = solid.pose[0, 1, 3:]  # the heading, turned by half a radian: cos along it, sin upwards
    turned = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)]) * c
    turned += np.array([2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)]) * s
    assert turned == pytest.approx(np.array([c * np.cos(0.5), s * np.cos(0.5), np.sin(0.5)]))


@pytest.mark.parametrize("dimension", [2, 3])
def test_vertical_condition_of_a_motion(dimension):
    given, d = scene(dimension), dimension
    floor, low, high = given.bodies
    assert is_vertical(given) and is_vertical(replace(given, bodies=(floor,)))
    assert is_vertical(replace(given, gravity=(0.0,) * d))
    upright = replace(high, twist=(*(0.0,) * (d - 1), 2.0, *(0.0,) * (1 if d == 2 else 3)))
    assert is_vertical(replace(given, bodies=(floor, low, upright)))
    turns = 1 if d == 2 else 3
    tilt = (0.1,) if d == 2 else (0.8, 0.6, 0.0, 0.0)
    others = [
        replace(high, motion="fixed"), replace(high, pose=(0.1, *high.pose[1:])), replace(high, motion="prescribed"),
        replace(high, pose=(*high.pose[:d], *tilt)), replace(high, force=(*(0.0,) * (d - 1), 1.0)),
        replace(high, torque=(*(0.0,) * (turns - 1), 1.0)), replace(high, twist=(1.0, *(0.0,) * (d + turns - 1))),
        replace(high, twist=(*(0.0,) * (d + turns - 1), 1.0)),
    ]  # fmt: skip
    for other in others:
        assert not is_vertical(replace(given, bodies=(floor, low, other))), other
        assert not is_vertical(replace(given, bodies=(floor, replace(other, name="ball0"), high))), other
    assert not is_vertical(replace(given, gravity=(1.0, *given.gravity[1:])))
    up = floor.shape.normal
    for shape in (HalfSpace(up, 0.5), HalfSpace(up, -0.5), HalfSpace(tuple(-x for x in up)), Box((0.5,) * d)):
        assert not is_vertical(replace(given, bodies=(replace(floor, shape=shape), low, high))), shape


def law(damping=8.0, stiffness=64.0, deep=0.5, softness=1.0, margin=0.0):
    return ContactLaw(DT, damping, stiffness, Impedance.of((deep, deep, 0.001, 0.5, 1.0)), softness, margin)


def test_free_fall_until_touch_then_push_by_the_law():
    free = fall(law(), 2.0, -1.0, 0.5, -1.0, 3)
    speeds = [-1.0 - k * DT for k in range(4)]
    assert free.shape == (4, 3) and free[:, 1].tolist() == speeds and free[:, 2].tolist() == [0.0] * 4
    assert free[:, 0] == pytest.approx([2.0 + DT * sum(speeds[1 : k + 1]) for k in range(4)], abs=1e-15)
    pushed = fall(law(), 0.4375, -1.0, 0.5, -1.0, 1)[1]  # deep by 1/16: (8 + 64/2/16 + 1)/(1 + (1 - d)/d) upwards
    assert pushed[2] == pytest.approx(DT * 11.0 / 2.0) and pushed[1] == pytest.approx(-1.0 - DT + pushed[2])
    assert pushed[0] == pytest.approx(0.4375 + DT * pushed[1])


def test_column_of_one_as_a_body_on_four_corners():
    one = column(law(softness=1.0), (0.46875,), (1.0,), (2.0,), -1.0, 4, 0.0)
    told = fall(law(softness=0.25), 0.46875, 0.0, 0.5, -1.0, 4)
    assert one[:, :2, 0] == pytest.approx(told[:, :2], abs=1e-14)
    assert one[:, 2, 0] == pytest.approx(2.0 * told[:, 2], abs=1e-14), "an impulse, not a change of speed"


def test_loads_of_stacked_boxes_by_neighbours_only():
    masses, heights = (1.0, 3.0, 2.0), (0.49, 1.475, 2.47)
    rows = column(law(64.0, 1024.0, 0.9), heights, (1.0, 1.0, 1.0), masses, -1.0, 4000, 0.0)
    assert rows.shape == (4001, 3, 3) and rows[0, 0].tolist() == list(heights) and not rows[0, 1:].any()
    assert rows[-1, 2] == pytest.approx([6.0 * DT, 5.0 * DT, 2.0 * DT], rel=1e-6)
    assert rows[-1, 1] == pytest.approx(0.0, abs=1e-9)
    assert rows[1:, 0] == pytest.approx(rows[:-1, 0] + DT * rows[1:, 1], abs=1e-14)
    gained = np.diff(rows[:, 1], axis=0) * masses + DT * np.array(masses)
    pushes = rows[1:, 2]
    assert gained == pytest.approx(pushes - np.column_stack([pushes[:, 1:], np.zeros(4000)]), abs=1e-12)
    apart = column(law(64.0, 1024.0, 0.9), (0.49, 2.5), (1.0, 1.0), (1.0, 1.0), -1.0, 1, 0.0)
    assert apart[1, 2, 0] > 0.0 and apart[1, 2, 1] == 0.0
    shallow = column(law(64.0, 1024.0, 0.9), (0.49,), (1.0,), (1.0,), -1.0, 1, 0.02)
    assert shallow[1, 2, 0] == 0.0, "what overlaps by less than the edge does not touch"


def test_solver_accuracy_and_warnings_of_an_engine():
    pytest.importorskip("mujoco")
    from adapters.mujoco import MujocoEngine
    from adapters.needs import needs

    engine, given = MujocoEngine(), scene(3)
    values = {each.name: each.value for each in engine.settings("default", needs(given), DT)}
    world = engine.build(given, DT, values)
    try:
        world.advance(5)
        told = world.certificate()
        assert set(told) == {"residual", "newton_steps", "warnings"} and told["warnings"] == {}
        assert 0.0 <= told["residual"] < 1e-4 and all(type(n) is int for n in told["newton_steps"])
        assert any(told["newton_steps"]), "two balls that rest are solved by some step"
        data, mj = world._data, world._mujoco
        data.warning[mj.mjtWarning.mjWARN_INERTIA].number = 3
        (text,) = world.certificate()["warnings"]
        assert world.certificate()["warnings"] == {mj.mju_warningText(mj.mjtWarning.mjWARN_INERTIA, 0): 3} and text
        data.qfrc_smooth[2] += 0.5
        assert world.certificate()["residual"] == pytest.approx(0.5, abs=1e-4)
        data.qfrc_constraint[2] -= 2.0
        assert world.certificate()["residual"] == pytest.approx(1.5, abs=1e-4)
    finally:
        world.close()
    still = engine.build(replace(given, bodies=given.bodies[:1]), DT, values)
    try:
        assert still.certificate() == {}, "nothing moves: nothing is solved"
    finally:
        still.close()
