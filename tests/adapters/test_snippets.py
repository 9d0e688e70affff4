"""Cures to paste are what they claim: pasted into a plain model of the engine they change what they should."""

import pytest

from adapters import registry
from adapters.needs import needs
from adapters.scene import Body, Disc, HalfSpace, Pair, Scene, Sphere

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
def test_mjcf_rebounds_as_asked_where_the_same_model_without_it_does_not(e):
    mujoco = pytest.importorskip("mujoco")
    scene = drop(3, e)
    paste = registry.load("mujoco").snippet(*changed(registry.load("mujoco"), scene), scene, DT)
    body = (
        '<worldbody><geom type="plane" size="0 0 1"/><body pos="0 0 1"><freejoint/>'
        '<geom type="sphere" size=".5" mass="1"/></body></worldbody>'
    )
    ratios = []
    for head in (paste, f'<option timestep="{DT!r}"/>'):
        model = mujoco.MjModel.from_xml_string(f"<mujoco>{head}{body}</mujoco>")
        model.opt.gravity[:] = 0.0
        data = mujoco.MjData(model)
        data.qvel[2] = -6.0
        for _ in range(240):
            mujoco.mj_step(model, data)
        ratios.append(data.qvel[2] / 6.0)
    assert ratios[0] == pytest.approx(e, abs=1e-3)
    assert abs(ratios[1] - e) > 0.05


def test_mjcf_of_a_scene_in_which_nothing_meets_has_its_option_alone():
    pytest.importorskip("mujoco")
    scene = drop(3, 0.5)
    alone = Scene("alone", 1, 3, scene.bodies[1:], (), (0.0, 0.0, 0.0), 1.0, {})
    settings, names = changed(registry.load("mujoco"), scene)
    text = registry.load("mujoco").snippet(settings, [*names, "integrator"], alone, DT)
    assert text.startswith("<option ") and "integrator=" in text and len(text.splitlines()) == 1


def test_python_of_chipmunk_runs_and_sets_what_the_profile_has():
    pymunk = pytest.importorskip("pymunk")
    scene = drop(2, 0.8, -9.81)
    settings, names = changed(registry.load("chipmunk"), scene)
    space = pymunk.Space()
    exec(registry.load("chipmunk").snippet(settings, names, scene, DT), {"space": space})
    assert names
    assert all(getattr(space, name) == pytest.approx(settings[name]) for name in names if name != "start_overlap")


def test_python_of_bullet_runs_and_sets_what_the_profile_has():
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


def test_an_adapter_without_such_words_says_nothing():
    from adapters.engine import Engine

    assert Engine.snippet(registry.load("chipmunk"), {}, [], drop(2, 0.5), DT) == ""
