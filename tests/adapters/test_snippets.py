"""Cures to paste are what they claim: pasted into a plain model of the engine they change what they should."""

import pytest
from bare import pasted_mjcf, run, valued

from adapters import registry
from adapters.needs import needs
from adapters.scene import Body, Disc, HalfSpace, Pair, Scene, Sphere
from validation.posed import resolve

DT = 1.0 / 240.0


def drop(dimension, e, gravity=0.0):
    up = (0.0,) * (dimension - 1)
    pose = (*up, 1.0, 0.0) if dimension == 2 else (*up, 1.0, 1.0, 0.0, 0.0, 0.0)
    shape, inertia = (Disc(0.5), 0.125) if dimension == 2 else (Sphere(0.5), (0.1, 0.1, 0.1))
    twist = (0.0, -6.0, 0.0) if dimension == 2 else (0.0, 0.0, -6.0, 0.0, 0.0, 0.0)
    floor = Body("floor", HalfSpace((*up, 1.0)), motion="fixed")
    ball = Body("ball", shape, 1.0, inertia, pose, twist)
    return Scene("drop", 1, dimension, (floor, ball), (Pair(restitution=e, friction=0.0),), (*up, gravity), 1.0, {})


def changed(engine, scene):
    """Settings of `tuned`, and the names of those that are not as shipped."""
    shipped, tuned = (
        {s.name: s.value for s in engine.settings(profile, needs(scene), DT)} for profile in ("default", "tuned")
    )
    return tuned, [name for name, value in tuned.items() if shipped.get(name) != value]


@pytest.mark.parametrize("e", [0.0, 0.5, 0.8, 1.0])
def test_mjcf_rebound_with_and_without_the_pasted_lines(e):
    mujoco = pytest.importorskip("mujoco")
    scene = drop(3, e)
    paste = registry.load("mujoco").snippet(*changed(registry.load("mujoco"), scene), scene, DT)
    ratios = []
    step = f'<option timestep="{DT!r}"/>'
    for head, of in ((step + paste, f'class="{"rebounds" if e else "rests"}"'), (step, "")):
        body = (
            '<worldbody><geom type="plane" size="0 0 1"/><body pos="0 0 1"><freejoint/>'
            f'<geom {of} type="sphere" size=".5" mass="1"/></body></worldbody>'
        )
        model = mujoco.MjModel.from_xml_string(f"<mujoco>{head}{body}</mujoco>")
        model.opt.gravity[:] = 0.0
        data = mujoco.MjData(model)
        data.qvel[2] = -6.0
        for _ in range(240):
            mujoco.mj_step(model, data)
        ratios.append(data.qvel[2] / 6.0)
    assert ratios[0] == pytest.approx(e, abs=1e-3)
    assert abs(ratios[1] - e) > 0.05


def test_mjcf_of_a_scene_without_contacts_with_its_option_alone():
    pytest.importorskip("mujoco")
    scene = drop(3, 0.5)
    alone = Scene("alone", 1, 3, scene.bodies[1:], (), (0.0, 0.0, 0.0), 1.0, {})
    settings, names = changed(registry.load("mujoco"), scene)
    text = registry.load("mujoco").snippet(settings, [*names, "integrator"], alone, DT)
    assert text.startswith("<option ") and "integrator=" in text and len(text.splitlines()) == 1


def test_python_snippet_of_chipmunk():
    pymunk = pytest.importorskip("pymunk")
    scene = drop(2, 0.8, -9.81)
    settings, names = changed(registry.load("chipmunk"), scene)
    space = pymunk.Space()
    exec(registry.load("chipmunk").snippet(settings, names, scene, DT), {"space": space})
    assert names
    assert all(getattr(space, name) == pytest.approx(settings[name]) for name in names if name != "start_overlap")


def test_python_snippet_of_bullet():
    p = pytest.importorskip("pybullet")
    scene = drop(3, 0.8, -9.81)
    settings, names = changed(registry.load("bullet"), scene)
    text = registry.load("bullet").snippet(settings, names, scene, DT)
    client = p.connect(p.DIRECT)
    try:
        body = p.createMultiBody(1.0, p.createCollisionShape(p.GEOM_SPHERE, radius=0.5), useMaximalCoordinates=1)
        lines = [line for line in text.splitlines() if "..." not in line]
        assert f"useMaximalCoordinates={settings['useMaximalCoordinates']}" in text
        exec("\n".join(lines), {"p": p, "body": body})
        held = p.getPhysicsEngineParameters()
    finally:
        p.disconnect(client)
    assert held["warmStartingFactor"] == settings["warmStartingFactor"] if "warmStartingFactor" in held else True
    for name in names:
        assert name in text or name == "iterations"


@pytest.mark.parametrize(("scene", "said"), [("incline", True), ("impact", False), ("card_tent", True)])
def test_floor_of_a_bullet_cure_for_boxes(scene, said):
    """On an infinite plane of Bullet a box has one contact point a step: the fix of `incline` is 15 % off there."""
    pytest.importorskip("pybullet")
    text = registry.load("bullet").snippet({"iterations": 99}, ["iterations"], resolve(scene).scene(2, {}), DT)
    assert ("the floor a box" in text.splitlines()[0]) == said


def test_adapter_without_snippets_prints_nothing():
    from adapters.engine import Engine

    assert Engine.snippet(registry.load("chipmunk"), {}, [], drop(2, 0.5), DT) == ""


# ---- MuJoCo: materials, steps ----------------------------------------------------------------------------------------

#: A gripper as people have it: a wall, a load of 1 kg, and a pad that is pressed on by 1.05 of what holds it.
GRIPPER = """
<mujoco>{head}<worldbody>
 <geom name="wall" type="box" size=".1 .5 .5" pos="-.35 0 1" friction=".5 .005 .0001"/>
 <body name="load" pos="0 0 1"><freejoint/>
  <geom name="load" type="box" size=".25 .25 .25" mass="1" friction=".5 .005 .0001"/></body>
 <body name="pad" pos=".35 0 1"><joint name="p" type="slide" axis="1 0 0"/>
  <geom name="pad" type="box" size=".1 .5 .5" mass="4" friction=".5 .005 .0001"/></body>
</worldbody>{contact}
<actuator><general joint="p" gainprm="0" biastype="affine" biasprm="-10.3005 0 0"/></actuator></mujoco>
"""


def tuned_paste(scene, dt=DT):
    """What a user is given who asks for all that the tuned profile changes."""
    engine = registry.load("mujoco")
    shipped, tuned = ({s.name: s.value for s in engine.settings(p, needs(scene), dt)} for p in ("default", "tuned"))
    return engine.snippet(tuned, [name for name, value in tuned.items() if shipped.get(name) != value], scene, dt)


@pytest.mark.parametrize("step", [1 / 500, 1 / 240, 1 / 333])
def test_pasted_grip_with_the_friction_of_each_pair(step):
    """The smooth floor of the scene comes first: its lines must not be those of the pairs that grip."""
    mujoco = pytest.importorskip("mujoco")
    scene = resolve("pinch").scene(3, {"margin": 1.05})
    elements = pasted_mjcf(tuned_paste(scene))
    option = dict(elements[0].attrib) | {"timestep": repr(step)}
    (line,) = [one for one in elements[1] if one.get("friction").startswith("0.5 ")]
    valued(line, dt=step, g=9.81, e=0.0)
    lines = ""
    for finger in ("wall", "pad"):
        words = line.attrib | {"geom1": finger, "geom2": "load"}
        lines += "<pair " + " ".join(f'{name}="{value}"' for name, value in words.items()) + "/>"
    head = "<option " + " ".join(f'{name}="{value}"' for name, value in option.items()) + "/>"
    model = mujoco.MjModel.from_xml_string(GRIPPER.format(head=head, contact=f"<contact>{lines}</contact>"))
    data, heights = mujoco.MjData(model), []
    while data.time < 2.0:
        mujoco.mj_step(model, data)
        heights.append(data.body("load").xpos[2])
    # It creeps at (1 - d)/(d b n impratio) g (`adapters.mujoco.profiles`), below 1e-6 m/s; without friction it falls.
    assert abs(heights[-1] - heights[len(heights) // 2]) < 1e-5


@pytest.mark.parametrize("scene", ["pinch", "wedge", "pair_matrix", "ladder", "arch", "scales", "domino"])
def test_line_of_each_material(scene):
    """MuJoCo's explicit pairs take nothing from their geoms: one that states no friction has a friction of 1."""
    pytest.importorskip("mujoco")
    made = resolve(scene).scene(2, {})
    text = tuned_paste(made)
    lines = [one for element in pasted_mjcf(text) for one in element if one.tag == "pair"]
    for restitution, friction in made.materials():
        own = [one for one in lines if f"e = {restitution:g}, friction {friction:g}:" in one.get("said")]
        (line,) = own
        assert float(line.get("friction").split()[0]) == pytest.approx(friction, rel=1e-8)
        assert (line.get("condim") == "1") == (friction == 0.0)


@pytest.mark.parametrize("e", [0.3, 0.8, 1.0])
@pytest.mark.parametrize(("size", "step"), [(1.0, 1 / 500), (0.1, 1 / 500), (1.0, 1 / 90)])
def test_pasted_rebound_by_formula_and_by_number(e, size, step):
    pytest.importorskip("mujoco")
    scene = drop(3, e, -9.81)
    paste = tuned_paste(scene)
    assert f"the numbers are for e = {e:g}, dt = {DT:.9g} s;" in paste and "for others with e > 0: " in paste
    found = run("mujoco", scene, paste, size, 1.0, step)
    up = found.twist[:, 1, 2]
    k = int((up > 0.0).argmax())
    # Newton's law between the samples around the blow, to what gravity adds in the two steps of it.
    assert up[k] == pytest.approx(-e * up[k - 2], abs=2.0 * 9.81 * found.dt)
    # As if the numbers were those of any step.
    wrong = run("mujoco", scene, paste.replace("for others", ""), size, 1.0, step)
    assert abs(wrong.twist[k, 1, 2] - up[k]) > 0.1


def test_contact_classes_of_a_snippet_without_a_step():
    pytest.importorskip("mujoco")
    engine, scene = registry.load("mujoco"), drop(3, 0.8)
    settings, names = changed(engine, scene)
    text = engine.snippet(settings, names, scene, DT)
    assert 'class="rebounds" to geoms that rebound;' in text
    assert "timestep" not in text
    assert engine.snippet(settings, [], scene, DT) == ""
    rebounds, smooth = (one for one in pasted_mjcf(text)[1].iter("default") if one.get("class"))
    assert all(one.get("solref") == "0 -432" and "condim" not in one.attrib for one in rebounds if one.tag != "default")
    assert {one.get("condim") for one in smooth} == {"1"} and smooth.get("class") == "smooth"


def test_geom_with_friction_in_a_class_that_rebounds():
    """`condim="1"` takes all friction: it stands in a class that nobody gives to a body with friction."""
    mujoco = pytest.importorskip("mujoco")
    paste = tuned_paste(drop(3, 0.8))
    spins = []
    for name in ("rebounds", "smooth"):
        model = mujoco.MjModel.from_xml_string(
            f'<mujoco>{paste}<worldbody><geom type="plane" size="0 0 1"/><body pos="0 0 1"><freejoint/>'
            f'<geom class="{name}" type="sphere" size=".1" mass="1" friction=".5"/></body></worldbody></mujoco>'
        )
        data = mujoco.MjData(model)
        model.opt.timestep, data.qvel[0] = DT, 2.0
        while data.time < 0.6:
            mujoco.mj_step(model, data)
        assert data.qvel[2] > 1.0
        spins.append(data.qvel[4])
    assert spins[0] > 10.0 and spins[1] == 0.0


def test_a_start_overlap_of_chipmunk_has_its_formula():
    pytest.importorskip("pymunk")
    scene = drop(2, 0.0, -9.81)
    engine = registry.load("chipmunk")
    settings, names = changed(engine, scene)
    text = engine.snippet(settings, names, scene, DT)
    assert text.endswith("# bodies that touch start 0.3*g*dt^2 deep in each other, in units of your space")
    assert engine.words(settings | {"start_overlap": 1e-5}, scene, DT)["start_overlap"][1] == 1e-5
