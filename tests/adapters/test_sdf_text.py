"""The text of SDF models, before Drake's parser sees it: no Drake is needed for any of this."""

import re
from itertools import pairwise
from pathlib import Path

import pytest
from click.testing import CliRunner

from adapters import registry
from adapters.drake.markup import GRAVITY, STEP, cleaned, told
from adapters.isolation.foreign import Found
from adapters.model import ReaderMissing, read, reader_of
from adapters.model.markup import parsed, text_of
from adapters.scene import SceneError
from reports.command import main, statuses

MODELS = Path(__file__).parents[1] / "models"
INERTIAL = "<inertial><mass>2</mass><inertia><ixx>.1</ixx><iyy>.1</iyy><izz>.1</izz></inertia></inertial>"
BALL = "<collision name='c'><geometry><sphere><radius>.2</radius></sphere></geometry></collision>"
MESH = "<collision name='d'><geometry><mesh><uri>/etc/passwd</uri></mesh></geometry></collision>"


def model(inside=f"{INERTIAL}{BALL}", beside="", about=""):
    return f"<sdf version='1.9'><model name='m'>{about}<link name='l'>{inside}</link>{beside}</model></sdf>"


def world(inside):
    return f"<sdf version='1.9'><world name='w'>{inside}</world></sdf>"


def state(text, drop=False):
    root = parsed(text, "sdf", "a model of SDF begins with <sdf>")
    return root, cleaned(root, drop)


def with_surface(inside):
    return model(BALL.replace("</collision>", f"<surface>{inside}</surface></collision>"))


def with_friction(inside):
    return with_surface(f"<friction><ode>{inside}</ode></friction>")


def joint(kind):
    return f"<link name='k'/><joint name='j' type='{kind}'><parent>l</parent><child>k</child></joint>"


#: What is refused, and with ``--drop`` either left out, in one line that begins alike, or refused as well (False).
REFUSED = [
    (model(beside=joint("revolute")), "<joint> 'j': a revolute joint holds a link", True),
    (model(beside=joint("ball")), "<joint> 'j': a ball joint holds a link", True),
    (model(beside="<plugin name='p' filename='evil.so'/>"), "<plugin> 'p': plugins are not loaded", True),
    (world("<include><uri>model://x</uri></include>"), "<include>: other files are not read", True),
    (world("<include><uri>file:///etc/passwd</uri></include>"), "<include>: other files are not read", True),
    (world("<actor name='a'/>"), "<actor> 'a': a scene has no scripted bodies", True),
    (world("<state world_name='w'/>"), "<state>: a saved state is not read", True),
    (model(INERTIAL + BALL + MESH), "<mesh>: a scene has no meshes", True),
    (model(INERTIAL + BALL + MESH.replace("mesh>", "heightmap>")), "<heightmap>: a scene has no height fields", True),
    (model(INERTIAL + BALL + MESH.replace("mesh>", "ellipsoid>")), "<ellipsoid>: a scene has spheres", True),
    (model(INERTIAL + BALL + "<gravity>false</gravity>"), "<gravity>: in a scene gravity acts on all bodies", True),
    (model(INERTIAL + BALL + "<kinematic>1</kinematic>"), "<kinematic>: bodies of a scene are free or fixed", True),
    (model(INERTIAL + BALL + "<velocity_decay><linear>.1</linear></velocity_decay>"), "<linear>: a scene's", True),
    (model(about="<enable_wind>true</enable_wind>"), "<enable_wind>: a scene has neither wind", True),
    (model(about="<model name='n'><link name='l'/></model>"), "<model> 'n': models inside models", True),
    (with_surface("<bounce><restitution_coefficient>.5</restitution_coefficient></bounce>"), "no coefficient", True),
    (with_surface("<contact><ode><kp>1e5</kp></ode></contact>"), "<contact>: contact elements of Gazebo", True),
    (with_surface("<friction><torsional/></friction>"), "<torsional>: a scene has no torsional friction", True),
    (with_friction("<mu>.5</mu><mu2>.4</mu2>"), "<ode>: friction 0.5 and 0.4 in two directions", True),
    (with_friction("<mu>.5</mu>"), "<ode>: friction 0.5 and 1 in two directions", True),
    (with_friction("<slip1>.1</slip1>"), "<slip1>: a scene has Coulomb friction only", True),
    (model(BALL + "<made_up/>"), "<made_up>: a scene has no such element", True),
    (model(BALL.replace("<radius>.2", "<radius>nan")), "<radius>: 'nan' is not a finite number", False),
    (model(BALL.replace("<radius>.2", "<radius>2,5")), "<radius>: '2,5' is not a finite number", False),
    (model(BALL.replace("<radius>.2", "<radius>2 m")), "<radius>: 'm' is not a finite number", False),
    (model(BALL.replace("<radius>.2", "<radius>1e999")), "<radius>: '1e999' is not a finite number", False),
    (model(BALL.replace("<radius>.2", "<radius>1_0")), "<radius>: '1_0' is not a finite number", False),
    (model(BALL.replace("<radius>.2", "<radius>-1")), "<radius>: '-1' must be greater than 0", False),
    (model(BALL.replace("<radius>.2", "<radius>0")), "<radius>: '0' must be greater than 0", False),
    (model(BALL.replace("<radius>.2", "<radius>")), "<radius>: has 0 numbers, needs 1", False),
    (model(BALL.replace("<radius>.2</radius>", "")), "<sphere>: has no <radius>", False),
    (model(BALL.replace("<radius>.2", "<radius><x/>.2")), "<x>: a scene has no such element", True),
    (model(BALL.replace("<sphere>", "<box><size>1 1 1</size></box><sphere>")), "<sphere>: is a second shape", False),
    (model("<collision name='c'><geometry/></collision>"), "<geometry>: has no shape", False),
    (model("<collision name='c'/>"), "<collision> 'c': has no <geometry>", False),
    (model(INERTIAL.replace("<mass>2</mass>", "<mass>2</mass><mass>3</mass>")), "<mass>: is given twice in", False),
    (model(INERTIAL.replace("<mass>2", "<mass>0")), "<mass>: '0' must be greater than 0", False),
    (model(INERTIAL.replace("<ixx>.1", "<ixx>.21")), "<inertia>: a body cannot have principal", False),
    (model(INERTIAL.replace("</izz>", "</izz><ixy>.11</ixy>")), "<inertia>: a body cannot have principal", False),
    (model(INERTIAL.replace("<inertial>", "<inertial auto='true'>") + BALL), "attribute 'auto' is not read", False),
    (model("<pose>0 0 1</pose>"), "<pose>: has 3 numbers, needs 6 or 7", False),
    (model("<pose frame='x'>0 0 0 0 0 0</pose>"), "<pose>: its attribute 'frame' is not read", False),
    (model(about="<static>maybe</static>"), "<static>: 'maybe' is neither true nor false", False),
    (model(beside="<joint name='j' type='fixed'><parent>l</parent></joint>"), "'j': has no <child>", False),
    (model(about="<frame name='b&#x202e;l'/>"), "cannot be a name", False),
    (world("<gravity>0 0 g</gravity>"), "<gravity>: 'g' is not a finite number", False),
    (world("<gravity>0 0</gravity>"), "<gravity>: has 2 numbers, needs 3", False),
    (world("<physics><max_step_size>0</max_step_size></physics>"), "<max_step_size>: '0' must be greater", False),
    ("<sdf version='1.9'>" + "<model/>" * 1 + "<link/>" * 1001 + "</sdf>", "are more than the 1000", False),
    ("<sdf/>", "<sdf>: states no version of SDF", False),
    ("<sdf version='latest'/>", "<sdf>: states no version of SDF", False),
    ("<robot/>", "a model of SDF begins with <sdf>", False),
    ('<!DOCTYPE s [<!ENTITY a "b">]><sdf>&a;</sdf>', "document types and entities are not read", False),
    ('<!DOCTYPE s SYSTEM "file:///etc/passwd"><sdf/>', "document types and entities are not read", False),
    ("<sdf version='1.9'>" + "<model>" * 100, "nested deeper than 64", False),
    ("", "is not XML", False),
]  # fmt: skip


@pytest.mark.parametrize(("text", "said", "left"), REFUSED, ids=[said[:40] for _, said, _ in REFUSED])
def test_sdf_text_refused_in_one_line_or_left_out_with_a_message(text, said, left):
    with pytest.raises(SceneError) as refused:
        state(text)
    assert said in str(refused.value) and "\n" not in str(refused.value) and len(str(refused.value)) < 600
    if left:
        assert re.match(r"model: line \d+: <", str(refused.value))
        _, stated = state(text, True)
        (line,) = stated.dropped
        assert said in line
    else:
        with pytest.raises(SceneError, match=re.escape(said)):
            state(text, True)


def test_line_numbers_of_the_text():
    text = model(beside="\n\n  <!-- two\n lines -->\n  <plugin\n name='p'/>")
    with pytest.raises(SceneError, match="line 5: <plugin> 'p'"):
        state(text)


def test_text_for_drake_with_the_same_lines():
    text = (MODELS / "boxes_in_frames.sdf").read_text()
    root, _ = state(text)
    handed = text_of(told(root))
    for number, line in enumerate(handed.splitlines(), 1):
        for tag in re.findall(r"<(\w+)", line):
            assert f"<{tag}" in text.splitlines()[number - 1]
    again, _ = state(handed)
    assert text_of(told(again)) == handed
    assert "gravity" not in handed and "self_collide" not in handed and 'relative_to="desk"' in handed


@pytest.mark.parametrize(("text", "gravity", "step"), [
    (model(), GRAVITY, STEP),
    (world(""), GRAVITY, STEP),
    (world("<gravity>0 0 -1.62</gravity>"), (0.0, 0.0, -1.62), STEP),
    (world("<gravity>0 -0 0</gravity>"), (0.0, 0.0, 0.0), STEP),
    (world("<physics><gravity>1 2 3</gravity><max_step_size>.01</max_step_size></physics>"), (1, 2, 3), 0.01),
    (world("<physics><max_step_size>.01</max_step_size></physics><physics default='true'><max_step_size>.02"
           "</max_step_size></physics>"), GRAVITY, 0.02),
    (world("<physics><real_time_factor>1</real_time_factor><ode/></physics>"), GRAVITY, STEP),
])  # fmt: skip
def test_gravity_and_step_of_the_world_or_sdf_defaults(text, gravity, step):
    _, stated = state(text)
    assert (stated.gravity, stated.step) == (gravity, step) and stated.dropped == []
    assert [note.partition(":")[0] for note in stated.notes] == ["gravity 9.8 m/s^2 downwards"] * (gravity is GRAVITY)


def test_visual_elements_ignored():
    drawn = "<visual name='v'><geometry><mesh><uri>/etc/passwd</uri></mesh></geometry></visual><sensor name='s'/>"
    idle = "<gravity>1</gravity><kinematic>false</kinematic><velocity_decay><linear>0.0</linear></velocity_decay>"
    root, stated = state(model(INERTIAL + BALL + drawn + idle))
    assert stated.dropped == [] and {e.tag for e in told(root).walk()}.isdisjoint(
        ("visual", "sensor", "mesh", "gravity", "kinematic", "velocity_decay")
    )


def test_moments_of_a_flat_body():
    state(model(INERTIAL.replace("<izz>.1", "<izz>.2")))


def test_single_friction_value_stated_twice():
    root, _ = state(with_friction("<mu>.25</mu><mu2>.25</mu2>"))
    (ode,) = (e for e in root.walk() if e.tag == "ode")
    assert [(e.tag, e.text) for e in ode.children] == [("mu", "0.25"), ("mu2", "0.25")]
    root, stated = state(with_friction("<mu>.25</mu>"), True)
    (ode,) = (e for e in root.walk() if e.tag == "ode")
    assert [e.text for e in ode.children] == ["0.25", "0.25"] and stated.dropped[0].endswith("; <mu2>")


def test_elements_below_a_dropped_joint_dropped():
    names = ["l", *(f"k{n}" for n in range(400))]
    chain = "".join(
        f"<link name='{b}'/><joint name='j{b}' type='{'prismatic' if a == 'l' else 'fixed'}'><parent>{a}</parent>"
        f"<child>{b}</child></joint>"
        for a, b in pairwise(names)
    )
    root, stated = state(model(beside=chain + "<link name='other'/>"), True)
    assert [e.attributes["name"] for e in root.walk() if e.tag == "link"] == ["l", "other"]
    assert len(stated.dropped) == 1 and not any(e.tag == "joint" for e in root.walk())


# ---- without Drake ---------------------------------------------------------------------------------------------------


@pytest.fixture
def no_drake(monkeypatch):
    """As where the extra is not installed."""
    real, reason = registry.find, "No module named 'pydrake'; pip install 'drake<1.52'"

    def find(name):
        return Found(name, None, "", reason, registry.facts(name)) if name == "drake" else real(name)

    monkeypatch.setattr(registry, "find", find)


@pytest.mark.usefixtures("no_drake")
def test_message_and_status_without_drake(tmp_path):
    assert reader_of(".SDF") == reader_of(".world") == "drake"
    with pytest.raises(ReaderMissing, match=r"\.sdf is read by drake, which is not installed"):
        read("drake", ".sdf", model(), False)
    done = CliRunner().invoke(main, ["run", str(MODELS / "ball_dropped.sdf"), "--out", str(tmp_path / "out")])
    assert done.exit_code == statuses.INCOMPLETE
    (line,) = done.stderr.splitlines()
    assert "pip install 'drake<1.52'" in line and not (tmp_path / "out").exists()
