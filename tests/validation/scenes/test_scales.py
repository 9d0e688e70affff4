"""One scene in several units: motions by Newton's laws pass in all of them, and faults fail by the same share."""

import math

import numpy as np
import pytest
from planted import failing, made, still
from scipy.integrate import solve_ivp

from adapters.trajectory import Trajectory
from validation.scenes.scales import DROP, MU, RADIUS, SPEED

DT = 1 / 240
SIZES = [0.1, 0.01, 0.001]
LENGTHS = [1e-6, 1e-3, 1.0, 1e3]


def moved(scene, dt=DT, mu=MU, e=0.5, threshold=0.0, sunk=0.0, late=0.0):
    """Ball and box by DOP853, in metres; rebounds slower than ``threshold`` [m/s] are dropped.

    ``sunk`` [m]: how deep the box is let in; ``late``: of the impact, in steps.
    """
    length = scene.params["length"]
    g, up = -scene.gravity[-1], scene.dimension - 1
    times = np.arange(round(scene.duration / dt) + 1) * dt

    def landed(t, y):
        return y[0]

    landed.terminal, landed.direction = True, -1
    height, speed = np.zeros(len(times)), np.zeros(len(times))
    start, since = [DROP * length, 0.0], 0.0
    for _ in range(30):
        found = solve_ivp(
            lambda t, y: [y[1], -g], (since, times[-1] + dt), start, "DOP853", events=landed, dense_output=True,
            rtol=1e-12, atol=1e-13 * length,
        )  # fmt: skip
        here = (times >= since) & (times <= found.t[-1] + late * dt)
        height[here], speed[here] = found.sol(times[here])
        if found.t[-1] >= times[-1] or (back := e * abs(found.y[1, -1])) < max(threshold, 4.0 * g * dt):
            break
        depth = late * dt * found.y[1, -1]
        since, start = found.t[-1] + late * dt, [depth + 1e-12 * length, back]
    stop = SPEED * length / (mu * g)
    t = np.minimum(times, stop)
    n = len(times)
    pose, twist = still(scene, n)
    pose[:, 1, up], twist[:, 1, up] = RADIUS * length + height, speed
    pose[:, 2, 0], twist[:, 2, 0] = SPEED * length * t - 0.5 * mu * g * t * t, SPEED * length - mu * g * t
    pose[1:, 2, up] -= sunk
    return Trajectory(times, pose, twist, None, dt, "completed")


@pytest.mark.parametrize("late", [0.0, 0.5])
@pytest.mark.parametrize("length", LENGTHS)
@pytest.mark.parametrize("dimension", [2, 3])
def test_newton_s_laws_in_every_unit(length, late, dimension):
    canonical, scene = made("scales", dimension, length=length)
    assert failing(canonical, scene, moved(scene, late=late)) == set()
    truth = canonical.exact(scene)
    assert truth == pytest.approx(canonical.exact(made("scales", dimension, length=1.0)[1]), rel=1e-12)
    found = canonical.measure(scene, moved(scene))
    assert [found[name][0] for name in truth] == pytest.approx(list(truth.values()), abs=1e-5)


def test_bounds_are_the_same_in_every_unit():
    canonical, metres = made("scales", length=1.0)
    there = {check.metric: check.bound for check in canonical.checks(metres, DT)}
    for length in LENGTHS:
        found = {check.metric: check.bound for check in canonical.checks(made("scales", length=length)[1], DT)}
        assert found == pytest.approx(there, rel=1e-9)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("length", [1e-3, 1e3])
def test_scales_with_wrong_friction_restitution_or_sinking(length, size):
    canonical, scene = made("scales", length=length)
    dt = DT if size > 0.05 else 1 / 1920
    wrong = failing(canonical, scene, moved(scene, dt, mu=MU * (1.0 - size)))
    assert "braking" in wrong and (size < 0.05 or "stopping_distance" in wrong)
    assert size < 0.005 or "apex" in failing(canonical, scene, moved(scene, dt, e=0.5 * (1.0 - 2.0 * size)))
    assert failing(canonical, scene, moved(scene, sunk=size * length)) == {"hop"}
    canonical, spatial = made("scales", 3, length=length)
    bent = moved(spatial)
    bent.pose[-1, 2, 1] += size * length
    assert failing(canonical, spatial, bent) == {"astray"}


def test_absolute_lengths_seen_at_large_scales():
    """A threshold of 0.2 m/s and a slop of 1 mm: nothing for a mountain, all of a pebble."""
    canonical, pebble = made("scales", length=1e-3)
    assert failing(canonical, pebble, moved(pebble, threshold=0.2)) == {"apex"}
    assert failing(canonical, pebble, moved(pebble, sunk=1e-3)) == {"hop"}
    canonical, mountain = made("scales", length=1e3)
    assert failing(canonical, mountain, moved(mountain, threshold=0.2, sunk=1e-3)) == set()
    assert math.isclose(pebble.gravity[1], -9.81e-3) and math.isclose(mountain.gravity[1], -9810.0)
