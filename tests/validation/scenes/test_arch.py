"""An arch of three stones: forces with the gaps of its faces as constraints, differenced; faults of three sizes."""

import math
from dataclasses import replace

import numpy as np
import pytest
from planted import carried, failing, made, still

from adapters.scene import SceneError
from adapters.trajectory import Trajectory
from validation.catalogue import CATALOGUE
from validation.files.mass_properties import moments, volume
from validation.geometry import overlap
from validation.scenes.arch import BASE, KEY, NARROW, TALL, _held, motion, needed

DT = 1 / 240
SIZES = [0.1, 0.01, 0.001]


def faces(scene):
    """Of each springer: a point of its face, and the unit normal off it, from the corners of its polygon [m]."""
    found = []
    for k in (1, 2):
        body = scene.bodies[k]
        corners = np.array(body.shape.vertices) + body.pose[:2]
        for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            along = (b - a) / np.linalg.norm(b - a)
            if min(abs(along)) > 0.01:  # the one side that is neither level nor upright
                found.append((0.5 * (a + b), np.array([along[1], -along[0]])))
    return found


def gaps(scene, q):
    """Of both springers from the floor and of the keystone from both faces; ``q``: x, y of the three stones [m]."""
    starts = [np.array(scene.bodies[k].pose[:2]) for k in (1, 2, 3)]
    moved = [q[2 * k : 2 * k + 2] - starts[k] for k in range(3)]
    between = [float((moved[2] - moved[k]) @ normal) for k, (_, normal) in enumerate(faces(scene))]
    return np.array([moved[0][1], moved[1][1], *between])


def accelerations(scene, mu, g=9.81):
    """Of the stones, x and y each, and the forces of floor and faces: Newton with slip outwards, gaps differenced."""
    q = np.concatenate([scene.bodies[k].pose[:2] for k in (1, 2, 3)])
    h = 1e-3
    first = np.array([(gaps(scene, q + e) - gaps(scene, q - e)) / (2.0 * h) for e in np.eye(6) * h]).T
    mass = np.repeat([scene.bodies[k].mass for k in (1, 2, 3)], 2)
    system = np.zeros((10, 10))
    system[:6, :6], system[:6, 6:], system[6:, :6] = np.diag(mass), -first.T, first
    system[0, 6], system[2, 7] = system[0, 6] - mu, system[2, 7] + mu  # friction pushes inwards, as both slip out
    return np.linalg.solve(system, [*(mass * np.tile([0.0, -g], 3)), 0.0, 0.0, 0.0, 0.0])


def least_friction(scene):
    """Friction at which the springers' acceleration changes sign, by bisection."""
    low, high = 0.0, 10.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if accelerations(scene, middle)[2] > 0.0 else (low, middle)
    return 0.5 * (low + high)


def run(scene, dt=DT, order=0.0, factors=(1.0, 1.0, 1.0), loads=None):
    """A record of stones that go by constant accelerations: left, right and keystone's, times ``factors``.

    ``loads``: of both floors and both faces over the keystone's weight; those of Newton's laws by default.
    """
    p = scene.params
    at = accelerations(scene, p["ratio"] * least_friction(scene), p["g"])
    if p["ratio"] >= 1.0:  # at rest: forces without friction or acceleration, level ones are the floor's
        s = math.sin(math.radians(p["beta"]))
        at = np.array(
            [*np.zeros(6), *[(p["heavy"] + 0.5) * p["mass"] * p["g"]] * 2, *[p["mass"] * p["g"] / (2 * s)] * 2]
        )
    rates = at[:6].reshape(3, 2) * np.array(factors)[:, None]
    t = np.arange(round(scene.duration / dt) + 1) * dt
    pose, twist = still(scene, len(t))
    for k, rate in enumerate(rates, 1):
        twist[:, k, :2] = np.outer(t, rate)
        pose[:, k, :2] += np.outer(0.5 * t * t + order * dt * t, rate)
    forces = at[6:] if loads is None else np.array(loads) * p["mass"] * p["g"]
    normals = [np.array([0.0, 1.0])] * 2 + [normal for _, normal in faces(scene)]
    each = np.array([force * normal for force, normal in zip(forces, normals, strict=True)]) * dt
    contacts = carried([(0, 1), (0, 2), (1, 3), (2, 3)], np.tile(each, (len(t), 1, 1)))
    return Trajectory(t, pose, twist, contacts, dt, "completed")


SHAPES = [{}, {"beta": 40.0}, {"heavy": 10.0}, {"g": 3.0, "mass": 7.0}]


@pytest.mark.parametrize("params", SHAPES)
def test_the_stones_are_uniform_touch_and_overlap_nowhere(params):
    _, scene = made("arch", **params)
    for stone in scene.bodies[1:]:
        assert stone.inertia == pytest.approx(moments(stone.shape, stone.mass, 2))
        corners = np.array(stone.shape.vertices) + stone.pose[:2]
        assert corners[:, 1].max() == pytest.approx(TALL)
    floor, left, right, keystone = scene.bodies
    for a, b in ((floor, left), (floor, right), (left, keystone), (right, keystone)):
        depth = overlap(a.shape, np.array([a.pose]), b.shape, np.array([b.pose]))
        assert depth == pytest.approx(0.0, abs=1e-12)
        deeper = np.array([b.pose]) - [[0.0, 1e-3, 0.0]]
        assert overlap(a.shape, np.array([a.pose]), b.shape, deeper) > 1e-4
    assert volume(left.shape, 2) == pytest.approx(volume(right.shape, 2))


@pytest.mark.parametrize("params", SHAPES)
def test_friction_that_balances_the_springers(params):
    _, scene = made("arch", **params)
    assert needed(scene.params) == pytest.approx(least_friction(scene), rel=1e-9)


@pytest.mark.parametrize("params", SHAPES)
@pytest.mark.parametrize("ratio", [0.5, 0.8])
def test_arch_fall_by_newton_s_laws(params, ratio):
    _, scene = made("arch", ratio=ratio, **params)
    p = scene.params
    found = accelerations(scene, ratio * least_friction(scene), p["g"])
    out, load = motion(p)
    assert found[[0, 2]] == pytest.approx([-out, out], rel=1e-9) and found[4] == pytest.approx(0.0, abs=1e-12)
    assert -found[5] == pytest.approx(out / math.tan(math.radians(p["beta"])), rel=1e-9)
    assert found[8:] == pytest.approx(load * p["mass"] * p["g"], rel=1e-9)


@pytest.mark.parametrize("params", SHAPES)
@pytest.mark.parametrize("ratio", [0.8, 1.05])
@pytest.mark.parametrize("order", [-0.5, 0.0, 0.5])
def test_arch_by_newton_s_laws_in_every_step_order(params, ratio, order):
    canonical, scene = made("arch", ratio=ratio, **params)
    assert failing(canonical, scene, run(scene, order=order)) == set()


@pytest.mark.parametrize("size", SIZES)
def test_arch_with_another_motion_fails(size):
    canonical, scene = made("arch", ratio=0.8)
    for factors, metric in (
        ((1.0 - 3.0 * size, 1.0, 1.0), "parting[left]"),
        ((1.0, 1.0 + 3.0 * size, 1.0), "parting[right]"),
        ((1.0, 1.0, 1.0 - 3.0 * size), "sinking"),
    ):
        assert metric in failing(canonical, scene, run(scene, factors=factors))
    true = accelerations(scene, 0.8 * least_friction(scene))[6:] / 9.81
    for k, side in ((2, "left"), (3, "right")):
        off = true.copy()
        off[k] *= 1.0 + size
        assert failing(canonical, scene, run(scene, loads=off)) == {f"face_load[{side}]"}
    plain = run(scene)
    for k in (1, 2, 3):
        for axis, said in ((0, {"off_the_faces"}), (1, {"off_the_faces"}), (2, {"turned"})):
            gone = replace(plain, pose=plain.pose.copy())
            gone.pose[-1, k, axis] += 2.0 * size
            assert failing(canonical, scene, gone) == said


@pytest.mark.parametrize("size", SIZES)
def test_arch_that_moves_or_bears_wrongly(size):
    canonical, scene = made("arch")
    still = run(scene)
    for k in (1, 2, 3):
        for axis in range(3):
            gone = replace(still, pose=still.pose.copy())
            gone.pose[-1, k, axis] -= 2.0 * size
            assert failing(canonical, scene, gone) == {"moved"}
    names = ("floor_load[left]", "floor_load[right]", "face_load[left]", "face_load[right]")
    for k, name in enumerate(names):
        loads = np.array([3.5, 3.5, 1.0, 1.0])
        loads[k] *= 1.0 + size
        assert failing(canonical, scene, run(scene, loads=loads)) == {name}


def test_arch_standing_or_falling_against_its_threshold():
    canonical, slides = made("arch", ratio=0.8)
    assert {"parting[left]", "parting[right]", "sinking"} <= failing(
        canonical, slides, run(slides, factors=(0.0, 0.0, 0.0))
    )
    canonical, stands = made("arch")
    fallen = run(replace(made("arch", ratio=0.95)[1], duration=1.0))
    assert {"moved", "face_load[left]", "floor_load[right]"} <= failing(canonical, stands, fallen)


def test_the_replay_s_ghost_sinks_with_the_keystone():
    canonical, scene = made("arch", ratio=0.8)
    record = run(scene)
    assert canonical.track(scene).position(record.t[-1]) == pytest.approx(tuple(record.pose[-1, 3, :2]), abs=1e-12)


def test_arch_that_rises_as_a_whole_fails():
    canonical, scene = made("arch", ratio=0.8)
    raised = run(scene)
    raised.pose[-1, 1:, 1] += 1e-3
    assert "off_the_faces" in failing(canonical, scene, raised)


def within_base(p):
    """Whether the right springer does not turn with the floor's load within its base: torques about its centre."""
    canonical = CATALOGUE["arch"]
    beta, heavy = math.radians(p["beta"]), p["heavy"]
    out, load = motion(p)
    share = 0.5 * BASE * (TALL + TALL) - 0.5 * KEY * KEY * math.tan(beta)  # a rectangle without a triangle
    corner = 0.5 * KEY * KEY * math.tan(beta)
    x = (BASE * TALL * (NARROW + 0.5 * BASE) - corner * (NARROW + KEY * math.tan(beta) / 3.0)) / share
    y = (BASE * TALL * 0.5 * TALL - corner * (TALL - KEY / 3.0)) / share
    press = heavy + load * math.sin(beta)
    grip = load * math.cos(beta) - heavy * out / canonical.complete({})["g"]  # friction, inwards
    for up in (0.0, KEY):
        arm = NARROW + up * math.tan(beta) - x, TALL - KEY + up - y
        torque = arm[0] * -load * math.sin(beta) - arm[1] * load * math.cos(beta) - y * grip
        if not NARROW < x - torque / press < NARROW + BASE:
            return False
    return True


def test_tipping_stones_at_rest_and_on_their_way():
    canonical, said = CATALOGUE["arch"], []
    for ratio in (0.05, 0.2, 0.5, 1.05):
        for beta in np.linspace(10.0, 45.0, 36):
            for heavy in np.geomspace(1.0, 10.0, 21):
                p = canonical.complete({"ratio": ratio, "beta": float(beta), "heavy": float(heavy)})
                said.append(_held(p))
                assert said[-1] == within_base(p), p
    assert 0.01 < np.mean(said) < 0.99  # both happen


def test_springers_that_would_tip_are_refused_by_name():
    with pytest.raises(SceneError, match=r"arch\.beta"):
        made("arch", beta=12.0)
