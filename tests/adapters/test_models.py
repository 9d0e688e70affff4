"""MJCF models as scenes: what is read, what is refused by name, and that nothing reaches outside the text."""

from pathlib import Path

import numpy as np
import pytest

from adapters import registry
from adapters.model import Model, model_from_dict, read, reader_of
from adapters.scene import Box, HalfSpace, SceneError, Sphere
from adapters.scene.lift import lift, lowered
from adapters.scene.shapes import Capsule, Cylinder, Hull
from adapters.stepping import run
from adapters.trajectory import Sampling

mujoco = pytest.importorskip("mujoco")
from adapters.mujoco import model as reading  # noqa: E402  (it imports the engine, which may not be there)

MODELS = Path(__file__).parents[1] / "models"
READ = sorted(path for path in MODELS.glob("*.xml") if not path.name.startswith("refused"))
#: What each refused model has that no scene has a place for: the line, the element, its name.
REFUSED = {
    "refused_ellipsoid": "line 6: <geom>: an ellipsoid",
    "refused_hinge": "line 4: <body> 'door': a hinge joint",
    "refused_mesh_file": "line 3: <mesh> 'bunny': other files are not read",
    "refused_off_centre": "line 4: <body> 'weeble': its centre of mass",
    "refused_rolling_friction": "line 6: <geom>: with floor: condim 6",
    "refused_tendon": "line 11: <tendon>: a scene has no tendons",
    "refused_two_shapes": "line 4: <body> 'dumbbell': has several geoms",
    "refused_water": "line 2: <option>: density",
}


def model_of(body, head="", after=""):
    return f"<mujoco>{head}<worldbody>{body}</worldbody>{after}</mujoco>"


BALL = '<body name="ball" pos="0 0 1"><freejoint/><geom type="sphere" size=".1"/></body>'


def test_number_of_models_read():
    assert len(READ) >= 20 and len(READ) + len(REFUSED) >= 30
    assert {path.stem for path in MODELS.glob("refused*.xml")} == set(REFUSED)


@pytest.mark.parametrize("path", READ, ids=lambda path: path.stem)
def test_motion_of_a_model_against_mujoco(path):
    """Profile `model` against the file itself: places and speeds after 40 steps, contacts made and broken.

    The bound is round-off that contacts of stiffness 1/dt^2 amplify, 1e-9 of the motion, far below any softness.
    """
    found = reading.read(path.read_text(), False)
    m = mujoco.MjModel.from_xml_string(path.read_text())
    m.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    d = mujoco.MjData(m)
    if m.nkey:
        mujoco.mj_resetDataKeyframe(m, d, 0)
    steps = 300
    mujoco.mj_step(m, d, nstep=steps)
    mujoco.mj_kinematics(m, d)
    mujoco.mj_comPos(m, d)
    expected = {m.body(b).name: (d.xipos[b].copy(), d.qvel[m.body_dofadr[b]:][:3].copy()) for b in range(1, m.nbody)
                if m.body_dofnum[b]}  # fmt: skip
    scene = found.scene
    settings = {setting.name: setting.value for setting in found.settings}
    from dataclasses import replace

    scene = replace(scene, duration=steps * found.dt)
    ours = run(registry.load("mujoco"), scene, found.dt, settings, Sampling(steps))
    moving = [i for i, body in enumerate(scene.bodies) if body.motion == "free"]
    assert len(moving) == len(expected)
    for i in moving:
        name = scene.bodies[i].name
        place, speed = expected[name] if name in expected else list(expected.values())[moving.index(i)]
        assert np.abs(ours.pose[-1, i, :3] - place).max() < 1e-7, name
        assert np.abs(ours.twist[-1, i, :3] - speed).max() < 1e-6, name


@pytest.mark.parametrize("name", REFUSED)
def test_model_elements_refused_or_left_out_with_a_message(name):
    text = (MODELS / f"{name}.xml").read_text()
    with pytest.raises(SceneError) as refused:
        reading.read(text, False)
    assert REFUSED[name] in str(refused.value) and "\n" not in str(refused.value)
    if name == "refused_water":
        with pytest.raises(SceneError, match="neither wind nor water"):
            reading.read(text, True)
        return
    left = reading.read(text, True)
    assert len(left.dropped) == 1
    assert any(body.motion == "free" for body in left.scene.bodies)


@pytest.mark.parametrize(("text", "said"), [
    ('<!DOCTYPE m [<!ENTITY a "b">]><mujoco>&a;</mujoco>', "line 1: document types and entities are not read"),
    ('<!DOCTYPE m SYSTEM "file:///etc/passwd"><mujoco/>', "document types and entities are not read"),
    ("<mujoco>&a;</mujoco>", "is not XML"),
    ('<mujoco><include file="/etc/passwd"/></mujoco>', "<include>: other files are not read"),
    ('<mujoco><asset><model name="m" file="other.xml"/></asset></mujoco>', "<model> 'm': other models are not read"),
    ('<mujoco><extension><plugin plugin="p"/></extension></mujoco>', "<extension>: plugins are not loaded"),
    ('<mujoco><asset><hfield name="h" nrow="100000" ncol="100000" size="1 1 1 1"/></asset></mujoco>', "<hfield> 'h'"),
    (model_of(f'<replicate count="100000000">{BALL}</replicate>'), "are more than the 1000 that are read"),
    (model_of(f'<replicate count="99"><replicate count="99">{BALL}</replicate></replicate>'), "are more than the 1000"),
    (model_of(f'<replicate count="inf">{BALL}</replicate>'), "are more than the 1000"),
    ("<mujoco>" + "<body>" * 200, "nested deeper than 64"),
    ("<mujoco " + " ".join(f'a{k}="1"' for k in range(101)) + "/>", "<mujoco>: more than 100 attributes"),
    ("<robot/>", "begins with <mujoco>"),
    ("", "is not XML"),
    ("<mujoco/>", "has no free body"),
    (model_of("<geom type='sphere' size='1'/>"), "has no free body"),
    (model_of(BALL.replace("size=", "sise=")), "MuJoCo does not compile it"),
    (model_of(BALL.replace('name="ball"', 'name="a&#27;b"')), "is not XML"),
    (model_of(BALL.replace('name="ball"', 'name="a&#x202e;b"')), "cannot be a name"),
    (model_of(BALL, after="<made_up/>"), "<made_up>: a scene has no such element"),
    (model_of(BALL, after='<actuator><motor name="m" joint="j"/></actuator>'), "<actuator>: a scene has no motors"),
    (model_of(BALL.replace("<freejoint/>", '<joint type="free" damping="1"/>')), "has damping"),
    (model_of(BALL.replace("<freejoint/>", '<joint type="free" armature="1"/>')), "has armature"),
    (model_of(BALL.replace('pos=', 'gravcomp="1" pos=')), "gravcomp"),
    (model_of(BALL.replace('pos=', 'mocap="true" pos=').replace("<freejoint/>", "")), "<body> 'ball': mocap: "),
    (model_of(BALL.replace("</body>", "<body><geom size='.1' contype='0' conaffinity='0'/></body></body>")),
     "<body> 'ball': a body with a mass is fixed to it"),
    (model_of(BALL.replace("/></body>", ' contype="0" conaffinity="0"/></body>')), "has no geom that collides"),
    (model_of(BALL + '<geom type="plane" size="1 1 1" contype="2" conaffinity="2"/>'), "exclude contact with"),
    (model_of(BALL + '<geom type="plane" size="1 1 1" gap=".1"/>'), "gap: "),
    (model_of(BALL, head='<option><flag contact="disable"/></option>'), "<option>: contact: without it"),
    (model_of(BALL, head='<option><flag override="enable"/></option>'), "<option>: override: "),
])  # fmt: skip
def test_hostile_and_wrong_models_in_one_line(text, said):
    with pytest.raises(SceneError) as refused:
        reading.read(text, False)
    assert said in str(refused.value) and "\n" not in str(refused.value) and len(str(refused.value)) < 600


@pytest.mark.parametrize(("old", "new", "said"), [
    ('density="1"', 'mass="nan"', "line 3: <geom>: mass is not a number: nan"),
    ('size=".1"', 'size=".1 NaN"', "line 3: <geom>: size is not a number: .1 NaN"),
    ('pos="0 0 1"', 'pos="0 nan 1"', "line 2: <body> 'nan': pos is not a number: 0 nan 1"),
    ("<option/>", '<option timestep="0"/>', "its time step of 0 s must be positive"),
    ("<option/>", '<option timestep="-.01"/>', "its time step of -0.01 s must be positive"),
    ("<option/>", '<option gravity="0 0 nan"/>', "<option>: gravity is not a number"),
    ("<option/>", "<option/>", ""),
])  # fmt: skip
def test_nan_value_and_invalid_step_refused(old, new, said):
    """MuJoCo takes nan for a value that is not given: a body of mass nan would weigh what its density says."""
    text = (
        f'<mujoco><option/><worldbody>{PLANE}\n<body name="nan" pos="0 0 1"><freejoint/>\n'
        '<geom type="sphere" size=".1" density="1"/></body></worldbody></mujoco>'
    )
    try:
        found = reading.read(text.replace(old, new), True)
    except SceneError as error:
        assert said and said in str(error)
    else:
        assert said == "" and found.dt == 0.002


def test_line_in_the_compiler_s_complaint():
    with pytest.raises(SceneError, match=r"does not compile it: .*'sise'.* line 4"):
        reading.read(model_of("\n\n" + BALL.replace("<geom", "\n<geom").replace("size=", "\nsise=")), False)


@pytest.mark.parametrize("what", ["damping", "armature"])
@pytest.mark.parametrize("bad", [0, 1, 2])
def test_body_with_a_joint_other_than_free_named(what, bad):
    bodies = [BALL.replace('"ball" pos="0 0 1"', f'"{name}" pos="0 0 {k + 1}"') for k, name in enumerate("abc")]
    bodies[bad] = bodies[bad].replace("<freejoint/>", f'<joint type="free" {what}="1"/>')
    with pytest.raises(SceneError, match=f"<body> '{'abc'[bad]}': .*{what}"):
        reading.read(model_of("".join(bodies)), False)


def test_control_characters_in_names_not_printed():
    text = model_of(BALL.replace('name="ball"', 'name="a&#x9;b"'))
    with pytest.raises(SceneError, match="cannot be a name"):
        reading.read(text, False)


def test_other_files_beside_the_model_are_not_opened(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "other.xml").write_text(model_of(BALL))
    with pytest.raises(SceneError, match="other files are not read"):
        reading.read('<mujoco><worldbody><include file="other.xml"/></worldbody></mujoco>', True)


def test_masses_positions_and_rotations_of_the_compiler():
    text = model_of(
        '<frame pos="1 0 0" euler="0 0 90"><body name="box" pos="0 1 2"><freejoint/>'
        '<geom type="box" size=".1 .2 .3" density="500"/></body></frame>'
        '<geom name="wall" type="plane" size="1 1 1" pos="-3 0 0" euler="0 90 0"/>'
        '<geom name="stone" type="sphere" size=".5" pos="0 0 -4"/>'
    )
    bodies = {body.name: body for body in reading.read(text, False).scene.bodies}
    box, wall, stone = bodies["box"], bodies["wall"], bodies["stone"]
    assert box.mass == pytest.approx(500 * 0.2 * 0.4 * 0.6) and box.shape == Box((0.1, 0.2, 0.3))
    assert box.pose[:3] == pytest.approx((0.0, 0.0, 2.0))
    assert np.abs(box.pose[3:]) == pytest.approx((np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)))
    m = box.mass / 3.0
    assert box.inertia == pytest.approx((m * (0.04 + 0.09), m * (0.09 + 0.01), m * (0.01 + 0.04)))
    assert wall.shape == HalfSpace((1.0, 0.0, 0.0), -3.0) and wall.motion == "fixed"
    assert stone.shape == Sphere(0.5) and stone.pose[:3] == (0.0, 0.0, -4.0) and stone.motion == "fixed"


def test_speed_of_a_keyframe_at_the_centre_of_mass():
    """MuJoCo's free joint moves the body's origin, here .5 m below the centre of a ball that turns about x."""
    text = model_of(
        '<body name="ball"><freejoint/><geom type="sphere" size=".1" pos="0 0 .5"/></body>',
        after='<keyframe><key qpos="0 0 0 1 0 0 0" qvel="1 0 0 2 0 0"/></keyframe>',
    )
    found = reading.read(text, False)
    body = found.scene.bodies[0]
    assert any(note.startswith("ball: MuJoCo moves a body's origin") for note in found.notes)
    assert not any("origin" in note for note in reading.read(model_of(BALL), False).notes)
    assert body.pose[:3] == pytest.approx((0.0, 0.0, 0.5))
    assert body.twist == pytest.approx((1.0, -1.0, 0.0, 2.0, 0.0, 0.0))


def test_rods_lie_along_their_bodies_first_axis():
    text = model_of(
        '<body name="pill" pos="0 0 1" euler="0 60 0"><freejoint/><geom type="capsule" size=".1 .2"/></body>'
        '<body name="can" pos="2 0 1"><freejoint/><geom type="cylinder" size=".1 .2" mass="3"/></body>'
    )
    pill, can = reading.read(text, False).scene.bodies
    assert pill.shape == Capsule(0.2, 0.1) and can.shape == Cylinder(0.2, 0.1)
    for body, lean in ((pill, np.radians(60.0)), (can, 0.0)):
        w, x, y, z = body.pose[3:]
        axis = (1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y))
        assert axis == pytest.approx((np.sin(lean), 0.0, np.cos(lean)), abs=1e-15)
    across = 3.0 * (0.1**2 / 4.0 + 0.4**2 / 12.0)
    assert can.inertia == pytest.approx((3.0 * 0.1**2 / 2.0, across, across))
    assert lowered(reading.read(text, False).scene) is None and lowered(reading.read(
        text.replace("cylinder", "capsule"), False).scene) is not None  # fmt: skip


@pytest.mark.parametrize(("moments", "planar"), [(".05 .05 .01", True), (".05 .04 .01", False)])
def test_orientation_of_a_rod_with_round_moments(moments, planar):
    rod = (
        '<body pos="0 0 1" zaxis="1 0 0"><freejoint/><geom type="capsule" fromto="0 0 .2 0 0 -.2" size=".1"/>'
        f'<inertial pos="0 0 0" mass="1" diaginertia="{moments}" euler="0 0 20"/></body>'
    )
    if planar:
        assert lowered(reading.read(model_of(rod), False).scene) is not None
    else:
        with pytest.raises(SceneError, match="its principal axes are not its geom's"):
            reading.read(model_of(rod), False)


MESH = '<asset><mesh name="m" vertex="{}"{}/></asset>'
TETRAHEDRON = "0 0 0  1 0 0  0 1 0  0 0 1"
SOLID = '<body name="solid" pos="0 0 2"><freejoint/><geom type="mesh" mesh="m"/></body>'


def test_hull_of_a_mesh_of_vertices_alone():
    """Of a tetrahedron with a vertex within it: a sixth of a cube's volume, a quarter from each face."""
    (body,) = reading.read(model_of(SOLID, head=MESH.format(TETRAHEDRON + "  .1 .1 .1", "")), False).scene.bodies
    assert isinstance(body.shape, Hull) and len(body.shape.vertices) == 4
    assert body.mass == pytest.approx(1000.0 / 6.0, rel=1e-6)
    assert np.mean(body.shape.vertices, axis=0) == pytest.approx((0.0, 0.0, 0.0), abs=1e-7)
    assert body.pose[:3] == pytest.approx((0.25, 0.25, 2.25), abs=1e-7)
    assert sorted(np.linalg.norm(body.shape.vertices, axis=1)) == pytest.approx(
        [np.sqrt(3.0 / 16.0), *[np.sqrt(11.0 / 16.0)] * 3], rel=1e-6
    )


ROUND = " ".join(f"{np.cos(k)} {np.sin(k)} {z}" for k in range(33) for z in (0, 1))


@pytest.mark.parametrize(("vertices", "more", "head", "said"), [
    (TETRAHEDRON, ' face="0 2 1  0 1 3  0 3 2  1 2 3"', "", "<mesh> 'm': face: a scene has no meshes except"),
    (TETRAHEDRON, ' file="m.stl"', "", "<mesh> 'm': other files are not read"),
    (TETRAHEDRON, ' inertia="shell"', "", "<mesh> 'm': inertia: a scene has no meshes except convex hulls"),
    (TETRAHEDRON, "", '<default><mesh inertia="shell"/></default>', "<mesh>: inertia: a scene has no meshes"),
    (ROUND, "", "", "<geom>: its hull has 66 corners, a scene's 4 to 64"),
    ("0 0 0  1 0 0  0 1 0  1 1 0", "", "", "MuJoCo does not compile it"),
])  # fmt: skip
def test_refusal_of_a_mesh_that_is_no_hull(vertices, more, head, said):
    with pytest.raises(SceneError) as refused:
        reading.read(model_of(SOLID, head=head + MESH.format(vertices, more)), False)
    assert said in str(refused.value) and "\n" not in str(refused.value)


GEOMS = [
    ("", ""),
    ('friction=".2" condim="1"', 'friction=".7" condim="3"'),
    ('priority="1" friction=".2" condim="1" solref=".05 .5"', 'friction=".7" solref=".01 1"'),
    ('solref=".05 .5" solmix="3"', 'solref=".01 1" solimp=".5 .9 .01 .4 3"'),
    ('solmix="0" solref=".05 1"', 'solref=".01 1"'),
    ('solref="-100 -1"', 'solref="-300 -.5"'),
    ('solref="-100 -1"', 'solref=".02 1"'),
    ('margin=".01"', 'margin=".02"'),
]


@pytest.mark.parametrize(("first", "second"), GEOMS)
def test_contacts_combine_as_mujoco_combines_them(first, second):
    """Against the contact that MuJoCo itself makes of two spheres in overlap."""
    from adapters.mujoco.combination import contact_of

    spheres = "".join(
        f'<body pos="0 0 {z}"><freejoint/><geom type="sphere" size=".1" {more}/></body>'
        for z, more in ((0.0, first), (0.15, second))
    )
    m = mujoco.MjModel.from_xml_string(model_of(spheres))
    d = mujoco.MjData(m)
    mujoco.mj_forward(m, d)
    made, found = d.contact[0], contact_of(m, 0, 1, None)
    assert d.ncon == 1 and found.refusal == ""
    assert found.condim == made.dim
    assert found.friction == (pytest.approx(made.friction[0]) if made.dim > 1 else 0.0)
    assert found.softness[0] == pytest.approx(tuple(made.solref))
    assert found.softness[1] == pytest.approx(tuple(made.solimp))
    assert found.softness[3] == pytest.approx(made.includemargin)


def test_planar_model_as_a_planar_scene_and_back():
    found = {path.stem: lowered(reading.read(path.read_text(), False).scene) for path in READ}
    assert found["capsules"] is not None  # MuJoCo's `fromto` turns the rail about its axis, out of the plane
    assert found["box_tilted"] is not None and found["ball_in_tray"] is None and found["box_spinning"] is None
    for path in READ:
        flat, scene = found[path.stem], reading.read(path.read_text(), False).scene
        if flat is not None:
            for body, back in zip(scene.bodies, lift(flat).bodies, strict=True):
                assert back.pose == pytest.approx(body.pose, abs=1e-15)
                assert back.twist == pytest.approx(body.twist, abs=1e-15)
                if body.motion == "free":
                    assert back.mass == body.mass and back.inertia[1] == body.inertia[1]


@pytest.mark.parametrize("out", ["pos='0 .1 1'", "pos='0 0 1' euler='10 0 0'", "pos='0 0 1' euler='0 0 10'"])
def test_model_out_of_the_plane_not_planar(out):
    box = f"<body {out}><freejoint/><geom type='box' size='.1 .1 .1'/></body>"
    assert lowered(reading.read(model_of(box), False).scene) is None


def test_model_read_in_another_process():
    text = (MODELS / "soft_and_hard.xml").read_text()
    assert reader_of(".XML") == "mujoco" and reader_of(".toml") is None
    found = read("mujoco", ".xml", text, False)
    assert found == reading.read(text, False) == model_from_dict(found.as_dict())
    assert isinstance(found, Model)
    with pytest.raises(SceneError, match="<include>"):
        read("mujoco", ".xml", '<mujoco><include file="x"/></mujoco>', True)


BOX_AND_FLOOR = """<mujoco>{default}<worldbody>
<geom type="plane" size="5 5 .1"{floor}/>
<body pos="0 0 .5"><freejoint/>{inertial}<geom type="box" size=".5 .5 .5"{box}/></body>
</worldbody></mujoco>"""
INERTIAL = '<inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/>'


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({}, ["friction 1 of 2 geoms that state none", "density 1000 kg/m^3 of 1 geom that states neither"]),
        ({"floor": ' friction=".5"', "box": ' friction=".5"'}, ["density 1000 kg/m^3"]),
        ({"box": ' friction=".5" mass="1"'}, ["friction 1 of 1 geom that states none"]),
        ({"default": '<default><geom friction=".3" density="10"/></default>'}, []),
        ({"inertial": INERTIAL, "box": ' friction=".5"', "floor": ' friction=".5"'}, []),
    ],
)
def test_default_friction_and_density_of_a_model_told(given, said):
    text = BOX_AND_FLOOR.format(**{"default": "", "floor": "", "inertial": "", "box": ""} | given)
    notes = [note for note in reading.read(text, False).notes if note.startswith(("friction", "density"))]
    assert len(notes) == len(said)
    assert all(note.startswith(begin) for note, begin in zip(notes, said, strict=True))


PLANE = '<geom type="plane" size="5 5 .1" friction="1"/>'
OTHERS = [
    '<freejoint/><geom type="mesh" mesh="gone" friction="1"/>',
    '<freejoint/><geom type="hfield" hfield="gone"/>',
    '<freejoint/><geom type="box" size=".1 .1 .1" mass="0"/>',
    '<freejoint/><geom type="ellipsoid" size=".1 .2 .3"/>',
]


@pytest.mark.parametrize("other", OTHERS)
def test_no_massless_body_after_elements_are_left_out(other):
    """The mesh lies in a file that is not read: its geom goes with it, and the body that had nothing else."""
    text = (
        f'<mujoco><asset><mesh name="gone" file="a.stl"/></asset><worldbody>{PLANE}<body name="ball" pos="0 0 1">'
        f'<freejoint/><geom type="sphere" size=".1" density="1"/></body><body name="part" pos="1 0 1">{other}</body>'
        "</worldbody></mujoco>"
    )
    found = reading.read(text, True)
    assert [body.name for body in found.scene.bodies if body.motion == "free"] == ["ball"]
    assert any("'part'" in line for line in found.dropped)


def test_drop_option_named_in_a_refusal_only_where_it_helps():
    text = f'<mujoco><worldbody>{PLANE}<body><freejoint/><geom size=".1" density="1"/></body></worldbody>{{}}</mujoco>'
    with pytest.raises(SceneError, match=r"; run --drop leaves it out$"):
        read("mujoco", ".xml", text.format("<tendon/>"), False)
    with pytest.raises(SceneError, match=r"; run --drop leaves it out \(2 in all\)$"):
        read("mujoco", ".xml", text.format('<tendon/><equality><weld body1="a"/></equality>'), False)
    for drop in (False, True):  # nothing is left that moves
        with pytest.raises(SceneError) as caught:
            read("mujoco", ".xml", f"<mujoco><worldbody>{PLANE}</worldbody></mujoco>", drop)
        assert "--drop" not in str(caught.value)
