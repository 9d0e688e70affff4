"""SDF models as scenes, through Drake's parser: against the same scenes in MJCF, and Drake's own run of the files."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from adapters import registry
from adapters.drake.engine import DrakeEngine
from adapters.drake.sdf import read
from adapters.model import read as read_apart
from adapters.scene import Body, Capsule, Cylinder, HalfSpace, Pair, Scene, SceneError, Sphere
from adapters.scene.lift import lowered
from adapters.stepping import run
from adapters.trajectory import Sampling
from reports.command import main

pytestmark = pytest.mark.optional("drake")
ROOT = Path(__file__).parents[2]
MODELS = ROOT / "tests" / "models"
READ = sorted(p for p in MODELS.iterdir() if p.suffix in (".sdf", ".world") and not p.name.startswith("refused"))
#: The models that have no more than balls, boxes and planes, as MJCF; frictions are harmonic means, worked by hand.
AS_MJCF = {
    "ball_dropped.sdf": """<mujoco><option gravity="0 0 -9.81"/><worldbody>
        <geom name="ground" type="plane" size="1 1 1"/>
        <body name="ball" pos="0 0 .5"><freejoint/><inertial pos="0 0 0" mass=".4" diaginertia=".0016 .0016 .0016"/>
          <geom type="sphere" size=".1"/></body></worldbody></mujoco>""",
    "boxes_in_frames.sdf": """<mujoco><option gravity="0 0 -9.8"/><worldbody>
        <geom name="table" type="box" size="1 .5 .05" pos=".3 0 .7"/>
        <body name="column::lower" pos=".1 0 .85"><freejoint/>
          <inertial pos="0 0 0" mass="2" diaginertia=".02666666666666667 .02666666666666667 .02666666666666667"/>
          <geom name="l" type="box" size=".1 .1 .1"/></body>
        <body name="column::upper" pos=".12 0 1.05"><freejoint/>
          <inertial pos="0 0 0" mass="1" diaginertia=".01 .0125 .0075"/>
          <geom name="u" type="box" size=".1 .1 .1"/></body></worldbody>
        <contact><pair geom1="table" geom2="l" friction=".4 .4 .005 .0001 .0001"/>
          <pair geom1="table" geom2="u" friction=".5454545454545454 .5454545454545454 .005 .0001 .0001"/>
          <pair geom1="l" geom2="u" friction=".375 .375 .005 .0001 .0001"/></contact></mujoco>""",
    "moon_slope.world": """<mujoco><compiler angle="radian"/><option gravity="0 0 -1.62"/><worldbody>
        <geom name="slope" type="plane" size="1 1 1" euler="0 .3 0" friction=".2 .005 .0001"/>
        <body name="crate" pos=".0886560619984 0 .286600946738" euler="0 .3 0"><freejoint/>
          <inertial pos="0 0 0" mass="3" diaginertia=".18 .18 .18"/>
          <geom type="box" size=".3 .3 .3" friction=".2 .005 .0001"/></body></worldbody></mujoco>""",
    "degrees_and_quaternions.sdf": """<mujoco><compiler eulerseq="XYZ"/><option gravity="0 0 -9.81"/><worldbody>
        <geom name="ground" type="plane" size="1 1 1"/>
        <body name="turned" pos="0 0 .8" euler="10 20 30"><freejoint/>
          <inertial pos="0 0 0" mass="1.5" diaginertia=".02 .03 .04"/><geom type="box" size=".2 .15 .1"/></body>
        <body name="apart" pos="1 1 .5" quat=".8 0 0 .6"><freejoint/>
          <inertial pos="0 0 0" mass="1" diaginertia=".016 .016 .016"/><geom type="sphere" size=".2"/></body>
        </worldbody></mujoco>""",
    "shelf.sdf": """<mujoco><option gravity="0 0 -9.81"/><worldbody>
        <geom name="shelf::frame::board" type="box" size=".6 .2 .05" pos="0 0 .95"/>
        <geom name="shelf::frame::stop" type="box" size=".025 .2 .1" pos=".575 0 1.1"/>
        <body name="ball" pos="-.3 0 1.35"><freejoint/><inertial pos="0 0 0" mass=".5" diaginertia=".002 .002 .002"/>
          <geom type="sphere" size=".1"/></body></worldbody></mujoco>""",
    "cube_alone.sdf": """<mujoco><option gravity="0 0 -9.8"/><worldbody>
        <body name="cube alone" pos="0 0 1"><freejoint/><inertial pos="0 0 0" mass="1" diaginertia=".015 .015 .015"/>
          <geom type="box" size=".15 .15 .15"/></body></worldbody></mujoco>""",
    "soft_surfaces.sdf": """<mujoco><compiler angle="radian"/><option gravity="0 0 -9.81"/><worldbody>
        <geom name="slab" type="box" size="2 2 .5" pos="0 0 -.5"/>
        <body name="cushion" pos="0 0 .3" euler="0 .1 0"><freejoint/>
          <inertial pos="0 0 0" mass="2" diaginertia=".0533333 .0533333 .0533333"/>
          <geom name="c" type="box" size=".2 .2 .2"/></body>
        <body name="ball" pos="1 0 .4"><freejoint/><inertial pos="0 0 0" mass=".5" diaginertia=".002 .002 .002"/>
          <geom name="b" type="sphere" size=".1"/></body></worldbody>
        <contact><pair geom1="slab" geom2="c" friction=".509090909090909 .509090909090909 .005 .0001 .0001"/>
          <pair geom1="slab" geom2="b" friction=".823529411764706 .823529411764706 .005 .0001 .0001"/>
          <pair geom1="c" geom2="b" friction=".571428571428571 .571428571428571 .005 .0001 .0001"/></contact>
        </mujoco>""",
}
#: Places of some metres, angles, moments and friction: tens of roundings of numbers of order 1.
ROUND_OFF = 1e-14


def test_every_readable_model_written_in_another_language():
    assert {path.name for path in READ} == {*AS_MJCF, "rollers.sdf"}


def assert_the_same(found, expected):
    """Two scenes hold the same numbers to round-off."""
    assert [(b.name, b.motion, type(b.shape)) for b in found.bodies] == [
        (b.name, b.motion, type(b.shape)) for b in expected.bodies
    ]
    for ours, theirs in zip(found.bodies, expected.bodies, strict=True):
        assert vars(ours.shape).keys() == vars(theirs.shape).keys()
        for name, value in vars(theirs.shape).items():
            assert np.array(getattr(ours.shape, name)) == pytest.approx(np.array(value), abs=ROUND_OFF), ours.name
        assert ours.pose[:3] == pytest.approx(theirs.pose[:3], abs=ROUND_OFF), ours.name
        assert abs(np.dot(ours.pose[3:], theirs.pose[3:])) == pytest.approx(1.0, abs=ROUND_OFF), ours.name
        if ours.motion == "free":
            assert ours.mass == pytest.approx(theirs.mass, rel=ROUND_OFF)
            assert ours.inertia == pytest.approx(theirs.inertia, rel=10 * ROUND_OFF), ours.name
            assert ours.twist == theirs.twist
    assert found.gravity == pytest.approx(expected.gravity, abs=ROUND_OFF)
    for ours, theirs in zip(found.contact_pairs(), expected.contact_pairs(), strict=True):
        assert ours[:2] == theirs[:2] and ours[2].restitution == theirs[2].restitution == 0.0
        assert ours[2].friction == pytest.approx(theirs[2].friction, abs=ROUND_OFF)


@pytest.mark.parametrize("name", AS_MJCF)
def test_sdf_model_equal_to_its_mjcf_scene(name):
    """Two languages, two parsers that share no code: frames, moments, friction and gravity agree to round-off."""
    pytest.importorskip("mujoco")
    mjcf = registry.load("mujoco").reads[".xml"](AS_MJCF[name], False)
    assert_the_same(read((MODELS / name).read_text(), False).scene, mjcf.scene)


def test_cylinders_and_capsules_lie_along_their_bodies_first_axis():
    """Worked by hand: z of SDF is x here. A pitch of 1.2 is a turn of 1.2 - pi/2 then, a roll of pi/2 is z to -y."""
    half = 0.5 * (1.2 - 0.5 * np.pi)
    bodies = (
        Body("ground", HalfSpace((0.0, 0.0, 1.0)), motion="fixed"),
        Body("capsule", Capsule(0.25, 0.1), 1.0, (0.005, 0.03, 0.03), (0, 0, 0.4, np.cos(half), 0, np.sin(half), 0)),
        Body("cylinder", Cylinder(0.2, 0.15), 2.0, (0.0225, 0.04, 0.04), (2, 0, 0.25, 0.5, 0.5, -0.5, -0.5)),
    )
    scene = Scene("rollers", 1, 3, bodies, (Pair(friction=1.0),), (0.0, 0.0, -9.81), 2.0)
    found = read((MODELS / "rollers.sdf").read_text(), False).scene
    assert_the_same(found, scene)
    w, x, y, z = found.bodies[2].pose[3:]
    axis = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)])
    assert np.abs(axis) == pytest.approx([0.0, 1.0, 0.0], abs=ROUND_OFF)
    assert lowered(replace(found, bodies=found.bodies[:2])) is not None


@pytest.mark.parametrize("path", READ, ids=lambda path: path.name)
def test_motion_of_a_model_against_drake(path):
    """Profile `model` against the file itself in Drake alone, gravity aside, which Drake does not read.

    The bound is round-off that springs amplify, as for models of MuJoCo: far below any softness.
    """
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
    from pydrake.systems.analysis import Simulator
    from pydrake.systems.framework import DiagramBuilder

    found = read(path.read_text(), False)
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, found.dt)
    Parser(plant).AddModelsFromString(path.read_text(), "sdf")
    plant.mutable_gravity_field().set_gravity_vector(list(found.scene.gravity))
    plant.Finalize()
    simulator = Simulator(builder.Build())
    steps = 400
    simulator.AdvanceTo(steps * found.dt)
    context = plant.GetMyContextFromRoot(simulator.get_context())
    settings = {setting.name: setting.value for setting in found.settings}
    scene = replace(found.scene, duration=steps * found.dt)
    assert DrakeEngine().refuses(scene, "model") is None
    ours = run(DrakeEngine(), scene, found.dt, settings, Sampling(steps))
    moved = 0.0
    for i, body in enumerate(scene.bodies):
        if body.motion != "free":
            continue
        model, _, link = body.name.partition("::")
        theirs = plant.GetBodyByName(link or "link", plant.GetModelInstanceByName(model))
        inertia = theirs.CalcSpatialInertiaInBodyFrame(context)
        place = plant.EvalBodyPoseInWorld(context, theirs).multiply(inertia.get_com())
        velocity = plant.EvalBodySpatialVelocityInWorld(context, theirs)
        assert np.abs(ours.pose[-1, i, :3] - place).max() < 1e-7, body.name
        assert np.abs(ours.twist[-1, i, 3:] - velocity.rotational()).max() < 1e-6, body.name
        moved = max(moved, float(np.abs(ours.pose[-1, i, :3] - np.array(body.pose[:3])).max()))
    assert moved > 1e-4  # columns sink into what bears them, all others fall


INERTIAL = "<inertial><mass>2</mass><inertia><ixx>.1</ixx><iyy>.1</iyy><izz>.1</izz></inertia></inertial>"
BALL = "<collision name='c'><geometry><sphere><radius>.2</radius></sphere></geometry></collision>"


def model(links, beside="", about=""):
    return f"<sdf version='1.9'><model name='m'>{about}{links}{beside}</model></sdf>"


def link(name, inside=f"{INERTIAL}{BALL}"):
    return f"<link name='{name}'>{inside}</link>"


def fixed(parent, child):
    return f"<joint name='j' type='fixed'><parent>{parent}</parent><child>{child}</child></joint>"


COLLIDE = "<self_collide>true</self_collide>"
SPHERE = "<sphere><radius>.2</radius></sphere>"
PLANE = "<plane><normal>0 0 1</normal></plane>"
HIGH = INERTIAL.replace("<mass>", "<pose>0 0 1 0 0 0</pose><mass>")
TILTED = "<collision name='c'><pose>0 0 0 .5 0 0</pose><geometry><box><size>1 1 1</size></box></geometry></collision>"
TALL = INERTIAL.replace("<izz>.1", "<izz>.05")
#: What has no place by what Drake's parser made of it, and the bodies that ``--drop`` leaves; None: it is refused too.
REFUSED = [
    (model(link("l") + link("k", INERTIAL)), "<link> 'k': has no shape that collides", ["m"]),
    (model(link("l") + link("k", INERTIAL + BALL + BALL.replace("'c'", "'d'"))), "<link> 'k': has several", ["m"]),
    (model(link("l") + link("k"), fixed("l", "k"), COLLIDE), "<joint> 'j': connects two moving links", ["m"]),
    (model(link("l") + link("k")), "<model> 'm': its links do not collide with each other", ["m::l", "m::k"]),
    (model(link("l") + link("k", HIGH + BALL), "", COLLIDE), "<link> 'k': its centre of mass", ["m"]),
    (model(link("l") + link("k", TALL + TILTED), "", COLLIDE), "<link> 'k': its principal axes", ["m"]),
    (model(link("l") + link("k", INERTIAL + BALL.replace(SPHERE, PLANE)), "", COLLIDE),
     "<link> 'k': its shape is a plane, which cannot move", ["m"]),
    (model(link("l"), "", "<static>true</static>"), "has no free body", None),
    (model(link("l"), fixed("world", "l")), "has no free body", None),
    (model(link("l") + link("l")), "Drake does not read it: ", None),
    (model("<link>" + INERTIAL + BALL + "</link>"), "Drake does not read it: line 1: ", None),
    (model(link("l", "<pose relative_to='nobody'>0 0 0 0 0 0</pose>" + BALL)), "relative_to name[nobody]", None),
    (model(link("world")), "Drake does not read it: ", None),
    (model(link("a::b")), "Drake does not read it: ", None),
    (model(""), "Drake does not read it: ", None),
    ("<sdf version='1.9'/>", "Drake does not read it: line 1: ", None),
    ("<sdf version='9.9'><model name='m'/></sdf>", "Drake does not read it: Unable to convert", None),
    (model(link("l", INERTIAL + BALL.replace(SPHERE, PLANE.replace("1", "0")))), "<normal>: is not a direction", None),
    (model(link("l", INERTIAL + BALL.replace(SPHERE, PLANE.replace("1", "1e-99")))), "Drake does not read it: ", None),
]  # fmt: skip


@pytest.mark.parametrize(("text", "said", "left"), REFUSED, ids=[said[:40] for _, said, _ in REFUSED])
def test_sdf_elements_refused_or_left_out_with_a_message(text, said, left):
    with pytest.raises(SceneError) as refused:
        read(text, False)
    assert said in str(refused.value) and "\n" not in str(refused.value) and len(str(refused.value)) < 600
    if left is None:
        with pytest.raises(SceneError):
            read(text, True)
    else:
        found = read(text, True)
        assert [body.name for body in found.scene.bodies] == left and said in found.dropped[0]
        assert len(found.dropped) == 1


def test_many_unplaceable_elements_each_told_once():
    several = "".join(link(f"k{n}", INERTIAL) + link(f"h{n}", HIGH + BALL) for n in range(100))
    found = read(model(several + link("l"), "", COLLIDE), True)
    assert [body.name for body in found.scene.bodies] == ["m"] and len(found.dropped) == 200
    assert {line.partition(": its")[0].partition(": has")[0] for line in found.dropped} == {
        f"line 1: <link> '{name}{n}'" for n in range(100) for name in "kh"
    }


@pytest.mark.parametrize("name", ["door.sdf", "include.world", "mesh.sdf", "bounce.sdf"])
def test_refused_models_run_with_the_remaining_elements(name):
    text = (MODELS / f"refused_{name}").read_text()
    with pytest.raises(SceneError, match=r"model: line \d+: <\w+>"):
        read(text, False)
    left = read(text, True)
    assert [body.motion for body in left.scene.bodies] == ["free"] and left.dropped
    assert (left.scene.bodies[0].mass, left.scene.bodies[0].inertia) == (1.0, (1.0, 1.0, 1.0))
    assert sum("the default of SDF, the model states none" in note for note in left.notes) >= 2


def test_contacts_between_links_of_a_model():
    both = link("l") + link("k", INERTIAL + BALL + COLLIDE)
    assert len(read(model(both), False).scene.bodies) == 2
    with pytest.raises(SceneError, match="do not collide with each other"):
        read(model(both + link("i")), False)
    # What is fixed need not touch what is fixed.
    read(model(link("l") + link("k") + link("i", INERTIAL + BALL + COLLIDE),
               fixed("world", "l") + fixed("world", "k").replace("'j'", "'h'")), False)  # fmt: skip


def test_axes_of_a_ball_by_its_inertia():
    moments = "<ixx>.01</ixx><iyy>.02</iyy><izz>.025</izz>"
    skewed = f"<inertial><pose>0 0 0 0 0 .7</pose><mass>1</mass><inertia>{moments}</inertia></inertial>"
    (ball,) = read(model(link("l", skewed + BALL)), False).scene.bodies
    assert ball.shape == Sphere(0.2) and sorted(ball.inertia) == pytest.approx([0.01, 0.02, 0.025], rel=1e-13)
    w, x, y, z = ball.pose[3:]
    turn = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])  # fmt: skip
    c, s = np.cos(0.7), np.sin(0.7)
    about = (
        np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        @ np.diag([0.01, 0.02, 0.025])
        @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    )
    assert turn @ np.diag(ball.inertia) @ turn.T == pytest.approx(about, abs=1e-16)


def test_sliding_friction_in_drake_solvers():
    text = (MODELS / "soft_surfaces.sdf").read_text().replace("<drake:mu_static>0.4", "<drake:mu_static>0.9")
    with pytest.raises(SceneError, match=r"friction 0\.9 and 0\.4 at rest and in motion"):
        read(text, False)
    left = read(text, True)
    assert left.scene == read((MODELS / "soft_surfaces.sdf").read_text(), False).scene


def test_model_read_in_another_process():
    text = (MODELS / "boxes_in_frames.sdf").read_text()
    assert read_apart("drake", ".sdf", text, False) == read(text, False)


def test_compliant_world_on_drake_and_elsewhere(tmp_path):
    pytest.importorskip("mujoco")
    words = ["--engine", "drake", "--engine", "mujoco", "--profile", "model", "--profile", "default", "--jobs", "1"]
    words += ["--param", "duration=0.2", "--out", str(tmp_path), "--json"]
    done = CliRunner().invoke(main, ["run", str(MODELS / "moon_slope.world"), *words])
    assert done.exit_code in (0, 1), done.output
    rows = json.loads(done.stdout)
    kinds = {(row["engine"], row["profile"], row["dimension"], row["dt"]) for row in rows}
    assert kinds == {(engine, profile, dimension, dt) for dimension in (2, 3) for engine, profile, dt in (
        ("drake", "model", 0.001), ("drake", "default", 1 / 240), ("mujoco", "default", 1 / 240))}  # fmt: skip
    assert {row["outcome"] for row in rows} == {"ok"}
    assert "drake/model runs it with the model's own contacts, solver and step" in done.stderr


def test_refused_model_in_one_line_without_a_run(tmp_path):
    out = tmp_path / "out"
    done = CliRunner().invoke(main, ["run", str(MODELS / "refused_door.sdf"), "--engine", "drake", "--out", str(out)])
    assert done.exit_code == 2 and not out.exists()
    (line,) = done.stderr.splitlines()
    assert "line 5: <joint> 'hinge': a revolute joint holds a link" in line


FUZZ = """
import json, logging, random, re, sys
logging.disable(logging.CRITICAL)
from adapters.drake.sdf import read
from adapters.scene import SceneError

texts, rng = json.load(open(sys.argv[1])), random.Random(7)
WORDS = ["nan", "inf", "-1", "0", "1e308", "-1e308", "1e-320", "2,5", "", "abc", "1 2 3", "0x10", "1e9999", "true",
         "::", "world", "__model__", "\\u202e", "&lt;", "9" * 400]
PIECES = ["<", ">", "/", "'", "&", "<a/>", "</link>", "<link>", "\\x00", "é"]

def broken(text):
    for _ in range(rng.choice([1, 1, 1, 2, 4])):
        kind = rng.randrange(6)
        at = rng.randrange(len(text))
        said = list(re.finditer(r">([^<>]+)<", text))
        tags = list(re.finditer(r"<(\\w+)", text))
        whole = list(re.finditer(r"<(\\w+)[^<>]*>[^<>]*</\\1>", text))
        if kind == 0:
            text = text[:at] + text[at + rng.randrange(1, 30):]
        elif kind == 1:
            text = text[:at] + rng.choice(PIECES) + text[at:]
        elif kind == 2 and said:
            m = rng.choice(said)
            text = text[:m.start(1)] + rng.choice(WORDS) + text[m.end(1):]
        elif kind == 3 and tags:
            a, b = rng.choice(tags)[1], rng.choice(tags)[1]
            text = text.replace("<" + a, "<" + b).replace("</" + a, "</" + b)
        elif kind == 4 and whole:
            m = rng.choice(whole)
            text = text[:m.start()] + text[m.end():]
        elif kind == 5 and whole:
            m = rng.choice(whole)
            text = text[:m.end()] + m[0] + text[m.end():]
    return text

made = {"read": 0, "refused": 0}
for number in range(300):
    text = broken(rng.choice(texts))
    for drop in (False, True):
        try:
            read(text, drop)
            made["read"] += 1
        except SceneError as error:
            made["refused"] += 1
            assert "\\n" not in str(error) and str(error).startswith("model: ") and len(str(error)) < 900, error
print(json.dumps(made))
"""


def test_three_hundred_broken_texts_refused_in_one_line(tmp_path):
    """In one process, which a radius that is no number would end: what comes out at the end counts them all."""
    seeds = [path.read_text() for path in MODELS.iterdir() if path.suffix in (".sdf", ".world")]
    (tmp_path / "seeds.json").write_text(json.dumps(sorted(seeds)))
    done = subprocess.run(
        [sys.executable, "-c", FUZZ, tmp_path / "seeds.json"], capture_output=True, text=True, cwd=ROOT
    )
    assert done.returncode == 0, done.stderr[-2000:]
    made = json.loads(done.stdout.splitlines()[-1])
    assert sum(made.values()) == 600 and min(made.values()) > 50
