"""URDF models as scenes: what is read, what is refused by name, and that nothing reaches outside the text."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from adapters.model import read as read_apart
from adapters.model import reader_of
from adapters.scene import Box, SceneError, Sphere
from adapters.stepping import run
from adapters.trajectory import Sampling

mujoco = pytest.importorskip("mujoco")
from adapters import registry  # noqa: E402
from adapters.mujoco.urdf import read  # noqa: E402  (it imports the engine, which may not be there)

MODELS = Path(__file__).parents[1] / "models"
INERTIA = '<inertial><mass value="1"/><inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial>'
BALL = f'<link name="ball">{INERTIA}<collision><geometry><sphere radius=".2"/></geometry></collision></link>'


def robot(inside):
    return f'<robot name="r">{inside}</robot>'


@pytest.mark.parametrize("name", ["cube_on_table", "ball_by_a_post", "barrel"])
def test_motion_of_a_robot_against_mujoco(name):
    """Profile `model` against the file itself, as `tests/adapters/test_models.py` asks of MJCF."""
    text = (MODELS / f"{name}.urdf").read_text().replace('link="base"', 'link="world"').replace('"base"', '"world"')
    found = read(text, False)
    m = mujoco.MjModel.from_xml_string(text)
    d = mujoco.MjData(m)
    mujoco.mj_step(m, d, nstep=300)
    mujoco.mj_kinematics(m, d)
    scene = replace(found.scene, duration=300 * found.dt)
    values = {setting.name: setting.value for setting in found.settings}
    ours = run(registry.load("mujoco"), scene, found.dt, values, Sampling(300))
    free = [body.motion for body in scene.bodies].index("free")
    assert ours.pose[-1, free, :3] == pytest.approx(d.qpos[:3], abs=1e-7)
    assert ours.twist[-1, free, :3] == pytest.approx(d.qvel[:3], abs=1e-6)
    assert abs(ours.pose[-1, free, 2] - scene.bodies[free].pose[2]) > 0.1


def test_places_masses_and_names_of_the_text():
    found = read((MODELS / "cube_on_table.urdf").read_text(), False)
    table, cube = found.scene.bodies
    assert (table.name, table.motion, table.shape) == ("table", "fixed", Box((1.0, 1.0, 0.05)))
    assert cube.name == "cube" and cube.mass == 2.0 and cube.inertia == pytest.approx((0.0133333333333,) * 3, rel=1e-9)
    assert cube.pose == pytest.approx((0, 0, 0.3, np.cos(0.15), 0, np.sin(0.15), 0), abs=1e-12)
    assert found.scene.name == "cube on a table" and found.scene.material("table", "cube").friction == 1.0
    assert any("friction 1" in note for note in found.notes)


def test_roots_that_are_free():
    alone = read((MODELS / "ball_alone.urdf").read_text(), False)
    assert [(body.motion, body.pose[2]) for body in alone.scene.bodies] == [("free", 0.1)]
    assert any("ball is free" in note for note in alone.notes)
    post = read((MODELS / "ball_by_a_post.urdf").read_text(), False)
    assert [body.motion for body in post.scene.bodies] == ["fixed", "fixed", "free"]
    assert any("base is fixed: it has no mass" in note for note in post.notes)
    with pytest.raises(SceneError, match="has no free body"):
        read(robot(BALL.replace('name="ball"', 'name="world"')), False)


def test_a_free_link_without_inertial():
    """MuJoCo gives it the density of water, which is said; a link of no mass that is fixed has none."""
    link = BALL.replace(INERTIA, "").replace('"ball"', '"{}"')
    joint = '<joint name="{0}" type="floating"><parent link="world"/><child link="{0}"/></joint>'
    crowd = "".join(link.format(name) + joint.format(name) for name in ("one", "two")) + link.format("world")
    assert "density 1000 kg/m^3 of one, two: no inertial, MuJoCo's default" in read(robot(crowd), False).notes
    assert not any("density" in note for note in read(robot(BALL), False).notes)


ARM = (
    f'<link name="world"/>{BALL}'
    '<joint name="f" type="floating"><parent link="world"/><child link="ball"/></joint>'
    '<joint name="hinge" type="revolute"><parent link="ball"/><child link="arm"/></joint>'
    f'<link name="arm">{INERTIA}</link>'
    '<joint name="tip" type="fixed"><parent link="arm"/><child link="hand"/></joint>'
    f'<link name="hand">{INERTIA}</link>'
)
#: A link that has no place hangs in the world by a joint of its own, beside one that has.
CROWD = (
    f'<link name="world"/>{BALL}'
    '<joint name="f" type="floating"><parent link="world"/><child link="ball"/></joint>'
    '<joint name="g" type="floating"><parent link="world"/><child link="crowd"/></joint>'
    + BALL.replace('"ball"', '"crowd"').replace(
        "</link>", '<collision><geometry><box size="1 1 1"/></geometry></collision></link>'
    )
)
#: What is refused, and what is left with ``--drop``: names of the bodies.
REFUSED = [
    ((MODELS / "refused_arm.urdf").read_text(), "line 3: <joint> 'shoulder': a revolute joint", None),
    (robot(ARM), "<joint> 'hinge': a revolute joint holds a link", ["ball"]),
    (robot(CROWD), "<link> 'crowd': has several geoms", ["ball"]),
    (robot(BALL.replace("</link>", '<contact><lateral_friction value=".1"/></contact></link>')), "<contact>", ["ball"]),
    (robot(BALL + '<gazebo reference="ball"><mu1>0.2</mu1></gazebo>'), "<gazebo>: Gazebo's own elements", ["ball"]),
    (robot(BALL + '<mujoco><option timestep="1"/></mujoco>'), "<mujoco>: MuJoCo's own elements", ["ball"]),
    (robot(BALL + "<made_up/>"), "<made_up>: a scene has no such element", ["ball"]),
    (robot(BALL.replace("<sphere radius", '<mesh filename="/etc/passwd" radius')), "<mesh>: a scene has no mesh", None),
    (robot(BALL.replace("</link>", '<collision><geometry><box size="1 1 1"/></geometry></collision></link>')),
     "<link> 'ball': has several geoms", None),
    (robot(BALL.replace("<mass", '<origin xyz="0 0 1"/><mass')), "<link> 'ball': its centre of mass", None),
    (robot(BALL.replace('"ball"', '"b&#x202e;l"')), "cannot be a name", None),
    (robot(f'{BALL}<link name="tip">{INERTIA}</link>'
           '<joint name="j" type="fixed"><parent link="ball"/><child link="tip"/></joint>'),
     "<link> 'ball': a body with a mass is fixed to it", None),
    (robot(BALL + BALL), "<link> 'ball': is a second root", None),
    (robot(BALL + BALL.replace('"ball"', '"other"')), "<link> 'other': is a second root", None),
    (robot("<link/>" * 1001), "are more than the 1000", None),
    ("<mujoco/>", "begins with <robot>", None),
    ('<!DOCTYPE r [<!ENTITY a "b">]><robot>&a;</robot>', "document types and entities are not read", None),
    (robot(""), "no link is the root", None),
    (robot(BALL.replace('".2"', '"nan"')), "model: ", None),
    (robot(BALL.replace('"1"', '"-1"')), "model: ", None),
]  # fmt: skip


@pytest.mark.parametrize(("text", "said", "left"), REFUSED, ids=[said[:30] for _, said, _ in REFUSED])
def test_urdf_elements_refused_or_left_out_with_a_message(text, said, left):
    with pytest.raises(SceneError) as refused:
        read(text, False)
    assert said in str(refused.value) and "\n" not in str(refused.value) and len(str(refused.value)) < 600
    if left is not None:
        found = read(text, True)
        assert [body.name for body in found.scene.bodies] == left and len(found.dropped) == 1
        assert said in found.dropped[0]


def test_visuals_and_transmissions_ignored():
    drawn = BALL.replace("</link>", '<visual><geometry><mesh filename="/etc/passwd"/></geometry></visual></link>')
    found = read(robot(drawn + '<transmission name="t"/><material name="m"/>'), False)
    assert found.dropped == () and found.scene.bodies[0].shape == Sphere(0.2)


def test_model_read_in_another_process():
    assert reader_of(".URDF") == "mujoco"
    text = (MODELS / "cube_on_table.urdf").read_text()
    assert read_apart("mujoco", ".urdf", text, False) == read(text, False)
