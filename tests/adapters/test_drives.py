"""Conveyors, moving half-spaces and courses: closed forms on every engine that claims them, and refusals elsewhere."""

import math
from dataclasses import replace

import numpy as np
import pytest

from adapters.engine import EngineError
from adapters.needs import needs
from adapters.registry import load
from adapters.scene import Body, Box, Disc, HalfSpace, Harmonic, Pair, Scene, SceneError, Sphere, scene_from_dict
from adapters.scene.drives import as_moving, asked_abilities, place_after, top_speed, velocity_over
from adapters.scene.lift import lift, lowered
from adapters.stepping import _fastest, posed_for, run
from adapters.trajectory import Sampling

G, DT = 9.81, 1.0 / 240.0
ENGINES = [("chipmunk", "tuned"), ("mujoco", "tuned"), ("bullet", "tuned"), ("reference", "classical")]
DRIVEN = ENGINES[:3]


def scene(ground, rider, mu, duration=0.8, gravity=(0.0, -G), e=0.0):
    return Scene("drive", 1, len(gravity), (ground, rider), (Pair(friction=mu, restitution=e),), gravity, duration)


def floor(**drive):
    return Body("belt", HalfSpace((0.0, 1.0)), **{"motion": "fixed", **drive})


def box(x=0.0, y=0.25, **given):
    return Body("box", Box((0.5, 0.25)), 1.0, 1.25 / 12.0, (x, y, 0.0), **given)


def disc(x=0.0, y=0.5, **given):
    return Body("ball", Disc(0.5), 1.0, 0.125, (x, y, 0.0), **given)


def driven(engine, profile, asked, dt=DT, contacts=False):
    """The run, or a skip where the engine is not installed."""
    made = pytest.importorskip({"chipmunk": "pymunk", "bullet": "pybullet"}.get(engine, "numpy")) and load(engine)
    settings = {setting.name: setting.value for setting in made.settings(profile, needs(asked), dt)}
    return run(made, asked, dt, settings, Sampling(1, 0.0 if contacts else None))


@pytest.mark.parametrize(("engine", "profile"), ENGINES)
@pytest.mark.parametrize("speed", [1.0, -0.5])
def test_box_on_a_conveyor_slips_by_coulomb_and_then_rides(engine, profile, speed):
    """v = mu g t until it is V: x = V t - V |V| / (2 mu g). A step more or less of slip is V dt of path."""
    mu = 0.3
    found = driven(engine, profile, scene(floor(surface_velocity=(speed, 0.0)), box(), mu))
    assert found.reason == "" and (found.out_of_plane or 0.0) < 1e-9
    slips = abs(speed) / (mu * G)
    middle = int(0.5 * slips / DT)
    assert abs(found.twist[middle, 1, 0]) == pytest.approx(mu * G * found.t[middle], abs=1.01 * mu * G * DT)
    assert found.twist[-1, 1, 0] == pytest.approx(speed, abs=1e-3 * abs(speed))
    truth = speed * (found.t[-1] - 0.5 * slips)
    assert found.pose[-1, 1, 0] == pytest.approx(truth, abs=abs(speed) * DT)
    assert not found.twist[:, 0].any() and not found.pose[:, 0].any()  # the belt itself stays


@pytest.mark.parametrize(("engine", "profile"), ENGINES)
def test_rolling_speed_of_a_ball_on_a_conveyor(engine, profile):
    """About the line of contact the angular momentum stays zero: v = V k/(1 + k), k = 1/2; omega r = V - v."""
    found = driven(engine, profile, scene(floor(surface_velocity=(1.0, 0.0)), disc(), 0.3))
    assert found.twist[-1, 1] == pytest.approx([1.0 / 3.0, 0.0, 4.0 / 3.0], abs=2e-3)


@pytest.mark.parametrize("angle", [0.0, 0.6, math.pi / 2])
@pytest.mark.parametrize("engine", ["mujoco", "bullet"])
def test_conveyor_in_space_carries_along_itself(engine, angle):
    v = (math.cos(angle), math.sin(angle), 0.0)
    belt = Body("belt", HalfSpace((0.0, 0.0, 1.0)), motion="fixed", surface_velocity=v)
    rider = Body("box", Box((0.5, 0.5, 0.25)), 1.0, (0.1, 0.1, 0.2), (0, 0, 0.25, 1, 0, 0, 0))
    found = driven(engine, "tuned", scene(belt, rider, 0.3, gravity=(0.0, 0.0, -G)))
    truth = 0.8 - 0.5 / (0.3 * G)
    assert found.pose[-1, 1, :2] == pytest.approx([truth * v[0], truth * v[1]], abs=2.0 * DT)


@pytest.mark.parametrize("cone", ["pyramidal", "elliptic"])
def test_mujoco_s_conveyor_in_both_of_its_cones(cone):
    asked = scene(floor(surface_velocity=(1.0, 0.0)), box(), 0.3)
    made = load("mujoco")
    settings = {setting.name: setting.value for setting in made.settings("default", needs(asked), DT)}
    found = run(made, asked, DT, {**settings, "cone": cone})
    assert found.twist[-1, 1, 0] == pytest.approx(1.0, abs=1e-3)
    assert found.pose[-1, 1, 0] == pytest.approx(0.8 - 0.5 / (0.3 * G), abs=DT)


@pytest.mark.parametrize(("engine", "profile"), [("chipmunk", "tuned"), ("mujoco", "tuned")])
def test_drag_on_top_of_a_running_box_without_end_push(engine, profile):
    belt = Body("belt", Box((2.0, 0.5)), pose=(0.0, -0.5, 0.0), motion="fixed", surface_velocity=(1.0, 0.0))
    found = driven(engine, profile, scene(belt, box(), 0.3))
    assert found.twist[-1, 1, 0] == pytest.approx(1.0, abs=1e-3)
    beside = disc(x=2.51, y=-0.5, twist=(-0.1, 0.0, 0.0))  # it runs at 1 m/s towards what comes at 0.1 m/s
    met = driven(engine, profile, scene(belt, beside, 0.0, duration=0.4, gravity=(0.0, 0.0)))
    assert abs(met.twist[-1, 1, 0]) < 0.05


@pytest.mark.usefixtures("bullet")
def test_refusal_of_a_running_box_on_a_moving_half_space():
    belt = Body("belt", Box((2.0, 0.5)), pose=(0.0, -0.5, 0.0), motion="fixed", surface_velocity=(1.0, 0.0))
    with pytest.raises(
        EngineError, match=r"belt\.surface_velocity: bullet supports surface velocities of fixed half-spaces only"
    ):
        posed_for(load("bullet"), scene(belt, box(), 0.3))


@pytest.mark.parametrize(("engine", "profile"), ENGINES)
def test_rising_floor_with_a_box_and_an_elastic_ball(engine, profile):
    rising = floor(motion="prescribed", twist=(0.0, 0.5, 0.0))
    found = driven(engine, profile, scene(rising, box(), 0.3))
    assert found.pose[-1, 0] == pytest.approx([0.0, 0.4, 0.0], abs=1e-12)
    assert found.pose[-1, 1, 1] == pytest.approx(0.65, abs=2.0 * G * DT * DT + 0.5 * DT)
    thrown = driven(engine, profile, scene(rising, disc(y=0.6), 0.0, 0.4, (0.0, 0.0), e=1.0))
    # v' = 2 V of a mirror that moves; Bullet's slop of 1e-6 m costs it 1e-6/dt.
    assert thrown.twist[-1, 1, 1] == pytest.approx(1.0, abs=1.01e-6 / DT)


@pytest.mark.parametrize(("engine", "profile"), DRIVEN)
@pytest.mark.parametrize("shape", ["half-space", "box"])
def test_course_positions_at_every_step_with_sticking_bodies(engine, profile, shape):
    """A (2 pi f)^2 = 3.2 m/s^2 < mu g: the box sticks, and is where the table is but for what it slips at the start."""
    course = Harmonic((0.02, 0.0), 2.0, 0.4)
    plate = HalfSpace((0.0, 1.0)) if shape == "half-space" else Box((3.0, 0.5))
    pose = () if shape == "half-space" else (0.0, -0.5, 0.0)
    table = Body("table", plate, pose=pose, motion="prescribed", twist=(0.1, 0.0, 0.0), course=course)
    found = driven(engine, profile, scene(table, box(), 1.0, 1.0))
    where = 0.1 * found.t + 0.02 * (np.sin(4.0 * np.pi * found.t + 0.4) - math.sin(0.4))
    assert found.pose[:, 0, 0] - found.pose[0, 0, 0] == pytest.approx(where, abs=1e-12)
    # It starts at rest on a table that moves at 0.33 m/s: stuck after v/(mu g), and v^2/(2 mu g) behind.
    start = 0.1 + 0.02 * 4.0 * math.pi * math.cos(0.4)
    behind = where - found.pose[:, 1, 0]
    late = found.t > 0.2
    if engine == "mujoco":  # its friction creeps: near, not stuck
        assert np.abs(behind[late]).max() < 0.2 * 0.02 * 4.0 * math.pi
        return
    assert behind[late] == pytest.approx(
        np.full(late.sum(), start**2 / (2.0 * G)), abs=0.35 * start**2 / G + start * DT
    )
    # A table that moves before its rider is a step of its speed ahead, which changes by 4 pi f A.
    assert np.ptp(behind[late]) < 1.01 * 8.0 * math.pi * 0.02 * DT


@pytest.mark.parametrize(("engine", "profile"), DRIVEN)
def test_shaken_box_thrown_off_above_g(engine, profile):
    for amplitude, leaves in ((0.03, False), (0.12, True)):  # A (4 pi)^2 = 4.7 and 18.9 m/s^2
        course = Harmonic((0.0, amplitude), 2.0)
        found = driven(engine, profile, scene(floor(motion="prescribed", course=course), box(), 0.5, 1.0))
        gap = found.pose[:, 1, 1] - 0.25 - found.pose[:, 0, 1]
        assert (gap.max() > 0.02) == leaves, gap.max()


def test_scene_hash_without_drives_unchanged():
    plain = scene(floor(), box(), 0.3)
    assert "surface_velocity" not in plain.as_dict()["bodies"][0] and "course" not in plain.as_dict()["bodies"][1]
    running = scene(floor(surface_velocity=(1.0, 0.0)), box(), 0.3)
    shaken = scene(floor(motion="prescribed", course=Harmonic((0.1, 0.0), 2.0, 0.3)), box(), 0.3)
    assert len({plain.hash(), running.hash(), shaken.hash()}) == 3
    for asked in (running, shaken):
        again = scene_from_dict(asked.as_dict())
        assert again == asked and again.hash() == asked.hash()


@pytest.mark.parametrize(
    ("ground", "said"),
    [
        (floor(surface_velocity=(1.0, 0.1)), "does not lie in the face"),
        (floor(surface_velocity=(1.0,)), "has 1 components"),
        (floor(surface_velocity=(math.nan, 0.0)), "not a finite number"),
        (floor(motion="free"), "fixed or prescribed"),
        (floor(course=Harmonic((0.1, 0.0), 2.0)), "only a prescribed body"),
        (floor(motion="prescribed", course=Harmonic((0.1,), 2.0)), "belt.course.amplitude"),
        (floor(motion="prescribed", course=Harmonic((0.1, 0.0), 0.0)), "belt.course.frequency"),
        (floor(motion="prescribed", course=Harmonic((0.1, 0.0), 1.0, math.inf)), "belt.course.phase"),
        (replace(box(), name="belt", surface_velocity=(1.0, 0.0)), "not free can have a surface velocity"),
    ],
)
def test_wrong_drive_refused_by_its_field(ground, said):
    with pytest.raises(SceneError, match=said):
        scene(ground, box(), 0.3)


def test_adapter_without_declared_abilities():
    bare = replace(load("chipmunk").facts, abilities=frozenset())
    engine = type("Bare", (type(load("chipmunk")),), {"facts": bare})()
    asked = scene(floor(surface_velocity=(1.0, 0.0)), box(), 0.3)
    with pytest.raises(EngineError, match=r"belt\.surface_velocity: the adapter of chipmunk has no surface velocity"):
        posed_for(engine, asked)
    assert posed_for(engine, scene(floor(), box(), 0.3)).bodies[0].motion == "fixed"


def test_path_of_a_course_by_its_velocity():
    body = Body(
        "b", Sphere(1.0), motion="prescribed", twist=(0.1, 0, 0, 0, 0, 0), course=Harmonic((0.0, 2.0, 0.0), 3.0, 1.0)
    )
    body = Scene("s", 1, 3, (body,), (), (0, 0, 0), 1.0).bodies[0]
    path = DT * np.sum([velocity_over(body, DT, k) for k in range(100)], axis=0)
    t = 100 * DT
    assert path == pytest.approx([0.1 * t, 2.0 * (math.sin(6.0 * math.pi * t + 1.0) - math.sin(1.0)), 0.0], abs=1e-12)
    assert top_speed(body) == pytest.approx(0.1 + 12.0 * math.pi)


@pytest.mark.parametrize("course", [None, Harmonic((0.0, 2.0, 0.5), 3.0, 1.0)])
def test_place_of_a_prescribed_body_by_its_velocities(course):
    body = Body(
        "b", Sphere(1.0), motion="prescribed", pose=(1.0, 2.0, 3.0, 1.0, 0, 0, 0), twist=(0.1, 0, -1.0, 0, 0, 0)
    )
    body = Scene("s", 1, 3, (replace(body, course=course),), (), (0, 0, 0), 1.0).bodies[0]
    gone = np.zeros(3)
    for k in range(50):
        assert place_after(body, k * DT) == pytest.approx(np.array([1.0, 2.0, 3.0]) + gone, abs=1e-12)
        gone += DT * np.array(velocity_over(body, DT, k))


def test_lift_of_drives_and_no_lowering_of_a_course():
    asked = scene(floor(surface_velocity=(1.0, 0.0)), box(), 0.3)
    raised = lift(asked)
    assert raised.bodies[0].surface_velocity == (1.0, 0.0, 0.0)
    assert lowered(raised).bodies[0].surface_velocity == (1.0, 0.0)
    shaken = lift(scene(floor(motion="prescribed", course=Harmonic((0.1, 0.2), 2.0)), box(), 0.3))
    assert shaken.bodies[0].course.amplitude == (0.1, 0.0, 0.2) and lowered(shaken) is None
    assert as_moving(asked).bodies[0].twist == (1.0, 0.0, 0.0) and as_moving(scene(floor(), box(), 0.3)).bodies[
        0
    ] == floor(pose=(0.0, 0.0, 0.0), twist=(0.0,) * 3, force=(0.0, 0.0), torque=(0.0,), surface_velocity=(0.0, 0.0))
    assert [ability for _, ability in asked_abilities(raised)] == ["surface velocity"]


def test_speed_explained_by_a_turning_face():
    door = floor(motion="prescribed", twist=(0.0, 0.0, 1e3))
    far = Body("far", Disc(0.1), 1.0, 1.0, (5.0, 0.1, 0.0))
    scene = Scene("door", 1, 2, (door, far), (Pair(),), (0.0, 0.0), 1.0)
    assert ("belt.twist", "turning half-space") in list(asked_abilities(scene))
    assert _fastest(scene) >= 5e3  # at five metres from where it turns about
    still = replace(scene, bodies=(floor(motion="prescribed", twist=(0.0, 1.0, 0.0)), far))
    assert "turning half-space" not in dict(asked_abilities(still)).values()
