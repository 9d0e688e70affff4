"""Scene files of every kind: each is refused in one clean line, or runs into rows that every export can hold."""

import copy
import json
import math
import os
import xml.etree.ElementTree as ElementTree

import pytest
from generated_scenes import mutated

from adapters.plain import is_visible
from adapters.scene import SceneError
from reports import exports
from validation.cells import LONGEST_DT, Observation, Outcome
from validation.files.scene_files import json_schema
from validation.files.scene_text import MOST_BODIES, MOST_BYTES
from validation.judging.rows import rows_of
from validation.posed import pinned, resolve
from validation.running.plan import Request, slots
from validation.workers import run_cells

BASE = {
    "name": "drop", "dimension": 2, "gravity": [0.0, -9.81], "duration": 0.05,
    "bodies": [
        {"name": "floor", "shape": {"type": "half_space", "normal": [0.0, 1.0]}, "motion": "fixed"},
        {"name": "ball", "shape": {"type": "disc", "radius": 0.5}, "mass": 1.0, "inertia": 0.125,
         "pose": [0.0, 0.6, 0.0], "twist": [0.0, -1.0, 0.0]},
        {"name": "box", "shape": {"type": "box", "half_extents": [0.5, 0.25]}, "mass": 2.0, "inertia": 0.3,
         "pose": [3.0, 0.25, 0.0]},
    ],
    "pairs": [{"restitution": 0.5, "friction": 0.3}],
}  # fmt: skip
SPATIAL = {
    "name": "drop", "dimension": 3, "gravity": [0.0, 0.0, -9.81], "duration": 0.05,
    "bodies": [
        {"name": "floor", "shape": {"type": "half_space", "normal": [0.0, 0.0, 1.0]}, "motion": "fixed"},
        {"name": "ball", "shape": {"type": "sphere", "radius": 0.5}, "mass": 1.0, "inertia": [0.1, 0.1, 0.1],
         "pose": [0.0, 0.0, 0.6, 1.0, 0.0, 0.0, 0.0]},
    ],
    "pairs": [{"a": "ball", "b": "floor", "restitution": 1.0}],
}  # fmt: skip


def written(data, dice, folder, number):
    """A file of it: JSON mostly; some cut short, some with bytes of their own."""
    text = json.dumps(data).encode("utf-8", "surrogatepass")
    if dice.random() < 0.05:
        text = text[: dice.randrange(len(text))]
    if dice.random() < 0.05:
        spot = dice.randrange(len(text))
        text = text[:spot] + bytes(dice.randrange(256) for _ in range(3)) + text[spot:]
    path = folder / f"scene-{number}.json"
    path.write_bytes(text)
    return path


def planned(path):
    """Slots of a scene file on one engine; or None if it is refused, in one clean line."""
    try:
        request = Request([str(path)], ["chipmunk", "bullet"], ["tuned"], dts=[1.0 / 240.0])
        found = slots(request)
        for slot in found:
            canonical = resolve(slot.scene)
            for check in canonical.checks(canonical.scene(slot.dimension), slot.dt):
                assert check.bound is None or check.bound >= 0.0 or math.isnan(check.bound)
        return found
    except SceneError as error:
        said = str(error)
        assert said and is_visible(said) and len(said) < 6000, said[:500]
        return None


def judged(cells, run="r"):
    """Run cells; every slot has one observation, and every export holds all rows."""
    found = list(run_cells(cells, jobs=2, timeout=60.0))
    assert sorted(o.slot.key() for o in found) == sorted(slot.key() for slot in cells)
    rows = [row.as_dict() for row in rows_of(run, found)]
    assert len(json.loads(exports.as_json(rows))) == len(rows)
    ElementTree.fromstring(exports.as_junit(rows))
    assert "<script" not in exports.as_markdown(rows)
    assert not [line for line in exports.as_csv(rows).splitlines() if line[:1] in "=+@"]
    return found


def test_generated_files(dice, soak, tmp_path):
    count, most = (12_000, 2_000) if soak else (500, 24)
    cells = []
    for number in range(count):
        path = written(mutated(dice.choice((BASE, SPATIAL)), dice), dice, tmp_path, number)
        cells += planned(path) or []
    assert len(cells) > count // 20, "the generator makes nothing that is valid"
    dice.shuffle(cells)
    judged(cells[:most])


@pytest.mark.parametrize("scene", [BASE, SPATIAL])
def test_unspoilt_scenes_are_valid(tmp_path, scene, dice):
    path = tmp_path / "sound.json"
    path.write_text(json.dumps(scene))
    assert planned(path)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[" * 100_000, "nested too deep"),
        ('{"a":' * 50_000, "nested too deep"),
        ('{"name": ' + "9" * 5000 + "}", "not valid JSON"),
        ("", "not valid JSON"),
        ("[]", "file"),
        ("null", "file"),
        ("\ufeff{}", "not valid JSON"),
        ('{"duration": 1e999}', "duration"),
        (" " * (MOST_BYTES + 1), "larger than"),
        (json.dumps(BASE | {"bodies": BASE["bodies"] * 20_000}), "larger than"),
        (json.dumps(BASE | {"bodies": [{}] * (MOST_BODIES + 1)}), "more than the"),
        (json.dumps(BASE | {"bodies": [BASE["bodies"][1] | {"name": "a" * 81}]}), "cannot be the name"),
        (json.dumps(BASE | {"bodies": [BASE["bodies"][1] | {"name": "\x1b[2J"}]}), "cannot be the name"),
    ],
)  # fmt: skip
def test_json_too_large_or_too_deep_refused(tmp_path, text, said):
    path = tmp_path / "scene.json"
    path.write_text(text)
    with pytest.raises(SceneError) as caught:
        resolve(pinned(str(path)))
    assert said in str(caught.value) and is_visible(str(caught.value))


@pytest.mark.parametrize("text", ["a = " + "[" * 100_000, "a = " + "9" * 5000, "a" * 5000 + " = ", "\x00"])
def test_invalid_toml_refused_in_one_line(tmp_path, text):
    path = tmp_path / "scene.toml"
    path.write_text(text)
    with pytest.raises(SceneError) as caught:
        resolve(pinned(str(path)))
    assert is_visible(str(caught.value)) and len(str(caught.value)) < 2000


@pytest.mark.parametrize("part", ["a", "'a'", '"b\\""', " a "])
def test_a_key_of_many_parts(tmp_path, part):
    """A parser takes time by the square of their number: they are counted before."""
    path = tmp_path / "scene.toml"
    for text in (".".join([part] * 16_000) + " = 1", "x = { " + ".".join([part] * 9) + " = 1 }"):
        path.write_text(text)
        with pytest.raises(SceneError, match="a key has more than 8 parts"):
            resolve(pinned(str(path)))
    path.write_text(".".join([part] * 8) + " = 1")
    with pytest.raises(SceneError, match="there is no such field"):
        resolve(pinned(str(path)))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_pipes_folders_and_devices_are_no_scene_files(tmp_path):
    os.mkfifo(tmp_path / "pipe.json")
    (tmp_path / "folder.json").mkdir()
    (tmp_path / "zero.json").symlink_to("/dev/zero")
    (tmp_path / "loop.json").symlink_to(tmp_path / "loop.json")
    for name in ("pipe", "folder", "zero", "loop"):
        with pytest.raises(SceneError, match="cannot read"):
            pinned(str(tmp_path / f"{name}.json"))


#: A file with a value in every field that takes text.
WORDY = BASE | {
    "growth": "2", "impact_law": "N-SIM", "constants": {"k": "1 + 1"}, "pairs": [{"a": "ball", "b": "floor"}],
    "checks": [{"quantity": "floor/ball.fy", "value": "k", "tolerance": "k", "over": "mean", "because": "a reason"}],
    "bodies": [body | {"motion": body.get("motion", "free")} for body in BASE["bodies"]],
}  # fmt: skip
SPOILT = "\x1b[2J\x00\u202egnp.exe\n]]>"


def texts(schema, root):
    """Places of all texts of a schema; a number stands for any entry of a list, ``*`` for a name of a table."""
    schema = root["$defs"][schema["$ref"].rpartition("/")[2]] if "$ref" in schema else schema
    if schema.get("type") == "string":
        yield ()
    for name, each in schema.get("properties", {}).items():
        yield from ((name, *rest) for rest in texts(each, root))
    for each in (*schema.get("anyOf", ()), *schema.get("oneOf", ())):
        yield from texts(each, root)
    if isinstance(schema.get("items"), dict):
        yield from ((0, *rest) for rest in texts(schema["items"], root))
    if isinstance(schema.get("additionalProperties"), dict):
        yield from (("*",), *(("k", *rest) for rest in texts(schema["additionalProperties"], root)))


def spoilt(data, place, word):
    """The data with another text at that place."""
    first, *rest = place
    if first == "*":
        return {word: "1"}
    changed = data.copy()
    changed[first] = spoilt(data[first], rest, word) if rest else word
    return changed


@pytest.mark.parametrize("place", dict.fromkeys(texts(json_schema(), json_schema())), ids=str)
def test_control_characters_in_a_text_of_a_scene_file(tmp_path, place):
    """The file is refused in a line that can be read, or its text is made plain before it is shown anywhere."""
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(spoilt(WORDY, place, SPOILT)))
    try:
        (slot,) = slots(Request([str(path)], ["chipmunk"], ["tuned"], dts=[1.0 / 240.0]))
    except SceneError as error:
        assert is_visible(str(error))
        return
    canonical = resolve(slot.scene)
    checks = canonical.checks(canonical.scene(2), slot.dt)
    metrics = {check.metric: (1e9, "") for check in checks}
    rows = [row.as_dict() for row in rows_of("r", [Observation(slot, "c", 1, "1", Outcome.OK, metrics=metrics)])]
    ElementTree.fromstring(exports.as_junit(rows))
    written = exports.as_csv(rows) + exports.as_markdown(rows) + canonical.name + "".join(canonical.notes)
    assert all(is_visible(line) for line in written.splitlines())
    assert all(is_visible(row["because"]) for row in rows)


def many(count):
    balls = [{"name": f"b{k}", "shape": {"type": "disc", "radius": 0.5}, "mass": 1.0, "inertia": 0.125,
              "pose": [1.5 * k, 0.6, 0.0]} for k in range(count)]  # fmt: skip
    return BASE | {"bodies": [BASE["bodies"][0], *balls]}


def test_reading_cost_linear_in_bodies(tmp_path, monkeypatch):
    """Counted, not timed: the material of a pair is asked for no more often than there are bodies."""
    from adapters.scene import Scene

    asked = []
    real = Scene.material
    monkeypatch.setattr(Scene, "material", lambda scene, a, b: asked.append(1) or real(scene, a, b))
    path = tmp_path / "many.json"
    path.write_text(json.dumps(many(MOST_BODIES - 1)))
    assert planned(path)
    assert len(asked) <= MOST_BODIES


@pytest.mark.parametrize("dt", ["1e-320", "1e-12", "5e-324"])
def test_too_many_steps_refused_before_the_run(tmp_path, dt):
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(BASE))
    with pytest.raises(SceneError, match=r"^dt: .* steps"):
        slots(Request([str(path)], ["chipmunk"], dts=[float(dt)]))


def test_step_longer_than_the_run(tmp_path):
    path = tmp_path / "scene.json"
    path.write_text(json.dumps({**BASE, "duration": 0.05}))
    judged(slots(Request([str(path)], ["chipmunk"], ["tuned"], dts=[LONGEST_DT])))


@pytest.mark.parametrize("dt", [3.0, 1.7e308])
def test_step_without_a_measurement_refused(tmp_path, dt):
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(BASE))
    with pytest.raises(SceneError, match=r"dt: .* s is longer than 0\.1 s"):
        slots(Request([str(path)], ["chipmunk"], ["tuned"], dts=[dt]))


def test_speed_with_an_infinite_energy_refused(tmp_path):
    fast = copy.deepcopy(BASE)
    fast["bodies"][1]["twist"] = [0.0, 0.0, 1e160]
    path = tmp_path / "fast.json"
    path.write_text(json.dumps(fast))
    with pytest.raises(SceneError, match=r"twist: 1e\+160 is larger than 1e\+30"):
        slots(Request([str(path)], ["chipmunk"], ["tuned"]))


def test_printable_characters_in_a_file_name(tmp_path):
    path = tmp_path / "a\x1b[31mb.json"
    path.write_text(json.dumps(BASE))
    with pytest.raises(SceneError) as caught:
        pinned(str(path))
    assert is_visible(str(caught.value))
    marked = tmp_path / "[bold]<b>|x.json"
    marked.write_text(json.dumps(BASE))
    judged(slots(Request([str(marked)], ["chipmunk"], ["tuned"], dts=[1.0 / 240.0])))


def test_unnamed_body_told_by_its_position(tmp_path):
    path = tmp_path / "nameless.toml"
    path.write_text(
        'name = "nameless"\ndimension = 3\ngravity = [0.0, 0.0, -9.81]\nduration = 0.1\n'
        'bodies = [{ name = "", shape = { type = "sphere", radius = 0.5 }, pose = [0, 0, 1, 1, 0.5, 0, 0] }]\n'
    )
    said = r"bodies\.0\.pose: the quaternion .* must have length 1; bodies: ''"
    with pytest.raises(SceneError, match=said):
        resolve(pinned(str(path)))
