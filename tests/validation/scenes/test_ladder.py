"""A ladder: loads and fall against forces at its two ends, differenced from where they are; faults of sizes."""

import math
from dataclasses import replace

import numpy as np
import pytest
from planted import carried, failing, made, still
from scipy.integrate import solve_ivp

from adapters.scene import SceneError
from adapters.trajectory import Trajectory
from validation.scenes.ladder import friction

DT = 1 / 240
SIZES = [0.1, 0.01, 0.001]


def centre_of(scene, tilt):
    """Centre of the box turned by ``tilt``, its lowest corner on the floor and its outermost at the wall."""
    half = np.array(scene.bodies[2].shape.half_extents)
    c, s = math.cos(tilt), math.sin(tilt)
    corners = np.array([[x, y] for x in (-1, 1) for y in (-1, 1)]) * half @ np.array([[c, s], [-s, c]])
    return np.array([-corners[:, 0].max(), -corners[:, 1].min()])


def forces(scene, tilt, spin, mu, g, heavy=1.0):
    """Angular acceleration, and forces of floor and wall: Newton and Euler, the constraint differenced from places."""
    h, body = 1e-4, scene.bodies[2]
    before, here, after = (centre_of(scene, tilt + k * h) for k in (-1, 0, 1))
    first, second = (after - before) / (2.0 * h), (after - 2.0 * here + before) / h**2
    half = np.array(body.shape.half_extents)
    c, s = math.cos(tilt), math.sin(tilt)
    arms = np.array([[x, y] for x in (-1, 1) for y in (-1, 1)]) * half @ np.array([[c, s], [-s, c]])
    foot, head = arms[arms[:, 1].argmin()], arms[arms[:, 0].argmax()]
    m = body.mass
    system = np.array(
        [
            [m * first[0], -mu, 1.0],
            [m * first[1], -1.0, 0.0],
            [heavy * body.inertia, -(foot[0] - foot[1] * mu), -head[1]],
        ]
    )
    return np.linalg.solve(system, [-m * second[0] * spin**2, -m * g - m * second[1] * spin**2, 0.0])


def sliding(scene, dt=DT, mu=None, g=None, heavy=1.0, offset=0.0, late=0.0):
    """The fall by DOP853; ``offset`` of a step order and ``late`` of the contacts, in steps."""
    p, start = scene.params, scene.bodies[2].pose[2]
    mu, g = friction(p) if mu is None else mu, p["g"] if g is None else g
    times = np.arange(round(scene.duration / dt) + 1) * dt
    found = solve_ivp(
        lambda t, y: [y[1], forces(scene, y[0], y[1], mu, g, heavy)[0]], (0.0, times[-1] + dt), [start, 0.0], "DOP853",
        dense_output=True, rtol=1e-9, atol=1e-10,
    )  # fmt: skip
    tilt, spin = found.sol(np.maximum(0.0, times - late * dt))
    spin[times < late * dt] = 0.0
    return recorded(scene, dt, tilt + offset * dt * spin, spin)


def recorded(scene, dt, tilt, spin, wall=None, foot=1.0):
    """A record with these angles; ``wall`` and ``foot`` are loads over the weight, at every step."""
    n = len(tilt)
    pose, twist = still(scene, n)
    pose[:, 2] = [(*centre_of(scene, each), each) for each in tilt]
    twist[:, 2, 2] = spin
    contacts = None
    if wall is not None:
        weight = scene.params["mass"] * scene.params["g"] * dt
        each = np.array([[wall, foot], [-wall, 0.0]]) * weight
        contacts = carried([(0, 2), (1, 2)], np.tile(each, (n, 1, 1)))
    return Trajectory(np.arange(n) * dt, pose, twist, contacts, dt, "completed")


def standing(scene, dt=DT, wall=None, foot=1.0):
    """A ladder at rest, with the loads that hold it: no friction is known, but no acceleration."""
    body = scene.bodies[2]
    if wall is None:
        c, s = math.cos(body.pose[2]), math.sin(body.pose[2])
        foot_at = np.array([[c, -s], [s, c]]) @ (np.array(body.shape.half_extents) * [1.0, -1.0])
        head_at = np.array([[c, -s], [s, c]]) @ np.array(body.shape.half_extents)
        # Unknown: friction, floor, wall, over the weight.
        system = [[1.0, 0.0, -1.0], [0.0, 1.0, 0.0], [-foot_at[1], foot_at[0], head_at[1]]]
        _, foot, wall = np.linalg.solve(system, [0.0, 1.0, 0.0])
    n = round(scene.duration / dt) + 1
    return recorded(scene, dt, np.full(n, body.pose[2]), np.zeros(n), wall, foot)


LEANS = [{}, {"lean": 45.0}, {"lean": 75.0}, {"aspect": 0.2}]


@pytest.mark.parametrize("params", LEANS)
def test_loads_and_friction_threshold_of_a_standing_ladder(params):
    canonical, scene = made("ladder", **params)
    assert failing(canonical, scene, standing(scene)) == set()
    start = scene.bodies[2].pose[2]
    least = canonical.exact(scene)["wall_load"]
    assert forces(scene, start, 0.0, 0.999 * least, 9.81)[0] < 0.0 < forces(scene, start, 0.0, 1.001 * least, 9.81)[0]


@pytest.mark.parametrize("params", LEANS)
@pytest.mark.parametrize("ratio", [0.5, 0.8])
def test_ladder_by_forces_at_its_ends(params, ratio):
    canonical, scene = made("ladder", ratio=ratio, **params)
    measured, truth = canonical.measure(scene, sliding(scene, 1 / 960)), canonical.exact(scene)
    assert measured["passing_time"][0] == pytest.approx(truth["passing_time"], rel=1e-5)
    assert measured["passing_spin"][0] == pytest.approx(truth["passing_spin"], rel=1e-5)
    assert measured["let_go"][0] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("offset", [-0.5, 0.0, 0.5])
@pytest.mark.parametrize("late", [0.0, 1.0])
@pytest.mark.parametrize("dt", [1 / 60, DT, 1 / 960])
def test_step_orders_and_late_contacts_pass(dt, late, offset):
    canonical, scene = made("ladder", ratio=0.8)
    assert failing(canonical, scene, sliding(scene, dt, offset=offset, late=late)) == set()


@pytest.mark.parametrize("size", SIZES)
def test_ladder_with_wrong_friction_gravity_inertia_or_loads(size):
    canonical, slides = made("ladder", ratio=0.8)
    dt = DT if size > 0.05 else 1 / 1920
    mu = friction(slides.params)
    assert size < 0.005 or failing(canonical, slides, sliding(slides, dt, mu * (1.0 - size))) >= {"passing_time"}
    assert size < 0.05 or "passing_time" in failing(canonical, slides, sliding(slides, dt, g=9.81 * (1.0 - size)))
    assert size < 0.005 or "passing_time" in failing(canonical, slides, sliding(slides, dt, heavy=1.0 + 5.0 * size))
    gone = sliding(slides)
    gone.pose[40:, 2, 0] -= 10.0 * size
    assert failing(canonical, slides, gone) == {"let_go"}
    canonical, stands = made("ladder")
    for loads, metric in (((1.0 + size, 1.0), "wall_load"), ((1.0, 1.0 - size), "floor_load")):
        found = standing(stands, wall=canonical.exact(stands)["wall_load"] * loads[0], foot=loads[1])
        assert failing(canonical, stands, found) == {metric}
    crept = standing(stands)
    crept.pose[-1, 2, :2] += [-2.0 * size, 0.0]
    assert failing(canonical, stands, crept) == {"moved"}


def test_ladder_standing_or_sliding_against_its_threshold():
    canonical, slides = made("ladder", ratio=0.8)
    assert failing(canonical, slides, standing(slides)) == {"passing_time", "passing_spin"}
    canonical, stands = made("ladder")
    fallen = sliding(replace(made("ladder", ratio=0.95)[1], duration=1.0))
    assert failing(canonical, stands, fallen) == {"moved", "wall_load", "floor_load"}


@pytest.mark.parametrize(
    ("params", "named"), [({"lean": 80.0, "aspect": 0.3}, "lean"), ({"ratio": 0.01, "lean": 20.0}, "ratio")]
)
def test_ladder_without_need_of_a_wall_refused(params, named):
    with pytest.raises(SceneError, match=rf"ladder\.{named}"):
        made("ladder", **params)
