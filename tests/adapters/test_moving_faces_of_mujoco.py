"""Faces that move and surfaces that run enter a contact row by row; a slide is told from who goes with the belt."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from adapters.mujoco import belts
from adapters.mujoco.moving import Moved, enter_motions, is_moved_face, motions, moved, script_lines
from adapters.scene import Body, Box, Disc, HalfSpace, Scene
from adapters.trajectory import Trajectory

UP = (0.0, 0.0, 1.0)
STILL = Body("floor", HalfSpace(UP), motion="fixed")
BELT = Body("belt", HalfSpace(UP), motion="fixed", surface_velocity=(2.0, -1.0, 0.0))
WALL = Body("wall", HalfSpace((1.0, 0.0, 0.0), -4.0), motion="prescribed", twist=(0.5, 0.0, 0.0, 0.0, 0.0, 0.0))
BOX = Body("box", Box((0.5, 0.5, 0.5)), 1.0, (0.1,) * 3, (0.0, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0),
           (1.0, 2.0, 3.0, 4.0, 5.0, 6.0))  # fmt: skip
DT = 0.25


def scene(*bodies):
    return Scene("belts", 1, 3, bodies, (), (0.0, 0.0, -1.0), 1.0)


# ---- contacts --------------------------------------------------------------------------------------------------------

#: Normal along x, tangents along y and z; a frame that mixes nothing, and one that is turned.
PLAIN = np.eye(3)
TURNED = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def contact(geoms=(0, 1), dim=3, frame=PLAIN, row=1, friction=(0.5, 0.25, 0.125, 0.1, 0.1)):
    return SimpleNamespace(efc_address=row, frame=frame.ravel(), geom=geoms, dim=dim, friction=friction)


def entered(contacts, given, cone, rows=12):
    """What is taken from the reference accelerations [b = 2 in row 0, 3 in row 1, ...]."""
    data = SimpleNamespace(ncon=len(contacts), contact=contacts, efc_aref=np.zeros(rows),
                           efc_KBIP=np.column_stack([np.full(rows, 7.0), np.arange(2.0, 2.0 + rows)]))  # fmt: skip
    enter_motions(SimpleNamespace(opt=SimpleNamespace(cone=cone)), data, given)
    return (-data.efc_aref / np.arange(2.0, 2.0 + rows)).tolist()


FACE, SURFACE = (1.0, 2.0, 4.0), (8.0, 16.0, 32.0)
NONE = (0.0, 0.0, 0.0)


@pytest.mark.parametrize(("side", "geom"), [(-1.0, 0), (1.0, 1)])
def test_face_velocity_in_the_rows_of_both_bodies(side, geom):
    given = {geom: (FACE, NONE), 5: ((9.0, 9.0, 9.0), NONE)}
    assert entered([contact()], given, 1)[:5] == [0.0, side * 1.0, side * 2.0, side * 4.0, 0.0]
    assert entered([contact(frame=TURNED)], given, 1)[:5] == [0.0, side * 4.0, side * 1.0, side * 2.0, 0.0]
    assert entered([contact(dim=1)], given, 1)[:3] == [0.0, side * 1.0, 0.0]
    assert entered([contact(dim=1)], given, 0)[:3] == [0.0, side * 1.0, 0.0]
    assert entered([contact(dim=4)], given, 1)[:6] == [0.0, side * 1.0, side * 2.0, side * 4.0, 0.0, 0.0]


def test_surface_running_into_itself_without_lift():
    assert entered([contact()], {1: (NONE, SURFACE)}, 1)[:5] == [0.0, 0.0, 16.0, 32.0, 0.0]
    assert entered([contact(dim=1)], {1: (NONE, SURFACE)}, 1) == [0.0] * 12
    assert entered([contact()], {1: (FACE, SURFACE)}, 1)[:4] == [0.0, 1.0, 18.0, 36.0]
    assert entered([contact()], {0: (FACE, NONE), 1: (NONE, SURFACE)}, 1)[:4] == [0.0, -1.0, 14.0, 28.0]


def test_pyramid_edges_from_normal_and_tangent():
    edges = [1.0 + 1.0, 1.0 - 1.0, 1.0 + 1.0, 1.0 - 1.0]
    assert entered([contact()], {1: (FACE, NONE)}, 0)[:6] == [0.0, *edges, 0.0]
    assert entered([contact(dim=4)], {1: (FACE, NONE)}, 0)[:8] == [0.0, *edges, 1.0, 1.0, 0.0]
    assert entered([contact(friction=(2.0, 1.0))], {1: (FACE, NONE)}, 0)[1:5] == [5.0, -3.0, 5.0, -3.0]


def test_rows_of_neighbouring_and_excluded_contacts():
    contacts = [contact(row=-1), contact(row=0, dim=1), contact(geoms=(2, 3), row=1), contact(geoms=(1, 2), row=4)]
    assert entered(contacts, {1: (FACE, NONE)}, 1)[:8] == [1.0, 0.0, 0.0, 0.0, -1.0, -2.0, -4.0, 0.0]


# ---- scenes ----------------------------------------------------------------------------------------------------------


def test_moving_faces_and_running_surfaces_by_body_index():
    assert [is_moved_face(body) for body in (STILL, BELT, WALL, replace(BOX, motion="prescribed"))] == [
        False, False, True, False]  # fmt: skip
    given = scene(STILL, BOX, BELT, WALL)
    assert moved(given) == {2: given.bodies[2], 3: given.bodies[3]} and moved(scene(STILL, BOX)) == {}
    assert motions(given, DT, 3) == {2: (NONE, (2.0, -1.0, 0.0)), 3: ((0.5, 0.0, 0.0), NONE)}


def test_faces_moved_on_as_their_contacts():
    given = scene(STILL, WALL, BELT)

    class Model:
        def body(self, name):
            return SimpleNamespace(mocapid=[{"body1": 4, "body2": 7}[name]])

        def geom(self, name):
            return SimpleNamespace(id={"geom1": 10, "geom2": 20}[name])

        opt = SimpleNamespace(cone=1)

    data = SimpleNamespace(mocap_pos=np.zeros((8, 3)), ncon=1, contact=[contact((0, 10), row=0)],
                           efc_aref=np.zeros(3), efc_KBIP=np.ones((3, 2)))  # fmt: skip
    world = Moved(given, DT, Model(), data)
    assert world.faces == {1: 4}
    assert world.velocities() == [(0.5, 0.0, 0.0)] and not np.any(world.places())
    world.enter(0)
    assert data.efc_aref.tolist() == [-0.5, 0.0, 0.0]
    world.move()
    world.move()
    assert data.mocap_pos[4].tolist() == [0.25, 0.0, 0.0] and np.array_equal(world.places(), data.mocap_pos[[4]])
    assert not data.mocap_pos[[0, 1, 2, 3, 5, 6, 7]].any()


def test_script_with_the_moving_faces_of_the_adapter():
    assert script_lines(scene(STILL, BOX), DT, "") == ([], ["mujoco.mj_step(model, data)"])
    assert script_lines(scene(STILL, BOX), DT, "half()") == ([], ["mujoco.mj_step1(model, data)", "half()"])
    before, step = script_lines(scene(STILL, BELT, WALL), DT, "")
    assert before[:2] == ["", ""] and before[2].startswith("def enter_motions(")
    assert before[-2:] == ["# Velocities of faces that move, by the numbers of their bodies.",
                           "faces = {1: (0.0, 0.0, 0.0), 2: (0.5, 0.0, 0.0)}"]  # fmt: skip
    assert step[0].startswith("faces[2] = ") and step[1] == "mujoco.mj_step1(model, data)"
    assert step[2].startswith('enter_motions(model, data, {model.geom("geom1").id: (faces[1], ')
    assert step[3:] == ["mujoco.mj_step2(model, data)",
                        'data.mocap_pos[model.body("body2").mocapid[0]] += DT * np.array(faces[2])']  # fmt: skip
    assert script_lines(scene(STILL, WALL), DT, "half()")[1][-2] == "half()"


# ---- who goes with the belt ------------------------------------------------------------------------------------------


def test_slower_motion_seen_from_the_belt():
    seen = belts._from_the_belt(scene(BELT, BOX))
    assert seen == scene(replace(BELT, surface_velocity=()), replace(BOX, twist=(-1.0, 3.0, 3.0, 4.0, 5.0, 6.0)))
    for other in (STILL, replace(BELT, motion="prescribed"), replace(BELT, shape=Box((1.0, 1.0, 1.0)))):
        assert belts._from_the_belt(scene(other, BOX)) is None


@pytest.mark.parametrize("run", [(2.0, -1.0, 0.5), (2.0, -1.0)])
def test_room_velocities_around_a_moving_belt(run):
    t, size = np.array([0.0, 0.5, 2.0]), len(run)
    pose, twist = np.zeros((3, 3, 7)), np.ones((3, 3, 6))
    found = belts._in_the_room(Trajectory(t, pose, twist, None, 0.5, "completed"), np.array(run))
    for k in (1, 2):
        assert found.pose[:, k, :size].tolist() == [[u * s for u in run] for s in t]
        assert found.twist[:, k, :size].tolist() == [[1.0 + u for u in run]] * 3
    assert not found.pose[:, 0].any() and (found.twist[:, 0] == 1.0).all()
    assert not found.pose[:, :, size:].any() and (found.twist[:, :, size:] == 1.0).all()
    assert not pose.any() and (twist == 1.0).all(), "what was seen stays as it was"


@pytest.mark.parametrize(
    ("metric", "asked"), [("slipped", "stopping_distance"), ("pull", "braking"), ("turned", "turned")]
)
def test_belt_law_by_the_slide_law_in_room_coordinates(monkeypatch, metric, asked):
    heard = []

    def inner(profile, name):
        def law(seen, dt, measure):
            t = np.array([0.0, 1.0])
            still = Trajectory(t, np.zeros((2, 2, 7)), np.zeros((2, 2, 6)), None, dt, "completed")
            heard.append((profile, name, seen.bodies[0].surface_velocity, dt, measure(None, still)))
            return 1.0, 2.0

        return law

    def measure(given, trajectory):
        return {"slipped": (float(trajectory.pose[-1, 1, 0]), given.name), "turned": (3.0, "")}

    monkeypatch.setattr(belts, "stopping_law", inner)
    law = belts.on_a_belt("tuned", metric)
    assert law(scene(BELT, BOX), DT, measure) == (1.0, 2.0) and law(scene(STILL, BOX), DT, measure) is None
    told = {"slipped": (2.0, "belts"), "turned": (3.0, ""), "stopping_distance": (2.0, "belts")}
    assert heard == [("tuned", asked, NONE, DT, told)]


def test_disc_on_a_planar_belt_slower_along_it_alone():
    belt = Body("belt", HalfSpace((0.0, 1.0)), motion="fixed", surface_velocity=(2.0, 0.0))
    disc = Body("disc", Disc(0.5), 1.0, 0.1, (0.0, 0.5, 0.0), (1.0, 2.0, 3.0))
    seen = belts._from_the_belt(Scene("belts", 1, 2, (belt, disc), (), (0.0, -1.0), 1.0))
    assert seen.bodies[1].twist == (-1.0, 2.0, 3.0)
