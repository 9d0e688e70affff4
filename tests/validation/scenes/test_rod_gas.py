"""A gas of rods: event by event the rods are where free flights say; methods of fixed steps stay within the bounds."""

import math
from dataclasses import replace

import numpy as np
import pytest
from planted import failing, made

from adapters.trajectory import Trajectory
from validation.catalogue import CATALOGUE
from validation.scenes import rod_gas
from validation.scenes.parts import phases

DT = 1 / 240
SIZES = [0.1, 0.01, 0.001]


def bodies(scene):
    x = np.array([body.pose[0] for body in scene.bodies[2:]])
    v = np.array([body.twist[0] for body in scene.bodies[2:]])
    mass = np.array([body.mass for body in scene.bodies[2:]])
    return x, v, mass, -scene.bodies[1].shape.offset


def blow(v, mass, k, e):
    """Newton's law for neighbours k and k + 1, and momentum."""
    together = mass[k] + mass[k + 1]
    common, closing = (mass[k] * v[k] + mass[k + 1] * v[k + 1]) / together, v[k] - v[k + 1]
    v[k] = common - e * mass[k + 1] / together * closing
    v[k + 1] = common + e * mass[k] / together * closing


def meeting(scene, e=1.0, missed=None):
    """Rods (not points) flown from meeting to meeting; how many meetings there were. ``missed`` is passed over."""
    x, v, mass, length = bodies(scene)
    r, now, count, skipped = rod_gas.RADIUS, 0.0, 0, None
    while True:
        with np.errstate(divide="ignore", invalid="ignore"):
            between = np.where(v[:-1] > v[1:], (x[1:] - x[:-1] - 2.0 * r) / (v[:-1] - v[1:]), math.inf)
        walls = [(x[0] - r) / -v[0] if v[0] < 0 else math.inf, (length - r - x[-1]) / v[-1] if v[-1] > 0 else math.inf]
        waits = np.array([*between, *walls])
        if skipped is not None:
            waits[skipped] = math.inf
        k = int(waits.argmin())
        if now + waits[k] > scene.duration:
            return x + v * (scene.duration - now), v, count
        x, now, count = x + v * waits[k], now + waits[k], count + 1
        if count == missed:
            skipped = k
        elif k < len(between):
            blow(v, mass, k, e)
        else:
            v[0 if k == len(between) else -1] *= -e


def recorded(scene, x, v, dt=DT):
    """The start and the end, as an engine's record would hold them."""
    n = len(scene.bodies)
    pose, twist = (np.array([[getattr(body, name) for body in scene.bodies]] * 2) for name in ("pose", "twist"))
    pose[-1, 2:, 0], twist[-1, 2:, 0] = x, v
    assert pose.shape == (2, n, 3)
    return Trajectory(np.array([0.0, scene.duration]), pose, twist, None, dt, "completed")


def stepped(scene, dt):
    """A method of fixed steps: what overlaps and closes in after a step has its blow there; nothing is pushed out."""
    x, v, mass, length = bodies(scene)
    for _ in range(round(scene.duration / dt)):
        x = x + v * dt
        for k in range(len(x) - 1):
            if x[k + 1] - x[k] <= 2.0 * rod_gas.RADIUS and v[k] > v[k + 1]:
                blow(v, mass, k, 1.0)
        if x[0] <= rod_gas.RADIUS and v[0] < 0:
            v[0] = -v[0]
        if x[-1] >= length - rod_gas.RADIUS and v[-1] > 0:
            v[-1] = -v[-1]
    return recorded(scene, x, v, dt)


@pytest.mark.parametrize(
    "params", [{}, {"n": 1.0}, {"n": 3.0, "room": 3.0}, {"n": 10.0, "v": 7.0}, {"n": 40.0, "room": 8.0}]
)
def test_rod_gas_against_sorted_free_flights(params):
    canonical, scene = made("rod_gas", **params)
    x, v, count = meeting(scene)
    p = scene.params
    place, velocity = rod_gas.rods(p, p["delay"] + p["duration"])
    assert np.allclose(x, place, rtol=0.0, atol=1e-10)
    assert np.allclose(v, velocity, rtol=0.0, atol=1e-10)
    told = [m for m in rod_gas.meetings(p) if m.time <= p["delay"] + p["duration"]]
    assert len(told) == count > 0
    assert failing(canonical, scene, recorded(scene, x, v)) == set()


def test_meetings_say_which_rods_meet_and_how_fast():
    """Between the meetings of a list each rod flies straight, and at each the two it names touch."""
    _, scene = made("rod_gas", n=6.0)
    p, r = scene.params, rod_gas.RADIUS
    length = p["room"] + 12.0 * r
    for m in rod_gas.meetings(p):
        x, _ = rod_gas.rods(p, m.time)
        _, before = rod_gas.rods(p, m.time - 1e-7)
        edges = [-r, *x, length + r]
        assert edges[m.rank + 1] - edges[m.rank] == pytest.approx(2.0 * r, abs=1e-9)
        speeds = [0.0, *before, 0.0]
        assert speeds[m.rank] - speeds[m.rank + 1] == pytest.approx(m.closing, abs=1e-9)


@pytest.mark.parametrize("dt", [1 / 121, 1 / 160, DT, 1 / 960])
@pytest.mark.parametrize("k", range(0, 16, 3))
def test_rod_gas_by_fixed_steps_within_the_bounds(dt, k):
    dt = 3.75 / math.ceil(3.75 / dt)  # whole steps
    canonical, scene = made("rod_gas", **phases(dt)[k])
    assert any(check.bound is not None for check in canonical.checks(scene, dt))
    assert failing(canonical, scene, stepped(scene, dt)) == set()


def test_share_of_the_bound_for_a_late_method():
    """A bound of which nothing is used would see nothing."""
    canonical, used = CATALOGUE["rod_gas"], []
    for params in phases(DT):
        scene = canonical.scene(2, params)
        value, _ = canonical.measure(scene, stepped(scene, DT))["misplaced"]
        (check,) = (c for c in canonical.checks(scene, DT) if c.metric == "misplaced")
        used.append(value / check.bound)
    assert 0.2 < max(used) <= 1.0


def test_steps_that_merge_two_meetings_not_judged():
    canonical, scene = made("rod_gas")
    coarsest = rod_gas.coarsest(scene.params)
    assert all(check.bound is not None for check in canonical.checks(scene, coarsest))
    assert all(check.bound is None for check in canonical.checks(scene, math.nextafter(coarsest, 1.0)))


@pytest.mark.parametrize("size", SIZES)
def test_rod_gas_with_lost_energy_other_masses_or_states(size):
    canonical, scene = made("rod_gas")
    x, v, _ = meeting(scene, e=1.0 - size)
    lossy = failing(canonical, scene, recorded(scene, x, v))
    assert {"wrong_speed", "energy_defect"} <= lossy
    heavier = (*scene.bodies[:3], replace(scene.bodies[3], mass=1.0 + size), *scene.bodies[4:])
    x, v, _ = meeting(replace(scene, bodies=heavier))
    assert "wrong_speed" in failing(canonical, scene, recorded(scene, x, v))
    x, v, _ = meeting(scene)
    assert failing(canonical, scene, recorded(scene, x, v * (1.0 - size))) == {"wrong_speed", "energy_defect"}
    (allowed,) = (c.bound for c in canonical.checks(scene, DT) if c.metric == "misplaced")
    x[1] += allowed * (1.0 + size)
    assert failing(canonical, scene, recorded(scene, x, v)) == {"misplaced"}
    x[1] -= allowed * (1.0 + size)
    off = recorded(scene, x, v)
    off.pose[0, 3, 1] = size
    assert failing(canonical, scene, off) == {"astray"}


def rounded(scene, off, seed):
    """Discs in the plane, not rods: every normal is turned by up to ``off``; how far off the line one gets [m]."""
    draw = np.random.default_rng(seed)
    x, v, _, length = bodies(scene)
    r, n, now, farthest = rod_gas.RADIUS, len(x), 0.0, 0.0
    x, v = np.stack([x, np.zeros(n)], axis=1), np.stack([v, np.zeros(n)], axis=1)
    while now < scene.duration:
        wait, met = scene.duration - now, ()
        for k in range(n - 1):
            apart, along = x[k + 1] - x[k], v[k + 1] - v[k]
            a, b, c = along @ along, apart @ along, apart @ apart - 4.0 * r * r
            if b < 0.0 and b * b > a * c and c / (-b + math.sqrt(b * b - a * c)) < wait:
                wait, met = c / (-b + math.sqrt(b * b - a * c)), (k, k + 1)
        for k, wall in ((0, r), (n - 1, length - r)):
            if (v[k, 0] > 0.0) == (k > 0) and (wall - x[k, 0]) / v[k, 0] < wait:
                wait, met = (wall - x[k, 0]) / v[k, 0], (k,)
        x, now = x + v * wait, now + wait
        farthest = max(farthest, float(np.abs(x[:, 1]).max()))
        if not met:
            break
        normal = np.array([1.0, 0.0]) if len(met) == 1 else (x[met[1]] - x[met[0]]) / (2.0 * r)
        turn = draw.choice((-off, off))
        normal = np.array([normal[0] - turn * normal[1], normal[1] + turn * normal[0]])
        if len(met) == 1:
            v[met[0]] -= 2.0 * (v[met[0]] @ normal) * normal
        else:
            swapped = ((v[met[0]] - v[met[1]]) @ normal) * normal
            v[met[0]] -= swapped
            v[met[1]] += swapped
    return farthest


@pytest.mark.parametrize("params", [{}, {"room": 10.0, "duration": 7.5}, {"n": 10.0, "room": 20.0, "duration": 2.5}])
def test_spread_of_round_ends_by_rounded_normals(params, monkeypatch):
    """With roundings a million times as coarse, so that nothing else is as large."""
    _, scene = made("rod_gas", **params)
    p = scene.params
    monkeypatch.setattr(rod_gas, "NORMAL", 1e6 * rod_gas.NORMAL)
    allowed = rod_gas.strayed(p, [m for m in rod_gas.meetings(p) if m.time < p["delay"] + p["duration"]])
    found = [rounded(scene, rod_gas.NORMAL, seed) for seed in range(40)]
    assert 0.1 * allowed < max(found) <= allowed * (1.0 + 1e-9)


@pytest.mark.parametrize("missed", [1, 5, 13])
def test_missed_meeting_fails_despite_kept_energy(missed):
    canonical, scene = made("rod_gas")
    x, v, _ = meeting(scene, missed=missed)
    found = failing(canonical, scene, recorded(scene, x, v))
    assert "wrong_speed" in found and "energy_defect" not in found
