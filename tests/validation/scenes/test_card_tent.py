"""A card tent: two free bodies under forces at feet and heads, gaps differenced from their places; faults of sizes."""

import math
from dataclasses import replace

import numpy as np
import pytest
from planted import carried, failing, made
from scipy.integrate import solve_ivp

from adapters.scene import SceneError
from adapters.trajectory import Trajectory
from validation.catalogue import CATALOGUE
from validation.files.mass_properties import moments
from validation.scenes.card_tent import _forces, friction, needed

DT = 1 / 240
SIZES = [0.1, 0.01, 0.001]


def gaps(scene, q):
    """Gaps of both feet and of the heads, from the places (x, y, angle) of both cards [m]."""
    shape = scene.bodies[1].shape
    ends = [
        np.array([x + side * shape.half_length * math.cos(tilt), y + side * shape.half_length * math.sin(tilt)])
        for x, y, tilt in (q[:3], q[3:])
        for side in (-1.0, 1.0)
    ]
    apart = np.linalg.norm(ends[3] - ends[1])
    return np.array([ends[0][1] - shape.radius, ends[2][1] - shape.radius, apart - 2.0 * shape.radius])


def accelerations(scene, q, v, mu, g, heavy=1.0):
    """Of both cards, and the forces of feet and heads: Newton and Euler, gaps differenced twice, feet that slip out.

    The heads push along the line of their centres, and alike on both: there is nothing to grip. A foot's friction acts
    where it touches.
    """
    h, n = 1e-4, 6
    card, r = scene.bodies[1], scene.bodies[1].shape.radius
    steps = np.eye(n) * h
    first = np.array([(gaps(scene, q + e) - gaps(scene, q - e)) / (2.0 * h) for e in steps]).T
    twice = (gaps(scene, q + h * v) - 2.0 * gaps(scene, q) + gaps(scene, q - h * v)) / h**2
    mass = np.array([card.mass, card.mass, heavy * card.inertia] * 2)
    # Friction: along the floor, inwards, at r under the end of the axis.
    along = np.zeros((2, n))
    for k, way in enumerate((1.0, -1.0)):
        tilt = q[3 * k + 2]
        arm = np.array([-card.shape.half_length * math.cos(tilt), -card.shape.half_length * math.sin(tilt) - r])
        along[k, 3 * k] = way
        along[k, 3 * k + 2] = -arm[1] * way
    system = np.zeros((9, 9))
    system[:6, :6] = np.diag(mass)
    system[:6, 6:] = -first.T
    for k in range(2):
        system[:6, 6 + k] -= mu * along[k]
    system[6:, :6] = first
    weight = np.array([0.0, -g * card.mass, 0.0] * 2)
    return np.linalg.solve(system, [*weight, *-twice])


def start_of(scene):
    return np.array([*scene.bodies[1].pose, *scene.bodies[2].pose])


def sliding(scene, dt=DT, mu=None, g=None, heavy=1.0, offset=0.0, late=0.0):
    """The fall by DOP853; ``offset`` of a step order and ``late`` of the contacts, in steps."""
    p, start = scene.params, start_of(scene)
    mu, g = friction(p) if mu is None else mu, p["g"] if g is None else g
    times = np.arange(round(scene.duration / dt) + 1) * dt
    found = solve_ivp(
        lambda t, y: [*y[6:], *accelerations(scene, y[:6], y[6:], mu, g, heavy)[:6]], (0.0, times[-1] + dt),
        [*start, *np.zeros(6)], "DOP853", dense_output=True, rtol=1e-7, atol=1e-9,
    )  # fmt: skip
    state = found.sol(np.maximum(0.0, times - late * dt)).T
    state[times < late * dt, 6:] = 0.0
    return recorded(scene, dt, state[:, :6] + offset * dt * state[:, 6:], state[:, 6:])


def recorded(scene, dt, places, speeds, loads=None):
    """A record of these places; ``loads``: of the left foot, the right foot and the heads, over a card's weight."""
    n = len(places)
    pose, twist = np.zeros((n, 3, 3)), np.zeros((n, 3, 3))
    pose[:, 1], pose[:, 2] = places[:, :3], places[:, 3:]
    twist[:, 1], twist[:, 2] = speeds[:, :3], speeds[:, 3:]
    contacts = None
    if loads is not None:
        left, right, heads = np.array(loads) * scene.params["mass"] * scene.params["g"] * dt
        each = np.array([[heads, left], [-heads, right], [heads, 0.0]])
        contacts = carried([(0, 1), (0, 2), (1, 2)], np.tile(each, (n, 1, 1)))
    return Trajectory(np.arange(n) * dt, pose, twist, contacts, dt, "completed")


def standing(scene, dt=DT, loads=None):
    """A tent at rest, with the loads that hold it: forces and moments of one card, its friction unknown."""
    if loads is None:
        card, tilt = scene.bodies[1], scene.bodies[1].pose[2]
        a, r = card.shape.half_length, card.shape.radius
        foot, head = np.array([-a * math.cos(tilt), -a * math.sin(tilt) - r]), np.array([0.0, a * math.sin(tilt)])
        _, press, heads = np.linalg.solve(
            [[1.0, 0.0, -1.0], [0.0, 1.0, 0.0], [-foot[1], foot[0], head[1]]], [0.0, 1.0, 0.0]
        )
        loads = (press, press, heads)
    n = round(scene.duration / dt) + 1
    return recorded(scene, dt, np.tile(start_of(scene), (n, 1)), np.zeros((n, 6)), loads)


SHAPES = [{}, {"lean": 45.0}, {"lean": 75.0}, {"aspect": 0.2}]


@pytest.mark.parametrize("params", SHAPES)
def test_contacts_and_inertia_of_a_card_tent(params):
    _, scene = made("card_tent", **params)
    card = scene.bodies[1]
    assert gaps(scene, start_of(scene)) == pytest.approx(np.zeros(3), abs=1e-15)
    assert card.inertia == pytest.approx(moments(card.shape, card.mass, 2), rel=1e-14)
    assert 2.0 * (card.shape.half_length + card.shape.radius) == pytest.approx(2.0)


@pytest.mark.parametrize("params", SHAPES)
def test_loads_and_friction_threshold_of_a_standing_tent(params):
    canonical, scene = made("card_tent", **params)
    assert failing(canonical, scene, standing(scene)) == set()
    least, q = needed(scene.params), start_of(scene)
    assert accelerations(scene, q, np.zeros(6), 0.999 * least, 9.81)[2] < 0.0
    assert accelerations(scene, q, np.zeros(6), 1.001 * least, 9.81)[2] > 0.0


def test_friction_threshold_of_thin_cards():
    p = CATALOGUE["card_tent"].complete({"aspect": 1e-9, "lean": 65.0})
    assert needed(p) == pytest.approx(0.5 * math.tan(math.radians(25.0)), rel=1e-8)


@pytest.mark.parametrize("params", SHAPES)
@pytest.mark.parametrize("ratio", [0.5, 0.8])
def test_sliding_tent_by_forces_at_its_ends(params, ratio):
    canonical, scene = made("card_tent", ratio=ratio, **params)
    measured, truth = canonical.measure(scene, sliding(scene, 1 / 960)), canonical.exact(scene)
    for name in ("passing_time[left]", "passing_time[right]", "passing_spin[left]", "passing_spin[right]"):
        assert measured[name][0] == pytest.approx(truth[name], rel=1e-5)
    assert measured["let_go"][0] == pytest.approx(0.0, abs=1e-7)


@pytest.mark.parametrize("params", SHAPES)
def test_forces_at_feet_and_heads_all_the_way(params):
    _, scene = made("card_tent", ratio=0.5, **params)
    record, p = sliding(scene), scene.params
    for k in (0, 30, 60):
        q, v = record.pose[k, 1:].ravel(), record.twist[k, 1:].ravel()
        loads = accelerations(scene, q, v, friction(p), p["g"])[6:] / (p["mass"] * p["g"])
        _, foot, heads = _forces(p, q[2], v[2] ** 2)
        assert loads == pytest.approx([foot, foot, heads], rel=1e-5)


def test_tent_end_one_step_late_and_three_steps_late():
    canonical, scene = made("card_tent", ratio=0.8)
    for steps, said in ((1.0, set()), (3.0, {"let_go"})):
        found = sliding(scene, 1 / 60)
        found.pose[5, 1, 1] -= 1.4 * steps * 9.81 * found.dt**2
        assert failing(canonical, scene, found) == said


@pytest.mark.parametrize("offset", [-0.5, 0.0, 0.5])
@pytest.mark.parametrize("late", [0.0, 1.0])
@pytest.mark.parametrize("dt", [1 / 60, DT, 1 / 960])
def test_step_orders_and_late_contacts_pass(dt, late, offset):
    canonical, scene = made("card_tent", ratio=0.8)
    assert failing(canonical, scene, sliding(scene, dt, offset=offset, late=late)) == set()


@pytest.mark.parametrize("size", SIZES)
def test_tent_with_wrong_friction_gravity_inertia_or_loads(size):
    canonical, slides = made("card_tent", ratio=0.8)
    dt = DT if size > 0.05 else 1 / 1920
    mu = friction(slides.params)
    times = {"passing_time[left]", "passing_time[right]"}
    assert size < 0.005 or failing(canonical, slides, sliding(slides, dt, mu * (1.0 - size))) >= times
    assert size < 0.05 or failing(canonical, slides, sliding(slides, dt, g=9.81 * (1.0 - size))) >= times
    assert size < 0.005 or failing(canonical, slides, sliding(slides, dt, heavy=1.0 + 5.0 * size)) >= times
    plain = sliding(slides)
    for k, axis, way in ((1, 0, -1.0), (2, 0, 1.0), (1, 1, 1.0), (2, 1, -1.0)):
        gone = replace(plain, pose=plain.pose.copy())
        gone.pose[20:, k, axis] += way * 10.0 * size
        assert failing(canonical, slides, gone) == {"let_go"}
    for k, name in ((1, "left"), (2, "right")):
        slow = replace(plain, twist=plain.twist.copy(), pose=plain.pose.copy())
        slow.twist[:, k, 2] *= 1.0 - 10.0 * size
        assert size < 0.01 or f"passing_spin[{name}]" in failing(canonical, slides, slow)
    canonical, stands = made("card_tent")
    least = needed(stands.params)
    for loads, metric in (
        ((1.0, 1.0, least * (1.0 + size)), "head_load"),
        ((1.0 - size, 1.0, least), "floor_load"),
        ((1.0, 1.0 + size, least), "floor_load"),
    ):
        assert failing(canonical, stands, standing(stands, loads=loads)) == {metric}
    for k in (1, 2):
        for axis in range(3):
            crept = standing(stands)
            crept.pose[-1, k, axis] += 2.0 * size
            assert failing(canonical, stands, crept) == {"moved"}


def test_tent_standing_or_sliding_against_its_threshold():
    canonical, slides = made("card_tent", ratio=0.8)
    names = {f"passing_{what}[{side}]" for what in ("time", "spin") for side in ("left", "right")}
    assert failing(canonical, slides, standing(slides)) == names
    canonical, stands = made("card_tent")
    fallen = sliding(replace(made("card_tent", ratio=0.95)[1], duration=1.0))
    assert failing(canonical, stands, fallen) == {"moved", "head_load", "floor_load"}


def test_tent_with_one_standing_card():
    canonical, slides = made("card_tent", ratio=0.8)
    half = sliding(slides)
    half.pose[:, 2], half.twist[:, 2] = half.pose[0, 2], 0.0
    assert failing(canonical, slides, half) == {"passing_time[right]", "passing_spin[right]", "let_go"}


def test_cards_that_separate_on_the_way_refused():
    with pytest.raises(SceneError, match=r"card_tent\.ratio"):
        made("card_tent", ratio=0.01, lean=20.0)
