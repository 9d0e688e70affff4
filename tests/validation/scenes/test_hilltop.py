"""A disc that leaves a hill: truth against forces integrated in the plane, and what leaves elsewhere fails."""

import math
from dataclasses import replace

import numpy as np
import pytest
from planted import failing, made, still
from scipy.integrate import solve_ivp

from adapters.scene import SceneError
from adapters.trajectory import Trajectory
from validation.catalogue import CATALOGUE

DT = 1 / 240


def integrated(scene, dt=DT, g=None, stuck=0.0, drag=0.0, late=0.0):
    """Position, velocity and spin in the plane; the hill's force keeps the distance, until it would have to pull.

    Rolls while friction suffices, slips after. ``stuck``: pull over the weight up to which the hill holds on.
    """
    p = scene.params
    g, reach, r, mu = p["g"] if g is None else g, p["hill"] + p["radius"], p["radius"], p["mu"]

    def forces(y, rolls):
        place, velocity = y[:2], y[2:4]
        normal = place / np.linalg.norm(place)
        along = np.array([normal[1], -normal[0]])
        carried = g * normal[1] - velocity @ velocity / reach
        rub = g * normal[0] * 0.5 / 1.5 if rolls else mu * max(0.0, carried)  # rolling: a third of a disc's pull
        return normal, along, carried, rub

    def rates(t, y, rolls):
        normal, along, carried, rub = forces(y, rolls)
        push = carried * normal - rub * along - drag * y[2:4]
        return [*y[2:4], push[0], push[1] - g, rub / (0.5 * r)]

    def leaves(t, y, rolls):
        return forces(y, rolls)[2] + stuck * g

    def slips(t, y, rolls):
        return mu * forces(y, rolls)[2] - forces(y, True)[3]

    leaves.terminal = slips.terminal = True
    start = np.array([0.0, reach, p["v"], 0.0, p["v"] / r if mu > 0.0 else 0.0])
    runs, since = [], 0.0
    for rolls in (True, False) if mu > 0.0 else (False,):
        found = solve_ivp(
            rates, (since, 5.0), start, "DOP853", events=slips if rolls else leaves, rtol=1e-10, atol=1e-11,
            dense_output=True, args=(rolls,),
        )  # fmt: skip
        since, start = found.t[-1], found.y[:, -1]
        runs.append((since, found.sol))
    end, y = since, start
    times = np.arange(round(scene.duration / dt) + 1) * dt
    pose, twist = still(scene, len(times))
    for k, t in enumerate(np.maximum(0.0, times - late * dt)):
        if t <= end:
            now = next(path for until, path in runs if t <= until)(t)
        else:
            s = t - end
            now = [y[0] + s * y[2], y[1] + s * y[3] - 0.5 * g * s * s, y[2], y[3] - g * s, y[4]]
        pose[k, 1, :2], twist[k, 1] = now[:2], [now[2], now[3], -now[4]]
    return Trajectory(times, pose, twist, None, dt, "completed"), math.degrees(math.atan2(y[0], y[1])), end


@pytest.mark.parametrize("params", [{}, {"mu": 0.0}, {"mu": 0.1}, {"mu": 2.0, "v": 0.5}, {"mu": 0.0, "v": 2.0}])
def test_departure_angle_at_zero_normal_force(params):
    canonical, scene = made("hilltop", **params)
    trajectory, angle, end = integrated(scene)
    truth, measured = canonical.exact(scene), canonical.measure(scene, trajectory)
    assert truth["leaving_angle"] == pytest.approx(angle, abs=1e-3)
    assert truth["leaving_time"] == pytest.approx(end, abs=1e-4)
    for name, value in truth.items():
        assert measured[name][0] == pytest.approx(value, rel=2e-5), name


def test_departure_height_of_two_thirds_without_friction():
    _, scene = made("hilltop", mu=0.0, v=1e-3)
    truth = CATALOGUE["hilltop"].exact(scene)
    assert math.cos(math.radians(truth["leaving_angle"])) == pytest.approx(2.0 / 3.0, abs=1e-6)


@pytest.mark.parametrize("late", [0.0, 1.0])
@pytest.mark.parametrize("dt", [1 / 60, DT, 1 / 960])
@pytest.mark.parametrize("params", [{}, {"mu": 0.1}, {"mu": 0.0}])
def test_the_motion_passes_in_every_step(params, dt, late):
    canonical, scene = made("hilltop", **params)
    assert failing(canonical, scene, integrated(scene, dt, late=late)[0]) == set()


def held(scene, dt, new):
    """A step of first order without friction: the velocity along the normal is taken off at the old or new place."""
    p = scene.params
    reach, place, velocity, rows = (
        p["hill"] + p["radius"],
        np.array(scene.bodies[1].pose[:2]),
        np.array([p["v"], 0.0]),
        [],
    )
    for _ in range(round(scene.duration / dt) + 1):
        rows.append((*place, *velocity))
        if new:
            place = place + dt * velocity
        velocity = velocity - [0.0, dt * p["g"]]
        distance = float(np.linalg.norm(place))
        approach = float(velocity @ place) / distance
        if distance <= reach + 1e-12 and approach < 0.0:
            velocity = velocity - approach * place / distance
        if not new:
            place = place + dt * velocity
    r = np.array(rows)
    pose, twist = still(scene, len(r))
    pose[:, 1, :2], twist[:, 1, :2] = r[:, :2], r[:, 2:]
    return Trajectory(np.arange(len(r)) * dt, pose, twist, None, dt, "completed")


@pytest.mark.parametrize("new", [False, True])
@pytest.mark.parametrize("dt", [1 / 60, 1 / 120, DT, 1 / 960])
@pytest.mark.parametrize("v", [0.5, 1.0, 2.0])
def test_steps_of_first_order_pass(v, dt, new):
    canonical, scene = made("hilltop", mu=0.0, v=v)
    assert failing(canonical, scene, held(scene, dt, new)) == set()


@pytest.mark.parametrize("size", [0.1, 0.01, 0.001])
def test_hilltop_with_adhesion_wrong_gravity_or_drag(size):
    canonical, scene = made("hilltop")
    dt = DT if size > 0.05 else 1 / 3840
    assert size < 0.005 or {"level_speed", "leaving_time"} <= failing(
        canonical, scene, integrated(scene, dt, drag=size)[0]
    )
    assert size < 0.005 or failing(canonical, scene, integrated(scene, dt, g=9.81 * (1.0 - size))[0])
    assert size < 0.05 or failing(canonical, scene, integrated(scene, 1 / 3840, stuck=5.0 * size)[0])


def test_disc_that_stays_has_no_departure():
    canonical, scene = made("hilltop")
    still = integrated(scene)[0]
    still = replace(still, pose=np.repeat(still.pose[:1], len(still.t), axis=0))
    assert canonical.measure(scene, still)["leaving_angle"] == (None, "it does not leave")


def test_disc_that_takes_off_at_the_top():
    with pytest.raises(SceneError, match=r"hilltop\.v"):
        made("hilltop", v=3.0)


@pytest.mark.parametrize("dt", [1 / 60, DT, 1 / 960])
@pytest.mark.parametrize("v", [0.5, 1.0, 2.0])
def test_hilltop_bound_at_two_steps(v, dt):
    """Without friction the hill's force over the angle has a closed form: 3 g sin(phi) - (2 g + v^2/reach) phi."""
    canonical, scene = made("hilltop", mu=0.0, v=v)
    g, reach = scene.params["g"], scene.params["hill"] + scene.params["radius"]
    truth = canonical.exact(scene)
    phi = math.radians(truth["leaving_angle"])
    turned = dt * (3.0 * g * math.sin(phi) - (2.0 * g + v * v / reach) * phi)
    bound = {check.metric: check.bound for check in canonical.checks(scene, dt)}
    assert bound["level_speed"] >= 0.999 * turned > 0.0
    assert bound["leaving_time"] >= 1.5 * dt + 0.999 * 2.0 * turned / g
    # v^2 = g reach cos(phi)^3 of a level speed: the angle that such a change of it is worth.
    cosine = (truth["level_speed"] + np.array([-turned, turned])) ** 2 / (g * reach)
    worth = np.abs(np.degrees(np.arccos(np.cbrt(cosine))) - truth["leaving_angle"]).min()
    assert bound["leaving_angle"] >= 0.9 * worth
