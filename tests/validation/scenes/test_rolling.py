"""Balls that slide, roll, bounce and spin: their truths against integrated friction, and faults of three sizes."""

import math
from dataclasses import replace

import numpy as np
import pytest
from planted import failing, made, still
from scipy.integrate import solve_ivp

from adapters.trajectory import Trajectory
from validation.catalogue import CATALOGUE

DT = 1 / 240
SIZES = [0.1, 0.01, 0.001]


def integrated(scene, dt=DT, mu=None, k=None, resistance=0.0, late=0.0, offset=0.0):
    """What Coulomb's friction on a slipping point, and none on a rolling one, makes of a ball: DOP853 in three axes.

    A planar scene moves along x and turns about -y. ``resistance`` [1/s] brakes speed and spin; ``late`` [s] of a start
    without contact; ``offset`` in steps shifts the places that are sampled, as step orders do.
    """
    d, body = scene.dimension, scene.bodies[1]
    r, load = body.shape.radius, np.array([scene.gravity[0], 0.0 if d == 2 else scene.gravity[1]])
    weight = -scene.gravity[-1]
    mu = scene.material("floor", body.name).friction if mu is None else mu
    k = (body.inertia if d == 2 else body.inertia[0]) / (body.mass * r**2) if k is None else k
    if d == 2:
        start = [0.0, 0.0, body.twist[0], 0.0, 0.0, -body.twist[2], 0.0]
    else:
        start = [0.0, 0.0, *body.twist[:2], *body.twist[3:]]

    def slip(y):
        return np.array([y[2] - y[5] * r, y[3] + y[4] * r])

    def rates(t, y, rolling):
        if t < late:
            friction = np.zeros(2)
        elif rolling:
            friction = -load / (1.0 + 1.0 / k)
        else:
            friction = -mu * weight * slip(y) / np.linalg.norm(slip(y))
        turning = np.array([friction[1], -friction[0], 0.0]) / (k * r)
        return [*y[2:4], *(load + friction - resistance * y[2:4]), *(turning - resistance * y[4:])]

    def stops(t, y, rolling):
        return np.linalg.norm(slip(y)) - 1e-9

    stops.terminal = True
    steps = round(scene.duration / dt)
    times = np.arange(steps + 1) * dt
    grips = mu * weight >= np.linalg.norm(load) / (1.0 + 1.0 / k)
    rolling = np.linalg.norm(slip(start)) < 1e-9 and grips
    states, since, y = np.empty((len(times), 7)), 0.0, np.array(start)
    if np.linalg.norm(slip(start)) < 1e-9 and not grips:
        y[2:4] += 1e-12 * load  # friction has a direction once it slips
    for _ in range(2):
        events = None if rolling or not grips else stops
        found = solve_ivp(
            rates, (since, times[-1] + dt), y, "DOP853", dense_output=True, events=events, args=(rolling,), rtol=1e-11,
            atol=1e-12, max_step=0.02,
        )  # fmt: skip
        here = (times >= since) & (times <= found.t[-1])
        states[here] = found.sol(times[here]).T
        if found.t[-1] >= times[-1]:
            break
        since, y, rolling = found.t[-1], found.y[:, -1], True
    return recorded(scene, times, states, dt, offset)


def recorded(scene, times, states, dt=DT, offset=0.0):
    """A record of places (2), velocities (2) and spins (3), level."""
    d, body = scene.dimension, scene.bodies[1]
    pose, twist = still(scene, len(times))
    place = states[:, :2] + offset * dt * (states[:, 2:4] - states[0, 2:4])
    if d == 2:
        pose[:, 1, 0] = body.pose[0] + place[:, 0]
        twist[:, 1, 0], twist[:, 1, 2] = states[:, 2], -states[:, 5]
    else:
        pose[:, 1, :2] = place + body.pose[:2]
        twist[:, 1, :2], twist[:, 1, 3:] = states[:, 2:4], states[:, 4:]
    return Trajectory(times, pose, twist, None, dt, "completed")


CELLS = [
    ("slide_to_roll", 2, {}),
    ("slide_to_roll", 2, {"mu": 0.1, "radius": 1.0}),
    ("slide_to_roll", 3, {"heading": 30.0}),
    ("roll_incline", 2, {}),
    ("roll_incline", 3, {"ratio": 0.99}),
    ("roll_incline", 2, {"ratio": 1.5}),
    ("roll_incline", 3, {"ratio": 5.0}),
    ("rolling_spin", 3, {}),
    ("rolling_spin", 3, {"v": 0.0, "spin": 50.0}),
    ("masse", 3, {}),
    ("masse", 3, {"side": 1.0, "back": 4.0}),
    ("masse", 3, {"side": -2.0, "back": -7.0}),
]


@pytest.mark.parametrize(("name", "dimension", "params"), CELLS)
def test_formula_against_integrated_friction(name, dimension, params):
    canonical, scene = made(name, dimension, **params)
    measured = canonical.measure(scene, integrated(scene))
    for metric, truth in canonical.exact(scene).items():
        # Between samples places are read off a line, mu g dt^2/8; everything else is the formula's own.
        assert measured[metric][0] == pytest.approx(truth, abs=1e-5 if metric == "rolling_place" else 1e-7), metric


@pytest.mark.few(54)
@pytest.mark.parametrize("late", [0.0, 1.0])
@pytest.mark.parametrize("offset", [-0.5, 0.0, 0.5])
@pytest.mark.parametrize("dt", [1 / 60, DT, 1 / 960])
@pytest.mark.parametrize(("name", "dimension", "params"), CELLS)
def test_step_orders_and_a_late_contact(name, dimension, params, dt, offset, late):
    canonical, scene = made(name, dimension, **params)
    assert failing(canonical, scene, integrated(scene, dt, late=late * dt, offset=offset)) == set()


@pytest.mark.parametrize("size", SIZES)
def test_wrong_friction_inertia_and_resistance_fail(size):
    for name, dimension, params, friction, inertia in (
        ("slide_to_roll", 2, {"mu": 0.1}, {"rolling_time", "rolling_place"}, {"final_speed", "slip"}),
        ("masse", 3, {}, {"end_x", "end_y"}, {"final_vy", "final_vx"}),
        ("roll_incline", 2, {"ratio": 1.5}, {"acceleration", "turning"}, {"turning"}),
    ):
        canonical, scene = made(name, dimension, **params)
        k = 0.5 if dimension == 2 else 0.4
        wrong = failing(canonical, scene, integrated(scene, mu=scene.params["mu"] * (1.0 - size)))
        assert size < 0.02 or wrong & friction, name
        assert size < 0.005 or failing(canonical, scene, integrated(scene, k=k * (1.0 + size))) & inertia, name
        assert failing(canonical, scene, integrated(scene, resistance=size)), name


@pytest.mark.parametrize("size", SIZES)
def test_decaying_spin_bend_and_hop(size):
    canonical, scene = made("rolling_spin", 3)
    assert failing(canonical, scene, integrated(scene, resistance=size)) == {"spin", "speed"}
    good = integrated(scene)
    bent, raised = good.pose.copy(), good.pose.copy()
    bent[-1, 1, 1] += 2.0 * size
    assert failing(canonical, scene, replace(good, pose=bent)) == {"astray"}
    raised[10, 1, 2] += size
    for name in ("rolling_spin", "slide_to_roll", "masse", "roll_incline"):
        canonical, scene = made(name, 3)
        good = integrated(scene)
        raised = good.pose.copy()
        raised[10, 1, 2] += size
        assert failing(canonical, scene, replace(good, pose=raised)) == {"hop"}, name


@pytest.mark.parametrize("size", SIZES)
def test_rolling_with_a_bent_path_or_final_slip(size):
    canonical, scene = made("slide_to_roll", 3)
    good = integrated(scene)
    bent = good.pose.copy()
    bent[-1, 1, 1] += size
    assert failing(canonical, scene, replace(good, pose=bent)) == {"astray"}
    slipping = good.twist.copy()
    slipping[-1, 1, 4] *= 1.0 + size
    assert failing(canonical, scene, replace(good, twist=slipping)) == {"slip"}


@pytest.mark.parametrize("size", SIZES)
def test_friction_oblique_to_the_slip_detected(size):
    """A cone of which one axis is weaker turns the direction of the slip."""
    canonical, scene = made("masse", 3)
    good = integrated(scene)
    turned = good.twist.copy()
    bend = np.linspace(0.0, 5.0 * size, len(good.t))
    slip = turned[:, 1, :2] + 0.25 * np.column_stack([-turned[:, 1, 4], turned[:, 1, 3]])
    turned[:, 1, :2] += bend[:, None] * np.column_stack([-slip[:, 1], slip[:, 0]])
    assert "turned" in failing(canonical, scene, replace(good, twist=turned)) or size < 0.005


def test_ball_without_rolling_has_no_rolling_time():
    canonical, scene = made("slide_to_roll")
    good = integrated(scene)
    sliding = replace(good, twist=np.repeat(good.twist[:1], len(good.t), axis=0))
    measured = canonical.measure(scene, sliding)
    assert measured["rolling_time"] == measured["rolling_place"] == (None, "the ball does not begin to roll")


# ---- a bounce with spin ----


def bounced(v, w, fall, e, mu, k, radius, stiffness=1e6, h=2e-7):
    """Speed, spin, rebound of a ball on a spring that gives back e^2 of its energy, and rubs with mu as it presses."""
    x, up, mass, deepest = 0.0, -fall, 1.0, 0.0
    while x <= 0.0:
        deepest = min(deepest, x)
        # Unloading is along a line that is 1/e^2 as steep from the deepest point, which has e^2 of the energy.
        given = stiffness / e**2 * max(0.0, x - deepest)
        push = max(0.0, -stiffness * deepest - given) if up > 0.0 else -stiffness * x
        grips = (v - w * radius) / (1.0 + 1.0 / k)
        rub = max(-mu * push * h, min(mu * push * h, grips))
        v, w, up = v - rub, w + rub / (k * radius), up + push / mass * h
        x += up * h
        if up > 0.0 and push == 0.0:
            break
    return v, w, up


@pytest.mark.parametrize(
    ("dimension", "params"),
    [
        (2, {}),
        (3, {}),
        (2, {"mu": 0.1}),
        (3, {"mu": 0.1, "e": 0.5}),
        (2, {"v": 1.0, "spin": -10.0, "mu": 1.0}),
        (3, {"v": 1.0, "spin": -10.0, "mu": 1.0}),
        (2, {"v": 0.0, "spin": 5.0, "mu": 0.2}),
    ],
)
def test_ball_on_a_rubbing_spring(dimension, params):
    canonical, scene = made("oblique", dimension, **params)
    p, truth = scene.params, canonical.exact(scene)
    k = 0.5 if dimension == 2 else 0.4
    v, w, up = bounced(p["v"], p["spin"] / p["radius"], p["fall"], p["e"], p["mu"], k, p["radius"])
    assert up == pytest.approx(truth["rebound_ratio"] * p["fall"], abs=2e-3)
    assert v == pytest.approx(truth["forward_speed"], abs=2e-3)
    assert w * p["radius"] == pytest.approx(truth["spin_speed"], abs=2e-3 / k)


def test_the_worked_examples_of_the_field():
    """A ball grips and comes back at 15/7; table tennis: backspin of ten times the speed reverses both."""
    truth = CATALOGUE["oblique"].exact(made("oblique", 3, v=1.0, spin=-10.0, mu=2.0)[1])
    assert (truth["forward_speed"], truth["spin_speed"]) == (pytest.approx(-15 / 7), pytest.approx(-15 / 7))


def left(scene, forward, spin, rebound, sideways=0.0):
    """A record that ends with these velocities [m/s]."""
    d, r = scene.dimension, scene.params["radius"]
    pose, twist = still(scene, 2)
    twist[-1, 1, d - 1] = rebound
    if d == 2:
        twist[-1, 1, 0], twist[-1, 1, 2] = forward, -spin / r
    else:
        angle = math.radians(scene.params["heading"])
        along, across = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
        twist[-1, 1, :2] = forward * along + sideways * across
        twist[-1, 1, 3:5] = spin / r * across
    return Trajectory(np.array([0.0, DT]), pose, twist, None, DT, "completed")


@pytest.mark.parametrize("size", SIZES)
def test_bounce_with_a_fault(size):
    canonical, scene = made("oblique", 3, mu=0.1, heading=30.0)
    forward, spin, up = 2.64, 0.9, 1.6
    assert failing(canonical, scene, left(scene, forward, spin, up)) == set()
    assert failing(canonical, scene, left(scene, forward, spin, up * (1.0 - size))) == {"rebound_ratio"}
    assert failing(canonical, scene, left(scene, forward * (1.0 - size), spin, up)) == {"forward_speed"}
    assert failing(canonical, scene, left(scene, forward, spin, up, size)) == {"sideways"}
    # The arm of a ball that is found up to v dt = 8 mm deep is 1.7 % shorter, and so is what friction turns.
    assert failing(canonical, scene, left(scene, forward, spin * (1.0 - size), up)) == (
        {"spin_speed"} if size > 0.02 else set()
    )


@pytest.mark.parametrize("dt", [1 / 60, DT, 1 / 960])
@pytest.mark.parametrize("params", [{}, {"mu": 0.1}, {"v": 1.0, "spin": -10.0, "mu": 1.0}])
def test_deep_contact_rubbed_on_a_shorter_arm(params, dt):
    """Angular momentum and Coulomb's law, solved anew at the place where a step finds the contact."""
    canonical, scene = made("oblique", 2, **params)
    p = scene.params
    for depth in (0.0, 0.3 * p["fall"] * dt, p["fall"] * dt):
        arm, inertia = p["radius"] - depth, 0.5 * p["radius"] ** 2
        v, w = p["v"], p["spin"] / p["radius"]
        grips = np.linalg.solve([[1.0, 1.0, 0.0], [-arm / inertia, 0.0, 1.0], [0.0, 1.0, -arm]], [v, w, 0.0])
        rub = float(np.clip(grips[0], -p["mu"] * 1.8 * p["fall"], p["mu"] * 1.8 * p["fall"]))
        found = left(scene, v - rub, (w + rub * arm / inertia) * p["radius"], p["e"] * p["fall"])
        assert failing(canonical, scene, replace(found, dt=dt)) == set()
