"""Scene files are refused with one line that names the field."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

from adapters.engine import Contacts
from adapters.scene import SceneError
from adapters.scene.lift import size_across
from adapters.trajectory import ContactRecord, Trajectory
from reports.findings import refusals
from validation.cells import Observation, Outcome, Slot, plane_of
from validation.files.scene_files import canonical_from_file, json_schema, load_scene, load_stated
from validation.files.scene_text import read_text
from validation.files.stated import stated_from_dict
from validation.judging.rows import rows_of
from validation.posed import pinned, resolve

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

ROOT = Path(__file__).resolve().parents[2]


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
        ("mass = 1.0", "mass = true", "bodies.1.mass"),
        ("mass = 1.0", 'mass = "1.0"', "bodies.1.mass"),
        ("radius = 0.5", "radius = true", "bodies.1.shape.disc.radius"),
        ("pose = [0.0, 1.0, 0.0]", "pose = [0.0, true, 0.0]", "bodies.1.pose.1"),
        ("duration = 0.5", "duration = 0.5\nversion = true", "version"),
        ("duration = 0.5", "duration = 0.5\nformat = true", "format"),
        ("dimension = 2", "dimension = 2.0", "dimension"),
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


def test_the_published_schema_is_that_of_the_format():
    """`crosscheck schema -o validation/files/scene.schema.json` writes it anew."""
    from click.testing import CliRunner

    from reports.command import main

    done = CliRunner().invoke(main, ["schema"])
    assert done.exit_code == 0
    assert done.stdout == (Path(__file__).parents[2] / "validation" / "files" / "scene.schema.json").read_text()
    assert json.loads(done.stdout)["$id"].endswith(":1")


def test_the_schema_names_every_field():
    assert {"name", "dimension", "gravity", "duration", "bodies", "pairs"} <= set(json_schema()["properties"])


def stated(tmp_path, text):
    path = tmp_path / "scene.toml"
    path.write_text(text)
    return canonical_from_file(path)


def test_inertia_from_shape_and_mass(tmp_path):
    canonical = stated(tmp_path, GOOD.replace("mass = 1.0\ninertia = 0.125", "mass = 3.0"))
    assert canonical.scene(2).bodies[1].inertia == pytest.approx(0.5 * 3.0 * 0.25)
    assert canonical.notes == ("ball.inertia: 0.375 kg m^2, of a uniform disc; none was given",)


def test_mass_and_inertia_by_density(tmp_path):
    canonical = stated(tmp_path, GOOD.replace("mass = 1.0\ninertia = 0.125", "density = 2.0"))
    body = canonical.scene(2).bodies[1]
    assert body.mass == pytest.approx(2.0 * math.pi * 0.25)
    assert body.inertia == pytest.approx(0.5 * body.mass * 0.25)
    assert [note.partition(":")[0] for note in canonical.notes] == ["ball.mass", "ball.inertia"]


def test_no_note_on_a_complete_file(tmp_path):
    assert stated(tmp_path, GOOD).notes == ()


def test_a_normal_is_normalised_and_keeps_its_offset(tmp_path):
    canonical = stated(tmp_path, GOOD.replace("normal = [0.0, 1.0]", "normal = [0.0, 5.0], offset = 0.25"))
    shape = canonical.scene(2).bodies[0].shape
    assert shape.normal == (0.0, 1.0) and shape.offset == 0.25
    assert "length 5" in canonical.notes[0]


@pytest.mark.parametrize(("angle", "normal"), [("0.0", (0.0, 1.0)), ("0.3", (-math.sin(0.3), math.cos(0.3)))])
def test_a_half_space_is_tilted_by_its_angle(tmp_path, angle, normal):
    shape = stated(tmp_path, GOOD.replace("normal = [0.0, 1.0]", f"angle = {angle}")).scene(2).bodies[0].shape
    assert shape.normal == pytest.approx(normal, abs=1e-15)


CHECK = """
[[checks]]
quantity = "ball.vy"
value = -0.981
tolerance = 1e-3
at = 0.1
because = "g t"
[[checks]]
quantity = "ball.angle"
value = 0.0
tolerance = 1e-9
"""


def falling(scene, spin=0.0):
    """Exact free fall of the ball, sampled at 1/100 s."""
    t = np.arange(51) / 100.0
    pose, twist = np.zeros((51, 2, 3)), np.zeros((51, 2, 3))
    pose[:, 1, 1], twist[:, 1, 1] = 1.0 - 0.5 * 9.81 * t * t, -9.81 * t
    pose[:, 1, 2], twist[:, 1, 2] = np.arctan2(np.sin(spin * t), np.cos(spin * t)), spin
    rows = Contacts.from_rows([(0, 1, (0.0, 0.0), (0.0, 1.0), (0.0, 0.0981), 0.0)] * 51, 2)
    return Trajectory(t, pose, twist, ContactRecord(np.arange(51), np.arange(52), rows), 0.01, "completed")


def judged(canonical, trajectory):
    scene = canonical.scene(2)
    measured = canonical.measure(scene, trajectory)
    checks = [check for check in canonical.checks(scene, trajectory.dt) if check.truth is not None]
    return {check.metric: abs(measured[check.metric][0] - check.truth) <= check.bound for check in checks}


def test_stated_numbers_of_a_file_judged(tmp_path):
    canonical = stated(tmp_path, GOOD + CHECK)
    found = judged(canonical, falling(canonical.scene(2)))
    assert found["at[0.1 s][ball.vy]"] and found["final[ball.angle]"]
    found = judged(canonical, falling(canonical.scene(2), spin=20.0))
    assert found["at[0.1 s][ball.vy]"] and not found["final[ball.angle]"]
    wrong = stated(tmp_path, GOOD + CHECK.replace("-0.981", "-0.983"))
    assert not judged(wrong, falling(wrong.scene(2)))["at[0.1 s][ball.vy]"]


def test_places_angles_velocities_and_forces_are_shown(tmp_path):
    canonical = stated(tmp_path, GOOD)
    measured = canonical.measure(canonical.scene(2), falling(canonical.scene(2), spin=20.0))
    assert measured["final[ball.y]"][0] == pytest.approx(1.0 - 0.5 * 9.81 * 0.25)
    assert measured["final[ball.vy]"][0] == pytest.approx(-9.81 * 0.5)
    assert measured["final[ball.angle]"][0] == pytest.approx(10.0)  # more than one turn
    assert measured["final[ball.omega]"][0] == 20.0
    assert measured["final[ball.fy]"][0] == pytest.approx(9.81)
    shown = {c.metric: c.unit for c in canonical.checks(canonical.scene(2), 0.01) if c.truth is None}
    assert shown["final[ball.fy]"] == "N" and shown["final[ball.angle]"] == "rad"
    checks = canonical.checks(canonical.scene(2), 0.01)
    assert {c.source for c in checks if c.truth is None} == {""}  # nobody stated it
    assert "the file states no value for it" in next(c.because for c in checks if c.metric == "final[ball.fy]")


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("mass = 1.0", "mass = 1.0\ndensity = 2.0", "ball.density"),
        ("mass = 1.0", "density = -2.0", "ball.density"),
        ("normal = [0.0, 1.0]", "normal = [0.0, 0.0]", "floor.shape.normal"),
        ("normal = [0.0, 1.0]", "normal = [0.0, 1.0], angle = 0.1", "either a normal or an angle"),
        (", normal = [0.0, 1.0]", "", "either a normal or an angle"),
        ("ball.vy", "cube.vy", "checks.0.quantity: 'cube.vy' names no body"),
        ("ball.vy", "ball.vz", "checks.0.quantity: 'vz' is not one of"),
        ("ball.vy", "floor/ball.vy", "between two bodies there are only forces, impulses and the like"),
        ("ball.vy", "ball.overlap_without_force", "an overlap needs two bodies"),
        ("at = 0.1", 'over = "least"', "checks.0.over: only for forces, impulses and the like"),
        ("at = 0.1", 'over = "median"', "checks.0.over"),
        ('ball.vy"', 'ball.fy"\nover = "least"', "checks.0.over: at an instant there is one number"),
        (
            'ball.vy"\nvalue = -0.981\ntolerance = 1e-3\nat = 0.1',
            'ball.fy"\nvalue = 1.0\ntolerance = 1e-3\n[[checks]]\n'
            'quantity = "ball.fy"\nover = "greatest"\nvalue = 2.0\ntolerance = 1e-3',
            "'ball.fy' is stated 2 times",
        ),
        ("at = 0.1", "at = 0.9", "checks.0.at: 0.9 s is after the end"),
        ("tolerance = 1e-3", "tolerance = 0.0", "checks.0.tolerance"),
        ("ball.angle", "ball.vy", "checks.1.at"),
    ],
)
def test_a_wrong_statement_is_named_in_one_line(tmp_path, old, new, named):
    text = (GOOD + CHECK).replace(old, new, 1)
    if named == "checks.1.at":
        text, named = text + "at = 0.1\n", "'ball.vy' is stated 2 times"
    with pytest.raises(SceneError) as caught:
        read(tmp_path, text)
    assert named in str(caught.value)
    assert "\n" not in str(caught.value)


def test_refusal_by_an_engine_unsupported_and_no_alarm(tmp_path):
    path = tmp_path / "space.toml"
    path.write_text(
        GOOD.replace("dimension = 2", "dimension = 3")
        .replace("gravity = [0.0, -9.81]", "gravity = [0.0, 0.0, -9.81]")
        .replace("normal = [0.0, 1.0]", "normal = [0.0, 0.0, 1.0]")
        .replace('type = "disc"', 'type = "sphere"')
        .replace("inertia = 0.125", "inertia = [0.1, 0.1, 0.1]")
        .replace("pose = [0.0, 1.0, 0.0]", "pose = [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0]")
    )
    # Bullet lists no refusal that would speak of every scene, as Chipmunk's of space does.
    for engine, why in (("chipmunk", "chipmunk is planar"), ("bullet", "friction: no product gives this table")):
        slot = Slot(str(path), (), 3, engine, "default", 1 / 240)
        refused = Observation(slot, "cell", 1, "7", Outcome.UNSUPPORTED, why)
        rows = rows_of("run", [refused])
        assert rows and not any(row.alarming for row in rows)
        assert list(refusals([row.as_dict() for row in rows])) == [f"UNSUPPORTED: {engine} {path}: {why}"]


def test_recipe_s_example(tmp_path):
    text = (ROOT / "docs/howto/own-scene.md").read_text(encoding="utf-8").partition("```toml\n")[2].partition("```")[0]
    canonical = stated(tmp_path, text)
    scene = canonical.scene(2)
    ramp, box = scene.bodies
    height = float(np.dot(ramp.shape.normal, box.pose[:2])) - box.shape.half_extents[0]
    assert height == pytest.approx(0.0, abs=1e-15)  # it touches the ramp
    (check,) = (check for check in canonical.checks(scene, 1 / 240) if "[[checks]]" in check.source)
    slide = 9.81 * (math.sin(0.3) - 0.1 * math.cos(0.3))
    assert check.truth == pytest.approx(math.cos(0.3) * slide * scene.duration, abs=5e-4)
    assert len(canonical.notes) == 2


def test_body_with_a_slash_in_its_name():
    from validation.files.scene_format import parts_of

    names = ["a/b", "b", "a"]
    assert parts_of("a/b.y", names) == (None, "a/b", "y")
    assert parts_of("a/a/b.fy", names) == ("a", "a/b", "fy")
    assert parts_of("floor/box.fy") == ("floor", "box", "fy")


@pytest.mark.parametrize("name", ["none.toml", "none.xml", "none\0.toml", "."])
def test_unreadable_file_told_once(tmp_path, name):
    with pytest.raises(SceneError) as refused:
        read_text(tmp_path / name)
    assert str(refused.value).count("cannot read") == 1


PILE = """
name = "pile"
dimension = 2
gravity = [0.0, -10.0]
duration = 2.0
{stated}

[constants]
radius = 0.5

[[bodies]]
name = "ball"
shape = {{ type = "disc", radius = 0.5 }}
pose = [0.0, 1.0, 0.0]
"""


@pytest.mark.parametrize(
    ("stated", "growth"),
    [("", 1.0), ("growth = 5e4", 5e4), ('growth = "exp(t * sqrt(g / (2 * radius)))"', math.exp(2 * math.sqrt(10.0)))],
)
def test_file_with_a_growth_factor_off_its_plane(tmp_path, stated, growth):
    path = tmp_path / "pile.toml"
    path.write_text(PILE.format(stated=stated))
    canonical = canonical_from_file(path)
    scene = canonical.scene(2, {})
    assert canonical.growth(scene) == pytest.approx(growth, rel=1e-12)
    [plane] = plane_of(canonical, scene, 1 / 240)
    owed = 10.0 / 240**2 + 1e-12 * max(growth, 1e3) * size_across(scene)  # a thousand times at least
    assert plane.bound == pytest.approx(owed, rel=1e-12)
    assert stated_from_dict(load_stated(path).as_dict()).growth == pytest.approx(growth, rel=1e-12)


@pytest.mark.parametrize(
    ("stated", "said"),
    [
        ("growth = 0.5", "growth: 0.5 is less than 1"),
        ('growth = "2 * height"', "growth: '2 * height': 'height' is not one of"),
        ("growth = nan", "growth"),
        ("growth = true", "growth"),
    ],
)
def test_invalid_growth_factor_refused_with_its_name(tmp_path, stated, said):
    path = tmp_path / "pile.toml"
    path.write_text(PILE.format(stated=stated))
    with pytest.raises(SceneError, match=re.escape(said)):
        load_stated(path)


def test_no_plane_departure_of_a_spatial_scene(tmp_path):
    path = tmp_path / "ball.toml"
    path.write_text(
        'name = "ball"\ndimension = 3\ngravity = [0.0, 0.0, -10.0]\nduration = 1.0\ngrowth = 10.0\n'
        '[[bodies]]\nname = "ball"\nshape = { type = "sphere", radius = 0.5 }\n'
    )
    with pytest.raises(SceneError, match="growth: a 3-D scene has no plane"):
        load_stated(path)


# ---- numbers of pairs that nobody gives ----


def pairs_notes(tmp_path, pairs):
    """Notes about pairs of a scene of a floor and two balls, with these entries in the place of its own."""
    other = GOOD[GOOD.index('[[bodies]]\nname = "ball"') : GOOD.index("[[pairs]]")].replace('"ball"', '"top"')
    path = tmp_path / "scene.toml"
    path.write_text(GOOD[: GOOD.index("[[pairs]]")] + other.replace("[0.0, 1.0, 0.0]", "[5.0, 3.0, 0.0]") + pairs)
    return [note for note in load_stated(path).notes if note.startswith("pairs:")]


@pytest.mark.parametrize(
    ("pairs", "said"),
    [
        ("", ["pairs: restitution 0 and friction 0 of all pairs, none was given"]),
        ("[[pairs]]\nrestitution = 0.1\n", ["pairs: friction 0 of all pairs, none was given"]),
        ("[[pairs]]\nfriction = 0.1\n", ["pairs: restitution 0 of all pairs, none was given"]),
        ("[[pairs]]\nfriction = 0.0\nrestitution = 0.0\n", []),
        ('[[pairs]]\na = "floor"\nb = "ball"\nfriction = 0.1\nrestitution = 0.2\n',
         ["pairs: restitution 0 and friction 0 of pairs without an entry, none was given"]),
        ('[[pairs]]\na = "ball"\nfriction = 0.1\nrestitution = 0.2\n'
         '[[pairs]]\na = "top"\nb = "floor"\nfriction = 0.3\n',
         ["pairs: restitution 0 of top-floor, none was given"]),
    ],
)  # fmt: skip
def test_friction_and_restitution_left_out_of_a_file(tmp_path, pairs, said):
    assert pairs_notes(tmp_path, pairs) == said


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ('shape = { type = "disk", radius = 1.0 }', "bodies.0.shape: there is no type 'disk', only 'disc', "),
        ("shape = { radius = 1.0 }", 'bodies.0.shape: needs a type, such as type = "box"'),
        ('shape = { type = "disc" }', "bodies.0.shape.disc.radius: is missing"),
        ('shape = { type = "disc", radius = true }', "bodies.0.shape.disc.radius: must be a number"),
        ('motion = "static"', "bodies.0.motion: must be 'free', 'fixed' or 'prescribed'"),
        ("colour = 3", "bodies.0.colour: there is no such field"),
        ("course = 3", "bodies.0.course: must be a table"),
    ],
)
def test_a_wrong_field_in_words_of_the_format(tmp_path, line, said):
    """pydantic's sentences speak of tags, discriminators and inputs."""
    path = tmp_path / "wrong.toml"
    path.write_text(
        f'name = "w"\ndimension = 2\ngravity = [0.0, -9.81]\nduration = 1.0\n[[bodies]]\nname = "a"\n{line}\n'
    )
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    assert said in str(caught.value), caught.value


def test_an_unknown_parameter_of_a_file_without_any(tmp_path):
    path = tmp_path / "free.toml"
    path.write_text(GOOD)
    with pytest.raises(SceneError, match=r"there is no such parameter, it has none$"):
        resolve(pinned(str(path))).complete({"e": 0.5})
