"""Numbers that no body has: too large ones are refused in one line, impossible moments of inertia are said."""

import pytest

from adapters.scene import Body, Scene, SceneError
from adapters.scene.shapes import Box, Capsule, Sphere
from validation.files.magnitudes import impossible_inertia
from validation.posed import resolve

FILE = """
name = "small body"
dimension = 3
gravity = [0.0, 0.0, -9.81]
duration = 1.0
[[bodies]]
name = "floor"
shape = { type = "half_space", normal = [0.0, 0.0, 1.0] }
motion = "fixed"
[[bodies]]
name = "small"
shape = { type = "box", half_extents = [0.005, 0.01, 0.01] }
mass = 0.1
inertia = [1.0, 1.0, 1.0]
pose = [0.0, 0.0, 0.02, 1.0, 0.0, 0.0, 0.0]
[[pairs]]
restitution = 0.0
friction = 1.0
"""
SAID = "small.inertia: 1 kg m^2 is more than a body of this size and mass can have"
URDF = """<?xml version="1.0"?>
<robot name="small"><link name="small">
<inertial><origin xyz="0 0 0"/><mass value="0.1"/>
<inertia ixx="{0}" ixy="0" ixz="0" iyy="{0}" iyz="0" izz="{0}"/></inertial>
<collision><geometry><box size="0.01 0.02 0.02"/></geometry></collision></link></robot>
"""
MJCF = """<mujoco><worldbody><body name="small" pos="0 0 1"><freejoint/>
<inertial pos="0 0 0" mass="0.1" diaginertia="{0} {0} {0}"/>
<geom type="box" size="0.005 0.01 0.01"/></body></worldbody></mujoco>
"""


def notes(path):
    return [note for note in resolve(str(path)).notes if "can have" in note]


def written(tmp_path, name, text):
    path = tmp_path / name
    path.write_text(text)
    return path


def test_scene_file_with_implausible_inertia_told(tmp_path):
    assert notes(written(tmp_path, "small.toml", FILE)) == [f"{SAID}, 1.25e-05 kg m^2"]
    possible = FILE.replace("[1.0, 1.0, 1.0]", "[2e-5, 1.25e-5, 1.25e-5]")
    assert notes(written(tmp_path, "possible.toml", possible)) == []


@pytest.mark.parametrize(("name", "text"), [("small.urdf", URDF), ("small.xml", MJCF)])
def test_model_with_the_inertia_of_a_desk(tmp_path, name, text):
    (said,) = notes(written(tmp_path, name, text.format("1")))
    assert said.startswith(SAID)
    assert notes(written(tmp_path, f"possible-{name}", text.format("1e-5"))) == []


def test_moments_of_all_mass_at_the_surface():
    upright = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    shapes = {Sphere(0.2): (0.04,) * 3, Capsule(0.3, 0.1): (0.01, 0.16, 0.16), Box((0.1, 0.2, 0.3)): (0.13, 0.1, 0.05)}
    for share, said in ((1.0, 0), (1.01, 1)):
        for shape, most in shapes.items():
            body = Body("one", shape, 2.0, tuple(2.0 * share * each for each in most), upright)
            scene = Scene("one", 1, 3, (body,), (), (0.0, 0.0, 0.0), 1.0)
            assert len(impossible_inertia(scene)) == said


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("mass = 0.1", "mass = 1e308", "small.mass: 1e+308 is larger than 1e+30"),
        ("mass = 0.1", "mass = 1e-308", "small.mass: 1e-308 is smaller than 1e-30"),
        ("inertia = [1.0, 1.0, 1.0]", "inertia = [1e200, 1e200, 1e200]", "small.inertia: 1e+200 is larger than"),
        ("[0.005, 0.01, 0.01]", "[1e31, 0.01, 0.01]", "small.shape.half_extents: 1e+31 is larger than"),
        ("0.02, 1.0, 0.0, 0.0, 0.0]", "1e100, 1.0, 0.0, 0.0, 0.0]", "small.pose: 1e+100 is larger than"),
        ("-9.81]", "-1e300]", "gravity: -1e+300 is larger than"),
        ("duration = 1.0", "duration = 1e300", "duration: "),
    ],
)
def test_physically_impossible_numbers_refused(tmp_path, old, new, named):
    with pytest.raises(SceneError) as caught:
        resolve(str(written(tmp_path, "large.toml", FILE.replace(old, new))))
    assert named in str(caught.value) and "\n" not in str(caught.value)
