"""Bodies that start inside each other: corrections of places pass, corrections by speed are seen in any size."""

import numpy as np
import pytest
from planted import failing, made, still

from adapters.reference.start import overlap_at_the_start
from adapters.trajectory import Trajectory
from validation.catalogue import CATALOGUE

DT, G = 1 / 240, 9.81
SIZES = (0.1, 0.01, 0.001)


def parting(scene, share=0.2, kept=0.0, dt=DT, pull=0.0):
    """Two balls of which each step takes a share of the overlap out; a share ``kept`` of that speed stays."""
    n, d = round(scene.duration / dt) + 1, scene.dimension
    masses = np.array([body.mass for body in scene.bodies])
    pose = np.array([[body.pose for body in scene.bodies]] * n)
    twist = np.array([[body.twist for body in scene.bodies]] * n)
    x, v = pose[0, :, 0].copy(), np.zeros(2)
    away = np.array([-1.0, 1.0]) * masses[::-1] / masses.sum()
    for k in range(1, n):
        depth = max(0.0, 1.0 - (x[1] - x[0]))
        v += kept * share * depth / dt * away
        x += v * dt + (1.0 - kept) * share * depth * away - pull * dt * away
        pose[k, :, 0], twist[k, :, 0] = x, v
        pose[k, :, d - 1] += twist[k, :, d - 1] * k * dt
    return Trajectory(np.arange(n) * dt, pose, twist, None, dt, "completed")


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("params", [{}, {"depth": 0.01, "ratio": 100.0}])
@pytest.mark.parametrize("share", [0.0, 0.2, 1.0])
def test_corrected_positions_at_any_rate(params, share, dimension):
    canonical, scene = made("overlap", dimension, **params)
    trajectory = parting(scene, share)
    assert failing(canonical, scene, trajectory) == set()
    left = canonical.measure(scene, trajectory)["left"][0]
    assert left == pytest.approx(1.0) if share == 0.0 else left < 1e-9


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("params", [{}, {"depth": 0.01, "ratio": 100.0}])
def test_overlap_with_throw_growth_or_moved_centre(params, size):
    canonical, scene = made("overlap", **params)
    assert failing(canonical, scene, parting(scene, 0.2, kept=size)) == {"thrown"}
    assert failing(canonical, scene, parting(scene, 0.0, pull=size)) == {"grown"}
    moved = parting(scene)
    moved.pose[:, :, 0] += size * moved.t[:, None]
    assert failing(canonical, scene, moved) == {"centre_moved"}


def test_throw_by_a_share_of_the_overlap():
    """One step takes beta depth/dt: the number that the docstring names."""
    canonical, scene = made("overlap")
    for dt in (1 / 60, DT):
        thrown = canonical.measure(scene, parting(scene, 0.08, kept=1.0, dt=dt))["thrown"][0]
        assert thrown >= 0.08 * 0.25 / dt * (1.0 - 1e-12)
        value, _ = canonical.primary.error(scene, dt, {"thrown": (thrown, "")})
        assert value == pytest.approx(thrown * dt / 0.25)


def coming_up(scene, share=0.2, kept=0.0, dt=DT):
    """A box that is pushed out of the floor; a share ``kept`` of the correction stays as speed, and it falls back."""
    n = round(scene.duration / dt) + 1
    pose, twist = still(scene, n)
    y, v = pose[0, 1, 1], 0.0
    for k in range(1, n):
        depth = 0.5 - y
        v = v - G * dt if depth < 0.0 else max(v - G * dt, kept * share * depth / dt)
        y += v * dt + (1.0 - kept) * share * max(0.0, depth)
        pose[k, 1, 1], twist[k, 1, 1] = y, v
    return Trajectory(np.arange(n) * dt, pose, twist, None, dt, "completed")


@pytest.mark.parametrize("dt", [1 / 60, DT, 1 / 960])
@pytest.mark.parametrize("depth", [0.01, 0.1, 0.3])
@pytest.mark.parametrize("share", [0.0, 0.2, 1.0])
def test_box_set_up_on_the_floor(depth, share, dt):
    canonical, scene = made("position_correction", depth=depth)
    assert failing(canonical, scene, coming_up(scene, share, dt=dt)) == set()


@pytest.mark.parametrize("size", SIZES)
def test_thrown_sinking_or_slipping_box(size):
    canonical, scene = made("position_correction")
    for axis, sign, metric in ((1, 1.0, "launched"), (1, -1.0, "sunk"), (0, 1.0, "drift")):
        spoilt = coming_up(scene, 1.0 if sign > 0.0 else 0.0)
        spoilt.pose[-1, 1, axis] += sign * size
        assert failing(canonical, scene, spoilt) == {metric}


def test_height_of_a_box_thrown_by_a_correction():
    """v = beta depth/dt rises by v^2/(2 g) less what it has climbed within the floor."""
    canonical, scene = made("position_correction")
    trajectory = coming_up(scene, 0.2, kept=1.0)
    assert failing(canonical, scene, trajectory) == {"launched"}
    height = canonical.measure(scene, trajectory)["launched"][0]
    assert 0.5 * (0.2 * 0.1 / DT) ** 2 / (2.0 * G) < height < 2.0 * (0.2 * 0.1 / DT) ** 2 / (2.0 * G)


@pytest.mark.parametrize(
    ("name", "params"), [("overlap", {}), ("position_correction", {}), ("overlap", {"depth": 1e-5})]
)
def test_reference_solver_not_asked_without_a_solution(name, params):
    _, scene = made(name, **params)
    assert "overlap by" in overlap_at_the_start(scene)


@pytest.mark.parametrize("name", [name for name in CATALOGUE if name not in ("overlap", "position_correction")])
def test_no_other_scene_starts_with_an_overlap(name):
    canonical = CATALOGUE[name]
    for dimension in canonical.dimensions:
        for variation in canonical.variations("standard"):
            assert overlap_at_the_start(canonical.scene(dimension, variation.params)) is None or not variation.runs_in(
                dimension
            )


def test_thrown_body_by_speed_and_not_by_spin():
    canonical, scene = made("overlap")
    trajectory = parting(scene)
    before = canonical.measure(scene, trajectory)["thrown"][0]
    trajectory.twist[:, 1, 2] = 50.0
    assert canonical.measure(scene, trajectory)["thrown"] == (before, "")
