"""`export --to`: a cell as a text for its engine alone ends in the bits of the cell."""

import json
import re
import shlex
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from adapters import registry
from adapters.scene.lift import lower_pose, lower_twist
from adapters.settings import text_of
from adapters.settings.own import given, own
from adapters.stepping import posed_for, run, step_count
from adapters.trajectory import Sampling
from reports.command import main
from reports.scripts import written
from validation.cells import Slot, prepare, settings_of
from validation.files.scene_files import load_scene
from validation.posed import pinned

DT = 1.0 / 240.0
MODELS = Path(__file__).parents[1] / "models"
OURS = ("contact_crosscheck", "adapters", "validation", "reports")
#: What each script must get right beside what the scene file below has: tuned starts, tables of materials.
CELLS = [("impact", {"e": 0.5}, "default"), ("pinch", {}, "tuned")]
#: Cells of engines that are set apart: each profile, tables of materials, what is moved as prescribed.
APART = [
    ("rapier", "bounce", {}, 2, "default"), ("rapier", "stack", {}, 3, "tuned"),
    ("rapier", "oblique", {}, 3, "default"), ("rapier", "pair_matrix", {}, 2, "default"),
    ("rapier", "closing_wall", {}, 3, "tuned"),
    ("dart", "bounce", {}, 2, "default"), ("dart", "stack", {"n": 2.0}, 3, "pgs"),
    ("dart", "incline", {}, 3, "default"), ("dart", "pinch", {}, 2, "default"), ("dart", "oblique", {}, 3, "nsgs"),
    ("dart", "oblique", {}, 2, "fbf"),
    ("box2d", "bounce", {}, 2, "default"), ("box2d", "stack", {}, 2, "tuned"), ("box2d", "incline", {}, 2, "tuned"),
    ("box2d", "pair_matrix", {}, 2, "tuned"), ("box2d", "closing_wall", {}, 2, "default"),
    ("box2d3", "bounce", {}, 2, "default"), ("box2d3", "stack", {}, 2, "tuned"),
    ("box2d3", "incline", {}, 2, "default"), ("box2d3", "pinch", {}, 2, "tuned"),
    ("box2d3", "closing_wall", {}, 2, "default"),
    ("drake", "stack", {"n": 2.0}, 3, "default"), ("drake", "incline", {}, 2, "sap"),
    ("drake", "pinch", {}, 2, "tamsi"), ("drake", "oblique", {"e": 0.0}, 3, "similar"),
    ("physx", "bounce", {}, 2, "default"), ("physx", "stack", {}, 3, "tuned"), ("physx", "incline", {}, 2, "pgs"),
    ("physx", "oblique", {}, 3, "tuned"), ("physx", "closing_wall", {}, 3, "default"),
    ("newton", "impact", {}, 2, "default"), ("newton", "oblique", {}, 3, "default"),
    ("newton", "impact", {}, 3, "tuned"),
]  # fmt: skip
USUAL = ("chipmunk", "bullet", "mujoco", "reference")
OPTIONAL = {engine for engine, *_ in APART}
LOADED = """
name = "loaded"
dimension = {d}
gravity = {gravity}
duration = 0.25
[[bodies]]
name = 'floor "0"'
shape = {{ type = "half_space", angle = 0.0 }}
motion = "fixed"
[[bodies]]
name = "box"
shape = {{ type = "box", half_extents = {half} }}
pose = {pose}
force = {force}
torque = {torque}
[[bodies]]
name = "belt"
shape = {{ type = "box", half_extents = {half} }}
motion = "prescribed"
pose = {away}
twist = {twist}
[[pairs]]
restitution = 0.25
friction = 0.5
[[pairs]]
a = "belt"
b = "box"
restitution = 0.25
friction = 0.4
"""
PLANAR = {"d": 2, "gravity": [0.0, -9.81], "half": [0.5, 0.5], "pose": [0.0, 0.7, 0.1], "force": [1.0, 0.5],
          "torque": [0.3], "away": [1.3, 0.6, 0.0], "twist": [-0.5, 0.0, 0.2]}  # fmt: skip
SPATIAL = {"d": 3, "gravity": [0.0, 0.0, -9.81], "half": [0.5, 0.4, 0.3],
           "pose": [0.0, 0.0, 0.7, 0.9887710779360422, 0.0, 0.14943813247359922, 0.0], "force": [1.0, 0.2, 0.5],
           "torque": [0.3, 0.1, 0.2], "away": [1.3, 0.0, 0.6, 1.0, 0.0, 0.0, 0.0],
           "twist": [-0.5, 0.0, 0.0, 0.0, 0.0, 0.2]}  # fmt: skip


def cases(listed):
    """Cases of a test of engines; those of `OPTIONAL` are marked."""
    return [
        pytest.param(name, *rest, marks=[pytest.mark.optional(name)] if name in OPTIONAL else [])
        for name, *rest in listed
    ]


def installed(engine):
    """An engine; whoever asks for one that is not there is skipped."""
    found = registry.find(engine).engine
    if found is None:
        pytest.skip(f"{engine} is not installed")
    return found


def best_of(engine):
    """Profile of a textbook, or the tuned one."""
    return engine.facts.profile("textbook") or engine.facts.profile("tuned")


def slot_of(engine, scene, params, profile, dimension):
    return Slot(scene, tuple(sorted(params.items())), dimension, engine, profile, DT)


def ended(slot):
    """Final pose and twist of a cell."""
    engine, prepared = registry.load(slot.engine), prepare(slot)
    settings = {setting.name: setting.value for setting in settings_of(engine, slot, prepared.scene)}
    found = run(engine, prepared.scene, slot.dt, settings, Sampling(10**6))
    return found.pose[-1], found.twist[-1]


def printed(slot, tmp_path, allowed=()):
    """Final pose and twist that the script of a cell prints."""
    return told(written(slot, "python"), prepare(slot).scene, tmp_path, allowed)


def told(script, scene, tmp_path, allowed=()):
    """Final pose and twist that a script prints, run in a folder of its own without our packages."""
    path = tmp_path / "cell.py"
    blocked = [name for name in (*OURS, "reference_solver") if name not in allowed]
    guard = f"\nimport sys\nassert not set(sys.modules) & set({blocked!r}), 'it imports us'\n"
    path.write_text(script + guard)
    alone = [] if allowed else ["-I"]  # what is allowed may stand on PYTHONPATH
    done = subprocess.run([sys.executable, *alone, str(path)], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    last = json.loads(done.stdout.splitlines()[-1])
    bodies = [last["bodies"][body.name] for body in scene.bodies]
    pose, twist = (np.array([body[key] for body in bodies]) for key in ("pose", "twist"))
    if pose.shape[1] == 7 and scene.dimension == 2:
        pose, twist = lower_pose(pose), lower_twist(twist)
    return pose, twist


def assert_same_bits(slot, tmp_path, allowed=()):
    for found, expected in zip(printed(slot, tmp_path, allowed), ended(slot), strict=True):
        assert np.array_equal(found, expected)


@pytest.mark.few(5)
@pytest.mark.parametrize(("scene", "params", "profile"), CELLS)
@pytest.mark.parametrize(("engine", "package", "dimension"), [
    ("chipmunk", "pymunk", 2), ("bullet", "pybullet", 2), ("bullet", "pybullet", 3),
    ("mujoco", "mujoco", 2), ("mujoco", "mujoco", 3),
])  # fmt: skip
def test_a_script_ends_in_the_bits_of_its_cell(engine, package, dimension, scene, params, profile, tmp_path):
    pytest.importorskip(package)
    assert_same_bits(slot_of(engine, scene, params, profile, dimension), tmp_path)


@pytest.mark.parametrize(("engine", "scene", "params", "dimension", "profile"), cases(APART))
def test_script_of_an_engine_set_apart(engine, scene, params, dimension, profile, tmp_path):
    installed(engine)
    assert_same_bits(slot_of(engine, scene, params, profile, dimension), tmp_path)


@pytest.mark.parametrize(("engine", "changes"), cases([
    ("rapier", {"friction_model": "coulomb", "recycling": False, "clustering": False}),
    ("dart", {"detector": "bullet"}), ("box2d", {"early_restitution": True, "units_per_metre": 4.0}),
    ("box2d3", {"continuous": False, "units_per_metre": 4.0}), ("drake", {"boxes": "point", "dissipation": 10.0}),
    ("physx", {"friction_every_iteration": False, "persistent_manifolds": False}),
    ("newton", {"weighted": False, "rebound_iterations": 3}),
]))  # fmt: skip
def test_script_with_settings_of_no_profile(engine, changes, tmp_path):
    found = installed(engine)
    slot = slot_of(engine, "oblique", {"e": 0.0 if engine == "drake" else 0.5}, "default", 2)
    scene = prepare(slot).scene
    settings = {setting.name: setting.value for setting in settings_of(found, slot, scene)} | changes
    script = found.exports["python"](posed_for(found, scene), DT, settings, step_count(scene.duration, DT))
    ends = run(found, scene, DT, settings, Sampling(10**6))
    for state, expected in zip(told(script, scene, tmp_path), (ends.pose[-1], ends.twist[-1]), strict=True):
        assert np.array_equal(state, expected)


@pytest.mark.parametrize(("engine", "package", "texts"), [
    ("mujoco", "mujoco", ["cone=elliptic", "impratio=10", "solref=0.01,1", "jacobian=dense", "solver=cg"]),
    ("mujoco", "mujoco", ["enabled=override", "o_solref=0.03,1", "o_margin=0.001", "disabled=warmstart,island"]),
    ("bullet", "pybullet", ["frictionERP=0.1", "contactStiffness=1e5", "contactDamping=10", "linearDamping=0.5"]),
    ("chipmunk", "pymunk", ["damping=0.5", "collision_slop=0.01", "iterations=3"]),
])  # fmt: skip
def test_script_with_own_settings(engine, package, texts, tmp_path):
    """And no other does: each of them is in the script."""
    pytest.importorskip(package)
    plain = slot_of(engine, "oblique", {"e": 0.5}, "default", 2)
    found, scene = registry.load(engine), prepare(plain).scene
    slot = plain.with_own(own(found, given(texts), settings_of(found, plain, scene)))
    assert_same_bits(slot, tmp_path)
    script = written(slot, "python")
    assert f"profile {slot.profile}" in script and all(f"--set {text}" in script.lower() for text in given_back(slot))
    for left in texts:
        fewer = [text for text in texts if text != left and not {left, text} <= TOGETHER]
        other = plain.with_own(own(found, given(fewer), settings_of(found, plain, scene)))
        assert written(other, "python").partition("import")[2] != script.partition("import")[2], left


#: Settings of Bullet that it takes together only.
TOGETHER = {"contactStiffness=1e5", "contactDamping=10"}


def given_back(slot):
    """Settings of a slot as the command that runs it again has them."""
    return [f"{name}={text_of(value)}".lower() for name, value in slot.switched]


#: Another word for settings that are words.
OTHER_WORD = {"coulomb": "simplified", "simplified": "coulomb", "fcl": "dart", "lagged": "sap", "sap": "lagged",
              "tamsi": "sap", "similar": "sap", "hydroelastic": "point", "tgs": "pgs", "pgs": "tgs"}  # fmt: skip


def another(value):
    """Another value of a setting that an engine can take."""
    if isinstance(value, str):
        return OTHER_WORD[value]
    return not value if isinstance(value, bool) else value + 1 if isinstance(value, int) else 0.5 * value or 1.0


@pytest.mark.parametrize("engine", cases((name,) for name in sorted(OPTIONAL)))
def test_script_with_every_setting(engine):
    """A profile's own number may be the engine's default, so that a script ends in the same bits without it."""
    found = installed(engine)
    for profile in found.profiles:
        slot = slot_of(engine, "stack", {"n": 1.0}, profile, 2)
        scene = prepare(slot).scene
        settings = {setting.name: setting.value for setting in settings_of(found, slot, scene)}
        # These bring settings of their own; profiles have them all.
        left = [name for name, value in settings.items() if (engine, name) == ("dart", "solver") or value == "cenic"]
        texts = {}
        for name, value in settings.items():
            if name in left:
                continue
            texts[name] = found.exports["python"](posed_for(found, scene), DT, settings | {name: another(value)}, 3)
        texts[""] = found.exports["python"](posed_for(found, scene), DT, settings, 3)
        assert len(set(texts.values())) == len(settings) + 1 - len(left), (profile, texts)


@pytest.mark.optional("drake")
@pytest.mark.parametrize("name", ["rollers", "soft_surfaces"])
def test_script_of_a_model_with_its_own_surfaces(name, tmp_path):
    assert_same_bits(slot_of("drake", pinned(str(MODELS / f"{name}.sdf")), {}, "model", 3), tmp_path)


def test_script_of_bodies_from_files(tmp_path):
    """Tuned Bullet clips faces of hulls, and knows those of bodies from URDF alone."""
    pytest.importorskip("pybullet")
    assert_same_bits(slot_of("bullet", "wedge", {}, "tuned", 2), tmp_path)


@pytest.mark.parametrize(("scene", "params"), [("oblique", {"e": 0.5}), ("pinch", {}), ("tumble", {})])
def test_script_with_the_loop_of_a_matched_profile(scene, params, tmp_path):
    pytest.importorskip("mujoco")
    assert_same_bits(slot_of("mujoco", scene, params, "matched", 3), tmp_path)


@pytest.mark.parametrize("engine", cases((name,) for name in (*USUAL, *sorted(OPTIONAL))))
@pytest.mark.parametrize("values", [PLANAR, SPATIAL], ids=["planar", "spatial"])
def test_script_of_loads_and_a_driven_body(engine, values, tmp_path):
    found = installed(engine)
    if values["d"] == 3 and found.facts.dimensions == {2}:
        pytest.skip(f"{engine} is planar: it has no spatial script")
    path = tmp_path / "loaded.toml"
    text = LOADED.format(**values)
    if engine in UNMOVED:
        text = re.sub(r'motion = "prescribed"(.*?)twist = [^\n]*', r'motion = "fixed"\1', text, flags=re.DOTALL)
    if engine == "drake":  # has no restitution
        text = text.replace("restitution = 0.25", "restitution = 0.0")
    path.write_text(text)
    slot = slot_of(engine, pinned(str(path)), {}, best_of(found), values["d"])
    assert_same_bits(slot, tmp_path, allowed=("reference_solver",) if engine == registry.solver() else ())


#: Engines that move no body as prescribed.
UNMOVED = ("dart", "drake")
DRIVEN = """
name = "driven"
dimension = 2
gravity = [0.0, -9.81]
duration = 0.25
[[bodies]]
name = "belt"
shape = { type = "half_space", angle = 0.0 }
motion = "%s"
surface_velocity = [%s, 0.0]
%s
[[bodies]]
name = "box"
shape = { type = "box", half_extents = [0.5, 0.25] }
pose = [0.0, 0.25, 0.0]
[[bodies]]
name = "hammer"
shape = { type = "box", half_extents = [0.5, 0.25] }
motion = "prescribed"
pose = [1.2, 0.35, 0.1]
twist = [-0.2, 0.0, 0.5]
%s
[[pairs]]
friction = 0.5
"""
COURSE = "course = { amplitude = [0.01, 0.02], frequency = 3.0, phase = 0.5 }"


@pytest.mark.parametrize(("engine", "runs", "shaken"), cases([
    ("chipmunk", True, True), ("bullet", True, False), ("bullet", False, True), ("mujoco", True, True),
    ("mujoco", False, True), ("mujoco matched", True, True), ("mujoco matched", False, True),
    ("physx", None, True), ("newton", True, True), ("newton", False, True),
]) + [pytest.param("reference", True, False, marks=pytest.mark.long)])  # fmt: skip
def test_script_of_conveyors_and_courses(engine, runs, shaken, tmp_path):
    engine, _, profile = engine.partition(" ")
    found = installed(engine)
    path, course = tmp_path / "driven.toml", COURSE if shaken else ""
    moved = {True: ("fixed", 1.0, ""), False: ("prescribed", 0.0, COURSE), None: ("fixed", 0.0, "")}[runs]
    path.write_text(DRIVEN % (*moved, course))
    slot = slot_of(engine, pinned(str(path)), {}, profile or best_of(found), 2)
    allowed = ("reference_solver",) if engine == registry.solver() else ()
    pose, twist = printed(slot, tmp_path, allowed)
    expected = ended(slot)
    standing = [1, 2] if runs else [0, 1, 2]  # a script's conveyor may be a half-space that moves along itself
    assert np.array_equal(pose[standing], expected[0][standing])
    assert np.array_equal(twist[standing], expected[1][standing])


SHAPES = """
name = "shapes"
dimension = {d}
gravity = {gravity}
duration = 0.1
[[bodies]]
name = "floor"
shape = {{ type = "half_space", angle = 0.0 }}
motion = "fixed"
[[bodies]]
name = "capsule"
shape = {{ type = "capsule", half_length = 0.4, radius = 0.3 }}
pose = {first}
[[bodies]]
name = "other"
shape = {{ type = {other} }}
pose = {second}
[[pairs]]
friction = 0.5
"""
IN_THE_PLANE = {"d": 2, "gravity": [1.0, -9.81], "first": [0.0, 0.31, 0.1], "second": [3.0, 0.41, 0.2],
                "other": '"polygon", vertices = [[0, 0], [1, 0], [0.5, 1]]'}  # fmt: skip
CYLINDER = {"d": 3, "gravity": [1.0, 0.0, -9.81], "first": [0.0, 0.0, 0.31, 1, 0, 0, 0],
            "second": [3.0, 0.0, 0.41, 1, 0, 0, 0], "other": '"cylinder", half_length = 0.5, radius = 0.4'}  # fmt: skip
HULL = CYLINDER | {"other": '"hull", vertices = [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]'}


@pytest.mark.parametrize(("engine", "values"), cases([
    ("chipmunk", IN_THE_PLANE), ("mujoco", IN_THE_PLANE), ("bullet", CYLINDER),
    ("bullet", HULL), ("mujoco", CYLINDER), ("mujoco", HULL), ("physx", IN_THE_PLANE), ("physx", HULL),
    ("newton", IN_THE_PLANE), ("newton", HULL),
]) + [pytest.param("reference", IN_THE_PLANE, marks=pytest.mark.long)])  # fmt: skip
def test_script_of_other_shapes(engine, values, tmp_path):
    found = installed(engine)
    path = tmp_path / "shapes.toml"
    path.write_text(SHAPES.format(**values))
    slot = slot_of(engine, pinned(str(path)), {}, best_of(found), values["d"])
    assert_same_bits(slot, tmp_path, ("reference_solver",) if engine == registry.solver() else ())
    if engine == "mujoco":
        import mujoco

        model = mujoco.MjModel.from_xml_string(written(slot, "mjcf"))
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, model.key("start").id)
        mujoco.mj_step(model, data, nstep=24)
        pose = data.qpos.reshape(-1, 7)
        assert np.array_equal(lower_pose(pose) if values["d"] == 2 else pose, ended(slot)[0][1:])


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("profile", ["default", "tuned"])
def test_bits_of_an_exported_mjcf(dimension, profile):
    mujoco = pytest.importorskip("mujoco")
    slot = slot_of("mujoco", "masse", {}, profile, dimension) if dimension == 3 else slot_of(
        "mujoco", "off_centre", {}, profile, 2
    )  # fmt: skip
    model = mujoco.MjModel.from_xml_string(written(slot, "mjcf"))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("start").id)
    scene = prepare(slot).scene
    for _ in range(int(np.ceil(scene.duration / slot.dt - 1e-9))):
        mujoco.mj_step(model, data)
    pose = data.qpos.reshape(-1, 7)
    if dimension == 2:
        pose = lower_pose(pose)
    moving = [i for i, body in enumerate(scene.bodies) if body.motion != "fixed"]
    assert np.array_equal(pose, ended(slot)[0][moving])


def test_mjcf_with_loads_as_in_its_cell(tmp_path):
    mujoco = pytest.importorskip("mujoco")
    path = tmp_path / "loaded.toml"
    path.write_text(LOADED.format(**SPATIAL))
    done = CliRunner().invoke(main, ["export", str(path), "--engine", "mujoco", "--to", "mjcf"])
    assert done.exit_code == 0, done.output
    scene = load_scene(path)
    assert any(body.is_loaded for body in scene.bodies)
    model = mujoco.MjModel.from_xml_string(done.output)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("start").id)
    mujoco.mj_forward(model, data)
    pushed = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, pushed, model.key("start").id)
    model.actuator_biasprm[:] = 0.0
    for i, body in enumerate(scene.bodies):
        if body.is_loaded:
            pushed.xfrc_applied[model.body(f"body{i}").id] = (*body.force, *body.torque)
    mujoco.mj_forward(model, pushed)
    assert data.qfrc_actuator.any() and np.allclose(data.qacc, pushed.qacc, rtol=1e-12, atol=1e-12)


def test_mjcf_note_on_what_it_cannot_express():
    pytest.importorskip("mujoco")
    done = CliRunner().invoke(main, ["export", "slide", "--engine", "mujoco", "--profile", "matched", "--to", "mjcf"])
    assert done.exit_code == 2 and "rounds: MJCF has no word for a loop around the solver" in done.output


def test_head_of_a_script(tmp_path):
    pytest.importorskip("pymunk")
    call = ["export", "bounce", "--engine", "chipmunk", "--to", "python", "--param", "e=0.5", "--dt", "1/120"]
    done = CliRunner().invoke(main, call)
    assert done.exit_code == 0
    for said in ("h_n = e^(2n) h0", "apex[1] = 0.25 m", "step 1/120 s", "crosscheck run bounce --param e=0.5 --dim 2"):
        assert said in done.stdout
    assert f"DT, STEPS = {1 / 120!r}" in done.stdout
    assert re.search(r"apex\[1\] = 0.25 m within [\d.e+-]+ m: ", done.stdout)


def test_script_head_with_scene_file_path_and_judge(tmp_path):
    """The head of a script names the scene file by its path, in quotes where the path has spaces."""
    pytest.importorskip("pymunk")
    (tmp_path / "own files").mkdir()
    path = tmp_path / "own files" / "loaded.toml"
    checks = "".join(
        f'[[checks]]\nquantity = "box.x"\nat = {0.01 * k}\nvalue = 0.0\ntolerance = 1.0\n' for k in range(1, 14)
    )
    path.write_text(LOADED.format(**PLANAR) + checks)
    done = CliRunner().invoke(main, ["export", str(path), "--engine", "chipmunk", "--to", "python"])
    assert done.exit_code == 0, done.output
    lines = done.stdout.splitlines()
    for start, word in ((" more: ", "describe"), ("Judged by: ", "run")):
        (said,) = (line.split(start)[1] for line in lines if start in line)
        words = shlex.split(said)
        assert words[:2] == ["crosscheck", word] and words[2].partition("@")[0] == str(path)
        assert word == "run" or CliRunner().invoke(main, words[1:]).exit_code == 0


def test_hostile_names_within_comments_and_strings(tmp_path):
    """A body's name is data in a script and in a model, whatever it holds."""
    pytest.importorskip("pymunk")
    path = tmp_path / "hostile.toml"
    text = re.sub('(name|b) = "box"', "\\1 = '''a'\"\"\" --> <b/> ]}} ''' ", LOADED.format(**PLANAR))
    path.write_text(text.replace('name = "loaded"', "name = '''-->'\"\"\"'''"))
    assert_same_bits(slot_of("chipmunk", pinned(str(path)), {}, "default", 2), tmp_path)
    if registry.find("mujoco").engine:
        path.write_text(path.read_text().replace("force = ", "#").replace("torque = ", "#"))
        slot = slot_of("mujoco", pinned(str(path)), {}, "default", 2)
        ElementTree.fromstring(written(slot, "mjcf"))


@pytest.mark.parametrize(("words", "said"), [
    (["bounce", "--engine", "chipmunk"], "needs --parquet FOLDER for results, or --to FORMAT for a case"),
    (["bounce", "--engine", "chipmunk", "--to", "mjcf"], "to: chipmunk writes python, not mjcf"),
    (["bounce", "--to", "python"], "name its scene and its --engine"),
    (["bounce", "stack", "--engine", "chipmunk", "--to", "python"], "name its scene and its --engine"),
    (["bounce", "--engine", "chipmunk", "--to", "python", "--all"], "all: chooses runs"),
    (["--parquet", "p", "--engine", "chipmunk"], "engine: chooses a case"),
    (["bounce", "--dim", "3", "--engine", "chipmunk", "--to", "python"], "chipmunk is planar"),
    (["bounce", "--engine", "chipmunk", "--to", "python", "-o", "pymunk.py"], "name it otherwise"),
    (["bounce", "--engine", "chipmunk", "--profile", "best", "--to", "python"], "has no profile 'best'"),
])  # fmt: skip
def test_wrong_call_in_one_line(words, said, tmp_path, monkeypatch):
    pytest.importorskip("pymunk")
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(main, ["export", *words])
    assert done.exit_code == 2 and said in done.output and len(done.output.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_script_formats_all_tested():
    ours = [name for name in registry.names() if registry.is_ours(registry.entry(name))]
    forms = {(name, form) for name in ours for form in registry.adapter(name).exports}
    tried = {*USUAL, *OPTIONAL}
    assert forms == {(name, "python") for name in tried} | {("mujoco", "mjcf")}


def test_transformed_scene_as_written():
    pytest.importorskip("pybullet")
    slot = slot_of("bullet", "impact", {}, "default", 2)
    engine, prepared = registry.load("bullet"), prepare(slot)
    assert posed_for(engine, prepared.scene).dimension == 3
    assert "posed in the plane y = 0" in written(slot, "python")
