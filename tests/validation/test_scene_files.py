"""Scene files are refused with one line that names the field."""

import json

import pytest

from adapters.scene import SceneError
from validation.scene_files import json_schema, load_scene

GOOD = """
name = "drop"
dimension = 2
gravity = [0.0, -9.81]
duration = 0.5
[[bodies]]
name = "floor"
shape = { type = "half_space", normal = [0.0, 1.0] }
motion = "fixed"
[[bodies]]
name = "ball"
shape = { type = "disc", radius = 0.5 }
mass = 1.0
inertia = 0.125
pose = [0.0, 1.0, 0.0]
[[pairs]]
restitution = 0.5
friction = 0.3
"""


def read(tmp_path, text, name="scene.toml"):
    path = tmp_path / name
    path.write_text(text)
    return load_scene(path)


def test_toml_and_json_give_the_same_scene(tmp_path):
    scene = read(tmp_path, GOOD)
    again = read(tmp_path, json.dumps(scene.as_dict() | {"params": None}).replace(', "params": null', ""), "s.json")
    assert scene.hash() == again.hash()


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("restitution = 0.5", "restitution = 1.2", "restitution"),
        ("friction = 0.3", "friction = -0.1", "friction"),
        ("mass = 1.0", "mass = nan", "bodies.1.mass"),
        ("mass = 1.0", "mass = 0.0", "ball.mass"),
        ("radius = 0.5", "radius = -0.5", "ball.shape.radius"),
        ('name = "ball"', 'name = "floor"', "used 2 times"),
        ("duration = 0.5", "duration = 0.0", "duration"),
        ("dimension = 2", "dimension = 4", "dimension"),
        ("inertia = 0.125", "inertia = [1.0, 1.0, 1.0]", "ball.inertia"),
        ("gravity = [0.0, -9.81]", "gravity = [0.0, 0.0, -9.81]", "gravity"),
        ("mass = 1.0", "weight = 1.0", "bodies.1.weight"),
        ('type = "disc"', 'type = "sphere"', "ball.shape"),
        ("duration = 0.5", "", "duration"),
        ("[[bodies]]", "[[bodies", "not valid TOML"),
    ],
)
def test_a_wrong_field_is_named_in_one_line(tmp_path, old, new, named):
    with pytest.raises(SceneError) as caught:
        read(tmp_path, GOOD.replace(old, new, 1))
    assert named in str(caught.value)
    assert "\n" not in str(caught.value).strip() or "TOML" in str(caught.value)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(SceneError, match="cannot read"):
        load_scene(tmp_path / "nowhere.toml")


def test_the_schema_names_every_field():
    assert {"name", "dimension", "gravity", "duration", "bodies", "pairs"} <= set(json_schema()["properties"])
