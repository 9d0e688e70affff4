"""Bodies that the compiler made of one element stand in no line of the text: what is wrong is said by their names."""

import pytest

pytest.importorskip("mujoco")

from adapters.mujoco import model as reading
from adapters.scene import SceneError

SPHERE = '<geom name="g" type="sphere" size=".1"/>'
BOX = '<geom name="g" type="box" size=".1 .1 .1"/>'


def twice(inner, joint="<freejoint/>", more="", after=""):
    made = f'<body name="b"{more}>{joint}{inner}</body>'
    return (
        f'<mujoco><worldbody><replicate count="2" offset="0 0 1">{made}</replicate></worldbody>{after}</mujoco>'
    )  # fmt: skip


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (twice(SPHERE, '<joint name="j" type="hinge"/>'),
         "body: b0: a hinge joint holds it; bodies of a scene are free or fixed"),
        (twice(SPHERE, '<joint name="j" type="free" damping="1"/>'),
         "body: b0: its joint has damping; a scene's bodies have none"),
        (twice(SPHERE, '<joint name="j" type="free" armature="1"/>'),
         "body: b0: its joint has armature; a scene's bodies have none"),
        (twice(SPHERE, '<joint name="j" type="free" frictionloss="1"/>'),
         "body: b0: its joint has frictionloss; a scene's bodies have none"),
        (twice(SPHERE, '<joint name="j" type="free" stiffness="1"/>'),
         "body: b0: its joint has stiffness; a scene's bodies have none"),
        (twice(SPHERE + SPHERE.replace('"g"', '"h"')),
         "body: b0: has several geoms that collide; a scene's body has one"),
        (twice(SPHERE.replace("/>", ' contype="0" conaffinity="0"/>')), "body: b0: has no geom that collides"),
        (twice(SPHERE, more=' gravcomp="1"'), "body: b0: gravcomp: in a scene gravity acts on all bodies alike"),
        (twice(SPHERE + '<inertial pos="0 0 .05" mass="1" diaginertia="1 1 1"/>'),
         "body: b0: its centre of mass is not its geom's; a scene's body has both in one place"),
        (twice(BOX + '<inertial pos="0 0 0" euler="0 0 30" mass="1" diaginertia="1 2 2.5"/>'),
         "body: b0: its principal axes are not its geom's; a scene's body has both in one direction"),
        (twice(SPHERE.replace("sphere", "ellipsoid").replace('".1"', '".1 .1 .1"')),
         "geom: g0: an ellipsoid; a scene has spheres, boxes, rods, hulls and planes"),
        (twice(SPHERE.replace("/>", ' contype="1" conaffinity="2"/>')),
         "geom: g1: contype and conaffinity exclude contact with b0; in a scene all bodies can collide"),
        (twice(SPHERE.replace("/>", ' condim="6"/>')), "geom: g1: with b0: condim 6"),
    ],
)  # fmt: skip
def test_name_of_an_unplaceable_element_without_a_line(text, said):
    with pytest.raises(SceneError) as refused:
        reading.read(text, False)
    assert str(refused.value).startswith(f"model: {said}"), str(refused.value)


def test_unplaceable_element_that_cannot_be_left_out():
    with pytest.raises(SceneError, match=r"^model: body: b0: its joint has stiffness"):
        reading.read(twice(SPHERE, '<joint name="j" type="free" stiffness="1"/>'), True)
    wrong = SPHERE.replace("sphere", "ellipsoid").replace('".1"', '".1 .1 .1"')
    with pytest.raises(SceneError, match=r"^model: body: b0: its geom is an ellipsoid; a scene has spheres"):
        reading.read(twice(wrong), True)


def test_names_of_replicas():
    found = reading.read(twice(SPHERE), False)
    assert [(body.name, body.motion, body.pose[2]) for body in found.scene.bodies] == [
        ("b0", "free", 0.0), ("b1", "free", 1.0)]  # fmt: skip
    assert found.dropped == () and found.scene.gravity == (0.0, 0.0, -9.81)
