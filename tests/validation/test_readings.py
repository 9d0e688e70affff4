"""What engines say of contact forces is judged by momentum; every planted fault of a reading fails."""

import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from adapters.engine_folder import force_script_of, readings_of
from adapters.readings import Heard, Read
from adapters.registry import find, load
from validation.questions.kept_readings import PROFILES, known_of
from validation.questions.readings import RIGHT, SITUATIONS, STOPPED, WRONG, causes_of, got, judge, measured, posed

OURS = [
    *("mujoco", "bullet", "chipmunk"),
    *(
        pytest.param(name, marks=pytest.mark.optional(name))
        for name in ("box2d", "box2d3", "rapier", "dart", "physx", "drake", "newton", "box3d", "motrixsim")
    ),
]
WITH_SCRIPT = [each for each in OURS if each != "box2d3" and getattr(each, "values", ("",))[0] != "box2d3"]
DT = 1.0 / 240.0


def made_up(situation):
    """A run of made-up bodies, two steps touching and one not in every three, and a reading that is true of it."""
    scene = posed(situation, 2)[0]
    rng, n, steps = np.random.default_rng(7), len(scene.bodies), 30
    twist, pose = np.zeros((steps + 1, n, 3)), np.zeros((steps + 1, n, 3))
    pose[:] = [body.pose for body in scene.bodies]
    free = [k for k, body in enumerate(scene.bodies) if body.motion == "free"]
    loads = {k: scene.bodies[k].mass * np.array(scene.gravity) + scene.bodies[k].force for k in free}
    pushes = {pair: rng.uniform(0.5, 1.0, (steps, 2)) for pair in situation.pairs(np.zeros((1, n, 2)))}
    if situation.name == "grip":  # the pad touches the smooth floor as well, which is no neighbour of the box
        pushes[0, 3] = rng.uniform(0.5, 1.0, (steps, 2)) * (0.0, 1.0)
    for push in pushes.values():
        push[::3] = 0.0
    read = [[[] for _ in range(n)] for _ in range(steps)]
    for (a, b), push in pushes.items():
        for step in range(steps):
            read[step][b].append(Read(a, push[step]))
            read[step][a].append(Read(b, -push[step]))
    for k in free:
        for step in range(steps):
            gained = sum((one.impulse for one in read[step][k]), loads[k] * DT)
            twist[step + 1, k, :2] = twist[step, k, :2] + gained / scene.bodies[k].mass
    return scene, Heard(pose, twist, read, DT), {k: np.ones_like for k in free}


def spoilt(run, change):
    """The run with another reading: ``change`` of the step, the body and what was read."""
    return replace(run, read=[[change(s, b, told) for b, told in enumerate(step)] for s, step in enumerate(run.read)])


def scaled(by):
    return lambda step, body, told: [replace(one, impulse=by @ one.impulse) for one in told]


FAULTS = {
    "1 % more": scaled(1.01 * np.eye(2)),
    "1 % less": scaled(0.99 * np.eye(2)),
    "both bodies of a contact added up": scaled(2.0 * np.eye(2)),
    "a force in place of an impulse": scaled(np.eye(2) / DT),
    "friction the other way": scaled(np.diag([-1.0, 1.0])),
    "the other sign": scaled(-np.eye(2)),
    "axes of the contact": scaled(np.array([[0.0, 1.0], [-1.0, 0.0]])),
    "one of four substeps": scaled(0.25 * np.eye(2)),
    "no number": scaled(math.nan * np.eye(2)),
}


@pytest.mark.parametrize("situation", SITUATIONS, ids=lambda each: each.name)
def test_a_true_reading_is_right(situation):
    scene, run, keeps = made_up(situation)
    assert judge(situation, scene, run, "vector", keeps).verdict == RIGHT


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("situation", [s for s in SITUATIONS if not s.flies], ids=lambda each: each.name)
def test_a_planted_fault_of_a_reading_fails(situation, fault):
    scene, run, keeps = made_up(situation)
    assert judge(situation, scene, spoilt(run, FAULTS[fault]), "vector", keeps).verdict == WRONG


@pytest.mark.parametrize("situation", [s for s in SITUATIONS if not s.flies], ids=lambda each: each.name)
def test_error_where_forces_on_a_body_cancel(situation):
    scene, run, keeps = made_up(situation)
    more = spoilt(run, scaled(1.25 * np.eye(2)))
    assert judge(situation, scene, more, "vector", keeps).off == pytest.approx(0.25)


@pytest.mark.parametrize("situation", [s for s in SITUATIONS if not s.flies], ids=lambda each: each.name)
def test_action_against_reaction(situation):
    scene, run, keeps = made_up(situation)
    fixed = [k for k, body in enumerate(scene.bodies) if body.motion == "fixed"]
    alike = spoilt(run, lambda step, body, told: scaled(-np.eye(2))(step, body, told) if body in fixed else told)
    told = judge(situation, scene, alike, "vector", keeps)
    assert told.verdict == WRONG and told.where.partition(" from ")[0].removeprefix("on ") in ("floor", "wall")


@pytest.mark.parametrize("situation", SITUATIONS, ids=lambda each: each.name)
def test_a_reading_that_is_one_step_late_fails(situation):
    scene, run, keeps = made_up(situation)
    late = replace(run, read=[run.read[-1], *run.read[:-1]])
    assert judge(situation, scene, late, "vector", keeps).verdict == WRONG


@pytest.mark.parametrize("situation", [s for s in SITUATIONS if not s.flies], ids=lambda each: each.name)
def test_a_reading_of_another_body_fails(situation):
    scene, run, keeps = made_up(situation)
    others = replace(run, read=[[*step[1:], step[0]] for step in run.read])
    assert judge(situation, scene, others, "vector", keeps).verdict == WRONG


@pytest.mark.parametrize("situation", [s for s in SITUATIONS if not s.flies], ids=lambda each: each.name)
def test_reading_wrong_in_one_step(situation):
    scene, run, keeps = made_up(situation)
    once = spoilt(run, lambda step, body, told: told[:-1] if step == 4 else told)
    told = judge(situation, scene, once, "vector", keeps)
    assert (told.verdict, told.wrong, told.steps) == (WRONG, 1, 30)
    lost = max(np.abs(each[-1].impulse).max() for each in run.read[4] if each)
    assert told.most == pytest.approx(lost / run.dt) and judge(situation, scene, run, "vector", keeps).most is None


def test_a_force_in_flight_fails():
    flight = next(each for each in SITUATIONS if each.flies)
    scene, run, keeps = made_up(flight)

    def kept(step, body, told):
        return told if any(one.impulse.any() for one in told) else [Read(1 - body, np.array([0.0, 0.02]))]

    stale = spoilt(run, kept)
    assert judge(flight, scene, stale, "vector", keeps).verdict == WRONG


def test_a_reading_of_normal_parts_needs_no_friction():
    sliding = next(each for each in SITUATIONS if each.name == "sliding")
    scene, run, keeps = made_up(sliding)
    normal = spoilt(run, scaled(np.diag([0.0, 1.0])))
    assert judge(sliding, scene, normal, "normal", keeps).verdict == RIGHT
    told = judge(sliding, scene, normal, "vector", keeps)
    assert told.verdict == WRONG and told.where == "friction is not in it"
    assert judge(sliding, scene, spoilt(normal, scaled(1.01 * np.eye(2))), "normal", keeps).verdict == WRONG


def test_a_resultant_off_its_place_fails():
    slope = next(each for each in SITUATIONS if each.placed)
    scene, run, keeps = made_up(slope)
    way = slope.placed(scene)
    assert way == pytest.approx(0.5 * math.tan(math.atan(0.25)))
    for off, verdict in ((0.0, RIGHT), (0.01, WRONG)):
        point = np.array([way + off, 0.0])
        placed = spoilt(run, lambda step, body, told, at=point: [replace(one, point=at) for one in told])
        assert judge(slope, scene, placed, "vector", keeps).verdict == verdict
    body_axes = spoilt(run, lambda step, body, told: [replace(one, point=np.array([way, -0.5])) for one in told])
    assert judge(slope, scene, body_axes, "vector", keeps).where == "its points do not lie on the floor"


def test_the_momentum_of_damped_bodies_is_no_impulse():
    flight = next(each for each in SITUATIONS if each.flies)
    scene, run, _ = made_up(flight)
    still = np.zeros_like(run.twist)
    still[:, 1, 0] = 0.9 ** np.arange(len(still))
    fall = scene.bodies[1].mass * np.array(scene.gravity) * DT
    found = got(scene, replace(run, twist=still), {1: lambda speeds: np.full_like(speeds, 0.9)})
    assert np.abs(found[:, 1] + fall).max() < 1e-12


@pytest.mark.parametrize("engine", OURS)
def test_kept_readings_complete_and_explained(engine):
    known = known_of(engine)
    calls = {reading.call: reading for reading in readings_of(engine)}
    profiles = [name for name in map(load(engine).facts.profile, PROFILES) if name]
    cells = {(each.call, each.profile, each.judged.situation) for each in known}
    assert cells == {(call, profile, s.name) for call in calls for profile in profiles for s in SITUATIONS}
    for each in known:
        if each.judged.verdict == WRONG:
            assert causes_of(calls[each.call], each.profile, each.judged.situation), each


@pytest.mark.parametrize("engine", OURS)
def test_release_of_the_kept_table(engine):
    """As shipped, of the first call; all of it with CROSSCHECK_ALL=1 by `crosscheck forces ENGINE --keep`."""
    loaded, first = load(engine), readings_of(engine)[0]
    known = [each for each in known_of(engine) if each.call == first.call]
    assert {each.version for each in known} == {find(engine).version}
    shipped = loaded.facts.profile("shipped")
    for each in known:
        if each.profile == shipped:
            situation = next(s for s in SITUATIONS if s.name == each.judged.situation)
            assert measured(loaded, shipped, first, situation).verdict == each.judged.verdict, each


@pytest.mark.parametrize("engine", OURS)
def test_settings_that_switch_off_a_cause(engine):
    """Where a cause is the only one, the reading is wrong without its settings and right with them."""
    loaded, tried = load(engine), 0
    for each in known_of(engine):
        reading = next(r for r in readings_of(engine) if r.call == each.call)
        causes = causes_of(reading, each.profile, each.judged.situation)
        if each.judged.verdict == WRONG and len(causes) == 1 and causes[0].set:
            situation = next(s for s in SITUATIONS if s.name == each.judged.situation)
            found = measured(loaded, each.profile, reading, situation, causes[0].set)
            assert found.verdict in (RIGHT, STOPPED), (each, found)
            tried += 1
    assert tried or engine not in ("mujoco", "bullet", "chipmunk", "box2d")


@pytest.mark.parametrize(("threshold", "rightly"), [(0.0, True), (None, False)])
def test_force_of_bullet_points_apart(threshold, rightly):
    """To skip points apart is right for a threshold of 0; as shipped it loses forces of every landing and rest."""
    p = pytest.importorskip("pybullet")
    client = p.connect(p.DIRECT)
    try:
        p.setGravity(0, 0, -9.81, physicsClientId=client)
        floor, ball = (p.createCollisionShape(kind, physicsClientId=client, **size) for kind, size in (
            (p.GEOM_BOX, {"halfExtents": [9.0, 9.0, 1.0]}), (p.GEOM_SPHERE, {"radius": 0.5})))  # fmt: skip
        for mass, shape, z in ((0, floor, -1.0), (1, ball, 1.0)):
            body = p.createMultiBody(
                mass, shape, basePosition=[0, 0, z], useMaximalCoordinates=1, physicsClientId=client
            )
            p.changeDynamics(body, -1, restitution=0.8, linearDamping=0.0, physicsClientId=client)
            if threshold is not None:
                p.changeDynamics(body, -1, contactProcessingThreshold=threshold, physicsClientId=client)
        wrong = 0
        for _ in range(240):
            before = p.getBaseVelocity(body, physicsClientId=client)[0][2]
            p.stepSimulation(physicsClientId=client)
            got = 240.0 * (p.getBaseVelocity(body, physicsClientId=client)[0][2] - before) + 9.81
            told = sum(each[9] for each in p.getContactPoints(physicsClientId=client) if each[8] <= 0.0)
            wrong += abs(told - got) > 1e-3 * max(9.81, abs(got))
        assert (wrong == 0) == rightly
    finally:
        p.disconnect(client)
    advice = [c.because for r in readings_of("bullet") for c in r.causes if "distance > 0" in c.because]
    assert advice and all("never as shipped" in each for each in advice)


@pytest.mark.parametrize("engine", WITH_SCRIPT)
def test_the_bare_script_prints_the_weight(engine):
    ended = subprocess.run([sys.executable, "-"], input=force_script_of(engine), capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr
    *along, up = map(float, ended.stdout.splitlines()[-1].split())
    # Single precision, and what is left of a landing after some seconds.
    assert up == pytest.approx(9.81, rel=2e-4) and all(abs(x) < 1e-3 for x in along)
